use std::sync::Mutex;

use super::look::paint::Paint;
use super::mesh::{Details, Mesh};
use super::rays::Rays;
use super::shape::Shape;
use super::{Lighting, MAX_LENGTH, MIN_LENGTH, RenderError};
use crate::camera::Lens;
use crate::pose::Pose;

/// Visuals (shapes with paint) that are drawn by ray casting.
#[derive(Debug, Default)]
pub struct Scene {
    pub(super) visuals: Vec<Visual>,
    pub(super) kept: Kept,
}

/// Cache of the rays of the last lenses: inverting a distortion takes time.
#[derive(Debug, Default)]
pub(super) struct Kept {
    pub rays: Mutex<Vec<std::sync::Arc<Rays<f32>>>>,
    pub exact: Mutex<Vec<std::sync::Arc<Rays<f64>>>>,
}

#[derive(Debug)]
pub(super) struct Visual {
    pub shape: Shape,
    pub paint: Paint,
    /// Middle and half sizes of a box around it, in its own frame, with a margin for rounding.
    pub bounds: ([f64; 3], [f64; 3]),
}

/// Poses of a lens and of the visuals of a scene during one exposure.
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

    /// Returns the number of visuals.
    #[must_use]
    pub fn count(&self) -> usize {
        self.visuals.len()
    }

    /// Adds an ellipsoid by its radii; returns its index. A texture wraps around z once, and runs
    /// from +z down to -z.
    ///
    /// # Errors
    /// If a radius is not a valid length.
    pub fn add_ellipsoid(&mut self, radii: [f64; 3], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Ellipsoid { radii: sizes("radii", radii)? }, paint))
    }

    /// Adds a capsule along z: a cylinder of the given half length with half balls on its ends.
    ///
    /// # Errors
    /// If a size is not a valid length.
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
    /// If a size is not a valid length.
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
    /// If a size is not a valid length.
    pub fn add_box(&mut self, half_size: [f64; 3], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Box { half_size: sizes("half_size", half_size)? }, paint))
    }

    /// Adds a rectangle in the xy plane that is visible from both sides; the top of a texture lies
    /// towards +y.
    ///
    /// # Errors
    /// If a size is not a valid length.
    pub fn add_plane(&mut self, half_size: [f64; 2], paint: Paint) -> Result<usize, RenderError> {
        Ok(self.add(Shape::Plane { half_size: sizes("half_size", half_size)? }, paint))
    }

    /// Adds triangles that are visible from both sides; vertices in metres.
    ///
    /// # Errors
    /// If there is no triangle, a vertex is not finite or does not exist, or `details` are not
    /// given for each vertex.
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
        let bounds = shape.bounds();
        self.visuals.push(Visual { shape, paint, bounds });
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

#[cfg(test)]
mod tests {
    use super::super::{Exposure, Texture};
    use super::*;
    use crate::camera::Distortion;
    use crate::simd::Backend;

    fn pose(x: f64, y: f64, turn: f64) -> Pose {
        let (s, c) = libm::sincos(0.5 * turn);
        Pose::from_parts([x, y, 0.6], [c, 0.6 * s, 0.8 * s, 0.0]).unwrap()
    }

    /// One visual of each kind.
    fn scene() -> (Scene, Vec<Pose>) {
        let bytes: Vec<u8> = (0..3 * 16 * 8).map(|i| (i * 37 % 256) as u8).collect();
        let painted = Paint::default().with_texture(Texture::new(&bytes, [16, 8]).unwrap());
        let painted = painted.with_gloss(0.4).unwrap();
        let mut scene = Scene::new();
        scene.add_ellipsoid([0.08, 0.05, 0.04], painted.clone()).unwrap();
        scene.add_capsule(0.03, 0.05, painted.clone()).unwrap();
        scene.add_cylinder(0.04, 0.05, painted.clone()).unwrap();
        scene.add_box([0.04, 0.05, 0.03], painted.clone()).unwrap();
        scene.add_plane([0.4, 0.4], painted).unwrap();
        let corners = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [-0.1, -0.1, -0.1]];
        let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        scene.add_mesh(&corners, &faces, &Details::default(), Paint::default()).unwrap();
        let poses = [
            pose(-0.12, -0.1, 0.4),
            pose(0.1, -0.1, 1.0),
            pose(0.12, 0.08, 2.0),
            pose(-0.1, 0.08, 0.7),
            pose(0.0, 0.0, 0.2),
            pose(0.0, 0.0, 0.9),
        ];
        (scene, poses.into())
    }

    #[test]
    fn every_back_end_gives_the_same_bits() {
        let (scene, poses) = scene();
        let lighting = Lighting { toward: [0.3, -0.5, -0.8], ..Lighting::default() };
        let exposure = Exposure { noise: 3.0, ..Exposure::default() };
        for distortion in [Distortion::None, Distortion::KannalaBrandt([0.02, 0.0, 0.0, 0.0])] {
            let lens = Lens::new([93, 61], [80.0, 81.0], [45.0, 31.0], distortion).unwrap();
            let placement = Placement {
                lens: &lens,
                world_from_lens: &[
                    Pose::identity(),
                    pose(0.01, 0.0, 0.0) * pose(0.0, 0.0, 0.0).inverse(),
                ],
                world_from_visual: &[poses.clone(), poses.clone()],
                lighting: &lighting,
            };
            let best = scene.render(&placement, &exposure).unwrap();
            let portable = scene.render_by(&placement, &exposure, Backend::PORTABLE).unwrap();
            assert!(best.iter().any(|&byte| byte > 100));
            assert_eq!(best, portable);
        }
    }
}
