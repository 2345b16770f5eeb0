//! Holds what calls change, for one thread at a time.

use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard, TryLockError};

use pyo3::PyResult;

use crate::errors::named;

/// A tracker that Python may call from several threads. A call never waits for another one: it
/// raises TrackError, since the order of the images would be left to chance.
pub struct Held<T>(RwLock<T>);

impl<T> Held<T> {
    pub const fn new(tracker: T) -> Self {
        Self(RwLock::new(tracker))
    }

    /// Borrows the tracker, as other calls that change nothing may at the same time.
    pub fn read(&self) -> PyResult<RwLockReadGuard<'_, T>> {
        free(self.0.try_read())
    }

    /// Borrows the tracker for a call that changes it.
    pub fn write(&self) -> PyResult<RwLockWriteGuard<'_, T>> {
        free(self.0.try_write())
    }
}

fn free<G>(tried: Result<G, TryLockError<G>>) -> PyResult<G> {
    match tried {
        Ok(guard) => Ok(guard),
        Err(TryLockError::Poisoned(poisoned)) => Ok(PoisonError::into_inner(poisoned)),
        Err(TryLockError::WouldBlock) => {
            let message = "another thread is calling this tracker, and a tracker takes one call at \
                           a time; call it from one thread, or give each thread its own";
            Err(named("TrackError", message.into()))
        }
    }
}
