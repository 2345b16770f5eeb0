use nalgebra::{Matrix6, Vector3, Vector6};

use super::guess::Distance;
use super::lines::add_lines;
use super::matching::match_points;
use super::measurement::{Measurement, outlying};
use super::uncertainty::inverse;
use crate::camera::Pyramid;
use crate::fitness::{ContourPoint, contour};
use crate::pose::{Pose, Twist};
use crate::shape::Outline;
use crate::track::frame::occlusion::{LastSeen, Occlusion};
use crate::track::inputs::Inputs;
use crate::track::motion::Prior;
use crate::track::target::bias::Information;
use crate::track::target::contour_offsets::Edge;
use crate::track::target::points::{InView, Match};
use crate::track::target::ranges::Residual;
use crate::track::target::solid::Rims;

/// Normal equations of a weighted sum of squares about a pose: curvature and slope for a small
/// motion in the object's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Normal {
    pub(crate) curvature: Matrix6<f64>,
    /// The part of the curvature that does not come from images.
    pub(crate) prior: Matrix6<f64>,
    pub(crate) slope: Vector6<f64>,
    /// Information of the outline, with its bias.
    pub(crate) outline: Information,
    /// The part of it that is in the sum: what remains after its bias is marginalised.
    freed: Information,
    /// The part of the outline whose boundary offset is known; it is not in the sum.
    pub(crate) replaced: Information,
    /// Information of the boundary there, in its place; it is in the sum.
    edges: Information,
    /// What remains of the whole outline after its bias is marginalised.
    whole: Information,
}

/// A pose with the normal equations of the images.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Evaluated {
    pub(crate) pose: Pose,
    pub(crate) normal: Normal,
    /// Agreement of the outline with the images: the sum over lines, and their number.
    pub(crate) outline: (f64, f64),
}

impl Evaluated {
    /// Makes a pose without any measurement.
    pub(crate) fn nothing(pose: Pose, radius: f64) -> Self {
        Self { pose, normal: Normal::new(radius), outline: (0.0, 0.0) }
    }
}

/// Memory of a refinement, reused from image to image.
#[derive(Debug, Clone, Default)]
pub(crate) struct Workspace {
    /// The points that should be visible, and those of them that are compared.
    pub(crate) visible: Vec<InView>,
    pub(crate) in_view: Vec<InView>,
    pub(crate) matches: Vec<Match>,
    pub(crate) rims: Rims,
    pub(crate) occlusion: Occlusion,
    /// Current displacement of each point in view in metres, if its distance is a guess.
    pub(crate) moved: Vec<f64>,
    pub(crate) distances: Vec<Distance>,
    /// What the matches say about the pose, and their squared residuals.
    measurements: Vec<Measurement>,
    squares: Vec<f64>,
    outlines: Vec<(usize, Outline)>,
    pub(crate) exposed_outlines: Vec<Outline>,
    pub(crate) contour: Vec<ContourPoint>,
    /// The boundary along the outline, as the finest resolution shows it.
    pub(crate) edges: Vec<Edge>,
}

/// Longest step, in radii and radians.
pub(crate) const MOST_STEP: f64 = 0.35;
/// Most steps at each resolution, the finest first. They end on convergence: with a quarter of
/// these, the pose of a rotating object lagged behind, until another pose looked better.
const STEPS: [usize; Pyramid::LEVELS] = [16, 12, 12];
/// Step size, in radii, below which the steps end, at the finest resolution.
const CONVERGED: f64 = 1e-3;
/// Pixels along the outline between lines.
const LINE_SPACING_PX: f64 = 8.0;
/// Most steps that move guessed points at a fixed pose.
const GUESSES: usize = 4;

impl Normal {
    /// Starts from a weak prior on the pose, so that unconstrained directions do not move.
    pub(crate) fn new(radius: f64) -> Self {
        let (across, turn) = ((0.3 * radius).powi(-2), 0.5_f64.powi(-2));
        let diagonal = Vector6::new(across, across, across, turn, turn, turn);
        let prior = Matrix6::from_diagonal(&diagonal);
        let none = (Matrix6::zeros(), Vector6::zeros());
        Self {
            curvature: prior,
            prior,
            slope: none.1,
            outline: none,
            freed: none,
            replaced: none,
            edges: none,
            whole: none,
        }
    }

