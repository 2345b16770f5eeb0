use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use servoid::model as core;

use crate::errors::raise;
use crate::observe::{Pixels, View};
use crate::shape::Body;

/// How modelling proceeds; every default is written in the core.
#[pyclass(frozen, module = "servoid", from_py_object)]
#[derive(Clone)]
pub struct ModelSettings(core::Settings);

#[pymethods]
impl ModelSettings {
    /// Takes the defaults, except where a value is given.
    #[new]
    #[pyo3(signature = (*, max_ellipsoids=None, delta=None, seed=None, threads=None))]
    fn new(
        max_ellipsoids: Option<usize>,
        delta: Option<f64>,
        seed: Option<u64>,
        threads: Option<usize>,
    ) -> Self {
        let default = core::Settings::default();
        Self(core::Settings {
            max_ellipsoids: max_ellipsoids.unwrap_or(default.max_ellipsoids),
            delta: delta.unwrap_or(default.delta),
            seed: seed.unwrap_or(default.seed),
            threads: threads.unwrap_or(default.threads),
            ..default
        })
    }

    /// Most ellipsoids.
    #[getter]
    fn max_ellipsoids(&self) -> usize {
        self.0.max_ellipsoids
    }

    /// Least gain in F for which another ellipsoid is added; 0 goes on to the maximum.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta
    }

    /// Seed of every search.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Worker threads; 0 takes as many as the machine has. The result does not depend on it.
    #[getter]
    fn threads(&self) -> usize {
        self.0.threads
    }
}

/// What modelling had reached with one count of ellipsoids.
#[pyclass(frozen, module = "servoid")]
pub struct Step(core::Step);

#[pymethods]
impl Step {
    /// Ellipsoids.
    #[getter]
    fn count(&self) -> usize {
        self.0.body.ellipsoids().len()
    }

    /// F: the mean silhouette overlap at the resolution of the fit.
    #[getter]
    fn fitness(&self) -> f64 {
        self.0.fitness
    }

    /// The body.
    #[getter]
    fn body(&self) -> Body {
        Body(self.0.body.clone())
    }
}

/// Models what the views show; gives one step for each count of ellipsoids. `progress` is called
/// with the count, F and the share of the work that is done; what it raises ends the work. Raises
/// ModelError.
#[pyfunction]
#[pyo3(signature = (views, settings, progress=None))]
pub fn fit_body(
    py: Python<'_>,
    views: Vec<Bound<'_, View>>,
    settings: ModelSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Step>> {
    let views = borrow(&views)?;
    let mut raised = None;
    let steps = py.detach(|| {
        let mut report = |count: usize, fitness: f64, share: f64| {
            let told = Python::attach(|py| {
                py.check_signals()?;
                progress.as_ref().map_or(Ok(()), |f| f.call1(py, (count, fitness, share)).map(drop))
            });
            raised = told.err();
            raised.is_none()
        };
        core::progressive(&views, &settings.0, &mut report)
    });
    match raised {
        Some(error) => Err(error),
        None => Ok(steps.map_err(raise)?.into_iter().map(Step).collect()),
    }
}

/// Gives the intersection over union of the body's silhouette and the mask in each view, (V,)
/// float64.
#[pyfunction]
pub fn silhouette_ious<'py>(
    py: Python<'py>,
    body: Body,
    views: Vec<Bound<'py, View>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let views = borrow(&views)?;
    let ious = py.detach(|| core::silhouette_ious(&body.0, &views));
    Ok(PyArray1::from_vec(py, ious))
}

/// Gives each ellipsoid's median colour over the images in which it is foremost, (K, 3) uint8.
#[pyfunction]
pub fn ellipsoid_colors<'py>(
    py: Python<'py>,
    body: Body,
    views: Vec<Bound<'py, View>>,
    images: Vec<PyReadonlyArrayDyn<'py, u8>>,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let views = borrow(&views)?;
    let pixels = images.iter().map(Pixels::new).collect::<PyResult<Vec<_>>>()?;
    let images = pixels.iter().map(Pixels::view).collect::<PyResult<Vec<_>>>()?;
    let colors = py.detach(|| core::ellipsoid_colors(&body.0, &views, &images)).map_err(raise)?;
    PyArray1::from_vec(py, colors.concat()).reshape([colors.len(), 3])
}

fn borrow<'a>(views: &'a [Bound<'_, View>]) -> PyResult<Vec<servoid::observe::View<'a>>> {
    views.iter().map(|view| view.get().core()).collect()
}
