//! Lines across the outline of the body, along which the object's boundary is located.

use super::refine::{Evaluated, Workspace};
use crate::camera::Pyramid;
use crate::fitness::boundary;
use crate::track::target::contour_offsets::{ContourOffsets, Edge};
use crate::track::target::points::by_motion;

/// Positions on one side of a line and pixels between them, the finest resolution first.
const LINES: [(usize, f64); Pyramid::LEVELS] = [(6, 1.0), (8, 1.5), (10, 2.5)];
/// Variance of the true outline about that of the ellipsoids, in square pixels: they only
/// approximate the object.
const SHAPE_PX: f64 = 6.0;
/// Distance between boundary and outline, in pixels, within which they still agree.
const NEAR_PX: f64 = 2.5;
/// Distance inside the outline, in pixels, at which a line is tested for occlusion.
const INSIDE_PX: f64 = 4.0;
/// Weight of a line: errors of neighbouring lines are correlated.
const LINE_SHARE: f64 = 0.25;
/// The same where the offset of the true boundary is known.
const EDGE_SHARE: f64 = 0.5;
/// Standard deviation of a boundary, in pixels, beyond its posterior.
const EDGE_PX: f64 = 0.5;
/// Distance of a boundary from where it should be, in pixels, at which a line has a quarter of its
/// weight.
const OFF_PX: f64 = 4.0;
/// Distance of the boundary from the outline, in pixels, up to which the ends of a line do not bias
/// it.
const WHOLE_PX: f64 = 4.5;

/// Adds the lines across the contour in the workspace; `ratio` is the log-likelihood ratio of a
/// pixel. At the finest resolution, each line also becomes an edge; where the offset of the true
/// boundary is known, the edge measures the pose in place of the outline.
pub(crate) fn add_lines(
    sum: &mut Evaluated,
    (camera, level): (usize, usize),
    ratio: impl Fn(f64, f64) -> Option<f64>,
    (offsets, radius): (&ContourOffsets, f64),
    workspace: &mut Workspace,
) {
    for place in &workspace.contour {
        let inside = place.pixel - place.normal * INSIDE_PX;
        let shows = 1.0 - workspace.occlusion.hides(camera, &inside);
        if shows == 0.0 {
            continue;
        }
        let Some(found) = boundary(place, LINES[level], &ratio) else { continue };
        let known = shows * informed_share(found.variance_px, LINES[level]);
        sum.outline.0 += known * libm::exp(-0.5 * (found.mean_px / NEAR_PX).powi(2));
        sum.outline.1 += known;
        let by_motion = by_motion(&place.slope, &place.rim).tr_mul(&place.normal);
        let mut replaced = false;
        if level == 0 && found.mean_px.abs() < WHOLE_PX && known > 0.0 {
            let cell = ContourOffsets::cell(place.ellipsoid, &place.on_ball);
            let px = place.slope.tr_mul(&place.normal).norm() * radius;
            let offset = offsets.known(cell);
            let off_px = offset.map_or(0.0, |offset| found.mean_px - offset.mean * px);
            let fits = (1.0 + (off_px / OFF_PX).powi(2)).powi(-2);
            let weight = known * fits * EDGE_SHARE / (found.variance_px + EDGE_PX * EDGE_PX);
            workspace.edges.push(Edge {
                cell,
                on_ball: place.on_ball,
                outside: found.mean_px / px,
                information: weight * px * px,
                by_motion: by_motion / px,
            });
            replaced = offset.is_some();
        }
        let weight = known * LINE_SHARE / (found.variance_px + SHAPE_PX);
        let information = by_motion * by_motion.transpose() * weight;
        let pull = by_motion * (weight * found.mean_px);
        sum.normal.outline.0 += information;
        sum.normal.outline.1 += pull;
        if replaced {
            sum.normal.replaced.0 += information;
            sum.normal.replaced.1 += pull;
        }
    }
}

/// Returns the share of the information a line could have that it has: none if its variance is
/// that of a boundary that may be anywhere along it. // (S47)
fn informed_share(variance_px: f64, (reach, step_px): (usize, f64)) -> f64 {
    let places = (2 * reach + 2) as f64;
    let even = (places * places - 1.0) / 12.0 * step_px * step_px;
    (1.0 - variance_px / even).max(0.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2x3, Vector2, Vector3};

    use super::*;
    use crate::fitness::ContourPoint;
    use crate::pose::Pose;
    use crate::track::pose::refine::Normal;

    /// Contribution of a line across an outline, if the object's colours end some pixels outside of
    /// it.
    fn added(level: usize, ratio: impl Fn(f64) -> f64) -> (Normal, (f64, f64)) {
        let (pixel, normal) = (Vector2::new(50.0, 40.0), Vector2::new(1.0, 0.0));
        let slope = Matrix2x3::new(300.0, 0.0, 0.0, 0.0, 300.0, 0.0);
        let rim = Vector3::new(0.05, 0.0, 0.0);
        let place = ContourPoint { pixel, normal, rim, ellipsoid: 0, on_ball: Vector3::x(), slope };
        let mut workspace = Workspace::default();
        workspace.contour.push(place);
        let mut sum = Evaluated::nothing(Pose::identity(), 0.05);
        let offsets = ContourOffsets::unknown(1);
        let ratio = |u: f64, _| Some(ratio(u - pixel.x));
        add_lines(&mut sum, (0, level), ratio, (&offsets, 0.05), &mut workspace);
        (sum.normal, sum.outline)
    }

    #[test]
    fn a_line_whose_colours_are_ambiguous_adds_no_information() {
        for level in 0..LINES.len() {
            let (sum, outline) = added(level, |_| 0.0);
            assert!(sum.outline.0.amax() < 1e-9 * sum.prior.amax());
            assert!(outline.1 < 1e-9 && sum.outline.1.amax() < 1e-9, "{outline:?}");
        }
    }

    #[test]
    fn the_clearer_the_colours_the_more_information_a_line_adds() {
        for level in 0..LINES.len() {
            let mut before = (0.0, 0.0);
            for nats in [0.01, 0.1, 0.5, 2.0] {
                let (sum, (agreed, lines)) =
                    added(level, |out| if out < 0.0 { nats } else { -nats });
                let now = (sum.outline.0.amax(), lines);
                assert!(now.0 > before.0 && now.1 > before.1 && lines <= 1.0);
                assert!(agreed > 0.8 * lines, "{agreed} of {lines}");
                before = now;
            }
            let (_, (agreed, lines)) = added(level, |_| 2.0);
            assert!(lines > 0.9 && agreed < 0.1, "colours that go on speak against an outline");
        }
    }
}
