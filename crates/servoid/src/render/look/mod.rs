//! What a surface looks like where rays meet it: its paint, and the light that it sends back.

pub(super) mod light;
pub(super) mod paint;
pub(super) mod shade;
pub(super) mod surface;
