//! The joint speeds that may be commanded next, under all limits of the joints.

use super::ArmError;
use super::arm_error::fits;
use super::stopping::stopping_distance;
use crate::pose::exact::{greater, lesser};

/// Candidate accelerations for the largest one that still stops in time.
const HALVINGS: usize = 12;

/// Why a speed that may be commanded is not greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Its acceleration may not change faster.
    Jerk,
    /// It may not accelerate more.
    Acceleration,
    /// It is, or will be, at its greatest speed.
    Speed,
    /// It must stop before the end of its range.
    Limit,
}

/// The least and the greatest speeds that may be commanded, in rad/s, with their causes.
#[derive(Debug, Clone, PartialEq)]
pub struct SpeedWindow {
    /// The least speed of each joint.
    pub lower: Vec<f64>,
    /// The greatest speed of each joint.
    pub upper: Vec<f64>,
    /// Why the least and the greatest speeds are not farther.
    pub causes: [Vec<Cause>; 2],
}

/// The limits of N joints, in radians and seconds, N numbers each.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRanges {
    /// The least angles.
    pub lower: Vec<f64>,
    /// The greatest angles.
    pub upper: Vec<f64>,
    /// The greatest speeds.
    pub speed: Vec<f64>,
    /// The greatest accelerations.
    pub acceleration: Vec<f64>,
    /// The greatest jerks.
    pub jerk: Vec<f64>,
}

/// The state of N joints: N numbers each, in radians and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointMotion<'a> {
    /// The measured angles.
    pub positions: &'a [f64],
    /// The measured speeds.
    pub velocities: &'a [f64],
    /// The speeds of the last command.
    pub previous: &'a [f64],
    /// The rate of change of the commanded speeds.
    pub acceleration: &'a [f64],
}

/// Enforces the limits of joints in position, speed, acceleration and jerk in each command.
#[derive(Debug, Clone)]
pub struct JointLimits {
    ranges: JointRanges,
    hand_count: usize,
    period_s: f64,
    reaction_s: f64,
}

/// One joint in one direction.
#[derive(Clone, Copy)]
struct Side {
    /// Its commanded speed.
    speed: f64,
    /// Its measured speed.
    goes: f64,
    /// Its way to the end of its range.
    room: f64,
    /// The deceleration with which it may stop.
    braking: f64,
    jerk: f64,
}

impl JointLimits {
    /// Takes the limits of N joints, of which the first `hand_count` move the hand, the control
    /// period, and the time after which a joint begins to brake.
    ///
    /// # Errors
    /// If the limits are not N numbers each, or more joints than N move the hand.
    pub fn new(
        ranges: JointRanges,
        hand_count: usize,
        period_s: f64,
        reaction_s: f64,
    ) -> Result<Self, ArmError> {
        let count = ranges.lower.len();
        fits("the greatest angles of joints", count, &ranges.upper)?;
        fits("the greatest speeds of joints", count, &ranges.speed)?;
        fits("the greatest accelerations of joints", count, &ranges.acceleration)?;
        fits("the greatest jerks of joints", count, &ranges.jerk)?;
        if hand_count > count {
            return Err(ArmError::Count { given: hand_count, most: count });
        }
        Ok(Self { ranges, hand_count, period_s, reaction_s })
    }

    /// Returns the speeds that may follow the last command.
    ///
    /// Before their stops the first joints brake no harder than `braking`, in rad/s². The window is
    /// never empty: if limits contradict each other, it contains only the hardest braking.
    ///
    /// # Errors
    /// If the state is not of N joints, or `braking` of more.
    pub fn window(&self, now: &JointMotion<'_>, braking: &[f64]) -> Result<SpeedWindow, ArmError> {
        let count = self.ranges.lower.len();
        fits("the angles of joints", count, now.positions)?;
        fits("the speeds of joints", count, now.velocities)?;
        self.check_command(now.previous, now.acceleration)?;
        if braking.len() > count {
            return Err(ArmError::Count { given: braking.len(), most: count });
        }
        let (mut lower, mut upper) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut causes = [Vec::with_capacity(count), Vec::with_capacity(count)];
        for joint in 0..count {
            let most = braking.get(joint).copied().unwrap_or(f64::INFINITY);
            let (up, why_up) = self.fastest(joint, now, 1.0, most);
            let (down, why_down) = self.fastest(joint, now, -1.0, most);
            lower.push(lesser(down, up));
            upper.push(up);
            causes[0].push(why_down);
            causes[1].push(why_up);
        }
        Ok(SpeedWindow { lower, upper, causes })
    }

    /// Returns the farthest speed of a joint in the direction of a sign, and its cause.
    fn fastest(
        &self,
        joint: usize,
        now: &JointMotion<'_>,
        sign: f64,
        braking: f64,
    ) -> (f64, Cause) {
        let JointRanges { lower, upper, acceleration, jerk, .. } = &self.ranges;
        let (acceleration, jerk) = (acceleration[joint], jerk[joint]);
        let place = now.positions[joint];
        let speed = sign * now.previous[joint];
        let before = clipped(sign * now.acceleration[joint], -acceleration, acceleration);
        let side = Side {
            speed,
            goes: greater(sign * now.velocities[joint], 0.0),
            room: if sign < 0.0 { place - lower[joint] } else { upper[joint] - place },
            braking: lesser(acceleration, braking),
            jerk,
        };
        let change = jerk * self.period_s;
        let hardest = greater(before - change, -acceleration);
        let mut cause = Cause::Jerk;
        let mut most = before + change;
        for (choice, why) in
            [(acceleration, Cause::Acceleration), (self.up_to_speed(joint, speed), Cause::Speed)]
        {
            if choice < most {
                (most, cause) = (choice, why);
            }
        }
        let most = greater(most, hardest);
        let stopping = self.stopping(side, hardest, most);
        if stopping < most {
            cause = Cause::Limit;
        }
        (sign * (speed + self.period_s * stopping), cause)
    }

