use pyo3::prelude::*;
use servoid::fitness::Backend;

use crate::errors::{named, raise};

/// The environment variable that forces a backend by name.
const VARIABLE: &str = "SERVOID_BACKEND";

/// Forces the backend named by the environment variable, if it is set.
pub fn force_named() -> PyResult<()> {
    let Some(name) = std::env::var_os(VARIABLE) else { return Ok(()) };
    match Backend::named(&name.to_string_lossy()) {
        Ok(backend) => backend.force(),
        Err(error) => {
            let remedy = "set it to one of these, or unset it for the fastest";
            return Err(named("BackendError", format!("{VARIABLE}: {error}; {remedy}")));
        }
    }
    Ok(())
}

/// Returns the name of the backend that this process uses.
#[pyfunction]
pub fn backend() -> &'static str {
    Backend::used().name()
}

/// Returns the names of all backends of this machine, the fastest last.
#[pyfunction]
pub fn backends() -> Vec<&'static str> {
    Backend::available().into_iter().map(Backend::name).collect()
}

/// Makes this process use the backend of a name from now on.
#[pyfunction]
pub fn force_backend(name: &str) -> PyResult<()> {
    Backend::named(name).map(Backend::force).map_err(raise)
}
