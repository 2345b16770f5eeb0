//! How an object may have turned: the outlines fit several turns, of which the tracker follows one.

use nalgebra::{Matrix6, SymmetricEigen};

use super::fit::{Fitted, Scene, State};
use super::mirror::unlike_mirrored;
use super::residuals::View;
use super::shape::Part;
use crate::pose::{Pose, Twist};
use crate::track::pose::weakest_turn::WeakestTurn;

/// A state that fits best, and what it is worth.
#[derive(Debug, Clone)]
pub(crate) struct Adjusted {
    pub(crate) state: State,
    /// What is known before of its ellipsoids.
    pub(crate) prior: Vec<Part>,
    /// The cost per view at which one more ellipsoid was not worth it, or none.
    pub(crate) in_vain: Option<f64>,
    /// Of each keyframe.
    pub(crate) covariances: Vec<Matrix6<f64>>,
    /// Whether all fits but the newest keyframe.
    pub(crate) fits_before: bool,
    /// Whether it fits, and nothing else fits nearly as well; and whether it does so very well.
    pub(crate) fits: bool,
    pub(crate) is_sure: bool,
}

/// Turns that are tried, as multiples of the tracked one: of the newest keyframe, from the one before
/// it and from the first; and of all of them, by the body of the first look, while there are few and no
/// adjustment was sure.
const NEWEST: [f64; 4] = [1.0, -1.0, 0.0, 2.0];
const ALL: [f64; 2] = [-1.0, 0.3];
const MIRRORED: f64 = -1.0;
const FEW: usize = 8;
/// Steps of a first fit, and the number of turns of the newest keyframe that are fitted with all else.
const STEPS: usize = 12;
const FITTED: usize = 2;
/// Weight of what is known before in the last fit, others with which it is compared, and their steps.
const FREE: f64 = 0.03;
const LESS_FREE: [f64; 2] = [0.1, 0.3];
const FREE_STEPS: usize = 40;
/// Largest misfit of all views on average, in pixels, that is the noise of their boundaries.
const NOISE_PX: f64 = 0.25;
/// Largest change of the newest orientation by these weights, in radians, for covariances to be used.
const HANGS_RAD: f64 = 0.1;
/// Angle, in radians, from which on another solution is a rival, and the least difference of their
/// costs.
const RIVAL_RAD: f64 = 0.17;
const MARGIN: f64 = 15.0;
/// Largest misfit of all views on average, and of the newest keyframe's, in radii, and largest
/// standard deviation of the newest orientation about any axis, in radians, for an adjustment to be
/// applied, and for its covariances to be used; and the least number of keyframes for that.
const FITS: (f64, f64, f64) = (0.008, 0.011, 0.25);
const SURE: (f64, f64, f64) = (0.0055, 0.007, 0.2);
const LEAST_SURE: usize = 3;
/// Least lever of the outlines of all keyframes together for the same; and how far the boundary in each
/// camera is at least from its mirror image in most of them, in radii and in pixels: a body of revolution
/// is its own one, and no outline tells its spin, whatever the lever of a guess.
const LEVER: f64 = 0.025;
const UNEVEN: (f64, f64) = (0.008, 1.0);
/// Largest misfit of an image, in radii, for the covariance of a keyframe to be that of its pose; and
/// largest rotation, in radians, that would move its outline as far.
const IMAGE: (f64, f64) = (0.015, 0.25);
/// Factor of the standard deviations per pixel of misfit, since errors of the body are correlated
/// between the views; and what counts as misfit where there is none, in pixels.
const CORRELATED: f64 = 3.5;
const LEAST_MISFIT_PX: f64 = 0.12;

impl View {
    /// Returns whether a body at a pose fits so well that its orientation there is that of the
    /// keyframes; `radius` is that of the body, and `lever` that of its outline.
    pub(super) fn is_sure(&self, parts: &[Part], (pose, radius): (&Pose, f64), lever: f64) -> bool {
        let state = State { poses: vec![*pose], parts: parts.to_vec() };
        let views = vec![Self { keyframe: 0, ..self.clone() }];
        let scene =
            Scene { views, prior: state.clone(), radius, is_rigid: true, prior_weight: 1.0 };
        let found = scene.misfits(&state).zip(scene.radius_px(&state));
        let most = IMAGE.0.min(IMAGE.1 * lever);
        found.is_some_and(|(misfits, radius_px)| misfits.iter().all(|one| *one < most * radius_px))
    }
}

