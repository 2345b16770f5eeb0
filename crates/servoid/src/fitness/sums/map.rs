use crate::camera::{Channels, ImageView, RigError, check_image_size};

use crate::fitness::ColorModel;

/// A map of scores, one per pixel, stored as prefix sums along its rows.
///
/// The sum of the scores between two columns of a row is then the difference of two look-ups.
/// Scores are multiples of [`ScoreMap::QUANTUM`] and bounded by [`ScoreMap::LIMIT`], so every
/// prefix sum is exact in single precision. With a row stride of s only every s-th row is kept and
/// counts s times.
#[derive(Debug, Clone, Default)]
pub struct ScoreMap {
    size_px: [usize; 2],
    stride: usize,
    per_stride: f64,
    rows: usize,
    pitch: usize,
    prefix: Vec<f32>,
}

/// Rows of zeros behind the last one, so that a vector of rows may start at any row.
const PADDING_ROWS: usize = 16;

impl ScoreMap {
    /// Smallest step of a score.
    pub const QUANTUM: f64 = 1.0 / 256.0;
    /// Largest magnitude of a score, in nats.
    pub const LIMIT: f64 = 7.0;

    /// Makes the map of an image whose pixel (u, v) scores `score(v)(u)` quanta.
    /// The size is that of a [`crate::camera::Camera`]: sides of at most 8192 pixels.
    fn from_rows<R: Iterator<Item = i16>>(
        size_px: [usize; 2],
        stride: usize,
        scores_of_row: impl Fn(usize) -> R,
    ) -> Self {
        let mut map = Self::default();
        map.refill(size_px, stride, scores_of_row);
        map
    }

    /// Replaces the map by that of another image, of any size, in the same memory; its pixel (u, v)
    /// scores `score(v)(u)` quanta.
    pub(crate) fn refill<R: Iterator<Item = i16>>(
        &mut self,
        size_px: [usize; 2],
        stride: usize,
        scores_of_row: impl Fn(usize) -> R,
    ) {
        let [width, height] = size_px;
        self.size_px = size_px;
        self.stride = stride.max(1);
        self.per_stride = 1.0 / self.stride as f64;
        self.rows = height.div_ceil(self.stride);
        // One entry before the first pixel, one after the last for the interpolation there.
        self.pitch = width + 2;
        self.prefix.clear();
        self.prefix.resize((self.rows + PADDING_ROWS) * self.pitch, 0.0);
        self.fill(scores_of_row);
    }

    /// Writes all kept rows.
    fn fill<R: Iterator<Item = i16>>(&mut self, scores_of_row: impl Fn(usize) -> R) {
        let width = self.size_px[0];
        let kept = self.prefix.chunks_exact_mut(self.pitch).take(self.rows);
        for (row, out) in kept.enumerate() {
            let (mut sum, mut seen) = (0_i32, 0);
            for (score, place) in scores_of_row(row * self.stride).zip(&mut out[1..=width]) {
                sum += i32::from(score);
                *place = sum as f32;
                seen += 1;
            }
            // Pixels without a score count nothing, and neither does the entry behind the last.
            out[seen + 1..].fill(sum as f32);
        }
    }

    /// Makes the map of given scores, row by row, rounded to [`ScoreMap::QUANTUM`] and clamped to
    /// [`ScoreMap::LIMIT`]; a score that is missing or not a number counts nothing.
    #[must_use]
    pub fn from_scores(scores: &[f64], size_px: [usize; 2], stride: usize) -> Self {
        let width = size_px[0];
        Self::from_rows(size_px, stride, |v| {
            scores.iter().skip(v * width).take(width).map(|&score| quanta(score))
        })
    }

    /// Makes the map of log-likelihood ratios log p(colour | object) / p(colour | background).
    #[must_use]
    pub fn from_colors(image: &ImageView<'_>, model: &ColorModel, stride: usize) -> Self {
        let mut map = Self::from_rows(image.size_px(), stride, |_| std::iter::empty());
        map.fill_colors(image, model);
        map
    }

    /// Replaces the map by that of another image of the same size, in the same memory.
    ///
    /// # Errors
    /// If the image has another size.
    pub fn recolor(&mut self, image: &ImageView<'_>, model: &ColorModel) -> Result<(), RigError> {
        check_image_size(0, self.size_px, *image)?;
        self.fill_colors(image, model);
        Ok(())
    }

    fn fill_colors(&mut self, image: &ImageView<'_>, model: &ColorModel) {
        let table = model.table();
        match image.channels() {
            Channels::Rgb => self.fill(|v| {
                let (pixels, _) = image.row(v).as_chunks::<3>();
                pixels.iter().map(|&pixel| table[ColorModel::bin(pixel)])
            }),
            Channels::Grey => {
                self.fill(|v| image.row(v).iter().map(|&grey| table[ColorModel::bin([grey; 3])]))
            }
        }
    }

    /// Returns (width, height) of the image in pixels.
    #[must_use]
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// Returns the row stride.
    #[must_use]
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Returns the number of rows that are kept.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the score of the pixel in kept row `row` and column `u`.
    #[must_use]
    pub fn score(&self, u: usize, row: usize) -> f64 {
        let at = row * self.pitch + u;
        Self::QUANTUM * f64::from(self.prefix[at + 1] - self.prefix[at])
    }

    /// One over the row stride, rounded: rows computed with it may be one too many, which are
    /// empty.
    pub(in crate::fitness) fn per_stride(&self) -> f64 {
        self.per_stride
    }

    /// Entries from one row to the next in [`ScoreMap::prefix`].
    pub(in crate::fitness) fn pitch(&self) -> usize {
        self.pitch
    }

    /// Prefix sums in quanta: entry k of a row is the sum of its first k scores; [`PADDING_ROWS`]
    /// follow.
    pub(in crate::fitness) fn prefix(&self) -> &[f32] {
        &self.prefix
    }
}

/// Rounds a score to whole quanta.
pub(in crate::fitness) fn quanta(score: f64) -> i16 {
    (score.clamp(-ScoreMap::LIMIT, ScoreMap::LIMIT) / ScoreMap::QUANTUM).round() as i16
}
