use pyo3::prelude::*;
use pyo3::types::PyTuple;
use servoid::fitness::Margin;
use servoid::track as core;

use crate::camera::Camera;
use crate::errors::{named, raise};
use crate::held::Held;
use crate::pose::Pose;
use crate::settings::Settings;
use crate::shape::Body;
use crate::taking::{
    Listed, Seconds, Wanted, hashed_by_seed, read_numbers, remade, taken_in_words, valued, written,
};
use crate::track::estimate::Estimate;
use crate::track::{Masks, Pictures, mask, observation, read, read_masks};

const SETTINGS: Settings = Settings("TrackError");

/// Settings of tracking with the 1-step genetic algorithm; their defaults are those of the core.
///
/// Arguments that are None keep their defaults.
#[pyclass(frozen, eq, hash, module = "servoid._native")]
#[derive(Clone, PartialEq)]
pub struct OneStepSettings(core::OneStepSettings);

taken_in_words!(
    OneStepSettings,
    "TrackError",
    "a OneStepSettings",
    "make one with servoid._native.OneStepSettings"
);

const NAMES: [&str; 12] = [
    "seed",
    "turns",
    "region",
    "points",
    "alpha",
    "reach",
    "turn",
    "population",
    "elites",
    "mutation_rate",
    "mutation_width",
    "least_width",
];

hashed_by_seed!(OneStepSettings);

