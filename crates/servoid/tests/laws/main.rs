//! Laws of the core, in one program: shared code is built and linked once.

#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    reason = "a test that cannot go on has failed; what it expects may come from any library"
)]

mod arm;
mod arm_limits;
mod contour;
mod coverage;
mod evidence;
mod evolved;
mod from_masks;
mod geometry;
mod lens;
mod mass;
mod mesh;
mod modelling;
mod motion;
mod one_step;
mod points;
mod pyramid;
mod range_samples;
#[cfg(feature = "render")]
mod raycast;
mod scenes;
mod score;
mod search;
mod shapes;
mod surface;
mod track;
mod track_extremes;
mod track_faults;
mod track_frozen;
mod track_learning;
mod track_units;
mod volume;
