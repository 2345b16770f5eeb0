//! Finds an object again: near its last pose (locally), anywhere (globally), or from masks.

mod detection;
mod from_masks;
mod known_side;
mod known_turns;
mod look_alike;
mod other_sides;
mod relocalizer;

pub use from_masks::{MaskFit, pose_from_masks, poses_from_masks};
pub(super) use look_alike::LookAlikes;
use relocalizer::LIGHTS;
pub(super) use relocalizer::Relocalizer;

use crate::camera::Observation;
use crate::pose::Pose;
use crate::track::TrackError;
use crate::track::inputs::Inputs;
use crate::track::pose::hypothesis::{COARSEST, Hypothesis};
use crate::track::tracker::{MARGIN, Tracker};

/// Margin of the window, as a share of the object's size, for a search near a pose.
const LOCAL_MARGIN: f64 = 0.8;
/// Range of a search around a pose, in radii and radians.
const LOCAL_RANGE: (f64, f64) = (0.6, 0.8);
/// Images from one search around the expected pose to the next, while its rotation is not seen.
const EXPECTED_EVERY: usize = 4;
/// Factor by which the support of a rival must exceed the current one.
const BETTER: f64 = 1.2;
/// Rounds of a search near a pose, and anywhere, when there is no time limit.
pub(crate) const ROUNDS: (usize, usize) = (2, 5);
/// Range of distances that a search anywhere covers: relative to the last distance, relative to the
/// mean one if the object was not tracked yet, and the least one, in radii, without either.
const NEAR_LAST: (f64, f64) = (0.6, 1.7);
const NEAR_MEAN: (f64, f64) = (0.4, 2.5);
const NEAREST: f64 = 2.5;
/// Smallest image of the object that is sought, in pixels.
const SMALLEST_PX: f64 = 24.0;

impl Tracker {
    /// Searches for the object again: near its predicted pose if it was seen recently, and anywhere
    /// if that is in vain. Replaces the hypothesis if something better is found; returns the number
    /// of poses scored.
    pub(in crate::track) fn relocalize(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let was_missed = hypothesis.quality.share < self.least_share();
        let scored = if self.trust.seek_nearby(self.target.points.are_guessed()) {
            // It may have turned unseen, or not.
            let turned = *expected * self.unseen_turn(hypothesis);
            let is_turned = !self.trust.turn_unseen.is_multiple_of(EXPECTED_EVERY);
            let near = if is_turned { turned } else { *expected };
            self.relocalize_locally(observation, (&near, 1), hypothesis)?
        } else {
            self.relocalize_anywhere(observation, hypothesis)?
        };
        Ok(scored + self.check_side(observation, (expected, was_missed), hypothesis))
    }

    /// Searches for the object in the whole images, and keeps the hypothesis that is followed unless
    /// another one can be followed and has more support; returns the number of poses scored.
    fn relocalize_anywhere(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let (followed, light) = (*hypothesis, self.relocalizer.light);
        let evaluations = self.relocalize_globally(observation, 1, hypothesis)?;
        let can_follow = |one: &Hypothesis| one.quality.share >= self.settings.trusted;
        let is_better =
            can_follow(hypothesis) && hypothesis.quality.support >= followed.quality.support;
        if can_follow(&followed) && !is_better {
            *hypothesis = followed;
            self.expect_light(light);
            self.settle(observation, hypothesis);
        }
        Ok(evaluations)
    }

    /// Expects the colours that were recalled in one of the `LIGHTS`.
    fn expect_light(&mut self, light: usize) {
        if light != self.relocalizer.light {
            self.relocalizer.light = light;
            self.target.colors.relight(LIGHTS[light]);
        }
    }

    /// Searches near a hypothesis for a pose at which more is recognised, since the orientation may
    /// have drifted; returns the number of poses scored.
    pub(in crate::track) fn compare_with_rival(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let mut rival = *hypothesis;
        let near = hypothesis.pose * self.unseen_turn(hypothesis);
        let evaluations = self.relocalize_locally(observation, (&near, 1), &mut rival)?;
        let better = rival.quality.support > BETTER * hypothesis.quality.support
            && rival.quality.share >= self.settings.trusted;
        if better {
            *hypothesis = rival;
        }
        if better && self.has_jumped(expected, &rival.pose) {
            self.status = self.trust.without();
            return Ok(evaluations);
        }
        *hypothesis = self.back_at(observation, expected, &hypothesis.pose);
        Ok(evaluations)
    }

    /// Evaluates a pose that is followed once more, after a search elsewhere.
    fn back_at(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        followed: &Pose,
    ) -> Hypothesis {
        self.open_windows(observation, followed, MARGIN);
        self.points_in_view(followed);
        let prior = self.prior_if_followed(observation);
        let mut hypothesis = self.evaluate(observation, followed, prior.as_ref());
        self.penalize_doubtful(expected, &mut hypothesis);
        hypothesis
    }

