use std::hash::{Hash, Hasher};
use std::time::Duration;

use nalgebra::{Matrix6, Vector6};
use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use servoid::track as core;

use crate::errors::named;
use crate::pose::{Pose, rows};
use crate::taking::{hash_numbers, short, shorts};

/// The pose of the object, with its uncertainty.
///
/// Two estimates are equal if they differ at most in their timing.
#[pyclass(frozen, eq, hash, module = "servoid.track")]
#[derive(Clone)]
pub struct Estimate {
    core: core::Estimate,
    notices: Vec<String>,
}

impl From<core::Estimate> for Estimate {
    fn from(mut core: core::Estimate) -> Self {
        let notices = core.notices.drain(..).map(|notice| notice.to_string()).collect();
        Self { core, notices }
    }
}

impl PartialEq for Estimate {
    fn eq(&self, other: &Self) -> bool {
        let untimed = core::Estimate { timing: other.core.timing, ..self.core.clone() };
        untimed == other.core && self.notices == other.notices
    }
}

impl Hash for Estimate {
    fn hash<H: Hasher>(&self, state: &mut H) {
        hash_numbers(&[self.core.time_s, self.core.confidence], state);
        Pose(self.core.world_from_object).hash(state);
    }
}

#[pymethods]
impl Estimate {
    /// Time stamp in seconds.
    #[getter]
    fn time_s(&self) -> f64 {
        self.core.time_s
    }

    /// Pose of the object in the world; while it is not tracked, the last pose or the best guess.
    #[getter]
    fn world_from_object(&self) -> Pose {
        Pose(self.core.world_from_object)
    }

