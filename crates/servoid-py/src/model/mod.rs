pub(crate) mod paper;

use std::hash::{Hash, Hasher};

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyTuple, PyType};
use servoid::fitness::RangeSample;
use servoid::model as core;

use crate::camera::{Camera, GivenView, Pixels, View};
use crate::errors::raise;
use crate::given_images::Picture;
use crate::pose::Pose;
use crate::relay::relay;
use crate::settings::Settings;
use crate::shape::{Body, Mesh};
use crate::taking::{
    Wanted, hashed_by_seed, read_rows, remade, short, taken_in_words, valued, written,
};

const SETTINGS: Settings = Settings("ModelError");

/// Settings of modelling; their defaults are those of the core.
///
/// Arguments that are None keep their defaults; `quick` searches less, for a body that is only an
/// intermediate step.
#[pyclass(frozen, eq, hash, module = "servoid.model")]
#[derive(Clone, PartialEq)]
pub struct ModelSettings(core::Settings);

taken_in_words!(
    ModelSettings,
    "ModelError",
    "a ModelSettings",
    "make one with servoid.model.ModelSettings"
);

const MODEL_NAMES: [&str; 5] = ["max_ellipsoids", "delta", "held_out", "seed", "threads"];

hashed_by_seed!(ModelSettings);

#[pymethods]
impl ModelSettings {
    /// Most worker threads.
    #[classattr]
    const MAX_THREADS: usize = core::Settings::MAX_THREADS;

    #[new]
    #[pyo3(signature = (*, max_ellipsoids=None, delta=None, held_out=None, seed=None, threads=None, quick=false))]
    fn new(
        max_ellipsoids: Option<&Bound<'_, PyAny>>,
        delta: Option<&Bound<'_, PyAny>>,
        held_out: Option<&Bound<'_, PyAny>>,
        seed: Option<&Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
        quick: bool,
    ) -> PyResult<Self> {
        let default = core::Settings::default();
        let default = if quick { default.quick() } else { default };
        let mut it = default;
        SETTINGS.put(&mut it.max_ellipsoids, "max_ellipsoids", max_ellipsoids)?;
        SETTINGS.put(&mut it.delta, "delta", delta)?;
        SETTINGS.put(&mut it.held_out, "held_out", held_out)?;
        SETTINGS.put(&mut it.seed, "seed", seed)?;
        SETTINGS.put(&mut it.threads, "threads", threads)?;
        it.checked().map(Self).map_err(raise)
    }

    /// Most ellipsoids.
    #[getter]
    fn max_ellipsoids(&self) -> usize {
        self.0.max_ellipsoids
    }

    /// Least gain in F for which another ellipsoid is added; with 0 modelling continues to the
    /// maximum.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta
    }

    /// Whether a part of the evidence is held out to select the number of ellipsoids.
    #[getter]
    fn held_out(&self) -> bool {
        self.0.held_out
    }

    /// Seed of every search.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Worker threads; 0 uses as many as the machine has. The result does not depend on it.
    #[getter]
    fn threads(&self) -> usize {
        self.0.threads
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        written(slf, &MODEL_NAMES)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let settings = &slf.get().0;
        let usual = core::Settings::default().with(|it| {
            it.max_ellipsoids = settings.max_ellipsoids;
            it.delta = settings.delta;
            it.held_out = settings.held_out;
            it.seed = settings.seed;
            it.threads = settings.threads;
        });
        let mut values = valued(slf, &MODEL_NAMES)?;
        values.push(("quick", PyBool::new(slf.py(), *settings != usual).to_owned().into_any()));
        remade(slf, &values)
    }
}

/// The result of modelling with a given number of ellipsoids.
#[pyclass(frozen, eq, hash, module = "servoid.model")]
#[derive(PartialEq)]
pub struct Step(pub core::Step);

impl Hash for Step {
    fn hash<H: Hasher>(&self, state: &mut H) {
        Body(self.0.body.clone()).hash(state);
    }
}

#[pymethods]
impl Step {
    /// Number of ellipsoids.
    #[getter]
    fn count(&self) -> usize {
        self.0.body.ellipsoids().len()
    }

