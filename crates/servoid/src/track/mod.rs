//! Observations and a body become estimates: where the object is in each image, and how well that
//! is known.

mod estimate;
mod one_step;

pub use estimate::{Estimate, Notice, Status, Timing};
pub use one_step::{Genes, Judge, OneStep, OneStepError, OneStepSettings};
