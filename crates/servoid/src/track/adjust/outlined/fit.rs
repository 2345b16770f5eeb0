//! Fits the ellipsoids of a body and the poses of keyframes to boundaries together, by the
//! Levenberg-Marquardt method.

use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, SVector, Vector6};

use super::residuals::{Distances, Row, View};
use super::shape::{Change, Part};
use crate::pose::Pose;

/// What is adjusted: the poses of keyframes, of which the first is fixed, and the body.
#[derive(Debug, Clone)]
pub(crate) struct State {
    pub(crate) poses: Vec<Pose>,
    pub(crate) parts: Vec<Part>,
}

/// What is known: the boundaries, and the state before any of them, however uncertain.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub(crate) views: Vec<View>,
    pub(crate) prior: State,
    /// Of the body, in metres.
    pub(crate) radius: f64,
    /// Whether the body is fixed as well.
    pub(crate) is_rigid: bool,
    /// Weight of what is known before.
    pub(crate) prior_weight: f64,
}

/// Standard deviation of a distance in pixels, and number of neighbours that share one error: the
/// ellipsoids leave out what is larger than the noise of a boundary, and is correlated along it.
const SD_PX: f64 = 1.0;
const TOGETHER: f64 = 6.0;
/// Distance in standard deviations of a point that has half of its weight.
const OUTLYING: f64 = 3.0;
/// Standard deviations of the body before: of a centre in radii, of the logarithm of a radius, and
/// of an orientation in radians.
const CENTER: f64 = 0.4;
const LOG_RADIUS: f64 = 0.5;
const AXES_RAD: f64 = 0.6;
/// The same of a keyframe: of its position in radii, and of its orientation in radians.
const PLACE: f64 = 0.3;
const TURN_RAD: f64 = 0.52;
/// Initial damping, its bounds, and its factors after a step that lowers the cost and after one that
/// does not.
const DAMPING: (f64, f64, f64, f64) = (1e-2, 1e-5, 0.2, 5.0);
const MOST_DAMPING: f64 = 1e4;
/// Relative decrease of the cost below which the steps end.
const CONVERGED: f64 = 1e-3;
/// Share of the nearest points of a boundary whose distances count as its misfit.
const NEAREST: f64 = 0.9;

/// The normal equations at a state.
struct Equations {
    curvature: DMatrix<f64>,
    slope: DVector<f64>,
}

/// A state that was fitted.
#[derive(Debug, Clone)]
pub(crate) struct Fitted {
    pub(crate) state: State,
    pub(crate) cost: f64,
}

impl Scene {
    /// Fits from a state, in a number of steps at most; none if a part of the body is not in front
    /// of the cameras there.
    pub(super) fn fitted(&self, from: &State, steps: usize) -> Option<Fitted> {
        let mut state = from.clone();
        let mut cost = self.cost(&state)?;
        let mut damping = DAMPING.0;
        for _ in 0..steps {
            let equations = self.equations(&state)?;
            let lower = loop {
                let tried = equations.step(damping).map(|step| self.moved(&state, &step));
                let new = tried.and_then(|tried| Some((self.cost(&tried)?, tried)));
                match new {
                    Some((new, tried)) if new < cost => break Some((new, tried)),
                    _ if damping > MOST_DAMPING => break None,
                    _ => damping *= DAMPING.3,
                }
            };
            let Some((new, tried)) = lower else { break };
            damping = (damping * DAMPING.2).max(DAMPING.1);
            let gain = cost - new;
            (cost, state) = (new, tried);
            if gain <= CONVERGED * cost {
                break;
            }
        }
        Some(Fitted { state, cost })
    }

    /// Returns the distances of each view; none if a part of the body is not in front of a camera.
    pub(super) fn distances(&self, state: &State) -> Option<Vec<Distances>> {
        self.with_slopes(state, false)
    }

    fn with_slopes(&self, state: &State, sloped: bool) -> Option<Vec<Distances>> {
        let of = |view: &View| view.distances(&state.parts, &state.poses[view.keyframe], sloped);
        self.views.iter().map(of).collect()
    }

