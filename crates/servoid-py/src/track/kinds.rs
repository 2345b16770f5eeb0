//! Tells images of grey cameras from those of colour cameras beside them.

use std::sync::atomic::{AtomicBool, Ordering};

use pyo3::prelude::*;

use crate::camera::Pixels;
use crate::track::{Pictures, read};

/// Whether a tracker was given images in colour, and grey ones with three channels.
///
/// A tracker knows colours and grey levels of the object apart. As soon as it was given both, an
/// image with three equal channels is taken as one of grey levels: its camera sees no colours, so
/// that those of the object are not expected there.
#[derive(Default)]
pub struct Kinds {
    color: AtomicBool,
    grey: AtomicBool,
}

impl Kinds {
    /// Forgets what was given before.
    pub fn forget(&self) {
        self.color.store(false, Ordering::Relaxed);
        self.grey.store(false, Ordering::Relaxed);
    }

    /// Borrows images, those of grey cameras beside others as grey levels.
    pub fn read<'a>(&self, pictures: &'a Pictures<'_>) -> PyResult<Vec<Option<Pixels<'a>>>> {
        let mut images = read(pictures)?;
        let shows_color = |image: &Option<Pixels<'a>>| image.as_ref().and_then(Pixels::shows_color);
        let shown: Vec<Option<bool>> = images.iter().map(shows_color).collect();
        self.color.fetch_or(shown.contains(&Some(true)), Ordering::Relaxed);
        self.grey.fetch_or(shown.contains(&Some(false)), Ordering::Relaxed);
        if self.color.load(Ordering::Relaxed) && self.grey.load(Ordering::Relaxed) {
            for (image, shows_color) in images.iter_mut().zip(shown) {
                if shows_color == Some(false) {
                    *image = image.take().map(Pixels::first_channel);
                }
            }
        }
        Ok(images)
    }
}
