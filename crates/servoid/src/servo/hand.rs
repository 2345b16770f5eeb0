//! The paper's PD law of the hand.

use super::moving::{Moving, place, rotation, rows_of};
use crate::pose::exact::{greater, lesser, norm};
use crate::pose::{Pose, PoseError};

/// Below this length in m/s or rad/s a velocity is not shortened.
const STILL: f64 = 1e-12;

/// The gains of the hand: of the position in 1/s, of its rate, of the rotation in 1/s, of its rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandGains {
    /// Of the offset to the goal.
    pub position: f64,
    /// Of the offset's rate.
    pub position_rate: f64,
    /// Of the vector part of the quaternion to the goal.
    pub turn: f64,
    /// Of the angular velocity towards the goal.
    pub turn_rate: f64,
}

/// Returns the vector part of the shorter unit quaternion of the rotation to the goal.
///
/// # Errors
/// If the pose error is no rigid motion.
pub fn quaternion_error(hand_from_goal: &Moving) -> Result<[f64; 3], PoseError> {
    let [w, x, y, z] = hand_from_goal.pose()?.quaternion();
    Ok([x, y, z].map(|value| 1.0_f64.copysign(w) * value))
}

/// Returns the hand's desired velocity, linear and angular in the world, from its pose error.
///
/// # Errors
/// If the pose error is no rigid motion.
pub fn correction(
    hand_from_goal: &Moving,
    world_from_hand: &Pose,
    gains: &HandGains,
) -> Result<[f64; 6], PoseError> {
    let turn = rotation(&rows_of(world_from_hand));
    let offset = turn.times_vector(&place(hand_from_goal.matrix()));
    let off = turn.times_vector(&quaternion_error(hand_from_goal)?);
    let rates = hand_from_goal.twist();
    let (moving, turning) = (turn.times_vector(&rates[..3]), turn.times_vector(&rates[3..]));
    let linear = |i: usize| gains.position * offset[i] + gains.position_rate * moving[i]; // Eq. (12)
    let angular = |i: usize| gains.turn * off[i] + gains.turn_rate * turning[i]; // Eq. (13)
    Ok([linear(0), linear(1), linear(2), angular(0), angular(1), angular(2)])
}

/// Returns factors, at most 1, that limit a twist's two parts to the given lengths.
#[must_use]
pub fn shares(twist: &[f64; 6], most: [f64; 2]) -> [f64; 2] {
    let [linear, angular] = lengths(twist);
    [lesser(1.0, most[0] / greater(linear, STILL)), lesser(1.0, most[1] / greater(angular, STILL))]
}

/// Returns a twist whose linear and angular parts have at most the given lengths.
#[must_use]
pub fn within(twist: &[f64; 6], most: [f64; 2]) -> [f64; 6] {
    let shares = shares(twist, most);
    std::array::from_fn(|i| twist[i] * shares[i / 3])
}

/// Returns the lengths of a twist's linear and angular parts.
pub(super) fn lengths(twist: &[f64; 6]) -> [f64; 2] {
    [norm(&twist[..3]), norm(&twist[3..])]
}
