use crate::track::pose::verify::Quality;

/// The mean quality of the images in which the object is tracked, with which new ones are compared.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Reference {
    /// Mean log-likelihood ratio inside the outline.
    pub(crate) ratio: f64,
    /// Agreement of the outline with the boundary in the images.
    pub(crate) outline: f64,
    /// Share of what should be visible that is seen.
    pub(crate) share: f64,
    /// Support of the pose, in surface points.
    pub(crate) support: f64,
    /// Surface points that are seen.
    pub(crate) recognised: f64,
    /// Those of them with the contrast of a pattern; not saved, so learned anew.
    pub(crate) textured: f64,
    /// Share of them that have it now or mostly had it, once it was measured; not saved, either.
    pub(crate) printed_share: Option<f64>,
    /// Share of them that are finely patterned; not saved, either.
    pub(crate) fine_share: Option<f64>,
    /// Share of them that show the rotation that the outline shows least, without the first image,
    /// in which points on the boundary are not found out yet; not saved, either.
    pub(crate) turning_share: Option<f64>,
    /// The largest of each of the four so far, since an object may have a label on one side only.
    pub(crate) most_textured: f64,
    pub(crate) most_fine: f64,
    pub(crate) most_printed: f64,
    pub(crate) most_turning: f64,
    /// Pixels inside the outlines, times the squared distance.
    pub(crate) area: f64,
    /// Distance from the first camera, in metres.
    pub(crate) distance: f64,
}

/// Weight of the newest image.
const RATE: f64 = 0.05;

impl Reference {
    /// Number of values that are saved.
    pub(crate) const NUMBERS: usize = 7;

    /// Returns it as numbers that are independent of the number of cameras: sums over cameras are
    /// divided by it.
    pub(crate) fn numbers(&self, cameras: usize) -> [f64; Self::NUMBERS] {
        let Self { ratio, outline, share, support, recognised, area, distance, .. } = *self;
        let each = 1.0 / cameras as f64;
        [ratio, outline, share, support * each, recognised * each, area * each, distance]
    }

    /// Restores it from the result of [`Reference::numbers`], for other cameras.
    pub(crate) fn of(numbers: [f64; Self::NUMBERS], cameras: usize) -> Self {
        let [ratio, outline, share, support, recognised, area, distance] = numbers;
        let all = cameras as f64;
        let (support, recognised, area) = (support * all, recognised * all, area * all);
        Self { ratio, outline, share, support, recognised, area, distance, ..Self::default() }
    }

    /// Measures what is printed by the first image.
    pub(crate) fn begin(&mut self, quality: &Quality) {
        self.textured = quality.textured;
        self.printed_share = Some(quality.printed_share());
        self.fine_share = Some(quality.fine_share());
        self.note_most();
    }

    fn note_most(&mut self) {
        self.most_textured = self.most_textured.max(self.textured);
        self.most_printed = self.most_printed.max(self.printed_share.unwrap_or(0.0));
        self.most_fine = self.most_fine.max(self.fine_share.unwrap_or(0.0));
        self.most_turning = self.most_turning.max(self.turning_share.unwrap_or(0.0));
    }

    /// Updates it by the quality of an image in which the pose was trusted.
    pub(crate) fn follow(&mut self, quality: &Quality, distance: f64) {
        self.distance += RATE * (distance - self.distance);
        self.ratio += RATE * (quality.ratio - self.ratio);
        self.outline += RATE * (quality.outline - self.outline);
        self.share += RATE * (quality.share - self.share);
        self.recognised += RATE * (quality.recognised - self.recognised);
        let rate = if self.textured > 0.0 { RATE } else { 1.0 };
        self.textured += rate * (quality.textured - self.textured);
        self.printed_share = Some(mean(self.printed_share, quality.printed_share()));
        self.fine_share = Some(mean(self.fine_share, quality.fine_share()));
        self.turning_share = Some(mean(self.turning_share, quality.turning_share()));
        self.note_most();
        self.support += RATE * (quality.support - self.support);
    }
}

/// Returns a running mean after another value; the first value is the first mean.
fn mean(before: Option<f64>, value: f64) -> f64 {
    let before = before.unwrap_or(value);
    before + RATE * (value - before)
}
