//! The probability that a pose is right: all evidence for it, added up as log-odds.
//!
//! The weights are those of a logistic regression over recordings and simulated sequences, each of
//! which has the same weight; factors for drift and for poses that look alike were added since.
//! `benches/trust/confidence.py` fits the weights over fewer sequences, with both factors, and
//! reports their performance on those left out.

use std::f64::consts::SQRT_2;

use crate::track::estimate::Status;

/// The evidence for and against the pose of an object that is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Share of what should be visible that is seen, 0 to 1; the more is seen elsewhere, the less a
    /// hidden part counts.
    pub share: f64,
    /// Surface points that are recognised, as the mean over the cameras that see the object.
    pub recognised: f64,
    /// Those of them with the contrast of a pattern.
    pub textured: f64,
    /// The number of those usually recognised.
    pub reference_textured: f64,
    /// Whether the object was never lost, or is proved to be the lost one.
    pub proved: bool,
    /// Standard deviation of the orientation due to image noise, in radians.
    pub turn_rad: f64,
    /// The same, estimated from how poses differ from image to image without any motion.
    pub jitter_rad: f64,
    /// Standard deviation of the orientation since the first image, from the uncertainty with which
    /// the visible sides were learned, in radians.
    pub drift_rad: f64,
    /// Whether the outline of a known shape alone shows the orientation; it does not drift then.
    pub by_outline: bool,
}

/// Log-odds of a pose without any evidence for it.
const AT_LEAST: f64 = -3.74;
/// Contribution of a share of 1.
const SHARE: f64 = 0.56;
/// Contribution of an object that is textured all over: this many points per camera have the
/// contrast of a pattern, and this part of the recognised ones, times the share.
const TEXTURED: (f64, f64, f64) = (30.0, 0.72, 1.98);
/// Number of points per camera that usually have that contrast from which on each contributes, the
/// number up to which they do, and their contribution in total.
const REFERENCE: (f64, f64, f64) = (15.0, 40.0, 1.94);
/// Standard deviation of the orientation due to noise at which it contributes nothing, the least
/// and the greatest that are distinguished, all in radians, and the penalty per factor of e.
const TURN: (f64, f64, f64, f64) = (0.02, 0.001, 1.0, 0.99);
/// The same for the jitter of poses: an object that jumps appears to jitter as well.
const JITTER: (f64, f64, f64, f64) = (0.05, 0.003, 0.0675, 3.44);
/// Jitter assumed for an object of which no images were compared yet: it cannot have turned far
/// unseen.
pub(crate) const UNMEASURED: f64 = 0.03;
/// Contribution of an object that is proved to be the lost one, or was never lost.
const PROVED: f64 = 2.15;
/// Of an object that was found again and is not proved, which may be at another pose: the share up
/// to which the pose is the least probable, that from which on it is as probable as its evidence
/// says, and the least factor of the probability.
const SAME_POSE: (f64, f64, f64) = (0.58, 0.9, 0.1);
/// Log-odds of a pose whose orientation the outline of a known shape shows: of 440 poses of drawn
/// objects all were right.
const OUTLINED: f64 = 3.5;
/// Orientation error of a right pose at most, in radians.
const MOST_RAD: f64 = 0.26;
/// Part of the points that usually have the contrast of a pattern which must be recognised for the
/// drift they show to be fully trusted: with fewer, it is trusted less.
const WITNESSES: f64 = 0.8;
/// Standard deviation of the orientation, in radians, for which any points suffice.
const SURE_RAD: f64 = 0.04;
/// Probability that the last pose is right while the object is sought.
const UNSEEN: f64 = 0.1;

impl Evidence {
    /// Returns the probability that the pose is right: not more than 20 mm, or a tenth of the
    /// object's diameter if that is more, and 15 degrees off.
    #[must_use]
    pub fn probability(&self) -> f64 {
        let ramp = |x: f64, (from, to, most): (f64, f64, f64)| {
            most * ((x - from) / (to - from)).clamp(0.0, 1.0)
        };
        let spread = |x: f64, (none, least, most, weight): (f64, f64, f64, f64)| {
            -weight * libm::log(x.clamp(least, most) / none)
        };
        let (many, most, all_over) = TEXTURED;
        let is_textured =
            self.textured >= many && self.textured * self.share >= most * self.recognised;
        let odds = AT_LEAST
            + SHARE * self.share
            + if is_textured { all_over } else { 0.0 }
            + ramp(self.reference_textured, REFERENCE)
            + if self.proved { PROVED } else { 0.0 }
            + spread(self.turn_rad, TURN)
            + spread(self.jitter_rad, JITTER);
        let odds = if self.by_outline { odds.max(OUTLINED) } else { odds };
        self.same_pose() * self.on_course() / (1.0 + libm::exp(-odds))
    }