impl Scene {
    /// Fits body and keyframes by all turns that are tried, and returns the best; `body` is that of
    /// the tracker, which may have been adjusted before, and `first` the one of the first look, where
    /// all may be turned otherwise; `in_vain` is as the last adjustment left it.
    pub(crate) fn adjusted(
        mut self,
        body: &[Part],
        first: Option<&[Part]>,
        in_vain: Option<f64>,
    ) -> Option<Adjusted> {
        let found = self.tried(body, first);
        let best = found.first()?;
        let here = best.fitted.state.poses.last()?;
        let is_rival = |one: &&Tried| {
            one.fitted.state.poses.last().is_some_and(|pose| angle(here, pose) > RIVAL_RAD)
        };
        let margin = found
            .iter()
            .find(is_rival)
            .map_or(f64::INFINITY, |rival| rival.fitted.cost - best.fitted.cost);
        self.prior.parts.clone_from(&best.prior);
        let (grown, in_vain) = self.grown(&best.fitted.state, in_vain)?;
        let (state, hangs_rad) = self.freed(grown.state)?;
        self.judged(state, (margin, hangs_rad), in_vain)
    }

    /// Returns what is found from all turns that are tried, the best first.
    fn tried(&mut self, body: &[Part], first: Option<&[Part]>) -> Vec<Tried> {
        let tracked = self.prior.poses.clone();
        let Some(before) = tracked.len().checked_sub(2) else { return Vec::new() };
        let newest = NEWEST.iter().map(|&times| with_newest(&tracked, before, times));
        let newest = newest.chain(std::iter::once(with_newest(&tracked, 0, MIRRORED)));
        let newest = self.settled(newest, body).into_iter();
        let mut starts: Vec<_> =
            newest.map(|poses| (poses, body, self.prior.parts.clone())).collect();
        if let Some(first) = first.filter(|_| tracked.len() <= FEW) {
            starts.extend(ALL.map(|times| (with_all(&tracked, times), first, first.to_vec())));
        }
        let fitted = starts.into_iter().filter_map(|(poses, parts, prior)| {
            self.prior.parts.clone_from(&prior);
            let fitted = self.fitted(&State { poses, parts: parts.to_vec() }, STEPS)?;
            Some(Tried { fitted, prior })
        });
        let mut found: Vec<_> = fitted.collect();
        found.sort_by(|a, b| a.fitted.cost.total_cmp(&b.fitted.cost));
        found
    }

    /// Fits from a state with less weight on what was known before: that is a guess, and holds a turn
    /// back. Returns what fits to the noise of the boundaries without it, or else the state, and by how
    /// much the newest orientation hangs on the guess, in radians.
    fn freed(&mut self, state: State) -> Option<(State, f64)> {
        let misfit = |state: &State| Some(mean(self.misfits(state)?.into_iter()));
        if misfit(&state)? > SURE.0 * self.radius_px(&state)? {
            return Some((state, 0.0));
        }
        let with = |prior_weight: f64| {
            Some(Self { prior_weight, ..self.clone() }.fitted(&state, FREE_STEPS)?.state)
        };
        let free = with(FREE)?;
        if misfit(&free)? <= NOISE_PX {
            self.prior_weight = FREE;
            return Some((free, 0.0));
        }
        let newest = state.poses.last()?;
        let mut hangs_rad = angle(newest, free.poses.last()?);
        for prior_weight in LESS_FREE {
            hangs_rad = hangs_rad.max(angle(newest, with(prior_weight)?.poses.last()?));
        }
        Some((state, hangs_rad))
    }

