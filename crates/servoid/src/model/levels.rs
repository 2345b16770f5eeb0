use crate::parallel::*;
use nalgebra::{Matrix3, Vector3};

use super::ModelError;
use crate::camera::{Mask, View};
use crate::fitness::{Overlap, OverlapView};
use crate::shape::Projection;

/// How much of the evidence a level uses.
#[derive(Debug, Clone, Copy)]
pub(super) struct Resolution {
    /// Length of the object's longer side in pixels; an image in which it is smaller is not
    /// changed.
    pub extent_px: usize,
    /// Most views.
    pub views: usize,
    /// Voxels along the longest side of a solid.
    pub voxels: usize,
    /// Most lines of sight.
    pub samples: usize,
}

pub(super) const COARSE: Resolution =
    Resolution { extent_px: 64, views: 12, voxels: 32, samples: 300 };
pub(super) const MIDDLE: Resolution =
    Resolution { extent_px: 128, views: 24, voxels: 48, samples: 600 };
pub(super) const FINEST: Resolution =
    Resolution { extent_px: 200, views: usize::MAX, voxels: 96, samples: 2000 };

/// Background kept around the object, as a share of its longer side.
const MARGIN: f64 = 0.3;

/// Rotation and translation from the scene to a camera.
pub(super) type CameraFromScene = (Matrix3<f64>, Vector3<f64>);

/// Crops views to the object, shrinks them and makes an overlap score of them.
pub(super) fn overlap(
    views: &[(&View<'_>, &CameraFromScene)],
    extent_px: usize,
) -> Result<Overlap, ModelError> {
    let views = views
        .par_iter()
        .map(|(view, camera)| shrunk(view, camera, extent_px))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Overlap::new(views))
}

/// Shrinks the masks of a scene whose frame is the world until the object's longer side spans about
/// `extent_px` pixels in each, and makes an overlap score of them.
pub(crate) fn shrunk_overlap(views: &[View<'_>], extent_px: usize) -> Result<Overlap, ModelError> {
    let camera = |view: &View<'_>| {
        let camera_from_world = view.world_from_camera().inverse();
        (camera_from_world.rotation_matrix(), camera_from_world.translation())
    };
    let cameras: Vec<_> = views.iter().map(camera).collect();
    overlap(&views.iter().zip(&cameras).collect::<Vec<_>>(), extent_px)
}

fn shrunk(
    view: &View<'_>,
    (rotation, translation): &CameraFromScene,
    extent_px: usize,
) -> Result<OverlapView, ModelError> {
    let (first, last) = view.mask().bounds_px();
    let extent = (last[0] - first[0]).max(last[1] - first[1]) + 1;
    let shrink = (extent as f64 / extent_px as f64).round().max(1.0) as usize;
    let margin = (extent as f64 * MARGIN).ceil() as usize;
    let limits = view.camera().size_px();
    let corner = first.map(|x| x.saturating_sub(margin));
    let end = |i: usize| (last[i] + 1 + margin).min(limits[i]);
    let size_px = [0, 1].map(|i| (end(i) - corner[i]).div_ceil(shrink));
    let calibration = view.camera().crop(corner, size_px, shrink)?.matrix();
    Ok(OverlapView {
        filled: fill_shares(view.mask(), corner, size_px, shrink),
        size_px,
        projection: Projection {
            linear: calibration * rotation,
            offset: calibration * translation,
        },
    })
}

/// Averages the mask over blocks of `shrink` x `shrink` pixels; a block cut by the border is
/// averaged over its remaining pixels.
fn fill_shares(
    mask: &Mask<'_>,
    corner: [usize; 2],
    [width, height]: [usize; 2],
    shrink: usize,
) -> Vec<f64> {
    let [full_width, full_height] = mask.image().size_px();
    let columns = corner[0]..(corner[0] + width * shrink).min(full_width);
    let mut out = Vec::with_capacity(width * height);
    let mut filled = vec![0; columns.len()];
    for row in 0..height {
        let top = corner[1] + row * shrink;
        let rows = top..(top + shrink).min(full_height);
        filled.fill(0_u32);
        for v in rows.clone() {
            for (filled, &m) in filled.iter_mut().zip(&mask.image().row(v)[columns.clone()]) {
                *filled += u32::from(m != 0);
            }
        }
        let share = |block: &[u32]| {
            f64::from(block.iter().sum::<u32>()) / (rows.len() * block.len()) as f64
        };
        out.extend(filled.chunks(shrink).map(share));
    }
    out
}

/// Averages `value(u, v)` over blocks of `shrink` x `shrink` pixels.
pub(super) fn block_means(
    [width, height]: [usize; 2],
    shrink: usize,
    value: impl Fn(usize, usize) -> f64,
) -> Vec<f64> {
    let mut out = Vec::with_capacity(width * height);
    for row in 0..height {
        for column in 0..width {
            let block = (0..shrink * shrink)
                .map(|i| value(column * shrink + i % shrink, row * shrink + i / shrink));
            out.push(block.sum::<f64>() / (shrink * shrink) as f64);
        }
    }
    out
}
