//! Adjusts the body and the keyframes of a plain object together, by its outlines alone, beside the
//! tracker: only many views together tell a guessed shape from a turn.

mod fit;
mod grow;
mod hypotheses;
mod mirror;
mod residuals;
mod shape;

use nalgebra::Matrix6;

use self::fit::{Scene, State};
use self::hypotheses::Adjusted;
use self::residuals::View;
pub(in crate::track) use self::shape::Part;
use super::worker::Job;
use crate::camera::Observation;
use crate::pose::Pose;
use crate::shape::Body;
use crate::track::estimate::Notice;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::verify::Quality;
use crate::track::target::Target;
use crate::track::target::contour_offsets::ContourOffsets;
use crate::track::target::keyframes::{Keyframe, object_from_camera};
use crate::track::target::look::Look;
use crate::track::target::solid::Solid;
use crate::track::tracker::Tracker;

/// Observations after which a result is applied: the farther the object has turned meanwhile, the less
/// of it is worth.
const DELAY: usize = 3;
/// Least number of cameras and of keyframes, and most keyframes at once.
const CAMERAS: usize = 2;
const LEAST_KEYFRAMES: usize = 2;
const MOST_KEYFRAMES: usize = 9;
/// Number of keyframes up to which a misfit contradicts what those before told.
const FEW_KEYFRAMES: usize = 3;
/// Share of what should be visible, and agreement of the outline with the boundary, from which on an
/// outline shows the pose.
const VISIBLE: f64 = 0.65;
const FITS: f64 = 0.6;
/// Angle from the nearest adjusted keyframe up to which its orientation is known, in radians, and the
/// standard deviation of the rotation from there per radian.
const NEAR_RAD: f64 = 1.0;
const AWAY: f64 = 0.2;
/// Lever of an image's outline from which on it shows the orientation.
const LEVER: f64 = 0.03;
/// Standard deviation of the orientation by the outline of one image, in radians about its least certain
/// axis, up to which it shows the pose.
const CERTAIN_RAD: f64 = 0.2;
/// Adjustments in a row that must be sure for what they tell to be known: a single one may be by chance.
const SURE_IN_A_ROW: usize = 2;
/// Rotation from which on a correction is reported, in radians.
const REPORTED_RAD: f64 = 0.01;

/// An adjustment that is being computed.
#[derive(Debug, Clone)]
pub(in crate::track) struct Outlining {
    job: Job<Option<Adjusted>>,
    /// Numbers of its keyframes.
    keyframes: Vec<usize>,
}

/// What outlines tell of body and keyframes.
#[derive(Debug, Clone, Default)]
pub(in crate::track) struct Outlined {
    /// The ellipsoids of the first look, and what was known before of those that are adjusted.
    first: Vec<Part>,
    prior: Vec<Part>,
    /// Whether the body was adjusted, and what few keyframes told was not contradicted by the next.
    is_adjusted: bool,
    /// The cost per view at which one more ellipsoid was not worth it, or none.
    in_vain: Option<f64>,
    /// Adjustments in a row that were sure, and whether they were as many as it takes before.
    sure: usize,
    was_sure: bool,
    /// The adjusted keyframes, each with the covariance of its pose, if they are sure.
    known: Vec<(usize, Matrix6<f64>)>,
}

impl Outlined {
    /// Returns whether the body was adjusted to outlines from several sides.
    pub(in crate::track) fn is_adjusted(&self) -> bool {
        self.is_adjusted
    }
}

impl Tracker {
    /// Returns whether the outlines of an object are adjusted: one without print that was followed
    /// ever since its pose was given, and whose shape is a guess.
    pub(in crate::track) fn is_outlined(&self) -> bool {
        self.settings.adjust_outlines
            && self.settings.region
            && !self.settings.known_shape
            && self.frame.cameras.len() >= CAMERAS
            && (self.is_plain() || self.is_smooth())
            && self.trust.is_continuous()
    }

    /// Returns whether the outlines told the orientation of an object, whose outline is seen now: once it
    /// has turned, none of the rims and highlights is left that were learned as points.
    pub(in crate::track) fn is_known_by_outline(&self, quality: &Quality) -> bool {
        self.target.outlined.was_sure && self.is_outlined() && shows_outline(quality)
    }

