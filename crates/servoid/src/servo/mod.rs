//! The motion of an object, estimated from poses that arrive late and with correlated errors.

mod measurement;
mod motion;
mod motion_model;
mod rows;

pub use measurement::{Measurement, Noise};
pub use motion::{Mixture, Motion};
pub use motion_model::{MotionModel, MotionPrior};

/// Why a motion cannot be estimated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MotionError {
    /// A measurement has no usable covariance.
    #[error(
        "a measurement of an object's motion needs a positive and finite covariance, but its \
         innovation has none"
    )]
    Innovation,
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
