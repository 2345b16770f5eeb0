use pyo3::prelude::*;
use servoid::model::{ModelError, Progress, Step};

use crate::errors::raise;

/// Runs long work without the interpreter's lock. `progress` is called with the number of
/// ellipsoids, F and the share of the work that is done. An exception that it raises, or Ctrl-C,
/// ends the work and is raised.
pub fn relay(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(Progress<'_>) -> Result<Vec<Step>, ModelError> + Send,
) -> PyResult<Vec<Step>> {
    let mut raised = None;
    let steps = py.detach(|| {
        work(&mut |count: usize, fitness: f64, share: f64| {
            let called = Python::attach(|py| {
                py.check_signals()?;
                progress.map_or(Ok(()), |f| f.call1(py, (count, fitness, share)).map(drop))
            });
            raised = called.err();
            raised.is_none()
        })
    });
    match raised {
        Some(error) => Err(error),
        None => steps.map_err(raise),
    }
}
