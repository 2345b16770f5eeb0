use crate::camera::{ImageView, Mask, RigError, check_image_size};

use super::sums::map::quanta;

/// Colour histograms of the object and of its surroundings.
///
/// Each channel is divided into 32 bins. The score of a colour is its log-likelihood ratio; one
/// count spread over all bins keeps the score of unseen colours near zero.
#[derive(Debug, Clone)]
pub struct ColorModel {
    object: Vec<f64>,
    background: Vec<f64>,
    table: Vec<i16>,
}

const BITS: u32 = 5;
const BINS: usize = 1 << (3 * BITS);

impl ColorModel {
    /// Learns both histograms from images and the masks of the object in them.
    ///
    /// # Errors
    /// If an image and its mask differ in size.
    pub fn learn(pairs: &[(&ImageView<'_>, &Mask<'_>)]) -> Result<Self, RigError> {
        let (mut object, mut background) = (vec![0.0; BINS], vec![0.0; BINS]);
        for (camera, (image, mask)) in pairs.iter().enumerate() {
            check_image_size(camera, image.size_px(), mask.image())?;
            for v in 0..image.size_px()[1] {
                for (u, &m) in mask.image().row(v).iter().enumerate() {
                    let counts = if m == 0 { &mut background } else { &mut object };
                    counts[Self::bin(image.rgb(u, v))] += 1.0;
                }
            }
        }
        let table = log_ratios(&object, &background);
        Ok(Self { object, background, table })
    }

    /// Returns the log-likelihood ratio of a colour, in nats.
    #[must_use]
    pub fn score(&self, rgb: [u8; 3]) -> f64 {
        f64::from(self.table[Self::bin(rgb)]) * super::ScoreMap::QUANTUM
    }

    /// Returns the number of object pixels and of background pixels in a colour's bin.
    #[must_use]
    pub fn counts(&self, rgb: [u8; 3]) -> (f64, f64) {
        (self.object[Self::bin(rgb)], self.background[Self::bin(rgb)])
    }

    #[inline]
    pub(super) fn bin([r, g, b]: [u8; 3]) -> usize {
        let cut = |channel: u8| usize::from(channel >> (8 - BITS));
        (cut(r) << (2 * BITS)) | (cut(g) << BITS) | cut(b)
    }

    pub(super) fn table(&self) -> &[i16; BINS] {
        // The table has BINS entries; an empty one would score nothing.
        const NOTHING: &[i16; BINS] = &[0; BINS];
        self.table.as_slice().try_into().unwrap_or(NOTHING)
    }
}

fn log_ratios(object: &[f64], background: &[f64]) -> Vec<i16> {
    let (objects, backgrounds) = (object.iter().sum::<f64>(), background.iter().sum::<f64>());
    let share = |count: f64, total: f64| (count + 1.0 / BINS as f64) / (total + 1.0);
    let pairs = object.iter().zip(background);
    // A bin that is empty in both histograms carries no information.
    let ratio = |(&o, &b): (&f64, &f64)| {
        if o + b == 0.0 { 0.0 } else { libm::log(share(o, objects) / share(b, backgrounds)) }
    };
    pairs.map(|pair| quanta(ratio(pair))).collect()
}
