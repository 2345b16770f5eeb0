//! Compares the points that should be visible with the images, each at a resolution at which it
//! shows.

use nalgebra::Vector2;

use super::refine::Workspace;
use crate::camera::{ImageView, Pyramid};
use crate::fitness::{Agreement, SurfacePoint};
use crate::pose::Pose;
use crate::shape::Projection;
use crate::track::inputs::Inputs;
use crate::track::target::points::Match;

/// Correlation from which on a point's image is sharp, and the gain in correlation at a coarser
/// resolution from which on it is blurred.
const SHARP: f64 = 0.8;
const CLEARER: f64 = 0.05;

/// Matches the points in view at a pose and stores the matches in the workspace.
pub(crate) fn match_points(
    inputs: &Inputs<'_>,
    pose: &Pose,
    level: usize,
    workspace: &mut Workspace,
) {
    workspace.matches.clear();
    let (mut camera, mut seen) = (usize::MAX, None);
    for (at, view) in workspace.in_view.iter().enumerate() {
        if view.camera != camera {
            (camera, seen) = (view.camera, inputs.windows[view.camera].projection(pose));
        }
        let Some(projection) = seen else { continue };
        let known = &inputs.points.features[view.point];
        let mut point = *known.template(view.template);
        let moved = workspace.moved[at];
        point.position += known.point.toward * moved;
        let pyramid = &inputs.windows[view.camera].pyramid;
        let (agreement, used) = agreement(inputs, &point, (&projection, pyramid), level);
        let place = projection.pixel(&point.position);
        let is_inside = || {
            let image = inputs.images[view.camera].as_ref();
            place.zip(image).is_none_or(|((pixel, slope), image)| {
                point.reach_px(&slope, level).is_some_and(|reach| holds(image, &pixel, &reach))
            })
        };
        // A point outside the image, or never seen at such a coarse level, does not count as
        // missed.
        if agreement.is_some() || is_inside() {
            let pixel = place.map(|(pixel, _)| pixel);
            workspace.matches.push(Match {
                view: *view,
                agreement,
                level: used,
                pixel,
                at,
                moved,
                turns: false,
                is_edgel: known.is_edgel,
            });
        }
    }
}

/// Compares a point with an image at a level or, if the image may be blurred, at a coarser one at
/// which it agrees better; also returns the level.
fn agreement(
    inputs: &Inputs<'_>,
    point: &SurfacePoint,
    (projection, pyramid): (&Projection, &Pyramid),
    level: usize,
) -> (Option<Agreement>, usize) {
    let mut found = (point.agreement(projection, pyramid, level), level);
    if !inputs.is_blurred {
        return found;
    }
    for coarser in level + 1..Pyramid::LEVELS {
        let worth = |one: &Option<Agreement>| one.map_or(0.0, |one| one.correlation);
        if worth(&found.0) > SHARP {
            break;
        }
        let other = point.agreement(projection, pyramid, coarser);
        if worth(&other) > worth(&found.0) + CLEARER {
            found = (other, coarser);
        }
    }
    found
}

/// Returns whether an image contains a position and everything within a reach of it.
fn holds(image: &ImageView<'_>, pixel: &Vector2<f64>, reach: &Vector2<f64>) -> bool {
    let size = image.size_px().map(|n| n as f64 - 1.0);
    (0..2).all(|i| pixel[i] - reach[i] >= 0.0 && pixel[i] + reach[i] < size[i])
}
