//! The region score against sums taken pixel by pixel.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use servoid::camera::{Camera, Channels, ImageView, Mask};
use servoid::fitness::{
    Backend, ColorModel, Differentiable, Fitness, Overlap, OverlapView, Region, RegionView,
    ScoreMap,
};
use servoid::pose::Pose;
use servoid::shape::{Outline, Projection, Quadric, QuadricGradient};

const SIZE: [usize; 2] = [96, 72];

/// From tiny to huge, in front of the camera, beside it, around it and behind it.
fn quadrics() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.8..0.8), prop::array::uniform9(-0.25..0.25), -0.4..2.0, -6.0..0.7)
        .prop_map(|(c, f, z, size): ([f64; 3], [f64; 9], f64, f64)| Quadric {
            center: Vector3::new(c[0], c[1], z),
            factor: Matrix3::from_column_slice(&f) * size.exp().min(2.0),
        })
}

/// Completely in front of the camera and not flat.
fn solids() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.3..0.3), prop::array::uniform9(-0.08..0.08), 0.8..1.5).prop_map(
        |(c, f, z)| Quadric {
            center: Vector3::new(c[0], c[1], z),
            factor: Matrix3::from_column_slice(&f) + Matrix3::identity() * 0.2,
        },
    )
}

/// Several ellipsoids, some of them duplicated, nested or flat.
fn bodies() -> impl Strategy<Value = Vec<Quadric>> {
    (prop::collection::vec(quadrics(), 1..9), 0..4_usize).prop_map(|(mut body, extra)| {
        let first = body[0];
        match extra {
            0 => body.push(first),
            1 => body.push(Quadric { factor: first.factor * 0.5, ..first }),
            2 => body[0].factor.set_column(0, &Vector3::zeros()),
            _ => {}
        }
        body
    })
}

fn projection() -> Projection {
    let camera = Camera::new(SIZE, [90.0, 85.0], [47.2, 36.9]).unwrap();
    Projection::new(&camera, &Pose::identity())
}

fn noise(seed: u64) -> Vec<f64> {
    let mut state = seed | 1;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 40) % 1025) as f64 / 256.0 - 2.0
    };
    (0..SIZE[0] * SIZE[1]).map(|_| next()).collect()
}

/// Distance in pixels from the corner beyond which an outline counts as unseen.
const FARTHEST: f64 = 1e6;

/// Error of an end of a row's interval, as a share of the reach of its outline.
const ROUNDED: f64 = 1e-6;

/// Sums each kept row over the share of each pixel that the union covers.
fn by_pixels(body: &[Quadric], map: &ScoreMap) -> (f64, f64) {
    let is_near = |outline: &Outline| {
        let reach_v = outline.center_v.abs() + outline.reach(map.stride() as f64);
        outline.center_u.abs() + outline.half_width < FARTHEST && reach_v < FARTHEST
    };
    let outlines = body.iter().filter_map(|q| projection().outline(q));
    let outlines: Vec<_> = outlines.filter(is_near).collect();
    let (mut score, mut area) = (0.0, 0.0);
    for row in 0..map.rows() {
        let v = (row * map.stride()) as f64;
        let mut spans: Vec<_> = outlines
            .iter()
            .filter_map(|outline| outline.mean_interval(v, map.stride() as f64))
            .collect();
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut union: Vec<(f64, f64)> = vec![];
        for (begin, end) in spans {
            match union.last_mut() {
                Some(last) if begin <= last.1 => last.1 = last.1.max(end),
                _ => union.push((begin, end)),
            }
        }
        for u in 0..SIZE[0] {
            let edges = (u as f64 - 0.5, u as f64 + 0.5);
            let covered = |s: &(f64, f64)| (s.1.min(edges.1) - s.0.max(edges.0)).max(0.0);
            let share: f64 = union.iter().map(covered).sum();
            score += map.stride() as f64 * share * map.score(u, row);
            area += map.stride() as f64 * share;
        }
    }
    (score, area)
}

/// Returns by how much an area in single precision may differ: each end of a row's interval by some
/// of the last bits of its outline's reach.
fn slack(body: &[Quadric]) -> f64 {
    let outlines = body.iter().filter_map(|q| projection().outline(q));
    let reach = |outline: Outline| {
        let across = outline.center_u.abs() + outline.half_width;
        across + outline.center_v.abs() + outline.half_height
    };
    ROUNDED
        * SIZE[1] as f64
        * outlines.map(reach).filter(|reach| *reach < 2.0 * FARTHEST).sum::<f64>()
}

