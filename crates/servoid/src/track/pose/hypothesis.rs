use nalgebra::Vector3;

use super::align::align;
use super::refine::{Evaluated, Normal, evaluate_at, refine, toward};
use super::search::{Deviation, Probes, Scorer};
use super::verify::{Quality, verify};
use crate::camera::{Observation, Pyramid};
use crate::pose::Pose;
use crate::track::TrackError;
use crate::track::clock::Clock;
use crate::track::estimate::Status;
use crate::track::inputs::Inputs;
use crate::track::motion::Prior;
use crate::track::tracker::Tracker;

/// The coarsest resolution.
pub(crate) const COARSEST: usize = Pyramid::LEVELS - 1;
/// Pixels by which the object may be off for the finest resolution, and the next, to find it.
const FORESEEN_PX: [f64; COARSEST] = [0.8, 3.0];

/// Motion in pixels from image to image above which an object may be blurred.
const BLURRED_PX: f64 = 3.0;

/// A refined pose with its quality.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hypothesis {
    pub(crate) pose: Pose,
    pub(crate) normal: Normal,
    pub(crate) quality: Quality,
    /// Direction to a camera, in the object's frame.
    pub(crate) toward: Vector3<f64>,
}

impl Hypothesis {
    fn new(inputs: &Inputs<'_>, found: &Evaluated, quality: Quality) -> Self {
        let toward = toward(inputs, &found.pose);
        Self { pose: found.pose, normal: found.normal, quality, toward }
    }

    /// Makes a pose for which there is no evidence.
    pub(crate) fn nothing(pose: Pose, radius: f64) -> Self {
        let quality = Quality {
            visible: 0.0,
            share: 0.0,
            support: f64::NEG_INFINITY,
            recognised: 0.0,
            textured: 0.0,
            printed: 0.0,
            fine: 0.0,
            turning: 0.0,
            ratio: 0.0,
            outline: 0.0,
        };
        Self { pose, normal: Normal::new(radius), quality, toward: Vector3::z() }
    }
}

impl Tracker {
    /// Opens windows around the body at a pose; returns `false` if no camera sees it.
    pub(crate) fn open_windows(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        margin: f64,
    ) -> bool {
        let place = (pose, &self.target.solid, margin);
        let colors = self.settings.region.then_some(&self.target.colors);
        self.frame.open_windows(observation, place, colors)
    }

    /// Opens windows on the whole images.
    pub(crate) fn open_all_over(&mut self, observation: &Observation<'_>) {
        // The background far from the object's last position must be known, too.
        for image in self.frame.images(observation) {
            self.target.colors.count_anywhere(&image);
        }
        self.target.colors.take_anywhere();
        let colors = self.settings.region.then_some(&self.target.colors);
        self.frame.open_all_over(observation, colors);
    }

    /// Selects the surface points that are compared from a pose.
    pub(crate) fn points_in_view(&mut self, pose: &Pose) {
        let most = if self.settings.surface { self.settings.points } else { 0 };
        self.target.points.in_view(
            &self.frame.windows,
            pose,
            &self.target.solid,
            most,
            (&mut self.workspace.rims, &mut self.workspace.visible, &mut self.workspace.in_view),
        );
    }

    /// Returns the assumed change of the motion from image to image, in metres and radians.
    pub(crate) fn process_noise(&self) -> Deviation {
        let (across, turned) = self.search_range();
        (across / 3.0, turned / 3.0)
    }

    /// Returns how far the object may be from its predicted pose.
    pub(crate) fn search_range(&self) -> Deviation {
        let radius = self.target.solid.radius;
        let across = (3.0 * self.innovation.0).clamp(0.02 * radius, 0.5 * radius);
        (across, (3.0 * self.innovation.1).clamp(0.02, 0.5))
    }

    /// Selects the resolution from which a pose is refined, by the accuracy of its prediction.
    fn coarsest(&self, expected: &Pose) -> usize {
        let off_px = self.off_px(expected);
        FORESEEN_PX.iter().position(|&most| off_px < most).unwrap_or(COARSEST)
    }