    /// Covariance of a small motion (linear, angular) of the object in its own frame, (6, 6)
    /// float64, in metres and radians.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.core.covariance.transpose().as_slice(), 6)
    }

    /// Unit motions that the images do not constrain, (K, 6) float64: linear in object sizes,
    /// angular in radians, in the object's frame.
    #[getter]
    fn unobservable<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let axes = self.core.unobservable.iter();
        rows(py, &axes.flat_map(|axis| axis.iter().copied()).collect::<Vec<_>>(), 6)
    }

    /// Probability that the pose is right, 0 to 1. A pose is right if it is not off by more than 20
    /// mm, or a tenth of the object's diameter if that is more, and 15 degrees.
    #[getter]
    fn confidence(&self) -> f64 {
        self.core.confidence
    }

    /// The evidence for the pose if the object is followed, else None: `share`, the share of what
    /// should be visible that is seen; `recognised`, surface points per camera, `textured`, those
    /// with the contrast of a pattern, and `reference_textured`, the usual number of those;
    /// `proved`, 1 if the object was never lost or is proved to be the lost one; `turn_rad`,
    /// `jitter_rad` and `drift_rad`, standard deviations of the orientation due to image noise,
    /// from how poses differ from image to image without any motion, and since the first image;
    /// `by_outline`, 1 if the outline of a known shape alone shows the orientation.
    #[getter]
    fn evidence<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(core::Evidence {
            share,
            recognised,
            textured,
            reference_textured,
            proved,
            turn_rad,
            jitter_rad,
            drift_rad,
            by_outline,
        }) = self.core.evidence
        else {
            return Ok(None);
        };
        let out = PyDict::new(py);
        for (name, value) in [
            ("share", share),
            ("recognised", recognised),
            ("textured", textured),
            ("reference_textured", reference_textured),
            ("proved", f64::from(u8::from(proved))),
            ("turn_rad", turn_rad),
            ("jitter_rad", jitter_rad),
            ("drift_rad", drift_rad),
            ("by_outline", f64::from(u8::from(by_outline))),
        ] {
            out.set_item(name, value)?;
        }
        Ok(Some(out))
    }

    /// Status of the tracker: "tracking", "searching" or "lost".
    #[getter]
    fn status(&self) -> &'static str {
        self.core.status.name()
    }

    /// Whether the images confirm the object's position; if the status is "tracking", its
    /// orientation as well.
    #[getter]
    fn located(&self) -> bool {
        self.core.located
    }

    /// Number and pose, world_from_object, of the keyframe to which this pose belongs, if the
    /// object is followed, and of the keyframe of the previous pose if that was another one. A
    /// later correction of a keyframe applies to its poses as well.
    #[getter]
    fn keyframes(&self) -> Vec<(usize, Pose)> {
        self.core.keyframes.iter().flatten().map(|(number, pose)| (*number, Pose(*pose))).collect()
    }

    /// Whether the body changed since the last estimate because it evolved in the worker.
    #[getter]
    fn evolved(&self) -> bool {
        self.core.evolved
    }

    /// What was wrong with the observation, in words.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.notices.clone()
    }

    /// Number of hypotheses scored.
    #[getter]
    fn evaluations(&self) -> usize {
        self.core.evaluations
    }

    /// Seconds spent in each stage: prepare, search, refine, verify, update.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core::Timing { prepare, search, refine, verify, update } = self.core.timing;
        let out = PyDict::new(py);
        let stages = [prepare, search, refine, verify, update].map(|stage| stage.as_secs_f64());
        for (name, seconds) in
            ["prepare", "search", "refine", "verify", "update"].iter().zip(stages)
        {
            out.set_item(name, seconds)?;
        }
        Ok(out)
    }

    /// Returns the same estimate for a start in doubt: nothing confirms its pose; `located` says
    /// whether its position is confirmed. What is lost stays lost.
    fn in_doubt(&self, located: bool) -> Self {
        Self { core: self.core.clone().in_doubt(located), notices: self.notices.clone() }
    }

    fn __repr__(&self) -> String {
        let core::Estimate { time_s, confidence, world_from_object, .. } = &self.core;
        format!(
            "Estimate(time_s={}, status='{}', confidence={confidence:.2}, at {})",
            short(*time_s),
            self.status(),
            shorts(world_from_object.translation().as_slice())
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Parts)> {
        let Self { core: it, notices } = slf.get();
        let evidence = it.evidence.map(|e| {
            let counts = [e.share, e.recognised, e.textured, e.reference_textured];
            (counts, [e.proved, e.by_outline], [e.turn_rad, e.jitter_rad, e.drift_rad])
        });
        let core::Timing { prepare, search, refine, verify, update } = it.timing;
        let keyframes = it.keyframes.map(|one| one.map(|(number, pose)| (number, Pose(pose))));
        let parts = (
            (it.time_s, Pose(it.world_from_object), it.confidence),
            it.covariance.as_slice().to_vec(),
            it.unobservable.iter().map(|&axis| axis.into()).collect(),
            evidence,
            (it.status.name().to_owned(), it.located, it.evolved, it.evaluations),
            keyframes,
            notices.clone(),
            [prepare, search, refine, verify, update].map(|stage| stage.as_secs_f64()),
        );
        Ok((slf.getattr("_of_parts")?, parts))
    }

    /// Restores an estimate from its parts, to the last bit.
    #[classmethod]
    #[allow(clippy::too_many_arguments, reason = "an estimate has so many parts")]
    fn _of_parts(
        _class: &Bound<'_, PyType>,
        first: (f64, Pose, f64),
        covariance: Vec<f64>,
        unobservable: Vec<[f64; 6]>,
        evidence: Option<EvidenceParts>,
        state: (String, bool, bool, usize),
        keyframes: [Option<(usize, Pose)>; 2],
        notices: Vec<String>,
        seconds: [f64; 5],
    ) -> PyResult<Self> {
        let (time_s, world_from_object, confidence) = first;
        let (status, located, evolved, evaluations) = state;
        let states = [core::Status::Tracking, core::Status::Searching, core::Status::Lost];
        let status = states.into_iter().find(|one| one.name() == status);
        let (Some(status), 36) = (status, covariance.len()) else {
            return Err(named("TrackError", "these parts do not make an estimate".into()));
        };
        let evidence = evidence.map(|(counts, [proved, by_outline], turns)| {
            let (
                [share, recognised, textured, reference_textured],
                [turn_rad, jitter_rad, drift_rad],
            ) = (counts, turns);
            core::Evidence {
                share,
                recognised,
                textured,
                reference_textured,
                proved,
                turn_rad,
                jitter_rad,
                drift_rad,
                by_outline,
            }
        });
        let [prepare, search, refine, verify, update] =
            seconds.map(|s| Duration::try_from_secs_f64(s).unwrap_or_default());
        let core = core::Estimate {
            time_s,
            world_from_object: world_from_object.0,
            covariance: Matrix6::from_column_slice(&covariance),
            unobservable: unobservable.into_iter().map(Vector6::from).collect(),
            confidence,
            evidence,
            status,
            located,
            keyframes: keyframes.map(|one| one.map(|(number, pose)| (number, pose.0))),
            evolved,
            notices: Vec::new(),
            evaluations,
            timing: core::Timing { prepare, search, refine, verify, update },
        };
        Ok(Self { core, notices })
    }
}

type EvidenceParts = ([f64; 4], [bool; 2], [f64; 3]);

type Parts = (
    (f64, Pose, f64),
    Vec<f64>,
    Vec<[f64; 6]>,
    Option<EvidenceParts>,
    (String, bool, bool, usize),
    [Option<(usize, Pose)>; 2],
    Vec<String>,
    [f64; 5],
);