    /// F: the agreement with all evidence, at the resolution of the fit; for the paper's method,
    /// its own F.
    #[getter]
    fn fitness(&self) -> f64 {
        self.0.fitness
    }

    /// The body.
    #[getter]
    fn body(&self) -> Body {
        Body(self.0.body.clone())
    }

    fn __repr__(&self) -> String {
        format!("Step({} ellipsoids, fitness {})", self.count(), short(self.0.fitness))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Body, f64))> {
        let step = &slf.get().0;
        Ok((slf.getattr("_of_parts")?, (Body(step.body.clone()), step.fitness)))
    }

    /// Restores a step from its body and fitness.
    #[classmethod]
    fn _of_parts(_class: &Bound<'_, PyType>, body: Body, fitness: f64) -> Self {
        Self(core::Step { body: body.0, fitness })
    }
}

/// The evidence to model from: views, a closed mesh, and measured points of the surface.
///
/// It combines views; a mesh; measured points (N, 3) in metres with the directions (N, 3) in which
/// they were seen, float64, whose length is the distance of the eye, or short if only the direction
/// is known; and the weight of each kind, where None is the core's default. Raises BodyError.
#[pyclass(frozen, module = "servoid._native")]
pub struct ModelInput {
    views: Vec<Py<View>>,
    mesh: Option<servoid::shape::Mesh>,
    samples: Vec<RangeSample>,
    weights: core::Weights,
}

#[pymethods]
impl ModelInput {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "each is a keyword of its own in Python")]
    #[pyo3(signature = (*, views=None, mesh=None, points=None, directions=None, silhouette_weight=None, volume_weight=None, depth_weight=None))]
    fn new(
        views: Option<Vec<GivenView<'_>>>,
        mesh: Option<Mesh>,
        points: Option<&Bound<'_, PyAny>>,
        directions: Option<&Bound<'_, PyAny>>,
        silhouette_weight: Option<&Bound<'_, PyAny>>,
        volume_weight: Option<&Bound<'_, PyAny>>,
        depth_weight: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let samples = read_samples(points, directions)?;
        let mut weights = core::Weights::default();
        SETTINGS.put(&mut weights.silhouettes, "silhouette_weight", silhouette_weight)?;
        SETTINGS.put(&mut weights.volume, "volume_weight", volume_weight)?;
        SETTINGS.put(&mut weights.depth, "depth_weight", depth_weight)?;
        Ok(Self {
            views: views.unwrap_or_default().into_iter().map(|view| view.0.unbind()).collect(),
            mesh: mesh.map(|mesh| mesh.0),
            samples,
            weights,
        })
    }
}

/// Models an object from evidence; returns one step for each number of ellipsoids. `progress` is
/// called with the number of ellipsoids, F and the share of the work that is done; an exception
/// that it raises ends the work. Raises ModelError.
#[pyfunction]
#[pyo3(signature = (given, settings, progress=None))]
pub fn fit_body(
    py: Python<'_>,
    given: &ModelInput,
    settings: ModelSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Step>> {
    let views = given.views.iter().map(|view| view.get().core()).collect::<PyResult<Vec<_>>>()?;
    let fit = |report: core::Progress<'_>| {
        let given = core::ModelInput::default().with(|it| {
            it.views = &views;
            it.mesh = given.mesh.as_ref();
            it.samples = &given.samples;
            it.weights = given.weights;
        });
        core::progressive(&given, &settings.0, report)
    };
    Ok(relay(py, progress.as_ref(), fit)?.into_iter().map(Step).collect())
}

