//! Elementary functions and small linear algebra with the same bits on every processor.

use std::borrow::Cow;

use numpy::ndarray::ArrayViewD;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyTuple};
use servoid::pose::exact::{self, Rows};

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

fn matrix(x: &PyReadonlyArray2<'_, f64>) -> Rows {
    let x = x.as_array();
    Rows { numbers: x.iter().copied().collect(), columns: x.ncols() }
}

fn array<'py>(py: Python<'py>, x: Rows) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let shape = [x.count(), x.columns];
    numpy::PyArrayMethods::reshape(&x.numbers.into_pyarray(py), shape)
}

/// A matrix by rows, or a vector that stands for a row or a column.
struct Factor<'a> {
    numbers: Cow<'a, [f64]>,
    rows: usize,
    columns: usize,
    is_vector: bool,
}

impl<'a> Factor<'a> {
    fn of(array: &ArrayViewD<'a, f64>, is_first: bool) -> PyResult<Self> {
        let (rows, columns) = match (array.shape(), is_first) {
            (&[count], true) => (1, count),
            (&[count], false) => (count, 1),
            (&[rows, columns], _) => (rows, columns),
            (shape, _) => {
                let message = format!("a factor is a matrix or a vector, but has shape {shape:?}");
                return Err(PyValueError::new_err(message));
            }
        };
        let numbers = match (array.to_slice(), array.t().to_slice()) {
            (Some(rows), _) => Cow::Borrowed(rows),
            // Much faster than by the strides of the array.
            (None, Some(by_column)) => {
                (0..rows).flat_map(|row| by_column[row..].iter().step_by(rows).copied()).collect()
            }
            (None, None) => array.iter().copied().collect(),
        };
        Ok(Self { numbers, rows, columns, is_vector: array.ndim() == 1 })
    }

    fn times(&self, other: &Factor<'_>) -> PyResult<Self> {
        if self.columns != other.rows {
            let (a, b) = ([self.rows, self.columns], [other.rows, other.columns]);
            return Err(PyValueError::new_err(format!("cannot multiply {a:?} with {b:?}")));
        }
        let numbers = if self.columns == 0 || other.columns == 0 {
            vec![0.0; self.rows * other.columns]
        } else {
            exact::product(&self.numbers, &other.numbers, self.columns, other.columns)
        };
        let numbers = Cow::Owned(numbers);
        Ok(Self { numbers, rows: self.rows, columns: other.columns, is_vector: false })
    }
}

/// Multiplies matrices from the left; the first or the last may be a vector. Sums are in the order
/// of the inner index.
#[pyfunction]
#[pyo3(signature = (*factors))]
pub fn exact_product<'py>(
    py: Python<'py>,
    factors: &Bound<'py, PyTuple>,
) -> PyResult<Bound<'py, PyAny>> {
    let factors: Vec<PyReadonlyArrayDyn<'py, f64>> =
        factors.iter_borrowed().map(|factor| factor.extract()).collect::<PyResult<_>>()?;
    let [first, others @ ..] = &factors[..] else {
        return Err(PyValueError::new_err("a product needs a factor"));
    };
    let mut product = Factor::of(&first.as_array(), true)?;
    let is_row = product.is_vector;
    let mut is_column = false;
    for other in others {
        if is_column {
            return Err(PyValueError::new_err(
                "only the first and the last factor may be a vector",
            ));
        }
        let other = other.as_array();
        let other = Factor::of(&other, false)?;
        is_column = other.is_vector;
        product = product.times(&other)?;
    }
    let Factor { numbers, rows, columns, .. } = product;
    if is_row && is_column {
        return Ok(numbers[0].into_pyobject(py)?.into_any());
    }
    let array = numbers.into_owned().into_pyarray(py);
    if is_row || is_column {
        return Ok(array.into_any());
    }
    Ok(numpy::PyArrayMethods::reshape(&array, [rows, columns])?.into_any())
}

/// Solves a x = b for each column of b.
#[pyfunction]
pub fn exact_solve<'py>(
    py: Python<'py>,
    a: PyReadonlyArray2<'py, f64>,
    b: PyReadonlyArray2<'py, f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (of, right) = (a.as_array().dim(), b.as_array().dim());
    if of.0 != of.1 || of.0 != right.0 {
        let message = format!("cannot solve {of:?} for {right:?}");
        return Err(PyValueError::new_err(message));
    }
    if right.1 == 0 {
        return Ok(PyArray2::zeros(py, [right.0, 0], false));
    }
    let x = matrix(&a).solve(&matrix(&b));
    array(py, x.ok_or_else(|| PyValueError::new_err("the matrix is singular"))?)
}

/// Returns the eigenvalues (N) of a symmetric matrix, the least first, and the eigenvectors as
/// columns.
#[pyfunction]
pub fn exact_eigh<'py>(py: Python<'py>, a: PyReadonlyArray2<'py, f64>) -> PyResult<Eigen<'py>> {
    let Some((values, vectors)) = matrix(&a).symmetric_eigen() else {
        return Err(PyValueError::new_err("the eigenvalues of the matrix cannot be found"));
    };
    Ok((values.into_pyarray(py), array(py, vectors)?))
}

/// Returns the length of a vector.
#[pyfunction]
pub fn exact_norm(x: PyReadonlyArray1<'_, f64>) -> f64 {
    x.as_array().iter().fold(0.0, |sum, x| sum + x * x).sqrt()
}

/// Returns whether all numbers of an array are finite.
#[pyfunction]
pub fn exact_is_finite(x: PyReadonlyArrayDyn<'_, f64>) -> bool {
    match x.as_slice() {
        Ok(numbers) => exact::is_finite(numbers),
        Err(_) => x.as_array().iter().all(|x| x.is_finite()),
    }
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
    module.add_function(wrap_pyfunction!(exact_norm, module)?)?;
    module.add_function(wrap_pyfunction!(exact_is_finite, module)?)
}
