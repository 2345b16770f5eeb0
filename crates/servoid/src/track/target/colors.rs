use super::other_light::relit;
use crate::camera::{Channels, ImageView};
use crate::fitness::ScoreMap;

/// Colour statistics of the object and of its current surroundings, separately for grey and colour
/// images: what is learned in one kind says nothing about the other.
#[derive(Debug, Clone)]
pub(crate) struct Colors {
    grey: Palette,
    rgb: Palette,
}

/// Colour statistics of images of one kind: they follow the light, and the background's depend on
/// the side of the object.
///
/// A [`ColorModel`](crate::fitness::ColorModel) counts once what masks show; these histograms hold
/// shares, a part of which each update replaces.
///
/// The background has one histogram for each of eight directions from the object; each is mixed
/// with the histogram of all directions, so that a colour seen elsewhere still counts as
/// background.
#[derive(Debug, Clone)]
pub(crate) struct Palette {
    object: Histogram,
    around: Histogram,
    sides: Vec<Histogram>,
    /// The object's shares as they were recalled; empty if none were.
    recalled: Vec<f32>,
    /// ln p(colour | object) / p(colour | background), one table per side and one for any side.
    tables: Vec<f32>,
    local: bool,
}

/// The bins of the object's colours that are not empty, with the share of each.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Shares {
    /// Whether the bins are those of grey images.
    pub(crate) grey: bool,
    pub(crate) bins: Vec<(u32, f32)>,
}

/// Bits kept per channel.
pub(super) const BITS: u32 = 4;
pub(super) const BINS: usize = 1 << (3 * BITS);
/// The same of the only channel of grey images.
pub(super) const GREY_BITS: u32 = 6;
const SIDES: usize = 8;
/// Index of a pixel whose side of the object is unknown.
pub(crate) const ANY_SIDE: usize = SIDES;
/// Probability that a pixel has an arbitrary colour.
const ANYTHING: f32 = 0.02;
/// Largest absolute log-likelihood ratio of a pixel, in nats.
const MOST_RATIO: f32 = 2.5;
/// Pixels between those counted anywhere, across and down.
const ANYWHERE_STRIDE: usize = 4;
/// Weight of a side's own histogram in its expected background.
const OWN: f32 = 0.7;

#[derive(Debug, Clone)]
struct Histogram {
    shares: Vec<f32>,
    fresh: Vec<f32>,
    count: f32,
    known: bool,
}

impl Histogram {
    fn new() -> Self {
        Self { shares: vec![0.0; BINS], fresh: vec![0.0; BINS], count: 0.0, known: false }
    }

    fn add(&mut self, bin: usize) {
        self.fresh[bin] += 1.0;
        self.count += 1.0;
    }

    /// Mixes the counts in with a weight of `rate`; the first counts replace everything.
    fn take(&mut self, rate: f32) {
        if self.count >= LEAST_PIXELS {
            let rate = if self.known { rate } else { 1.0 };
            let scale = rate / self.count;
            for (share, fresh) in self.shares.iter_mut().zip(&self.fresh) {
                *share += scale * fresh - rate * *share;
            }
            self.known = true;
        }
        self.fresh.fill(0.0);
        self.count = 0.0;
    }
}

/// Fewer pixels than this are ignored.
const LEAST_PIXELS: f32 = 20.0;

/// Label of a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Belongs {
    Object,
    Background,
    Unknown,
}

impl Colors {
    pub(crate) fn new(local: bool) -> Self {
        Self { grey: Palette::new(local), rgb: Palette::new(local) }
    }

    /// Returns the statistics of images of one kind.
    #[inline]
    pub(crate) fn of(&self, channels: Channels) -> &Palette {
        match channels {
            Channels::Grey => &self.grey,
            Channels::Rgb => &self.rgb,
        }
    }

    #[inline]
    pub(crate) fn of_mut(&mut self, channels: Channels) -> &mut Palette {
        match channels {
            Channels::Grey => &mut self.grey,
            Channels::Rgb => &mut self.rgb,
        }
    }

    /// Mixes the counts in with a weight of `rate`.
    pub(crate) fn take(&mut self, rate: f32) {
        self.grey.take(rate);
        self.rgb.take(rate);
    }

    /// Counts a whole image as background, including the object: it is small in comparison.
    pub(crate) fn count_anywhere(&mut self, image: &ImageView<'_>) {
        self.of_mut(image.channels()).count_anywhere(image);
    }

