use std::hash::{Hash, Hasher};

use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::camera as core;

use crate::camera::{CENTER, Camera, FOCAL, read_distortion, read_matrix};
use crate::errors::{named, raise};
use crate::pose::{Pose, rows};
use crate::taking::{
    Wanted, hash_numbers, read_numbers, read_rows, read_size, remade, shorts, taken_in_words,
    valued,
};

/// A camera with a lens that may have distortion: pinhole, brown_conrady or kannala_brandt.
///
/// It is constructed from (width, height), (fx, fy) and (cx, cy), all in pixels, and the
/// coefficients of its model in OpenCV's order; CameraError is raised if they do not make a lens.
/// `Lens.from_matrix` takes OpenCV's K.
///
/// x points right, y down, z forward along the axis; pixel (0, 0) is the centre of the top-left
/// pixel.
#[pyclass(frozen, eq, hash, module = "servoid.camera")]
#[derive(Clone, PartialEq)]
pub struct Lens(core::Lens);

taken_in_words!(
    Lens,
    "CameraError",
    "a lens",
    "make one with servoid.camera.Lens(model=, size_px=, focal_px=, center_px=) or Lens.from_matrix"
);

impl Lens {
    pub fn core(&self) -> &core::Lens {
        &self.0
    }
}

impl Hash for Lens {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let camera = self.0.camera();
        (self.model(), camera.size_px()).hash(state);
        hash_numbers(&camera.focal_px(), state);
        hash_numbers(&camera.center_px(), state);
        hash_numbers(self.0.distortion().coefficients(), state);
    }
}

const POINTS: Wanted = Wanted {
    name: "points_in_lens",
    what: "numbers of shape (N, 3), in metres",
    class: "CameraError",
};

const PIXELS: Wanted =
    Wanted { name: "pixels", what: "numbers of shape (N, 2), in pixels", class: "CameraError" };

#[pymethods]
impl Lens {
    #[new]
    #[pyo3(signature = (*, model, size_px, focal_px, center_px, distortion = None))]
    fn new(
        model: &str,
        size_px: &Bound<'_, PyAny>,
        focal_px: &Bound<'_, PyAny>,
        center_px: &Bound<'_, PyAny>,
        distortion: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let coefficients = read_distortion(distortion)?;
        let distortion = core::Distortion::from_name(model, &coefficients).map_err(raise)?;
        let (focal, center) = (read_numbers(focal_px, FOCAL)?, read_numbers(center_px, CENTER)?);
        core::Lens::new(read_size(size_px)?, focal, center, distortion).map(Self).map_err(raise)
    }

    /// Makes a lens of OpenCV's matrix K, (3, 3), (width, height) in pixels and the distortion that
    /// `cv2.calibrateCamera` returns: none, 4, 5 or 8 coefficients, or more if the rest are zeros;
    /// with `fisheye` the 4 of `cv2.fisheye.calibrate`. Raises CameraError.
    #[staticmethod]
    #[pyo3(signature = (matrix, size_px, distortion=None, *, fisheye=false))]
    fn from_matrix(
        matrix: &Bound<'_, PyAny>,
        size_px: &Bound<'_, PyAny>,
        distortion: Option<&Bound<'_, PyAny>>,
        fisheye: bool,
    ) -> PyResult<Self> {
        let (focal, center) = read_matrix(matrix)?;
        let mut coefficients = read_distortion(distortion)?;
        if matches!(coefficients.len(), 12 | 14) && coefficients[8..].iter().all(|&k| k == 0.0) {
            coefficients.truncate(8);
        }
        let model = match (fisheye, coefficients.is_empty()) {
            (true, _) => "kannala_brandt",
            (false, true) => "pinhole",
            (false, false) => "brown_conrady",
        };
        let distortion = core::Distortion::from_name(model, &coefficients).map_err(raise)?;
        core::Lens::new(read_size(size_px)?, focal, center, distortion).map(Self).map_err(raise)
    }

    /// Returns OpenCV's matrix K, (3, 3) float64.
    fn matrix<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.camera().matrix().transpose().as_slice(), 3)
    }

    /// Name of the model.
    #[getter]
    fn model(&self) -> &'static str {
        self.0.distortion().name()
    }

    /// (width, height) in pixels.
    #[getter]
    fn size_px(&self) -> (usize, usize) {
        self.0.camera().size_px().into()
    }

    /// (fx, fy) in pixels.
    #[getter]
    fn focal_px(&self) -> (f64, f64) {
        self.0.camera().focal_px().into()
    }

    /// Principal point (cx, cy) in pixels.
    #[getter]
    fn center_px(&self) -> (f64, f64) {
        self.0.camera().center_px().into()
    }

    /// Coefficients of the model: none, 8 or 4.
    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.distortion().coefficients())
    }

    /// Angle off the axis, in radians, up to which the lens sees.
    #[getter]
    fn limit(&self) -> f64 {
        self.0.limit()
    }

    /// Projects points in the lens's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
    /// points beyond the limit.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points_in_lens: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = read_rows::<3>(points_in_lens, POINTS)?;
        let pixel = |p: &[f64; 3]| {
            self.0.project(&Vector3::from(*p)).map_or([f64::NAN; 2], <[f64; 2]>::from)
        };
        let pixels = py.detach(|| points.iter().flat_map(pixel).collect::<Vec<_>>());
        Ok(rows(py, &pixels, 2))
    }

    /// Returns the directions in which pixels, (N, 2) float64, are seen: (N, 3) float64 of length
    /// 1; NaN where the lens sees nothing.
    fn rays<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixels = read_rows::<2>(pixels, PIXELS)?;
        let ray = |&p: &[f64; 2]| self.0.ray(p).map_or([f64::NAN; 3], <[f64; 3]>::from);
        let rays = py.detach(|| pixels.iter().flat_map(ray).collect::<Vec<_>>());
        Ok(rows(py, &rays, 3))
    }

    /// Returns, for each pixel of an ideal camera at the same position, where the lens's image
    /// shows the same direction: (H, W, 2) float32 as (u, v), -10000 twice where the image does not
    /// contain it; raises CameraError if lens_from_camera is more than a rotation.
    fn map_to<'py>(
        &self,
        py: Python<'py>,
        camera: Camera,
        lens_from_camera: Pose,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let moved = lens_from_camera.0.translation();
        if moved.norm() > 0.0 {
            let message = format!(
                "an ideal camera is at the position of its lens, but lens_from_camera moves by {:?}; \
                 give a rotation",
                <[f64; 3]>::from(moved)
            );
            return Err(named("CameraError", message));
        }
        let map = py.detach(|| self.0.map_to(&camera.0, &lens_from_camera.0.rotation()));
        let [width, height] = camera.0.size_px();
        PyArray1::from_vec(py, map.into_flattened()).reshape([height, width, 2])
    }

    fn __repr__(&self) -> String {
        let camera = self.0.camera();
        format!(
            "Lens(model='{}', size_px={:?}, focal_px={}, center_px={}, distortion={})",
            self.model(),
            self.size_px(),
            shorts(&camera.focal_px()),
            shorts(&camera.center_px()),
            shorts(self.0.distortion().coefficients())
        )
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let names = ["model", "size_px", "focal_px", "center_px", "distortion"];
        remade(slf, &valued(slf, &names)?)
    }
}
