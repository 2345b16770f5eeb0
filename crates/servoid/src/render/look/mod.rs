//! Appearance of a surface where rays hit it: its paint, and the light that it reflects.

pub(super) mod light;
pub(super) mod paint;
pub(super) mod shade;
pub(super) mod surface;