    /// Replaces the statistics of the background anywhere by the counts.
    pub(crate) fn take_anywhere(&mut self) {
        self.grey.take_anywhere();
        self.rgb.take_anywhere();
    }

    /// Returns whether a bin exists.
    pub(crate) fn holds(bin: usize) -> bool {
        bin < BINS
    }

    /// Returns the object's bins that are not empty, with their shares, and whether they are of
    /// grey images. Colours are more informative where both are known.
    pub(crate) fn object_shares(&self) -> Shares {
        let grey = !self.rgb.object.known && self.grey.object.known;
        let palette = if grey { &self.grey } else { &self.rgb };
        Shares { grey, bins: palette.object_shares() }
    }

    /// Restores the object's shares; the background is unknown then.
    pub(crate) fn recall(&mut self, shares: &Shares) {
        let palette = if shares.grey { &mut self.grey } else { &mut self.rgb };
        palette.recall(&shares.bins);
    }

    /// Returns whether the object's colours were recalled.
    pub(crate) fn are_recalled(&self) -> bool {
        !(self.grey.recalled.is_empty() && self.rgb.recalled.is_empty())
    }

    /// Expects the colours that were recalled in `gain` times the light in which they were learned.
    pub(crate) fn relight(&mut self, gain: f32) {
        self.grey.relight(gain, true);
        self.rgb.relight(gain, false);
    }

    /// Returns whether colours of the object were learned in images of this kind.
    pub(crate) fn know_object(&self, channels: Channels) -> bool {
        self.of(channels).object.known
    }

    /// Returns whether colours of the object and of the background were learned.
    pub(crate) fn are_known(&self) -> bool {
        self.grey.is_known() || self.rgb.is_known()
    }
}

impl Palette {
    fn new(local: bool) -> Self {
        Self {
            object: Histogram::new(),
            around: Histogram::new(),
            sides: (0..=SIDES).map(|_| Histogram::new()).collect(),
            recalled: Vec::new(),
            tables: vec![0.0; (SIDES + 1) * BINS],
            local,
        }
    }

    fn is_known(&self) -> bool {
        self.object.known && self.around.known
    }

    /// Counts a pixel's bin for its label, on its side of the object.
    #[inline]
    pub(crate) fn count(&mut self, bin: usize, belongs: Belongs, side: usize) {
        match belongs {
            Belongs::Object => self.object.add(bin),
            Belongs::Background => {
                self.around.add(bin);
                self.sides[side].add(bin);
            }
            Belongs::Unknown => {}
        }
    }

    fn take(&mut self, rate: f32) {
        self.object.take(rate);
        self.around.take(rate);
        self.sides.iter_mut().for_each(|side| side.take(rate));
        self.tabulate();
    }

    fn count_anywhere(&mut self, image: &ImageView<'_>) {
        let [width, height] = image.size_px();
        for v in (0..height).step_by(ANYWHERE_STRIDE) {
            for u in (0..width).step_by(ANYWHERE_STRIDE) {
                self.sides[ANY_SIDE].add(bin(image, u, v));
            }
        }
    }

    fn take_anywhere(&mut self) {
        self.sides[ANY_SIDE].take(1.0);
        self.tabulate();
    }

    fn tabulate(&mut self) {
        // Without known colours of the object, colours carry no information.
        if !self.object.known {
            return;
        }
        let even = ANYTHING / BINS as f32;
        let tables = self.tables.chunks_exact_mut(BINS);
        for (index, (side, table)) in self.sides.iter().zip(tables).enumerate() {
            let own = match index {
                ANY_SIDE if side.known => 1.0,
                _ if self.local && side.known => OWN,
                _ => 0.0,
            };
            let shares = self.object.shares.iter().zip(&self.around.shares).zip(&side.shares);
            for (ratio, ((&object, &around), &here)) in table.iter_mut().zip(shares) {
                let beside = around + own * (here - around);
                let quotient = (object + even) / (beside + even);
                *ratio = fast_ln(quotient).clamp(-MOST_RATIO, MOST_RATIO);
            }
        }
    }

    fn object_shares(&self) -> Vec<(u32, f32)> {
        let shares = self.object.shares.iter().enumerate();
        shares.filter(|(_, share)| **share > 0.0).map(|(bin, &share)| (bin as u32, share)).collect()
    }

    fn recall(&mut self, shares: &[(u32, f32)]) {
        self.object.known = !shares.is_empty();
        for &(bin, share) in shares {
            if let Some(place) = self.object.shares.get_mut(bin as usize) {
                *place = share;
            }
        }
        self.recalled.clone_from(&self.object.shares);
    }

