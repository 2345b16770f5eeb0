//! Colours of an object in another light than that in which they were learned.

use super::colors::{BITS, GREY_BITS};

/// Levels of a channel of colour images, and of grey ones.
const LEVELS: usize = 1 << BITS;
const GREY_LEVELS: usize = 1 << GREY_BITS;

/// Writes the shares of colours in `gain` times the light.
pub(super) fn relit(shares: &[f32], gain: f32, is_grey: bool, out: &mut [f32]) {
    out.fill(0.0);
    for (bin, &share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
        if is_grey {
            for (level, part) in spread(bin, gain, GREY_LEVELS) {
                out[level] += share * part;
            }
            continue;
        }
        let channel = |at: u32| spread((bin >> (at * BITS)) & (LEVELS - 1), gain, LEVELS);
        for (r, red) in channel(2) {
            for (g, green) in channel(1) {
                for (b, blue) in channel(0) {
                    out[(((r << BITS) | g) << BITS) | b] += share * red * green * blue;
                }
            }
        }
    }
}

/// Returns the two levels between which the middle of a level lies in another light, with the share
/// of each; what is too bright has the greatest.
fn spread(level: usize, gain: f32, levels: usize) -> [(usize, f32); 2] {
    let greatest = levels - 1;
    let place = ((level as f32 + 0.5) * gain - 0.5).clamp(0.0, greatest as f32);
    let below = place as usize;
    let above = place - below as f32;
    [(below, 1.0 - above), ((below + 1).min(greatest), above)]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::colors::{BINS, grey_bin, rgb_bin};
    use super::*;

    fn of(bins: &[(usize, f32)]) -> Vec<f32> {
        let mut shares = vec![0.0; BINS];
        bins.iter().for_each(|(bin, share)| shares[*bin] += share);
        shares
    }

    fn relit_of(shares: &[f32], gain: f32, is_grey: bool) -> Vec<f32> {
        let mut out = vec![7.0; BINS];
        relit(shares, gain, is_grey, &mut out);
        out
    }

    proptest! {
        #[test]
        fn another_light_loses_no_share(r: u8, g: u8, b: u8, gain in 0.3..3.0_f32) {
            let shares = of(&[(rgb_bin([r, g, b]), 0.25), (rgb_bin([b, r, g]), 0.75)]);
            let sum: f32 = relit_of(&shares, gain, false).iter().sum();
            prop_assert!((sum - 1.0).abs() < 1e-5);
            let sum: f32 = relit_of(&of(&[(grey_bin(g), 1.0)]), gain, true).iter().sum();
            prop_assert!((sum - 1.0).abs() < 1e-5);
        }

        #[test]
        fn a_colour_in_another_light_is_about_where_its_pixels_are(
            pixel in prop::array::uniform3(20..160_u8),
            gain in 0.4..1.5_f32,
        ) {
            let lit = pixel.map(|x| (f32::from(x) * gain) as u8);
            let out = relit_of(&of(&[(rgb_bin(pixel), 1.0)]), gain, false);
            let cut = |bin: usize| [8, 4, 0].map(|at| (bin >> at & 15) as f32);
            let is_near = |bin: usize| {
                let (one, other) = (cut(bin), cut(rgb_bin(lit)));
                one.iter().zip(other).all(|(a, b)| (a - b).abs() <= 1.5 + gain)
            };
            prop_assert!((0..BINS).filter(|bin| out[*bin] > 0.0).all(is_near));
        }
    }

    #[test]
    fn the_same_light_changes_nothing() {
        let shares = of(&[(rgb_bin([200, 30, 90]), 0.5), (rgb_bin([255, 255, 0]), 0.5)]);
        assert_eq!(relit_of(&shares, 1.0, false), shares);
        let shares = of(&[(grey_bin(77), 1.0)]);
        assert_eq!(relit_of(&shares, 1.0, true), shares);
    }
}
