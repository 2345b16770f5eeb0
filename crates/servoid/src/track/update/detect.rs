use std::f64::consts::FRAC_PI_4;

use nalgebra::{Vector2, Vector3};

use crate::camera::{ImageView, Mask, Plane, depth_noise};
use crate::fitness::SurfacePoint;
use crate::pose::Pose;
use crate::shape::Projection;
use crate::track::frame::occlusion::Occlusion;
use crate::track::frame::window::Window;
use crate::track::inputs::Inputs;
use crate::track::target::colors::Colors;
use crate::track::target::points::{Feature, InView, PLACE_PX, WORST, noise};
use crate::track::target::relief::GUESS;
use crate::track::target::solid::{Hit, Rims};

/// Radius of the object's image, in pixels, from which on a grain is one pixel, and the smallest
/// grain: a smaller image has as many points, each of which covers as much of the surface.
const FULL_PX: f64 = 80.0;
const FINEST: f64 = 0.5;
/// Side of a cell in grains; one point is detected per cell.
const CELL: f64 = 10.0;
/// Least value of the smaller eigenvalue of the gradients' covariance at a corner.
const LEAST_CORNER: f32 = 3.0;
/// Least value of the larger one on an edge.
const LEAST_EDGE: f32 = 30.0;
/// Range of distances in which a point is sought, as a share of the body's radius.
const REACH: f64 = 0.35;
/// Least correlation between two cameras' images of a new point.
const LEAST_CORRELATION: f64 = 0.85;
/// Least distance of a point from the outline, towards the inside, in grains.
const LEAST_MARGIN: f64 = 5.0;
/// Grains between a position and the neighbours whose colours are checked.
const AROUND: f64 = 3.0;
/// Sum of the log-likelihood ratios of nine pixels below which they count as background.
const AGAINST: f64 = -4.0;
/// Grains from a position to the pixels just outside its patch, and between those.
const BESIDE: f64 = 5.0;
const BESIDE_APART: f64 = 1.5;
/// Sum of the log-likelihood ratios of four pixels below which they count as background.
const AGAINST_BESIDE: f64 = -3.0;

/// Where to look for new points.
pub(crate) struct DetectionPlan<'a> {
    /// First cell, in the order in which cells are visited.
    pub(crate) from: usize,
    /// Most cells per window.
    pub(crate) cells: usize,
    /// Most positions per window that are examined closely.
    pub(crate) tries: usize,
    /// Whether a cell without a corner is searched for an edge.
    pub(crate) edgels: bool,
    /// Masks of the object, one entry per camera, or empty.
    pub(crate) masks: &'a [Option<Mask<'a>>],
}

/// What a detection knows of a camera's window, in memory that is reused from image to image.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cells {
    /// The cells well inside the outline.
    inside: Vec<usize>,
    /// The pixels of points that are already known, each with whether it is an edgel.
    taken: Vec<(Vector2<f64>, bool)>,
}

/// Detects new surface points in cells of each window that contain no point of `taken`.
pub(crate) fn detect(
    inputs: &Inputs<'_>,
    pose: &Pose,
    (taken, occlusion): (&[InView], &Occlusion),
    plan: &DetectionPlan<'_>,
    (rims, cells, out): (&mut Rims, &mut Cells, &mut Vec<Feature>),
) {
    for camera in 0..inputs.windows.len() {
        let Some(projection) = inputs.windows[camera].projection(pose) else { continue };
        let Some(eye) = projection.eye() else { continue };
        let Some(grain) = grain(inputs, &projection) else { continue };
        rims.read(inputs.solid, &projection);
        let known = (taken, &*rims, occlusion);
        let spots = spots(inputs, (camera, &projection), known, (plan, grain), cells);
        for Spot { pixel, is_edge } in spots.take(plan.tries) {
            let reach = rims.margin(&pixel);
            let scale = (grain, reach);
            let found = point_at(inputs, (camera, &projection, &eye), pose, pixel, scale);
            // The distance of an edgel must be measured: motion tells too little of it.
            if let Some(mut found) = found.filter(|found| !is_edge || !found.is_from_body) {
                found.is_edgel = is_edge;
                out.push(found);
            }
        }
    }
}

