//! From an object's motion to joint speeds: the motion, estimated from poses that arrive late and
//! with correlated errors, the law of the hand, and the limits of hand and joints.

mod arm_error;
mod chain;
mod gaze;
mod hand;
mod hand_limits;
mod jacobian;
mod joint_law;
mod joint_limits;
mod measurement;
mod motion;
mod motion_model;
mod moving;
mod prediction;
mod stopping;
mod workspace;

pub use arm_error::ArmError;
pub use chain::{Chain, Link};
pub use gaze::{Gaze, fixation, seen_from_head};
pub use hand::{HandGains, correction, quaternion_error, shares, within};
pub use hand_limits::{Balls, Cuts, HandLimits};
pub use jacobian::Jacobian;
pub use joint_law::{QuadraticLaw, hand_weights, lost_speed, newton_turn};
pub use joint_limits::{Cause, JointLimits, JointMotion, JointRanges, SpeedWindow};
pub use measurement::{Measurement, Noise};
pub use motion::{Mixture, Motion};
pub use motion_model::{MotionModel, MotionPrior};
pub use moving::{Moving, change_between, shifted_and_turned};
pub use prediction::{Beside, Prediction, certain_twist, predict, spread_at};
pub use stopping::{stoppable_speed, stopping_distance};
pub use workspace::{Drift, VelocityLimits, Workspace};

/// Why a motion cannot be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// The covariance of an innovation is not positive and finite.
    #[error(
        "a measurement of an object's motion needs a positive and finite covariance, but the least \
         eigenvalue of that of its innovation is {0:.3e}"
    )]
    Innovation(f64),
    /// The offset of a measurement is not finite.
    #[error("the offset of a measurement must be made of finite numbers, but it holds {0}")]
    NotFinite(f64),
    /// A measurement has no axis.
    #[error("a measurement of an object's motion needs an axis at least, but it has none")]
    NoAxis,
    /// Matrices do not fit each other.
    #[error("{what} must have {wanted} numbers for this motion, but it has {given}")]
    Size {
        /// What was given.
        what: &'static str,
        /// The number that fits.
        wanted: usize,
        /// The number that was given.
        given: usize,
    },
}
