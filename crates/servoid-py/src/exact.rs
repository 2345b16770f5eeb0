//! Elementary functions and small linear algebra with the same bits on every processor.

use nalgebra::{DMatrix, DVector};
use numpy::ndarray::Array2;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyFloat;

/// Eigenvalues and eigenvectors.
type Eigen<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// A number, or an array of numbers of any shape.
pub enum Numbers<'py> {
    Array(PyReadonlyArrayDyn<'py, f64>),
    One(f64),
}

impl<'a, 'py> FromPyObject<'a, 'py> for Numbers<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        // That a number is no array takes longer to find out than what is computed of it.
        if let Ok(number) = given.cast::<PyFloat>() {
            return Ok(Self::One(number.value()));
        }
        if let Ok(array) = given.extract() {
            return Ok(Self::Array(array));
        }
        given.extract().map(Self::One).map_err(|_| {
            let kind = given.get_type();
            let kind =
                given.getattr("dtype").map_or_else(|_| kind.to_string(), |kind| kind.to_string());
            PyTypeError::new_err(format!(
                "a number or an array of float64 is needed, but got {kind}"
            ))
        })
    }
}

impl<'py> Numbers<'py> {
    fn map(self, py: Python<'py>, f: impl Fn(f64) -> f64) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self {
            Self::One(x) => f(x).into_pyobject(py)?.into_any(),
            Self::Array(x) => x.as_array().mapv(f).into_pyarray(py).into_any(),
        })
    }
}

macro_rules! elementary {
    ($($name:ident = $function:path;)*) => {$(
        #[doc = concat!("Returns ", stringify!($function), " of a number, or of each in an array.")]
        #[pyfunction]
        pub fn $name<'py>(py: Python<'py>, x: Numbers<'py>) -> PyResult<Bound<'py, PyAny>> {
            x.map(py, $function)
        }
    )*};
}

elementary! {
    exact_sin = libm::sin;
    exact_cos = libm::cos;
    exact_tan = libm::tan;
    exact_arcsin = libm::asin;
    exact_arccos = libm::acos;
    exact_arctan = libm::atan;
    exact_exp = libm::exp;
    exact_expm1 = libm::expm1;
    exact_log = libm::log;
}

/// Returns atan2(y, x) of numbers.
#[pyfunction]
pub fn exact_arctan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// Returns x to the power y, for numbers.
#[pyfunction]
pub fn exact_power(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

fn matrix(x: &PyReadonlyArray2<'_, f64>) -> DMatrix<f64> {
    let x = x.as_array();
    DMatrix::from_fn(x.nrows(), x.ncols(), |row, column| x[[row, column]])
}

fn rows<'py>(py: Python<'py>, x: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    // The transpose of columns in memory is rows in memory.
    let numbers = x.transpose().as_slice().to_vec().into_pyarray(py);
    numpy::PyArrayMethods::reshape(&numbers, [x.nrows(), x.ncols()])
}

/// Multiplies two matrices; sums are in the order of the inner index.
#[pyfunction]
pub fn exact_product<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'py, f64>,
    b: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (a, b) = (a.as_array(), b.as_array());
    let (count, inner, width) = (a.nrows(), a.ncols(), b.ncols());
    if inner != b.nrows() {
        let message = format!("cannot multiply {:?} with {:?}", a.shape(), b.shape());
        return Err(PyValueError::new_err(message));
    }
    let mut out = Array2::zeros([count, width]);
    for (mut out, a) in out.rows_mut().into_iter().zip(a.rows()) {
        for (&factor, b) in a.iter().zip(b.rows()) {
            for (sum, &value) in out.iter_mut().zip(b) {
                *sum += factor * value;
            }
        }
    }
    Ok(out.into_pyarray(py))
}

/// Solves a x = b for each column of b.
#[pyfunction]
pub fn exact_solve<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'py, f64>,
    b: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (a, b) = (matrix(&a), matrix(&b));
    if !a.is_square() || a.nrows() != b.nrows() {
        let message = format!("cannot solve {:?} for {:?}", a.shape(), b.shape());
        return Err(PyValueError::new_err(message));
    }
    let x = a.lu().solve(&b).ok_or_else(|| PyValueError::new_err("the matrix is singular"))?;
    rows(py, &x)
}

/// Returns the eigenvalues (N) of a symmetric matrix, the least first, and the eigenvectors as
/// columns.
#[pyfunction]
pub fn exact_eigh<'py>(py: Python<'py>, a: PyReadonlyArray2<'py, f64>) -> PyResult<Eigen<'py>> {
    let a = matrix(&a);
    let found = a.is_square().then(|| a.try_symmetric_eigen(f64::EPSILON, 0)).flatten();
    let Some(found) = found else {
        return Err(PyValueError::new_err("the eigenvalues of the matrix cannot be found"));
    };
    let mut order: Vec<usize> = (0..found.eigenvalues.len()).collect();
    order.sort_by(|&i, &j| found.eigenvalues[i].total_cmp(&found.eigenvalues[j]));
    let values = DVector::from_fn(order.len(), |i, _| found.eigenvalues[order[i]]);
    let vectors =
        DMatrix::from_fn(order.len(), order.len(), |r, c| found.eigenvectors[(r, order[c])]);
    Ok((values.as_slice().to_vec().into_pyarray(py), rows(py, &vectors)?))
}

/// Returns the length of a vector.
#[pyfunction]
pub fn exact_norm(x: PyReadonlyArray1<'_, f64>) -> f64 {
    x.as_array().iter().fold(0.0, |sum, x| sum + x * x).sqrt()
}

/// Adds these functions to the module.
pub fn add_to(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(exact_sin, module)?)?;
    module.add_function(wrap_pyfunction!(exact_cos, module)?)?;
    module.add_function(wrap_pyfunction!(exact_tan, module)?)?;
    module.add_function(wrap_pyfunction!(exact_arcsin, module)?)?;
    module.add_function(wrap_pyfunction!(exact_arccos, module)?)?;
    module.add_function(wrap_pyfunction!(exact_arctan, module)?)?;
    module.add_function(wrap_pyfunction!(exact_arctan2, module)?)?;
    module.add_function(wrap_pyfunction!(exact_exp, module)?)?;
    module.add_function(wrap_pyfunction!(exact_expm1, module)?)?;
    module.add_function(wrap_pyfunction!(exact_log, module)?)?;
    module.add_function(wrap_pyfunction!(exact_power, module)?)?;
    module.add_function(wrap_pyfunction!(exact_product, module)?)?;
    module.add_function(wrap_pyfunction!(exact_solve, module)?)?;
    module.add_function(wrap_pyfunction!(exact_eigh, module)?)?;
    module.add_function(wrap_pyfunction!(exact_norm, module)?)
}
