//! Observations and a body become estimates: where the object is in each image, and how well that
//! is known.

mod estimate;

pub use estimate::{Estimate, Notice, Status, Timing};
