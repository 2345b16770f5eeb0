//! How far the orientation may have been held back where little shows it. Shading stays where the
//! light is, so that an object seems to turn less than it does while it shows a side without print.
//! Nothing in the images tells this from an object that slows down.

use nalgebra::{UnitQuaternion, Vector3};

use crate::camera::Observation;
use crate::track::frame::input_checks::FARTHEST_S;
use crate::track::motion::drift::slip;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::uncertainty::turn_variance;
use crate::track::target::keyframes::{Keyframe, object_from_camera};
use crate::track::target::relief::UsualNoise;
use crate::track::tracker::Tracker;

/// The rotation by which an object is behind its angular velocity, as that was last shown well.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HeldBack {
    last: Option<(f64, UnitQuaternion<f64>)>,
    /// Angular velocity in the world, in radians per second, as last shown well.
    velocity: Vector3<f64>,
    /// Angle in radians that is missing since then, and its maximum.
    missing: f64,
    most_missing: f64,
    /// Variance by which it may have been held back before, in square radians.
    before: f64,
    /// Usual variance of the orientation by the noise of an image.
    usual_noise: UsualNoise,
    /// Number of the keyframe to come when the orientation was last shown well.
    upcoming: usize,
}

/// Weight of the newest image in the angular velocity.
const RATE: f64 = 0.3;
/// Largest angle that is missing in an image, as a multiple of the rotation seen.
const MOST: f64 = 2.3;
/// Standard deviation of the orientation, as a multiple of the angle that is missing: the object may
/// as well have turned faster meanwhile.
const TIMES: f64 = 3.0;
/// Part of the variance below which the orientation is known again.
const KNOWN_AGAIN: f64 = 0.25;
/// Slip of what is recognised from which on it may hold back the rotation.
const SLIPPERY: f64 = 0.08;
/// Ratio of the standard deviation of the orientation by the noise of an image to the usual one from
/// which on an image shows little of it.
const NOISY: f64 = 2.0;
/// Standard deviation of the orientation, in radians, up to which it is known: by what is recognised,
/// whatever is doubted of the side that is seen, or at a keyframe, by how far it was held back.
const KNOWN_RAD: f64 = 0.03;
/// Angle to a keyframe within which a view is known, in radians, and the number of the last keyframes
/// before the orientation was shown badly that do not count, as their views were just left.
const SAME_RAD: f64 = 0.2;
const LEFT: usize = 3;

impl HeldBack {
    /// Adds an orientation in the world at a time; `is_shown` states whether the image shows it well
    /// or the view is known, and `drift` is the variance of the orientation by what is recognised, in
    /// square radians.
    fn follow(
        &mut self,
        time_s: f64,
        orientation: UnitQuaternion<f64>,
        (is_shown, drift): (bool, f64),
    ) {
        if is_shown {
            let doubt = self.variance();
            self.before = if drift < KNOWN_AGAIN * doubt { drift } else { doubt };
            (self.missing, self.most_missing) = (0.0, 0.0);
        }
        let Some((last_s, last)) = self.last.replace((time_s, orientation)) else { return };
        let dt = time_s - last_s;
        if !(dt > 0.0 && dt < FARTHEST_S) {
            return;
        }
        let step = (orientation * last.inverse()).scaled_axis();
        let axis = self.velocity.try_normalize(0.0).unwrap_or_default();
        let along = axis.dot(&step);
        let missing = (self.velocity.norm() * dt - along).min(MOST * along.max(0.0));
        // What turns faster is not held back.
        if is_shown || missing < 0.0 {
            self.velocity += (step / dt - self.velocity) * RATE;
        }
        if !is_shown {
            self.missing = (self.missing + missing).max(0.0);
            self.most_missing = self.most_missing.max(self.missing);
        }
    }

    /// Returns the variance by which the orientation may have been held back since it was known.
    pub(crate) fn variance(&self) -> f64 {
        self.before + self.newest()
    }

    /// Returns the part of it since the orientation was last shown well.
    fn newest(&self) -> f64 {
        (TIMES * self.most_missing).powi(2)
    }

    /// Forgets the last orientation, as the next one does not go on from it.
    pub(crate) fn pause(&mut self) {
        self.last = None;
    }
}

impl Tracker {
    /// Updates how far the orientation may have been held back, by an accepted pose. Of an object
    /// without print that is always so, and is not counted here; nor are views that are known, nor
    /// where motion is to determine distances, as then noise counts as drift.
    pub(crate) fn follow_held_back(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) {
        let quality = &hypothesis.quality;
        let noise = turn_variance(&hypothesis.normal, self.target.solid.radius);
        let is_noisy = noise > NOISY * NOISY * self.held_back.usual_noise.follow(noise);
        let is_doubted = self.is_plain() || self.target.relief.is_open;
        let keyframes = &self.target.keyframes;
        let camera = object_from_camera(observation, &hypothesis.pose);
        let may_slip = is_noisy || keyframes.may_be_off(&camera, KNOWN_RAD * KNOWN_RAD, SAME_RAD);
        let slips = may_slip && slip(quality, self.frame.open()) >= SLIPPERY && !is_doubted;
        if !slips {
            self.held_back.upcoming = keyframes.upcoming();
        }
        let earlier = self.held_back.upcoming.saturating_sub(LEFT);
        let is_shown =
            !slips || keyframes.is_known(&camera, KNOWN_RAD * KNOWN_RAD, (earlier, SAME_RAD));
        let known = (is_shown, self.target.points.drift_variance);
        self.held_back.follow(observation.time_s, hypothesis.pose.rotation(), known);
        self.target.points.held_back_variance = self.held_back.newest();
    }

