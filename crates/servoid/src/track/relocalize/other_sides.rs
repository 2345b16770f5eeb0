//! Compares a pose that a search found with other known sides: one that looks alike may be found
//! first, and where two show about as much, the images do not tell which it is.

use nalgebra::UnitQuaternion;

use crate::camera::Observation;
use crate::pose::Pose;
use crate::track::pose::hypothesis::{COARSEST, Hypothesis};
use crate::track::tracker::{MARGIN, Tracker};

/// Turn from the expected orientation, in radians, from which on a pose may show another side that
/// looks alike, though the object was not missed.
const TURNED: f64 = 0.3;
/// Angle of a side from the one that was found, and of sides from each other, in radians.
const APART: f64 = 0.35;
const EACH: f64 = 0.2;
/// Part of the best side's support from which on another one may be the right one. Of right poses
/// others have at most 0.66 of it, of wrong ones the right one 0.85 and more.
const ALIKE: f64 = 0.75;

impl Tracker {
    /// Replaces a pose that a search found by one at which the cameras see another known side, if
    /// that has more support, where the object was missed or has turned from the expected
    /// orientation. Returns the number of poses scored.
    pub(super) fn check_side(
        &mut self,
        observation: &Observation<'_>,
        (expected, was_missed): (&Pose, bool),
        hypothesis: &mut Hypothesis,
    ) -> usize {
        let is_found = hypothesis.quality.share >= self.settings.trusted;
        let turned = hypothesis.pose.rotation().angle_to(&expected.rotation());
        if !is_found || !self.tells_sides() || !(was_missed || turned >= TURNED) {
            return 0;
        }
        let found = hypothesis.pose;
        let scored = self.compare_with_other_sides(observation, hypothesis);
        if hypothesis.pose != found {
            self.settle(observation, hypothesis);
        } else if scored > 0 {
            self.open_windows(observation, &found, MARGIN);
            self.points_in_view(&found);
        }
        scored
    }

    /// As long as the images do not tell which of several sides they show, compares them again now
    /// and then. Returns the number of poses scored.
    pub(in crate::track) fn check_side_again(
        &mut self,
        observation: &Observation<'_>,
        expected: &Pose,
        hypothesis: &mut Hypothesis,
    ) -> usize {
        if !self.trust.found_turn.is_due() || !self.tells_sides() {
            return 0;
        }
        let followed = hypothesis.pose;
        let scored = self.compare_with_other_sides(observation, hypothesis);
        if followed.rotation().angle_to(&hypothesis.pose.rotation()) < APART {
            *hypothesis = self.back_at(observation, expected, &followed);
        } else {
            self.status = self.trust.without();
            self.settle(observation, hypothesis);
        }
        scored
    }

    /// Returns whether support can tell one side from another: without print all look alike, and with
    /// guessed distances other poses fit as well as the right one.
    fn tells_sides(&self) -> bool {
        self.is_surely_printed() && !self.target.points.are_guessed()
    }

    /// Replaces a pose by one at which the cameras see another known side, if that has more support,
    /// and decides whether the images tell which it is. Returns the number of poses scored.
    fn compare_with_other_sides(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &mut Hypothesis,
    ) -> usize {
        let sides = self.sides_apart(observation, &hypothesis.pose);
        let mut all = vec![*hypothesis];
        for side in &sides {
            if self.open_windows(observation, side, MARGIN) {
                self.points_in_view(side);
                let other = self.hypothesis(observation, side, COARSEST, None);
                if !self.is_other(&other.pose) {
                    all.push(other);
                }
            }
        }
        let support = |one: &Hypothesis| one.quality.support;
        for other in &all {
            if support(other) > support(hypothesis) {
                *hypothesis = *other;
            }
        }
        let is_apart =
            |one: &Hypothesis| one.pose.rotation().angle_to(&hypothesis.pose.rotation()) >= APART;
        let least = ALIKE * support(hypothesis);
        let is_ambiguous = all.iter().any(|one| is_apart(one) && support(one) > least);
        self.trust.found_turn.decide(is_ambiguous);
        sides.len()
    }

    /// Returns poses at the place of another, at which the first camera sees known sides as it saw
    /// them, clearly turned from that and somewhat from each other.
    fn sides_apart(&self, observation: &Observation<'_>, from: &Pose) -> Vec<Pose> {
        let place = from.translation();
        let known = self.known_turns(observation);
        let mut sides: Vec<UnitQuaternion<f64>> = Vec::new();
        for view in 0..self.target.known_views() {
            let turn = known.turn_at(view, &place);
            let is_apart = from.rotation().angle_to(&turn) >= APART;
            if is_apart && sides.iter().all(|one| one.angle_to(&turn) >= EACH) {
                sides.push(turn);
            }
        }
        sides.into_iter().map(|turn| Pose::from_rotation(turn, place)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Twist;
    use crate::track::Status;
    use crate::track::target::keyframes::tests::keep;
    use crate::track::trust::tests::tracker;

    #[test]
    fn the_other_sides_are_the_known_ones_at_the_same_place_apart_from_it_and_from_each_other() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        for number in 0..12 {
            keep(&mut tracker.target.keyframes, 0.15 * f64::from(number));
        }
        let (time_s, world_from_camera) = (0.0, vec![Pose::identity()]);
        let (images, depths) = (vec![None], Vec::new());
        let observation = Observation { time_s, world_from_camera, images, depths };
        for turned in [0.0, 0.4, 0.9, 3.0] {
            let found = Pose::exp(&Twist::new(0.02, 0.0, 0.6, 0.0, turned, 0.0));
            let sides = tracker.sides_apart(&observation, &found);
            assert!(!sides.is_empty());
            for (number, side) in sides.iter().enumerate() {
                let away = |other: &Pose| side.rotation().angle_to(&other.rotation());
                assert!((side.translation() - found.translation()).norm() < 1e-12);
                assert!(away(&found) >= APART);
                assert!(sides[..number].iter().all(|other| away(other) >= EACH));
            }
        }
    }

    #[test]
    fn a_pose_that_was_followed_without_a_turn_is_not_compared() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        keep(&mut tracker.target.keyframes, 1.0);
        let (time_s, world_from_camera) = (0.0, vec![Pose::identity()]);
        let (images, depths) = (vec![None], Vec::new());
        let observation = Observation { time_s, world_from_camera, images, depths };
        let at = |turned: f64| Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, turned, 0.0));
        let reference = &mut tracker.target.reference;
        (reference.most_fine, reference.most_textured) = (1.0, 1e3);
        let mut compared = |turned: f64, was_missed: bool, share: f64| {
            let mut hypothesis = Hypothesis::nothing(at(turned), 0.05);
            hypothesis.quality.share = share;
            tracker.check_side(&observation, (&at(0.0), was_missed), &mut hypothesis)
        };
        assert_eq!(compared(0.9 * TURNED, false, 0.9), 0);
        assert_eq!(compared(0.0, true, 0.1), 0, "it was not found");
        assert_eq!(compared(0.0, true, 0.9), 1);
        assert_eq!(compared(1.1 * TURNED, false, 0.9), 1);
        tracker.target.reference.most_fine = 0.0;
        let mut hypothesis = Hypothesis::nothing(at(0.0), 0.05);
        hypothesis.quality.share = 0.9;
        let scored = tracker.check_side(&observation, (&at(0.0), true), &mut hypothesis);
        assert_eq!(scored, 0, "without print all sides look alike");
    }
}
