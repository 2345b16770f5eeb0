use numpy::PyArray2;
use pyo3::prelude::*;
use servoid::servo as core;

use super::taking::read_row;
use crate::errors::raise;
use crate::pose::{Pose, rows};

/// A chain of revolute joints whose base is the world, with a hand at its end.
///
/// Each link, as (twist, along) in radians and metres by modified Denavit-Hartenberg parameters,
/// turns the former joint's frame about its x axis and shifts it along the new z axis, about which
/// the joint turns. Raises ServoError if there is none.
#[pyclass(frozen)]
pub struct Chain(core::Chain);

#[pymethods]
impl Chain {
    #[new]
    fn new(links: Vec<(f64, f64)>, flange_from_hand: &Pose) -> PyResult<Self> {
        let links: Vec<core::Link> =
            links.into_iter().map(|(twist, along)| core::Link { twist, along }).collect();
        core::Chain::new(&links, &flange_from_hand.0).map(Self).map_err(raise)
    }

    /// Returns the pose of the hand for angles (N,) in radians, of which those after the chain's do
    /// not move it. Raises ServoError, or PoseError if an angle is not finite.
    fn world_from_hand(&self, positions: &Bound<'_, PyAny>) -> PyResult<Pose> {
        self.0.world_from_hand(&read_row(positions, "joint angles")?).map(Pose).map_err(raise)
    }

    /// Returns (6, N) float64: the hand's velocity, linear and angular in the world, by joint.
    /// Raises ServoError.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let jacobian = self.0.jacobian(&read_row(positions, "joint angles")?).map_err(raise)?;
        Ok(rows(py, &jacobian.rows().numbers, jacobian.count()))
    }
}
