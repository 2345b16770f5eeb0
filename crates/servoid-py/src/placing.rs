use numpy::{PyReadonlyArray2, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use servoid::track as core;

use crate::errors::raise;
use crate::model::borrow;
use crate::observe::{Pixels, View};
use crate::pose::{Pose, read_rows};
use crate::shape::Body;

/// Finds the pose at which a body's outlines agree with masks, and how well they do there. Turns
/// that look alike are told apart by the colours of its ellipsoids, (K, 3) uint8, in images, one a
/// view. Raises TrackError.
#[pyfunction]
#[pyo3(signature = (body, views, images=None, colors=None, seed=0))]
#[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
pub fn place_body(
    py: Python<'_>,
    body: Body,
    views: Vec<Bound<'_, View>>,
    images: Option<Vec<PyReadonlyArrayDyn<'_, u8>>>,
    colors: Option<PyReadonlyArray2<'_, u8>>,
    seed: u64,
) -> PyResult<(Pose, f64)> {
    let views = borrow(&views)?;
    let pixels = images
        .as_ref()
        .map(|images| images.iter().map(Pixels::new).collect::<PyResult<Vec<_>>>())
        .transpose()?;
    let images = pixels
        .as_ref()
        .map(|pixels| pixels.iter().map(Pixels::view).collect::<PyResult<Vec<_>>>())
        .transpose()?;
    let colors = colors.map(|colors| read_rows::<_, 3>(&colors, "colors")).transpose()?;
    let placed = py
        .detach(|| core::place(&body.0, &views, images.as_deref(), colors.as_deref(), seed))
        .map_err(raise)?;
    Ok((Pose(placed.world_from_object), placed.iou))
}
