//! Converts images and masks of Python; others raise an error that says how to convert them.

use numpy::{PyArrayDescrMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

use crate::errors::named;
use crate::taking::described;

/// An image from Python: (H, W) or (H, W, 3) uint8.
pub struct Picture<'py>(pub PyReadonlyArrayDyn<'py, u8>);

impl<'a, 'py> FromPyObject<'a, 'py> for Picture<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let Ok(array) = given.extract::<PyReadonlyArrayDyn<'py, u8>>() else {
            return Err(wrong_picture(&given));
        };
        if is_masked(&given) {
            return Err(masked("an image", &given, "ImageError"));
        }
        match *array.shape() {
            [_, _] | [_, _, 3] => Ok(Self(array)),
            _ => Err(wrong_picture(&given)),
        }
    }
}

fn wrong_picture(given: &Bound<'_, PyAny>) -> PyErr {
    let cure = given.cast::<PyUntypedArray>().map_or(
        "make an array of it with numpy.asarray(image, dtype=numpy.uint8)",
        |array| match (array.dtype().kind(), array.shape()) {
            (b'f', _) => {
                "say what its values mean: (255 * image).astype(numpy.uint8) if they go from 0 to 1"
            }
            (b'u' | b'i', _) if array.dtype().itemsize() > 1 => {
                "say what its values mean: (image >> 8).astype(numpy.uint8) if they have 16 bits, \
                 image.astype(numpy.uint8) if they go from 0 to 255"
            }
            (b'i', _) => {
                "say what its values mean: image.view(numpy.uint8) if they were 0 to 255 before \
                 they were cast, image.astype(numpy.uint8) if they go from 0 to 127"
            }
            (b'b', _) => "write image.astype(numpy.uint8) * 255",
            (kind, _) if kind != b'u' => {
                "make an array of numbers of it, with image.astype(numpy.uint8) if they go from 0 \
                 to 255"
            }
            (_, [3, _, _]) => "move its first axis to the end: image.transpose(1, 2, 0)",
            (_, [1, _, _]) => "leave its first axis out: image[0]",
            (_, [_, _, 4]) => "leave its transparency out: image[..., :3]",
            (_, [_, _, 1]) => "leave its last axis out: image[..., 0]",
            _ => "give one image for each camera",
        },
    );
    let message = format!(
        "an image must be (H, W) or (H, W, 3) of uint8, RGB, but {} was given; {cure}",
        described(given)
    );
    named("ImageError", message)
}

/// Returns whether an array is one of `numpy.ma`, some of whose values do not count.
pub fn is_masked(given: &Bound<'_, PyAny>) -> bool {
    let is_plain = given.get_type().is(given.py().get_type::<PyUntypedArray>());
    !is_plain && given.cast::<PyUntypedArray>().is_ok() && given.hasattr("mask").unwrap_or(false)
}

/// Makes the error for such an array.
pub fn masked(what: &str, given: &Bound<'_, PyAny>, class: &'static str) -> PyErr {
    let message = format!(
        "{what} must be a plain array, but {} with masked values was given; say what these are \
         with its method filled, such as filled(0)",
        described(given)
    );
    named(class, message)
}

/// A mask from Python: (H, W) of bool or of whole numbers, not zero on the object.
pub struct GivenMask<'py>(pub PyReadonlyArrayDyn<'py, u8>);

impl<'a, 'py> FromPyObject<'a, 'py> for GivenMask<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if is_masked(&given) {
            return Err(masked("a mask", &given, "MaskError"));
        }
        if let Ok(array) = given.extract::<PyReadonlyArrayDyn<'py, u8>>()
            && array.ndim() == 2
        {
            return Ok(Self(array));
        }
        let listed = given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>();
        let made = listed
            .then(|| given.py().import("numpy")?.call_method1("asarray", (given,)))
            .and_then(Result::ok);
        let whole = made.as_ref().unwrap_or(&given);
        let array = whole.cast::<PyUntypedArray>().ok().filter(|array| array.ndim() == 2);
        match array.map(|array| array.dtype().kind()) {
            Some(b'b' | b'u' | b'i') => {
                let marked = whole.call_method1("__ne__", (0,))?;
                Ok(Self(marked.call_method1("astype", ("uint8",))?.extract()?))
            }
            kind => Err(wrong_mask(&given, kind)),
        }
    }
}

fn wrong_mask(given: &Bound<'_, PyAny>, kind: Option<u8>) -> PyErr {
    let cure = match kind {
        Some(b'f') => "say from where on it is the object, such as mask > 0.5",
        _ => "make it of one channel, such as mask[..., 0] != 0",
    };
    let message = format!(
        "a mask must be (H, W) of bool or whole numbers, not zero on the object, but {} was given; \
         {cure}",
        described(given)
    );
    named("MaskError", message)
}
