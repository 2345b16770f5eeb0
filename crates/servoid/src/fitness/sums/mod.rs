//! Sums over the rows of score maps between outlines, and their gradients.

pub(super) mod boundary;
pub(super) mod map;
pub(super) mod rows;
pub(super) mod running;
pub(super) mod sweep;
