use super::{Channels, ImageView};

/// Brightness of a part of an image, row by row.
#[derive(Debug, Clone, Default)]
pub struct Plane {
    size_px: [usize; 2],
    data: Vec<f32>,
}

/// Brightness at a position between pixels, and its derivatives to the right and downwards.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sample {
    /// Brightness, 0 to 255.
    pub value: f32,
    /// Change per pixel to the right.
    pub right: f32,
    /// Change per pixel down.
    pub down: f32,
}

impl Plane {
    /// Returns (width, height) in pixels.
    #[must_use]
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// Returns the rows of pixels.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[f32]> {
        self.data.chunks_exact(self.size_px[0].max(1))
    }

    /// Returns whether a position lies between four pixels of the plane.
    #[inline]
    #[must_use]
    pub fn holds(&self, u: f64, v: f64) -> bool {
        let [width, height] = self.size_px;
        u >= 0.0 && v >= 0.0 && u + 1.0 < width as f64 && v + 1.0 < height as f64
    }

    /// Interpolates between four pixels. The position must lie inside ([`Plane::holds`]); outside,
    /// the result is meaningless.
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, u: f32, v: f32) -> Sample {
        let (left, top) = (u as usize, v as usize);
        let (a, b) = (u - left as f32, v - top as f32);
        let at = top * self.size_px[0] + left;
        let below = at + self.size_px[0];
        let (Some(upper), Some(lower)) =
            (self.data.get(at..at + 2), self.data.get(below..below + 2))
        else {
            return Sample::default();
        };
        let (across, under) = (upper[1] - upper[0], lower[1] - lower[0]);
        let (first, second) = (upper[0] + a * across, lower[0] + a * under);
        Sample {
            value: first + b * (second - first),
            right: across + b * (under - across),
            down: second - first,
        }
    }

    /// Returns the standard deviation of the brightness.
    #[must_use]
    pub fn deviation(&self) -> f32 {
        let (count, mean) = (self.data.len().max(1) as f32, self.mean());
        (self.data.iter().map(|x| (x - mean) * (x - mean)).sum::<f32>() / count).sqrt()
    }

    /// Returns the mean brightness.
    #[must_use]
    pub fn mean(&self) -> f32 {
        self.data.iter().sum::<f32>() / self.data.len().max(1) as f32
    }

    /// Estimates the standard deviation of the noise, in grey levels, from the median of a second
    /// difference across and down, on which edges and slopes have little effect (after Immerkaer,
    /// Fast noise variance estimation, 1996).
    fn noise(&self, scratch: &mut Vec<f32>) -> f32 {
        let [width, height] = self.size_px;
        scratch.clear();
        for v in (1..height.saturating_sub(1)).step_by(NOISE_STRIDE) {
            let rows = [v - 1, v, v + 1].map(|v| &self.data[v * width..(v + 1) * width]);
            for u in (1..width.saturating_sub(1)).step_by(NOISE_STRIDE) {
                let across = rows.map(|row| row[u - 1] - 2.0 * row[u] + row[u + 1]);
                scratch.push((across[0] - 2.0 * across[1] + across[2]).abs());
            }
        }
        if scratch.is_empty() {
            return 0.0;
        }
        let middle = scratch.len() / 2;
        let (_, median, _) = scratch.select_nth_unstable_by(middle, f32::total_cmp);
        *median / (MEDIAN * SECOND)
    }

    /// Averages each pixel with its neighbours, by binomial weights; the border stays as it is.
    fn smooth(&mut self, scratch: &mut Vec<f32>) {
        let [width, height] = self.size_px;
        if width < 3 || height < 3 {
            return;
        }
        // First across, then down, row by row, so that each row is read before it changes.
        scratch.clear();
        for row in self.data.chunks_exact(width) {
            scratch.push(row[0]);
            scratch.extend(row.windows(3).map(|x| 0.25 * (x[0] + 2.0 * x[1] + x[2])));
            scratch.push(row[width - 1]);
        }
        for v in 1..height - 1 {
            let rows = [v - 1, v, v + 1].map(|v| &scratch[v * width..(v + 1) * width]);
            let inner = self.data[v * width..(v + 1) * width].iter_mut().enumerate();
            for (u, pixel) in inner.take(width - 1).skip(1) {
                *pixel = 0.25 * (rows[0][u] + 2.0 * rows[1][u] + rows[2][u]);
            }
        }
    }

    /// Replaces this plane by another at half its resolution: each pixel is the mean of four.
    fn halve(&mut self, from: &Self) {
        let [width, height] = from.size_px.map(|n| n / 2);
        self.size_px = [width, height];
        self.data.clear();
        for v in 0..height {
            let row = |v: usize| &from.data[v * from.size_px[0]..][..2 * width];
            let (upper, lower) = (row(2 * v).as_chunks::<2>().0, row(2 * v + 1).as_chunks::<2>().0);
            let mean = |(a, b): (&[f32; 2], &[f32; 2])| 0.25 * (a[0] + a[1] + b[0] + b[1]);
            self.data.extend(upper.iter().zip(lower).map(mean));
        }
    }

    fn read(&mut self, image: &ImageView<'_>, first: [usize; 2], size_px: [usize; 2]) {
        self.size_px = size_px;
        self.data.clear();
        for v in first[1]..first[1] + size_px[1] {
            match image.channels() {
                Channels::Grey => {
                    let row = &image.row(v)[first[0]..first[0] + size_px[0]];
                    self.data.extend(row.iter().map(|&grey| f32::from(grey)));
                }
                Channels::Rgb => {
                    let row = &image.row(v)[3 * first[0]..3 * (first[0] + size_px[0])];
                    self.data.extend(row.as_chunks::<3>().0.iter().map(|&rgb| luma(rgb)));
                }
            }
        }
    }
}

