use nalgebra::{Matrix6, Vector6};

use crate::pose::{Pose, Twist};
use crate::track::frame::input_checks::FARTHEST_S;

/// Pose noise: the part of the differences between successive poses that no motion explains,
/// measured as the change of acceleration from image to image.
#[derive(Debug, Clone)]
pub(crate) struct Jitter {
    last: Option<(f64, Pose)>,
    /// The motions from image to image, the newest first, with their durations in seconds.
    steps: [Option<(f64, Twist)>; 2],
    covariance: Matrix6<f64>,
    /// Number of comparisons; the initial value counts as one.
    count: f64,
}

/// Largest relative difference between the intervals of images that are compared.
const UNEVEN: f64 = 0.2;
/// Least weight of the newest image.
const RATE: f64 = 0.05;
/// Variance of the third difference of independent values of unit variance.
const THIRD: f64 = 20.0;
/// Ratio of an error's variance to that of its part that differs from image to image: the errors of
/// objects with and without a pattern are about three times as large as that part.
const LASTING: f64 = 9.0;

/// Standard deviation, in radii and radians, assumed before images were compared.
const AT_FIRST: f64 = 0.01;

impl Jitter {
    pub(crate) fn new(radius: f64) -> Self {
        let (across, turn) = ((AT_FIRST * radius).powi(2), AT_FIRST.powi(2));
        let diagonal = Vector6::new(across, across, across, turn, turn, turn);
        let covariance = Matrix6::from_diagonal(&diagonal);
        Self { last: None, steps: [None; 2], covariance, count: 1.0 }
    }

    /// Adds a pose.
    pub(crate) fn follow(&mut self, time_s: f64, world_from_object: Pose) {
        let Some((before_s, before)) = self.last.replace((time_s, world_from_object)) else {
            return;
        };
        let newest = (time_s - before_s, (before.inverse() * world_from_object).log());
        let [last, first] = self.steps;
        self.steps = [Some(newest), last];
        if let (Some(last), Some(first)) = (last, first)
            && is_even([newest.0, last.0, first.0])
        {
            let change = newest.1 - 2.0 * last.1 + first.1;
            self.count += 1.0;
            let seen = change * change.transpose() / THIRD;
            self.covariance += RATE.max(1.0 / self.count) * (seen - self.covariance);
        }
    }

    /// Forgets the previous poses, since the object was lost in between.
    pub(crate) fn pause(&mut self) {
        (self.last, self.steps) = (None, [None; 2]);
    }

    /// Returns whether any images were compared yet.
    pub(crate) fn is_measured(&self) -> bool {
        self.count > 1.0
    }

    /// Returns the covariance of the pose error, in the object's frame, as estimated from its
    /// changes from image to image.
    pub(crate) fn covariance(&self) -> Matrix6<f64> {
        LASTING * self.covariance
    }
}

fn is_even(seconds: [f64; 3]) -> bool {
    let most = seconds.iter().copied().fold(0.0, f64::max);
    let least = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    least > 0.0 && most < FARTHEST_S && most < (1.0 + UNEVEN) * least
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    const RADIUS: f64 = 0.05;

    /// Tracks an object along x, at `place` metres from its start in each image.
    fn followed(seconds: impl Fn(usize) -> f64, place: impl Fn(usize) -> f64) -> Jitter {
        let mut jitter = Jitter::new(RADIUS);
        for index in 0..200 {
            let pose = Pose::from_rotation(UnitQuaternion::identity(), Vector3::x() * place(index));
            jitter.follow(seconds(index), pose);
        }
        jitter
    }

    fn even(index: usize) -> f64 {
        index as f64 / 30.0
    }

    /// A repeatable pseudo-random number, uniform in -1 to 1.
    fn random(index: usize) -> f64 {
        let mixed = (index as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        ((mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) >> 11) as f64
            / (1_u64 << 52) as f64
            - 1.0
    }

    #[test]
    fn a_motion_that_speeds_up_evenly_does_not_scatter() {
        let jitter = followed(even, |index| 1e-4 * (index * index) as f64);
        let left = jitter.covariance()[(0, 0)] / Jitter::new(RADIUS).covariance()[(0, 0)];
        assert!(left < 1e-4, "{left}");
    }

    #[test]
    fn errors_that_differ_from_image_to_image_show_whole_and_in_their_direction_only() {
        let jitter = followed(even, |index| 0.003 * random(index));
        let covariance = jitter.covariance();
        assert!(jitter.is_measured() && !Jitter::new(RADIUS).is_measured());
        let true_one = LASTING * 0.003_f64.powi(2) / 3.0;
        let share = covariance[(0, 0)] / true_one;
        assert!((0.5..2.0).contains(&share), "{share}");
        assert!(covariance[(1, 1)] < 1e-3 * covariance[(0, 0)]);
    }

    #[test]
    fn images_at_uneven_times_are_not_compared() {
        let uneven = |index: usize| even(index) + 0.01 * (index % 2) as f64;
        let jitter = followed(uneven, |index| 0.003 * random(index));
        assert_eq!(jitter.covariance(), Jitter::new(RADIUS).covariance());
    }
}
