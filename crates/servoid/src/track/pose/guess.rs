//! Points whose distance is a guess: a single camera constrains a new point to its ray only. Its
//! distance is solved together with each pose, by the Schur complement, and then discarded; the
//! keyframes together determine it.

use nalgebra::{Matrix2, Matrix2x6, Vector2, Vector6};

use super::refine::{MOST_STEP, Normal, Workspace};
use crate::pose::Twist;

/// What a match says about its point's distance, jointly with the pose.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Distance {
    /// Index of the point among those in view.
    pub(crate) at: usize,
    curvature: f64,
    slope: f64,
    with_pose: Vector6<f64>,
}

/// The current estimate of a point's position along its ray.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ray {
    /// Motion of its pixel per metre towards the camera by which it was learned.
    pub(crate) along: Vector2<f64>,
    /// Current displacement in metres, and its variance.
    pub(crate) moved: f64,
    pub(crate) variance: f64,
}

impl Distance {
    /// Adds what a match says about the pose, marginalised over the point's position on its ray;
    /// returns what it says about that position.
    pub(crate) fn marginalized(
        at: usize,
        normal: &mut Normal,
        by_motion: &Matrix2x6<f64>,
        (information, pull): (Matrix2<f64>, Vector2<f64>),
        ray: &Ray,
    ) -> Self {
        let curvature = ray.along.dot(&(information * ray.along)) + 1.0 / ray.variance;
        let slope = ray.along.dot(&pull) - ray.moved / ray.variance;
        let with_pose = by_motion.tr_mul(&(information * ray.along));
        normal.curvature += by_motion.tr_mul(&(information * by_motion))
            - with_pose * with_pose.transpose() / curvature;
        normal.slope += by_motion.tr_mul(&pull) - with_pose * (slope / curvature);
        Self { at, curvature, slope, with_pose }
    }

    /// Returns the displacement of the point that belongs to a motion of the pose.
    pub(crate) fn step(&self, motion: &Twist) -> f64 {
        (self.slope - self.with_pose.dot(motion)) / self.curvature
    }
}

impl Workspace {
    /// Resets the distances that are guesses to their estimates.
    pub(crate) fn forget_distances(&mut self) {
        self.moved.clear();
        self.moved.resize(self.in_view.len(), 0.0);
        self.distances.clear();
    }

    /// Moves points whose distance is a guess to where the images put them, for a step of the pose.
    pub(crate) fn move_guesses(&mut self, step: &Twist, radius: f64) {
        let most = MOST_STEP * radius;
        for distance in &self.distances {
            self.moved[distance.at] += distance.step(step).clamp(-most, most);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn a_pose_with_guessed_distances_is_that_of_pose_and_distances_together(
            entries in prop::collection::vec(-1.0..1.0_f64, 19),
            variance in 0.1..10.0_f64,
        ) {
            let by_motion = Matrix2x6::from_fn(|i, j| entries[6 * i + j]);
            let along = Vector2::new(entries[12], entries[13]);
            let half = Matrix2::new(1.0 + entries[14], entries[15], 0.0, 1.0 + entries[16]);
            let information = half * half.transpose() + Matrix2::identity() * 0.1;
            let (off, moved) = (Vector2::new(entries[17], entries[18]), 0.3);
            let mut normal = Normal::new(0.05);
            let before = normal.curvature;
            let ray = Ray { along, moved, variance };
            let measured = (information, information * off);
            let distance = Distance::marginalized(0, &mut normal, &by_motion, measured, &ray);
            let step = normal.curvature.cholesky().unwrap().solve(&normal.slope);
            // All seven unknowns at once.
            let mut all = nalgebra::SMatrix::<f64, 2, 7>::zeros();
            all.fixed_view_mut::<2, 6>(0, 0).copy_from(&by_motion);
            all.fixed_view_mut::<2, 1>(0, 6).copy_from(&along);
            let mut curvature = all.transpose() * information * all;
            let mut view = curvature.fixed_view_mut::<6, 6>(0, 0);
            view += before;
            curvature[(6, 6)] += 1.0 / variance;
            let mut slope = all.transpose() * information * off;
            slope[6] -= moved / variance;
            let both = curvature.cholesky().unwrap().solve(&slope);
            let scale = 1.0 + both.amax();
            prop_assert!((step - both.fixed_rows::<6>(0)).amax() < 1e-9 * scale);
            prop_assert!((distance.step(&step) - both[6]).abs() < 1e-9 * scale);
            prop_assert!(Matrix6::from(normal.curvature).cholesky().is_some());
        }
    }
}
