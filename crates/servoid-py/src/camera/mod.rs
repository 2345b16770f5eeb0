pub(crate) mod lens;

use std::borrow::Cow;
use std::hash::{Hash, Hasher};

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::camera as core;

use crate::errors::{named, raise};
use crate::given_images::{GivenMask, Picture};
use crate::pose::{Pose, rows};
use crate::taking::{
    Wanted, described, floats, hash_numbers, other_class, read_number, read_numbers, read_rows,
    read_size, remade, shorts, taken_in_words, valued,
};

/// A pinhole camera: pixel (0, 0) is the centre of the top-left pixel.
///
/// It is constructed from (width, height), (fx, fy) and (cx, cy), all in pixels; CameraError is
/// raised if they do not make a camera. `Camera.from_matrix` takes OpenCV's K, `Camera.from_fov` an
/// angle of view.
#[pyclass(frozen, eq, hash, module = "servoid.camera")]
#[derive(Clone, PartialEq)]
pub struct Camera(pub core::Camera);

taken_in_words!(
    Camera,
    "CameraError",
    "a camera",
    "make one with servoid.camera.Camera(size_px=, focal_px=, center_px=) or Camera.from_matrix; \
     the pinhole of a lens with distortion is servoid.camera.undistortion(lens).camera"
);

impl Hash for Camera {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.0.size_px().hash(state);
        hash_numbers(&self.0.focal_px(), state);
        hash_numbers(&self.0.center_px(), state);
    }
}

const fn wanted(name: &'static str, what: &'static str) -> Wanted {
    Wanted { name, what, class: "CameraError" }
}

pub const FOCAL: Wanted = wanted("focal_px", "2 numbers (fx, fy) in pixels");
pub const CENTER: Wanted = wanted("center_px", "2 numbers (cx, cy) in pixels");

/// Makes a camera whose focal lengths can be in pixels.
fn made(size_px: &Bound<'_, PyAny>, focal: [f64; 2], center: [f64; 2]) -> PyResult<Camera> {
    let camera = core::Camera::new(read_size(size_px)?, focal, center);
    camera.and_then(core::Camera::in_pixels).map(Camera).map_err(raise)
}

#[pymethods]
impl Camera {
    /// Most pixels along a side.
    #[classattr]
    const MAX_SIDE_PX: usize = core::Camera::MAX_SIDE_PX;

    #[new]
    #[pyo3(signature = (*, size_px, focal_px, center_px))]
    fn new(
        size_px: &Bound<'_, PyAny>,
        focal_px: &Bound<'_, PyAny>,
        center_px: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (focal, center) = (read_numbers(focal_px, FOCAL)?, read_numbers(center_px, CENTER)?);
        made(size_px, focal, center)
    }

    /// Makes a camera of OpenCV's matrix K, (3, 3), and (width, height) in pixels. A camera has no
    /// distortion, so `distortion` must be zeros; `Lens.from_matrix` takes other values. Raises
    /// CameraError.
    #[staticmethod]
    #[pyo3(signature = (matrix, size_px, distortion=None))]
    fn from_matrix(
        matrix: &Bound<'_, PyAny>,
        size_px: &Bound<'_, PyAny>,
        distortion: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let (focal, center) = read_matrix(matrix)?;
        if let Some(&bent) = read_distortion(distortion)?.iter().find(|&&k| k != 0.0) {
            let message = format!(
                "a camera has no distortion, but a coefficient is {bent}; make a lens of it with \
                 servoid.camera.Lens.from_matrix(matrix, size_px, distortion)"
            );
            return Err(named("CameraError", message));
        }
        made(size_px, focal, center)
    }

    /// Makes a camera of (width, height) in pixels and the angle of view from the left to the right
    /// border of the image in degrees, 3 to 160. Its pixels are square and its principal point is
    /// the centre of the image. An angle of view from a data sheet is accurate to a few per cent,
    /// and so are all lengths that follow from it. Raises CameraError.
    #[staticmethod]
    fn from_fov(size_px: &Bound<'_, PyAny>, fov_deg: &Bound<'_, PyAny>) -> PyResult<Self> {
        let what = "a number of degrees";
        let wanted = Wanted { name: "fov_deg", what, class: "CameraError" };
        let fov_deg = read_number(fov_deg, wanted)?;
        core::Camera::from_fov(read_size(size_px)?, fov_deg).map(Self).map_err(raise)
    }

