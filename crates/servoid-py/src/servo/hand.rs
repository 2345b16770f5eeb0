use numpy::PyArray1;
use pyo3::prelude::*;
use servoid::servo as core;

use super::moving::Moving;
use super::taking::{read_twist, read_vector};
use crate::errors::raise;
use crate::pose::Pose;

type Vector<'py> = Bound<'py, PyArray1<f64>>;

/// Returns the hand's desired velocity (6,), linear and angular in the world, by the paper's PD law.
///
/// The gains are of the position, of its rate, of the rotation, and of its rate. Raises PoseError.
#[pyfunction]
pub fn hand_correction<'py>(
    py: Python<'py>,
    hand_from_goal: &Moving,
    world_from_hand: &Pose,
    gains: [f64; 4],
) -> PyResult<Vector<'py>> {
    let [position, position_rate, turn, turn_rate] = gains;
    let gains = core::HandGains { position, position_rate, turn, turn_rate };
    let twist = core::correction(&hand_from_goal.0, &world_from_hand.0, &gains).map_err(raise)?;
    Ok(PyArray1::from_slice(py, &twist))
}

/// Returns the vector part (3,) of the shorter unit quaternion of the rotation to the goal.
#[pyfunction]
pub fn quaternion_error<'py>(py: Python<'py>, hand_from_goal: &Moving) -> PyResult<Vector<'py>> {
    let vector = core::quaternion_error(&hand_from_goal.0).map_err(raise)?;
    Ok(PyArray1::from_slice(py, &vector))
}

/// Returns factors (2,), at most 1, that limit a twist's two parts to the given lengths. Raises
/// ServoError.
#[pyfunction]
pub fn twist_shares<'py>(
    py: Python<'py>,
    twist: &Bound<'py, PyAny>,
    linear: f64,
    angular: f64,
) -> PyResult<Vector<'py>> {
    Ok(PyArray1::from_slice(py, &core::shares(&read_twist(twist)?, [linear, angular])))
}

/// Returns a twist (6,) whose linear and angular parts have at most the given lengths. Raises
/// ServoError.
#[pyfunction]
pub fn twist_within<'py>(
    py: Python<'py>,
    twist: &Bound<'py, PyAny>,
    linear: f64,
    angular: f64,
) -> PyResult<Vector<'py>> {
    Ok(PyArray1::from_slice(py, &core::within(&read_twist(twist)?, [linear, angular])))
}

/// Returns the gaze at a point (3,) that moves at a velocity (3,), in the head's frame: angles (3,)
/// of tilt, left and right pan, and their rates (3,). Raises ServoError.
#[pyfunction]
pub fn fixation<'py>(
    py: Python<'py>,
    half_baseline: f64,
    point: &Bound<'py, PyAny>,
    velocity: &Bound<'py, PyAny>,
) -> PyResult<(Vector<'py>, Vector<'py>)> {
    let point = read_vector(point, "a point in the head")?;
    let velocity = read_vector(velocity, "a velocity in the head")?;
    let core::Gaze { angles, rates } = core::fixation(half_baseline, point, velocity);
    Ok((PyArray1::from_slice(py, &angles), PyArray1::from_slice(py, &rates)))
}

/// Returns position and velocity (3,) in the head of a point (3,) that moves in the world.
///
/// `hand_twist` (6,) is the hand's own motion in the world, which the head shares. Raises
/// ServoError.
#[pyfunction]
pub fn seen_from_head<'py>(
    py: Python<'py>,
    world_from_hand: &Pose,
    hand_from_head: &Pose,
    hand_twist: &Bound<'py, PyAny>,
    point: &Bound<'py, PyAny>,
    velocity: &Bound<'py, PyAny>,
) -> PyResult<(Vector<'py>, Vector<'py>)> {
    let (place, velocity) = core::seen_from_head(
        &world_from_hand.0,
        &hand_from_head.0,
        &read_twist(hand_twist)?,
        read_vector(point, "a point in the world")?,
        read_vector(velocity, "a velocity in the world")?,
    );
    Ok((PyArray1::from_slice(py, &place), PyArray1::from_slice(py, &velocity)))
}
