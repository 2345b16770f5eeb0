//! A small ray-caster: images of simple shapes and meshes under one distant lamp.
//!
//! A [`Scene`] contains visuals; their poses are given for each image, at one moment or at several
//! moments of one exposure. Images are the same, bit for bit, on any number of threads.

mod bounds;
mod depth;
mod draw;
mod look;
mod mesh;
mod normals;
mod placed;
mod rays;
mod scene;
mod sensor;
mod shape;
mod trace;
mod vector;

pub use depth::Depth;
pub use draw::Exposure;
pub use look::light::Lighting;
pub use look::paint::{Paint, Texture};
pub use mesh::Details;
use normals::corner_normals;
pub use scene::{Placement, Scene};

use crate::words::{s, were};

/// Longest length in metres: beyond it, single precision no longer resolves small details.
pub const MAX_LENGTH: f64 = 1e4;

/// Shortest length of a shape, in metres.
pub const MIN_LENGTH: f64 = 1e-6;

/// Why an image cannot be drawn.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// A size is not a length that a visual can have.
    #[error(
        "{what} is {value}, but a size must be a number of metres from {MIN_LENGTH} to {MAX_LENGTH}"
    )]
    Size {
        /// Name of the size.
        what: &'static str,
        /// What was given.
        value: f64,
    },
    /// A mesh has no triangle or too many.
    #[error("a mesh has from 1 to {max} faces, but {given} {} given", were(*given))]
    Faces {
        /// What was given.
        given: usize,
        /// Most faces.
        max: usize,
    },
    /// A vertex is not finite, or too far away.
    #[error(
        "vertex {index} of the mesh is {corner:?}, but its coordinates must be finite and within \
         {MAX_LENGTH} m of zero"
    )]
    Corner {
        /// Index of the vertex.
        index: usize,
        /// Its coordinates.
        corner: [f64; 3],
    },
    /// A triangle refers to a vertex that does not exist.
    #[error(
        "face {index} of the mesh names the vertices {}, but there are {corners}, counted from 0",
        shown(face)
    )]
    Face {
        /// Which triangle.
        index: usize,
        /// Its vertex indices.
        face: [usize; 3],
        /// Number of vertices.
        corners: usize,
    },
    /// An attribute is not given for each vertex.
    #[error(
        "{what} has {given} row{}, but the mesh has {corners} vertices; give one row for each",
        s(*given)
    )]
    Details {
        /// Its name.
        what: &'static str,
        /// Rows given.
        given: usize,
        /// Vertices of the mesh.
        corners: usize,
    },
    /// A texture coordinate is out of range.
    #[error("texture_coordinates has {0}, but each number must lie within 10000 of zero")]
    TexturePlace(f64),
    /// The triangles lie on top of each other.
    #[error(
        "the {faces} faces of the mesh overlap so much that no tree of boxes separates them; \
         remove duplicate faces"
    )]
    Tangled {
        /// Triangles of the mesh.
        faces: usize,
    },
    /// A colour, or the strength of a light, is out of range.
    #[error("{what} is {value:?}, but each of its numbers must lie from 0 to {max}")]
    Color {
        /// Its name.
        what: &'static str,
        /// What was given.
        value: Vec<f64>,
        /// Largest value.
        max: f64,
    },
    /// A number is out of range.
    #[error("{what} is {value}, but it must lie from {min} to {max}")]
    Range {
        /// Its name.
        what: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// The size of a texture does not match its bytes.
    #[error(
        "a texture has from 1 to {max} pixels along a side and 3 bytes per pixel, but {given} \
         bytes were given for {width}x{height} pixels"
    )]
    Texture {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
        /// Bytes given.
        given: usize,
        /// Most pixels along a side.
        max: usize,
    },
    /// The direction towards the lamp is not a direction.
    #[error("toward is {0:?}, but it must be a direction: three finite numbers, not all zero")]
    Toward([f64; 3]),
    /// There are not as many poses as visuals.
    #[error(
        "moment {moment} has {given} pose{} of visuals, but the scene holds {visuals} visual{}; \
         give one pose for each, in the order in which they were added",
        s(*given),
        s(*visuals)
    )]
    Poses {
        /// Which moment.
        moment: usize,
        /// Poses given.
        given: usize,
        /// Visuals of the scene.
        visuals: usize,
    },
    /// The lens and the visuals are not given at the same moments.
    #[error(
        "the lens has {lens} pose{} and the visuals have {visuals} set{} of poses, but both must be \
         given at the same moments, at least one",
        s(*lens),
        s(*visuals)
    )]
    Moments {
        /// Poses of the lens.
        lens: usize,
        /// Sets of poses of the visuals.
        visuals: usize,
    },
    /// There are more moments than rays in a pixel.
    #[error(
        "{moments} moments were given, but a pixel has only {rays} ray{}, one for each moment; \
         give fewer moments or more samples",
        s(*rays)
    )]
    TooManyMoments {
        /// Moments given.
        moments: usize,
        /// Rays of a pixel.
        rays: usize,
    },
    /// Something is too far away.
    #[error("{what} is {distance} m from the origin; bring it within {MAX_LENGTH} m")]
    Far {
        /// What it is.
        what: String,
        /// Its distance from the world's origin.
        distance: f64,
    },
    /// The threads could not be started.
    #[error("{threads} threads could not be started: {reason}; use fewer, or 0 for all cores")]
    Threads {
        /// Threads requested.
        threads: usize,
        /// The operating system's reason.
        reason: String,
    },
}

/// An index of `usize::MAX` stands for a negative one.
fn shown(face: &[usize; 3]) -> String {
    let name = |&i: &usize| if i == usize::MAX { "a negative one".into() } else { i.to_string() };
    face.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Returns a number if it lies in a range.
fn within(what: &'static str, value: f64, [min, max]: [f64; 2]) -> Result<f64, RenderError> {
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(RenderError::Range { what, value, min, max })
    }
}

/// Returns a colour, or the strengths of a light in red, green and blue, if it is in range.
fn color(what: &'static str, value: [f64; 3], max: f64) -> Result<[f64; 3], RenderError> {
    if value.iter().all(|x| (0.0..=max).contains(x)) {
        Ok(value)
    } else {
        Err(RenderError::Color { what, value: value.into(), max })
    }
}