    /// Returns OpenCV's matrix K, (3, 3) float64.
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.matrix().transpose().as_slice(), 3)
    }

    /// (width, height) in pixels.
    #[getter]
    fn size_px(&self) -> (usize, usize) {
        self.0.size_px().into()
    }

    /// (fx, fy) in pixels.
    #[getter]
    fn focal_px(&self) -> (f64, f64) {
        self.0.focal_px().into()
    }

    /// Principal point (cx, cy) in pixels.
    #[getter]
    fn center_px(&self) -> (f64, f64) {
        self.0.center_px().into()
    }

    /// Projects points in the camera's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
    /// points that are not in front. Raises CameraError.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points_in_camera: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let wanted = wanted("points_in_camera", "numbers of shape (N, 3), in metres");
        let points = read_rows::<3>(points_in_camera, wanted)?;
        let pixel = |&p: &[f64; 3]| {
            self.0.project(&Vector3::from(p)).map_or([f64::NAN; 2], <[f64; 2]>::from)
        };
        Ok(rows(py, &points.iter().flat_map(pixel).collect::<Vec<_>>(), 2))
    }

    fn __repr__(&self) -> String {
        let (focal, center) = (shorts(&self.0.focal_px()), shorts(&self.0.center_px()));
        format!("Camera(size_px={:?}, focal_px={focal}, center_px={center})", self.size_px())
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        remade(slf, &valued(slf, &["size_px", "focal_px", "center_px"])?)
    }
}

/// Reads OpenCV's matrix K: (fx, fy) and (cx, cy).
pub fn read_matrix(given: &Bound<'_, PyAny>) -> PyResult<([f64; 2], [f64; 2])> {
    let what = "a 3x3 array of numbers, fx 0 cx, 0 fy cy, 0 0 1; of a 3x4 projection give the first \
                three columns";
    let rows = read_rows::<3>(given, wanted("the matrix of a camera", what))?;
    match *rows.as_slice() {
        [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]] => Ok(([fx, fy], [cx, cy])),
        [[_, skew, _], [under, _, _], last] => {
            let message = format!(
                "the matrix of a camera is fx 0 cx, 0 fy cy, 0 0 1, but this one has {skew} beside \
                 fx, {under} under it and {} below; calibrate without skew, and scale it so that \
                 its last number is 1",
                shorts(&last)
            );
            Err(named("CameraError", message))
        }
        _ => Err(named("CameraError", format!("K must be {what}, but is {}", described(given)))),
    }
}

/// Reads OpenCV's distortion coefficients, in a row, a column or a list.
pub fn read_distortion(given: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<f64>> {
    let wanted = wanted("distortion", "a row of numbers in OpenCV's order");
    let Some(given) = given else { return Ok(Vec::new()) };
    let array = floats(given, wanted)?;
    let lean = array.shape().iter().filter(|&&n| n != 1).count() <= 1;
    let numbers: Vec<f64> = array.as_array().iter().copied().collect();
    if lean { Ok(numbers) } else { Err(wanted.refuse(given)) }
}

/// Copies an array in the order of its rows.
fn row_by_row(array: &PyReadonlyArrayDyn<'_, u8>) -> PyResult<Vec<u8>> {
    let copy = array.call_method1("copy", ("C",))?;
    let copy: PyReadonlyArrayDyn<'_, u8> = copy.extract()?;
    Ok(copy.as_slice()?.to_vec())
}

/// One pixel of so many tells whether an image shows colours.
const LOOKED_AT: usize = 7;

/// The bytes of an image in a numpy array, which must not change while they are used.
#[derive(PartialEq)]
pub struct Pixels<'a> {
    data: Cow<'a, [u8]>,
    size_px: [usize; 2],
    channels: core::Channels,
}

impl<'a> Pixels<'a> {
    /// Borrows an (H, W) or (H, W, 3) uint8 array; an array with gaps is copied.
    pub fn new(array: &'a PyReadonlyArrayDyn<'_, u8>) -> PyResult<Self> {
        let (height, width, channels) = match *array.shape() {
            [height, width] => (height, width, core::Channels::Grey),
            [height, width, 3] => (height, width, core::Channels::Rgb),
            ref shape => {
                let message =
                    format!("an image has shape (H, W) or (H, W, 3), but this one has {shape:?}");
                return Err(named("ImageError", message));
            }
        };
        // An array that numpy calls contiguous may be stored column by column. numpy copies others
        // ten times as fast as an iteration over their elements does.
        let data = match array.as_slice() {
            Ok(bytes) if array.is_c_contiguous() => Cow::Borrowed(bytes),
            _ => Cow::Owned(row_by_row(array)?),
        };
        Ok(Self { data, size_px: [width, height], channels })
    }