    /// Returns the information of everything but the outline.
    pub(crate) fn rest(&self) -> Information {
        (self.curvature - self.freed.0 - self.edges.0, self.slope - self.freed.1 - self.edges.1)
    }

    /// Returns the sum without the edges whose offsets the tracker itself learned: they cannot
    /// confirm the poses by which they were learned.
    pub(crate) fn without_edges(&self) -> Self {
        if self.edges.0 == Matrix6::zeros() {
            return *self;
        }
        let (curvature, slope) = self.rest();
        let (curvature, slope) = (curvature + self.whole.0, slope + self.whole.1);
        Self { curvature, slope, ..*self }
    }

    /// Returns the covariance, including the prior.
    pub(crate) fn covariance(&self) -> Matrix6<f64> {
        inverse(&self.curvature).unwrap_or_else(Matrix6::identity)
    }

    fn step(&self) -> Option<Twist> {
        Some(self.curvature.cholesky()?.solve(&self.slope))
    }
}

/// Refines a pose by Gauss-Newton steps from coarse to fine until surface points and outline agree
/// with the images; the matches remain in the workspace.
pub(crate) fn refine(
    inputs: &Inputs<'_>,
    (start, coarsest): (Pose, usize),
    prior: Option<&Prior>,
    workspace: &mut Workspace,
) -> Evaluated {
    let last_seen = last_seen(prior);
    let mut found = Evaluated::nothing(start, inputs.solid.radius);
    workspace.forget_distances();
    for level in (0..=coarsest).rev() {
        for number in 0..STEPS[level] {
            match_points(inputs, &found.pose, level, workspace);
            if number == 0 {
                workspace.look_for_hidden(inputs, &found.pose, last_seen);
            }
            found = linearize(inputs, (found.pose, prior), level, workspace);
            let Some(step) = found.normal.step() else { break };
            let step = bounded(step, inputs.solid.radius);
            workspace.move_guesses(&step, inputs.solid.radius);
            found.pose = found.pose * Pose::exp(&step);
            let turn = step.fixed_rows::<3>(3).norm() * inputs.solid.radius;
            if step.fixed_rows::<3>(0).norm() + turn
                < CONVERGED * f64::from(1 << level) * inputs.solid.radius
            {
                break;
            }
        }
    }
    workspace.look_for_hidden(inputs, &found.pose, last_seen);
    found
}

/// Compares what should be visible at a pose with the images, without moving the pose; the matches
/// remain in the workspace.
pub(crate) fn evaluate_at(
    inputs: &Inputs<'_>,
    pose: Pose,
    prior: Option<&Prior>,
    workspace: &mut Workspace,
) -> Evaluated {
    workspace.forget_distances();
    match_points(inputs, &pose, 0, workspace);
    workspace.look_for_hidden(inputs, &pose, last_seen(prior));
    let mut found = linearize(inputs, (pose, prior), 0, workspace);
    for _ in 0..GUESSES {
        if workspace.distances.is_empty() {
            break;
        }
        workspace.move_guesses(&Twist::zeros(), inputs.solid.radius);
        match_points(inputs, &pose, 0, workspace);
        found = linearize(inputs, (pose, prior), 0, workspace);
    }
    found
}

/// Returns whether the object was seen a moment ago: only then is it assumed to be there though
/// hidden.
fn last_seen(prior: Option<&Prior>) -> LastSeen {
    if prior.is_some() { LastSeen::There } else { LastSeen::Elsewhere }
}

fn bounded(step: Twist, radius: f64) -> Twist {
    let size = step.fixed_rows::<3>(0).norm() / radius + step.fixed_rows::<3>(3).norm();
    step * (MOST_STEP / size.max(MOST_STEP))
}

