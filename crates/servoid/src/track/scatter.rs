use nalgebra::{Matrix6, Vector6};

use super::senses::FARTHEST_S;
use crate::pose::{Pose, Twist};

/// How much poses that were found one after the other differ by what no motion does: the change of
/// their acceleration from image to image.
#[derive(Debug, Clone)]
pub(super) struct Scatter {
    last: Option<(f64, Pose)>,
    /// The motions from image to image, the newest first, with the seconds that they took.
    steps: [Option<(f64, Twist)>; 2],
    covariance: Matrix6<f64>,
    /// Images that were compared, and what is supposed counts for one.
    count: f64,
}

/// Largest difference between the times of images for which their steps are compared.
const UNEVEN: f64 = 0.2;
/// Least share of the newest image.
const RATE: f64 = 0.05;
/// Variance of the third difference of independent values.
const THIRD: f64 = 20.0;
/// Variance of an error beside the part of it that differs from image to image.
const LASTING: f64 = 4.0;

/// Standard deviation, in radii and radians, that is supposed before images were compared.
const AT_FIRST: f64 = 0.01;

impl Scatter {
    pub(super) fn new(radius: f64) -> Self {
        let (across, turn) = ((AT_FIRST * radius).powi(2), AT_FIRST.powi(2));
        let diagonal = Vector6::new(across, across, across, turn, turn, turn);
        let covariance = Matrix6::from_diagonal(&diagonal);
        Self { last: None, steps: [None; 2], covariance, count: 1.0 }
    }

    /// Takes a pose that was found.
    pub(super) fn follow(&mut self, time_s: f64, world_from_object: Pose) {
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

    /// Forgets where the object was, since it was lost on the way.
    pub(super) fn pause(&mut self) {
        (self.last, self.steps) = (None, [None; 2]);
    }

    /// Gives the covariance of an error, in the object's frame, as far as it shows from image to
    /// image.
    pub(super) fn covariance(&self) -> Matrix6<f64> {
        LASTING * self.covariance
    }
}

fn is_even(seconds: [f64; 3]) -> bool {
    let most = seconds.iter().copied().fold(0.0, f64::max);
    let least = seconds.iter().copied().fold(f64::INFINITY, f64::min);
    least > 0.0 && most < FARTHEST_S && most < (1.0 + UNEVEN) * least
}
