//! Reads settings one by one, and rejects invalid values with the setting's name.

use pyo3::prelude::*;

use crate::taking::{Wanted, replace};

/// Valid values of a setting, by type.
pub trait Setting<'py>: FromPyObjectOwned<'py> {
    /// Their description in words.
    const WHAT: &'static str;
}

impl Setting<'_> for usize {
    const WHAT: &'static str = "a whole number, 0 or more";
}

impl Setting<'_> for u64 {
    const WHAT: &'static str = "a whole number from 0 to 2^64 - 1";
}

impl Setting<'_> for f64 {
    const WHAT: &'static str = "a number";
}

impl Setting<'_> for bool {
    const WHAT: &'static str = "True or False";
}

/// Reads settings; an invalid value raises an error of this class.
pub struct Settings(pub &'static str);

impl Settings {
    /// Reads a setting by its name; None stays None.
    pub fn read<'py, T: Setting<'py>>(
        &self,
        name: &'static str,
        given: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Option<T>> {
        let wanted = Wanted { name, what: T::WHAT, class: self.0 };
        given.map(|given| given.extract().map_err(|_| wanted.refuse(given))).transpose()
    }

    /// Overwrites a default if a value is given.
    pub fn put<'py, T: Setting<'py>>(
        &self,
        place: &mut T,
        name: &'static str,
        given: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<()> {
        replace(place, self.read(name, given)?);
        Ok(())
    }
}
