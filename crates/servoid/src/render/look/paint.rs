use std::sync::Arc;

use wide::f32x4;

use super::light::linear;
use crate::render::vector::Vector;
use crate::render::{RenderError, color, within};
use crate::simd::{EIGHT, Single};

/// An image on a surface, which repeats without end.
#[derive(Debug, Clone)]
pub struct Texture {
    size: [f32; 2],
    /// Entries per row.
    pitch: usize,
    // Linear, with one row or column of the opposite side beyond each edge; the fourth number fills
    // a vector register. Paints are copied, and share them.
    texels: Arc<[f32x4]>,
}

impl Texture {
    /// Most pixels along a side.
    pub const MAX_SIDE_PX: usize = 1 << 14;

    /// Makes a texture of sRGB bytes, row by row.
    ///
    /// # Errors
    /// If a side is zero or too long, or the number of bytes does not fit.
    pub fn new(bytes: &[u8], [width, height]: [usize; 2]) -> Result<Self, RenderError> {
        let fits = |side: usize| (1..=Self::MAX_SIDE_PX).contains(&side);
        if !fits(width) || !fits(height) || bytes.len() != 3 * width * height {
            let max = Self::MAX_SIDE_PX;
            return Err(RenderError::Texture { width, height, given: bytes.len(), max });
        }
        let (across, pitch) = (3 * width, width + 2);
        let mut texels = Vec::with_capacity(pitch * (height + 2));
        for v in 0..height + 2 {
            let row = &bytes[(v + height - 1) % height * across..][..across];
            let (first, last) = (&row[..3], &row[across - 3..]);
            for pixel in [last].into_iter().chain(row.chunks_exact(3)).chain([first]) {
                let [r, g, b] = linear([pixel[0], pixel[1], pixel[2]]);
                texels.push(f32x4::new([r, g, b, 0.0]));
            }
        }
        let texels = texels.into();
        Ok(Self { size: [width as f32, height as f32], pitch, texels })
    }

    /// Returns the colours at texture coordinates, for the rays in `lanes`; (0, 0) is the corner of
    /// the first pixel, (1, 1) that of the last.
    #[inline(always)]
    pub(in crate::render) fn at<L: Single>(&self, [u, v]: [L; 2], lanes: u32) -> Vector<L> {
        let (left, across) = split(u, self.size[0]);
        let (top, down) = split(v, self.size[1]);
        // Rays that are not in `lanes` read the first pixel: a branch would cost more.
        let colors: [[f32; 4]; EIGHT] = std::array::from_fn(|lane| {
            let at = top[lane] as usize * self.pitch + left[lane] as usize;
            let at = if lanes >> lane & 1 == 1 { at } else { 0 };
            let (Some([a, b, ..]), Some([c, d, ..])) = (
                self.texels.get(at..at + 2),
                self.texels.get(at + self.pitch..at + self.pitch + 2),
            ) else {
                return [0.0; 4];
            };
            let (x, y) = (f32x4::splat(across[lane]), f32x4::splat(down[lane]));
            let (above, below) = (*a + (*b - *a) * x, *c + (*d - *c) * x);
            (above + (below - above) * y).to_array()
        });
        let part = |channel: usize| L::read(std::array::from_fn(|lane| colors[lane][channel]));
        Vector { x: part(0), y: part(1), z: part(2) }
    }
}

/// Returns the stored pixel before a coordinate, and the fraction of the way to the next.
#[inline(always)]
fn split<L: Single>(place: L, count: f32) -> ([i32; EIGHT], [f32; EIGHT]) {
    let share = place - place.trunc();
    let share = share.less(L::of(0.0)).select(share + L::of(1.0), share);
    // NaN becomes a valid coordinate, too.
    let at = share.max(L::of(0.0)) * L::splat(count) + L::of(0.5);
    let first = at.trunc();
    (first.whole(), (at - first).write())
}

/// Appearance of a surface.
#[derive(Debug, Clone)]
pub struct Paint {
    pub(in crate::render) color: [f32; 3],
    pub(in crate::render) texture: Option<Texture>,
    pub(in crate::render) repeat: [f32; 2],
    pub(in crate::render) gloss: f32,
}

impl Default for Paint {
    fn default() -> Self {
        Self { color: [0.7; 3], texture: None, repeat: [1.0; 2], gloss: 0.0 }
    }
}

impl Paint {
    /// Most repetitions of a texture over a surface.
    pub const MAX_REPEAT: f64 = 1e4;

    /// Sets the colour, linear red, green and blue; it multiplies a texture's.
    ///
    /// # Errors
    /// If a number is not between 0 and 1.
    pub fn with_color(self, value: [f64; 3]) -> Result<Self, RenderError> {
        Ok(Self { color: color("color", value, 1.0)?.map(|x| x as f32), ..self })
    }

    /// Sets the texture.
    #[must_use]
    pub fn with_texture(self, texture: Texture) -> Self {
        Self { texture: Some(texture), ..self }
    }

    /// Sets the number of repetitions of the texture over u and v.
    ///
    /// # Errors
    /// If a number is not above 0, or exceeds [`Paint::MAX_REPEAT`].
    pub fn with_repeat(self, repeat: [f64; 2]) -> Result<Self, RenderError> {
        let range = [1.0 / Self::MAX_REPEAT, Self::MAX_REPEAT];
        for value in repeat {
            within("repeat", value, range)?;
        }
        Ok(Self { repeat: repeat.map(|x| x as f32), ..self })
    }

    /// Sets the gloss: 0 is dull.
    ///
    /// # Errors
    /// If it is not between 0 and 1.
    pub fn with_gloss(self, gloss: f64) -> Result<Self, RenderError> {
        Ok(Self { gloss: within("gloss", gloss, [0.0, 1.0])? as f32, ..self })
    }
}