    /// Returns the rms distance of each view's boundary from the outline, in pixels, without the
    /// farthest points.
    pub(super) fn misfits(&self, state: &State) -> Option<Vec<f64>> {
        let misfit = |one: &Distances| {
            let mut squares: Vec<_> = one.boundary.iter().map(|row| row.off_px.powi(2)).collect();
            squares.sort_unstable_by(f64::total_cmp);
            squares.truncate((NEAREST * squares.len() as f64) as usize);
            (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
        };
        Some(self.distances(state)?.iter().map(misfit).collect())
    }

    /// Returns the radius of the body as the images show it, in pixels, on average.
    pub(super) fn radius_px(&self, state: &State) -> Option<f64> {
        let of = |view: &View| view.radius_px(&state.poses[view.keyframe], self.radius);
        let all: Option<Vec<_>> = self.views.iter().map(of).collect();
        let all = all?;
        Some(all.iter().sum::<f64>() / all.len().max(1) as f64)
    }

    /// Returns the covariance of each keyframe's pose, as a small motion of the object.
    pub(super) fn covariances(&self, state: &State) -> Option<Vec<Matrix6<f64>>> {
        let inverse = self.equations(state)?.curvature.cholesky()?.inverse();
        let from = self.numbers(&state.parts);
        let own = |at: usize| match at.checked_sub(1) {
            Some(free) => inverse.fixed_view::<6, 6>(from + 6 * free, from + 6 * free).into_owned(),
            None => Matrix6::zeros(),
        };
        Some((0..state.poses.len()).map(own).collect())
    }

    fn cost(&self, state: &State) -> Option<f64> {
        let rows = self.distances(state)?;
        let rows = rows.iter().flat_map(|one| one.boundary.iter().chain(&one.outline));
        let seen = rows.map(|row| row.weight * robust(row.off_px).0).sum::<f64>();
        let (parts, poses) = self.off(state);
        let parts = parts.iter().map(|off| off.component_mul(off).dot(&self.part_information()));
        let poses = poses.iter().map(|off| off.component_mul(off).dot(&self.pose_information()));
        let cost = seen * SCALE + parts.sum::<f64>() + poses.sum::<f64>();
        cost.is_finite().then_some(cost)
    }

    /// Returns the information of all keyframes together on one small motion of the object.
    pub(super) fn together(&self, state: &State) -> Option<Matrix6<f64>> {
        let mut sum = Matrix6::zeros();
        for distances in self.with_slopes(state, true)? {
            for row in distances.boundary.iter().chain(&distances.outline) {
                let by_motion = row.slope.fixed_rows::<6>(9).into_owned();
                let weight = information(row);
                sum += by_motion * by_motion.transpose() * weight;
            }
        }
        Some(sum)
    }

    /// Returns the number of numbers of the body that are adjusted.
    fn numbers(&self, parts: &[Part]) -> usize {
        if self.is_rigid { 0 } else { 9 * parts.len() }
    }

    fn moved(&self, state: &State, by: &DVector<f64>) -> State {
        let from = self.numbers(&state.parts);
        let mut parts = state.parts.clone();
        for (at, part) in parts.iter_mut().enumerate().take(from / 9) {
            *part = part.moved(&by.fixed_rows::<9>(9 * at).into_owned());
        }
        let poses = state.poses.iter().enumerate().map(|(at, pose)| match at.checked_sub(1) {
            Some(free) => {
                let by = by.fixed_rows::<6>(from + 6 * free).into_owned();
                (*pose * Pose::exp(&by)).renormalized()
            }
            None => *pose,
        });
        State { poses: poses.collect(), parts }
    }

    fn equations(&self, state: &State) -> Option<Equations> {
        let (parts, body) = (state.parts.len(), self.numbers(&state.parts));
        let size = body + 6 * (state.poses.len() - 1);
        let mut sum =
            Equations { curvature: DMatrix::zeros(size, size), slope: DVector::zeros(size) };
        for (view, distances) in self.views.iter().zip(self.with_slopes(state, true)?) {
            let mut blocks = vec![(SMatrix::<f64, 15, 15>::zeros(), SVector::zeros()); parts];
            for row in distances.boundary.iter().chain(&distances.outline) {
                let weight = information(row);
                let (curvature, slope) = &mut blocks[row.part];
                let weighted = row.slope * weight;
                *slope -= weighted * row.off_px;
                for j in 0..15 {
                    for i in j..15 {
                        curvature[(i, j)] += row.slope[i] * weighted[j];
                    }
                }
            }
            let from = view.keyframe.checked_sub(1).map(|free| body + 6 * free);
            for (part, (curvature, slope)) in blocks.iter().enumerate() {
                let own = (!self.is_rigid).then_some(9 * part);
                sum.add((own, from), curvature, slope);
            }
        }
        let (parts_off, poses_off) = self.off(state);
        for (part, off) in parts_off.iter().enumerate().take(body / 9) {
            sum.add_prior(9 * part, self.part_information().as_slice(), off.as_slice());
        }
        for (at, off) in poses_off.iter().enumerate() {
            sum.add_prior(body + 6 * at, self.pose_information().as_slice(), off.as_slice());
        }
        Some(sum)
    }

    /// Returns how far a state is from what was known before.
    fn off(&self, state: &State) -> (Vec<Change>, Vec<Vector6<f64>>) {
        let parts = state.parts.iter().zip(&self.prior.parts);
        let poses = state.poses.iter().zip(&self.prior.poses).skip(1);
        (
            parts.map(|(one, before)| one.change_from(before)).collect(),
            poses.map(|(one, before)| (before.inverse() * *one).log()).collect(),
        )
    }

    fn part_information(&self) -> Change {
        let mut information = Change::zeros();
        information.fixed_rows_mut::<3>(0).fill((CENTER * self.radius).powi(-2));
        information.fixed_rows_mut::<3>(3).fill(LOG_RADIUS.powi(-2));
        information.fixed_rows_mut::<3>(6).fill(AXES_RAD.powi(-2));
        information * self.prior_weight
    }

    fn pose_information(&self) -> Vector6<f64> {
        let (place, turn) = ((PLACE * self.radius).powi(-2), TURN_RAD.powi(-2));
        Vector6::new(place, place, place, turn, turn, turn) * self.prior_weight
    }
}

const SCALE: f64 = 1.0 / (2.0 * TOGETHER * SD_PX * SD_PX);

/// Returns Cauchy's cost of a distance in pixels, and its weight: where the surroundings have the
/// object's colours, its boundary is lost.
fn robust(off_px: f64) -> (f64, f64) {
    let bend = (OUTLYING * SD_PX).powi(2);
    let far = off_px * off_px / bend;
    (bend * libm::log1p(far), 1.0 / (1.0 + far))
}

/// Returns the information of a distance, as robust as its cost.
fn information(row: &Row) -> f64 {
    row.weight * robust(row.off_px).1 * SCALE
}

impl Equations {
    /// Adds what a view says of an ellipsoid and of the pose of its keyframe, unless they are fixed;
    /// only the part below the diagonal is read of the former, and filled of the sum.
    fn add(
        &mut self,
        (part, pose): (Option<usize>, Option<usize>),
        curvature: &SMatrix<f64, 15, 15>,
        slope: &SVector<f64, 15>,
    ) {
        let place = |at: usize| if at < 9 { Some(part? + at) } else { Some(pose? + at - 9) };
        for j in 0..15 {
            let Some(column) = place(j) else { continue };
            self.slope[column] += slope[j];
            for i in j..15 {
                if let Some(row) = place(i) {
                    self.curvature[(row, column)] += curvature[(i, j)];
                }
            }
        }
    }

    fn add_prior(&mut self, from: usize, information: &[f64], off: &[f64]) {
        for (at, (information, off)) in information.iter().zip(off).enumerate() {
            self.curvature[(from + at, from + at)] += information;
            self.slope[from + at] -= information * off;
        }
    }

    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut damped = self.curvature.clone();
        for i in 0..damped.nrows() {
            damped[(i, i)] *= 1.0 + damping;
        }
        Some(damped.cholesky()?.solve(&self.slope))
    }
}
