//! Drift of the object's orientation since the first image. A surface point constrains the
//! orientation only as well as the orientation was known when the point was learned, and features
//! such as shading, which look alike wherever they lie on the surface, slip along it. Once sides
//! are seen again that are known better, what was learned since is turned back by its share of the
//! drift.

use nalgebra::{Matrix6, Vector6};

use crate::camera::Observation;
use crate::pose::{Pose, Twist};
use crate::track::estimate::Notice;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::uncertainty::turn_variance;
use crate::track::pose::verify::Quality;
use crate::track::target::Target;
use crate::track::target::keyframes::object_from_camera;
use crate::track::tracker::Tracker;
use crate::track::trust::{ADRIFT_RAD, CLEAR};

/// Slip of the orientation per radian, as a standard deviation, where nothing has the contrast of a
/// pattern and few points are recognised; its maximum; and the number of recognised points per
/// camera that halves it.
const SLIPS: (f64, f64, f64) = (2.0, 0.5, 20.0);
/// Standard deviation, in radians, of the orientation of an object found again with too few known
/// points, or whose rotation is not seen.
const FOUND_RAD: f64 = 0.3;
/// Standard deviation of the orientation, in radians, from which on a loop may be closed, and the
/// largest part of its variance that may be left after that.
pub(crate) const CLOSED: (f64, f64) = (0.03, 0.25);
/// Factor by which the orientation strays more, where points are learned, than its noise predicts.
const STRAYS: f64 = 3.0;
/// Part of the object's radius by which the position drifts per radian of the orientation.
const PLACE: f64 = 0.2;
/// Factor of the orientation's standard deviation by the noise of an image in which a single camera
/// cannot tell it from relief, as errors of points are correlated; and the part of its variance that
/// is left after another image, as they last.
const NOISE: (f64, f64) = (7.0, 0.9);
/// Systematic error of the orientation, as a standard deviation in radians per radian of rotation, by
/// points that are shading: it stays where the light is, and so holds all of them back alike. And the
/// parts of the recognised points that have the contrast of a pattern, and that are finely patterned,
/// from which on there is none.
const HELD_BACK: f64 = 0.25;
const PATTERNED: (f64, f64) = (0.8, 0.9);
/// Images between two searches for a rival pose.
const RIVAL_EVERY: usize = 4;
/// Most images between two searches for a rival pose while the share stays low.
const RIVAL_SELDOM: usize = 16;

impl Tracker {
    /// Updates the drift of the orientation by an accepted pose; `foreseen` is the variance
    /// predicted without this image, or none where the object was lost.
    pub(crate) fn follow_drift(&mut self, hypothesis: &Hypothesis, foreseen: Option<f64>) {
        let slip = slip(&hypothesis.quality, self.frame.open());
        self.note_unseen_turn(hypothesis);
        let (points, radius) = (&mut self.target.points, self.target.solid.radius);
        let known = points.drift_seen(&self.workspace.matches, &hypothesis.toward, slip * slip);
        let lost = FOUND_RAD * FOUND_RAD;
        let drift = known.unwrap_or(points.drift_variance + foreseen.unwrap_or(lost));
        let (together, lasting) = NOISE;
        points.noise_variance *= lasting;
        let relief = &mut self.target.relief;
        if relief.is_open || points.are_from_body(&self.workspace.matches) {
            let noise = turn_variance(&hypothesis.normal, radius);
            relief.note_noise(noise);
            // A relief that is a guess, or estimated from motion, cannot confirm itself.
            if relief.adds_noise() {
                points.noise_variance = points.noise_variance.max(together.powi(2) * noise);
            }
        }
        // Where much is missed, an apparently known side may be another one.
        let is_clear = hypothesis.quality.share >= CLEAR;
        let drift = if self.trust.turn_unseen > 0 {
            points.note_sliding(&self.workspace.matches);
            self.target.keyframes.followed = false;
            drift.max(lost)
        } else {
            drift
        };
        points.drift_variance = if is_clear { drift } else { drift.max(points.drift_variance) };
    }

    /// Updates the variances of a pose that are due to a relief which nothing confirms, where the
    /// distances of most points that agree with the images came from the body alone.
    pub(crate) fn doubt_turn(&mut self, observation: &Observation<'_>, pose: &Pose) {
        let Target { points, relief, keyframes, .. } = &mut self.target;
        let is_guess = points.are_from_body(&self.workspace.matches);
        let camera = object_from_camera(observation, pose);
        let variance = relief.turn_variance(camera, keyframes);
        points.relief_variance = if is_guess { variance } else { 0.0 };
        relief.follow_turn(&camera, is_guess && !self.settings.known_shape);
    }

    /// Where sides are seen that are known better than those followed, turns back what was learned
    /// since, and the motion, unless shading shows them; `before` is the drift of the orientation
    /// before, as a variance.
    pub(crate) fn close_loop(&mut self, expected: &Pose, hypothesis: &Hypothesis, before: f64) {
        let (least, left) = CLOSED;
        let after = self.target.points.drift_variance;
        // In the step in which a known side was recognised, the loop is already closed.
        let is_over = self.target.keyframes.is_open();
        if before < least * least || after > left * before || self.is_plain() || is_over {
            return;
        }
        let off = (expected.inverse() * hypothesis.pose).log();
        self.turn_back(expected, &off, (before, after));
    }

