use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::levels::{COARSE, CameraFromScene, FINEST, MIDDLE, Resolution, overlap};
use super::progressive::refine::Objective;
use super::{ModelError, ModelInput};
use crate::camera::View;
use crate::fitness::{Extent, RangeSample, RangeSamples, Total, Volume};
use crate::pose::Pose;
use crate::shape::{Body, Ellipsoid, Mesh, Quadric, silhouette};

/// The evidence in a frame and a unit of its own. For views the frame has the axes of the first
/// camera and its origin where the lines of sight meet, for a mesh it is the principal frame; the
/// unit is the object's mean radius. Moving, rotating or scaling the world does not change the
/// scene, nor the search that runs in it.
pub(super) struct Scene {
    pub world_from_scene: Pose,
    pub unit: f64,
    /// For searches.
    pub coarse: Objective,
    /// For comparing their finalists.
    pub middle: Objective,
}

/// Smallest radius of a solid ellipsoid, as a share of the unit.
const LEAST_RADIUS: f64 = 1e-3;
/// Distances before (unless the eye is farther) and behind a measured surface within which
/// positions are scored, in the scene's unit.
const SIGHT_BEFORE: f64 = 0.6;
const SIGHT_BEHIND: f64 = 0.25;
/// Empty margin around a solid, as a share of its longest side.
const MARGIN: f64 = 0.2;
/// Desired number of voxels across a solid's mean thickness, and most voxels along its side for
/// that.
const VOXELS_ACROSS: f64 = 3.0;
const MOST_COARSE_VOXELS: usize = 48;

impl Scene {
    pub fn new(given: &ModelInput<'_>) -> Result<Self, ModelError> {
        let (world_from_scene, unit) = frame_and_unit(given)?;
        let prepared = Prepared::new(given, &world_from_scene, unit);
        let [coarse, middle] = [COARSE, MIDDLE].map(|level| prepared.objective(level));
        Ok(Self { world_from_scene, unit, coarse: coarse?, middle: middle? })
    }

    /// Prepares only what compares finalists, in a given frame and unit.
    pub fn middle_in(
        given: &ModelInput<'_>,
        world_from_scene: &Pose,
        unit: f64,
    ) -> Result<Objective, ModelError> {
        Prepared::new(given, world_from_scene, unit).objective(MIDDLE)
    }

    /// Prepares the rest of a scene in that frame and unit.
    pub fn around(
        middle: Objective,
        given: &ModelInput<'_>,
        world_from_scene: Pose,
        unit: f64,
    ) -> Result<Self, ModelError> {
        let coarse = Prepared::new(given, &world_from_scene, unit).objective(COARSE)?;
        Ok(Self { world_from_scene, unit, coarse, middle })
    }

    /// Prepares all of some evidence, in the frame and unit of the scene, for a final fit.
    pub fn finest(&self, given: &ModelInput<'_>) -> Result<Objective, ModelError> {
        Prepared::new(given, &self.world_from_scene, self.unit).objective(FINEST)
    }

    /// Transforms ellipsoids to the world.
    pub fn ellipsoids(&self, quadrics: &[Quadric]) -> Vec<Ellipsoid> {
        solids(quadrics, &self.world_from_scene, self.unit)
    }

    /// Transforms ellipsoids to the world and makes them a body.
    pub fn body(&self, quadrics: &[Quadric]) -> Result<Body, ModelError> {
        Ok(Body::around(&self.ellipsoids(quadrics))?)
    }
}

/// Transforms ellipsoids from a frame with a unit of its own to the world.
pub(super) fn solids(quadrics: &[Quadric], world_from_scene: &Pose, unit: f64) -> Vec<Ellipsoid> {
    let solid =
        |q: &Quadric| Ellipsoid::from_quadric(q, LEAST_RADIUS).transformed(world_from_scene, unit);
    quadrics.iter().map(solid).collect()
}

