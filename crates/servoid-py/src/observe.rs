use std::borrow::Cow;

use nalgebra::Vector3;
use numpy::{PyArray2, PyReadonlyArray2, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use servoid::observe as core;

use crate::errors::{named, raise};
use crate::pose::{Pose, read_rows, rows};

/// A pinhole camera: pixel (0, 0) is the centre of the top-left pixel.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct Camera(pub core::Camera);

#[pymethods]
impl Camera {
    /// Most pixels along a side.
    #[classattr]
    const MAX_SIDE_PX: usize = core::Camera::MAX_SIDE_PX;

    /// Makes a camera of (width, height), (fx, fy) and (cx, cy), all in pixels; raises CameraError.
    #[new]
    #[pyo3(signature = (*, size_px, focal_px, center_px))]
    fn new(size_px: (i64, i64), focal_px: [f64; 2], center_px: [f64; 2]) -> PyResult<Self> {
        core::Camera::new(side_px(size_px), focal_px, center_px).map(Self).map_err(raise)
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
    /// points that are not in front.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points_in_camera: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = read_rows::<_, 3>(&points_in_camera, "points_in_camera")?;
        let pixel = |&p: &[f64; 3]| {
            self.0.project(&Vector3::from(p)).map_or([f64::NAN; 2], <[f64; 2]>::from)
        };
        Ok(rows(py, &points.iter().flat_map(pixel).collect::<Vec<_>>(), 2))
    }

    fn __repr__(&self) -> String {
        let (size, focal, center) = (self.size_px(), self.focal_px(), self.center_px());
        format!("Camera(size_px={size:?}, focal_px={focal:?}, center_px={center:?})")
    }
}

/// Takes a size as Python gives it; a negative side becomes zero, which the core refuses in words.
pub fn side_px(size_px: (i64, i64)) -> [usize; 2] {
    [size_px.0, size_px.1].map(|n| usize::try_from(n).unwrap_or(0))
}

/// The bytes of an image in a numpy array, which nobody may change while they are looked at.
pub struct Pixels<'a> {
    data: Cow<'a, [u8]>,
    size_px: [usize; 2],
    channels: core::Channels,
}

impl<'a> Pixels<'a> {
    /// Looks at an (H, W) or (H, W, 3) uint8 array; one that has gaps is copied.
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
        // What numpy calls contiguous may lie column by column; iterating goes row by row.
        let data = match array.as_slice() {
            Ok(bytes) if array.is_c_contiguous() => Cow::Borrowed(bytes),
            _ => Cow::Owned(array.as_array().iter().copied().collect()),
        };
        Ok(Self { data, size_px: [width, height], channels })
    }

    /// Takes a copy that lives on.
    fn into_owned(self) -> Pixels<'static> {
        let Self { data, size_px, channels } = self;
        Pixels { data: Cow::Owned(data.into_owned()), size_px, channels }
    }

    pub fn view(&self) -> PyResult<core::ImageView<'_>> {
        core::ImageView::new(&self.data, self.size_px, self.channels).map_err(raise)
    }
}

/// One picture that says where the object is: a camera, its pose, and a mask.
#[pyclass(frozen, module = "servoid")]
pub struct View {
    camera: core::Camera,
    world_from_camera: servoid::pose::Pose,
    mask: Pixels<'static>,
}

impl View {
    pub fn core(&self) -> PyResult<core::View<'_>> {
        let mask = core::Mask::new(self.mask.view()?).map_err(raise)?;
        core::View::new(self.camera, self.world_from_camera, mask).map_err(raise)
    }
}

#[pymethods]
impl View {
    /// Joins a camera, its pose and a mask, (H, W) uint8, non-zero on the object; raises MaskError
    /// if none or all of its pixels are, ImageError if it has not the camera's size.
    #[new]
    #[pyo3(signature = (*, camera, world_from_camera, mask))]
    fn new(
        camera: Camera,
        world_from_camera: Pose,
        mask: PyReadonlyArrayDyn<'_, u8>,
    ) -> PyResult<Self> {
        let view = Self {
            camera: camera.0,
            world_from_camera: world_from_camera.0,
            mask: Pixels::new(&mask)?.into_owned(),
        };
        view.core()?;
        Ok(view)
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.camera)
    }

    /// Its pose.
    #[getter]
    fn world_from_camera(&self) -> Pose {
        Pose(self.world_from_camera)
    }
}
