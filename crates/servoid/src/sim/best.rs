use wide::f32x8;

#[cfg(target_arch = "x86_64")]
use super::lanes_x86::Avx2;
use super::render::{Job, draw};

/// The fastest arithmetic that this processor has; all give the same bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Best {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Best {
    pub fn found() -> Self {
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx2") {
            return Self::Avx2;
        }
        Self::Portable
    }

    pub fn draw(self, job: &Job<'_>, band: usize, rows: &mut [u8]) {
        match self {
            Self::Portable => draw::<f32x8>(job, band, rows),
            // SAFETY: chosen only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { draw_avx2(job, band, rows) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn draw_avx2(job: &Job<'_>, band: usize, rows: &mut [u8]) {
    draw::<Avx2>(job, band, rows);
}
