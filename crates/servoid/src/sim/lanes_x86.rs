use wide::f32x8;

use super::render::{Job, draw};

/// The fastest arithmetic that this processor has; all give the same bits.
#[derive(Clone, Copy)]
pub(super) enum Best {
    Portable,
}

impl Best {
    pub fn found() -> Self {
        Self::Portable
    }

    pub fn draw(self, job: &Job<'_>, band: usize, rows: &mut [u8]) {
        match self {
            Self::Portable => draw::<f32x8>(job, band, rows),
        }
    }
}
