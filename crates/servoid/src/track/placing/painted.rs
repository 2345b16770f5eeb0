use nalgebra::Vector3;

use super::Placement;
use crate::observe::{Camera, ImageView, View};
use crate::pose::Pose;
use crate::track::solid::Solid;

/// What images show at places in the masks, and the colours that a body's ellipsoids have.
pub(super) struct Painted {
    views: Vec<Seen>,
    colors: Vec<Vector3<f64>>,
}

/// One image: where its camera is, and rays in its frame with the colour there.
struct Seen {
    world_from_camera: Pose,
    rays: Vec<(Vector3<f64>, Vector3<f64>)>,
}

/// Places along the object's longer side.
const PLACES: usize = 32;
/// How far a colour is from its own under other light.
const SPREAD: f64 = 60.0;

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

    /// Says how well the foremost ellipsoids' colours agree with the images, 0 to 1.
    pub(super) fn agreement(&self, solid: &Solid, placement: &Placement) -> f64 {
        let object_from_world = placement.world_from_object.inverse();
        let (mut total, mut views) = (0.0, 0.0);
        for seen in &self.views {
            let object_from_camera = object_from_world * seen.world_from_camera;
            let (eye, turn) = (object_from_camera.translation(), object_from_camera.rotation());
            let (mut sum, mut hits) = (0.0, 0.0);
            for (ray, color) in &seen.rays {
                if let Some(hit) = solid.hit(&eye, &(turn * ray)) {
                    let away = (self.colors[hit.ellipsoid] - color).norm() / SPREAD;
                    sum += (-0.5 * away * away).exp();
                    hits += 1.0;
                }
            }
            if hits > 0.0 {
                total += sum / hits;
                views += 1.0;
            }
        }
        if views > 0.0 { total / views } else { 0.0 }
    }
}

/// Gives the mean colours of small blocks in the mask, and the rays in which they are seen.
fn rays(view: &View<'_>, image: &ImageView<'_>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let (first, last) = view.mask().bounds_px();
    let extent = (last[0] - first[0]).max(last[1] - first[1]) + 1;
    let step = extent.div_ceil(PLACES);
    let blocks = |i: usize| (first[i]..=last[i]).step_by(step);
    let block = |(u, v)| block_mean(view, image, [u, v], step);
    let corners = blocks(1).flat_map(|v| blocks(0).map(move |u| (u, v)));
    corners.filter_map(block).collect()
}

/// Gives the mean colour of a block, and the middle of its ray; none if half of it is background.
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