    /// Returns the greatest acceleration that can vanish before the speed limit.
    fn up_to_speed(&self, joint: usize, speed: f64) -> f64 {
        let (left, jerk) = (self.ranges.speed[joint] - speed, self.ranges.jerk[joint]);
        let step = jerk * self.period_s;
        if left >= 0.0 {
            (step * step + 2.0 * jerk * greater(left, 0.0)).sqrt() - step
        } else {
            left / self.period_s
        }
    }

    /// Returns the greatest acceleration between two after which a joint stops within its room.
    fn stopping(&self, side: Side, least: f64, most: f64) -> f64 {
        if self.stops(side, most) {
            return most;
        }
        let (mut good, mut bad) = (least, most);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (good + bad);
            if self.stops(side, middle) {
                good = middle;
            } else {
                bad = middle;
            }
        }
        good
    }

    fn stops(&self, side: Side, acceleration: f64) -> bool {
        let later = side.speed + self.period_s * acceleration;
        let ahead = greater(later, 0.0);
        let way = stopping_distance(ahead, acceleration, side.braking, side.jerk);
        let rests = later <= 0.0 && acceleration <= 0.0;
        // Lagging joints move on after the commanded speed is zero.
        rests || way + self.reaction_s * greater(ahead, side.goes) <= side.room
    }

    /// Returns the next command of joints that come to rest.
    ///
    /// The joints of the hand stop together, along their path, and in no fewer periods than
    /// `hand_ticks`. The other joints also stop together, independently of the hand.
    ///
    /// # Errors
    /// If the last command is not of N joints.
    pub fn braked(
        &self,
        previous: &[f64],
        acceleration: &[f64],
        hand_ticks: f64,
    ) -> Result<Vec<f64>, ArmError> {
        self.check_command(previous, acceleration)?;
        let mut braked = previous.to_vec();
        let count = braked.len();
        for (joints, ticks) in [(0..self.hand_count, hand_ticks), (self.hand_count..count, 0.0)] {
            let kept = 1.0 - self.braking_share(joints.clone(), previous, acceleration, ticks);
            for speed in &mut braked[joints] {
                *speed *= kept;
            }
        }
        Ok(braked)
    }

    /// Returns the next command of joints that come to rest, without knowing their state.
    ///
    /// # Errors
    /// If the last command is not of N joints.
    pub fn blindly_braked(
        &self,
        previous: &[f64],
        acceleration: &[f64],
        hand_ticks: f64,
    ) -> Result<Vec<f64>, ArmError> {
        let mut braked = self.braked(previous, acceleration, hand_ticks)?;
        for (joint, speed) in braked.iter_mut().enumerate() {
            let (last, now) = (previous[joint], acceleration[joint]);
            let change = self.ranges.jerk[joint] * self.period_s;
            let limit = self.ranges.acceleration[joint];
            let least = greater(now - change, -limit);
            let most = lesser(now + change, limit);
            let wanted = (*speed - last) / self.period_s;
            *speed = last + self.period_s * clipped(wanted, least, most);
        }
        Ok(braked)
    }

    /// Returns the share of speed that joints lose per period if they stop together.
    fn braking_share(
        &self,
        joints: std::ops::Range<usize>,
        previous: &[f64],
        acceleration: &[f64],
        ticks: f64,
    ) -> f64 {
        let period_s = self.period_s;
        let (mut most, mut jerk) = (f64::INFINITY, f64::INFINITY);
        let (mut along, mut squares) = (0.0, 0.0);
        let mut moves = false;
        for joint in joints {
            let speed = previous[joint].abs();
            along += acceleration[joint] * previous[joint];
            squares += previous[joint] * previous[joint];
            if speed > 0.0 {
                moves = true;
                most = most.min(self.ranges.acceleration[joint] * period_s / speed);
                jerk = jerk.min(self.ranges.jerk[joint] * period_s * period_s / speed);
            }
        }
        if !moves || (jerk >= 1.0 && ticks.max(1.0 / most) <= 1.0) {
            return 1.0;
        }
        let last = -along * period_s / squares;
        let fading = (jerk * jerk + 2.0 * jerk).sqrt() - jerk;
        let least = most.min(1.0 / ticks.max(1e-9)).min(fading).min(last.max(0.0) + jerk);
        least.min(1.0)
    }

    fn check_command(&self, previous: &[f64], acceleration: &[f64]) -> Result<(), ArmError> {
        let count = self.ranges.lower.len();
        fits("the commanded speeds of joints", count, previous)?;
        fits("the commanded accelerations of joints", count, acceleration)
    }
}

/// Returns the nearest number between two.
fn clipped(value: f64, least: f64, most: f64) -> f64 {
    lesser(greater(value, least), most)
}
