//! Angles of a tilt and two pans that keep the optical axes of two cameras on a target.

use super::moving::{place, rotation, rows_of};
use crate::pose::Pose;

/// Below this distance from a camera, in m, the target's direction is undefined.
const NEAREST: f64 = 0.02;

/// The angles of tilt, left and right pan in radians, and their rates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gaze {
    /// The angles.
    pub angles: [f64; 3],
    /// The rates in rad/s.
    pub rates: [f64; 3],
}

/// Returns the gaze at a point that moves, in the head's frame, of cameras `half_baseline` from the
/// head's origin.
#[must_use]
pub fn fixation(half_baseline: f64, point: [f64; 3], velocity: [f64; 3]) -> Gaze {
    let ([x, y, z], [x_rate, y_rate, z_rate]) = (point, velocity);
    // In the tilted head's frame, the target is straight ahead except for the pans.
    let ahead = (y * y + z * z).sqrt().max(NEAREST);
    let ahead_rate = (y * y_rate + z * z_rate) / ahead;
    let pan = |aside: f64| {
        let rate = (ahead * x_rate - aside * ahead_rate) / (ahead * ahead + aside * aside);
        (libm::atan2(aside, ahead), rate)
    };
    let (left, right) = (pan(x + half_baseline), pan(x - half_baseline));
    Gaze {
        angles: [libm::atan2(y, z), left.0, right.0],
        rates: [(z * y_rate - y * z_rate) / (ahead * ahead), left.1, right.1],
    }
}

/// Returns position and velocity in the head of a point that moves in the world.
///
/// `hand_twist` is the hand's own motion in the world, which the head shares.
#[must_use]
pub fn seen_from_head(
    world_from_hand: &Pose,
    hand_from_head: &Pose,
    hand_twist: &[f64; 6],
    point: [f64; 3],
    velocity: [f64; 3],
) -> ([f64; 3], [f64; 3]) {
    let world_from_head = rows_of(&(*world_from_hand * *hand_from_head));
    let head_from_world = rotation(&world_from_head).transposed();
    let (hand, head) = (world_from_hand.translation(), place(&world_from_head));
    let [u, v, w, x, y, z] = *hand_twist;
    let [a, b, c]: [f64; 3] = std::array::from_fn(|i| point[i] - hand[i]);
    let carried = [u + (y * c - z * b), v + (z * a - x * c), w + (x * b - y * a)];
    let in_head = |minuend: [f64; 3], subtrahend: [f64; 3]| {
        let vector: [f64; 3] = std::array::from_fn(|i| minuend[i] - subtrahend[i]);
        let found = head_from_world.times_vector(&vector);
        [found[0], found[1], found[2]]
    };
    (in_head(point, head), in_head(velocity, carried))
}
