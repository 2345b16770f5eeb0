//! Numbers side by side in the registers of a processor: the arithmetic of scores and of rays.
//!
//! `Lanes` are what both have in common; `RowLanes` add what sums over rows need, `RayLanes` what
//! rays need. [`Backend`] chooses the instructions at run time, in one place. What is generic over
//! lanes is always inlined, so that it ends up whole in the function that enables a processor's
//! instructions.
//!
//! Every set of instructions gives the same bits: each operation is rounded as IEEE 754 has it, and
//! no multiplication is fused with an addition.

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
