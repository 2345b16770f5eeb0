//! Doubts the orientation of an object that was found again, if it cannot have turned there, or if
//! another side shows about as much: one that looks like the right one may have been found.

use nalgebra::UnitQuaternion;

use crate::pose::Pose;

/// Fastest turn of an object, in radians per second, and by how much an orientation may differ beyond
/// it, in radians.
const FASTEST: f64 = 3.2;
const SLACK: f64 = 0.6;
/// Images from one comparison of sides to the next, as long as they look alike.
const EVERY: usize = 4;
/// Standard deviation of an orientation, in radians, up to which later ones are compared with it, and
/// how many of them it may be off.
const KNOWN_RAD: f64 = 0.2;
const SDS: f64 = 2.5;

/// The last orientation that was known, and whether the present one can follow from it.
#[derive(Debug, Clone, Default)]
pub(in crate::track) struct FoundTurn {
    known: Option<Known>,
    /// Whether the object cannot have turned to where it was found.
    is_impossible: bool,
    /// Whether another side shows about as much, and images until they are compared again.
    is_ambiguous: bool,
    left: usize,
}

#[derive(Debug, Clone, Copy)]
struct Known {
    time_s: f64,
    turn: UnitQuaternion<f64>,
    sd_rad: f64,
}

impl FoundTurn {
    pub(in crate::track) fn is_doubtful(&self) -> bool {
        self.is_impossible || self.is_ambiguous
    }

    /// Notes whether another side shows about as much.
    pub(in crate::track) fn decide(&mut self, is_ambiguous: bool) {
        (self.is_ambiguous, self.left) = (is_ambiguous, EVERY);
    }

    /// Counts an image; returns whether sides that look alike are to be compared again.
    pub(in crate::track) fn is_due(&mut self) -> bool {
        self.left = self.left.saturating_sub(1);
        self.is_ambiguous && self.left == 0
    }

    /// Notes a pose that the images confirm, with the standard deviation of its orientation.
    pub(in crate::track) fn follow(&mut self, time_s: f64, pose: &Pose, sd_rad: f64) {
        if !self.is_doubtful() && sd_rad <= KNOWN_RAD {
            self.known = Some(Known { time_s, turn: pose.rotation(), sd_rad });
        }
    }

    /// Decides whether an object that was found again can have turned there.
    pub(in crate::track) fn find(&mut self, time_s: f64, pose: &Pose) {
        self.is_impossible = self.known.is_some_and(|known| {
            let passed_s = (time_s - known.time_s).max(0.0);
            let most = SLACK + SDS * known.sd_rad + FASTEST * passed_s;
            pose.rotation().angle_to(&known.turn) > most
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Twist;

    fn turned(angle: f64) -> Pose {
        Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, angle, 0.0))
    }

    #[test]
    fn an_orientation_is_doubtful_that_is_farther_than_anything_turns_in_the_time() {
        for (passed_s, sd_rad) in [(0.0, 0.0), (0.1, 0.0), (0.3, 0.1)] {
            let most = SLACK + SDS * sd_rad + FASTEST * passed_s;
            for (factor, is_doubtful) in [(0.5, false), (0.99, false), (1.01, true)] {
                let mut found = FoundTurn::default();
                found.follow(2.0, &turned(0.3), sd_rad);
                found.find(2.0 + passed_s, &turned(0.3 + factor * most));
                assert_eq!(found.is_doubtful(), is_doubtful, "{passed_s} {factor}");
                found.find(2.0 + passed_s, &turned(0.3));
                assert!(!found.is_doubtful(), "it is found where it was");
            }
        }
    }

    #[test]
    fn a_doubtful_orientation_and_one_that_drifted_judge_no_later_one() {
        let mut found = FoundTurn::default();
        found.find(1.0, &turned(3.0));
        assert!(!found.is_doubtful(), "nothing was known");
        found.follow(1.0, &turned(0.0), 0.0);
        found.find(1.0, &turned(2.0));
        found.follow(1.1, &turned(2.0), 0.0);
        found.find(1.1, &turned(2.0));
        assert!(found.is_doubtful(), "the doubtful one was not taken as known");
        found.find(1.1, &turned(0.0));
        found.follow(1.2, &turned(1.0), 1.1 * KNOWN_RAD);
        found.find(1.2, &turned(2.0));
        assert!(found.is_doubtful(), "the one that drifted was not taken as known");
    }

    #[test]
    fn sides_that_look_alike_are_compared_again_now_and_then_until_one_is_decided() {
        let mut found = FoundTurn::default();
        assert!((0..3 * EVERY).all(|_| !found.is_due()));
        for _ in 0..3 {
            found.decide(true);
            assert!(found.is_doubtful());
            let due: Vec<bool> = (0..EVERY).map(|_| found.is_due()).collect();
            assert_eq!(due.iter().filter(|due| **due).count(), 1);
            assert!(due[EVERY - 1]);
        }
        found.decide(false);
        assert!(!found.is_doubtful() && (0..3 * EVERY).all(|_| !found.is_due()));
    }
}