/// Computes an initial model from views with their images, which teach the object's colours, and
/// images in which the object is not marked: (camera, world_from_camera, image). Points (N, 3) of
/// its surface and the directions (N, 3) in which they were seen give its position, if present.
/// Raises ModelError.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "each is a keyword of its own in Python")]
#[pyo3(signature = (views, images, pictures, settings, points=None, directions=None))]
pub fn initial_body(
    py: Python<'_>,
    views: Vec<GivenView<'_>>,
    images: Vec<Picture<'_>>,
    pictures: Vec<(Camera, Pose, Picture<'_>)>,
    settings: ModelSettings,
    points: Option<&Bound<'_, PyAny>>,
    directions: Option<&Bound<'_, PyAny>>,
) -> PyResult<Body> {
    let views = borrow(&views)?;
    let pixels = images.iter().map(|image| Pixels::new(&image.0)).collect::<PyResult<Vec<_>>>()?;
    let marked = views.into_iter().zip(&pixels);
    let marked: Vec<_> =
        marked.map(|(view, image)| Ok((view, image.view()?))).collect::<PyResult<_>>()?;
    let others = pictures.iter().map(|picture| Pixels::new(&picture.2.0));
    let others = others.collect::<PyResult<Vec<_>>>()?;
    let unmasked = pictures.iter().zip(&others).map(|((camera, pose, _), image)| {
        let image = image.view()?;
        let unmasked = core::UnmaskedImage { camera: camera.0, world_from_camera: pose.0, image };
        unmasked.checked().map_err(raise)
    });
    let unmasked: Vec<_> = unmasked.collect::<PyResult<_>>()?;
    let samples = read_samples(points, directions)?;
    let found = py.detach(|| core::initial_body(&marked, &unmasked, &samples, &settings.0));
    found.map(Body).map_err(raise)
}

/// Shares by ellipsoid (K,), the share of the whole, and the direction to the unseen side.
type SeenSurface<'py> = (Bound<'py, PyArray1<f64>>, f64, Option<[f64; 3]>);

/// Returns the share of each ellipsoid's surface (K,) float64 that the views or the measured points
/// show, the share of the whole, and the direction in the object's frame to the side that they do
/// not show, None if there is none or it lies all around.
#[pyfunction]
#[pyo3(signature = (body, views, points=None, directions=None))]
pub fn surface_coverage<'py>(
    py: Python<'py>,
    body: Body,
    views: Vec<GivenView<'py>>,
    points: Option<&Bound<'_, PyAny>>,
    directions: Option<&Bound<'_, PyAny>>,
) -> PyResult<SeenSurface<'py>> {
    let views = borrow(&views)?;
    let samples = read_samples(points, directions)?;
    let found = py.detach(|| core::coverage(&body.0, &views, &samples));
    Ok((PyArray1::from_vec(py, found.by_ellipsoid), found.share, found.unseen_toward))
}

fn read_samples(
    points: Option<&Bound<'_, PyAny>>,
    directions: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<RangeSample>> {
    let read = |given: Option<&Bound<'_, PyAny>>, name| {
        let what = "numbers of shape (N, 3), in metres";
        given.map_or_else(
            || Ok(Vec::new()),
            |given| read_rows::<3>(given, Wanted { name, what, class: "ModelError" }),
        )
    };
    RangeSample::join(&read(points, "points")?, &read(directions, "directions")?).map_err(raise)
}

/// Returns the intersection over union of the body's silhouette and the mask in each view, (V,)
/// float64.
#[pyfunction]
pub fn silhouette_ious<'py>(
    py: Python<'py>,
    body: Body,
    views: Vec<GivenView<'py>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let views = borrow(&views)?;
    let ious = py.detach(|| core::silhouette_ious(&body.0, &views));
    Ok(PyArray1::from_vec(py, ious))
}

/// Returns each ellipsoid's median colour over the images in which it is foremost, (K, 3) uint8.
#[pyfunction]
pub fn ellipsoid_colors<'py>(
    py: Python<'py>,
    body: Body,
    views: Vec<GivenView<'py>>,
    images: Vec<Picture<'py>>,
) -> PyResult<Bound<'py, PyArray2<u8>>> {
    let views = borrow(&views)?;
    let pixels = images.iter().map(|image| Pixels::new(&image.0)).collect::<PyResult<Vec<_>>>()?;
    let images = pixels.iter().map(Pixels::view).collect::<PyResult<Vec<_>>>()?;
    let colors = py.detach(|| core::ellipsoid_colors(&body.0, &views, &images)).map_err(raise)?;
    PyArray1::from_vec(py, colors.concat()).reshape([colors.len(), 3])
}

pub fn borrow<'a>(views: &'a [GivenView<'_>]) -> PyResult<Vec<servoid::camera::View<'a>>> {
    views.iter().map(|view| view.0.get().core()).collect()
}
