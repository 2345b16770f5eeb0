use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use servoid::servo as core;

use super::taking::{read_twist, wanted};
use crate::errors::raise;
use crate::pose::{Pose, rows};
use crate::taking::read_numbers;

/// Translates `a_from_b` by change[:3] and rotates it about b's origin by change[3:], in `a`, in
/// metres and radians. Raises PoseError.
#[pyfunction]
pub fn shifted_and_turned(pose: &Pose, change: &Bound<'_, PyAny>) -> PyResult<Pose> {
    let change = read_numbers(change, wanted("a change", "6 numbers (linear, angular)"))?;
    core::shifted_and_turned(&pose.0, &change).map(Pose).map_err(raise)
}

/// Returns translation and rotation (6,), in `a`, from one `a_from_b` to another. Raises PoseError.
#[pyfunction]
pub fn change_between<'py>(
    py: Python<'py>,
    before: &Pose,
    after: &Pose,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let change = core::change_between(&before.0, &after.0).map_err(raise)?;
    Ok(PyArray1::from_slice(py, &change))
}

/// A rigid motion `a_from_b` with its derivatives, all (4, 4) float64.
///
/// `first` and `second` are the time derivatives of `matrix`, in 1/s and 1/s². The product of
/// `a_from_b` and `b_from_c` is `a_from_c`, by the product rule.
#[pyclass(frozen)]
pub struct Moving(pub core::Moving);

#[pymethods]
impl Moving {
    /// Returns a constant motion.
    #[staticmethod]
    fn at_rest(pose: &Pose) -> Self {
        Self(core::Moving::at_rest(&pose.0))
    }

    /// Returns `a_from_b` with the velocity of b's origin and the angular velocity of b, in `a`.
    ///
    /// `twist` is (6,) in m/s and rad/s, `acceleration` its derivative, 0 if left out. Raises
    /// ServoError.
    #[staticmethod]
    #[pyo3(signature = (pose, twist, acceleration=None))]
    fn from_twist(
        pose: &Pose,
        twist: &Bound<'_, PyAny>,
        acceleration: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let acceleration = acceleration.map(read_twist).transpose()?;
        Ok(Self(core::Moving::from_twist(&pose.0, &read_twist(twist)?, acceleration.as_ref())))
    }

    /// The homogeneous matrix of the present pose.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, &self.0.matrix().numbers, 4)
    }

    /// The first derivative of the matrix by time, in 1/s.
    #[getter]
    fn first<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, &self.0.first().numbers, 4)
    }

    /// The second derivative of the matrix by time, in 1/s².
    #[getter]
    fn second<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, &self.0.second().numbers, 4)
    }

    /// The present pose.
    #[getter]
    fn pose(&self) -> PyResult<Pose> {
        self.0.pose().map(Pose).map_err(raise)
    }

    /// The velocity of b's origin in m/s and of b's rotation in rad/s, (6,), in `a`.
    #[getter]
    fn twist<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.0.twist())
    }

    /// Returns `b_from_a`.
    fn inverse(&self) -> PyResult<Self> {
        self.0.inverse().map(Self).map_err(raise)
    }

    fn __matmul__(&self, other: &Self) -> Self {
        Self(&self.0 * &other.0)
    }
}
