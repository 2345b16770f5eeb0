use super::{Body, Projection};
use crate::camera::Camera;
use crate::pose::Pose;

/// Draws the body's silhouette: row by row, 255 at each pixel whose centre is inside an outline.
#[must_use]
pub fn silhouette(body: &Body, camera: &Camera, world_from_camera: &Pose) -> Vec<u8> {
    let [width, height] = camera.size_px();
    let projection = Projection::new(camera, world_from_camera);
    let outlines: Vec<_> = body
        .in_world()
        .iter()
        .filter_map(|ellipsoid| projection.outline(&ellipsoid.quadric()))
        .collect();
    let mut pixels = vec![0; width * height];
    for (v, row) in pixels.chunks_exact_mut(width).enumerate() {
        for (first, last) in outlines.iter().filter_map(|outline| outline.interval(v as f64)) {
            // A pixel belongs to the outline if its centre, an integer, lies inside.
            let begin = first.ceil().clamp(0.0, width as f64) as usize;
            let end = (last.floor() + 1.0).clamp(0.0, width as f64) as usize;
            if begin < end {
                row[begin..end].fill(u8::MAX);
            }
        }
    }
    pixels
}
