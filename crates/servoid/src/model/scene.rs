use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use super::ModelError;
use super::levels::{COARSE, FINEST, Level, MIDDLE, Resolution};
use crate::observe::View;
use crate::pose::Pose;
use crate::shape::{Body, Ellipsoid, Quadric, silhouette};

/// The views in a frame and a unit of their own: the axes of the first camera, the origin where
/// the lines of sight meet, the object's mean radius as the unit. Whatever moves, turns or scales
/// the world leaves it as it is, and so the search that runs in it.
pub(super) struct Scene {
    world_from_scene: Pose,
    unit: f64,
    /// On which searches run.
    pub coarse: Level,
    /// On which their finalists are compared.
    pub middle: Level,
    /// All views, for the last touch.
    pub finest: Level,
}

/// Below this share of the unit a radius is no solid.
const LEAST_RADIUS: f64 = 1e-3;

impl Scene {
    pub fn new(views: &[View<'_>]) -> Result<Self, ModelError> {
        let origin = common_point(views)?;
        let unit = mean_radius(views, &origin);
        let rotation = views[0].world_from_camera().rotation();
        let world_from_scene = Pose::from_rotation(rotation, origin);
        let cameras: Vec<_> = views
            .iter()
            .map(|view| camera_from_scene(&view.world_from_camera(), &world_from_scene, unit))
            .collect();
        let spread = spread_out(&cameras);
        let level = |resolution: Resolution| {
            let chosen = &spread[..resolution.views.min(spread.len())];
            let pairs: Vec<_> = chosen.iter().map(|&i| (&views[i], &cameras[i])).collect();
            Level::new(&pairs, resolution.extent_px)
        };
        let (coarse, middle, finest) = (level(COARSE)?, level(MIDDLE)?, level(FINEST)?);
        Ok(Self { world_from_scene, unit, coarse, middle, finest })
    }

    /// Carries ellipsoids back to the world.
    pub fn body(&self, quadrics: &[Quadric]) -> Result<Body, ModelError> {
        let solid = |q: &Quadric| {
            Ellipsoid::from_quadric(q, LEAST_RADIUS).transformed(&self.world_from_scene, self.unit)
        };
        let in_world: Vec<_> = quadrics.iter().map(solid).collect();
        Ok(Body::around(&in_world)?)
    }
}

/// Gives rotation and translation from the scene to a camera, in the scene's unit, rounded so that
/// the same scene seen in another world has the same bits.
fn camera_from_scene(
    world_from_camera: &Pose,
    world_from_scene: &Pose,
    unit: f64,
) -> (Matrix3<f64>, Vector3<f64>) {
    let pose = world_from_camera.inverse() * *world_from_scene;
    let grain = f64::from(1_u32 << 26);
    let rounded = |x: f64| (x * grain).round() / grain;
    (pose.rotation_matrix().map(rounded), (pose.translation() / unit).map(rounded))
}

/// Orders views so that the first n look from as different directions as n views can: each next
/// one is the farthest from all before it.
fn spread_out(cameras: &[(Matrix3<f64>, Vector3<f64>)]) -> Vec<usize> {
    let directions: Vec<Vector3<f64>> =
        cameras.iter().map(|(rotation, t)| -(rotation.transpose() * t).normalize()).collect();
    let mut order = vec![0];
    let mut nearest: Vec<f64> = directions.iter().map(|d| (d - directions[0]).norm()).collect();
    while order.len() < directions.len() {
        // Chosen ones are nearest to themselves; marking them keeps twins from coming twice.
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
fn common_point(views: &[View<'_>]) -> Result<Vector3<f64>, ModelError> {
    if views.len() < 2 {
        return Err(ModelError::TooFewViews(views.len()));
    }
    let (mut normal, mut target) = (Matrix3::zeros(), Vector3::zeros());
    for view in views {
        let pose = view.world_from_camera();
        let sight = pose.rotation() * view.camera().ray(view.mask().centroid_px()).normalize();
        let across = Matrix3::identity() - sight * sight.transpose();
        normal += across;
        target += across * pose.translation();
    }
    // The mean squared sine of the angles between the lines of sight.
    let spread = SymmetricEigen::new(normal / views.len() as f64).eigenvalues.min();
    let point = normal.lu().solve(&target).filter(|_| spread > 1e-6);
    let point = point.ok_or(ModelError::NoBaseline)?;
    for (index, view) in views.iter().enumerate() {
        if let Some(what) = disagreement(view, &point) {
            return Err(ModelError::NoCommonPoint { point: point.into(), view: index, what });
        }
    }
    Ok(point)
}

/// Says how a view contradicts an object at a point: it must lie in front of the camera and be
/// seen within one mask's size of the mask.
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

/// Gives the median radius of the discs that fill as many pixels as the masks.
fn mean_radius(views: &[View<'_>], origin: &Vector3<f64>) -> f64 {
    let radius = |view: &View<'_>| {
        let depth = view.world_from_camera().inverse().transform(origin).z;
        let [fx, fy] = view.camera().focal_px();
        depth * (view.mask().area_px() as f64 / (std::f64::consts::PI * fx * fy)).sqrt()
    };
    let mut radii: Vec<_> = views.iter().map(radius).collect();
    radii.sort_by(f64::total_cmp);
    radii[radii.len() / 2]
}

/// Gives the intersection over union of the body's silhouette and the mask in each view, pixel by
/// pixel.
#[must_use]
pub fn silhouette_ious(body: &Body, views: &[View<'_>]) -> Vec<f64> {
    use rayon::prelude::*;
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
