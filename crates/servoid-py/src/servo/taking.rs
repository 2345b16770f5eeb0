use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;
use servoid::pose::exact::Rows;
use servoid::servo::Jacobian;

use crate::errors::raise;
use crate::taking::{Wanted, floats, read_numbers};

pub const fn wanted(name: &'static str, what: &'static str) -> Wanted {
    Wanted { name, what, class: "ServoError" }
}

/// Reads a twist.
pub fn read_twist(given: &Bound<'_, PyAny>) -> PyResult<[f64; 6]> {
    read_numbers(given, wanted("a twist", "6 numbers (linear, angular)"))
}

/// Reads a point or a direction.
pub fn read_vector(given: &Bound<'_, PyAny>, name: &'static str) -> PyResult<[f64; 3]> {
    read_numbers(given, wanted(name, "3 numbers (x, y, z)"))
}

/// Reads a row of any length.
pub fn read_row(given: &Bound<'_, PyAny>, name: &'static str) -> PyResult<Vec<f64>> {
    let wanted = wanted(name, "a row of numbers");
    let array = floats(given, wanted)?;
    if array.ndim() != 1 {
        return Err(wanted.refuse(given));
    }
    Ok(array.as_array().iter().copied().collect())
}

/// Reads a Jacobian (6, n).
pub fn read_jacobian(given: &Bound<'_, PyAny>) -> PyResult<Jacobian> {
    let wanted = wanted("a Jacobian", "numbers of shape (6, n)");
    let rows = read_matrix(given, wanted)?;
    if rows.columns == 0 || rows.count() != 6 {
        return Err(wanted.refuse(given));
    }
    Jacobian::new(rows).map_err(raise)
}

/// Reads a matrix.
pub fn read_matrix(given: &Bound<'_, PyAny>, wanted: Wanted) -> PyResult<Rows> {
    let array = floats(given, wanted)?;
    let &[_, columns] = array.shape() else { return Err(wanted.refuse(given)) };
    Ok(Rows { numbers: array.as_array().iter().copied().collect(), columns })
}