    /// Fits the newest keyframe alone to a body, and returns the best of those that differ.
    fn settled(&self, starts: impl Iterator<Item = Vec<Pose>>, body: &[Part]) -> Vec<Vec<Pose>> {
        let last = self.prior.poses.len() - 1;
        let of_newest = self.views.iter().filter(|view| view.keyframe == last);
        let views = of_newest.map(|view| View { keyframe: 1, ..view.clone() }).collect();
        let state =
            |newest: Pose| State { poses: vec![self.prior.poses[0], newest], parts: body.to_vec() };
        let prior = state(self.prior.poses[last]);
        let Self { radius, prior_weight, .. } = *self;
        let alone = Scene { views, prior, radius, is_rigid: true, prior_weight };
        let fitted = starts.filter_map(|mut poses| {
            let Fitted { state, cost } = alone.fitted(&state(poses[last]), STEPS)?;
            poses[last] = state.poses[1];
            Some((poses, cost))
        });
        let mut fitted: Vec<_> = fitted.collect();
        fitted.sort_by(|a, b| a.1.total_cmp(&b.1));
        let mut kept: Vec<Vec<Pose>> = Vec::new();
        for (poses, _) in fitted {
            let is_new = kept.iter().all(|one| angle(&one[last], &poses[last]) > RIVAL_RAD);
            if is_new && kept.len() < FITTED {
                kept.push(poses);
            }
        }
        kept
    }

    /// Returns what a state is worth whose cost is by a `margin` lower than that of any other, and whose
    /// newest orientation hangs on a guess by an angle.
    fn judged(
        self,
        state: State,
        (margin, hangs_rad): (f64, f64),
        in_vain: Option<f64>,
    ) -> Option<Adjusted> {
        let misfits = self.misfits(&state)?;
        let last = state.poses.len() - 1;
        let of = |is_newest: bool| {
            let all = self.views.iter().zip(&misfits);
            all.filter(move |(view, _)| (view.keyframe == last) == is_newest).map(|(_, one)| *one)
        };
        let newest = of(true).fold(0.0, f64::max);
        let (all, before) = (mean(misfits.iter().copied()), mean(of(false)));
        let factor = (CORRELATED * libm::hypot(all, LEAST_MISFIT_PX)).powi(2);
        let covariances = self.covariances(&state)?;
        let covariances: Vec<_> = covariances.iter().map(|one| one * factor).collect();
        let turn = covariances.last()?.fixed_view::<3, 3>(3, 3).into_owned();
        let turn_sd = SymmetricEigen::new(turn).eigenvalues.max().max(0.0).sqrt();
        let px = self.radius_px(&state)?;
        let weakest = WeakestTurn::of(&self.together(&state)?, self.radius);
        let lever = weakest.map_or(0.0, |turn| turn.lever);
        let within = |(of_all, of_newest, turn_rad): (f64, f64, f64)| {
            let fits = all < of_all * px && newest < of_newest * px;
            fits && margin > MARGIN && turn_sd < turn_rad
        };
        Some(Adjusted {
            fits: within(FITS),
            is_sure: within(SURE)
                && lever >= LEVER
                && hangs_rad < HANGS_RAD
                && state.poses.len() >= LEAST_SURE
                && self.is_uneven(&state)?,
            fits_before: newest >= FITS.1 * px && before < FITS.0 * px,
            prior: self.prior.parts,
            in_vain,
            covariances,
            state,
        })
    }

    /// Returns whether the boundaries of most keyframes are none of a body of revolution.
    fn is_uneven(&self, state: &State) -> Option<bool> {
        let mut uneven = vec![true; state.poses.len()];
        for view in &self.views {
            let radius_px = view.radius_px(&state.poses[view.keyframe], self.radius)?;
            let least = UNEVEN.0.max(UNEVEN.1 / radius_px);
            uneven[view.keyframe] &= unlike_mirrored(view, radius_px)? >= least;
        }
        Some(2 * uneven.iter().filter(|one| **one).count() > uneven.len())
    }
}

