//! Converts Python arguments: arrays of any numeric type, lists, a single item for a list of one.
//! Invalid arguments raise an error of servoid that describes them.

use numpy::{PyArrayDescrMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyInt, PyList, PyString, PyTuple};
use servoid::words::Digits;

use crate::errors::named;

/// Name of an argument, its valid values, and the class of the error for others.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub name: &'static str,
    pub what: &'static str,
    pub class: &'static str,
}

impl Wanted {
    /// Makes the error for an invalid value.
    pub fn refuse(&self, given: &Bound<'_, PyAny>) -> PyErr {
        let Self { name, what, class } = self;
        named(class, format!("{name} must be {what}, but {} was given", described(given)))
    }
}

/// Overwrites a default if a value is given; None keeps it.
pub fn replace<T>(default: &mut T, given: Option<T>) {
    if let Some(given) = given {
        *default = given;
    }
}

/// Describes a Python value briefly.
pub fn described(given: &Bound<'_, PyAny>) -> String {
    let kind = given.get_type().name().map_or_else(|_| "an object".into(), |name| name.to_string());
    if let Ok(array) = given.cast::<PyUntypedArray>() {
        let shape: Vec<String> = array.shape().iter().map(ToString::to_string).collect();
        let comma = if shape.len() == 1 { "," } else { "" };
        return format!("an array ({}{comma}) of {}", shape.join(", "), array.dtype());
    }
    if given.is_none() {
        return "None".into();
    }
    if let Ok(items) = given.len().map(|count| format!("a {kind} of {count}"))
        && (given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>())
    {
        return items;
    }
    if let Ok(text) = given.cast::<PyString>() {
        let shown: String = text.to_string_lossy().chars().take(40).collect();
        return format!("'{shown}'");
    }
    if given.is_instance_of::<PyInt>() || given.is_instance_of::<PyFloat>() {
        return given.repr().map_or(kind, |shown| shown.to_string().chars().take(40).collect());
    }
    let vowel = kind.starts_with(['A', 'E', 'I', 'O', 'a', 'e', 'i', 'o', 'u']);
    format!("{} {kind}", if vowel { "an" } else { "a" })
}

/// Converts lists and arrays of any numeric type to an array of float64.
pub fn floats<'py>(
    given: &Bound<'py, PyAny>,
    wanted: Wanted,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    converted(given, wanted, "fiu", "float64")
}

fn converted<'py, T: numpy::Element>(
    given: &Bound<'py, PyAny>,
    wanted: Wanted,
    kinds: &str,
    kind: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    if let Ok(array) = given.extract() {
        return Ok(array);
    }
    let numpy = given.py().import("numpy")?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|_| wanted.refuse(given))?;
    let array = array.cast_into::<PyUntypedArray>().map_err(PyErr::from)?;
    // The items of an empty list have no type.
    if array.len() > 0 && !kinds.contains(char::from(array.dtype().kind())) {
        return Err(wanted.refuse(given));
    }
    array.call_method1("astype", (kind,))?.extract()
}

/// Reads an (N, K) array of numbers.
pub fn read_rows<const K: usize>(
    given: &Bound<'_, PyAny>,
    wanted: Wanted,
) -> PyResult<Vec<[f64; K]>> {
    rows_of(&floats(given, wanted)?, given, wanted)
}

/// Reads an (N, K) array of whole numbers.
pub fn read_index_rows<const K: usize>(
    given: &Bound<'_, PyAny>,
    wanted: Wanted,
) -> PyResult<Vec<[i64; K]>> {
    rows_of(&converted(given, wanted, "iu", "int64")?, given, wanted)
}

fn rows_of<T: Copy + numpy::Element, const K: usize>(
    array: &PyReadonlyArrayDyn<'_, T>,
    given: &Bound<'_, PyAny>,
    wanted: Wanted,
) -> PyResult<Vec<[T; K]>> {
    match *array.shape() {
        [0] => Ok(Vec::new()),
        [_, width] if width == K => {
            let array = array.as_array();
            Ok(array.rows().into_iter().map(|row| std::array::from_fn(|i| row[i])).collect())
        }
        _ => Err(wanted.refuse(given)),
    }
}

