//! Sensor noise: normal variables that depend on seed, pixel and channel alone.

use crate::simd::EIGHT;
use std::sync::LazyLock;

/// Size of the table of the normal distribution's quantiles.
const STEPS: usize = 1024;

/// Quantiles of equal shares, and a 2048th of the difference to the next, for linear interpolation;
/// scaled so that interpolated values have a standard deviation of 1.
static QUANTILES: LazyLock<[[f32; 2]; STEPS]> = LazyLock::new(|| {
    let mut table = Vec::with_capacity(STEPS + 1);
    let (mut x, mut below, step): (f64, f64, f64) = (-6.0, 0.0, 1e-4);
    let density = |x: f64| libm::exp(-0.5 * x * x) / (2.0 * std::f64::consts::PI).sqrt();
    // The half up to the median; the other is its mirror image.
    for i in 0..STEPS / 2 {
        let share = (i as f64).max(0.25) / STEPS as f64;
        while below < share {
            below += step * density(x + 0.5 * step);
            x += step;
        }
        table.push(x);
    }
    table.push(0.0);
    let mirrored: Vec<f64> = table[..STEPS / 2].iter().rev().map(|x| -x).collect();
    table.extend(mirrored);
    let square = |pair: &[f64]| (pair[0] * pair[0] + pair[0] * pair[1] + pair[1] * pair[1]) / 3.0;
    let variance = table.windows(2).map(square).sum::<f64>() / STEPS as f64;
    let scale = 1.0 / variance.sqrt();
    std::array::from_fn(|i| {
        let rise = scale * (table[i + 1] - table[i]) / 2048.0;
        [(scale * table[i] + 0.5 * rise) as f32, rise as f32]
    })
});

/// A sensor's noise.
#[derive(Clone, Copy)]
pub(super) struct Noise {
    sigma: f32,
    seed: u64,
    table: &'static [[f32; 2]; STEPS],
}

impl Noise {
    /// Makes noise of a standard deviation in grey levels; none if it is not positive.
    pub fn new(sigma: f64, seed: u64) -> Option<Self> {
        let seed = mixed(seed ^ 0x5e_ed0f_5e45_0111);
        (sigma > 0.0).then(|| Self { sigma: sigma as f32, seed, table: &QUANTILES })
    }

    /// Returns the noise in the three channels of eight pixels in a row, in grey levels.
    #[inline(always)]
    pub fn eight(self, first: u64) -> [[f32; EIGHT]; 3] {
        let mut out = [[0.0; EIGHT]; 3];
        for lane in 0..EIGHT {
            let pixel = first + lane as u64;
            let bits = mixed(self.seed.wrapping_add(pixel.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
            // 21 bits per channel: 10 select the entry, 11 the position up to the next.
            for (channel, levels) in out.iter_mut().enumerate() {
                let part = (bits >> (21 * channel)) as i32 & 0x1f_ffff;
                let [low, rise] = self.table[part as usize >> 11];
                levels[lane] = self.sigma * (low + rise * (part & 0x7ff) as f32);
            }
        }
        out
    }
}

/// Mixes the bits of a number.
///
/// Source: Steele, Lea, Flood, *Fast splittable pseudorandom number generators* (2014).
fn mixed(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
