use super::light::linear;
use super::{SimError, color, within};

/// A picture on a surface, which repeats without end.
#[derive(Debug, Clone)]
pub struct Texture {
    width: usize,
    height: usize,
    // Linear; the fourth number fills a vector register.
    texels: Vec<[f32; 4]>,
}

impl Texture {
    /// Takes sRGB bytes, row by row.
    ///
    /// # Errors
    /// If a side is zero or the number of bytes does not fit.
    pub fn new(bytes: &[u8], [width, height]: [usize; 2]) -> Result<Self, SimError> {
        if width == 0 || height == 0 || bytes.len() != 3 * width * height {
            return Err(SimError::Texture { width, height, given: bytes.len() });
        }
        let texel = |c: &[u8]| {
            let [r, g, b] = linear([c[0], c[1], c[2]]);
            [r, g, b, 0.0]
        };
        Ok(Self { width, height, texels: bytes.chunks_exact(3).map(texel).collect() })
    }

    /// Gives the colour at a place; (0, 0) is the first pixel's corner, (1, 1) the last one's.
    #[inline(always)]
    pub(super) fn at(&self, u: f32, v: f32) -> [f32; 3] {
        let (left, right, across) = neighbours(u, self.width);
        let (top, bottom, down) = neighbours(v, self.height);
        let row = |v: usize| {
            let (a, b) = (&self.texels[v * self.width + left], &self.texels[v * self.width + right]);
            let mix = |i: usize| a[i] + (b[i] - a[i]) * across;
            [mix(0), mix(1), mix(2)]
        };
        let (above, below) = (row(top), row(bottom));
        let mix = |i: usize| above[i] + (below[i] - above[i]) * down;
        [mix(0), mix(1), mix(2)]
    }
}

/// Gives the pixels on both sides of a place, and how far it is from the first to the second.
#[inline(always)]
fn neighbours(place: f32, count: usize) -> (usize, usize, f32) {
    let whole = place as i32;
    let share = place - whole as f32;
    let share = if share < 0.0 { share + 1.0 } else { share };
    // Half a pixel up, so that it stays positive.
    let at = share * count as f32 + (count as f32 - 0.5);
    let first = at as usize;
    let wrap = |mut i: usize| {
        while i >= count {
            i -= count;
        }
        i
    };
    (wrap(first), wrap(first + 1), at - first as f32)
}

/// What a surface looks like.
#[derive(Debug, Clone)]
pub struct Paint {
    pub(super) color: [f32; 3],
    pub(super) texture: Option<Texture>,
    pub(super) repeat: [f32; 2],
    pub(super) gloss: f32,
}

impl Default for Paint {
    fn default() -> Self {
        Self { color: [0.7; 3], texture: None, repeat: [1.0; 2], gloss: 0.0 }
    }
}

impl Paint {
    /// Most repetitions of a texture over a surface.
    pub const MAX_REPEAT: f64 = 1e4;

    /// Takes another colour, linear red, green and blue; it multiplies a texture's.
    ///
    /// # Errors
    /// If a number does not lie from 0 to 1.
    pub fn with_color(self, value: [f64; 3]) -> Result<Self, SimError> {
        Ok(Self { color: color("color", value, 1.0)?.map(|x| x as f32), ..self })
    }

    /// Takes a texture.
    #[must_use]
    pub fn with_texture(self, texture: Texture) -> Self {
        Self { texture: Some(texture), ..self }
    }

    /// Lets the texture repeat so often over u and v.
    ///
    /// # Errors
    /// If a number is not above 0 or beyond [`Paint::MAX_REPEAT`].
    pub fn with_repeat(self, repeat: [f64; 2]) -> Result<Self, SimError> {
        let range = [1.0 / Self::MAX_REPEAT, Self::MAX_REPEAT];
        for value in repeat {
            within("repeat", value, range)?;
        }
        Ok(Self { repeat: repeat.map(|x| x as f32), ..self })
    }

    /// Lets the surface shine: 0 is dull.
    ///
    /// # Errors
    /// If it does not lie from 0 to 1.
    pub fn with_gloss(self, gloss: f64) -> Result<Self, SimError> {
        Ok(Self { gloss: within("gloss", gloss, [0.0, 1.0])? as f32, ..self })
    }
}
