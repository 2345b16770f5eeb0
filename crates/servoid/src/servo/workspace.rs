//! Bounds that keep a hand in its workspace and away from an object.

use super::jacobian::Jacobian;
use super::stopping::stoppable_speed;
use crate::pose::exact::{Rows, dot, greater, lesser, norm};

/// At smaller distances from the object, in m, the direction away is undefined.
const BLIND: f64 = 1e-6;

/// Where a hand may be, and how it brakes before the end of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Workspace {
    /// The least coordinates in the world.
    pub lower: [f64; 3],
    /// The greatest coordinates in the world.
    pub upper: [f64; 3],
    /// The least distance of the hand from the object, in m.
    pub least_distance: f64,
    /// The deceleration of the hand in m/s².
    pub braking: f64,
    /// The time after which it begins to brake.
    pub reaction_s: f64,
    /// The control period.
    pub period_s: f64,
}

/// A hand or an object: its position and its velocity in the world, in m and m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// The position.
    pub place: [f64; 3],
    /// The velocity.
    pub velocity: [f64; 3],
}

/// Bounds of a hand's velocity in the world, and of its speed towards the object.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityLimits {
    /// The least velocity in m/s.
    pub lower: [f64; 3],
    /// The greatest velocity in m/s.
    pub upper: [f64; 3],
    /// The unit direction to the object; 0 at the object itself.
    pub toward: [f64; 3],
    /// The greatest speed towards the object, which includes the object's velocity.
    pub closing: f64,
}

impl Workspace {
    /// Returns the bounds on a hand for an object, after the hand's last velocity.
    ///
    /// No bound requires a deceleration above `braking`.
    #[must_use]
    pub fn velocity_limits(&self, hand: &Drift, object: &Drift) -> VelocityLimits {
        let step = self.braking * self.period_s;
        let away: [f64; 3] = std::array::from_fn(|i| object.place[i] - hand.place[i]);
        let distance = norm(&away);
        let toward = if distance > BLIND { away.map(|x| x / distance) } else { [0.0; 3] };
        // Without any room left, only speeds that move back are allowed.
        let speed =
            |room: f64| stoppable_speed(room.abs(), self.braking, self.reaction_s).copysign(room);
        let closing = speed(distance - self.least_distance) + dot(&toward, &object.velocity);
        let lower =
            |i: usize| lesser(-speed(hand.place[i] - self.lower[i]), hand.velocity[i] + step);
        let upper =
            |i: usize| greater(speed(self.upper[i] - hand.place[i]), hand.velocity[i] - step);
        VelocityLimits {
            lower: std::array::from_fn(lower),
            upper: std::array::from_fn(upper),
            toward,
            closing: closing.max(dot(&toward, &hand.velocity) - step),
        }
    }

    /// Returns the position of a goal, moved into the workspace and away from an object.
    #[must_use]
    pub fn allowed(&self, goal: [f64; 3], object: [f64; 3]) -> [f64; 3] {
        let away: [f64; 3] = std::array::from_fn(|i| goal[i] - object[i]);
        let distance = norm(&away);
        let mut place = goal;
        if BLIND < distance && distance < self.least_distance {
            let factor = self.least_distance / distance;
            place = std::array::from_fn(|i| object[i] + away[i] * factor);
        }
        std::array::from_fn(|i| lesser(greater(place[i], self.lower[i]), self.upper[i]))
    }
}

impl VelocityLimits {
    /// Returns the rows, 4 x n, whose products with joint speeds are bounded, with the least and
    /// the greatest products.
    #[must_use]
    pub fn rows(&self, jacobian: &Jacobian) -> (Rows, [f64; 4], [f64; 4]) {
        let linear = jacobian.part(0);
        let row = Rows { numbers: self.toward.to_vec(), columns: 3 }.times(&linear);
        let mut matrix = linear;
        matrix.numbers.extend(row.numbers);
        let is_apart = self.toward.iter().any(|&x| x != 0.0);
        let most = if is_apart { self.closing } else { f64::INFINITY };
        let ([a, b, c], [x, y, z]) = (self.lower, self.upper);
        (matrix, [a, b, c, f64::NEG_INFINITY], [x, y, z, most])
    }
}