/// Returns the size of a grain in pixels, in a camera's image of the object.
pub(crate) fn grain(inputs: &Inputs<'_>, projection: &Projection) -> Option<f64> {
    let (_, by_place) = projection.pixel(&Vector3::zeros())?;
    Some((inputs.solid.radius * by_place.row(0).norm() / FULL_PX).clamp(FINEST, 1.0))
}

/// Returns corners on the object in a camera's image, and places on edges if these are sought, each
/// in a free cell among those to be visited.
fn spots<'a>(
    inputs: &'a Inputs<'_>,
    (camera, projection): (usize, &'a Projection),
    (taken, outline, occlusion): (&'a [InView], &'a Rims, &'a Occlusion),
    (plan, grain): (&'a DetectionPlan<'_>, f64),
    cells: &'a mut Cells,
) -> impl Iterator<Item = Spot> + 'a {
    let pyramid = &inputs.windows[camera].pyramid;
    let first = Vector2::from(pyramid.first_px().map(|x| x as f64));
    let plane = pyramid.plane(0);
    let side = (CELL * grain).round() as usize;
    let [across, down] = plane.size_px().map(|n| n / side);
    let mask = plan.masks.get(camera).and_then(Option::as_ref);
    let first_px = move |cell: usize| [cell % across * side, cell / across * side];
    let middle =
        move |cell: usize| first + Vector2::from(first_px(cell).map(|x| (x + side / 2) as f64));
    let is_inside = |cell: &usize| outline.margin(&middle(*cell)) >= LEAST_MARGIN * grain;
    cells.inside.clear();
    cells.inside.extend((0..across * down).filter(is_inside));
    let count = cells.inside.len();
    let from = plan.from % count.max(1);
    let pixels = taken.iter().filter(|view| view.camera == camera).filter_map(|view| {
        let feature = &inputs.points.features[view.point];
        Some((projection.pixel(&feature.point.position)?.0, feature.is_edgel))
    });
    cells.taken.clear();
    cells.taken.extend(pixels);
    let Cells { inside, taken } = &*cells;
    let turns = (from..from + plan.cells.min(count)).map(move |turn| inside[turn % count]);
    turns.filter_map(move |cell| {
        let center = middle(cell);
        let near = |(pixel, _): &&(Vector2<f64>, bool)| (pixel - center).amax() < 0.8 * side as f64;
        let near = || taken.iter().filter(near);
        if occlusion.hides(camera, &center) > 0.0 || near().any(|(_, is_edgel)| !is_edgel) {
            return None;
        }
        let found = best_spot(plane, first_px(cell), grain)?;
        let spot = Spot { pixel: first + found.pixel, ..found };
        let counts = !spot.is_edge || (plan.edgels && near().next().is_none());
        (counts && is_object(inputs, (camera, mask), &spot.pixel, grain)).then_some(spot)
    })
}

/// Returns whether a pixel and its surroundings are compatible with the mask, or with the colours
/// if there is none.
fn is_object(
    inputs: &Inputs<'_>,
    (camera, mask): (usize, Option<&Mask<'_>>),
    pixel: &Vector2<f64>,
    grain: f64,
) -> bool {
    let around = (0..9).map(|i| {
        let shift = Vector2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0) * (AROUND * grain);
        pixel + shift
    });
    if let Some(mask) = mask {
        return around.into_iter().all(|place| mask.holds(place.x, place.y));
    }
    let (Some(colors), Some(image)) = (inputs.colors, &inputs.images[camera]) else { return true };
    let window = &inputs.windows[camera];
    let ratios = around.filter_map(|place| window.ratio(image, colors, place.x, place.y));
    ratios.sum::<f64>() > AGAINST && is_within((window, image), colors, pixel, grain)
}

