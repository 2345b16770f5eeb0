//! Laws of brightness at several resolutions.

use proptest::prelude::*;
use servoid::camera::{Channels, ImageView, Plane, Pyramid};

const SIZE: [usize; 2] = [48, 40];

/// An image that increases by whole grey levels to the right and downwards.
fn ramp(right: usize, down: usize) -> Vec<u8> {
    let [width, height] = SIZE;
    (0..width * height).map(|at| (at % width * right + at / width * down) as u8).collect()
}

fn noise(count: usize) -> Vec<u8> {
    let mut state = 5_u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}

fn read(pixels: &[u8], first: [usize; 2], size: [usize; 2]) -> Pyramid {
    let mut pyramid = Pyramid::default();
    pyramid.read(&ImageView::new(pixels, SIZE, Channels::Grey).unwrap(), first, size);
    pyramid
}

fn at(plane: &Plane, [u, v]: [f64; 2]) -> f32 {
    plane.sample(u as f32, v as f32).value
}

proptest! {
    #[test]
    fn a_ramp_is_sampled_exactly_between_pixels(u in 0.0..46.9_f64, v in 0.0..38.9_f64) {
        let pyramid = read(&ramp(3, 2), [0, 0], SIZE);
        let sample = pyramid.plane(0).sample(u as f32, v as f32);
        prop_assert!((f64::from(sample.value) - (3.0 * u + 2.0 * v)).abs() < 1e-4);
        prop_assert!((sample.right - 3.0).abs() < 1e-4 && (sample.down - 2.0).abs() < 1e-4);
    }

    #[test]
    fn a_place_of_the_image_is_the_same_place_at_each_resolution(
        u in 16.0..28.0_f64, v in 14.0..24.0_f64, left in 0..4_usize, top in 0..4_usize,
    ) {
        let pyramid = read(&ramp(3, 2), [2 * left, 2 * top], [40, 32]);
        for level in 0..Pyramid::LEVELS {
            let value = f64::from(at(pyramid.plane(level), pyramid.place(u, v, level)));
            prop_assert!((value - (3.0 * u + 2.0 * v)).abs() < 1e-3, "{level}: {value}");
        }
    }

    #[test]
    fn gradients_are_those_of_the_interpolated_picture(
        cell in (0..46_usize, 0..38_usize), share in (0.1..0.9_f32, 0.1..0.9_f32),
    ) {
        let pyramid = read(&noise(SIZE[0] * SIZE[1]), [0, 0], SIZE);
        let (u, v) = (cell.0 as f32 + share.0, cell.1 as f32 + share.1);
        let plane = pyramid.plane(0);
        let step = 0.05;
        let right = plane.sample(u + step, v).value - plane.sample(u - step, v).value;
        let down = plane.sample(u, v + step).value - plane.sample(u, v - step).value;
        let found = plane.sample(u, v);
        prop_assert!((right / (2.0 * step) - found.right).abs() < 0.05);
        prop_assert!((down / (2.0 * step) - found.down).abs() < 0.05);
    }

    #[test]
    fn a_window_is_cut_to_the_image_and_holds_its_pixels(
        first in prop::array::uniform2(0..60_usize), size in prop::array::uniform2(0..60_usize),
    ) {
        let pixels = noise(SIZE[0] * SIZE[1]);
        let pyramid = read(&pixels, first, size);
        let [left, top] = pyramid.first_px();
        let [width, height] = pyramid.plane(0).size_px();
        prop_assert!(left + width <= SIZE[0] && top + height <= SIZE[1]);
        for level in 0..Pyramid::LEVELS {
            let plane = pyramid.plane(level);
            prop_assert_eq!(plane.size_px(), [width >> level, height >> level]);
            // Every position inside is read without reading beyond the plane.
            let [columns, rows] = plane.size_px().map(|n| n as f64);
            for (u, v) in [(0.0, 0.0), (columns - 1.001, rows - 1.001), (columns - 1.0, 0.0)] {
                if plane.holds(u, v) {
                    let value = at(plane, [u, v]);
                    prop_assert!((0.0..=255.0).contains(&value));
                }
            }
        }
        if pyramid.plane(0).holds(0.0, 0.0) {
            let pixel = pixels[top * SIZE[0] + left];
            prop_assert_eq!(at(pyramid.plane(0), [0.0, 0.0]), f32::from(pixel));
        }
    }
}

#[test]
fn only_places_between_four_pixels_are_held() {
    let plane = read(&ramp(1, 1), [0, 0], SIZE).plane(0).clone();
    for (u, v, held) in [
        (0.0, 0.0, true),
        (46.9, 38.9, true),
        (-0.01, 5.0, false),
        (5.0, -0.01, false),
        (47.0, 5.0, false),
        (5.0, 39.0, false),
        (f64::NAN, 5.0, false),
        (5.0, f64::INFINITY, false),
    ] {
        assert_eq!(plane.holds(u, v), held, "{u} {v}");
    }
}

#[test]
fn each_pixel_of_a_coarser_plane_is_the_mean_of_four() {
    let pixels = noise(SIZE[0] * SIZE[1]);
    let pyramid = read(&pixels, [3, 5], [21, 19]);
    let fine = pyramid.plane(0);
    let coarse = pyramid.plane(1);
    for (u, v) in [(0, 0), (4, 7), (8, 7)] {
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)];
        let mean = |(right, down): (usize, usize)| {
            f32::from(pixels[(5 + 2 * v + down) * SIZE[0] + 3 + 2 * u + right])
        };
        let expected = four.map(mean).iter().sum::<f32>() / 4.0;
        assert_eq!(coarse.sample(u as f32, v as f32).value, expected);
    }
    assert_eq!(fine.size_px(), [21, 19]);
}

#[test]
fn grey_in_three_channels_is_read_like_grey_in_one() {
    let pixels = noise(SIZE[0] * SIZE[1]);
    let tripled: Vec<u8> = pixels.iter().flat_map(|&x| [x; 3]).collect();
    let mut pyramid = Pyramid::default();
    pyramid.read(&ImageView::new(&tripled, SIZE, Channels::Rgb).unwrap(), [4, 2], [30, 30]);
    let grey = read(&pixels, [4, 2], [30, 30]);
    for place in [[0.0, 0.0], [7.3, 9.1], [28.2, 28.7]] {
        let apart = at(pyramid.plane(0), place) - at(grey.plane(0), place);
        assert!(apart.abs() < 1e-3, "{place:?}: {apart}");
    }
}

#[test]
fn deviation_is_zero_for_one_brightness_and_that_of_the_pixels_else() {
    assert_eq!(read(&ramp(0, 0), [0, 0], SIZE).plane(2).deviation(), 0.0);
    let stripes: Vec<u8> = (0..SIZE[0] * SIZE[1]).map(|at| (at % 2 * 20) as u8).collect();
    assert!((read(&stripes, [0, 0], SIZE).plane(0).deviation() - 10.0).abs() < 1e-3);
    assert_eq!(read(&stripes, [0, 0], [0, 0]).plane(0).deviation(), 0.0);
}
