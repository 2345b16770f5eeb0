use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use servoid::servo as core;

use super::taking::{read_jacobian, read_row, read_twist, read_vector};
use crate::errors::raise;
use crate::pose::rows;

type Row<'py> = Bound<'py, PyArray1<f64>>;
type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// The greatest linear and angular speed of a hand, in m/s and rad/s, and how far they may change
/// in a control period.
///
/// An acceleration counts as if it continued for `fading` periods before it vanishes.
#[pyclass(frozen)]
pub struct HandLimits(core::HandLimits);

#[pymethods]
impl HandLimits {
    #[new]
    const fn new(speeds: [f64; 2], steps: [f64; 2], period_s: f64, fading: f64) -> Self {
        Self(core::HandLimits { speeds, steps, period_s, fading })
    }

    /// Returns the bounds on joint speeds after a hand velocity `last` (6,), at a share of the
    /// hand's speed. `jacobian` is (6, n). Raises ServoError.
    fn balls(
        &self,
        jacobian: &Bound<'_, PyAny>,
        last: &Bound<'_, PyAny>,
        speed_scale: f64,
    ) -> PyResult<Balls> {
        Ok(Balls(self.0.balls(&read_jacobian(jacobian)?, &read_twist(last)?, speed_scale)))
    }

    /// Returns the joints' decelerations (n,) in rad/s² that the hand's limit allows.
    ///
    /// `jacobian` is (6, n). Each joint leaves a share of the hand's limit to the other joints.
    /// Raises ServoError.
    fn braking<'py>(&self, py: Python<'py>, jacobian: &Bound<'py, PyAny>) -> PyResult<Row<'py>> {
        Ok(self.0.braking(&read_jacobian(jacobian)?).into_pyarray(py))
    }

    /// Returns the number of periods in which the hand can come to rest from a velocity (6,). Raises
    /// ServoError.
    fn ticks_to_rest(&self, twist: &Bound<'_, PyAny>) -> PyResult<f64> {
        Ok(self.0.ticks_to_rest(&read_twist(twist)?))
    }
}

/// The bounds of a hand's velocity on joint speeds (n,): of the linear and then of the angular
/// velocity, first that of the speed, then that of the acceleration.
#[pyclass(frozen)]
pub struct Balls(core::Balls);

#[pymethods]
impl Balls {
    /// Returns whether joint speeds (n,) are inside. Raises ServoError.
    fn hold(&self, velocities: &Bound<'_, PyAny>) -> PyResult<bool> {
        self.0.hold(&read_row(velocities, "joint speeds")?).map_err(raise)
    }

    /// Returns the tangent planes nearest to joint speeds (n,) of the k bounds that these are
    /// outside of: the numbers of the bounds, the planes as rows (k, n), and the greatest products
    /// (k,) of the rows with joint speeds. Raises ServoError.
    fn cuts<'py>(
        &self,
        py: Python<'py>,
        velocities: &Bound<'py, PyAny>,
    ) -> PyResult<(Vec<usize>, Matrix<'py>, Row<'py>)> {
        let velocities = read_row(velocities, "joint speeds")?;
        let core::Cuts { balls, matrix, upper } = self.0.cuts(&velocities).map_err(raise)?;
        Ok((balls, rows(py, &matrix.numbers, matrix.columns), upper.into_pyarray(py)))
    }
}

/// Where a hand may be, and how it brakes before the end of it.
///
/// Corners (3,) of the workspace are in the world, `least_distance` in m is that from the object;
/// the hand begins to brake, at `braking` in m/s², after `reaction_s`. Raises ServoError.
#[pyclass(frozen)]
pub struct Workspace(core::Workspace);

#[pymethods]
impl Workspace {
    #[new]
    #[pyo3(signature = (corners, *, least_distance, braking, reaction_s, period_s))]
    fn new(
        corners: [[f64; 3]; 2],
        least_distance: f64,
        braking: f64,
        reaction_s: f64,
        period_s: f64,
    ) -> Self {
        let [lower, upper] = corners;
        Self(core::Workspace { lower, upper, least_distance, braking, reaction_s, period_s })
    }

    /// Returns the position of a goal (3,), moved into the workspace and away from an object at (3,).
    /// Raises ServoError.
    fn allowed(
        &self,
        goal: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
    ) -> PyResult<(f64, f64, f64)> {
        let (goal, target) = (read_vector(goal, "a goal")?, read_vector(target, "an object")?);
        Ok(self.0.allowed(goal, target).into())
    }

    /// Returns the bounds of a hand's velocity for an object, both as (position, velocity), of (3,)
    /// each in the world.
    ///
    /// No bound requires a deceleration above `braking` from the hand's velocity. Raises ServoError.
    fn velocity_limits(
        &self,
        hand: (Bound<'_, PyAny>, Bound<'_, PyAny>),
        target: (Bound<'_, PyAny>, Bound<'_, PyAny>),
    ) -> PyResult<VelocityLimits> {
        let hand = read_drift(&hand, "a hand's position or velocity")?;
        let target = read_drift(&target, "an object's position or velocity")?;
        Ok(VelocityLimits(self.0.velocity_limits(&hand, &target)))
    }
}

fn read_drift(
    (place, velocity): &(Bound<'_, PyAny>, Bound<'_, PyAny>),
    name: &'static str,
) -> PyResult<core::Drift> {
    Ok(core::Drift { place: read_vector(place, name)?, velocity: read_vector(velocity, name)? })
}

/// Bounds (3,) of the hand's velocity in the world, and of its speed towards the object.
#[pyclass(frozen)]
pub struct VelocityLimits(core::VelocityLimits);

#[pymethods]
impl VelocityLimits {
    /// The least velocity (3,) in m/s.
    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> Row<'py> {
        PyArray1::from_slice(py, &self.0.lower)
    }

    /// The greatest velocity (3,) in m/s.
    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> Row<'py> {
        PyArray1::from_slice(py, &self.0.upper)
    }

    /// The unit direction (3,) to the object, 0 at the object itself.
    #[getter]
    fn toward<'py>(&self, py: Python<'py>) -> Row<'py> {
        PyArray1::from_slice(py, &self.0.toward)
    }

    /// The greatest speed towards the object in m/s, which includes the object's velocity.
    #[getter]
    const fn closing(&self) -> f64 {
        self.0.closing
    }

    /// Returns rows (4, n) whose products with joint speeds (n,) are bounded, and the least and the
    /// greatest products, (4,) each. `jacobian` (6, n) is that of the hand. Raises ServoError.
    fn rows<'py>(
        &self,
        py: Python<'py>,
        jacobian: &Bound<'py, PyAny>,
    ) -> PyResult<(Matrix<'py>, Row<'py>, Row<'py>)> {
        let (matrix, lower, upper) = self.0.rows(&read_jacobian(jacobian)?);
        let matrix = rows(py, &matrix.numbers, matrix.columns);
        Ok((matrix, PyArray1::from_slice(py, &lower), PyArray1::from_slice(py, &upper)))
    }
}
