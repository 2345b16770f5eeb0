use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::fitness::Margin;
use servoid::model as core;

use crate::camera::GivenView;
use crate::errors::{named, raise};
use crate::model::{Step, borrow};
use crate::pose::read_poses;
use crate::relay::relay;
use crate::settings::Settings;
use crate::shape::Body;
use crate::taking::{hashed_by_seed, remade, replace, taken_in_words, valued, written};

const SETTINGS: Settings = Settings("ModelError");

/// Settings of the paper's own method; their defaults are those of the core.
///
/// Arguments that are None keep their defaults.
#[pyclass(frozen, eq, hash, module = "servoid.model")]
#[derive(Clone, PartialEq)]
pub struct PaperSettings(core::PaperSettings);

taken_in_words!(
    PaperSettings,
    "ModelError",
    "a PaperSettings",
    "make one with servoid.model.PaperSettings"
);

const NAMES: [&str; 9] = [
    "max_ellipsoids",
    "delta",
    "seed",
    "threads",
    "points",
    "alpha",
    "alpha_m",
    "population",
    "generations",
];

hashed_by_seed!(PaperSettings);

#[pymethods]
impl PaperSettings {
    #[new]
    #[pyo3(signature = (*, max_ellipsoids=None, delta=None, seed=None, threads=None, points=None,
        alpha=None, alpha_m=None, population=None, generations=None))]
    #[allow(clippy::too_many_arguments, reason = "all of them are named")]
    fn new(
        max_ellipsoids: Option<&Bound<'_, PyAny>>,
        delta: Option<&Bound<'_, PyAny>>,
        seed: Option<&Bound<'_, PyAny>>,
        threads: Option<&Bound<'_, PyAny>>,
        points: Option<&Bound<'_, PyAny>>,
        alpha: Option<&Bound<'_, PyAny>>,
        alpha_m: Option<&Bound<'_, PyAny>>,
        population: Option<&Bound<'_, PyAny>>,
        generations: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let alpha = SETTINGS.read("alpha", alpha)?;
        let alpha_m = SETTINGS.read("alpha_m", alpha_m)?;
        let margin = match (alpha, alpha_m) {
            (Some(_), Some(_)) => {
                let message = "alpha is a share and alpha_m a length of the same margin: give one";
                return Err(named("ModelError", message.into()));
            }
            (share, metres) => share.map(Margin::Share).or(metres.map(Margin::Metres)),
        };
        let mut it = core::PaperSettings::default();
        SETTINGS.put(&mut it.max_ellipsoids, "max_ellipsoids", max_ellipsoids)?;
        SETTINGS.put(&mut it.delta, "delta", delta)?;
        SETTINGS.put(&mut it.seed, "seed", seed)?;
        SETTINGS.put(&mut it.threads, "threads", threads)?;
        SETTINGS.put(&mut it.points, "points", points)?;
        replace(&mut it.alpha, margin);
        SETTINGS.put(&mut it.generations, "generations", generations)?;
        SETTINGS.put(&mut it.search.population, "population", population)?;
        it.checked().map(Self).map_err(raise)
    }

    /// Most ellipsoids.
    #[getter]
    fn max_ellipsoids(&self) -> usize {
        self.0.max_ellipsoids
    }

    /// Least gain in F for which another ellipsoid is kept.
    #[getter]
    fn delta(&self) -> f64 {
        self.0.delta
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

    /// Points on each surface, and on each envelope.
    #[getter]
    fn points(&self) -> usize {
        self.0.points
    }

    /// Margin of the envelopes as a share of each ellipsoid's smallest radius; None if it is a
    /// length.
    #[getter]
    fn alpha(&self) -> Option<f64> {
        match self.0.alpha {
            Margin::Share(share) => Some(share),
            Margin::Metres(_) => None,
        }
    }

    /// Margin of the envelopes in metres, one for all ellipsoids; None if it is a share.
    #[getter]
    fn alpha_m(&self) -> Option<f64> {
        match self.0.alpha {
            Margin::Share(_) => None,
            Margin::Metres(metres) => Some(metres),
        }
    }

    /// Individuals per generation.
    #[getter]
    fn population(&self) -> usize {
        self.0.search.population
    }

    /// Generations for each ellipsoid.
    #[getter]
    fn generations(&self) -> usize {
        self.0.generations
    }

    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        written(slf, &NAMES)
    }

    fn __reduce__<'py>(
        slf: &Bound<'py, Self>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        remade(slf, &valued(slf, &NAMES)?)
    }
}

/// Models from the views by the paper's own method, with the mask of each as the pixels where the
/// hue matches; returns one step for each number of ellipsoids. `progress` is called with the
/// number of ellipsoids, F and the share of the work that is done; an exception that it raises ends
/// the work. Raises ModelError.
#[pyfunction]
#[pyo3(signature = (views, settings, progress=None))]
pub fn fit_paper(
    py: Python<'_>,
    views: Vec<GivenView<'_>>,
    settings: PaperSettings,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Step>> {
    let views = borrow(&views)?;
    let fit = |report: core::Progress<'_>| core::paper(&views, &settings.0, report);
    Ok(relay(py, progress.as_ref(), fit)?.into_iter().map(Step).collect())
}

/// Scores a body at poses by the paper's fitness, with the mask of each view as the pixels where
/// the hue matches: poses (N, 7) float64, world_from_object as (w, x, y, z, tx, ty, tz), scores
/// (N,) float64. Of the settings only points, alpha and threads matter. Raises ModelError,
/// PoseError.
#[pyfunction]
#[pyo3(signature = (views, body, poses, settings))]
#[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
pub fn paper_scores<'py>(
    py: Python<'py>,
    views: Vec<GivenView<'py>>,
    body: Body,
    poses: &Bound<'py, PyAny>,
    settings: PaperSettings,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let views = borrow(&views)?;
    let poses = read_poses(poses)?;
    let scores = py.detach(|| core::paper_scores(&views, &body.0, &poses, &settings.0));
    Ok(PyArray1::from_vec(py, scores.map_err(raise)?))
}