    /// Returns where each camera sees the boundary of an object, if all of it is seen.
    pub(in crate::track) fn looks(
        &self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) -> Vec<Option<Look>> {
        let whole = self.settings.adjust_outlines
            && shows_outline(&hypothesis.quality)
            && self.frame.cameras.len() >= CAMERAS;
        let windows = self.frame.windows.iter().zip(&observation.images);
        let found = windows.map(|(window, image)| {
            let image = image.as_ref().filter(|_| whole && window.is_open())?;
            let body = (&self.target.solid, &hypothesis.pose);
            Look::find((window, image), body, &self.target.colors)
        });
        found.collect()
    }

    /// Starts to adjust body and keyframes, unless that is going on.
    pub(in crate::track) fn begin_outlining(&mut self) {
        if self.outlining.is_some() || !self.is_outlined() {
            return;
        }
        let body: Vec<_> = self.target.body.ellipsoids().iter().map(Part::of).collect();
        let outlined = &mut self.target.outlined;
        if outlined.prior.len() != body.len() {
            (outlined.first, outlined.prior) = (body.clone(), body.clone());
        }
        let prior = outlined.prior.clone();
        let first = outlined.known.is_empty().then(|| outlined.first.clone());
        let in_vain = outlined.in_vain;
        let Some((keyframes, scene)) = self.target.outlines(prior) else { return };
        let job = Job::new(DELAY, self.evolving.clone(), move || {
            scene.clone().adjusted(&body, first.as_deref(), in_vain)
        });
        self.outlining = Some(Outlining { job, keyframes });
    }

    /// Applies an adjustment, once it is due.
    pub(in crate::track) fn take_outlined(&mut self) {
        let due = self.outlining.take_if(|one| one.job.is_due());
        let Some(Outlining { job, keyframes }) = due else { return };
        let Some(Some(adjusted)) = job.result() else { return };
        if !self.is_outlined() {
            self.target.outlined = Outlined::default();
            return;
        }
        let Some(newest) = self.target.take_outlined(&adjusted, &keyframes) else { return };
        let off = newest.log();
        self.correct_motion(&off);
        self.has_evolved = true;
        let turned = off.fixed_rows::<3>(3).norm();
        if turned > REPORTED_RAD {
            self.jitter.pause();
            self.frame.notices.push(Notice::Adjusted { degrees: turned.to_degrees() });
        }
    }

    /// Returns the covariance of a pose near keyframes whose outlines tell the turn.
    pub(in crate::track) fn outlined_covariance(
        &self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) -> Option<Matrix6<f64>> {
        let shows = self.is_outlined()
            && shows_outline(&hypothesis.quality)
            && self.is_turn_certain(hypothesis, (LEVER, CERTAIN_RAD));
        if !shows {
            return None;
        }
        let here = object_from_camera(observation, &hypothesis.pose);
        let near = self.target.outlined.known.iter().filter_map(|(number, covariance)| {
            let at = self.target.keyframes.place(*number)?;
            let away = self.target.keyframes.all[at].object_from_camera.angle_to(&here);
            (away < NEAR_RAD).then_some((away, covariance))
        });
        let (away, covariance) = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let parts: Vec<_> = self.target.body.ellipsoids().iter().map(Part::of).collect();
        let at = (&hypothesis.pose, self.target.solid.radius);
        let looks = self.looks(observation, hypothesis);
        let views = self.frame.windows.iter().zip(looks).filter_map(|(window, look)| {
            Some(View { keyframe: 0, world: window.projection(&Pose::identity())?, look: look? })
        });
        let views: Vec<_> = views.collect();
        let lever = self.lever(hypothesis);
        let fits = views.len() >= CAMERAS && views.iter().all(|one| one.is_sure(&parts, at, lever));
        if !fits {
            return None;
        }
        let mut covariance = *covariance;
        for axis in 3..6 {
            covariance[(axis, axis)] += (AWAY * away).powi(2);
        }
        Some(covariance)
    }
}

/// Returns whether an image shows the outline of the body at a pose.
pub(in crate::track) fn shows_outline(quality: &Quality) -> bool {
    quality.visible >= VISIBLE && quality.outline >= FITS
}

/// Returns the angle between the views of two keyframes, in radians.
fn apart(one: &Keyframe, other: &Keyframe) -> f64 {
    one.object_from_camera.angle_to(&other.object_from_camera)
}

