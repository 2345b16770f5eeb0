//! What an outline says of the orientation: nothing where its shape is that of a body of revolution,
//! and all of it where the object's shape is known and has no print.

use nalgebra::{Matrix6, SymmetricEigen};

use crate::pose::Pose;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::refine::Normal;
use crate::track::pose::uncertainty::inverse;
use crate::track::pose::verify::Quality;
use crate::track::pose::weakest_turn::WeakestTurn;
use crate::track::target::reference::Reference;
use crate::track::tracker::Tracker;

/// Motion of the outline per radian about the axis about which it moves least, compared with its
/// motion per radius of translation, from which on it shows that rotation; the same of a body that
/// several cameras saw from one side: a bottle's is never quite one of revolution, and reaches 0.042,
/// or 0.1 once.
const LEVER: f64 = 0.03;
const LEVER_OF_ONE_LOOK: f64 = 0.06;
/// Usual share, or the most so far, of the recognised points that show a rotation, from which on it
/// is shown where the outline does not show it.
const TURNS: f64 = 0.18;
/// That share lately, compared with this, and the outline's lever squared, compared with its least:
/// their sum below which the rotation is not seen. It is more than 1, as blocks of JPEG images, which
/// stay where they are, reach 1 on a bottle without print.
const UNSEEN: f64 = 1.1;
/// Rotation, in radians per image, by which poses are tried farther and farther around while the
/// rotation is not seen.
const ON_RAD: f64 = 0.29;
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
        turning >= TURNS || self.outline_shows_all(hypothesis)
    }

    /// Notes whether neither print nor the outline showed some rotation lately, of an object that
    /// has print on another side.
    pub(in crate::track) fn note_unseen_turn(&mut self, hypothesis: &Hypothesis) {
        let turning = self.trust.follow_turning(hypothesis.quality.turning_share());
        let is_printed = self.target.reference.most_turning >= TURNS;
        let shown = turning / TURNS + (self.lever(hypothesis) / self.least_lever()).powi(2);
        let is_unseen = self.settings.region && is_printed && shown < UNSEEN;
        self.trust.turn_unseen = if is_unseen { self.trust.turn_unseen + 1 } else { 0 };
    }

    /// Returns how an object may have turned while nothing showed it: farther with each image, and
    /// all the way around.
    pub(in crate::track) fn unseen_turn(&self, hypothesis: &Hypothesis) -> Pose {
        let angle = ON_RAD * self.trust.turn_unseen as f64;
        self.weakest_turn(hypothesis).map_or_else(Pose::identity, |turn| turn.by(angle))
    }

    /// Returns whether all rotations move the outline, or outlines are not used at all.
    fn outline_shows_all(&self, hypothesis: &Hypothesis) -> bool {
        !self.settings.region || self.lever(hypothesis) >= self.least_lever()
    }

    fn least_lever(&self) -> f64 {
        let is_one_look = self.frame.cameras.len() > 1 && !self.settings.known_shape;
        if is_one_look { LEVER_OF_ONE_LOOK } else { LEVER }
    }

    /// Returns how far the outline moves with the rotation that moves it least.
    pub(in crate::track) fn lever(&self, hypothesis: &Hypothesis) -> f64 {
        self.weakest_turn(hypothesis).map_or(0.0, |turn| turn.lever)
    }

    pub(super) fn weakest_turn(&self, hypothesis: &Hypothesis) -> Option<WeakestTurn> {
        WeakestTurn::of(&hypothesis.normal.outline.0, self.target.solid.radius)
    }

    /// Returns whether the outline alone shows the orientation of an object without print, whose
    /// shape is known and that was followed ever since its pose was given.
    pub(in crate::track) fn is_turn_outlined(&self, hypothesis: &Hypothesis) -> bool {
        let Quality { visible, outline, .. } = hypothesis.quality;
        self.settings.known_shape
            && self.is_plain()
            && self.trust.is_continuous()
            && self.frame.open() >= CAMERAS
            && visible >= WHOLE
            && outline >= FITS
            && self.is_turn_certain(hypothesis, (LEVER, CERTAIN_RAD))
    }

    /// Returns whether the outline determines the orientation about all axes: by a least lever, and a
    /// largest standard deviation.
    pub(in crate::track) fn is_turn_certain(
        &self,
        hypothesis: &Hypothesis,
        (lever, most_rad): (f64, f64),
    ) -> bool {
        let turn_sd = turn_sd(&hypothesis.normal.outline.0, self.target.solid.radius);
        self.lever(hypothesis) >= lever && turn_sd.is_some_and(|sd| sd <= most_rad)
    }
}

