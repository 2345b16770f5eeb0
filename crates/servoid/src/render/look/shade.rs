//! The light that returns along a ray.

use super::light::Lighting;
use super::surface::Seen;
use crate::render::placed::Moment;
use crate::render::vector::{Vector, splat, stored};
use crate::simd::Single;

/// Number of squarings of the cosine of the highlight: the 64th power.
const SQUARINGS: usize = 6;

/// Brightness of the background straight below, relative to straight above.
const BELOW: f64 = 0.5;

/// Light in single precision, exposure included.
pub(in crate::render) struct Lamp {
    key: [f32; 3],
    sky: [f32; 3],
    bounce: [f32; 3],
}

impl Lamp {
    pub fn new(lighting: &Lighting) -> Self {
        let exposed = |color: [f64; 3]| stored(color.map(|x| x * lighting.exposure));
        Self {
            key: exposed(lighting.key),
            sky: exposed(lighting.sky),
            bounce: exposed(lighting.bounce),
        }
    }

    /// Returns the background in the direction of a ray.
    #[inline(always)]
    pub fn background<L: Single>(&self, moment: &Moment<f32>, ray: Vector<L>) -> Vector<L> {
        let up = ray.unit().dot(splat(moment.up));
        splat::<L>(self.sky) * (up * L::of(0.5 - 0.5 * BELOW) + L::of(0.5 + 0.5 * BELOW))
    }

    /// Returns the reflected light: Lambert's law, and Blinn's highlight if the surface is glossy.
    #[inline(always)]
    pub fn shine<L: Single>(
        &self,
        moment: &Moment<f32>,
        (ray, seen): (Vector<L>, &Seen<L>),
        (facing, shaded): (L, L),
    ) -> Vector<L> {
        let zero = L::of(0.0);
        let up = seen.normal.dot(splat(moment.up)) * L::of(0.5) + L::of(0.5);
        let (sky, bounce) = (splat::<L>(self.sky), splat::<L>(self.bounce));
        let key = splat::<L>(self.key);
        let lit = shaded.select(zero, facing);
        let mut out = seen.albedo.times(bounce + (sky - bounce) * up + key * lit);
        if zero.less(seen.gloss.both(zero.less(lit))).bits() != 0 {
            let middle = (splat::<L>(moment.toward) - ray.unit()).unit();
            let mut power = middle.dot(seen.normal).max(zero);
            for _ in 0..SQUARINGS {
                power = power * power;
            }
            out = out + key * zero.less(lit).select(seen.gloss * power, zero);
        }
        out
    }
}
