//! Ellipsoids, their outlines in cameras, and bodies: rigid sets of ellipsoids.

mod body;
mod ellipsoid;
mod grid;
mod mass;
mod mesh;
mod outline;
mod quadric;
mod rebuilt;
mod section;
mod silhouette;
mod soup;

pub use body::Body;
pub use ellipsoid::Ellipsoid;
pub use grid::Grid;
pub use mass::MassProperties;
pub use mesh::Mesh;
pub(crate) use outline::product;
pub use outline::{Outline, Projection};
pub use quadric::{Quadric, QuadricGradient};
pub use rebuilt::Rebuilt;
pub use section::{Section, SectionGradient};
pub use silhouette::silhouette;
pub use soup::Soup;

use crate::words::were;

/// Why numbers do not make a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    /// A radius, or the distance from the origin, is beyond what can be computed with.
    #[error(
        "ellipsoid {index}: its radii must be {least:e} to {most:e} m and its center within \
         {most:e} m, but {value:e} is given for its {what}"
    )]
    Size {
        /// Which ellipsoid.
        index: usize,
        /// Which of its parts.
        what: &'static str,
        /// The number.
        value: f64,
        /// Smallest radius.
        least: f64,
        /// Largest radius and coordinate.
        most: f64,
    },
    /// The rotation is not a unit quaternion.
    #[error("ellipsoid {index}: its rotation: {source}")]
    Rotation {
        /// Which ellipsoid.
        index: usize,
        /// What is wrong with it.
        source: crate::pose::PoseError,
    },
    /// A body has no ellipsoid or too many.
    #[error("a body has 1 to {max} ellipsoids, but {given} {} given", were(*given))]
    Count {
        /// How many were given.
        given: usize,
        /// Most ellipsoids in a body.
        max: usize,
    },
    /// A vertex of a mesh is not finite.
    #[error("vertex {index} of the mesh must be three finite numbers, but it is {corner:?}")]
    Corner {
        /// Index of the vertex.
        index: usize,
        /// Its coordinates.
        corner: [f64; 3],
    },
    /// A surface is to be rebuilt from too many cells.
    #[error(
        "a surface is rebuilt from at most {most} cells along its longest side, but {cells} were \
         requested; use fewer"
    )]
    Cells {
        /// How many were requested.
        cells: usize,
        /// Most cells.
        most: usize,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error("the mesh has {corners} vertices, counted from 0, but a triangle refers to {face:?}")]
    Face {
        /// The triangle.
        face: [usize; 3],
        /// Number of vertices of the mesh.
        corners: usize,
    },
    /// The surface has a hole, or triangles with inconsistent orientation.
    #[error(
        "the mesh is not closed: {edges} of its edges do not have as many triangles on one side \
         as on the other; fill its holes and orient its triangles consistently"
    )]
    Open {
        /// Edges that are not balanced.
        edges: usize,
    },
    /// The mesh encloses no volume, or it is inside out.
    #[error(
        "the mesh has a volume of {0} cubic metres; it must be positive: vertices are in \
         counter-clockwise order seen from outside"
    )]
    Volume(f64),
}