impl Target {
    /// Returns the problem of adjusting, and the numbers of its keyframes; none if they are too few,
    /// or the newest was not seen whole.
    fn outlines(&self, parts: Vec<Part>) -> Option<(Vec<usize>, Scene)> {
        let all = &self.keyframes.all;
        let is_whole = |one: &&Keyframe| one.looks.iter().flatten().count() >= CAMERAS;
        let mut chosen: Vec<_> = all.iter().filter(is_whole).collect();
        let fixed = chosen.first().is_some_and(|one| one.is_given);
        if chosen.len() < LEAST_KEYFRAMES || !fixed || !all.last().is_some_and(|one| is_whole(&one))
        {
            return None;
        }
        while chosen.len() > MOST_KEYFRAMES {
            let nearest = |at: usize| {
                let others = chosen.iter().enumerate().filter(|(other, _)| *other != at);
                others.map(|(_, one)| apart(one, chosen[at])).fold(f64::INFINITY, f64::min)
            };
            let inner = 1..chosen.len() - 1;
            let least = inner.min_by(|&a, &b| nearest(a).total_cmp(&nearest(b)))?;
            chosen.remove(least);
        }
        let views = chosen.iter().enumerate().flat_map(|(keyframe, one)| {
            one.cameras.iter().zip(&one.looks).filter_map(move |(world, look)| {
                Some(View { keyframe, world: (*world)?, look: look.clone()? })
            })
        });
        let poses = chosen.iter().map(|one| one.world_from_object).collect();
        let (views, prior) = (views.collect(), State { poses, parts });
        let numbers = chosen.iter().map(|one| one.number).collect();
        let radius = self.solid.radius;
        Some((numbers, Scene { views, prior, radius, is_rigid: false, prior_weight: 1.0 }))
    }

    /// Applies an adjustment to everything; returns the motion of the newest keyframe.
    fn take_outlined(&mut self, adjusted: &Adjusted, numbers: &[usize]) -> Option<Pose> {
        let Adjusted { state, prior, in_vain, covariances, fits_before, fits, is_sure } = adjusted;
        self.outlined.in_vain = *in_vain;
        self.outlined.sure = if *fits && *is_sure { self.outlined.sure + 1 } else { 0 };
        if !fits {
            self.outlined.is_adjusted &= numbers.len() > FEW_KEYFRAMES;
            // Its pose is wrong, and would make the others so.
            let newest = numbers.last().filter(|_| *fits_before);
            if let Some(at) = newest.and_then(|number| self.keyframes.place(*number)) {
                self.keyframes.all[at].looks.clear();
            }
            return None;
        }
        let ellipsoids = state.parts.iter().enumerate().map(|(at, part)| part.ellipsoid(at));
        let ellipsoids: Option<Vec<_>> = ellipsoids.collect();
        let body = Body::new(self.body.world_from_object(), ellipsoids?).ok()?;
        let moves: Vec<_> = numbers
            .iter()
            .zip(&state.poses)
            .filter_map(|(number, pose)| {
                Some((*number, self.keyframes.pose(*number)?.inverse() * *pose))
            })
            .collect();
        let (_, last) = *moves.last()?;
        self.move_keyframes(&moves);
        (self.solid, self.body) = (Solid::new(&body), body);
        self.offsets = ContourOffsets::unknown(self.body.ellipsoids().len());
        self.outlined.prior.clone_from(prior);
        self.outlined.is_adjusted = true;
        let known = numbers.iter().copied().zip(covariances.iter().copied());
        let are_sure = self.outlined.sure >= SURE_IN_A_ROW;
        self.outlined.was_sure |= are_sure;
        self.outlined.known = if are_sure { known.collect() } else { Vec::new() };
        Some(last)
    }

    /// Moves keyframes, and all that belongs to them, by motions in the object's frame; others move
    /// with the last one before them.
    fn move_keyframes(&mut self, moves: &[(usize, Pose)]) {
        let by = |number: usize| {
            let at = moves.partition_point(|(one, _)| *one <= number);
            moves[..at].last().map_or_else(Pose::identity, |(_, by)| *by)
        };
        self.keyframes.move_by(by);
        self.sides.move_by(by);
        self.ranges.move_by(by);
        for known in &mut self.points.features {
            if let Some(keyframe) = known.origin.keyframe {
                known.move_by(&by(keyframe).inverse());
            }
        }
    }
}
