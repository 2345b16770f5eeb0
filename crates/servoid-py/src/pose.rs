use nalgebra::{Matrix4, Vector3, Vector6};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use servoid::pose as core;

use crate::errors::{named, raise};

/// A rigid motion, an element of SE(3): `a_from_b` maps coordinates in `b` to coordinates in `a`.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct Pose(pub core::Pose);

#[pymethods]
impl Pose {
    /// Reads a homogeneous matrix, (4, 4) float64; raises PoseError if it is no rigid motion.
    #[new]
    fn new(matrix: PyReadonlyArray2<'_, f64>) -> PyResult<Self> {
        if matrix.shape() != [4, 4] {
            let message = format!("a pose is a 4x4 matrix, but its shape is {:?}", matrix.shape());
            return Err(named("PoseError", message));
        }
        let array = matrix.as_array();
        let matrix = Matrix4::from_fn(|row, column| array[[row, column]]);
        core::Pose::from_matrix(&matrix).map(Self).map_err(raise)
    }

    /// Gives the motion that moves nothing.
    #[staticmethod]
    fn identity() -> Self {
        Self(core::Pose::identity())
    }

    /// Joins a translation (x, y, z) in metres and a unit quaternion (w, x, y, z).
    #[staticmethod]
    fn from_parts(translation: [f64; 3], quaternion: [f64; 4]) -> PyResult<Self> {
        core::Pose::from_parts(translation, quaternion).map(Self).map_err(raise)
    }

    /// Follows a twist (linear, angular) for unit time.
    #[staticmethod]
    fn exp(twist: [f64; 6]) -> PyResult<Self> {
        match twist.iter().find(|x| !x.is_finite()) {
            Some(&bad) => Err(raise(core::PoseError::NotFinite(bad))),
            None => Ok(Self(core::Pose::exp(&Vector6::from(twist)))),
        }
    }

    /// Gives the twist (linear, angular), (6,) float64, whose exponential this is.
    fn log<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.log().as_slice())
    }

    /// Gives the adjoint, (6, 6) float64, that carries twists (linear, angular) along.
    fn adjoint<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.adjoint().transpose().as_slice(), 6)
    }

    /// Gives the motion back.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Gives the homogeneous matrix, (4, 4) float64.
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.matrix().transpose().as_slice(), 4)
    }

    /// Translation (x, y, z) in metres.
    #[getter]
    fn translation(&self) -> (f64, f64, f64) {
        let t = self.0.translation();
        (t.x, t.y, t.z)
    }

    /// Unit quaternion (w, x, y, z) with w >= 0.
    #[getter]
    fn quaternion(&self) -> (f64, f64, f64, f64) {
        self.0.quaternion().into()
    }

    /// Moves points, (N, 3) float64, in metres.
    fn transform<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = read_rows::<_, 3>(&points, "points")?;
        let moved: Vec<f64> = points
            .iter()
            .flat_map(|&p| <[f64; 3]>::from(self.0.transform(&Vector3::from(p))))
            .collect();
        Ok(rows(py, &moved, 3))
    }

    fn __matmul__(&self, other: &Self) -> Self {
        Self(self.0 * other.0)
    }

    fn __repr__(&self) -> String {
        format!("Pose(translation={:?}, quaternion={:?})", self.translation(), self.quaternion())
    }
}

/// Gives a float64 array of rows of a length.
pub fn rows<'py>(py: Python<'py>, values: &[f64], length: usize) -> Bound<'py, PyArray2<f64>> {
    let array = PyArray2::zeros(py, [values.len() / length, length], false);
    // SAFETY: the array was just made and nobody else holds it.
    unsafe {
        if let Ok(place) = array.as_slice_mut() {
            place.copy_from_slice(values);
        }
    }
    array
}

/// Reads an (N, K) float64 array.
pub fn read_rows<T: Copy + Element, const K: usize>(
    array: &PyReadonlyArray2<'_, T>,
    what: &str,
) -> PyResult<Vec<[T; K]>> {
    if array.shape()[1] != K {
        let message = format!("{what} must have shape (N, {K}), but it is {:?}", array.shape());
        return Err(named("ServoidError", message));
    }
    let array = array.as_array();
    Ok(array.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
}

/// Reads poses, (N, 7) float64, as (w, x, y, z, tx, ty, tz).
pub fn read_poses(array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<core::Pose>> {
    let rows = read_rows::<_, 7>(array, "poses")?;
    let pose = |&[w, i, j, k, x, y, z]: &[f64; 7]| core::Pose::from_parts([x, y, z], [w, i, j, k]);
    rows.iter().map(pose).collect::<Result<_, _>>().map_err(raise)
}