/// Reads K numbers, which may be a column or a row of a matrix.
pub fn read_numbers<const K: usize>(
    given: &Bound<'_, PyAny>,
    wanted: Wanted,
) -> PyResult<[f64; K]> {
    if let Some(numbers) = plain_numbers(given) {
        return Ok(numbers);
    }
    let array = floats(given, wanted)?;
    let lean = array.shape().iter().filter(|&&n| n != 1).count() <= 1;
    if !lean || array.len() != K {
        return Err(wanted.refuse(given));
    }
    let mut numbers = array.as_array().into_iter().copied().collect::<Vec<_>>().into_iter();
    Ok(std::array::from_fn(|_| numbers.next().unwrap_or(f64::NAN)))
}

/// Reads K numbers of a list or a tuple, ten times as fast as by an array; `None` if it is neither,
/// or has other items.
fn plain_numbers<const K: usize>(given: &Bound<'_, PyAny>) -> Option<[f64; K]> {
    let number = |item: Bound<'_, PyAny>| {
        if let Ok(number) = item.cast::<PyFloat>() {
            return Some(number.value());
        }
        // True and False are whole numbers, too, but no lengths.
        item.cast_exact::<PyInt>().ok()?.extract().ok()
    };
    let numbers: Vec<f64> = if let Ok(list) = given.cast::<PyList>() {
        list.iter().map(number).collect::<Option<_>>()?
    } else {
        given.cast::<PyTuple>().ok()?.iter().map(number).collect::<Option<_>>()?
    };
    numbers.try_into().ok()
}

/// Reads one number.
pub fn read_number(given: &Bound<'_, PyAny>, wanted: Wanted) -> PyResult<f64> {
    given.extract().map_err(|_| wanted.refuse(given))
}

/// Reads a whole number that is not negative.
pub fn read_whole(given: &Bound<'_, PyAny>, wanted: Wanted) -> PyResult<usize> {
    given.extract().map_err(|_| wanted.refuse(given))
}

/// The time of an observation.
pub struct Seconds(pub f64);

impl<'a, 'py> FromPyObject<'a, 'py> for Seconds {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let what = "a number of seconds";
        read_number(&given, Wanted { name: "time_s", what, class: "TrackError" }).map(Self)
    }
}

/// Reads (width, height); a negative side becomes zero, which the core rejects with a message.
pub fn read_size(given: &Bound<'_, PyAny>) -> PyResult<[usize; 2]> {
    let what = "(width, height) in whole pixels";
    let wanted = Wanted { name: "size_px", what, class: "CameraError" };
    let sides = read_numbers::<2>(given, wanted)?;
    if sides.iter().any(|side| side.fract() != 0.0) {
        return Err(wanted.refuse(given));
    }
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it saturates")]
    Ok(sides.map(|side| side.max(0.0) as usize))
}

/// Several items, or a single item instead of a list of one.
pub struct Listed<T>(pub Vec<T>);

impl<T> Default for Listed<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'a, 'py, T: FromPyObjectOwned<'py>> FromPyObject<'a, 'py> for Listed<T> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if !given.is_instance_of::<PyList>() && !given.is_instance_of::<PyTuple>() {
            let one = T::extract(given).map_err(Into::into);
            // An array whose first axis counts images is a list of them.
            let several = given.cast::<PyUntypedArray>().map_or(true, |array| array.ndim() > 3);
            match one {
                Err(_) if several && given.try_iter().is_ok() => {}
                one => return Ok(Self(vec![one?])),
            }
        }
        let take = |item: PyResult<Bound<'py, PyAny>>| item?.extract::<T>().map_err(Into::into);
        given.try_iter()?.map(take).collect::<PyResult<_>>().map(Self)
    }
}

