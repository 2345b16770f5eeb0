use crate::parallel::*;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use super::ModelError;
use crate::camera::{Camera, Channels, ImageView, Mask, View};
use crate::pose::{Pose, even_direction};
use crate::shape::{Body, Ellipsoid, Mesh, Projection, silhouette};

/// Number of silhouettes that are drawn of a mesh, from all sides.
const COUNT: usize = 6;
/// Their width and height in pixels.
const SIDE_PX: usize = 256;
/// Distance of the cameras from the mesh's centre, in radii of the ball around it.
const DISTANCE: f64 = 6.0;

/// A silhouette that was drawn, not recorded.
#[derive(Debug, Clone)]
pub struct SyntheticView {
    camera: Camera,
    world_from_camera: Pose,
    pixels: Vec<u8>,
}

impl SyntheticView {
    /// Draws a silhouette of the content of a ball from a direction.
    fn draw(
        (middle, radius): (&Vector3<f64>, f64),
        away: &Vector3<f64>,
        draw: impl Fn(&Camera, &Pose) -> Vec<u8>,
    ) -> Result<Self, ModelError> {
        let side = SIDE_PX as f64;
        // A ball of this radius at this distance just fits into the image.
        let focal_px = 0.5 * side * (DISTANCE * DISTANCE - 1.0).sqrt();
        let camera = Camera::new([SIDE_PX; 2], [focal_px; 2], [0.5 * (side - 1.0); 2])?;
        let place = middle + away * (DISTANCE * radius);
        let world_from_camera = Pose::from_rotation(looking_along(&-away), place);
        let pixels = draw(&camera, &world_from_camera);
        Ok(Self { camera, world_from_camera, pixels })
    }

    /// Draws a body in its own frame from directions.
    ///
    /// # Errors
    /// If the body has no size.
    pub fn of_body(
        body: &Body,
        directions: impl Iterator<Item = Vector3<f64>>,
    ) -> Result<Vec<Self>, ModelError> {
        let body = body.at(Pose::identity());
        let reach = |e: &Ellipsoid| e.center().norm() + e.radii().max();
        let radius = body.ellipsoids().iter().map(reach).fold(0.0, f64::max);
        let ball = (&Vector3::zeros(), radius);
        directions
            .map(|away| Self::draw(ball, &away, |camera, pose| silhouette(&body, camera, pose)))
            .collect()
    }

    /// Returns the silhouette as a view.
    ///
    /// # Errors
    /// If the silhouette is empty.
    pub fn view(&self) -> Result<View<'_>, ModelError> {
        let image = ImageView::new(&self.pixels, self.camera.size_px(), Channels::Grey)?;
        Ok(View::new(self.camera, self.world_from_camera, Mask::new(image)?)?)
    }
}

/// Draws silhouettes of a mesh from directions evenly spread over a half ball: from opposite sides
/// a silhouette is nearly the same.
pub(super) fn synthetic_views(mesh: &Mesh) -> Result<Vec<SyntheticView>, ModelError> {
    let world_from_mesh = mesh.principal_frame();
    let middle = world_from_mesh.translation();
    let radius = mesh.vertices().iter().map(|v| (v - middle).norm()).fold(0.0, f64::max);
    let draw = |index: usize| {
        let away = world_from_mesh.rotation() * half_ball_direction(index, COUNT);
        SyntheticView::draw((&middle, radius), &away, |camera, pose| {
            mesh.silhouette(&Projection::new(camera, pose), camera.size_px())
        })
    };
    (0..COUNT).into_par_iter().map(draw).collect()
}

/// Returns direction `index` of a spiral of `count` over the half ball z > 0.
#[must_use]
pub fn half_ball_direction(index: usize, count: usize) -> Vector3<f64> {
    even_direction(index, 1.0 - (index as f64 + 0.5) / count as f64)
}

/// Returns the rotation of z to a direction.
fn looking_along(forward: &Vector3<f64>) -> UnitQuaternion<f64> {
    let mut least = Vector3::zeros();
    least[forward.iamin()] = 1.0;
    let right = forward.cross(&least).normalize();
    let down = forward.cross(&right);
    let axes = Matrix3::from_columns(&[right, down, *forward]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}