    /// Turns back what was learned since the orientation was known as well as after a motion that
    /// closes a loop, and the motion; `drifts` are its variances before and after that.
    pub(crate) fn turn_back(&mut self, expected: &Pose, off: &Twist, drifts: (f64, f64)) {
        let since = self.target.keyframes.last_known(drifts.1);
        self.target.points.turn_back(off, drifts, since);
        self.target.ranges.turn_back(off, drifts, since);
        self.target.keyframes.tie(expected);
        self.target.keyframes.turn_back(off, drifts, since);
        self.target.points.know_drift(self.target.keyframes.drifts_of_points());
        self.pending = None;
        self.correct_motion(off);
        self.jitter.pause();
        self.held_back.pause();
        let degrees = off.fixed_rows::<3>(3).norm().to_degrees();
        self.frame.notices.push(Notice::LoopClosed { degrees });
    }

    /// Returns whether it is time to search for a rival pose at which more is recognised: every few
    /// images while the orientation may have drifted, and at growing intervals while more of the
    /// object is missed than usual.
    pub(crate) fn needs_rival(&mut self, quality: &Quality) -> bool {
        let is_adrift = self.target.points.drift_variance > ADRIFT_RAD * ADRIFT_RAD;
        let is_doubtful = quality.share < self.usual_share();
        let trust = &mut self.trust;
        trust.adrift = if is_adrift { trust.adrift + 1 } else { 0 };
        trust.doubtful = if is_doubtful { trust.doubtful + 1 } else { 0 };
        let is_time = |images: usize| {
            images > 1 && (images.is_power_of_two() || images.is_multiple_of(RIVAL_SELDOM))
        };
        is_adrift && trust.adrift.is_multiple_of(RIVAL_EVERY) || is_time(trust.doubtful)
    }

    /// Returns the variance of the orientation with which a new point is learned.
    pub(crate) fn drift_of_new_points(&self) -> f64 {
        let points = &self.target.points;
        points.drift_variance
            + points.noise_variance
            + points.held_back_variance
            + (STRAYS * self.motion.turn_sd()).powi(2)
    }

    /// Returns the covariance of a pose due to drift and to a guessed body, in the object's frame.
    pub(crate) fn drift_covariance(&self) -> Matrix6<f64> {
        let Target { points, relief, solid, .. } = &self.target;
        let (shift, turned) = relief.systematic;
        let systematic = (turned - points.relief_variance).max(0.0);
        let of_turn = turn_covariance(points.turn_variance() + systematic, solid.radius);
        let place = solid.radius.powi(2) * shift;
        of_turn + Matrix6::from_diagonal(&Vector6::new(place, place, place, 0.0, 0.0, 0.0))
    }

    /// Returns the covariance of a pose due to shading that held points back as the object turned,
    /// beyond that of a guessed body, in the object's frame.
    pub(crate) fn shading_covariance(
        &self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) -> Matrix6<f64> {
        let Target { relief, solid, .. } = &self.target;
        let turned = relief.turned(&object_from_camera(observation, &hypothesis.pose));
        let held_back = HELD_BACK * shading(&hypothesis.quality) * turned;
        turn_covariance((held_back * held_back - relief.systematic.1).max(0.0), solid.radius)
    }
}

/// Returns the covariance of a pose whose orientation has a variance about any axis, and whose
/// position strays with it.
fn turn_covariance(variance: f64, radius: f64) -> Matrix6<f64> {
    let turn = variance / 3.0;
    let place = (PLACE * radius).powi(2) * turn;
    Matrix6::from_diagonal(&Vector6::new(place, place, place, turn, turn, turn))
}

/// Returns how much of what is recognised is shading, 0 to 1.
fn shading(quality: &Quality) -> f64 {
    let textured = (quality.textured + 1.0) / (quality.recognised + 1.0);
    let (contrast, fine) = (textured / PATTERNED.0, quality.fine_share() / PATTERNED.1);
    1.0 - contrast.min(1.0) * fine.min(1.0)
}

/// Returns the standard deviation, in radians, by which recognised points slip along the surface
/// per radian of rotation.
pub(super) fn slip(quality: &Quality, cameras: usize) -> f64 {
    let (few, most, half) = (SLIPS.0, SLIPS.1, SLIPS.2 * cameras.max(1) as f64);
    let textured = (quality.textured + 1.0) / (quality.recognised + 2.0);
    (few * (1.0 - textured) / (1.0 + (quality.recognised / half).powi(2))).min(most)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::track::trust;

    fn quality(recognised: f64, textured: f64) -> Quality {
        Quality { textured, ..trust::tests::quality(1.0, recognised) }
    }

    proptest! {
        #[test]
        fn more_points_and_more_of_them_printed_never_slip_more(
            recognised in 0.0..200.0_f64,
            part in 0.0..=1.0_f64,
            more in 0.0..50.0_f64,
        ) {
            let now = slip(&quality(recognised, part * recognised), 2);
            prop_assert!((0.0..=SLIPS.1).contains(&now));
            let textured = (part * recognised + more).min(recognised);
            prop_assert!(slip(&quality(recognised, textured), 2) <= now);
            let (many, all) = (recognised + more, part * recognised + more);
            prop_assert!(slip(&quality(many, all), 2) <= now);
        }

        #[test]
        fn what_is_finely_patterned_all_over_is_no_shading_and_more_of_a_pattern_never_is_more(
            recognised in 1.0..200.0_f64,
            part in 0.0..=1.0_f64,
            more in 0.0..=1.0_f64,
        ) {
            let seen = |textured: f64, fine: f64| Quality {
                fine: fine * recognised,
                ..quality(recognised, textured * recognised)
            };
            prop_assert!(shading(&seen(1.0, 1.0)) == 0.0);
            let now = shading(&seen(part, part));
            prop_assert!((0.0..=1.0).contains(&now));
            prop_assert!(shading(&seen(part.max(more), part)) <= now);
            prop_assert!(shading(&seen(part, part.max(more))) <= now);
        }
    }
}
