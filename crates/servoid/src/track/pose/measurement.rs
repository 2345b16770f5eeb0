//! What surface points say about a pose, each by its match. A highlight, or a place that was
//! mistaken for another, matches as well as print does, but not at the pose that the other points
//! show: a point weighs less, the more its residual exceeds theirs.

use nalgebra::{Matrix2, Matrix2x6, Vector3};

use super::guess::{Distance, Ray};
use super::refine::Normal;
use crate::fitness::{Agreement, SurfacePoint};
use crate::track::inputs::Inputs;
use crate::track::target::points::{Feature, InView, by_motion};
use crate::track::target::shift::Shift;

/// Standard deviation of a point's position, in radii, for a view at right angles to the direction
/// in which it was learned.
const BENT: f64 = 0.02;
/// Correlation from which on a point counts, and by how much more it has its full weight.
const CORRELATION_RAMP: (f64, f64) = (0.3, 0.5);
/// Squared residual, in variances, of a point that has a quarter of its weight: at least, and as a
/// multiple of the median.
const OUTLYING: (f64, f64) = (1.0, 4.0);
/// Noise, as a share of the least contrast of a pattern, up to which residuals count: those of all
/// points are noise beyond, and weights by them only lose information.
const QUIET: f64 = 0.25;
/// Part of the information of a shift that is added to it along a ridge, which has none.
const RIDGE: f64 = 1e-6;

/// What a match says about the pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measurement {
    /// Index of the point among those in view.
    at: usize,
    by_motion: Matrix2x6<f64>,
    shift: Shift,
    /// Weight by its correlation, and by what hides it.
    weight: f64,
    /// Its ray, if its distance is a guess.
    ray: Option<Ray>,
    /// Squared residual, in variances; none where it is noise, and none where the body alone gave
    /// the distance: as long as it is wrong, the points that show a rotation best disagree most.
    squared: Option<f64>,
}

impl Measurement {
    /// Returns what a point that agrees with an image says about the pose; `shows` is how much of
    /// the point nothing hides, and `eye` the camera's position in the object's frame.
    pub(crate) fn new(
        inputs: &Inputs<'_>,
        (view, at, moved): (InView, usize, f64),
        (agreement, level): (&Agreement, usize),
        (shows, eye): (f64, Option<Vector3<f64>>),
    ) -> Option<Self> {
        let ramp = (agreement.correlation - CORRELATION_RAMP.0) / CORRELATION_RAMP.1;
        let weight = shows * ramp.clamp(0.0, 1.0).powi(2);
        if weight == 0.0 || !inputs.points_measure {
            return None;
        }
        let feature = &inputs.points.features[view.point];
        let Feature { point: SurfacePoint { toward, .. }, variance, .. } = *feature;
        let position = feature.point.position + toward * moved;
        let is_free = feature.has_free_distance(inputs.solid.radius);
        let by_motion = by_motion(&agreement.slope, &position);
        // The farther the view is from the direction in which the point was learned, the less its
        // position along that direction is known.
        let learned = &feature.template(view.template).toward;
        let aside =
            eye.map_or(0.0, |eye| (1.0 - (eye - position).normalize().dot(learned)).max(0.0));
        let along = agreement.slope * toward;
        // A guess is marginalised below, and adds no uncertainty here.
        let known_within = if is_free { 0.0 } else { variance };
        let bent = (BENT * inputs.solid.radius * aside).powi(2);
        let beside = along * along.transpose() * (known_within + bent)
            + inputs.points.strayed(view.point, &by_motion);
        let shift = Shift::new(agreement, level, &beside)?;
        let ray = is_free.then_some(Ray { along, moved, variance });
        let is_quiet = inputs.windows[view.camera].noise_share() <= QUIET;
        let squared = (is_quiet && !feature.is_from_body).then(|| squared(&shift));
        Some(Self { at, by_motion, shift, weight, ray, squared })
    }

    /// Adds what it says about the pose, weighted by its residual; returns what it says about a
    /// distance that is a guess.
    pub(crate) fn add_to(&self, normal: &mut Normal, outlying: f64) -> Option<Distance> {
        let Self { at, by_motion, shift, ray, .. } = self;
        let weight = self.weight / (1.0 + self.squared.unwrap_or(0.0) / outlying).powi(2);
        if let Some(ray) = ray {
            let measured = (shift.information * weight, shift.pull * weight);
            return Some(Distance::marginalized(*at, normal, by_motion, measured, ray));
        }
        normal.curvature += by_motion.tr_mul(&(shift.information * by_motion)) * weight;
        normal.slope += by_motion.tr_mul(&shift.pull) * weight;
        None
    }
}

