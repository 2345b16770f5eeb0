use numpy::ndarray::Zip;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use servoid::pose::exact;
use servoid::servo as core;

use super::taking::{read_jacobian, read_row, read_twist, wanted};
use crate::errors::{named, raise};
use crate::pose::rows;
use crate::taking::floats;

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// Returns whether each of numbers (N,) is from its lower to its upper bound, (N,) each; NaN is not.
/// Raises ServoError.
#[pyfunction]
pub fn is_between(
    numbers: &Bound<'_, PyAny>,
    lower: &Bound<'_, PyAny>,
    upper: &Bound<'_, PyAny>,
) -> PyResult<bool> {
    let numbers = read_row(numbers, "numbers")?;
    let (lower, upper) = (read_row(lower, "lower bounds")?, read_row(upper, "upper bounds")?);
    if lower.len() != numbers.len() || upper.len() != numbers.len() {
        let message = format!(
            "each number needs a lower and an upper bound, but of {} numbers {} and {} were given",
            numbers.len(),
            lower.len(),
            upper.len()
        );
        return Err(named("ServoError", message));
    }
    Ok(exact::is_between(&numbers, &lower, &upper))
}

/// Returns weights (n, n) that measure deviations of the hand, and hardly null-space motion.
///
/// `jacobian` is (6, n), and `angular_weight` the metres that weigh as much as a radian. Raises
/// ServoError.
#[pyfunction]
pub fn hand_weights<'py>(
    py: Python<'py>,
    jacobian: &Bound<'py, PyAny>,
    angular_weight: f64,
) -> PyResult<Matrix<'py>> {
    let weights = core::hand_weights(&read_jacobian(jacobian)?, angular_weight);
    Ok(rows(py, &weights.numbers, weights.columns))
}

/// Returns the part of a hand's velocity (6,) in nearly singular directions of its arm, in m/s.
///
/// `jacobian` is (6, n), `angular_weight` the metres that weigh as much as a radian, and
/// `damped_below` the gain below which a direction is nearly singular. Raises ServoError.
#[pyfunction]
pub fn lost_speed(
    jacobian: &Bound<'_, PyAny>,
    twist: &Bound<'_, PyAny>,
    angular_weight: f64,
    damped_below: f64,
) -> PyResult<f64> {
    let (jacobian, twist) = (read_jacobian(jacobian)?, read_twist(twist)?);
    core::lost_speed(&jacobian, &twist, angular_weight, damped_below).map_err(raise)
}

/// Returns the turns (n,), in rad, of a damped Newton step of n joints that changes the pose of a
/// hand by translation and rotation (6,). `jacobian` is (6, n). Raises ServoError.
#[pyfunction]
pub fn newton_turn<'py>(
    py: Python<'py>,
    jacobian: &Bound<'py, PyAny>,
    change: &Bound<'py, PyAny>,
) -> PyResult<Row<'py>> {
    let turn = core::newton_turn(&read_jacobian(jacobian)?, &read_twist(change)?).map_err(raise)?;
    Ok(turn.into_pyarray(py))
}

/// Differential inverse kinematics as a small quadratic program.
///
/// `posture` (n,) are the preferred angles, `posture_gain` is in 1/s, `angular_weight` the metres
/// that weigh as much as a radian; directions whose gain is less than `damped_below` are damped by
/// up to `damping`, in m/s per rad/s. Raises ServoError.
#[pyclass(frozen)]
pub struct QuadraticLaw(core::QuadraticLaw);

#[pymethods]
impl QuadraticLaw {
    #[new]
    fn new(
        posture: &Bound<'_, PyAny>,
        posture_gain: f64,
        angular_weight: f64,
        damping: f64,
        damped_below: f64,
    ) -> PyResult<Self> {
        let posture = read_row(posture, "a posture")?;
        let law =
            core::QuadraticLaw { posture, posture_gain, angular_weight, damping, damped_below };
        Ok(Self(law))
    }

    /// Returns the best joint speeds (n,) without bounds, in rad/s, and the weights (n, n) of
    /// deviations from them.
    ///
    /// `jacobian` is (6, n), `positions` (n,) are the joints' angles, and `twist` (6,) is the hand's
    /// desired velocity in the world. Raises ServoError.
    fn setpoint<'py>(
        &self,
        py: Python<'py>,
        jacobian: &Bound<'py, PyAny>,
        positions: &Bound<'py, PyAny>,
        twist: &Bound<'py, PyAny>,
    ) -> PyResult<(Row<'py>, Matrix<'py>)> {
        let (jacobian, twist) = (read_jacobian(jacobian)?, read_twist(twist)?);
        let positions = read_row(positions, "joint angles")?;
        let (speeds, weights) = self.0.setpoint(&jacobian, &positions, &twist).map_err(raise)?;
        Ok((speeds.into_pyarray(py), rows(py, &weights.numbers, weights.columns)))
    }
}