fn region(map: ScoreMap, backend: Backend) -> Region {
    Region::with_backend(vec![RegionView { map, projection: projection(), weight: 1.0 }], backend)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn the_region_score_equals_the_sum_over_pixels(
        body in bodies(), seed in any::<u64>(), stride in 1_usize..6,
    ) {
        let map = ScoreMap::from_scores(&noise(seed), SIZE, stride);
        let (score, area) = by_pixels(&body, &map);
        let bound = 1e-3 * (10.0 + area.sqrt()) + slack(&body);
        for backend in Backend::available() {
            let region = region(map.clone(), backend);
            let sums = region.sums(&region.views()[0], &body);
            prop_assert!((sums.score - score).abs() < 2.0 * bound,
                "{backend:?}: {} instead of {score}, area {area}", sums.score);
            prop_assert!((sums.area - area).abs() < bound,
                "{backend:?}: area {} instead of {area}", sums.area);
            let mut slopes = vec![QuadricGradient::default(); body.len()];
            let also = region.score_and_gradient(&body, &mut slopes);
            prop_assert!((also - score).abs() < 2.0 * bound,
                "{backend:?}: {also} with the gradient instead of {score}");
            prop_assert!(slopes.iter().all(|s| s.center.iter().all(|x| x.is_finite())));
        }
    }

    #[test]
    fn the_gradient_equals_finite_differences_of_the_sum_over_pixels(
        body in prop::collection::vec(solids(), 1..5), seed in any::<u64>(),
        stride in 1_usize..4, which in 0_usize..12,
    ) {
        let map = ScoreMap::from_scores(&noise(seed), SIZE, stride);
        let index = seed as usize % body.len();
        let moved = |by: f64| {
            let mut body = body.clone();
            let q = &mut body[index];
            if which < 3 { q.center[which] += by } else { q.factor[which - 3] += by }
            body
        };
        // Where the sum is not differentiable (an end crosses a pixel's edge or another end, a row
        // opens), differences with two step lengths disagree; such cases are skipped. Single
        // precision may be on the other side of such a point than double precision: away from it
        // both agree.
        let found_at = |at: f64| {
            let sum = |by: f64| by_pixels(&moved(at + by), &map).0;
            let difference = |step: f64| (sum(step) - sum(-step)) / (2.0 * step);
            let (found, coarse) = (difference(1e-6), difference(4e-6));
            ((found - coarse).abs() < 1e-3 * (1.0 + found.abs())).then_some((at, found))
        };
        let places: Vec<_> = [0.0, 5e-5, -5e-5].into_iter().filter_map(found_at).collect();
        prop_assume!(!places.is_empty());
        for backend in Backend::available() {
            let region = region(map.clone(), backend);
            let off = places.iter().map(|&(at, found)| {
                let mut slopes = vec![QuadricGradient::default(); body.len()];
                region.score_and_gradient(&moved(at), &mut slopes);
                let slope = &slopes[index];
                let given = if which < 3 { slope.center[which] } else { slope.factor[which - 3] };
                (given - found).abs() / (20.0 + found.abs())
            });
            let least = off.fold(f64::INFINITY, f64::min);
            prop_assert!(least < 0.02, "{backend:?}: off by {least} of {places:?}");
        }
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits(
        body in bodies(), solid in prop::collection::vec(solids(), 1..9), seed in any::<u64>(),
        stride in 1_usize..6,
    ) {
        let map = ScoreMap::from_scores(&noise(seed), SIZE, stride);
        for body in [body, solid] {
            let of = |backend| bits(&region(map.clone(), backend), &body);
            let portable = of(Backend::PORTABLE);
            for backend in Backend::available() {
                prop_assert_eq!(of(backend), portable.clone(), "{:?}", backend);
            }
        }
    }
}

/// Returns all bits of sums and gradient.
fn bits(region: &Region, body: &[Quadric]) -> Vec<u64> {
    let sums = region.sums(&region.views()[0], body);
    let mut slopes = vec![QuadricGradient::default(); body.len()];
    let also = region.score_and_gradient(body, &mut slopes);
    let slopes = slopes.iter().flat_map(|s| s.center.iter().chain(s.factor.iter()).copied());
    [sums.score, sums.area, also].into_iter().chain(slopes).map(f64::to_bits).collect()
}

#[test]
fn each_back_end_is_found_by_its_name_and_no_other_name_is() {
    for backend in Backend::available() {
        assert_eq!(Backend::named(backend.name()), Ok(backend));
    }
    let message = Backend::named("avx1024").unwrap_err().to_string();
    assert!(message.contains("'avx1024'") && message.contains("portable"), "{message}");
}

#[test]
fn a_batch_scores_as_one_by_one_with_the_same_bits_on_any_thread_count() {
    let region = region(ScoreMap::from_scores(&noise(5), SIZE, 1), Backend::fastest());
    let place = |i: usize| Quadric {
        center: Vector3::new(0.004 * (i % 50) as f64 - 0.1, 0.003 * (i % 37) as f64, 1.0),
        factor: Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.15)),
    };
    let many: Vec<Quadric> = (0..2000).map(place).collect();
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| region.scores(&many, 2))
    };
    let alone: Vec<f64> = many.chunks(2).map(|body| region.score(body)).collect();
    for scores in [on(1), on(2), on(3)] {
        assert!(scores.iter().zip(&alone).all(|(a, b)| a.to_bits() == b.to_bits()));
        assert_eq!(scores.len(), 1000);
    }
}

