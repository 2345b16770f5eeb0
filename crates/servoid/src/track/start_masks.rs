use super::estimate::Notice;
use crate::camera::{Camera, Mask, Observation};
use crate::shape::{Body, silhouette};

/// Least share of a mask's pixels inside the silhouette of the body: a mask of what is visible of a
/// partly hidden object lies inside, and one of something else elsewhere.
const LEAST_INSIDE: f64 = 0.3;

/// Returns the masks that lie where the body is, None in place of the others, and what is wrong with
/// those. A mask without an image says nothing.
pub(super) fn masks_at<'a>(
    body: &Body,
    cameras: &[Camera],
    observation: &Observation<'_>,
    masks: &[Option<Mask<'a>>],
) -> (Vec<Option<Mask<'a>>>, Vec<Notice>) {
    let mut notices = Vec::new();
    let mut masks = masks.to_vec();
    for (index, given) in masks.iter_mut().enumerate().take(cameras.len()) {
        let (camera, pose) = (&cameras[index], &observation.world_from_camera[index]);
        let fits = |mask: &&Mask<'_>| mask.image().size_px() == camera.size_px();
        let mask = given.as_ref().filter(|_| observation.images[index].is_some()).filter(fits);
        let Some(mask) = mask else { continue };
        let inside = share_inside(mask, &silhouette(body, camera, pose));
        if inside < LEAST_INSIDE {
            notices.push(Notice::MaskElsewhere { camera: index, inside: 100.0 * inside });
            *given = None;
        }
    }
    (masks, notices)
}

/// Returns the share of a mask's pixels that a silhouette of the same size covers.
fn share_inside(mask: &Mask<'_>, drawn: &[u8]) -> f64 {
    let [width, height] = mask.image().size_px();
    let rows = (0..height).map(|v| mask.image().row(v)).zip(drawn.chunks(width));
    let both = rows.map(|(row, drawn)| row.iter().zip(drawn).filter(|(m, d)| **m != 0 && **d != 0));
    both.map(Iterator::count).sum::<usize>() as f64 / mask.area_px() as f64
}