/// Returns the greatest speeds that stop within `room`, an array, 0 without any room.
///
/// A speed continues for `reaction_s` before it decreases at `deceleration`, which is a number, or
/// an array whose last axes are those of the room; following this curve needs less than that
/// deceleration. Raises ServoError.
#[pyfunction]
pub fn stoppable_speed<'py>(
    py: Python<'py>,
    room: &Bound<'py, PyAny>,
    deceleration: &Bound<'py, PyAny>,
    reaction_s: f64,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let room = floats(room, wanted("room", "an array of numbers"))?;
    let deceleration = floats(deceleration, wanted("a deceleration", "a number or an array"))?;
    let (room, by) = (room.as_array(), deceleration.as_array());
    let Some(by) = by.broadcast(room.raw_dim()) else {
        let message = format!(
            "a deceleration must be a number, or one for each room of shape {:?}, but has shape \
             {:?}",
            room.shape(),
            deceleration.shape()
        );
        return Err(named("ServoError", message));
    };
    let speed = |&room: &f64, &by: &f64| core::stoppable_speed(room, by, reaction_s);
    Ok(Zip::from(room).and(by).map_collect(speed).into_pyarray(py))
}

/// The limits of N joints in position, speed, acceleration and jerk.
///
/// `ranges` are five rows (N,): least and greatest angles, greatest speeds, accelerations and jerks,
/// in radians and seconds. The first `hand_count` joints move the hand. A joint begins to brake
/// after `reaction_s`. Raises ServoError.
#[pyclass(frozen)]
pub struct JointLimits(core::JointLimits);

#[pymethods]
impl JointLimits {
    #[new]
    fn new(
        ranges: [Bound<'_, PyAny>; 5],
        hand_count: usize,
        period_s: f64,
        reaction_s: f64,
    ) -> PyResult<Self> {
        let [lower, upper, speed, acceleration, jerk] = ranges;
        let ranges = core::JointRanges {
            lower: read_row(&lower, "the least angles")?,
            upper: read_row(&upper, "the greatest angles")?,
            speed: read_row(&speed, "the greatest speeds")?,
            acceleration: read_row(&acceleration, "the greatest accelerations")?,
            jerk: read_row(&jerk, "the greatest jerks")?,
        };
        core::JointLimits::new(ranges, hand_count, period_s, reaction_s).map(Self).map_err(raise)
    }

    /// Returns the least and the greatest speeds (N,) that may follow the last command, and for each
    /// of both rows the causes: 0 for the jerk, 1 for the acceleration, 2 for the speed, 3 for the
    /// end of the range.
    ///
    /// `now` are four rows (N,): measured angles and speeds, commanded speeds, and their rate of
    /// change. Before their stops the first joints brake no harder than `braking` (n,) in rad/s². The
    /// window is never empty: if limits contradict each other, it contains only the hardest braking.
    /// Raises ServoError.
    fn window<'py>(
        &self,
        py: Python<'py>,
        now: [Bound<'py, PyAny>; 4],
        braking: &Bound<'py, PyAny>,
    ) -> PyResult<(Row<'py>, Row<'py>, [Vec<u8>; 2])> {
        let [positions, velocities, previous, acceleration] = now;
        let positions = read_row(&positions, "joint angles")?;
        let velocities = read_row(&velocities, "joint speeds")?;
        let (previous, acceleration) = read_command(&previous, &acceleration)?;
        let now = core::JointMotion {
            positions: &positions,
            velocities: &velocities,
            previous: &previous,
            acceleration: &acceleration,
        };
        let braking = read_row(braking, "decelerations")?;
        let core::SpeedWindow { lower, upper, causes } =
            self.0.window(&now, &braking).map_err(raise)?;
        let causes = causes.map(|side| side.into_iter().map(number_of).collect());
        Ok((lower.into_pyarray(py), upper.into_pyarray(py), causes))
    }

    /// Returns the next command (N,) of joints that come to rest, after commanded speeds (N,) and
    /// their rate of change (N,).
    ///
    /// The joints of the hand stop together, along their path, and in no fewer periods than
    /// `hand_ticks`. The other joints also stop together, independently of the hand. Raises
    /// ServoError.
    fn braked<'py>(
        &self,
        py: Python<'py>,
        previous: &Bound<'py, PyAny>,
        acceleration: &Bound<'py, PyAny>,
        hand_ticks: f64,
    ) -> PyResult<Row<'py>> {
        let (previous, acceleration) = read_command(previous, acceleration)?;
        let braked = self.0.braked(&previous, &acceleration, hand_ticks).map_err(raise)?;
        Ok(braked.into_pyarray(py))
    }

    /// Returns the next command (N,) of joints that come to rest, without knowing their state, as
    /// `braked` does. Raises ServoError.
    fn blindly_braked<'py>(
        &self,
        py: Python<'py>,
        previous: &Bound<'py, PyAny>,
        acceleration: &Bound<'py, PyAny>,
        hand_ticks: f64,
    ) -> PyResult<Row<'py>> {
        let (previous, acceleration) = read_command(previous, acceleration)?;
        let braked = self.0.blindly_braked(&previous, &acceleration, hand_ticks).map_err(raise)?;
        Ok(braked.into_pyarray(py))
    }
}

fn read_command(
    previous: &Bound<'_, PyAny>,
    acceleration: &Bound<'_, PyAny>,
) -> PyResult<(Vec<f64>, Vec<f64>)> {
    let previous = read_row(previous, "commanded speeds")?;
    Ok((previous, read_row(acceleration, "commanded accelerations")?))
}

const fn number_of(cause: core::Cause) -> u8 {
    match cause {
        core::Cause::Jerk => 0,
        core::Cause::Acceleration => 1,
        core::Cause::Speed => 2,
        core::Cause::Limit => 3,
    }
}
