use nalgebra::Vector3;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::observe as core;

use crate::errors::{named, raise};
use crate::observe::{Camera, side_px};
use crate::pose::{Pose, read_rows, rows};

/// A camera with a lens that may bend straight lines: pinhole, brown_conrady or kannala_brandt.
///
/// x points right, y down, z forward along the axis; pixel (0, 0) is the centre of the top-left
/// pixel.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct Lens(core::Lens);

impl Lens {
    pub fn core(&self) -> &core::Lens {
        &self.0
    }
}

#[pymethods]
impl Lens {
    /// Makes a lens of (width, height), (fx, fy) and (cx, cy), all in pixels, and the coefficients
    /// of its model in OpenCV's order; raises CameraError.
    #[new]
    #[pyo3(signature = (*, model, size_px, focal_px, center_px, distortion = Vec::new()))]
    fn new(
        model: &str,
        size_px: (i64, i64),
        focal_px: [f64; 2],
        center_px: [f64; 2],
        distortion: Vec<f64>,
    ) -> PyResult<Self> {
        let distortion = core::Distortion::from_name(model, &distortion).map_err(raise)?;
        core::Lens::new(side_px(size_px), focal_px, center_px, distortion).map(Self).map_err(raise)
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

    /// Angle off the axis below which the lens sees.
    #[getter]
    fn limit(&self) -> f64 {
        self.0.limit()
    }

    /// Projects points in the lens's frame, (N, 3) float64, to pixels, (N, 2) float64; NaN for
    /// points beyond the limit.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points_in_lens: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = read_rows::<_, 3>(&points_in_lens, "points_in_lens")?;
        let pixel = |p: &[f64; 3]| {
            self.0.project(&Vector3::from(*p)).map_or([f64::NAN; 2], <[f64; 2]>::from)
        };
        let pixels = py.detach(|| points.iter().flat_map(pixel).collect::<Vec<_>>());
        Ok(rows(py, &pixels, 2))
    }

    /// Gives the directions in which pixels, (N, 2) float64, are seen: (N, 3) float64 of length 1;
    /// NaN where the lens sees nothing.
    fn rays<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixels = read_rows::<_, 2>(&pixels, "pixels")?;
        let ray = |&p: &[f64; 2]| self.0.ray(p).map_or([f64::NAN; 3], <[f64; 3]>::from);
        let rays = py.detach(|| pixels.iter().flat_map(ray).collect::<Vec<_>>());
        Ok(rows(py, &rays, 3))
    }

    /// Gives where the lens's image holds what each pixel of an ideal camera at the same place
    /// sees: (H, W, 2) float32 as (u, v), -10000 twice where it does not hold it; raises
    /// CameraError if lens_from_camera is more than a rotation.
    fn map_to<'py>(
        &self,
        py: Python<'py>,
        camera: Camera,
        lens_from_camera: Pose,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let moved = lens_from_camera.0.translation();
        if moved.norm() > 0.0 {
            let message = format!(
                "an ideal camera stands where its lens does, but lens_from_camera moves by {:?}; \
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
        format!(
            "Lens(model='{}', size_px={:?}, focal_px={:?}, center_px={:?}, distortion={:?})",
            self.model(),
            self.size_px(),
            self.focal_px(),
            self.center_px(),
            self.0.distortion().coefficients()
        )
    }
}
