use nalgebra::{Matrix3, Vector2, Vector3};

use crate::camera::DepthView;
use crate::shape::Projection;
use crate::track::target::solid::Solid;

/// A depth image of the object at a pose: it measures positions in the object's frame.
#[derive(Debug)]
pub(crate) struct Rangefinder<'a> {
    pub(crate) projection: Projection,
    /// Position of the camera, in the object's frame.
    pub(crate) eye: Vector3<f64>,
    depth: &'a DepthView<'a>,
    object_from_ray: Matrix3<f64>,
}

impl<'a> Rangefinder<'a> {
    /// Combines a depth image with the projection of the object's frame into its camera; none if
    /// that projection is degenerate.
    pub(crate) fn new(depth: &'a DepthView<'a>, projection: Projection) -> Option<Self> {
        let (eye, object_from_ray) = (projection.eye()?, projection.linear.try_inverse()?);
        Some(Self { projection, eye, depth, object_from_ray })
    }

    /// Returns the position seen at the nearest pixel, and its distance along the camera's axis, in
    /// metres, if it was measured.
    pub(crate) fn place(&self, pixel: &Vector2<f64>) -> Option<(Vector3<f64>, f64)> {
        let metres = self.depth.at(pixel.x, pixel.y)?;
        Some((self.back_project(pixel, metres), metres))
    }

    /// Returns how far behind the body's surface something was measured at a pixel, and its distance
    /// along the camera's axis, in metres; none beside the body.
    pub(crate) fn behind(&self, solid: &Solid, pixel: &Vector2<f64>) -> Option<(f64, f64)> {
        let (found, metres) = self.place(pixel)?;
        let way = found - self.eye;
        let hit = solid.hit(&self.eye, &way.normalize())?;
        Some((way.norm() - (hit.point - self.eye).norm(), metres))
    }

    fn back_project(&self, pixel: &Vector2<f64>, metres: f64) -> Vector3<f64> {
        let seen = Vector3::new(libm::round(pixel.x), libm::round(pixel.y), 1.0) * metres;
        self.object_from_ray * (seen - self.projection.offset)
    }
}
