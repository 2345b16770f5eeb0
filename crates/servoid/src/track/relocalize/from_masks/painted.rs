use nalgebra::Vector3;

use super::MaskFit;
use crate::camera::{Camera, ImageView, View};
use crate::pose::Pose;
use crate::track::target::solid::Solid;

/// Colours of the images inside the masks, and the colours of a body's ellipsoids.
pub(super) struct Painted {
    views: Vec<Seen>,
    colors: Vec<Vector3<f64>>,
}

/// One image: the pose of its camera, and rays in the camera's frame with their colours.
struct Seen {
    world_from_camera: Pose,
    rays: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// Samples along the object's longer side.
const PLACES: usize = 32;
/// Mean square of the difference between a sample's colour and its ellipsoid's.
const SPREAD2: f64 = 900.0;

impl Painted {
    pub(super) fn new(views: &[View<'_>], images: &[ImageView<'_>], colors: &[[u8; 3]]) -> Self {
        let seen = |(view, image): (&View<'_>, &ImageView<'_>)| Seen {
            world_from_camera: view.world_from_camera(),
            rays: rays(view, image),
        };
        Self {
            views: views.iter().zip(images).map(seen).collect(),
            colors: colors.iter().map(|rgb| Vector3::from(rgb.map(f64::from))).collect(),
        }
    }

    /// Returns how well the foremost ellipsoids' colours agree with the images, 0 to 1. The mean
    /// difference in an image is attributed to the light, and ignored.
    pub(super) fn agreement(&self, solid: &Solid, fit: &MaskFit) -> f64 {
        let object_from_world = fit.world_from_object.inverse();
        let (mut total, mut views) = (0.0, 0.0);
        for seen in &self.views {
            let away = self.differences(solid, &(object_from_world * seen.world_from_camera), seen);
            if away.is_empty() {
                continue;
            }
            let count = away.len() as f64;
            let light = away.iter().sum::<Vector3<f64>>() / count;
            let worth =
                |off: &Vector3<f64>| libm::exp(-0.5 * (off - light).norm_squared() / SPREAD2);
            total += away.iter().map(worth).sum::<f64>() / count;
            views += 1.0;
        }
        total / f64::max(views, 1.0)
    }

    /// Returns the differences between the colours in an image and those of the foremost
    /// ellipsoids.
    fn differences(
        &self,
        solid: &Solid,
        object_from_camera: &Pose,
        seen: &Seen,
    ) -> Vec<Vector3<f64>> {
        let (eye, turn) = (object_from_camera.translation(), object_from_camera.rotation());
        let differs = |(ray, color): &(Vector3<f64>, Vector3<f64>)| {
            let hit = solid.hit(&eye, &(turn * ray))?;
            Some(color - self.colors[hit.ellipsoid])
        };
        seen.rays.iter().filter_map(differs).collect()
    }
}

/// Returns the mean colours of small blocks in the mask, and the rays in which they are seen.
fn rays(view: &View<'_>, image: &ImageView<'_>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let (first, last) = view.mask().bounds_px();
    let extent = (last[0] - first[0]).max(last[1] - first[1]) + 1;
    let step = extent.div_ceil(PLACES);
    let blocks = |i: usize| (first[i]..=last[i]).step_by(step);
    let block = |(u, v)| block_mean(view, image, [u, v], step);
    let corners = blocks(1).flat_map(|v| blocks(0).map(move |u| (u, v)));
    corners.filter_map(block).collect()
}

/// Returns the mean colour of a block, and its central ray; none if half of it is background.
fn block_mean(
    view: &View<'_>,
    image: &ImageView<'_>,
    corner: [usize; 2],
    step: usize,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let camera: &Camera = view.camera();
    let size = camera.size_px();
    let end = [0, 1].map(|i| (corner[i] + step).min(size[i]));
    let (mut sum, mut count) = (Vector3::zeros(), 0);
    for v in corner[1]..end[1] {
        let marked = &view.mask().image().row(v)[corner[0]..end[0]];
        for (u, _) in (corner[0]..).zip(marked).filter(|(_, marked)| **marked != 0) {
            sum += Vector3::from(image.rgb(u, v).map(f64::from));
            count += 1;
        }
    }
    let half = 0.5 * (step as f64 - 1.0);
    let ray = camera.ray(corner.map(|first| first as f64 + half));
    (2 * count > step * step).then(|| (ray, sum / f64::from(count as u32)))
}