    /// Searches for the object around its predicted pose; returns the best pose and the number of
    /// poses scored.
    pub(in crate::track) fn search_around(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        clock: &Clock,
    ) -> Result<(Pose, usize), TrackError> {
        self.points_in_view(expected);
        let (search_range, last, area) =
            (self.search_range(), self.motion.last(), self.area(expected));
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let scorer = Scorer { inputs, probes: Probes::InView(&self.workspace.in_view), area };
        let (most, budget) = (self.settings.generations, self.settings.budget_s);
        let go_on = |bred: usize| bred < most && !clock.is_over(budget);
        let found = self.search.run(&scorer, (expected, &last), search_range, go_on)?;
        Ok((found.pose, found.evaluations))
    }

    /// Decides whether the object may move so fast that its image is blurred.
    pub(crate) fn predict_blur(&mut self, expected: &Pose) {
        // A pose that jumped must not be verified by coarse resolutions alone, unless all else is
        // lost.
        self.frame.is_blurred = self.target.relief.is_open
            && self.status == Status::Tracking
            && self.motion_px(expected) > BLURRED_PX;
    }

    /// Returns by how many pixels the object may move from its last pose.
    fn motion_px(&self, expected: &Pose) -> f64 {
        let way = (self.motion.last().inverse() * *expected).log();
        let (across, turned) = (way.fixed_rows::<3>(0).norm(), way.fixed_rows::<3>(3).norm());
        let path = across + turned * self.target.solid.radius;
        path * self.frame.px_per_meter(expected) + self.off_px(expected)
    }

    /// Returns by how many pixels the object may be off its predicted pose.
    fn off_px(&self, expected: &Pose) -> f64 {
        let off = self.innovation.0 + self.innovation.1 * self.target.solid.radius;
        off * self.frame.px_per_meter(expected)
    }

    /// Returns the number of pixels inside the body's outlines at a pose.
    pub(crate) fn area(&self, pose: &Pose) -> f64 {
        self.frame.area(pose, &self.target.solid)
    }

    /// Refines a guess. If the result is doubtful, refines it from other starts and resolutions as
    /// well, and keeps the best supported pose.
    pub(crate) fn refined(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        guess: &Pose,
    ) -> Hypothesis {
        let prior = self.prior_if_followed(observation);
        let prior = prior.as_ref();
        let mut hypothesis = self.hypothesis(observation, guess, self.coarsest(expected), prior);
        if self.needs_retry(&hypothesis.quality) {
            // Something that hides much of the object pulls the search away, and an object that
            // jumps is not where it was predicted; the visible part of its surface shows where it
            // is.
            self.points_in_view(expected);
            let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
            let aligned = align(&inputs, expected, &self.workspace.in_view);
            let others = [(Some(*guess), COARSEST), (aligned, 1), (Some(*expected), 0)];
            for (start, coarsest) in others {
                let Some(start) = start else { continue };
                let other = self.hypothesis(observation, &start, coarsest, prior);
                if other.quality.support > hypothesis.quality.support {
                    hypothesis = other;
                }
            }
            // The matches left in the workspace must belong to the pose that is kept.
            hypothesis = self.evaluate(observation, &hypothesis.pose, prior);
        }
        self.penalize_doubtful(expected, &mut hypothesis);
        if self.has_jumped(expected, &hypothesis.pose) && self.is_other(&hypothesis.pose) {
            self.penalize(&mut hypothesis);
        }
        hypothesis
    }

    /// Returns the prior of the pose of an object that is followed.
    pub(in crate::track) fn prior_if_followed(
        &self,
        observation: &Observation<'_>,
    ) -> Option<Prior> {
        let followed = self.status == Status::Tracking;
        followed.then(|| self.motion.prior(observation.time_s, self.process_noise()))
    }

    /// Refines a pose, starting at the given coarsest resolution, and verifies it.
    pub(in crate::track) fn hypothesis(
        &mut self,
        observation: &Observation<'_>,
        start: &Pose,
        coarsest: usize,
        prior: Option<&Prior>,
    ) -> Hypothesis {
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let found = refine(&inputs, (*start, coarsest), prior, &mut self.workspace);
        Hypothesis::new(&inputs, &found, verify(&inputs, &found, &mut self.workspace))
    }

    /// Verifies a pose without refining it.
    pub(in crate::track) fn evaluate(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        prior: Option<&Prior>,
    ) -> Hypothesis {
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let found = evaluate_at(&inputs, *pose, prior, &mut self.workspace);
        Hypothesis::new(&inputs, &found, verify(&inputs, &found, &mut self.workspace))
    }
}