    fn relight(&mut self, gain: f32, is_grey: bool) {
        if self.object.known && !self.recalled.is_empty() {
            relit(&self.recalled, gain, is_grey, &mut self.object.shares);
            self.tabulate();
        }
    }

    /// Returns the log-likelihood ratio of a bin on a side, in nats.
    #[inline]
    pub(crate) fn ratio(&self, bin: usize, side: usize) -> f32 {
        self.tables[side * BINS + bin]
    }

    /// Returns the ratio of a bin on a side in quanta of a map.
    #[inline]
    pub(crate) fn quanta(&self, bin: usize, side: usize) -> i16 {
        (self.ratio(bin, side) * (1.0 / ScoreMap::QUANTUM as f32)) as i16
    }
}

/// Returns the bin of a pixel.
#[inline]
pub(crate) fn bin(image: &ImageView<'_>, u: usize, v: usize) -> usize {
    match image.channels() {
        Channels::Grey => grey_bin(image.row(v)[u]),
        Channels::Rgb => {
            let row = &image.row(v)[3 * u..3 * u + 3];
            rgb_bin([row[0], row[1], row[2]])
        }
    }
}

#[inline]
pub(crate) fn rgb_bin([r, g, b]: [u8; 3]) -> usize {
    let cut = |channel: u8| usize::from(channel >> (8 - BITS));
    (cut(r) << (2 * BITS)) | (cut(g) << BITS) | cut(b)
}

/// A grey image has a single channel, and so more bins for it.
#[inline]
pub(crate) fn grey_bin(grey: u8) -> usize {
    usize::from(grey >> (8 - GREY_BITS))
}

/// Returns the direction, one of eight, in which a position lies.
#[inline]
pub(crate) fn side(right: f32, down: f32) -> usize {
    usize::from(right > 0.0)
        | usize::from(down > 0.0) << 1
        | usize::from(right.abs() > down.abs()) << 2
}

/// Natural logarithm of a positive number, to about 0.001.
#[inline]
fn fast_ln(x: f32) -> f32 {
    let bits = x.to_bits();
    let exponent = (bits >> 23) as f32 - 127.0;
    let m = f32::from_bits((bits & 0x007f_ffff) | 0x3f80_0000) - 1.0;
    // A fit of log2(1 + m) on 0 to 1 that is exact at both ends.
    let fraction = m * (1.441_8 + m * (-0.708_2 + m * (0.414_7 - 0.148_3 * m)));
    (exponent + fraction) * std::f32::consts::LN_2
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 8;

    /// Labels the left half of an image with one grey level per half as the object.
    fn teach(colors: &mut Colors, channels: Channels, levels: [u8; 2]) {
        let bytes = channels.count();
        let pixels: Vec<u8> = (0..SIDE * SIDE * bytes)
            .map(|at| levels[usize::from(at / bytes % SIDE >= SIDE / 2)])
            .collect();
        let image = ImageView::new(&pixels, [SIDE; 2], channels).unwrap();
        for at in 0..SIDE * SIDE {
            let (u, v) = (at % SIDE, at / SIDE);
            let belongs = if u < SIDE / 2 { Belongs::Object } else { Belongs::Background };
            colors.of_mut(channels).count(bin(&image, u, v), belongs, 0);
        }
        colors.take(1.0);
    }

    #[test]
    fn colours_learned_from_images_of_one_kind_do_not_change_those_of_the_other() {
        let both = [Channels::Grey, Channels::Rgb];
        for (learned, other) in [(both[0], both[1]), (both[1], both[0])] {
            let mut colors = Colors::new(true);
            teach(&mut colors, learned, [40, 200]);
            assert!(colors.know_object(learned) && !colors.know_object(other));
            assert!(colors.of(learned).tables.iter().any(|ratio| *ratio > 1.0));
            assert!(colors.of(other).tables.iter().all(|ratio| *ratio == 0.0));
            let before = colors.of(learned).tables.clone();
            teach(&mut colors, other, [200, 40]);
            assert_eq!(colors.of(learned).tables, before);
        }
    }

    #[test]
    fn without_known_colours_of_the_object_the_ratio_of_each_colour_is_zero() {
        let mut colors = Colors::new(true);
        let pixels = [90; 3 * 64 * 64];
        let image = ImageView::new(&pixels, [64; 2], Channels::Rgb).unwrap();
        colors.count_anywhere(&image);
        colors.take_anywhere();
        assert!(colors.of(Channels::Rgb).tables.iter().all(|ratio| *ratio == 0.0));
    }
}
