use pyo3::prelude::*;
use servoid::track as core;

use crate::camera::{GivenView, Pixels};
use crate::errors::raise;
use crate::given_images::Picture;
use crate::model::borrow;
use crate::pose::Pose;
use crate::shape::Body;
use crate::taking::{Listed, Wanted, read_index_rows};

/// Finds the pose at which a body's outlines agree with masks, and their overlap there.
/// Orientations that look alike are distinguished by the colours of its ellipsoids, (K, 3) uint8,
/// in images, one per view. Raises TrackError.
#[pyfunction]
#[pyo3(signature = (body, views, images=None, colors=None, seed=0))]
pub fn pose_from_masks(
    py: Python<'_>,
    body: Body,
    views: Listed<GivenView<'_>>,
    images: Option<Listed<Picture<'_>>>,
    colors: Option<&Bound<'_, PyAny>>,
    seed: u64,
) -> PyResult<(Pose, f64)> {
    let mut found = poses_from_masks(py, body, views, images, colors, seed)?;
    Ok(found.swap_remove(0))
}

/// Finds all poses at which a body's outlines agree with masks about as well as at the best one,
/// which comes first, each with their overlap there. They are turned from each other by 20 degrees
/// or more: masks often do not distinguish two sides of a box, and never how a body of revolution
/// is turned. Arguments are those of `pose_from_masks`. Raises TrackError.
#[pyfunction]
#[pyo3(signature = (body, views, images=None, colors=None, seed=0))]
#[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
pub fn poses_from_masks(
    py: Python<'_>,
    body: Body,
    views: Listed<GivenView<'_>>,
    images: Option<Listed<Picture<'_>>>,
    colors: Option<&Bound<'_, PyAny>>,
    seed: u64,
) -> PyResult<Vec<(Pose, f64)>> {
    let views = borrow(&views.0)?;
    let pixels = images
        .as_ref()
        .map(|images| {
            images.0.iter().map(|image| Pixels::new(&image.0)).collect::<PyResult<Vec<_>>>()
        })
        .transpose()?;
    let images = pixels
        .as_ref()
        .map(|pixels| pixels.iter().map(Pixels::view).collect::<PyResult<Vec<_>>>())
        .transpose()?;
    let colors = colors.map(read_colors).transpose()?;
    let found = py
        .detach(|| {
            core::poses_from_masks(&body.0, &views, images.as_deref(), colors.as_deref(), seed)
        })
        .map_err(raise)?;
    Ok(found.into_iter().map(|one| (Pose(one.world_from_object), one.iou)).collect())
}

fn read_colors(given: &Bound<'_, PyAny>) -> PyResult<Vec<[u8; 3]>> {
    let what = "whole numbers of shape (K, 3), 0 to 255";
    let rows = read_index_rows::<3>(given, Wanted { name: "colors", what, class: "TrackError" })?;
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is clamped")]
    Ok(rows.into_iter().map(|row| row.map(|c| c.clamp(0, 255) as u8)).collect())
}