/// Selects the frame and the unit.
fn frame_and_unit(given: &ModelInput<'_>) -> Result<(Pose, f64), ModelError> {
    if let Some(mesh) = given.mesh {
        return Ok((mesh.principal_frame(), mesh.extent()));
    }
    let has_samples = given.samples.len() >= LEAST_SAMPLES;
    if given.views.len() >= 2 {
        match common_point(given.views) {
            // Depth gives the object's distance, even if all views are from one position.
            Err(ModelError::NoBaseline) if has_samples => {}
            found => return Ok(about_views(given.views, found?)),
        }
    }
    if has_samples {
        return about_samples(given.samples);
    }
    if given.views.len() < 2 && !given.samples.is_empty() {
        return Err(ModelError::TooFewRangeSamples {
            given: given.samples.len(),
            least: LEAST_SAMPLES,
        });
    }
    Err(ModelError::TooFewViews(given.views.len()))
}

/// Returns the axes of the first camera at the views' common point, and the object's mean radius.
fn about_views(views: &[View<'_>], origin: Vector3<f64>) -> (Pose, f64) {
    let rotation = views[0].world_from_camera().rotation();
    (Pose::from_rotation(rotation, origin), mean_radius(views, &origin))
}

/// Fewer measured points than this do not determine a shape.
const LEAST_SAMPLES: usize = 50;

/// Share of the largest coordinate by which equal points may differ after rounding.
const ROUNDING: f64 = 1e-12;
/// Largest width of points on a line, as a share of their length.
const THIN: f64 = 1e-6;

/// Returns the principal frame of measured points and their mean distance from its origin.
fn about_samples(samples: &[RangeSample]) -> Result<(Pose, f64), ModelError> {
    let count = samples.len() as f64;
    let centroid = samples.iter().map(|sample| sample.point).sum::<Vector3<f64>>() / count;
    let offsets = || samples.iter().map(|sample| sample.point - centroid);
    let spread = offsets().map(|d| d * d.transpose()).sum::<Matrix3<f64>>() / count;
    let radius = offsets().map(|d| d.norm()).sum::<f64>() / count;
    let refused = |what| Err(ModelError::NoSurface { given: samples.len(), what });
    if radius <= ROUNDING * samples.iter().map(|sample| sample.point.amax()).fold(0.0, f64::max) {
        return refused("are all at one position");
    }
    let mut squared = <[f64; 3]>::from(spread.symmetric_eigenvalues());
    squared.sort_by(f64::total_cmp);
    if squared[1] <= THIN * THIN * squared[2] {
        return refused("lie on a line");
    }
    let lean = |axis: &Vector3<f64>| offsets().map(|d| d.dot(axis).powi(3)).sum();
    Ok((Pose::principal(centroid, &spread, lean), radius))
}

/// Cost of a unit of anisotropy in F: small enough to matter only where the views do not decide;
/// larger if all views look from one side, which does not constrain the thickness.
pub(super) const ANISOTROPY_COST: f64 = 3e-4;
const ONE_LOOK_COST: f64 = 3e-3;
/// Cosine of the angle between two views below which they look from different sides.
const ONE_SIDE: f64 = 0.7;

/// Returns whether views look from more than one side.
fn wide(cameras: &[CameraFromScene]) -> bool {
    let directions: Vec<_> = cameras.iter().map(direction).collect();
    directions.iter().any(|one| directions.iter().any(|two| one.dot(two) < ONE_SIDE))
}

/// Returns the direction from the origin to a camera.
fn direction((rotation, translation): &CameraFromScene) -> Vector3<f64> {
    -(rotation.transpose() * translation).normalize()
}

/// The evidence in the scene's frame and unit.
struct Prepared<'a> {
    given: &'a ModelInput<'a>,
    cameras: Vec<CameraFromScene>,
    /// Views from the most different directions first.
    order: Vec<usize>,
    mesh: Option<Mesh>,
    /// Voxels along the longest side that a thin solid needs.
    fine: usize,
    samples: Vec<RangeSample>,
    extent: Option<Extent>,
}

