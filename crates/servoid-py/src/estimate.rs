use numpy::PyArray2;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use servoid::track as core;

use crate::pose::{Pose, rows};

/// Where the object is, and how well that is known.
#[pyclass(frozen, module = "servoid")]
pub struct Estimate(pub core::Estimate);

#[pymethods]
impl Estimate {
    /// When, in seconds.
    #[getter]
    fn time_s(&self) -> f64 {
        self.0.time_s
    }

    /// Pose of the object in the world; while it is not tracked, where it was last or is supposed.
    #[getter]
    fn world_from_object(&self) -> Pose {
        Pose(self.0.world_from_object)
    }

    /// Covariance of a small motion (linear, angular) of the object in its own frame, (6, 6)
    /// float64, in metres and radians.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        rows(py, self.0.covariance.transpose().as_slice(), 6)
    }

    /// Unit motions that the images leave open, (K, 6) float64: linear in object sizes, angular in
    /// radians, in the object's frame.
    #[getter]
    fn unobservable<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        let axes = self.0.unobservable.iter();
        rows(py, &axes.flat_map(|axis| axis.iter().copied()).collect::<Vec<_>>(), 6)
    }

    /// Probability that the pose is right, 0 to 1: not more than 20 mm, or a tenth of the object's
    /// diameter if that is more, and 15 degrees off.
    #[getter]
    fn confidence(&self) -> f64 {
        self.0.confidence
    }

    /// What speaks for the pose, where the object is followed, else None: `share` of what should be
    /// seen that is; `recognised`, surface points a camera, `printed`, those with the contrast of a
    /// pattern, and `usual_printed`; `proved`, 1 if the object was never lost or is proved to be the one
    /// that was; `turn_rad`, `scatter_rad` and `drift_rad`, standard deviations of the turn by the images'
    /// noise, by what poses differ from image to image without any motion, and since the first image.
    #[getter]
    fn evidence<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(core::Evidence {
            share,
            recognised,
            printed,
            usual_printed,
            proved,
            turn_rad,
            scatter_rad,
            drift_rad,
        }) = self.0.evidence
        else {
            return Ok(None);
        };
        let out = PyDict::new(py);
        for (name, value) in [
            ("share", share),
            ("recognised", recognised),
            ("printed", printed),
            ("usual_printed", usual_printed),
            ("proved", f64::from(u8::from(proved))),
            ("turn_rad", turn_rad),
            ("scatter_rad", scatter_rad),
            ("drift_rad", drift_rad),
        ] {
            out.set_item(name, value)?;
        }
        Ok(Some(out))
    }

    /// What the tracker believes: "tracking", "searching" or "lost".
    #[getter]
    fn status(&self) -> &'static str {
        self.0.status.name()
    }

    /// Whether the images confirm where the object is; its turn, too, if the status is "tracking".
    #[getter]
    fn located(&self) -> bool {
        self.0.located
    }

    /// Number and pose, world_from_object, of the keyframe that the pose belongs to, if the object is
    /// followed, and of the one that the last pose belonged to if that was another one: as its keyframe
    /// is corrected later, so is the pose.
    #[getter]
    fn keyframes(&self) -> Vec<(usize, Pose)> {
        self.0.keyframes.iter().flatten().map(|(number, pose)| (*number, Pose(*pose))).collect()
    }

    /// Whether the body changed since the last estimate, as it evolved in the worker.
    #[getter]
    fn evolved(&self) -> bool {
        self.0.evolved
    }

    /// What was wrong with the observation, in words.
    #[getter]
    fn notices(&self) -> Vec<String> {
        self.0.notices.iter().map(ToString::to_string).collect()
    }

    /// Hypotheses that were scored.
    #[getter]
    fn evaluations(&self) -> usize {
        self.0.evaluations
    }

    /// Seconds that each stage took: look, search, polish, judge, learn.
    #[getter]
    fn seconds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let core::Timing { look, search, polish, judge, learn } = self.0.timing;
        let out = PyDict::new(py);
        let stages = [look, search, polish, judge, learn].map(|stage| stage.as_secs_f64());
        for (name, seconds) in ["look", "search", "polish", "judge", "learn"].iter().zip(stages) {
            out.set_item(name, seconds)?;
        }
        Ok(out)
    }

    fn __repr__(&self) -> String {
        let Self(core::Estimate { time_s, confidence, .. }) = self;
        let status = self.status();
        format!("Estimate(time_s={time_s}, status='{status}', confidence={confidence:.2})")
    }
}
