//! How far the object's turn may have drifted since the first image. A surface point tells the turn
//! only as well as that of the pose it was learned at was known, and what looks alike wherever it
//! lies on the surface, as shading does, slips along. Where sides are seen again that are known
//! better, what was learned on the way is turned back by its share of what had drifted.

use nalgebra::{Matrix6, Vector6};

use crate::pose::Pose;
use crate::track::adjust::TOGETHER;
use crate::track::estimate::Notice;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::uncertainty::uncertainty;
use crate::track::pose::verify::Quality;
use crate::track::tracker::Tracker;
use crate::track::trust::{ADRIFT, CLEAR};

/// By what a turn slips for each radian, as a standard deviation, where nothing has the contrast of
/// a pattern and few points are recognised; the most of it; and recognised points of each camera
/// that halve it.
const SLIPS: (f64, f64, f64) = (2.0, 0.5, 20.0);
/// Standard deviation, in radians, of the turn of an object that is found again with too few points
/// that were known.
const FOUND_RAD: f64 = 0.3;
/// Standard deviation of the turn, in radians, from which on a loop may be closed, and the part of
/// its variance that is left then at most.
const CLOSED: (f64, f64) = (0.03, 0.25);
/// By how much more the turn strays where points are learned than its noise says.
const STRAYS: f64 = 3.0;
/// Part of the object's radius by which its place strays while the turn does by one radian.
const PLACE: f64 = 0.2;
/// Images from one in which another pose is sought to the next.
const RIVAL_EVERY: usize = 4;
/// Most images from one search for another pose to the next while the share stays so low.
const RIVAL_SELDOM: usize = 16;

impl Tracker {
    /// Says anew how far the turn may have drifted at a pose that is believed; `foreseen` is its
    /// variance without this image, or nothing where the object was lost.
    pub(crate) fn follow_drift(&mut self, hypothesis: &Hypothesis, foreseen: Option<f64>) {
        let slip = slip(&hypothesis.quality, self.frame.open());
        let (points, radius) = (&mut self.target.points, self.target.solid.radius);
        let known = points.drift_seen(&self.workspace.matches, &hypothesis.toward, slip * slip);
        let lost = FOUND_RAD * FOUND_RAD;
        let drift = known.unwrap_or(points.drift + foreseen.unwrap_or(lost));
        if self.target.relief.is_open {
            let known = uncertainty(&hypothesis.normal, radius).covariance;
            // A relief that motion told may be another one that looks alike, and is no witness of
            // itself.
            let turn = known.fixed_view::<3, 3>(3, 3).trace();
            points.noise = points.noise.max(TOGETHER.powi(2) * turn);
        }
        // Where much is missed, what seems to be a known side may be another one.
        let is_clear = hypothesis.quality.share >= CLEAR;
        points.drift = if is_clear { drift } else { drift.max(points.drift) };
    }

    /// Where sides are seen that are known better than those that were followed, turns back what
    /// was learned on the way, and the motion; `before` is what the turn may have drifted before,
    /// as a variance.
    pub(crate) fn close_loop(&mut self, expected: &Pose, hypothesis: &Hypothesis, before: f64) {
        let (least, left) = CLOSED;
        let after = self.target.points.drift;
        if before < least * least || after > left * before {
            return;
        }
        let off = (expected.inverse() * hypothesis.pose).log();
        let since = self.target.keyframes.last_known(after);
        self.target.points.turn_back(&off, (before, after), since);
        self.target.ranges.turn_back(&off, (before, after), since);
        self.target.keyframes.tie(expected);
        self.target.keyframes.turn_back(&off, (before, after), since);
        self.target.bias.correct(&off);
        self.pending = None;
        self.motion.correct(&off);
        self.jitter.pause();
        let degrees = off.fixed_rows::<3>(3).norm().to_degrees();
        self.frame.notices.push(Notice::LoopClosed { degrees });
    }

    /// Returns whether it is time to seek another pose at which more is recognised: in one of every
    /// few images while the turn may have drifted, and ever more seldom while more of the object is
    /// missed than usually.
    pub(crate) fn seeks_rival(&mut self, quality: &Quality) -> bool {
        let is_adrift = self.target.points.drift > ADRIFT * ADRIFT;
        let is_doubtful = quality.share < self.usual_share();
        let trust = &mut self.trust;
        trust.adrift = if is_adrift { trust.adrift + 1 } else { 0 };
        trust.doubtful = if is_doubtful { trust.doubtful + 1 } else { 0 };
        let is_time = |images: usize| {
            images > 1 && (images.is_power_of_two() || images.is_multiple_of(RIVAL_SELDOM))
        };
        is_adrift && trust.adrift.is_multiple_of(RIVAL_EVERY) || is_time(trust.doubtful)
    }

    /// Returns the variance of the turn with which a point is known that is learned now.
    pub(crate) fn drift_of_new_points(&self) -> f64 {
        self.target.points.drift + (STRAYS * self.motion.turn_sd()).powi(2)
    }

    /// Returns the covariance of a pose by what it may have drifted, in the object's frame.
    pub(crate) fn drift_covariance(&self) -> Matrix6<f64> {
        let turn = self.target.points.turn_variance() / 3.0;
        let place = (PLACE * self.target.solid.radius).powi(2) * turn;
        Matrix6::from_diagonal(&Vector6::new(place, place, place, turn, turn, turn))
    }
}

/// Returns the standard deviation by which what is recognised slips along the surface while the
/// object turns by one radian, in radians.
fn slip(quality: &Quality, cameras: usize) -> f64 {
    let (few, most, half) = (SLIPS.0, SLIPS.1, SLIPS.2 * cameras.max(1) as f64);
    let textured = (quality.textured + 1.0) / (quality.recognised + 2.0);
    (few * (1.0 - textured) / (1.0 + (quality.recognised / half).powi(2))).min(most)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn quality(recognised: f64, textured: f64) -> Quality {
        let (visible, share, support) = (1.0, 1.0, recognised);
        let printed = textured;
        Quality { visible, share, support, recognised, textured, printed, ratio: 1.0, outline: 1.0 }
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
    }
}
