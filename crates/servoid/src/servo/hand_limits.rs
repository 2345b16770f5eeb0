//! The limits of the hand's speed and acceleration as bounds on joint speeds.

use super::ArmError;
use super::arm_error::fits;
use super::hand::lengths;
use super::jacobian::Jacobian;
use crate::pose::exact::{Rows, dot, greater, lesser, norm};

/// Share of a ball's radius by which speeds are shortened below the bound.
const INSIDE: f64 = 1e-3;
/// Share of it by which they must be shorter.
const EDGE: f64 = 1e-6;
/// Share of the hand's acceleration that one joint's braking may use.
const ALONE: f64 = 0.6;
/// A joint that moves the hand less, in m or 1 per radian, is ignored.
const NO_LEVER: f64 = 1e-3;

/// The greatest linear and angular speed of a hand, and how far they may change in a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HandLimits {
    /// The speeds in m/s and rad/s.
    pub speeds: [f64; 2],
    /// The changes of the velocity in one control period, in m/s and rad/s.
    pub steps: [f64; 2],
    /// The control period.
    pub period_s: f64,
    /// An acceleration counts as if it continued for this many periods before it vanishes.
    pub fading: f64,
}

impl HandLimits {
    /// Returns the bounds on joint speeds after a hand velocity, at a share of the hand's speed.
    #[must_use]
    pub fn balls(&self, jacobian: &Jacobian, last: &[f64; 6], speed_scale: f64) -> Balls {
        // The relevant speed is that after its acceleration has vanished.
        let share = self.fading / (1.0 + self.fading);
        let lengths = lengths(last);
        let ball = |part: usize| {
            let before: [f64; 3] = std::array::from_fn(|i| last[3 * part + i]);
            // A hand above its speed limit decelerates as fast as it can.
            let fastest = (speed_scale * self.speeds[part]).max(lengths[part] - self.steps[part]);
            [
                Ball { part, center: before.map(|x| share * x), radius: fastest * (1.0 - share) },
                Ball { part, center: before, radius: self.steps[part] },
            ]
        };
        let parts = [0, 1].map(|part| jacobian.part(part));
        Balls { parts, balls: [ball(0), ball(1)].concat() }
    }

    /// Returns the joints' decelerations in rad/s² that the hand's limit allows.
    ///
    /// Each joint leaves a share of the hand's limit to the other joints.
    #[must_use]
    pub fn braking(&self, jacobian: &Jacobian) -> Vec<f64> {
        let most = |part: usize, joint: usize| {
            let rows = 3 * part..3 * part + 3;
            let squares = rows.map(|row| jacobian.rows().at(row, joint));
            let lever = squares.fold(0.0, |sum, x| sum + x * x).sqrt();
            self.steps[part] / self.period_s / greater(lever, NO_LEVER)
        };
        let joints = 0..jacobian.count();
        joints.map(|joint| ALONE * lesser(most(0, joint), most(1, joint))).collect()
    }

    /// Returns the number of periods in which the hand can come to rest from a velocity.
    #[must_use]
    pub fn ticks_to_rest(&self, twist: &[f64; 6]) -> f64 {
        let [linear, angular] = lengths(twist);
        let ticks = |length: f64, step: f64| length / ((1.0 - INSIDE) * step);
        greater(ticks(linear, self.steps[0]), ticks(angular, self.steps[1]))
    }
}

/// Bounds the linear or the angular velocity of a hand: within a radius of a center.
#[derive(Debug, Clone, PartialEq)]
struct Ball {
    part: usize,
    center: [f64; 3],
    radius: f64,
}

/// The bounds of a hand's velocity: of the linear and then of the angular velocity first that of
/// the speed, then that of the acceleration.
#[derive(Debug, Clone, PartialEq)]
pub struct Balls {
    parts: [Rows; 2],
    balls: Vec<Ball>,
}

/// Planes as bounds on joint speeds, which are below them.
#[derive(Debug, Clone, PartialEq)]
pub struct Cuts {
    /// The number of the ball of each, which is touched by its plane.
    pub balls: Vec<usize>,
    /// A row of a number for each joint for each.
    pub matrix: Rows,
    /// The greatest products of the rows with joint speeds.
    pub upper: Vec<f64>,
}

impl Balls {
    /// Returns whether joint speeds are inside.
    ///
    /// # Errors
    /// If there are not as many speeds as joints.
    pub fn hold(&self, velocities: &[f64]) -> Result<bool, ArmError> {
        Ok(self.offs(velocities)?.iter().all(|off| off.is_none()))
    }

    /// Returns, for each ball outside which joint speeds are, its tangent plane nearest to them.
    ///
    /// # Errors
    /// If there are not as many speeds as joints.
    pub fn cuts(&self, velocities: &[f64]) -> Result<Cuts, ArmError> {
        let mut cuts = Cuts {
            balls: Vec::new(),
            matrix: Rows { numbers: Vec::new(), columns: self.parts[0].columns },
            upper: Vec::new(),
        };
        for (number, (off, ball)) in self.offs(velocities)?.iter().zip(&self.balls).enumerate() {
            if let Some(off) = off {
                let length = norm(off);
                let normal: Vec<f64> = off.iter().map(|x| x / length).collect();
                let row =
                    Rows { numbers: normal.clone(), columns: 3 }.times(&self.parts[ball.part]);
                cuts.balls.push(number);
                cuts.matrix.numbers.extend(row.numbers);
                cuts.upper.push(dot(&normal, &ball.center) + ball.radius * (1.0 - INSIDE));
            }
        }
        Ok(cuts)
    }

    /// Returns how far joint speeds are from the centers of the balls, for those that they are
    /// outside of.
    fn offs(&self, velocities: &[f64]) -> Result<Vec<Option<Vec<f64>>>, ArmError> {
        fits("the speeds of joints", self.parts[0].columns, velocities)?;
        let moved = [0, 1].map(|part| self.parts[part].times_vector(velocities));
        let off = |ball: &Ball| {
            let pairs = moved[ball.part].iter().zip(ball.center);
            let off: Vec<f64> = pairs.map(|(x, center)| x - center).collect();
            (norm(&off) > ball.radius * (1.0 - EDGE)).then_some(off)
        };
        Ok(self.balls.iter().map(off).collect())
    }
}