#[pymethods]
impl OneStepSettings {
    #[new]
    #[pyo3(signature = (*, seed=None, turns=None, region=None, points=None, alpha=None, reach=None,
        turn=None, population=None, elites=None, mutation_rate=None, mutation_width=None,
        least_width=None))]
    #[allow(clippy::too_many_arguments, reason = "all of them are named")]
    fn new(
        seed: Option<&Bound<'_, PyAny>>,
        turns: Option<&Bound<'_, PyAny>>,
        region: Option<&Bound<'_, PyAny>>,
        points: Option<&Bound<'_, PyAny>>,
        alpha: Option<&Bound<'_, PyAny>>,
        reach: Option<&Bound<'_, PyAny>>,
        turn: Option<&Bound<'_, PyAny>>,
        population: Option<&Bound<'_, PyAny>>,
        elites: Option<&Bound<'_, PyAny>>,
        mutation_rate: Option<&Bound<'_, PyAny>>,
        mutation_width: Option<&Bound<'_, PyAny>>,
        least_width: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let default = core::OneStepSettings::default();
        let region = SETTINGS.read("region", region)?;
        let points = SETTINGS.read("points", points)?;
        let alpha = SETTINGS.read("alpha", alpha)?;
        let objective = objective(default.objective, region, points, alpha)?;
        let genes = match SETTINGS.read("turns", turns)? {
            Some(true) => core::Genes::Pose,
            Some(false) => core::Genes::Place,
            None => default.genes,
        };
        let mut it = default;
        (it.genes, it.objective) = (genes, objective);
        SETTINGS.put(&mut it.seed, "seed", seed)?;
        SETTINGS.put(&mut it.reach, "reach", reach)?;
        SETTINGS.put(&mut it.turn, "turn", turn)?;
        SETTINGS.put(&mut it.search.population, "population", population)?;
        SETTINGS.put(&mut it.search.elites, "elites", elites)?;
        SETTINGS.put(&mut it.search.mutation_rate, "mutation_rate", mutation_rate)?;
        SETTINGS.put(&mut it.search.mutation_width, "mutation_width", mutation_width)?;
        SETTINGS.put(&mut it.search.least_width, "least_width", least_width)?;
        it.checked().map(Self).map_err(raise)
    }

    /// Seed of the search.
    #[getter]
    fn seed(&self) -> u64 {
        self.0.seed
    }

    /// Whether the orientation is estimated in addition to the position.
    #[getter]
    fn turns(&self) -> bool {
        self.0.genes == core::Genes::Pose
    }

    /// Whether whole areas are scored instead of the paper's points.
    #[getter]
    fn region(&self) -> bool {
        self.0.objective == core::Objective::Region
    }

    /// Points on each surface, and on each envelope; None if whole areas are scored.
    #[getter]
    fn points(&self) -> Option<usize> {
        match self.0.objective {
            core::Objective::Points { count, .. } => Some(count),
            _ => None,
        }
    }

    /// Margin of the envelopes as a share of each ellipsoid's smallest radius; None if whole areas
    /// are scored.
    #[getter]
    fn alpha(&self) -> Option<f64> {
        match self.0.objective {
            core::Objective::Points { alpha: Margin::Share(share), .. } => Some(share),
            _ => None,
        }
    }

    /// Search range around the last position, along each axis, in object sizes.
    #[getter]
    fn reach(&self) -> f64 {
        self.0.reach
    }

    /// Search range around the last orientation, about each axis, in radians.
    #[getter]
    fn turn(&self) -> f64 {
        self.0.turn
    }

    /// Individuals per generation.
    #[getter]
    fn population(&self) -> usize {
        self.0.search.population
    }

    /// Best individuals that survive unchanged.
    #[getter]
    fn elites(&self) -> usize {
        self.0.search.elites
    }

    /// Share of genes that mutate.
    #[getter]
    fn mutation_rate(&self) -> f64 {
        self.0.search.mutation_rate
    }

    /// Standard deviation of a mutation in the first generation, as a share of the gene's range.
    #[getter]
    fn mutation_width(&self) -> f64 {
        self.0.search.mutation_width
    }

    /// Standard deviation below which success never narrows a mutation, as the same share.
    #[getter]
    fn least_width(&self) -> f64 {
        self.0.search.least_width
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

fn objective(
    default: core::Objective,
    region: Option<bool>,
    points: Option<usize>,
    alpha: Option<f64>,
) -> PyResult<core::Objective> {
    let given = points.is_some() || alpha.is_some();
    match (region, default) {
        (Some(true), _) if given => {
            let message = "points and alpha belong to the paper's points, but region is true: \
                           give one or the other";
            Err(named("TrackError", message.into()))
        }
        (Some(true), _) => Ok(core::Objective::Region),
        (_, core::Objective::Points { count, alpha: margin }) => Ok(core::Objective::Points {
            count: points.unwrap_or(count),
            alpha: alpha.map_or(margin, Margin::Share),
        }),
        (_, other) => Ok(other),
    }
}

/// Tracks a body by one generation of a genetic algorithm per image, as the paper does.
///
/// It is constructed from the cameras, the body and the settings; raises TrackError, ImageError.
#[pyclass(frozen, module = "servoid._native")]
pub struct OneStepTracker(Held<core::OneStep>);

#[pymethods]
impl OneStepTracker {
    #[new]
    #[pyo3(signature = (cameras, body, settings=None))]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn new(
        cameras: Listed<Camera>,
        body: Body,
        settings: Option<OneStepSettings>,
    ) -> PyResult<Self> {
        let cameras: Vec<_> = cameras.0.iter().map(|camera| camera.0).collect();
        let settings = settings.map(|settings| settings.0).unwrap_or_default();
        let tracker = core::OneStep::new(&cameras, &body.0, settings).map_err(raise)?;
        Ok(Self(Held::new(tracker)))
    }

    /// Starts with the object at a known pose, and learns its colours from masks, (H, W) uint8, or
    /// from the body's outline where there is none. Images are (H, W) or (H, W, 3) uint8, None
    /// where a camera delivered nothing. Raises TrackError, ImageError, MaskError.
    #[pyo3(signature = (time_s, world_from_camera, images, world_from_object, masks=None))]
    #[allow(clippy::too_many_arguments, reason = "an observation has three parts")]
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn start(
        &self,
        py: Python<'_>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'_>,
        world_from_object: Pose,
        masks: Option<Masks<'_>>,
    ) -> PyResult<Estimate> {
        let images = read(&images)?;
        let masks = masks.unwrap_or_default();
        let masks = read_masks(&masks)?;
        let observation = observation(time_s.0, &world_from_camera.0, &images, &[])?;
        let masks = masks.iter().map(mask).collect::<PyResult<Vec<_>>>()?;
        let tracker = &mut *self.0.write()?;
        let started = py.detach(|| tracker.start(&observation, world_from_object.0, &masks));
        started.map(Estimate::from).map_err(raise)
    }

    /// Estimates the object's pose in the next images, None where a camera delivered nothing.
    /// Raises TrackError, ImageError.
    #[allow(clippy::needless_pass_by_value, reason = "as Python hands it over")]
    fn step(
        &self,
        py: Python<'_>,
        time_s: Seconds,
        world_from_camera: Listed<Pose>,
        images: Pictures<'_>,
    ) -> PyResult<Estimate> {
        let images = read(&images)?;
        let observation = observation(time_s.0, &world_from_camera.0, &images, &[])?;
        let tracker = &mut *self.0.write()?;
        py.detach(|| tracker.step(&observation)).map(Estimate::from).map_err(raise)
    }

    /// Sets the orientation of the object in the world, a unit quaternion (w, x, y, z), where it is
    /// known. Raises TrackError before the start, PoseError.
    fn set_orientation(&self, world_from_object: &Bound<'_, PyAny>) -> PyResult<()> {
        let what = "4 numbers (w, x, y, z)";
        let wanted = Wanted { name: "world_from_object", what, class: "PoseError" };
        let world_from_object = read_numbers(world_from_object, wanted)?;
        let pose = servoid::pose::Pose::from_parts([0.0; 3], world_from_object).map_err(raise)?;
        self.0.write()?.set_orientation(pose.rotation()).map_err(raise)
    }
}