    /// Returns the variance by which the orientation of a new keyframe may have been held back: as
    /// much as that of the side which is seen, unless what is recognised is known better.
    pub(crate) fn held_back_at(&self, object_from_camera: &UnitQuaternion<f64>) -> f64 {
        let is_known = self.target.points.drift_variance <= KNOWN_RAD * KNOWN_RAD;
        let of_side = self.target.keyframes.nearest(object_from_camera).map(Keyframe::unseen_drift);
        let of_side = of_side.filter(|_| !is_known).unwrap_or(0.0);
        self.held_back.variance().max(of_side)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Status;
    use crate::track::trust::tests::tracker;

    const DT: f64 = 1.0 / 30.0;
    const STEP: f64 = 0.05;
    const DRIFT: f64 = 1e-4;

    /// Follows an object that turns by an angle in each image, shown well in the first twenty.
    fn followed(angle: impl Fn(usize) -> f64) -> HeldBack {
        let (mut out, mut turned) = (HeldBack::default(), 0.0);
        for image in 0..30 {
            turned += angle(image);
            let orientation = UnitQuaternion::from_scaled_axis(Vector3::y() * turned);
            out.follow(image as f64 * DT, orientation, (image < 20, DRIFT));
        }
        out
    }

    #[test]
    fn an_object_that_turns_on_or_faster_is_not_held_back() {
        for faster in [0.0, 0.1, 1.0] {
            let on = followed(|image| STEP * (1.0 + faster * image.saturating_sub(19) as f64));
            assert!(on.variance() < 1e-12, "{faster}");
        }
    }

    #[test]
    fn what_is_missing_counts_thrice_where_little_shows_the_turn_and_not_where_much_shows_it() {
        let slowed = |from: usize| followed(|image| if image < from { STEP } else { 0.4 * STEP });
        let expected = (TIMES * 10.0 * 0.6 * STEP).powi(2);
        let held_back = slowed(20);
        // The angular velocity is a running mean from rest.
        assert!((held_back.variance() / expected - 1.0).abs() < 0.02, "{held_back:?}");
        assert!(slowed(0).variance() < 1e-4 * expected, "shown well");
    }

    #[test]
    fn an_object_that_is_seen_to_stop_or_to_turn_back_is_missing_no_more_than_what_may_be_held_back()
     {
        let [stops, turns_back] =
            [0.0, -1.0].map(|to| followed(|image| if image < 20 { STEP } else { to * STEP }));
        assert!(stops.variance() < 1e-12 && turns_back.variance() < 1e-12);
        let slow = followed(|image| if image < 20 { STEP } else { 0.1 * STEP });
        let most = TIMES * 10.0 * MOST * 0.1 * STEP;
        assert!(slow.variance() <= most * most * (1.0 + 1e-9));
    }

    #[test]
    fn what_was_held_back_stays_in_doubt_until_the_orientation_is_known_again() {
        let mut held_back = followed(|image| if image < 20 { STEP } else { 0.5 * STEP });
        let doubt = held_back.variance();
        let mut go_on = |image: usize, drift| {
            held_back.follow(image as f64 * DT, UnitQuaternion::identity(), (true, drift));
            held_back.variance()
        };
        assert_eq!(go_on(30, 0.5 * doubt), doubt);
        assert_eq!(go_on(31, 0.9 * KNOWN_AGAIN * doubt), 0.9 * KNOWN_AGAIN * doubt);
        assert_eq!(go_on(32, doubt), 0.9 * KNOWN_AGAIN * doubt);
    }

    #[test]
    fn an_appearance_that_is_recalled_is_not_doubted_for_what_went_before() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        tracker.held_back = followed(|image| if image < 20 { STEP } else { 0.5 * STEP });
        tracker.recall(&tracker.appearance()).unwrap();
        assert!(tracker.held_back.variance() == 0.0);
        assert!(tracker.held_back_at(&UnitQuaternion::identity()) == 0.0);
    }

    #[test]
    fn where_it_does_not_go_on_nothing_is_missing() {
        let mut held_back = followed(|_| STEP);
        held_back.pause();
        for later_s in [40.0 * DT, 40.0 * DT, 30.0 * DT, 1.1 * FARTHEST_S + 30.0 * DT] {
            held_back.follow(later_s, UnitQuaternion::identity(), (false, DRIFT));
            assert!(held_back.variance() < 1e-12);
        }
    }
}
