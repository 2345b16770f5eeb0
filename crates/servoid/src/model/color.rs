use rayon::prelude::*;

use super::ModelError;
use crate::observe::{ImageView, RigError, View};
use crate::shape::{Body, Projection};

/// Gives each ellipsoid's mean colour (red, green, blue): that of the object's pixels in which it
/// is the foremost. One that is never seen takes the mean of the whole object.
///
/// # Errors
/// If there is not one image a view or an image has not its view's size.
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
        let (expected, given) = (view.camera().size_px(), image.size_px());
        if expected != given {
            return Err(RigError::ImageSize { camera: index, expected, given }.into());
        }
    }
    let pairs: Vec<_> = views.iter().zip(images).collect();
    let parts: Vec<_> =
        pairs.par_iter().map(|(view, image)| sums_in_view(body, view, image)).collect();
    let mut sums = vec![[0.0; 4]; body.ellipsoids().len()];
    for (sum, part) in parts.iter().flat_map(|part| part.iter().enumerate()) {
        (0..4).for_each(|i| sums[sum][i] += part[i]);
    }
    let whole: [f64; 4] = std::array::from_fn(|i| sums.iter().map(|sum| sum[i]).sum());
    let mean = |sum: &[f64; 4]| {
        let [r, g, b, count] = if sum[3] > 0.0 { *sum } else { whole };
        [r, g, b].map(|channel| (channel / count.max(1.0)).round() as u8)
    };
    Ok(sums.iter().map(mean).collect())
}

/// Sums red, green, blue and the count of the pixels in which each ellipsoid is foremost; every
/// second row and column is enough for a mean.
fn sums_in_view(body: &Body, view: &View<'_>, image: &ImageView<'_>) -> Vec<[f64; 4]> {
    let projection = Projection::new(view.camera(), &view.world_from_camera());
    let mut seen: Vec<_> = body
        .in_world()
        .iter()
        .enumerate()
        .filter_map(|(index, ellipsoid)| {
            let outline = projection.outline(&ellipsoid.quadric())?;
            Some((projection.apply(&ellipsoid.center()).z, index, outline))
        })
        .collect();
    seen.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut sums = vec![[0.0; 4]; body.ellipsoids().len()];
    let mask = view.mask();
    let (first, last) = mask.bounds_px();
    for v in (first[1]..=last[1]).step_by(2) {
        let row = mask.image().row(v);
        let intervals: Vec<_> = seen
            .iter()
            .filter_map(|(_, index, outline)| Some((*index, outline.interval(v as f64)?)))
            .collect();
        for u in (first[0]..=last[0]).step_by(2).filter(|&u| row[u] != 0) {
            let covers = |(begin, end): (f64, f64)| (begin..=end).contains(&(u as f64));
            if let Some((index, _)) = intervals.iter().find(|(_, interval)| covers(*interval)) {
                let rgb = image.rgb(u, v).map(f64::from);
                (0..3).for_each(|i| sums[*index][i] += rgb[i]);
                sums[*index][3] += 1.0;
            }
        }
    }
    sums
}
