//! Elementary functions and small linear algebra with the same bits on every processor.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use numpy::ndarray::ArrayViewD;
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArrayDyn,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyTuple};

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
        if self.columns == 0 || other.columns == 0 {
            let numbers = Cow::Owned(vec![0.0; self.rows * other.columns]);
            return Ok(Self { numbers, rows: self.rows, columns: other.columns, is_vector: false });
        }
        let (left, right) = (&self.numbers, &other.numbers);
        // The width in the type keeps the sums of a row in registers.
        let numbers = match other.columns {
            1 => sums::<1>(left, right, self.columns),
            3 => sums::<3>(left, right, self.columns),
            4 => sums::<4>(left, right, self.columns),
            6 => sums::<6>(left, right, self.columns),
            7 => sums::<7>(left, right, self.columns),
            12 => sums::<12>(left, right, self.columns),
            width => sums_of_any_width(left, right, self.columns, width),
        };
        let numbers = Cow::Owned(numbers);
        Ok(Self { numbers, rows: self.rows, columns: other.columns, is_vector: false })
    }
}

fn sums<const WIDTH: usize>(left: &[f64], right: &[f64], inner: usize) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(left.len() / inner * WIDTH);
    for factors in left.chunks_exact(inner) {
        let mut sums = [0.0; WIDTH];
        for (&factor, values) in factors.iter().zip(right.chunks_exact(WIDTH)) {
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        }
        numbers.extend(sums);
    }
    numbers
}

fn sums_of_any_width(left: &[f64], right: &[f64], inner: usize, width: usize) -> Vec<f64> {
    let mut numbers = vec![0.0; left.len() / inner * width];
    for (sums, factors) in numbers.chunks_exact_mut(width).zip(left.chunks_exact(inner)) {
        for (&factor, values) in factors.iter().zip(right.chunks_exact(width)) {
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        }
    }
    numbers
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
