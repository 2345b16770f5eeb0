use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::ModelError;
use crate::observe::{Camera, Channels, ImageView, Mask, View};
use crate::pose::{Pose, even_direction};
use crate::shape::{Mesh, Projection};

/// Pictures that are taken of a mesh, from all sides.
const COUNT: usize = 6;
/// Their width and height in pixels.
const SIDE_PX: usize = 256;
/// Distance of the cameras from the mesh's middle, in radii of the ball around it.
const DISTANCE: f64 = 6.0;

/// A picture of a mesh that was drawn, not taken.
pub(super) struct Portrait {
    camera: Camera,
    world_from_camera: Pose,
    pixels: Vec<u8>,
}

impl Portrait {
    pub fn view(&self) -> Result<View<'_>, ModelError> {
        let image = ImageView::new(&self.pixels, self.camera.size_px(), Channels::Grey)?;
        Ok(View::new(self.camera, self.world_from_camera, Mask::new(image)?)?)
    }
}

/// Draws silhouettes of a mesh, from places that lie evenly on a half ball about it: from opposite
/// sides a silhouette is nearly the same.
pub(super) fn portraits(mesh: &Mesh) -> Result<Vec<Portrait>, ModelError> {
    let world_from_mesh = mesh.principal_frame();
    let middle = world_from_mesh.translation();
    let radius = mesh.vertices().iter().map(|v| (v - middle).norm()).fold(0.0, f64::max);
    let side = SIDE_PX as f64;
    // A ball of this radius at this distance just fits into the image.
    let focal_px = 0.5 * side * (DISTANCE * DISTANCE - 1.0).sqrt();
    let center_px = [0.5 * (side - 1.0); 2];
    let camera = Camera::new([SIDE_PX; 2], [focal_px; 2], center_px)?;
    let draw = |index: usize| {
        let away = world_from_mesh.rotation() * half_ball_direction(index);
        let place = middle + away * (DISTANCE * radius);
        let world_from_camera = Pose::from_rotation(looking_along(&-away), place);
        let projection = Projection::new(&camera, &world_from_camera);
        let pixels = mesh.silhouette(&projection, [SIDE_PX; 2]);
        Portrait { camera, world_from_camera, pixels }
    };
    Ok((0..COUNT).into_par_iter().map(draw).collect())
}

/// Gives direction `index` of a spiral of [`COUNT`] over the half ball z > 0.
fn half_ball_direction(index: usize) -> Vector3<f64> {
    even_direction(index, 1.0 - (index as f64 + 0.5) / COUNT as f64)
}

/// Turns z to a direction.
fn looking_along(forward: &Vector3<f64>) -> UnitQuaternion<f64> {
    let mut least = Vector3::zeros();
    least[forward.iamin()] = 1.0;
    let right = forward.cross(&least).normalize();
    let down = forward.cross(&right);
    let axes = Matrix3::from_columns(&[right, down, *forward]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}
