//! Templates from further sides: a point looks different from different sides.

use nalgebra::{Vector2, Vector3};

use super::detect::grain;
use crate::fitness::SurfacePoint;
use crate::pose::Pose;
use crate::shape::Projection;
use crate::track::inputs::Inputs;
use crate::track::pose::refine::Workspace;
use crate::track::target::points::Match;
use crate::track::target::shift::Shift;
use crate::track::target::solid::Rims;

/// Largest cosine between the current viewing direction and that of a point's nearest template for
/// which another template is extracted.
pub(crate) const TEMPLATES_APART: f64 = 0.97;
/// Largest offset of a point from its expected pixel, in pixels.
const FARTHEST_PX: f64 = 2.0;

/// Extracts templates of points that are recognised at a pose from a side for which they have none;
/// returns them with the indices of their points.
pub(crate) fn templates(
    inputs: &Inputs<'_>,
    pose: &Pose,
    workspace: &Workspace,
    rims: &mut Rims,
) -> Vec<(usize, SurfacePoint)> {
    let mut out = Vec::new();
    for (camera, window) in inputs.windows.iter().enumerate() {
        let Some(projection) = window.projection(pose) else { continue };
        let Some(grain) = grain(inputs, &projection) else { continue };
        rims.read(inputs.solid, &projection);
        for found in workspace.matches.iter().filter(|found| found.view.camera == camera) {
            let scale = |pixel: &Vector2<f64>| (grain, rims.margin(pixel));
            let template = template(inputs, &projection, (found, workspace), scale);
            out.extend(template.map(|template| (found.view.point, template)));
        }
    }
    out
}

fn template(
    inputs: &Inputs<'_>,
    projection: &Projection,
    (found, workspace): (&Match, &Workspace),
    scale: impl Fn(&Vector2<f64>) -> (f64, f64),
) -> Option<SurfacePoint> {
    let (agreement, pixel) = (found.agreement.as_ref()?, found.pixel?);
    let feature = &inputs.points.features[found.view.point];
    let clear =
        found.is_recognised() && workspace.occlusion.hides(found.view.camera, &pixel) == 0.0;
    if !clear || !feature.has_room() {
        return None;
    }
    let eye = projection.eye()?;
    let place = feature.point.position + feature.point.toward * found.moved;
    let toward = (eye - place).normalize();
    if feature.nearest_template(&toward).1 > TEMPLATES_APART {
        return None;
    }
    // It is extracted where it is seen, not where it was expected.
    let off = Shift::pixels(agreement).filter(|off| off.norm() < FARTHEST_PX)?;
    let ray =
        projection.linear.try_inverse()? * Vector3::new(pixel.x + off.x, pixel.y + off.y, 1.0);
    let seen = eye + ray.normalize() * (place - eye).norm();
    let pyramid = &inputs.windows[found.view.camera].pyramid;
    let vectors = [seen, feature.point.normal, toward];
    let mut template = SurfacePoint::extract(projection, pyramid, vectors, scale(&pixel))?;
    template.color = feature.point.color;
    Some(template)
}
