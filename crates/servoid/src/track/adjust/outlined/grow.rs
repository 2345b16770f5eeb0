//! Adds an ellipsoid where those of the body cannot follow the boundaries.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::fit::{Fitted, Scene, State};
use super::residuals::{Distances, View};
use super::shape::Part;

/// Most ellipsoids that are added to, and the least decrease of the cost by one more.
const MOST: usize = 14;
const LEAST: f64 = 6.0;
/// Factor of the cost per view at which one more was not worth it, from which on it is tried again.
const AGAIN: f64 = 1.2;
/// Least number of keyframes for that: two tell a new ellipsoid from a turn less than more do.
const LEAST_KEYFRAMES: usize = 5;
/// Distance of a boundary from the outline, in radii, that is no misfit, and the rms of what is
/// beyond, from which on ellipsoids are added.
const FINE: f64 = 0.0077;
const COARSE: f64 = 0.0038;
/// Distance of a boundary outside of the outline, in radii, where an ellipsoid may be missing.
const MISSING: f64 = 0.03;
/// Number of ellipsoids that are tried to be halved, and of views in which one may be missing.
const HALVED: usize = 2;
const MISSED: usize = 3;
/// Steps of a fit with one more ellipsoid, and of the last one.
const STEPS: (usize, usize) = (8, 20);

impl Scene {
    /// Fits from a state, and adds an ellipsoid if that is worth it; what is known before of it is where
    /// it began. `in_vain` is the cost per view at which that was tried last and was not, or none; it is
    /// returned as it is now.
    pub(super) fn grown(
        &mut self,
        from: &State,
        in_vain: Option<f64>,
    ) -> Option<(Fitted, Option<f64>)> {
        let best = self.fitted(from, STEPS.1)?;
        let cost = best.cost / self.views.len() as f64;
        let fits = in_vain.is_some_and(|before| cost < AGAIN * before);
        let few = self.prior.poses.len() < LEAST_KEYFRAMES;
        if fits || few || best.state.parts.len() >= MOST {
            return Some((best, in_vain));
        }
        let before = self.prior.parts.clone();
        let mut better: Option<(Fitted, Vec<Part>)> = None;
        for parts in self.bodies_with_one_more(&best.state)? {
            self.prior.parts = before.clone();
            self.prior.parts.extend(&parts[before.len()..]);
            let tried = State { parts, poses: best.state.poses.clone() };
            let Some(found) = self.fitted(&tried, STEPS.0) else { continue };
            if better.as_ref().is_none_or(|(other, _)| found.cost < other.cost) {
                better = Some((found, self.prior.parts.clone()));
            }
        }
        match better {
            Some((found, prior)) if found.cost < best.cost - LEAST => {
                self.prior.parts = prior;
                Some((self.fitted(&found.state, STEPS.1)?, None))
            }
            _ => {
                self.prior.parts = before;
                Some((best, Some(cost)))
            }
        }
    }

    /// Returns bodies to try, each with one more ellipsoid; none if this one fits.
    fn bodies_with_one_more(&self, state: &State) -> Option<Vec<Vec<Part>>> {
        let distances = self.distances(state)?;
        let radius_px = self.radius_px(state)?;
        let (mut misfits, mut count) = (vec![0.0; state.parts.len()], 0.0);
        for row in distances.iter().flat_map(|one| &one.boundary) {
            misfits[row.part] += (row.off_px.abs() - FINE * radius_px).max(0.0).powi(2);
            count += 1.0;
        }
        if misfits.iter().sum::<f64>() < (COARSE * radius_px).powi(2) * count {
            return Some(Vec::new());
        }
        let mut order: Vec<_> = (0..misfits.len()).collect();
        order.sort_by(|&a, &b| misfits[b].total_cmp(&misfits[a]));
        let halved = order.iter().take(HALVED).map(|&part| {
            let mut parts = state.parts.clone();
            let [one, other] = parts[part].halves();
            parts[part] = one;
            parts.push(other);
            parts
        });
        let mut views: Vec<_> = self.views.iter().zip(&distances).collect();
        let most = |one: &Distances| one.boundary.iter().map(|row| row.off_px).fold(0.0, f64::max);
        views.sort_by(|a, b| most(b.1).total_cmp(&most(a.1)));
        let missing =
            views.iter().take(MISSED).filter_map(|(view, one)| self.with_missing(state, view, one));
        Some(halved.chain(missing).collect())
    }

    /// Returns the body with a ball where a view's boundary is farthest outside of its outline.
    fn with_missing(&self, state: &State, view: &View, distances: &Distances) -> Option<Vec<Part>> {
        let rows = distances.boundary.iter().enumerate();
        let (at, row) = rows.max_by(|a, b| a.1.off_px.total_cmp(&b.1.off_px))?;
        if row.off_px < MISSING * self.radius_px(state)? {
            return None;
        }
        let projection = view.world.moved(&state.poses[view.keyframe]);
        let near = state.parts[row.part].center;
        let place = beside(&projection.linear, &projection.offset, &view.look.points[at].0, &near)?;
        let (_, slope) = projection.pixel(&place)?;
        let radius = 0.5 * row.off_px / slope.row(0).norm();
        let mut parts = state.parts.clone();
        parts.push(Part::ball(place, radius));
        Some(parts)
    }
}

/// Returns the point that is seen at a pixel, as far away as another one.
fn beside(
    linear: &Matrix3<f64>,
    offset: &Vector3<f64>,
    pixel: &Vector2<f64>,
    point: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let depth = (linear * point + offset).z;
    linear.try_inverse().map(|back| back * (Vector3::new(pixel.x, pixel.y, 1.0) * depth - offset))
}
