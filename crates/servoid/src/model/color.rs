use crate::parallel::*;
use nalgebra::{Matrix3, Vector3};

use super::ModelError;
use crate::camera::{ImageView, RigError, View, check_image_size};
use crate::shape::{Body, Ellipsoid};

/// Returns each ellipsoid's colour (red, green, blue): the median over the object's pixels in which
/// it is foremost. An ellipsoid that is never seen gets the median of the whole object.
///
/// # Errors
/// If there is not one image per view or an image does not have its view's size.
pub fn ellipsoid_colors(
    body: &Body,
    views: &[View<'_>],
    images: &[ImageView<'_>],
) -> Result<Vec<[u8; 3]>, ModelError> {
    if views.len() != images.len() {
        let (cameras, given) = (views.len(), images.len());
        return Err(RigError::Count { what: "images", cameras, given }.into());
    }
    for (index, (view, image)) in views.iter().zip(images).enumerate() {
        check_image_size(index, view.camera().size_px(), *image)?;
    }
    let pairs: Vec<_> = views.iter().zip(images).collect();
    let parts: Vec<_> =
        pairs.par_iter().map(|(view, image)| seen_in_view(body, view, image)).collect();
    let seen = |which: usize| -> Vec<[u8; 3]> {
        parts.iter().flatten().filter(|(index, _)| *index == which).map(|(_, rgb)| *rgb).collect()
    };
    let whole = median(&parts.iter().flatten().map(|(_, rgb)| *rgb).collect::<Vec<_>>());
    let count = body.ellipsoids().len();
    Ok((0..count).map(|which| median(&seen(which)).or(whole).unwrap_or([0; 3])).collect())
}

/// Returns the median of each channel.
fn median(colors: &[[u8; 3]]) -> Option<[u8; 3]> {
    let middle = |channel: usize| {
        let mut values: Vec<u8> = colors.iter().map(|rgb| rgb[channel]).collect();
        let middle = values.len() / 2;
        *values.select_nth_unstable(middle).1
    };
    (!colors.is_empty()).then(|| [0, 1, 2].map(middle))
}

/// Returns the foremost ellipsoid and the colour at the object's pixels in every third row and
/// column, which are enough for a median.
fn seen_in_view(body: &Body, view: &View<'_>, image: &ImageView<'_>) -> Vec<(usize, [u8; 3])> {
    let camera_from_world = view.world_from_camera().inverse();
    let surfaces: Vec<_> = body
        .in_world()
        .iter()
        .map(|e| Surface::new(&e.transformed(&camera_from_world, 1.0)))
        .collect();
    let mask = view.mask();
    let (first, last) = mask.bounds_px();
    let mut seen = Vec::new();
    for v in (first[1]..=last[1]).step_by(3) {
        let row = mask.image().row(v);
        for u in (first[0]..=last[0]).step_by(3).filter(|&u| row[u] != 0) {
            let ray = view.camera().ray([u as f64, v as f64]);
            let depths = surfaces.iter().map(|surface| surface.depth(&ray)).enumerate();
            let hits = depths.filter_map(|(index, depth)| Some((index, depth?)));
            if let Some((index, _)) = hits.min_by(|a, b| a.1.total_cmp(&b.1)) {
                seen.push((index, image.rgb(u, v)));
            }
        }
    }
    seen
}

/// An ellipsoid in a camera's frame, prepared for intersection with rays from its centre.
struct Surface {
    unit_from_camera: Matrix3<f64>,
    center: Vector3<f64>,
}

impl Surface {
    fn new(in_camera: &Ellipsoid) -> Self {
        // Radii are positive, so the factor has an inverse.
        let inverse = in_camera.factor().try_inverse().unwrap_or_default();
        Self { unit_from_camera: inverse, center: inverse * in_camera.center() }
    }

    /// Returns the depth at which a ray with z = 1 enters, if it does.
    fn depth(&self, ray: &Vector3<f64>) -> Option<f64> {
        let ray = self.unit_from_camera * ray;
        let (square, along) = (ray.norm_squared(), ray.dot(&self.center));
        let root = along * along - square * (self.center.norm_squared() - 1.0);
        let depth = (along - root.max(0.0).sqrt()) / square;
        (root > 0.0 && depth > 0.0).then_some(depth)
    }
}
