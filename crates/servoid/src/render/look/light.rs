use std::sync::LazyLock;

use crate::changing::changeable;
use crate::render::{RenderError, color, within};
use crate::simd::{EIGHT, Single};

/// A distant lamp with parallel rays, and ambient light from above and below.
///
/// Strengths are linear red, green and blue; 1 makes a white surface that faces the lamp white.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Lighting {
    /// Direction from a visual towards the lamp, in the world, whose z points up.
    pub toward: [f64; 3],
    /// Strength of the lamp.
    pub key: [f64; 3],
    /// Strength of the light from above; the background has this colour.
    pub sky: [f64; 3],
    /// Strength of the light from below.
    pub bounce: [f64; 3],
    /// Factor on all strengths.
    pub exposure: f64,
}

changeable!(Lighting);

impl Default for Lighting {
    fn default() -> Self {
        Self {
            toward: [0.4, -0.4, 0.8],
            key: [0.72, 0.69, 0.64],
            sky: [0.30, 0.34, 0.40],
            bounce: [0.12, 0.11, 0.10],
            exposure: 1.0,
        }
    }
}

impl Lighting {
    /// Largest strength.
    pub const MAX_STRENGTH: f64 = 1e3;

    /// Checks that every number is in range.
    ///
    /// # Errors
    /// If the direction is zero or not finite, or a strength is negative or above
    /// [`Lighting::MAX_STRENGTH`].
    pub fn check(&self) -> Result<(), RenderError> {
        let length = self.toward.iter().map(|x| x * x).sum::<f64>();
        if !(length.is_finite() && length > 0.0) {
            return Err(RenderError::Toward(self.toward));
        }
        for (what, value) in [("key", self.key), ("sky", self.sky), ("bounce", self.bounce)] {
            color(what, value, Self::MAX_STRENGTH)?;
        }
        within("exposure", self.exposure, [0.0, Self::MAX_STRENGTH]).map(|_| ())
    }
}

/// Linear strengths of the 256 sRGB values (IEC 61966-2-1).
static LINEAR: LazyLock<[f32; 256]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let x = i as f64 / 255.0;
        let y = if x <= 0.04045 { x / 12.92 } else { libm::pow((x + 0.055) / 1.055, 2.4) };
        y as f32
    })
});

/// Returns the linear strengths of an sRGB colour.
pub(in crate::render) fn linear(color: [u8; 3]) -> [f32; 3] {
    color.map(|c| LINEAR[usize::from(c)])
}

/// Size of the inverse table; it is uniform in the root of the strength, where the function is
/// nearly linear.
const STEPS: usize = 4096;

static GREY: LazyLock<[f32; STEPS]> = LazyLock::new(|| {
    let grey = |i: usize| {
        let x = (i as f64 / (STEPS - 1) as f64).powi(2);
        let y = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
        (255.0 * y) as f32
    };
    std::array::from_fn(grey)
});

/// Converts roots of linear strengths to grey levels, 0 to 255, not rounded.
#[derive(Clone, Copy)]
pub(in crate::render) struct Grey(&'static [f32; STEPS]);

impl Grey {
    pub fn new() -> Self {
        Self(&GREY)
    }

    /// Returns the grey levels of strengths whose roots, from 0 to 1, are given.
    #[inline(always)]
    pub fn of_root<L: Single>(self, root: L) -> L {
        let places = (root * L::of((STEPS - 1) as f64) + L::of(0.5)).whole();
        let mut out = [0.0; EIGHT];
        for (level, &place) in out.iter_mut().zip(&places) {
            *level = self.0[place as usize & (STEPS - 1)];
        }
        L::read(out)
    }
}

#[cfg(test)]
mod tests {
    use wide::f32x8;

    use super::*;
    use crate::simd::RayLanes;

    #[test]
    fn every_srgb_value_comes_back() {
        for value in 0..=255_u8 {
            let [strength, ..] = linear([value; 3]);
            let [grey, ..] = Grey::new().of_root(f32x8::splat(strength.sqrt())).write();
            assert!((grey - f32::from(value)).abs() < 0.07, "{value} became {grey}");
        }
    }
}