/// Returns the standard deviation of the orientation about its least certain axis, by the information of
/// an outline.
fn turn_sd(outline: &Matrix6<f64>, radius: f64) -> Option<f64> {
    let covariance = inverse(&(outline + Normal::new(radius).prior))?;
    let turn = covariance.fixed_view::<3, 3>(3, 3).into_owned();
    Some(SymmetricEigen::new(turn).eigenvalues.max().max(0.0).sqrt())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector3};

    use super::*;
    use crate::track::Status;
    use crate::track::pose::weakest_turn::tests::{HANDLE, RADIUS, outlined, vase};
    use crate::track::trust::tests::{quality, tracker};

    /// Returns what is seen of an object with an outline, and with a share of its points by which
    /// a rotation shows.
    fn hypothesis(rim: &[(Vector3<f64>, Vector2<f64>)], turning: f64) -> Hypothesis {
        let mut hypothesis = Hypothesis::nothing(Pose::identity(), RADIUS);
        hypothesis.normal.outline.0 = outlined(rim, 1.0);
        hypothesis.quality = shown(turning);
        hypothesis
    }

    fn shown(turning: f64) -> Quality {
        Quality { turning: 60.0 * turning, ..quality(1.0, 60.0) }
    }

    #[test]
    fn a_turn_that_moves_no_outline_is_visible_only_by_print_that_it_moves() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let plain = vase(RADIUS, 0.3);
        let handled = [&plain[..], &HANDLE].concat();
        for step in 0..=50 {
            let turning = 0.02 * f64::from(step);
            assert!(tracker.is_turn_visible(&hypothesis(&handled, turning)));
            let is_visible = tracker.is_turn_visible(&hypothesis(&plain, turning));
            assert_eq!(is_visible, turning >= TURNS, "{turning}");
        }
        tracker.target.reference.begin(&shown(1.0));
        tracker.target.reference.follow(&shown(0.0), 0.5);
        let round = hypothesis(&plain, 0.0);
        assert!(!tracker.is_turn_visible(&round), "points of the background in the first image");
        for _ in 0..200 {
            tracker.target.reference.follow(&shown(1.0), 0.5);
        }
        tracker.target.reference.follow(&shown(0.0), 0.5);
        assert!(tracker.is_turn_visible(&round), "a label that turned away");
    }

    #[test]
    fn the_spin_of_a_bottle_is_unseen_once_its_label_has_turned_away_unless_its_outline_shows_it() {
        let plain = vase(RADIUS, 0.3);
        let handled = [&plain[..], &HANDLE].concat();
        let learns = |tracker: &mut Tracker| tracker.allowed_updates(&quality(0.9, 60.0)).surface;
        for (is_printed, rim) in [(false, &plain), (true, &handled), (true, &plain)] {
            let mut tracker = tracker(Status::Tracking, 60.0);
            tracker.target.reference.most_turning = if is_printed { 2.0 * TURNS } else { 0.0 };
            for image in 0..20 {
                let turning = if image < 10 { 2.0 * TURNS } else { 0.0 };
                tracker.follow_drift(&hypothesis(rim, turning), None);
                assert!(image > 9 || tracker.trust.turn_unseen == 0);
            }
            let is_unseen = is_printed && rim == &plain;
            assert_eq!(tracker.trust.turn_unseen > 0, is_unseen);
            assert_eq!(learns(&mut tracker), !is_unseen);
            let turn = tracker.unseen_turn(&hypothesis(rim, 0.0)).log().fixed_rows::<3>(3).norm();
            assert_eq!(turn > 0.1, is_unseen, "where it is sought");
            tracker.follow_drift(&hypothesis(rim, 1.0), None);
            assert_eq!(tracker.trust.turn_unseen, 0, "its label is back");
        }
    }
}
