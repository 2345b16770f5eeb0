use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use servoid::servo as core;

use super::taking::{read_twist, read_vector};
use crate::errors::{named, raise};
use crate::pose::rows;

/// A state and its covariance.
type StateParts<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

const AXES: &str = "axes, one a row,";

/// Returns the numbers of a matrix of so many columns by rows.
fn by_rows(matrix: &PyReadonlyArray2<'_, f64>, what: &str, columns: usize) -> PyResult<Vec<f64>> {
    let shape = matrix.shape();
    if shape[1] != columns {
        let message = format!("{what} must have {columns} columns, but have shape {shape:?}");
        return Err(named("ServoError", message));
    }
    Ok(matrix.as_array().iter().copied().collect())
}

/// Returns the numbers of a square matrix by rows.
fn square(matrix: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<f64>> {
    by_rows(matrix, "the rows of a covariance", matrix.shape()[0])
}

/// A motion model of one coordinate, driven by white-noise jerk of density `jerk` per s² and root s.
#[pyclass(frozen, from_py_object)]
#[derive(Clone)]
pub struct MotionModel(core::MotionModel);

#[pymethods]
impl MotionModel {
    /// Makes a model whose acceleration decays with time constant `lasting_s` (Singer model).
    #[staticmethod]
    const fn singer(jerk: f64, lasting_s: f64) -> Self {
        Self(core::MotionModel::Singer { jerk, lasting_s })
    }

    /// Makes a model of an oscillation about any position, with period `period_s`.
    #[staticmethod]
    const fn oscillation(jerk: f64, period_s: f64) -> Self {
        Self(core::MotionModel::Oscillation { jerk, period_s })
    }

    /// Returns (3, 3): what position, speed and acceleration become in a time.
    fn moved<'py>(&self, py: Python<'py>, span_s: f64) -> Bound<'py, PyArray2<f64>> {
        PyArray2::from_owned_array(py, numpy::ndarray::arr2(&self.0.moved(span_s)))
    }
}

/// The expected kinds of motion, and the correlation time of estimation errors.
///
/// At rest, the position is a random walk of `rest` per root s; in motion, it follows one of
/// several models. Each mode lasts about `change_s`. Errors that estimates share decay with
/// `lasting_s`.
#[pyclass(frozen, from_py_object)]
#[derive(Clone)]
pub struct MotionPrior(core::MotionPrior);

#[pymethods]
impl MotionPrior {
    #[new]
    fn new(rest: f64, models: Vec<MotionModel>, change_s: f64, lasting_s: f64) -> Self {
        let models = models.into_iter().map(|model| model.0).collect();
        Self(core::MotionPrior { rest, models, change_s, lasting_s })
    }
}

/// The uncertainty of an estimate.
///
/// `fresh` is the covariance (n, n) of errors that are independent in each estimate, `lasting` the
/// standard deviation, along any axis, of errors that successive estimates share. Earlier shared
/// errors decay within `fading_s`, faster than new ones arise if the estimates have become certain.
#[pyclass(frozen, from_py_object)]
#[derive(Clone)]
pub struct Noise(core::Noise);

#[pymethods]
impl Noise {
    #[new]
    fn new(fresh: PyReadonlyArray2<'_, f64>, lasting: f64, fading_s: f64) -> PyResult<Self> {
        core::Noise::new(square(&fresh)?, lasting, fading_s).map(Self).map_err(raise)
    }
}

/// A measurement of a motion.
#[pyclass(frozen)]
pub struct Measurement(core::Measurement);

#[pymethods]
impl Measurement {
    /// Returns the measurement of an estimate along axes (k, n): position plus shared error.
    #[staticmethod]
    fn along(axes: PyReadonlyArray2<'_, f64>, noise: &Noise) -> PyResult<Self> {
        let axes = by_rows(&axes, AXES, noise.0.coordinates())?;
        core::Measurement::along(&axes, &noise.0).map(Self).map_err(raise)
    }

    /// Returns a measurement of the position along axes (k, n), of covariance `spread` (n, n).
    #[staticmethod]
    fn of_place(
        axes: PyReadonlyArray2<'_, f64>,
        spread: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let axes = by_rows(&axes, AXES, spread.shape()[0])?;
        core::Measurement::of_place(&axes, square(&spread)?).map(Self).map_err(raise)
    }

    /// Adds the pseudo-measurement of zero speed along axes (m, n), of deviation `speed`.
    fn and_resting(&self, axes: PyReadonlyArray2<'_, f64>, speed: f64) -> PyResult<Self> {
        let axes = by_rows(&axes, AXES, self.0.coordinates())?;
        self.0.and_resting(&axes, speed).map(Self).map_err(raise)
    }
}

/// Coordinates (n,), their speed and acceleration, and the shared error of estimates.
///
/// Kalman filters, one for rest and one for each motion model, are weighted by their likelihood:
/// interacting multiple models. The state (4 n,) of each is (offset, speed, acceleration, shared
/// error of estimates), and offsets are relative to a reference that `settle` moves. It is made of
/// an estimate at the reference, and the initial standard deviations of speed and acceleration.
#[pyclass]
pub struct Motion(core::Motion);

#[pymethods]
impl Motion {
    #[new]
    fn new(prior: MotionPrior, noise: Noise, spread: [f64; 2]) -> Self {
        Self(core::Motion::new(prior.0, noise.0, spread))
    }

