use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::track as core;

use crate::errors::raise;
use crate::settings::Settings;
use crate::taking::{hashed_by_seed, remade, replace, taken_in_words, valued, written};

const SETTINGS: Settings = Settings("TrackError");

/// Settings of tracking; their defaults are those of the core.
///
/// Arguments that are None keep their defaults.
#[pyclass(frozen, eq, hash, module = "servoid.track")]
#[derive(Clone, PartialEq)]
pub struct TrackSettings(pub core::TrackSettings);

taken_in_words!(
    TrackSettings,
    "TrackError",
    "a TrackSettings",
    "make one with servoid.track.TrackSettings"
);

const NAMES: [&str; 11] = [
    "seed",
    "population",
    "generations",
    "budget_s",
    "surface",
    "region",
    "local_colors",
    "adjust",
    "adjust_outlines",
    "depth_from_motion",
    "known_shape",
];

hashed_by_seed!(TrackSettings);

#[pymethods]
impl TrackSettings {
    #[new]
    #[allow(clippy::too_many_arguments, reason = "each is a keyword of its own in Python")]
    #[pyo3(signature = (*, seed=None, population=None, generations=None, budget_s=None, surface=None, region=None, local_colors=None, adjust=None, adjust_outlines=None, depth_from_motion=None, known_shape=None))]
    fn new(
        seed: Option<&Bound<'_, PyAny>>,
        population: Option<&Bound<'_, PyAny>>,
        generations: Option<&Bound<'_, PyAny>>,
        budget_s: Option<&Bound<'_, PyAny>>,
        surface: Option<&Bound<'_, PyAny>>,
        region: Option<&Bound<'_, PyAny>>,
        local_colors: Option<&Bound<'_, PyAny>>,
        adjust: Option<&Bound<'_, PyAny>>,
        adjust_outlines: Option<&Bound<'_, PyAny>>,
        depth_from_motion: Option<&Bound<'_, PyAny>>,
        known_shape: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let mut it = core::TrackSettings::default();
        SETTINGS.put(&mut it.seed, "seed", seed)?;
        SETTINGS.put(&mut it.population, "population", population)?;
        SETTINGS.put(&mut it.generations, "generations", generations)?;
        replace(&mut it.budget_s, SETTINGS.read("budget_s", budget_s)?.map(Some));
        SETTINGS.put(&mut it.surface, "surface", surface)?;
        SETTINGS.put(&mut it.region, "region", region)?;
        SETTINGS.put(&mut it.local_colors, "local_colors", local_colors)?;
        SETTINGS.put(&mut it.adjust, "adjust", adjust)?;
        SETTINGS.put(&mut it.adjust_outlines, "adjust_outlines", adjust_outlines)?;
        SETTINGS.put(&mut it.depth_from_motion, "depth_from_motion", depth_from_motion)?;
        SETTINGS.put(&mut it.known_shape, "known_shape", known_shape)?;
        it.checked().map(Self).map_err(raise)
    }

    /// Seed of every search.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Hypotheses per generation.
    #[getter]
    fn population(&self) -> usize {
        self.0.population
    }

    /// Generations per image.
    #[getter]
    fn generations(&self) -> usize {
        self.0.generations
    }

    /// Seconds after which no further generation starts, nor a search beside a proved pose; with None
    /// only the counts decide.
    #[getter]
    fn budget_s(&self) -> Option<f64> {
        self.0.budget_s
    }

    /// Whether surface points are learned and scored.
    #[getter]
    fn surface(&self) -> bool {
        self.0.surface
    }

    /// Whether colours are learned and scored.
    #[getter]
    fn region(&self) -> bool {
        self.0.region
    }

    /// Whether the background's colours are learned separately for the sides of the object.
    #[getter]
    fn local_colors(&self) -> bool {
        self.0.local_colors
    }

    /// Whether keyframes and surface points are adjusted together, in a separate thread.
    #[getter]
    fn adjust(&self) -> bool {
        self.0.adjust
    }

    /// Whether the outlines of an object without print adjust its body and its keyframes.
    #[getter]
    fn adjust_outlines(&self) -> bool {
        self.0.adjust_outlines
    }

    /// Whether the distances of points that only one camera sees are estimated from motion.
    #[getter]
    fn depth_from_motion(&self) -> bool {
        self.0.depth_from_motion
    }

    /// Whether the body has the object's shape on all sides, as one made from a mesh has.
    #[getter]
    fn known_shape(&self) -> bool {
        self.0.known_shape
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