impl<'a> Prepared<'a> {
    fn new(given: &'a ModelInput<'a>, world_from_scene: &Pose, unit: f64) -> Self {
        let scene_from_world = world_from_scene.inverse();
        let camera =
            |view: &View<'_>| camera_from_scene(&view.world_from_camera(), world_from_scene, unit);
        let cameras: Vec<_> = given.views.iter().map(camera).collect();
        let order = spread_out(&cameras);
        let mesh = given.mesh.map(|mesh| mesh.moved(&scene_from_world, 1.0 / unit));
        let fine = mesh.as_ref().map_or(0.0, |mesh| VOXELS_ACROSS * mesh.slenderness());
        let sample = |sample: &RangeSample| RangeSample {
            point: scene_from_world.transform(&sample.point) / unit,
            direction: scene_from_world.rotation() * sample.direction,
            eye: sample.eye / unit,
        };
        let samples: Vec<RangeSample> = given.samples.iter().map(sample).collect();
        let points: Vec<_> = samples.iter().map(|sample| sample.point).collect();
        let (fine, extent) = (fine.ceil() as usize, Extent::of(&points));
        Self { given, cameras, order, mesh, fine, samples, extent }
    }

    fn objective(&self, resolution: Resolution) -> Result<Objective, ModelError> {
        let weights = self.given.weights;
        let mut total = Total::default();
        if !self.cameras.is_empty() {
            let chosen = &self.order[..resolution.views.min(self.order.len())];
            let pairs: Vec<_> =
                chosen.iter().map(|&i| (&self.given.views[i], &self.cameras[i])).collect();
            total.push(weights.silhouettes, overlap(&pairs, resolution.extent_px)?);
        }
        if let Some(mesh) = &self.mesh {
            let voxels = resolution.voxels.max(self.fine.min(MOST_COARSE_VOXELS));
            let margin = (MARGIN * voxels as f64).ceil() as usize;
            total.push(weights.volume, Volume::new(mesh.fill(voxels, margin)));
        }
        if !self.samples.is_empty() {
            let step = self.samples.len().div_ceil(resolution.samples);
            let some = self.samples.iter().step_by(step).copied().collect();
            total.push(weights.depth, RangeSamples::new(some, SIGHT_BEFORE, SIGHT_BEHIND));
        }
        if total.is_empty() {
            return Err(ModelError::Nothing);
        }
        let whole = self.mesh.is_some();
        let settled = whole || wide(&self.cameras);
        let anisotropy_cost = if settled { ANISOTROPY_COST } else { ONE_LOOK_COST };
        let extent = if settled { None } else { self.extent };
        // A volume has so many rows that its slope is smooth, and an ascent soon converges.
        let least_gain = if whole { 5e-6 } else { 1e-6 };
        Ok(Objective { total, anisotropy_cost, extent, least_gain })
    }
}

/// Returns rotation and translation from the scene to a camera, in the scene's unit, rounded so
/// that the same scene in another world frame has the same bits.
pub(super) fn camera_from_scene(
    world_from_camera: &Pose,
    world_from_scene: &Pose,
    unit: f64,
) -> CameraFromScene {
    let pose = world_from_camera.inverse() * *world_from_scene;
    let grain = f64::from(1_u32 << 26);
    let rounded = |x: f64| (x * grain).round() / grain;
    (pose.rotation_matrix().map(rounded), (pose.translation() / unit).map(rounded))
}

/// Orders views so that the first n have the most different directions: each next one is the
/// farthest from all before it.
fn spread_out(cameras: &[CameraFromScene]) -> Vec<usize> {
    let directions: Vec<Vector3<f64>> = cameras.iter().map(direction).collect();
    if directions.is_empty() {
        return Vec::new();
    }
    let mut order = vec![0];
    let mut nearest: Vec<f64> = directions.iter().map(|d| (d - directions[0]).norm()).collect();
    while order.len() < directions.len() {
        // Selected ones are nearest to themselves; marking them prevents selecting twins twice.
        order.iter().for_each(|&chosen| nearest[chosen] = -1.0);
        let farthest = (0..nearest.len()).rev().max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        let Some(next) = farthest else { break };
        for (distance, direction) in nearest.iter_mut().zip(&directions) {
            *distance = distance.min((direction - directions[next]).norm());
        }
        order.push(next);
    }
    order
}