    /// The probability of motion, 0 to 1.
    #[getter]
    fn going(&self) -> f64 {
        self.0.going()
    }

    /// Predicts state (4 n,) and covariance (4 n, 4 n) at a time after the newest estimate.
    fn ahead<'py>(&self, py: Python<'py>, span_s: f64) -> PyResult<StateParts<'py>> {
        let core::Mixture { state, covariance } = self.0.ahead(span_s);
        let size = state.len();
        Ok((state.into_pyarray(py), covariance.into_pyarray(py).reshape([size, size])?))
    }

    /// Advances all filters to the time of an estimate with the given noise; raises ServoError.
    fn advance(&mut self, elapsed_s: f64, noise: Noise) -> PyResult<()> {
        self.0.advance(elapsed_s, noise.0).map_err(raise)
    }

    /// Corrects by a measurement, given as its offset (k,) from the value at the reference.
    ///
    /// Returns the normalised innovation squared (NIS) of the filter that fits better; beyond
    /// `nis_gate` the measurement is down-weighted. Raises ServoError.
    fn correct(
        &mut self,
        measurement: &Measurement,
        offset: PyReadonlyArray1<'_, f64>,
        nis_gate: f64,
    ) -> PyResult<f64> {
        let offset: Vec<f64> = offset.as_array().iter().copied().collect();
        self.0.correct(&measurement.0, &offset, nis_gate).map_err(raise)
    }

    /// Adds a covariance (n, n) to that of the offset; raises ServoError.
    fn inflate(&mut self, unknown: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        self.0.inflate(&square(&unknown)?).map_err(raise)
    }

    /// Moves the reference to the estimated position; returns the shift, (n,).
    fn settle<'py>(&mut self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.settle().into_pyarray(py)
    }
}

/// Six rows of a prediction, and two matrices.
type PredictionParts<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
);

/// Predicts an object by the motions of its position and its rotation, of 3 coordinates each, at a
/// time after the newest estimate.
///
/// Returns translation and rotation from the reference (6,), their rates (6,), the rates of these
/// (6,), and the covariances (6, 6) of translation and rotation and of their rates, 0 about
/// unobservable axes. `hidden` (2, 3, 3) is added to the former, and `unobservable` (3, 3)
/// is the projection
/// onto the axes about which the rotation is unobservable. Raises ServoError.
#[pyfunction]
pub fn predicted_motion<'py>(
    py: Python<'py>,
    motions: (PyRef<'py, Motion>, PyRef<'py, Motion>),
    hidden: PyReadonlyArray3<'py, f64>,
    unobservable: PyReadonlyArray2<'py, f64>,
    span_s: f64,
) -> PyResult<PredictionParts<'py>> {
    let hidden: Vec<f64> = hidden.as_array().iter().copied().collect();
    let unobservable: Vec<f64> = unobservable.as_array().iter().copied().collect();
    let halves = hidden.split_at(hidden.len() / 2);
    let beside = core::Beside { hidden: [halves.0, halves.1], open: &unobservable };
    let core::Prediction { change, twist, acceleration, covariance, twist_covariance } =
        core::predict([&motions.0.0, &motions.1.0], &beside, span_s).map_err(raise)?;
    Ok((
        PyArray1::from_slice(py, &change),
        PyArray1::from_slice(py, &twist),
        PyArray1::from_slice(py, &acceleration),
        rows(py, &covariance.numbers, 6),
        rows(py, &twist_covariance.numbers, 6),
    ))
}

/// Returns the twist (6,) of an object after a time, as far as it is certain.
///
/// `motion` are its twist (6,), its acceleration (6,) and the covariance (6, 6) of the twist. The two
/// parts of the twist are shortened if their deviations exceed `sure`, in m/s and rad/s. Raises
/// ServoError.
#[pyfunction]
pub fn certain_twist<'py>(
    py: Python<'py>,
    motion: (Bound<'py, PyAny>, Bound<'py, PyAny>, PyReadonlyArray2<'py, f64>),
    after_s: f64,
    sure: [f64; 2],
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (twist, acceleration, covariance) = motion;
    if covariance.shape() != [6, 6] {
        let shape = covariance.shape();
        let message = format!("the covariance of a twist must be (6, 6), but has shape {shape:?}");
        return Err(named("ServoError", message));
    }
    let variances = std::array::from_fn(|i| covariance.as_array()[[i, i]]);
    let (twist, acceleration) = (read_twist(&twist)?, read_twist(&acceleration)?);
    let twist = core::certain_twist(&twist, &acceleration, after_s, &variances, sure);
    Ok(PyArray1::from_slice(py, &twist))
}

/// Returns the standard deviation, in m, of a point fixed to an object, at `lever` (3,) from its
/// origin in the world.
///
/// `covariance` (6, 6) is that of a small translation and rotation of the object in the world.
/// Raises ServoError.
#[pyfunction]
pub fn spread_at(covariance: PyReadonlyArray2<'_, f64>, lever: &Bound<'_, PyAny>) -> PyResult<f64> {
    let numbers: Vec<f64> = covariance.as_array().iter().copied().collect();
    core::spread_at(&numbers, read_vector(lever, "a lever")?).map_err(raise)
}
