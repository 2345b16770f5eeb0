//! What is known of the object.

pub(super) mod keyframes;
pub(super) mod solid;
pub(super) mod usual;

use self::keyframes::Keyframes;
use self::solid::Solid;
use self::usual::Usual;
use super::colors::Colors;
use super::points::Points;
use crate::shape::Body;

/// What is known of the object: its shape, what it looks like, and what is usual of it.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub(super) body: Body,
    /// The body, ready for outlines and for rays.
    pub(super) solid: Solid,
    pub(super) points: Points,
    pub(super) colors: Colors,
    pub(super) keyframes: Keyframes,
    pub(super) usual: Usual,
}

impl Target {
    /// Starts with a body of which nothing else is known.
    pub(super) fn new(body: &Body, local_colors: bool) -> Self {
        Self {
            body: body.clone(),
            solid: Solid::new(body),
            points: Points::default(),
            colors: Colors::new(local_colors),
            keyframes: Keyframes::default(),
            usual: Usual::default(),
        }
    }
}
