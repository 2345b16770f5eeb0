//! Ellipsoids, their outlines in cameras, and bodies: rigid sets of ellipsoids.

mod body;
mod ellipsoid;
mod mass;
mod outline;
mod quadric;
mod silhouette;

pub use body::Body;
pub use ellipsoid::Ellipsoid;
pub use mass::MassProperties;
pub use outline::{Outline, Projection};
pub use quadric::{Quadric, QuadricGradient};
pub use silhouette::silhouette;

/// Why numbers do not make a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ShapeError {
    /// A number is NaN or infinite.
    #[error("ellipsoid {index}: its {what} must be finite numbers, but hold {value}")]
    NotFinite {
        /// Which ellipsoid.
        index: usize,
        /// Which of its parts.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// A radius is not positive.
    #[error("ellipsoid {index}: its radii must be positive lengths in metres, but are {radii:?}")]
    Radii {
        /// Which ellipsoid.
        index: usize,
        /// Its radii.
        radii: [f64; 3],
    },
    /// The rotation is no unit quaternion.
    #[error("ellipsoid {index}: its rotation: {source}")]
    Rotation {
        /// Which ellipsoid.
        index: usize,
        /// What is wrong with it.
        source: crate::pose::PoseError,
    },
    /// A body has no ellipsoid or too many.
    #[error("a body has 1 to {max} ellipsoids, but {given} were given")]
    Count {
        /// How many were given.
        given: usize,
        /// Most that a body holds.
        max: usize,
    },
}