/// Pixels between the pixels at which noise is estimated.
const NOISE_STRIDE: usize = 5;
/// Median absolute value of a standard normal variable, and standard deviation of the second
/// difference across and down of independent variables, in their standard deviations.
const MEDIAN: f32 = 0.6745;
const SECOND: f32 = 6.0;

/// Noise above which an image is smoothed, in grey levels, and the share of it that remains then.
const NOISY: f32 = 6.0;
const SMOOTHED: f32 = 0.375;

/// Weights of red, green and blue in brightness (ITU-R BT.601).
fn luma([r, g, b]: [u8; 3]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}

/// Brightness of a window of an image at several resolutions, each half of the previous one.
#[derive(Debug, Clone, Default)]
pub struct Pyramid {
    first_px: [usize; 2],
    planes: [Plane; Pyramid::LEVELS],
    scratch: Vec<f32>,
}

impl Pyramid {
    /// Number of resolutions.
    pub const LEVELS: usize = 3;

    /// Reads a window of an image, clipped to the image; reuses the memory of the previous one.
    pub fn read(&mut self, image: &ImageView<'_>, first_px: [usize; 2], size_px: [usize; 2]) {
        let whole = image.size_px();
        let first = [0, 1].map(|i| first_px[i].min(whole[i]));
        let size = [0, 1].map(|i| size_px[i].min(whole[i] - first[i]));
        self.first_px = first;
        let [finest, ..] = &mut self.planes;
        finest.read(image, first, size);
        self.coarsen();
    }

    /// Smooths a noisy image; returns the standard deviation of the remaining noise, in grey
    /// levels.
    pub fn denoise(&mut self) -> f32 {
        let [finest, ..] = &mut self.planes;
        let noise = finest.noise(&mut self.scratch);
        if noise <= NOISY {
            return noise;
        }
        finest.smooth(&mut self.scratch);
        self.coarsen();
        noise * SMOOTHED
    }

    /// Computes the coarser planes from the finest.
    fn coarsen(&mut self) {
        let [finest, coarser @ ..] = &mut self.planes;
        let mut from: &Plane = finest;
        for plane in coarser {
            plane.halve(from);
            from = plane;
        }
    }

    /// Returns the plane of a level; 0 is the finest, and a level beyond the last returns the last.
    #[must_use]
    pub fn plane(&self, level: usize) -> &Plane {
        &self.planes[level.min(Self::LEVELS - 1)]
    }

    /// Returns the first column and row of the window in the image.
    #[must_use]
    pub fn first_px(&self) -> [usize; 2] {
        self.first_px
    }

    /// Maps a pixel of the image to a level's plane.
    #[inline]
    #[must_use]
    pub fn place(&self, u: f64, v: f64, level: usize) -> [f64; 2] {
        let scale = 1.0 / (1_u32 << level) as f64;
        let carry = |x: f64, first: usize| (x - first as f64 + 0.5) * scale - 0.5;
        [carry(u, self.first_px[0]), carry(v, self.first_px[1])]
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::evolve::Rng;

    const SIDE: usize = 120;

    /// Draws bars and a slope, with noise of a given standard deviation.
    fn drawn(noise: f64) -> Pyramid {
        let mut rng = Rng::seed_from_u64(3);
        let pixels: Vec<u8> = (0..SIDE * SIDE)
            .map(|at| {
                let (u, v) = (at % SIDE, at / SIDE);
                let bars = if u / 12 % 2 == 0 { 90.0 } else { 140.0 };
                // The sum of twelve uniform variables is nearly normal.
                let normal = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
                (bars + 0.2 * v as f64 + noise * normal).round().clamp(0.0, 255.0) as u8
            })
            .collect();
        let image = ImageView::new(&pixels, [SIDE; 2], Channels::Grey).unwrap();
        let mut pyramid = Pyramid::default();
        pyramid.read(&image, [0; 2], [SIDE; 2]);
        pyramid
    }

    #[test]
    fn the_standard_deviation_of_noise_is_estimated_beneath_a_pattern() {
        for noise in [2.0, 4.0, f64::from(NOISY) - 0.5] {
            let estimated = f64::from(drawn(noise).denoise());
            assert!((0.8..1.25).contains(&(estimated / noise)), "{estimated} of {noise}");
        }
        assert!(drawn(0.0).denoise() < 0.5);
    }

    #[test]
    fn what_is_noisy_is_smoothed_and_what_is_not_stays() {
        let [clean, fair, noisy] = [0.0, 2.0, 15.0].map(|noise| {
            let mut pyramid = drawn(noise);
            pyramid.denoise();
            pyramid
        });
        let apart = |one: &Pyramid, other: &Pyramid| {
            let pairs = one.plane(0).data.iter().zip(&other.plane(0).data);
            let count = one.plane(0).data.len() as f32;
            (pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f32>() / count).sqrt()
        };
        assert!((1.5..2.5).contains(&apart(&clean, &fair)));
        // The edges of the bars are blurred, too.
        assert!(apart(&clean, &noisy) < 0.6 * 15.0);
    }
}