    /// Returns the probability that the object is at this pose, and not at one that looks alike.
    fn same_pose(&self) -> f64 {
        let (from, to, least) = SAME_POSE;
        if self.proved { 1.0 } else { ((self.share - from) / (to - from)).clamp(least, 1.0) }
    }

    /// Returns whether the orientation drifted by no more than a standard deviation, judged by the
    /// recognised points: those that slip along the surface drift together, and show nothing of it.
    pub(crate) fn drifts_little(&self, most_rad: f64) -> bool {
        let part = (self.textured / (WITNESSES * self.reference_textured)).min(1.0);
        self.drift_rad <= (part * most_rad).max(SURE_RAD)
    }

    /// Returns the probability that the orientation did not drift too far since the first image.
    fn on_course(&self) -> f64 {
        libm::erf(MOST_RAD / (SQRT_2 * self.drift_rad))
    }
}

/// Returns the probability that the last pose of an object that is not followed is still right.
pub(crate) fn unseen(status: Status) -> f64 {
    if status == Status::Lost { 0.0 } else { UNSEEN }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn evidence() -> impl Strategy<Value = Evidence> {
        (
            (0.0..=1.0, 0.0..90.0, 0.0..=1.0, 0.0..90.0),
            any::<[bool; 2]>(),
            (0.0..4.0, 0.0..4.0, 0.0..1.0),
        )
            .prop_map(
                |(
                    (share, recognised, part, reference_textured),
                    [proved, by_outline],
                    (turn_rad, jitter_rad, drift_rad),
                )| Evidence {
                    share,
                    recognised,
                    textured: part * recognised,
                    reference_textured,
                    proved,
                    turn_rad,
                    jitter_rad,
                    drift_rad,
                    by_outline,
                },
            )
    }

    proptest! {
        #[test]
        fn more_evidence_for_a_pose_never_lowers_its_probability(one in evidence(), more in 0.0..5.0_f64) {
            let before = one.probability();
            prop_assert!(before > 0.0 && before < 1.0);
            for other in [
                Evidence { share: f64::min(one.share + more, 1.0), ..one },
                Evidence { textured: f64::min(one.textured + more, one.recognised), ..one },
                Evidence { reference_textured: one.reference_textured + more, ..one },
                Evidence { proved: true, ..one },
                Evidence { turn_rad: one.turn_rad / (1.0 + more), ..one },
                Evidence { jitter_rad: one.jitter_rad / (1.0 + more), ..one },
                Evidence { drift_rad: one.drift_rad / (1.0 + more), ..one },
                Evidence { by_outline: true, ..one },
            ] {
                prop_assert!(other.probability() >= before);
            }
        }
    }

    proptest! {
        #[test]
        fn less_drift_and_more_of_what_is_printed_are_never_less_on_course(
            one in evidence(),
            more in 0.0..50.0_f64,
        ) {
            let most = crate::track::trust::ADRIFT_RAD;
            let other = Evidence {
                textured: one.textured + more,
                drift_rad: one.drift_rad / (1.0 + more),
                ..one
            };
            prop_assert!(other.drifts_little(most) || !one.drifts_little(most));
            prop_assert!(!one.drifts_little(most) || one.drift_rad <= most);
            let unprinted = Evidence { textured: 0.0, reference_textured: 0.0, ..one };
            prop_assert_eq!(unprinted.drifts_little(most), one.drift_rad <= most);
        }
    }

    proptest! {
        #[test]
        fn a_pose_found_again_that_is_not_proved_is_no_more_likely_than_what_is_seen_of_it(
            one in evidence(),
        ) {
            let found = Evidence { proved: false, ..one };
            let (from, to, least) = SAME_POSE;
            let most = (found.share - from) / (to - from);
            prop_assert!(found.probability() <= most.max(least));
        }
    }

    #[test]
    fn a_turn_of_which_nothing_is_known_is_as_good_as_none() {
        let known = Evidence {
            share: 1.0,
            recognised: 52.0,
            textured: 50.0,
            reference_textured: 50.0,
            proved: true,
            turn_rad: 0.01,
            jitter_rad: 0.01,
            drift_rad: 0.0,
            by_outline: false,
        };
        assert!(known.probability() > 0.98);
        for nothing in [f64::INFINITY, 1e300, 3.0] {
            let open = Evidence { turn_rad: nothing, jitter_rad: nothing, ..known };
            assert!(open.probability() < 0.5, "{nothing}");
            assert_eq!(
                open.probability(),
                Evidence { turn_rad: 1.0, jitter_rad: 1.0, ..known }.probability()
            );
        }
    }
}