/// Returns whether the colours all around a patch are the object's. Otherwise its pattern would be
/// the outline, which does not move as the surface does.
fn is_within(
    (window, image): (&Window, &ImageView<'_>),
    colors: &Colors,
    pixel: &Vector2<f64>,
    grain: f64,
) -> bool {
    (0..8).all(|way| {
        let (sine, cosine) = libm::sincos(f64::from(way) * FRAC_PI_4);
        let (out, aside) = (Vector2::new(cosine, sine), Vector2::new(-sine, cosine) * BESIDE_APART);
        let last = out * BESIDE;
        let places =
            [last, last - out * BESIDE_APART, last + aside, last - aside].map(|by| by * grain);
        let ratio = |by: &Vector2<f64>| window.ratio(image, colors, pixel.x + by.x, pixel.y + by.y);
        places.iter().filter_map(ratio).sum::<f64>() > AGAINST_BESIDE
    })
}

/// A position at which a point may be detected: at a corner or on an edge.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spot {
    pixel: Vector2<f64>,
    is_edge: bool,
}

/// Returns the position in a cell around which the image changes most in the direction of least
/// change or, if there is no corner, in that of most change.
fn best_spot(plane: &Plane, [left, top]: [usize; 2], grain: f64) -> Option<Spot> {
    let (mut corner, mut edge) = ((LEAST_CORNER, None), (LEAST_EDGE, None));
    let spot =
        |[u, v]: [usize; 2], is_edge| Spot { pixel: Vector2::new(u as f64, v as f64), is_edge };
    for at in 0..9 {
        let place = |step: usize| ((2 + 3 * step) as f64 * grain).round() as usize;
        let (u, v) = (left + place(at % 3), top + place(at / 3));
        if !(u > 4 && v > 4 && plane.holds((u + 5) as f64, (v + 5) as f64)) {
            continue;
        }
        let (mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for step in 0..16 {
            let by = |step: usize| ((2 * step) as f32 - 3.0) * grain as f32;
            let sample = plane.sample(u as f32 + by(step % 4), v as f32 + by(step / 4));
            x += sample.right;
            y += sample.down;
            xx += sample.right * sample.right;
            xy += sample.right * sample.down;
            yy += sample.down * sample.down;
        }
        // A constant gradient is shading: only deviations from it are a pattern.
        let (xx, xy, yy) = (xx - x * x / 16.0, xy - x * y / 16.0, yy - y * y / 16.0);
        let (half, apart) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let apart = (apart * apart + xy * xy).sqrt();
        for (best, found) in [(&mut corner, half - apart), (&mut edge, half + apart)] {
            if found / 16.0 > best.0 {
                *best = (found / 16.0, Some([u, v]));
            }
        }
    }
    corner.1.map(|place| spot(place, false)).or(edge.1.map(|place| spot(place, true)))
}

/// Makes the surface point that a camera sees at a pixel, at the distance at which the other
/// cameras see it too.
fn point_at(
    inputs: &Inputs<'_>,
    (camera, projection, eye): (usize, &Projection, &Vector3<f64>),
    pose: &Pose,
    pixel: Vector2<f64>,
    scale: (f64, f64),
) -> Option<Feature> {
    let radius = inputs.solid.radius;
    let ray = projection.linear.try_inverse()? * Vector3::new(pixel.x, pixel.y, 1.0);
    let Hit { point: hit, normal, .. } = inputs.solid.hit(eye, &ray.normalize())?;
    let toward = (eye - hit).normalize();
    let window = &inputs.windows[camera];
    let mut point =
        SurfacePoint::extract(projection, &window.pyramid, [hit, normal, toward], scale)?;
    let guess = if inputs.relief.is_open { GUESS.1 } else { GUESS.0 };
    let (mut variance, mut is_from_body) = ((guess * radius).powi(2), true);
    let others = inputs.windows.iter().enumerate().filter(|(other, _)| *other != camera);
    let found = inputs.rangefinder(camera, pose).and_then(|seen| seen.place(&pixel));
    let found = found.filter(|(found, _)| (found - hit).norm() < REACH * radius);
    if let Some((found, metres)) = found {
        point.position = found;
        (variance, is_from_body) = (depth_noise(metres).powi(2), false);
    }
    let others = others.filter(|_| found.is_none());
    for (other, window) in others {
        let Some(projection) = window.projection(pose) else { continue };
        let Some(other_eye) = projection.eye() else { continue };
        let way = (other_eye - hit).normalize();
        if way.dot(&normal) < 0.25 || inputs.solid.hides(&hit, &other_eye) {
            continue;
        }
        let (along, found) = distance(&point, &projection, window, radius)?;
        point.position = hit + toward * along;
        let (beside, _) = projection.pixel(&point.position)?;
        if let (Some(colors), Some(image)) = (inputs.colors, &inputs.images[other])
            && !is_within((window, image), colors, &beside, scale.0)
        {
            return None;
        }
        (variance, is_from_body) = (found, false);
        break;
    }
    let mut extracted = SurfacePoint::extract(
        projection,
        &window.pyramid,
        [point.position, normal, toward],
        scale,
    )?;
    extracted.color = inputs.images[camera]?.rgb(pixel.x as usize, pixel.y as usize);
    let mut feature = Feature::new(extracted, variance);
    feature.is_from_body = is_from_body;
    feature.is_from_motion = is_from_body && inputs.relief.is_open;
    Some(feature)
}

/// Searches for the distance by which a point must move towards its camera to agree with another
/// camera's image; returns the distance and its variance.
fn distance(
    point: &SurfacePoint,
    projection: &Projection,
    window: &Window,
    radius: f64,
) -> Option<(f64, f64)> {
    let at = |along: f64| {
        let mut moved = *point;
        moved.position += point.toward * along;
        moved
    };
    let way = projection.pixel(&point.position)?.1 * point.toward;
    let step = 1.0 / way.norm().max(1e-6);
    let count = (REACH * radius / step).ceil().min(40.0);
    let level = usize::from(point.templates[1].is_some());
    let places = (0..=2 * count as usize).map(|i| (i as f64 - count) * step);
    let tried = places.filter_map(|along| {
        Some((along, at(along).correlation(projection, &window.pyramid, level)?))
    });
    let (mut along, _) = tried.max_by(|a, b| a.1.total_cmp(&b.1))?;
    for level in (0..=level).rev() {
        for _ in 0..3 {
            let agreement = at(along).agreement(projection, &window.pyramid, level)?;
            let way = agreement.slope * point.toward;
            let curvature = way.dot(&(agreement.tensor * way));
            along += (way.dot(&agreement.pull) / curvature).clamp(-2.0 * step, 2.0 * step);
        }
    }
    let agreement = at(along).agreement(projection, &window.pyramid, 0)?;
    let way = agreement.slope * point.toward;
    let curvature = way.dot(&(agreement.tensor * way));
    let variance =
        noise(agreement.correlation) / curvature + (0.5 * PLACE_PX).powi(2) / way.norm_squared();
    let good = agreement.correlation > LEAST_CORRELATION
        && along.abs() < 1.2 * REACH * radius
        && variance < (WORST * radius).powi(2);
    good.then_some((along, variance))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Channels, Pyramid};

    const SIDE: usize = 24;

    fn spot(grain: f64, brightness: impl Fn(f64, f64) -> f64) -> Option<Spot> {
        let middle = 0.5 * SIDE as f64;
        let at = |n: usize| (n as f64 - middle) / grain;
        let pixel = |i: usize| brightness(at(i % SIDE), at(i / SIDE));
        let pixels: Vec<_> = (0..SIDE * SIDE).map(|i| pixel(i).clamp(0.0, 255.0) as u8).collect();
        let image = ImageView::new(&pixels, [SIDE; 2], Channels::Grey).unwrap();
        let mut pyramid = Pyramid::default();
        pyramid.read(&image, [0; 2], [SIDE; 2]);
        best_spot(pyramid.plane(0), [(middle - 5.0 * grain) as usize; 2], grain)
    }

    #[test]
    fn a_ridge_that_grows_brighter_along_itself_is_an_edge_and_a_spot_is_a_corner_of_any_size() {
        let ridge = |u: f64, v: f64| 100.0 + 5.0 * v + 60.0 * libm::exp(-0.08 * u * u);
        let slope = |u: f64, v: f64| 100.0 + 5.0 * v + 6.0 * u;
        let blob = |u: f64, v: f64| 100.0 + 60.0 * libm::exp(-0.08 * (u * u + v * v));
        for grain in [1.0, 0.8, FINEST] {
            assert!(spot(grain, ridge).unwrap().is_edge);
            assert!(!spot(grain, blob).unwrap().is_edge);
            assert_eq!(spot(grain, slope), None, "even shading is neither");
        }
    }
}