#[test]
fn the_overlap_is_one_for_the_right_body_and_rises_along_its_gradient() {
    let truth = Quadric {
        center: Vector3::new(0.05, 0.02, 1.0),
        factor: Matrix3::from_diagonal(&Vector3::new(0.2, 0.15, 0.1)),
    };
    let outline = projection().outline(&truth).unwrap();
    let mut filled = vec![0.0; SIZE[0] * SIZE[1]];
    for v in 0..SIZE[1] {
        for u in 0..SIZE[0] {
            if let Some((begin, end)) = outline.mean_interval(v as f64, 1.0) {
                let (u, ends) = (u as f64, (begin, end));
                filled[v * SIZE[0] + u as usize] =
                    (ends.1.min(u + 0.5) - ends.0.max(u - 0.5)).clamp(0.0, 1.0);
            }
        }
    }
    let overlap =
        Overlap::new(vec![OverlapView { filled, size_px: SIZE, projection: projection() }]);
    // Pixels cut by the outline are half filled and half covered: a border's worth is lost.
    assert!(overlap.score(&[truth]) > 0.97, "{}", overlap.score(&[truth]));
    for by in [-0.02, 0.02] {
        let mut beside = truth;
        beside.center.y += by;
        let scaled = Quadric { factor: truth.factor * (1.0 + 3.0 * by), ..truth };
        assert!(overlap.score(&[beside]).max(overlap.score(&[scaled])) < overlap.score(&[truth]));
    }
    let mut off = truth;
    off.center.x += 0.05;
    off.factor *= 0.8;
    let mut slopes = [QuadricGradient::default()];
    let before = overlap.score_and_gradient(&[off], &mut slopes);
    assert!((before - overlap.score(&[off])).abs() < 1e-6);
    let step = 0.01 / slopes[0].center.norm().max(slopes[0].factor.norm());
    off.center += slopes[0].center * step;
    off.factor += slopes[0].factor * step;
    assert!(overlap.score(&[off]) > before + 0.005);
}

#[test]
fn colours_score_by_their_likelihood_ratio() {
    let [object, background, unseen] = [[200, 30, 30], [20, 180, 40], [90, 90, 250]];
    let bytes: Vec<u8> =
        (0..600).flat_map(|i| if i % 3 == 0 { object } else { background }).collect();
    let marks: Vec<u8> = (0..600).map(|i| u8::from(i % 3 == 0)).collect();
    let image = ImageView::new(&bytes, [30, 20], Channels::Rgb).unwrap();
    let mask = Mask::new(ImageView::new(&marks, [30, 20], Channels::Grey).unwrap()).unwrap();
    let model = ColorModel::learn(&[(&image, &mask)]).unwrap();
    assert!(model.score(object) > 3.0 && model.score(background) < -3.0);
    assert!(model.score(object) <= ScoreMap::LIMIT);
    assert_eq!(model.score(unseen), 0.0);
    let map = ScoreMap::from_colors(&image, &model, 2);
    assert_eq!((map.rows(), map.score(0, 3)), (10, model.score(object)));
}

#[test]
fn scores_that_are_no_numbers_or_too_large_are_bounded() {
    let scores = [f64::NAN, f64::INFINITY, -1e9, 0.5];
    let map = ScoreMap::from_scores(&scores, [4, 1], 1);
    let read: Vec<f64> = (0..4).map(|u| map.score(u, 0)).collect();
    assert_eq!(read, [0.0, ScoreMap::LIMIT, -ScoreMap::LIMIT, 0.5]);
}
