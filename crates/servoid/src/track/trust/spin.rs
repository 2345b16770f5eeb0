//! Tests whether the images show the rotation that the outline shows least. Creases, rims and the
//! border between light and shade of what was turned on a lathe have the contrast of print, but stay
//! where they are while it spins: turned on by hand, its pose fits as well.

use crate::camera::Observation;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::tracker::Tracker;

/// Angle by which a pose is turned on about the axis of that rotation, in radians, and the part of it
/// that must be left once it is refined there: print takes it back.
const BY_RAD: f64 = 0.1;
const LEFT: f64 = 0.5;
/// Coarsest resolutions from which it is refined, until it fits: a coarse one takes back what the
/// finest leaves, but where blocks of JPEG images are part of the points, the finest finds nothing.
const COARSEST: [usize; 2] = [0, 1];
/// Part of the support that is left there from which on it fits as well: of print it is less than half,
/// or up to 0.8 where little of it shows, of shading nine tenths and more.
const ALIKE: f64 = 0.85;
/// Number of tests at first, one an image, and images from one to the next afterwards, as long as they
/// say what they said before.
const FIRST: usize = 4;
const EVERY: usize = 6;
/// Weight of the newest test in their mean, and the mean from which on nothing shows the rotation.
const LATELY: f64 = 0.3;
const MOSTLY: f64 = 0.5;

/// How often a pose that was turned on fitted as well as the one that is followed.
#[derive(Debug, Clone, Default)]
pub(in crate::track) struct Spin {
    /// Mean over the tests, the newer the more; none before the first.
    alike: Option<f64>,
    tests: usize,
    /// Images until the next test.
    left: usize,
}

impl Spin {
    /// Returns whether nothing shows the rotation.
    pub(in crate::track) fn is_open(&self) -> bool {
        self.alike.is_some_and(|alike| alike >= MOSTLY)
    }

    /// Counts an image; returns the angle of a test that is due, to either side in turn.
    fn due_rad(&mut self) -> Option<f64> {
        if self.left > 0 {
            self.left -= 1;
            return None;
        }
        Some(if self.tests.is_multiple_of(2) { BY_RAD } else { -BY_RAD })
    }

    /// Notes the result of a test.
    fn note(&mut self, is_alike: bool) {
        let newest = f64::from(u8::from(is_alike));
        self.alike = Some(self.alike.map_or(newest, |mean| mean + LATELY * (newest - mean)));
        self.tests += 1;
        let is_news = is_alike != self.is_open();
        self.left = if self.tests < FIRST || is_news { 0 } else { EVERY - 1 };
    }
}

impl Tracker {
    /// Returns whether a pose that is followed still fits as well once it is turned on about the axis
    /// of the rotation that the outline shows least.
    pub(super) fn is_spin_open(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) -> bool {
        if let Some(turn) = self.weakest_turn(hypothesis)
            && let Some(angle) = self.trust.spin.due_rad()
        {
            let turned = hypothesis.pose * turn.by(angle);
            let is_alike = COARSEST.into_iter().any(|coarsest| {
                std::mem::swap(&mut self.workspace, &mut self.spare);
                self.points_in_view(&turned);
                let other = self.hypothesis(observation, &turned, coarsest, None);
                std::mem::swap(&mut self.workspace, &mut self.spare);
                let left = turn.angle_from(&hypothesis.pose, &other.pose) / angle;
                let support = other.quality.support / hypothesis.quality.support.max(1.0);
                left >= LEFT && support >= ALIKE
            });
            self.trust.spin.note(is_alike);
        }
        self.trust.spin.is_open()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tests_go_to_either_side_in_turn_one_an_image_at_first_and_now_and_then_later() {
        let mut spin = Spin::default();
        let mut angles = Vec::new();
        for image in 0..FIRST + 4 * EVERY {
            if let Some(angle) = spin.due_rad() {
                angles.push((image, angle));
                spin.note(false);
            }
        }
        assert!(angles.chunks(2).all(|pair| pair[0].1 == -pair[1].1));
        assert!((0..FIRST).all(|at| angles[at].0 == at));
        assert!(angles[FIRST..].windows(2).all(|pair| pair[1].0 - pair[0].0 == EVERY));
        assert_eq!(angles.len(), FIRST + 4);
    }

    #[test]
    fn a_rotation_is_open_once_most_tests_say_so_and_no_longer_once_they_do_not() {
        let mut spin = Spin::default();
        assert!(!spin.is_open(), "none was made");
        (0..10).for_each(|_| spin.note(true));
        spin.note(false);
        assert!(spin.is_open(), "a single test is chance");
        (0..10).for_each(|_| spin.note(false));
        assert!(!spin.is_open());
        spin.note(true);
        assert!(!spin.is_open(), "a single test is chance");
        assert!(spin.due_rad().is_some(), "it is made again at once");
    }
}