    /// Returns an owned copy.
    fn into_owned(self) -> Pixels<'static> {
        let Self { data, size_px, channels } = self;
        Pixels { data: Cow::Owned(data.into_owned()), size_px, channels }
    }

    pub fn view(&self) -> PyResult<core::ImageView<'_>> {
        core::ImageView::new(&self.data, self.size_px, self.channels).map_err(raise)
    }

    /// Returns whether three channels differ in some of the pixels; none if there is only one.
    pub fn shows_color(&self) -> Option<bool> {
        let is_colored = |pixel: &[u8]| pixel[0] != pixel[1] || pixel[1] != pixel[2];
        let has_three = self.channels == core::Channels::Rgb;
        has_three.then(|| self.data.chunks_exact(3).step_by(LOOKED_AT).any(is_colored))
    }

    /// Returns the first of three channels as an image of grey levels.
    pub fn first_channel(self) -> Self {
        let data = Cow::Owned(self.data.iter().step_by(3).copied().collect());
        Self { data, size_px: self.size_px, channels: core::Channels::Grey }
    }
}

/// An image in which the object is marked: a camera, its pose, and a mask.
///
/// The mask is (H, W) of bool or whole numbers, not zero on the object. MaskError is raised if none
/// or all of its pixels are, ImageError if it does not have the camera's size.
#[pyclass(frozen, eq, hash, module = "servoid.capture")]
#[derive(PartialEq)]
pub struct View {
    camera: Camera,
    world_from_camera: Pose,
    mask: Pixels<'static>,
}

impl View {
    pub fn core(&self) -> PyResult<core::View<'_>> {
        let mask = core::Mask::new(self.mask.view()?).map_err(raise)?;
        core::View::new(self.camera.0, self.world_from_camera.0, mask).map_err(raise)
    }
}

impl Hash for View {
    fn hash<H: Hasher>(&self, state: &mut H) {
        (&self.camera, &self.world_from_camera, &self.mask.data).hash(state);
    }
}

/// A view from Python.
pub struct GivenView<'py>(pub Bound<'py, View>);

impl<'a, 'py> FromPyObject<'a, 'py> for GivenView<'py> {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let cure = "make one with servoid.capture.View(camera=, world_from_camera=, mask=)";
        match given.cast::<View>() {
            Ok(view) => Ok(Self(view.to_owned())),
            Err(_) => Err(other_class(&given, "a view", "ModelError", cure)),
        }
    }
}

#[pymethods]
impl View {
    #[new]
    #[pyo3(signature = (*, camera, world_from_camera, mask))]
    fn new(camera: Camera, world_from_camera: Pose, mask: GivenMask<'_>) -> PyResult<Self> {
        let marked = |mut pixels: Pixels<'static>| {
            pixels.data.to_mut().iter_mut().for_each(|byte| *byte = 255 * u8::from(*byte != 0));
            pixels
        };
        let mask = marked(Pixels::new(&mask.0)?.into_owned());
        let view = Self { camera, world_from_camera, mask };
        view.core()?;
        Ok(view)
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        self.camera.clone()
    }

    /// Its pose.
    #[getter]
    fn world_from_camera(&self) -> Pose {
        self.world_from_camera.clone()
    }

    /// The mask, (H, W) uint8: 255 on the object and 0 elsewhere.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<u8>>> {
        let [width, height] = self.mask.size_px;
        PyArray1::from_slice(py, &self.mask.data).reshape([height, width])
    }

    fn __repr__(&self) -> String {
        let covered = self.mask.data.iter().filter(|&&byte| byte != 0).count();
        let [width, height] = self.mask.size_px;
        let translation = shorts(self.world_from_camera.0.translation().as_slice());
        format!("View({width}x{height} pixels, {covered} on the object, from {translation})")
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        remade(slf, &valued(slf, &["camera", "world_from_camera", "mask"])?)
    }
}

/// Converts an image, (H, W) or (H, W, 3) uint8, to (H, W, 3); raises ImageError.
#[pyfunction]
pub fn taken_image<'py>(py: Python<'py>, image: Picture<'py>) -> PyResult<Bound<'py, PyAny>> {
    let array = image.0.as_any();
    if image.0.ndim() == 3 {
        return Ok(array.clone());
    }
    py.import("numpy")?.call_method1("stack", ((array, array, array), -1))
}

/// Converts a mask, (H, W) of bool or whole numbers, to uint8: 255 where it is not zero. Raises
/// MaskError.
#[pyfunction]
pub fn taken_mask<'py>(py: Python<'py>, mask: GivenMask<'py>) -> Bound<'py, PyArray2<u8>> {
    let (height, width) = (mask.0.shape()[0], mask.0.shape()[1]);
    let mask = mask.0.as_array();
    PyArray2::from_owned_array(
        py,
        numpy::ndarray::Array2::from_shape_fn((height, width), |(row, column)| {
            255 * u8::from(mask[[row, column]] != 0)
        }),
    )
}