    /// Searches for the object near a pose, in several rounds unless it is found earlier.
    pub(in crate::track) fn relocalize_locally(
        &mut self,
        observation: &Observation<'_>,
        (near, rounds): (&Pose, usize),
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let search_range = (LOCAL_RANGE.0 * self.target.solid.radius, LOCAL_RANGE.1);
        let mut evaluations = 0;
        for _ in 0..rounds {
            if !self.open_windows(observation, near, LOCAL_MARGIN) {
                break;
            }
            let area = self.area(near);
            let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
            let (found, scored) = self.relocalizer.local(inputs, (near, search_range, area))?;
            evaluations += scored;
            let candidates: Vec<Pose> = found.iter().map(|found| found.pose).collect();
            self.choose(observation, &candidates, hypothesis);
            if self.is_sure(hypothesis) {
                break;
            }
        }
        Ok(evaluations)
    }

    /// Searches for the object in the whole images, in several rounds unless it is found earlier. An
    /// appearance that nothing here confirmed yet was learned in another light, maybe.
    pub(in crate::track) fn relocalize_globally(
        &mut self,
        observation: &Observation<'_>,
        rounds: usize,
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let radius = self.target.solid.radius;
        let focal = self.frame.cameras.first().map_or(1.0, |camera| camera.focal_px()[0]);
        let reference = self.target.reference.distance;
        let (near, far) = match self.last_distance(observation) {
            Some(last) => (NEAR_LAST.0 * last, NEAR_LAST.1 * last),
            None if reference > 0.0 => (NEAR_MEAN.0 * reference, NEAR_MEAN.1 * reference),
            None => (NEAREST * radius, 2.0 * focal * radius / SMALLEST_PX),
        };
        let reference_area = self.target.reference.area;
        let area_at = |distance: f64| reference_area / (distance * distance);
        let known = self.known_turns(observation);
        let is_recalled = self.target.colors.are_recalled() && !self.trust.is_confirmed();
        let (mut evaluations, mut light) = (0, self.relocalizer.light);
        for _ in 0..rounds {
            let before = *hypothesis;
            if is_recalled {
                let next = self.relocalizer.next_light();
                self.expect_light(next);
            }
            self.open_all_over(observation);
            let detected = self.detect(&known, (near, far));
            let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
            let places = (&*detected, (near, far));
            let (found, scored) = self.relocalizer.global(inputs, &known, places, area_at)?;
            evaluations += scored;
            let candidates: Vec<Pose> = found.iter().map(|found| found.pose).collect();
            if self.choose(observation, &candidates, hypothesis) {
                light = self.relocalizer.light;
            } else if self.relocalizer.light != light {
                *hypothesis = before;
            }
            if self.is_sure(hypothesis) {
                break;
            }
        }
        if self.relocalizer.light != light {
            self.expect_light(light);
            self.settle(observation, hypothesis);
        }
        if is_recalled && hypothesis.quality.share >= self.settings.trusted {
            self.match_light(observation, hypothesis);
        }
        Ok(evaluations)
    }

    /// Expects the recalled colours in the light in which a pose that is followed has the most
    /// support: its points may have shown it before the right light was tried.
    fn match_light(&mut self, observation: &Observation<'_>, hypothesis: &mut Hypothesis) {
        let (mut best, mut light) = (*hypothesis, self.relocalizer.light);
        let is_first = |at: &usize| !LIGHTS[..*at].contains(&LIGHTS[*at]);
        for other in (0..LIGHTS.len()).filter(is_first) {
            self.expect_light(other);
            let mut lit = *hypothesis;
            self.settle(observation, &mut lit);
            if lit.quality.support > best.quality.support {
                (best, light) = (lit, other);
            }
        }
        self.expect_light(light);
        *hypothesis = best;
        self.settle(observation, hypothesis);
    }

    /// Refines candidates and keeps the best, if it is better than the hypothesis, and returns
    /// whether it is; in the end the windows are those of the best.
    fn choose(
        &mut self,
        observation: &Observation<'_>,
        candidates: &[Pose],
        hypothesis: &mut Hypothesis,
    ) -> bool {
        let mut is_replaced = false;
        for candidate in candidates {
            self.points_in_view(candidate);
            let other = self.hypothesis(observation, candidate, COARSEST, None);
            let is_better = other.quality.support > hypothesis.quality.support;
            if is_better && !self.is_other(&other.pose) {
                *hypothesis = other;
                is_replaced = true;
            }
            if self.is_sure(hypothesis) {
                break;
            }
        }
        self.settle(observation, hypothesis);
        is_replaced
    }

    /// Opens the windows at a hypothesis and refines it there.
    fn settle(&mut self, observation: &Observation<'_>, hypothesis: &mut Hypothesis) {
        let pose = hypothesis.pose;
        if self.open_windows(observation, &pose, MARGIN) {
            self.points_in_view(&pose);
            *hypothesis = self.hypothesis(observation, &pose, COARSEST, None);
        }
        self.penalize_unrecognised(hypothesis);
        let is_followed = hypothesis.quality.share >= self.settings.trusted;
        if is_followed && self.is_other(&hypothesis.pose) {
            self.penalize(hypothesis);
        }
    }

    /// Returns the last distance of the object from the first camera, if it was tracked before.
    fn last_distance(&self, observation: &Observation<'_>) -> Option<f64> {
        let eye = observation.world_from_camera.first()?.translation();
        self.trust.is_started().then(|| (self.motion.last().translation() - eye).norm())
    }
}