/// Rejects a value of another class than required, with a message how to make the right one.
pub fn other_class(given: &Bound<'_, PyAny>, needed: &str, error: &str, cure: &str) -> PyErr {
    named(error, format!("{needed} is needed, but {} was given; {cure}", described(given)))
}

/// Implements conversion from Python for a class, with an error that describes other values.
macro_rules! taken_in_words {
    ($class:ty, $error:literal, $needed:literal, $cure:literal) => {
        impl<'a, 'py> pyo3::FromPyObject<'a, 'py> for $class {
            type Error = pyo3::PyErr;

            fn extract(given: pyo3::Borrowed<'a, 'py, pyo3::PyAny>) -> pyo3::PyResult<Self> {
                match given.cast::<Self>() {
                    Ok(found) => Ok(found.get().clone()),
                    Err(_) => Err($crate::taking::other_class(&given, $needed, $error, $cure)),
                }
            }
        }
    };
}
pub(crate) use taken_in_words;

/// Hashes settings by their seed: equal settings have equal hashes.
macro_rules! hashed_by_seed {
    ($class:ty) => {
        impl std::hash::Hash for $class {
            fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
                self.0.seed.hash(state);
            }
        }
    };
}
pub(crate) use hashed_by_seed;

/// Formats a number with at most six digits, as `format(x, ".6g")` does in Python.
pub fn short(x: f64) -> String {
    // Adding 0.0 turns -0.0 into 0.0.
    let text = Digits(x + 0.0).to_string();
    match text.split_once('e').map(|(digits, power)| (digits, power.parse::<i32>())) {
        Some((digits, Ok(power))) => format!("{digits}e{power:+03}"),
        _ => text.to_lowercase(),
    }
}

/// Formats numbers as a tuple, each with at most six digits.
pub fn shorts(numbers: &[f64]) -> String {
    let parts: Vec<_> = numbers.iter().map(|&x| short(x)).collect();
    format!("({})", parts.join(", "))
}

/// Feeds numbers to a hasher so that equal ones, including 0.0 and -0.0, give the same hash.
pub fn hash_numbers(numbers: &[f64], state: &mut impl std::hash::Hasher) {
    for number in numbers {
        // Adding 0.0 turns -0.0 into 0.0.
        state.write_u64((number + 0.0).to_bits());
    }
}

/// Reads members of an object, each with its name.
pub fn valued<'py, 'a, T>(
    of: &Bound<'py, T>,
    names: &[&'a str],
) -> PyResult<Vec<(&'a str, Bound<'py, PyAny>)>> {
    let of = of.as_any();
    names.iter().map(|&name| of.getattr(name).map(|value| (name, value))).collect()
}

/// Formats an object as its class with the values of members.
pub fn written<T>(of: &Bound<'_, T>, names: &[&str]) -> PyResult<String> {
    let write = |(name, value): (&str, Bound<'_, PyAny>)| match value.cast::<PyFloat>() {
        Ok(number) => Ok(format!("{name}={}", short(number.value()))),
        Err(_) => value.repr().map(|text| format!("{name}={text}")),
    };
    let values: PyResult<Vec<_>> = valued(of, names)?.into_iter().map(write).collect();
    Ok(format!("{}({})", of.as_any().get_type().name()?, values?.join(", ")))
}

/// Returns what `pickle` and `copy` call to recreate an object: its class with these keywords.
pub fn remade<'py, T>(
    of: &Bound<'py, T>,
    keywords: &[(&str, Bound<'py, PyAny>)],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
    let py = of.py();
    let given = pyo3::types::PyDict::new(py);
    for (name, value) in keywords {
        given.set_item(name, value)?;
    }
    let partial = py.import("functools")?.getattr("partial")?;
    Ok((partial.call((of.as_any().get_type(),), Some(&given))?, PyTuple::empty(py)))
}
