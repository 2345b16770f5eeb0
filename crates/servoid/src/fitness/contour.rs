use nalgebra::{Matrix2x3, Vector2, Vector3};

use crate::shape::{Outline, Projection, Quadric};

/// A point on the outline of a body in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourPoint {
    /// Its position, in pixels.
    pub pixel: Vector2<f64>,
    /// Unit vector out of the outline, in the image.
    pub normal: Vector2<f64>,
    /// The point of the surface that is imaged there.
    pub rim: Vector3<f64>,
    /// Index of the ellipsoid whose surface that is.
    pub ellipsoid: usize,
    /// The point of the unit ball that this ellipsoid maps to the surface point.
    pub on_ball: Vector3<f64>,
    /// Derivative of the pixel by that point.
    pub slope: Matrix2x3<f64>,
}

/// Position of the object's boundary relative to a [`ContourPoint`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset {
    /// Distance outwards in pixels, as the mean of its posterior.
    pub mean_px: f64,
    /// Its variance, in square pixels.
    pub variance_px: f64,
}

/// Most points along one outline.
const MOST: usize = 48;

/// Places points along the outline of the union of ellipsoids, about `spacing_px` apart.
pub fn contour(
    projection: &Projection,
    quadrics: &[Quadric],
    spacing_px: f64,
    outlines: &mut Vec<(usize, Outline)>,
    points: &mut Vec<ContourPoint>,
) {
    points.clear();
    outlines.clear();
    let all = quadrics.iter().enumerate();
    outlines.extend(all.filter_map(|(index, quadric)| Some((index, projection.outline(quadric)?))));
    for &(ellipsoid, ref outline) in outlines.iter() {
        let quadric = &quadrics[ellipsoid];
        let around = std::f64::consts::PI * (outline.half_width + outline.half_height);
        let count = ((around / spacing_px) as usize).clamp(6, MOST);
        for step in 0..count {
            let (pixel, normal) =
                on_outline(outline, std::f64::consts::TAU * step as f64 / count as f64);
            let hidden = outlines
                .iter()
                .any(|(other, outline)| *other != ellipsoid && outline.contains(&pixel));
            if hidden {
                continue;
            }
            let (rim, on_ball) = rim_at(projection, quadric, &pixel, &normal);
            if let Some((pixel, slope)) = projection.pixel(&rim) {
                points.push(ContourPoint { pixel, normal, rim, ellipsoid, on_ball, slope });
            }
        }
    }
}

/// Returns a point on an ellipse and its unit normal, at an angle about its centre.
pub(crate) fn on_outline(outline: &Outline, angle: f64) -> (Vector2<f64>, Vector2<f64>) {
    let (sin, cos) = libm::sincos(angle);
    let below = outline.half_height * sin;
    let right = outline.slope * below + outline.half_width * cos;
    let across = cos / outline.half_width;
    let normal = Vector2::new(across, sin / outline.half_height - outline.slope * across);
    (outline.center_px() + Vector2::new(right, below), normal.normalize())
}

/// Returns the point at which the plane through the camera and a tangent touches the ellipsoid, and
/// the point of the unit ball that is mapped there.
pub(crate) fn rim_at(
    projection: &Projection,
    quadric: &Quadric,
    pixel: &Vector2<f64>,
    normal: &Vector2<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let tangent = Vector3::new(normal.x, normal.y, -normal.dot(pixel));
    let outward = projection.linear.tr_mul(&tangent);
    let reach = quadric.factor.tr_mul(&outward);
    let length = reach.norm().max(f64::MIN_POSITIVE);
    (quadric.center + quadric.factor * reach / length, reach / length)
}

/// Locates the boundary along the normal at a point of the outline, among `2 reach + 1` pixels at
/// intervals of `step_px`. It may lie between any two of them, before the first or behind the last.
/// Its posterior is the likelihood that the pixels inside of it are the object's and those outside
/// are not (S45).
///
/// `score` returns the log-likelihood ratio of a pixel, `None` outside the image. Returns `None` if
/// the line leaves the image; without information all positions are equally likely.
///
/// Source: the idea of a likelihood along lines is that of Stoiber, Pfanne, Strobl, Triebel,
/// Albu-Schaeffer, *SRT3D: A Sparse Region-Based 3D Object Tracking Approach for the Real World*
/// (2022); the mean and the variance are those of the whole posterior.
pub fn boundary(
    point: &ContourPoint,
    (reach, step_px): (usize, f64),
    score: impl Fn(f64, f64) -> Option<f64>,
) -> Option<Offset> {
    let mut sums = [0.0; 2 * MOST_REACH + 2];
    let reach = reach.min(MOST_REACH);
    let count = 2 * reach + 1;
    let mut most = f64::NEG_INFINITY;
    for at in 0..count {
        let offset = (at as f64 - reach as f64) * step_px;
        let place = point.pixel + point.normal * offset;
        let ratio = score(place.x, place.y)?;
        sums[at + 1] = sums[at] + ratio * step_px.min(1.0);
        most = most.max(sums[at + 1]);
    }
    most = most.max(0.0);
    let (mut total, mut first, mut second) = (0.0, 0.0, 0.0);
    for (at, sum) in sums.iter().take(count + 1).enumerate() {
        // The boundary lies between two samples.
        let offset = (at as f64 - reach as f64 - 0.5) * step_px;
        let weight = libm::exp(sum - most);
        total += weight;
        first += weight * offset;
        second += weight * offset * offset;
    }
    let mean_px = first / total;
    Some(Offset { mean_px, variance_px: (second / total - mean_px * mean_px).max(0.0) })
}

/// Most samples on one side of a line.
const MOST_REACH: usize = 16;
