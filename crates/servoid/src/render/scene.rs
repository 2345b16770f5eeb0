use std::sync::Mutex;

use super::mesh::{Details, Mesh};
use super::paint::Paint;
use super::rays::Rays;
use super::shape::Shape;
use super::{Lighting, MAX_LENGTH, MIN_LENGTH, RenderError};
use crate::camera::Lens;
use crate::pose::Pose;

/// Visuals, which are shapes with paint, drawn by casting rays.
#[derive(Debug, Default)]
pub struct Scene {
    pub(super) visuals: Vec<Visual>,
    pub(super) kept: Kept,
}

/// Rays of the lenses that were last drawn through: the inverse of a distortion takes its time.
#[derive(Debug, Default)]
pub(super) struct Kept {
    pub rays: Mutex<Vec<std::sync::Arc<Rays<f32>>>>,
    pub exact: Mutex<Vec<std::sync::Arc<Rays<f64>>>>,
}

#[derive(Debug)]
pub(super) struct Visual {
    pub shape: Shape,
    pub paint: Paint,
    /// Centre and radius of a ball around it, in its own frame.
    pub ball: ([f64; 3], f64),
}

/// Where a lens and the visuals of a scene are during one exposure.
#[derive(Debug, Clone, Copy)]
pub struct Placement<'a> {
    /// The lens.
    pub lens: &'a Lens,
    /// Poses of the lens, one for each moment.
    pub world_from_lens: &'a [Pose],
    /// Poses of all visuals at each moment.
    pub world_from_visual: &'a [Vec<Pose>],
    /// The light.
    pub lighting: &'a Lighting,
}

impl Scene {
    /// Makes an empty scene.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Gives how many visuals there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.visuals.len()
    }

    /// Adds an ellipsoid by its radii; gives its number. A texture goes round z once, and from +z
    /// down to -z.
    ///
    /// # Errors
    /// If a radius is no length.
    pub fn add_ellipsoid(&mut self, radii: [f64; 3], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Ellipsoid { radii: sizes("radii", radii)? }, paint))
    }

    /// Adds a capsule along z: a cylinder of that half length with half balls on its ends.
    ///
    /// # Errors
    /// If a size is no length.
    pub fn add_capsule(
        &mut self,
        radius: f64,
        half_length: f64,
        paint: Paint,
    ) -> Result<usize, RenderError> {
        let (radius, half_length) = (size("radius", radius)?, size("half_length", half_length)?);
        Ok(self.add(Shape::Capsule { radius, half_length }, paint))
    }

    /// Adds a cylinder along z with flat ends.
    ///
    /// # Errors
    /// If a size is no length.
    pub fn add_cylinder(
        &mut self,
        radius: f64,
        half_length: f64,
        paint: Paint,
    ) -> Result<usize, RenderError> {
        let (radius, half_length) = (size("radius", radius)?, size("half_length", half_length)?);
        Ok(self.add(Shape::Cylinder { radius, half_length }, paint))
    }

    /// Adds a box; a texture lies on each of its faces.
    ///
    /// # Errors
    /// If a size is no length.
    pub fn add_box(&mut self, half_size: [f64; 3], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Box { half_size: sizes("half_size", half_size)? }, paint))
    }

    /// Adds a rectangle in the plane of x and y that is seen from both sides; the top of a texture
    /// lies towards +y.
    ///
    /// # Errors
    /// If a size is no length.
    pub fn add_plane(&mut self, half_size: [f64; 2], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Plane { half_size: sizes("half_size", half_size)? }, paint))
    }

    /// Adds triangles that are seen from both sides; corners in metres.
    ///
    /// # Errors
    /// If there is no triangle, a corner is not finite or not there, or `details` are not given for
    /// each corner.
    pub fn add_mesh(
        &mut self,
        vertices: &[[f64; 3]],
        faces: &[[usize; 3]],
        details: &Details,
        paint: Paint,
    ) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Mesh(Mesh::new(vertices, faces, details)?), paint))
    }

    fn add(&mut self, shape: Shape, paint: Paint) -> usize {
        let ball = shape.ball();
        self.visuals.push(Visual { shape, paint, ball });
        self.visuals.len() - 1
    }
}

impl Placement<'_> {
    pub(super) fn check(&self, scene: &Scene) -> Result<(), RenderError> {
        self.lighting.check()?;
        let (lens, visuals) = (self.world_from_lens.len(), self.world_from_visual.len());
        if lens != visuals || lens == 0 {
            return Err(RenderError::Moments { lens, visuals });
        }
        for (moment, poses) in self.world_from_visual.iter().enumerate() {
            let (given, visuals) = (poses.len(), scene.visuals.len());
            if given != visuals {
                return Err(RenderError::Poses { moment, given, visuals });
            }
        }
        let lenses = self.world_from_lens.iter().map(|pose| (None, pose));
        let visuals = self.world_from_visual.iter().flat_map(|poses| poses.iter().enumerate());
        for (number, pose) in lenses.chain(visuals.map(|(i, pose)| (Some(i), pose))) {
            let distance = pose.translation().norm();
            if distance > MAX_LENGTH {
                let what = number.map_or("the lens".into(), |i| format!("visual {i}"));
                return Err(RenderError::Far { what, distance });
            }
        }
        Ok(())
    }
}

fn size(what: &'static str, value: f64) -> Result<f64, RenderError> {
    if (MIN_LENGTH..=MAX_LENGTH).contains(&value) {
        Ok(value)
    } else {
        Err(RenderError::Size { what, value })
    }
}

fn sizes<const N: usize>(what: &'static str, values: [f64; N]) -> Result<[f64; N], RenderError> {
    for value in values {
        size(what, value)?;
    }
    Ok(values)
}