/// Sums the information of surface points, depth images and outline about a pose, and its prior;
/// uses the matches in the workspace.
fn linearize(
    inputs: &Inputs<'_>,
    (pose, prior): (Pose, Option<&Prior>),
    level: usize,
    workspace: &mut Workspace,
) -> Evaluated {
    let mut sum = Evaluated::nothing(pose, inputs.solid.radius);
    if let Some((information, pull)) = prior.map(|prior| prior.at(&pose)) {
        sum.normal.curvature += information;
        sum.normal.prior += information;
        sum.normal.slope += pull;
    }
    let (mut camera, mut eye) = (usize::MAX, None);
    workspace.measurements.clear();
    for Match { view, agreement, level: matched_level, pixel, at, moved, .. } in &workspace.matches
    {
        if let (Some(agreement), Some(pixel)) = (agreement, pixel) {
            if view.camera != camera {
                let seen = inputs.windows[view.camera].projection(&pose);
                (camera, eye) = (view.camera, seen.and_then(|seen| seen.eye()));
            }
            let shows = 1.0 - workspace.occlusion.hides(view.camera, pixel);
            let (point, matched) = ((*view, *at, *moved), (agreement, *matched_level));
            let found = Measurement::new(inputs, point, matched, (shows, eye));
            workspace.measurements.extend(found);
        }
    }
    let outlying = outlying(&workspace.measurements, &mut workspace.squares);
    workspace.distances.clear();
    for one in &workspace.measurements {
        workspace.distances.extend(one.add_to(&mut sum.normal, outlying));
    }
    for camera in 0..inputs.windows.len() {
        add_ranges(&mut sum.normal, inputs, (camera, &pose), &workspace.occlusion);
    }
    workspace.edges.clear();
    if let Some(colors) = inputs.colors {
        for (camera, (window, image)) in inputs.windows.iter().zip(inputs.images).enumerate() {
            if let (Some(projection), Some(image)) = (window.projection(&pose), image) {
                let ratio = |u, v| window.ratio(image, colors, u, v);
                contour(
                    &projection,
                    &inputs.solid.quadrics,
                    LINE_SPACING_PX,
                    &mut workspace.outlines,
                    &mut workspace.contour,
                );
                let offsets = (inputs.offsets, inputs.solid.radius);
                add_lines(&mut sum, (camera, level), ratio, offsets, workspace);
            }
        }
        let normal = &mut sum.normal;
        let toward = toward(inputs, &pose);
        normal.whole = inputs.bias.freed(&toward, normal.outline);
        normal.freed = if normal.replaced.0 == Matrix6::zeros() {
            normal.whole
        } else {
            let (all, replaced) = (normal.outline, normal.replaced);
            inputs.bias.freed(&toward, (all.0 - replaced.0, all.1 - replaced.1))
        };
        normal.curvature += normal.freed.0;
        normal.slope += normal.freed.1;
        normal.edges = inputs.offsets.measured(&mut workspace.edges);
        normal.curvature += normal.edges.0;
        normal.slope += normal.edges.1;
    }
    sum
}

/// Returns the direction from the object to the first open camera, in the object's frame.
pub(crate) fn toward(inputs: &Inputs<'_>, pose: &Pose) -> Vector3<f64> {
    let eye = inputs.windows.iter().find_map(|window| window.projection(pose)?.eye());
    eye.map_or_else(Vector3::z, |eye| eye.normalize())
}

impl Workspace {
    /// Updates where something hides the object, by the matches in the workspace.
    fn look_for_hidden(&mut self, inputs: &Inputs<'_>, pose: &Pose, last_seen: LastSeen) {
        self.occlusion.observe(
            inputs,
            (pose, last_seen),
            &self.matches,
            &mut self.exposed_outlines,
        );
    }
}

/// Adds the information of a camera's depth image about a pose, where nothing hides the object.
fn add_ranges(
    normal: &mut Normal,
    inputs: &Inputs<'_>,
    (camera, pose): (usize, &Pose),
    occlusion: &Occlusion,
) {
    let Some(seen) = inputs.rangefinder(camera, pose) else { return };
    let residuals = inputs.ranges.residuals(&seen, (inputs.solid, inputs.points.drift_variance));
    for (pixel, Residual { off, by_motion, information }) in residuals {
        let weight = information * (1.0 - occlusion.hides(camera, &pixel));
        normal.curvature += by_motion * by_motion.transpose() * weight;
        normal.slope += by_motion * (off * weight);
    }
}
