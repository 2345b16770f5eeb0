//! How fast a joint or a hand may move so that it stops in time.

use crate::pose::exact::greater;

/// Returns the greatest speed that stops within `room`, 0 without any room.
///
/// It continues for `reaction_s` before it decreases at `deceleration`; following this curve needs
/// less than that deceleration.
#[must_use]
pub fn stoppable_speed(room: f64, deceleration: f64, reaction_s: f64) -> f64 {
    let head = greater(room, 0.0);
    deceleration * ((reaction_s * reaction_s + 2.0 * head / deceleration).sqrt() - reaction_s)
}

/// Returns the stopping distance of a joint at a speed, not negative, and a present acceleration.
///
/// It brakes as hard as `deceleration` and `jerk` allow.
#[must_use]
pub fn stopping_distance(speed: f64, acceleration: f64, deceleration: f64, jerk: f64) -> f64 {
    let start = speed + acceleration * acceleration / (2.0 * jerk);
    let whole = if start * jerk >= deceleration * deceleration {
        0.5 * start * (start / deceleration + deceleration / jerk)
    } else {
        start * (start / jerk).sqrt()
    };
    let cubed = acceleration * acceleration * acceleration;
    whole + speed * acceleration / jerk + cubed / (3.0 * (jerk * jerk))
}