/// Finds the point closest to all lines of sight to the masks' centres.
pub(super) fn common_point(views: &[View<'_>]) -> Result<Vector3<f64>, ModelError> {
    let (mut normal, mut target) = (Matrix3::zeros(), Vector3::zeros());
    for view in views {
        let sight = line_of_sight(view);
        let across = Matrix3::identity() - sight * sight.transpose();
        normal += across;
        target += across * view.world_from_camera().translation();
    }
    // The mean squared sine of the angles between the lines of sight.
    let spread = SymmetricEigen::new(normal / views.len() as f64).eigenvalues.min();
    let point = normal.lu().solve(&target).filter(|_| spread > 1e-6);
    let point = point.filter(|point| is_apart(views, point)).ok_or(ModelError::NoBaseline)?;
    for (index, view) in views.iter().enumerate() {
        if let Some(what) = disagreement(view, &point) {
            return Err(ModelError::NoCommonPoint { point: point.into(), view: index, what });
        }
    }
    Ok(point)
}

/// Least distance between cameras, as a share of their distance from the object and from the
/// world's origin: a thousandth of a radian of parallax, and the remaining rounding error.
const LEAST_PARALLAX: f64 = 1e-3;
const LEAST_APART: f64 = 1e-9;

/// Returns whether cameras are at different positions, as seen from a point. If all are at one
/// position, their lines of sight meet there, whatever the masks are.
fn is_apart(views: &[View<'_>], point: &Vector3<f64>) -> bool {
    let places: Vec<_> = views.iter().map(|view| view.world_from_camera().translation()).collect();
    let far =
        |from: &Vector3<f64>| places.iter().map(|place| (place - from).norm()).fold(0.0, f64::max);
    let apart = far(&places[0]);
    apart > LEAST_PARALLAX * far(point) && apart > LEAST_APART * far(&Vector3::zeros())
}

/// Returns the direction, in the world, in which a view sees its mask's centre.
pub(super) fn line_of_sight(view: &View<'_>) -> Vector3<f64> {
    let ray = view.camera().ray(view.mask().centroid_px()).normalize();
    view.world_from_camera().rotation() * ray
}

/// Returns how a view contradicts an object at a point, if it does: the point must lie in front of
/// the camera and project to within one mask's size of the mask.
fn disagreement(view: &View<'_>, point: &Vector3<f64>) -> Option<&'static str> {
    let in_camera = view.world_from_camera().inverse().transform(point);
    let Some(pixel) = view.camera().project(&in_camera) else {
        return Some("has behind its camera");
    };
    let (first, last) = view.mask().bounds_px();
    let near = |i: usize| {
        let extent = (last[i] - first[i] + 1) as f64;
        (first[i] as f64 - extent..=last[i] as f64 + extent).contains(&pixel[i])
    };
    (!(near(0) && near(1))).then_some("sees far from its mask")
}

/// Returns the median radius of the discs with the areas of the masks.
pub(super) fn mean_radius(views: &[View<'_>], origin: &Vector3<f64>) -> f64 {
    let radius = |view: &View<'_>| {
        let depth = view.world_from_camera().inverse().transform(origin).z;
        let [fx, fy] = view.camera().focal_px();
        depth * (view.mask().area_px() as f64 / (std::f64::consts::PI * fx * fy)).sqrt()
    };
    let mut radii: Vec<_> = views.iter().map(radius).collect();
    radii.sort_by(f64::total_cmp);
    radii[radii.len() / 2]
}

/// Returns the intersection over union of the body's silhouette and the mask in each view, pixel by
/// pixel.
#[must_use]
pub fn silhouette_ious(body: &Body, views: &[View<'_>]) -> Vec<f64> {
    use crate::parallel::*;
    let iou = |view: &View<'_>| {
        let drawn = silhouette(body, view.camera(), &view.world_from_camera());
        let [width, height] = view.camera().size_px();
        let (mut both, mut either) = (0_usize, 0_usize);
        for (row, drawn) in (0..height).map(|v| view.mask().image().row(v)).zip(drawn.chunks(width))
        {
            for (&m, &d) in row.iter().zip(drawn) {
                both += usize::from(m != 0 && d != 0);
                either += usize::from(m != 0 || d != 0);
            }
        }
        both as f64 / either.max(1) as f64
    };
    views.par_iter().map(iou).collect()
}
