//! The motion of an object, estimated from poses that arrive late and with correlated errors.

mod measurement;
mod motion;
mod motion_model;

pub use measurement::{Measurement, Noise};
pub use motion::{Mixture, Motion};
pub use motion_model::{MotionModel, MotionPrior};

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
