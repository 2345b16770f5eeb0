//! Vectors of numbers in the registers of a processor, for the arithmetic of scores and of rays.
//!
//! `Lanes` are the common operations; `RowLanes` add those for sums over rows, `RayLanes` those for
//! rays. [`Backend`] selects the instructions at run time, in one place. Code that is generic over
//! lanes is always inlined, so that it is compiled inside the function that enables a processor's
//! instructions.
//!
//! Every set of instructions gives the same bits: each operation is rounded as IEEE 754 specifies,
//! and no multiplication is fused with an addition.

mod backend;
mod lanes;
mod portable;
#[cfg(target_arch = "x86_64")]
mod x86;

#[cfg(feature = "render")]
pub(crate) use backend::RayKernel;
pub(crate) use backend::RowKernel;
pub use backend::{Backend, BackendError};
#[cfg(feature = "render")]
pub(crate) use lanes::{EIGHT, RayLanes, Scalar, Single};
pub(crate) use lanes::{RowLanes, Truth};