/// Returns the squared residual of a point that has a quarter of its weight: of the function of
/// Geman and McClure, with a scale by the median; uses memory that is reused from step to step.
pub(crate) fn outlying(measurements: &[Measurement], squares: &mut Vec<f64>) -> f64 {
    squares.clear();
    squares.extend(measurements.iter().filter_map(|one| one.squared));
    let half = squares.len() / 2;
    let (least, times) = OUTLYING;
    if squares.is_empty() {
        return least;
    }
    least.max(times * *squares.select_nth_unstable_by(half, f64::total_cmp).1)
}

/// Returns the squared size of a shift, in variances.
fn squared(shift: &Shift) -> f64 {
    let ridge = Matrix2::identity() * (RIDGE * shift.information.trace());
    let covariance = (shift.information + ridge).try_inverse();
    covariance.map_or(0.0, |covariance| shift.pull.dot(&(covariance * shift.pull)))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector2, Vector6};
    use proptest::prelude::*;

    use super::*;

    const RADIUS: f64 = 0.05;

    /// Matches of points on a sphere that a camera sees along z, off by pixels.
    fn measured(off_px: impl Fn(usize) -> Vector2<f64>) -> Vec<Measurement> {
        let of = |at: usize| {
            let (down, around) = (0.1 + 0.04 * at as f64, 2.4 * at as f64);
            let (sine, cosine) = libm::sincos(around);
            let place = Vector3::new(down * cosine, down * sine, -(1.0 - down * down).sqrt());
            let slope = nalgebra::Matrix2x3::new(800.0, 0.0, 0.0, 0.0, 800.0, 0.0);
            let information = Matrix2::identity() * 16.0;
            let shift = Shift { information, pull: information * off_px(at) };
            let by_motion = by_motion(&slope, &(place * RADIUS));
            let squared = Some(squared(&shift));
            Measurement { at, by_motion, shift, weight: 1.0, ray: None, squared }
        };
        (0..20).map(of).collect()
    }

    fn step(measurements: &[Measurement]) -> Vector6<f64> {
        let mut normal = Normal::new(RADIUS);
        let outlying = outlying(measurements, &mut Vec::new());
        for one in measurements {
            assert!(one.add_to(&mut normal, outlying).is_none());
        }
        normal.curvature.cholesky().unwrap().solve(&normal.slope)
    }

    /// Pixels by which matches are off that agree about a motion to within a tenth of a pixel.
    fn agreeing(motion: &Vector6<f64>, at: usize) -> Vector2<f64> {
        let (sine, cosine) = libm::sincos(5.0 * at as f64);
        measured(|_| Vector2::zeros())[at].by_motion * motion + Vector2::new(sine, cosine) * 0.1
    }

    proptest! {
        #[test]
        fn the_farther_a_few_matches_are_off_alone_the_less_they_move_the_pose(
            far in 1.5..20.0_f64,
            farther in 1.2..3.0_f64,
        ) {
            let off = |by: f64| move |at: usize| {
                let alone = if at < 4 { by } else { 0.0 };
                agreeing(&Vector6::zeros(), at) + Vector2::new(alone, 0.0)
            };
            let moved = |by: f64| (step(&measured(off(by))) - step(&measured(off(0.0)))).norm();
            prop_assert!(moved(far * farther) < moved(far));
        }

        #[test]
        fn matches_that_are_all_off_by_the_same_motion_all_count(
            across in -2e-3..2e-3_f64,
            turned in -0.05..0.05_f64,
        ) {
            let motion = Vector6::new(across, 0.0, 0.0, 0.0, 0.0, turned);
            let rest = step(&measured(|at| agreeing(&Vector6::zeros(), at)));
            let found = step(&measured(|at| agreeing(&motion, at))) - rest;
            let off = motion - found;
            prop_assert!(off[0].abs() < 0.1 * across.abs() + 1e-4, "{off}");
            prop_assert!(off[5].abs() < 0.1 * turned.abs() + 2e-3, "{off}");
        }
    }

    #[test]
    fn a_residual_along_a_ridge_that_shows_nothing_there_is_finite() {
        let information = Matrix2::new(16.0, 0.0, 0.0, 0.0);
        let shift = Shift { information, pull: Vector2::new(16.0, 0.0) };
        assert!((squared(&shift) - 16.0).abs() < 1e-3);
    }
}