/// What is found from a start, and what is known before of its ellipsoids.
struct Tried {
    fitted: Fitted,
    prior: Vec<Part>,
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0_f64), |(sum, count), one| (sum + one, count + 1.0));
    sum / count.max(1.0)
}

fn angle(one: &Pose, other: &Pose) -> f64 {
    (one.inverse() * *other).log().fixed_rows::<3>(3).norm()
}

/// Returns a pose whose rotation from another one is a multiple of what it is.
fn turned(from: &Pose, pose: &Pose, times: f64) -> Pose {
    let turn = (from.inverse() * *pose).log().fixed_rows::<3>(3) * times;
    let turn = Pose::exp(&Twist::new(0.0, 0.0, 0.0, turn[0], turn[1], turn[2]));
    Pose::from_rotation(from.rotation() * turn.rotation(), pose.translation())
}

/// Returns poses of which the newest is turned by a multiple of its rotation from another one.
fn with_newest(poses: &[Pose], from: usize, times: f64) -> Vec<Pose> {
    let mut all = poses.to_vec();
    let from = poses[from];
    if let Some(newest) = all.last_mut() {
        *newest = turned(&from, newest, times);
    }
    all
}

fn with_all(poses: &[Pose], times: f64) -> Vec<Pose> {
    poses.iter().map(|pose| turned(&poses[0], pose, times)).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;
    use crate::track::adjust::outlined::residuals::tests::{RADIUS, seen, toy};

    /// The turns of the keyframes of an object that turns about an axis that is nearly upright.
    const TURNS: [f64; 5] = [0.0, 0.12, 0.25, 0.38, 0.5];

    fn poses(times: f64) -> Vec<Pose> {
        let pose = |turn: &f64| {
            let turn = turn * times;
            Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, 0.0, 0.0))
                * Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.1 * turn, turn, 0.1 * turn))
        };
        TURNS.iter().map(pose).collect()
    }

    /// A body of one look: as the true one, with a depth that is guessed.
    fn guess(parts: &[Part]) -> Vec<Part> {
        let flat = |part: &Part| {
            let mut change = super::super::shape::Change::zeros();
            (change[2], change[5]) = (-0.3 * part.center.z, -0.2);
            part.moved(&change)
        };
        parts.iter().map(flat).collect()
    }

    fn adjusted(parts: &[Part], tracked: f64) -> Adjusted {
        let views = poses(1.0).into_iter().enumerate();
        let views = views.flat_map(|(keyframe, pose)| seen(parts, keyframe, &pose)).collect();
        let guess = guess(parts);
        let prior = State { poses: poses(tracked), parts: guess.clone() };
        Scene { views, prior, radius: RADIUS, is_rigid: false, prior_weight: 1.0 }
            .adjusted(&guess, Some(&guess), None)
            .unwrap()
    }

    #[test]
    fn outlines_of_several_keyframes_tell_a_turn_however_it_was_tracked() {
        for tracked in [1.0, 0.4, -0.6] {
            let found = adjusted(&toy(), tracked);
            let newest = angle(found.state.poses.last().unwrap(), poses(1.0).last().unwrap());
            assert!(newest < 0.06 && found.is_sure, "{tracked}: {newest} {found:?}");
        }
    }

    #[test]
    fn the_turn_of_an_egg_is_not_sure_however_well_a_flat_guess_fits_it() {
        let egg = |at: f64, across: f64, along: f64| Part {
            center: Vector3::new(0.0, at, 0.0),
            log_radii: Vector3::new(across, along, across).map(libm::log),
            rotation: UnitQuaternion::identity(),
        };
        let egg = [egg(-0.01, 0.035, 0.045), egg(0.02, 0.03, 0.04)];
        for tracked in [1.0, 0.4, 0.0, -0.6] {
            let found = adjusted(&egg, tracked);
            assert!(!found.is_sure, "{tracked}");
        }
    }

    #[test]
    fn the_turn_of_a_ball_is_never_sure() {
        let ball = [Part::ball(Vector3::zeros(), 0.04)];
        for tracked in [1.0, 0.4, -0.6] {
            assert!(!adjusted(&ball, tracked).is_sure);
        }
    }
}
