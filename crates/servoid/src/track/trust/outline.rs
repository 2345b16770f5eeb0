//! What an outline says of the orientation: nothing where its shape is that of a body of revolution,
//! and all of it where the object's shape is known and has no print.

use nalgebra::{Matrix6, SymmetricEigen};

use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::refine::Normal;
use crate::track::pose::uncertainty::inverse;
use crate::track::pose::verify::Quality;
use crate::track::pose::weakest_turn::WeakestTurn;
use crate::track::target::reference::Reference;
use crate::track::tracker::Tracker;

/// Motion of the outline per radian about the axis about which it moves least, compared with its
/// motion per radius of translation, from which on it shows that rotation; the same of a body that
/// several cameras saw from one side: a bottle's is never quite one of revolution, and reaches 0.042.
const LEVER: f64 = 0.03;
const LEVER_OF_ONE_LOOK: f64 = 0.06;
/// Usual share, or the most so far, of the recognised points that show a rotation, from which on it
/// is shown where the outline does not show it.
const TURNS: f64 = 0.18;
/// Agreement of the outline with the boundary, and share of what should be visible that is seen, from
/// which on an outline alone shows the orientation.
const FITS: f64 = 0.7;
const WHOLE: f64 = 0.85;
/// Standard deviation of the orientation by the outline, in radians about its least certain axis and
/// without its bias, up to which that is so; and the least number of cameras: a single one often fits
/// the outline as well when it is mirrored in depth.
const CERTAIN_RAD: f64 = 0.15;
const CAMERAS: usize = 2;

impl Tracker {
    /// Returns whether print or the outline can show all of a rotation.
    pub(in crate::track) fn is_turn_visible(&self, hypothesis: &Hypothesis) -> bool {
        let Reference { turning_share, most_turning, .. } = self.target.reference;
        let turning = turning_share.map_or(hypothesis.quality.turning_share(), |_| most_turning);
        let is_one_look = self.frame.cameras.len() > 1 && !self.settings.known_shape;
        let least = if is_one_look { LEVER_OF_ONE_LOOK } else { LEVER };
        !self.settings.region || turning >= TURNS || self.lever(hypothesis) >= least
    }

    fn lever(&self, hypothesis: &Hypothesis) -> f64 {
        WeakestTurn::of(&hypothesis.normal.outline.0, self.target.solid.radius).lever
    }

    /// Returns whether the outline alone shows the orientation of an object without print, whose
    /// shape is known and that was followed ever since its pose was given.
    pub(in crate::track) fn is_turn_outlined(&self, hypothesis: &Hypothesis) -> bool {
        let radius = self.target.solid.radius;
        let Quality { visible, outline, .. } = hypothesis.quality;
        self.settings.known_shape
            && self.is_plain()
            && self.trust.is_continuous()
            && self.frame.open() >= CAMERAS
            && visible >= WHOLE
            && outline >= FITS
            && self.lever(hypothesis) >= LEVER
            && is_certain(&hypothesis.normal.outline.0, radius)
    }
}

fn is_certain(outline: &Matrix6<f64>, radius: f64) -> bool {
    let Some(covariance) = inverse(&(outline + Normal::new(radius).prior)) else { return false };
    let turn = covariance.fixed_view::<3, 3>(3, 3).into_owned();
    SymmetricEigen::new(turn).eigenvalues.max() <= CERTAIN_RAD.powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::track::Status;
    use crate::track::pose::weakest_turn::tests::{HANDLE, RADIUS, outlined, vase};
    use crate::track::trust::tests::{quality, tracker};

    #[test]
    fn a_turn_that_moves_no_outline_is_visible_only_by_print_that_it_moves() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let hypothesis = |rim: &[_], quality: Quality| {
            let mut hypothesis = Hypothesis::nothing(Pose::identity(), RADIUS);
            (hypothesis.normal.outline.0, hypothesis.quality) = (outlined(rim, 1.0), quality);
            hypothesis
        };
        let plain = vase(RADIUS, 0.3);
        let handled = [&plain[..], &HANDLE].concat();
        let shown = |turning: f64| Quality { turning: 60.0 * turning, ..quality(1.0, 60.0) };
        for step in 0..=50 {
            let turning = 0.02 * f64::from(step);
            assert!(tracker.is_turn_visible(&hypothesis(&handled, shown(turning))));
            let is_visible = tracker.is_turn_visible(&hypothesis(&plain, shown(turning)));
            assert_eq!(is_visible, turning >= TURNS, "{turning}");
        }
        tracker.target.reference.begin(&shown(1.0));
        tracker.target.reference.follow(&shown(0.0), 0.5);
        let round = hypothesis(&plain, shown(0.0));
        assert!(!tracker.is_turn_visible(&round), "points of the background in the first image");
        tracker.target.reference.follow(&shown(1.0), 0.5);
        for _ in 0..200 {
            tracker.target.reference.follow(&shown(1.0), 0.5);
        }
        tracker.target.reference.follow(&shown(0.0), 0.5);
        assert!(tracker.is_turn_visible(&round), "a label that turned away");
    }
}
