//! From the velocity of a hand to the speeds of its joints.

use super::ArmError;
use super::arm_error::fits;
use super::jacobian::{Jacobian, weighted};
use crate::pose::exact::{Rows, dot, greater, lesser};

/// Weight of null-space motion of the joints, in m².
const IDLE_WEIGHT: f64 = 1e-3;
const TINY: f64 = 1e-8;
/// Damping of a step of inverse kinematics, by the square of the error.
const STEP_DAMPING: f64 = 1e-3;
const STEP_TINY: f64 = 1e-9;
/// Greatest step of a joint, in rad.
const STEP: f64 = 0.3;

/// How a hand's velocity becomes joint speeds.
#[derive(Debug, Clone, PartialEq)]
pub struct QuadraticLaw {
    /// The preferred angles of the joints, in rad.
    pub posture: Vec<f64>,
    /// The speed in 1/s with which the joints go to them.
    pub posture_gain: f64,
    /// The metres that weigh as much as a radian.
    pub angular_weight: f64,
    /// The damping in a singular direction, in m/s per rad/s.
    pub damping: f64,
    /// The gain of a direction below which it is damped, in m/s per rad/s.
    pub damped_below: f64,
}

impl QuadraticLaw {
    /// Returns the best joint speeds without bounds, and the weights, n x n, of deviations from
    /// them. `positions` are the angles of the joints.
    ///
    /// # Errors
    /// If there are not as many angles as joints, or the Jacobian is not plausible.
    pub fn setpoint(
        &self,
        jacobian: &Jacobian,
        positions: &[f64],
        twist: &[f64; 6],
    ) -> Result<(Vec<f64>, Rows), ArmError> {
        let count = jacobian.count();
        fits("the preferred angles of joints", count, &self.posture)?;
        fits("the angles of joints", count, positions)?;
        let matrix = jacobian.weighted(self.angular_weight);
        let across = matrix.transposed();
        // The singular vectors of the hand's motion come last; those before span the null space.
        let (squares, axes) = across.times(&matrix).symmetric_eigen().ok_or(ArmError::NotFinite)?;
        let free = count.saturating_sub(6);
        let worth: Vec<f64> = squares
            .iter()
            .enumerate()
            .map(|(at, &square)| if at < free { IDLE_WEIGHT } else { self.worth(square) })
            .collect();
        let mut slope = across.times_vector(&weighted(twist, self.angular_weight));
        let pull: Vec<f64> = self
            .posture
            .iter()
            .zip(positions)
            .map(|(posture, place)| self.posture_gain * (posture - place))
            .collect();
        for (sum, idle) in slope.iter_mut().zip(along_first(&axes, free, &pull)) {
            *sum += IDLE_WEIGHT * idle;
        }
        let mut parts = axes.transposed().times_vector(&slope);
        for (part, worth) in parts.iter_mut().zip(&worth) {
            *part /= worth;
        }
        let mut scaled = axes.clone();
        for row in scaled.numbers.chunks_exact_mut(count) {
            for (value, worth) in row.iter_mut().zip(&worth) {
                *value *= worth;
            }
        }
        Ok((axes.times_vector(&parts), scaled.times(&axes.transposed())))
    }

    /// Returns the weight of a direction of the joints whose gain has a square.
    fn worth(&self, square: f64) -> f64 {
        let square = greater(square, 0.0);
        let lack = greater(0.0, 1.0 - square.sqrt() / self.damped_below);
        let damped = self.damping * lack;
        square + damped * damped + TINY
    }
}

/// Returns the part of a vector along the first columns of a matrix.
fn along_first(axes: &Rows, count: usize, vector: &[f64]) -> Vec<f64> {
    let numbers = axes.each().flat_map(|row| row[..count].to_vec()).collect();
    if count == 0 {
        return vec![0.0; vector.len()];
    }
    let first = Rows { numbers, columns: count };
    first.times_vector(&first.transposed().times_vector(vector))
}

/// Returns weights, n x n, that measure deviations of a hand, and hardly null-space motion.
///
/// `angular_weight` are the metres that weigh as much as a radian.
#[must_use]
pub fn hand_weights(jacobian: &Jacobian, angular_weight: f64) -> Rows {
    let matrix = jacobian.weighted(angular_weight);
    let mut weights = matrix.transposed().times(&matrix);
    for at in 0..jacobian.count() {
        *weights.at_mut(at, at) += IDLE_WEIGHT;
    }
    weights
}

/// Returns the part of a hand's velocity in nearly singular directions of its arm, in m/s, whose
/// gain is less than `damped_below`.
///
/// # Errors
/// If the Jacobian is not plausible.
pub fn lost_speed(
    jacobian: &Jacobian,
    twist: &[f64; 6],
    angular_weight: f64,
    damped_below: f64,
) -> Result<f64, ArmError> {
    let matrix = jacobian.weighted(angular_weight);
    let square = matrix.times(&matrix.transposed());
    let (squares, axes) = square.symmetric_eigen().ok_or(ArmError::NotFinite)?;
    let parts = axes.transposed().times_vector(&weighted(twist, angular_weight));
    // An arm of fewer than six joints is singular everywhere.
    let lacking = 6 - jacobian.count().min(6);
    let lost = squares.iter().zip(parts).map(|(&square, part)| {
        greater(0.0, 1.0 - greater(square, 0.0).sqrt() / damped_below) * part.abs()
    });
    Ok(lost.skip(lacking).fold(f64::NEG_INFINITY, greater))
}

/// Returns the turn of each joint, in rad, of a damped Newton step that changes the pose of a hand.
///
/// # Errors
/// If the Jacobian is not plausible.
pub fn newton_turn(jacobian: &Jacobian, change: &[f64; 6]) -> Result<Vec<f64>, ArmError> {
    let across = jacobian.rows().transposed();
    let mut square = across.times(jacobian.rows());
    let damping = STEP_TINY + STEP_DAMPING * dot(change, change);
    for at in 0..jacobian.count() {
        *square.at_mut(at, at) += damping;
    }
    let right = Rows { numbers: across.times_vector(change), columns: 1 };
    let turn = square.solve(&right).ok_or(ArmError::NotFinite)?.numbers;
    let most = turn.iter().fold(0.0, |most, x| greater(x.abs(), most));
    let factor = lesser(1.0, STEP / greater(STEP, most));
    Ok(turn.into_iter().map(|x| x * factor).collect())
}
