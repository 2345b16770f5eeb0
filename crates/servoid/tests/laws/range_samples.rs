//! The depth term against samples taken along the lines of sight.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use servoid::fitness::{
    Differentiable, Evidence, Fitness, RangeSample, RangeSampleError, RangeSamples,
};
use servoid::pose::{Pose, even_direction, even_turn};
use servoid::shape::{Ellipsoid, Quadric, QuadricGradient};

const BEFORE: f64 = 0.6;
const BEHIND: f64 = 0.25;

fn quadrics() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.5..0.5), prop::array::uniform9(-0.15..0.15)).prop_map(|(c, f)| {
        let factor = Matrix3::from_column_slice(&f) + Matrix3::identity() * 0.4;
        Quadric { center: c.into(), factor }
    })
}

fn lines() -> impl Strategy<Value = Vec<RangeSample>> {
    let triple = || prop::array::uniform3(-1.0..1.0);
    prop::collection::vec((triple(), triple()), 4..20).prop_map(|lines| {
        let points: Vec<[f64; 3]> = lines.iter().map(|(point, _)| point.map(|x| 0.7 * x)).collect();
        let along = |way: [f64; 3]| if way == [0.0; 3] { [1.0, 0.0, 0.0] } else { way };
        let directions: Vec<[f64; 3]> = lines.iter().map(|(_, way)| along(*way)).collect();
        RangeSample::join(&points, &directions).unwrap()
    })
}

fn holds(quadric: &Quadric, point: &Vector3<f64>) -> bool {
    (quadric.factor.try_inverse().unwrap() * (point - quadric.center)).norm() < 1.0
}

/// Samples per step.
const STEPS: usize = 1000;

/// Lengths counted by point samples, in front of and behind the surface.
fn lengths(samples: &[RangeSample], inside: impl Fn(&Vector3<f64>) -> bool) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for sample in samples {
        let from = -sample.eye.max(BEFORE);
        for (place, (begin, end)) in [(from, 0.0), (0.0, BEHIND)].into_iter().enumerate() {
            let step = (end - begin) / STEPS as f64;
            let at = |i: usize| sample.point + sample.direction * (begin + (i as f64 + 0.5) * step);
            sums[place] += step * (0..STEPS).filter(|&i| inside(&at(i))).count() as f64;
        }
    }
    sums
}

/// The share filled by both of everything that body or object fill.
fn by_samples(samples: &[RangeSample], body: &[Quadric]) -> f64 {
    let [before, behind] = lengths(samples, |point| body.iter().any(|q| holds(q, point)));
    behind / (BEHIND * samples.len() as f64 + before)
}

/// Points all over a surface, seen from outside, each from its own direction.
fn all_around(truth: &Quadric, count: usize) -> Vec<RangeSample> {
    let inverse = truth.factor.try_inverse().unwrap();
    let sample = |i: usize| {
        let unit = even_direction(i, 1.0 - (2 * i + 1) as f64 / count as f64);
        let direction = -(inverse.transpose() * unit).normalize();
        RangeSample { point: truth.center + truth.factor * unit, direction, eye: 0.0 }
    };
    (0..count).map(sample).collect()
}

fn slot(quadric: &mut Quadric, which: usize) -> &mut f64 {
    if which < 3 { &mut quadric.center[which] } else { &mut quadric.factor[which - 3] }
}

/// Least cosine between a line and the normal where it enters.
fn steepness(samples: &[RangeSample], body: &[Quadric]) -> f64 {
    let mut least = f64::INFINITY;
    for (sample, quadric) in samples.iter().flat_map(|s| body.iter().map(move |q| (s, q))) {
        let inverse = quadric.factor.try_inverse().unwrap();
        let from = inverse * (sample.point - quadric.center);
        let along = inverse * sample.direction;
        let middle = -from.dot(&along) / along.norm_squared();
        let root = 1.0 - (from + along * middle).norm_squared();
        if root > 0.0 {
            let unit = from + along * (middle - root.sqrt() / along.norm());
            least =
                least.min((inverse.transpose() * unit).normalize().dot(&sample.direction).abs());
        }
    }
    least
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn the_agreement_equals_the_share_of_samples(
        samples in lines(), body in prop::collection::vec(quadrics(), 1..5),
    ) {
        let expected = by_samples(&samples, &body);
        let term = RangeSamples::new(samples, BEFORE, BEHIND);
        let mut slopes = vec![QuadricGradient::default(); body.len()];
        for found in [term.score(&body), term.score_and_gradient(&body, &mut slopes)] {
            prop_assert!((found - expected).abs() < 4e-3, "{found} instead of {expected}");
        }
    }

    #[test]
    fn the_gradient_equals_finite_differences(
        samples in lines(), body in prop::collection::vec(quadrics(), 1..4), which in 0_usize..12,
        index in 0_usize..4,
    ) {
        // An end that leaves the window, meets another or is only grazed is not differentiable
        // there.
        prop_assume!(steepness(&samples, &body) > 0.06);
        let term = RangeSamples::new(samples, BEFORE, BEHIND);
        let index = index % body.len();
        let moved = |by: f64| {
            let mut body = body.clone();
            *slot(&mut body[index], which) += by;
            term.score(&body)
        };
        let difference = |step: f64| (moved(step) - moved(-step)) / (2.0 * step);
        let (found, coarse) = (difference(1e-6), difference(4e-6));
        prop_assume!((found - coarse).abs() < 1e-5);
        let mut slopes = vec![QuadricGradient::default(); body.len()];
        term.score_and_gradient(&body, &mut slopes);
        let QuadricGradient { center, factor } = slopes[index];
        let given = *slot(&mut Quadric { center, factor }, which);
        prop_assert!((given - found).abs() < 1e-4 * (1.0 + found.abs()), "{given} for {found}");
    }

    #[test]
    fn what_is_open_is_what_the_standing_leave(
        samples in lines(), standing in prop::collection::vec(quadrics(), 0..4), next in quadrics(),
    ) {
        let gains = |point: &Vector3<f64>| {
            holds(&next, point) && !standing.iter().any(|one| holds(one, point))
        };
        let [before, behind] = lengths(&samples, gains);
        let expected = (behind - before) / (BEHIND * samples.len() as f64);
        let found = RangeSamples::new(samples, BEFORE, BEHIND).open(&standing).score(&[next]);
        prop_assert!((found - expected).abs() < 6e-3, "{found} instead of {expected}");
    }

    #[test]
    fn the_truth_fits_wholly_and_whatever_is_off_the_surface_fits_less(
        turn in prop::array::uniform3(0.0..1.0), radii in prop::array::uniform3(0.3..0.9),
        way in prop::array::uniform3(-1.0..1.0), by in 0.02..0.2,
    ) {
        let turn: [f64; 3] = turn;
        let turn = even_turn(turn[0], turn[1], turn[2]).to_rotation_matrix().into_inner();
        let factor = turn * Matrix3::from_diagonal(&Vector3::from(radii));
        let truth = Quadric { center: Vector3::new(0.2, 0.1, 3.0), factor };
        let term = RangeSamples::new(all_around(&truth, 200), BEFORE, BEHIND);
        prop_assert!(term.score(&[truth]) > 1.0 - 1e-9);
        let way = Vector3::from(way);
        prop_assume!(way.norm() > 0.1);
        let aside = |side: f64| Quadric { center: truth.center + way.normalize() * side, ..truth };
        let scaled = |by: f64| Quadric { factor: truth.factor * by, ..truth };
        let smaller = (1.0 - by, 1.0 + by);
        for other in [aside(by), aside(-by), scaled(smaller.0), scaled(smaller.1)] {
            prop_assert!(term.score(&[other]) < 1.0 - 1e-3, "{}", term.score(&[other]));
        }
    }

    #[test]
    fn seen_from_one_side_it_may_reach_back_but_not_forward(by in 0.01..0.3) {
        let truth = Quadric { center: Vector3::new(0.0, 0.0, 2.0), factor: Matrix3::identity() };
        let all = all_around(&truth, 2000);
        let front = all.into_iter().filter(|s| s.point.z < 1.2 && s.point.norm() < 2.0);
        let looked = front.map(|s| RangeSample { direction: s.point.normalize(), ..s }).collect();
        let term = RangeSamples::new(looked, BEFORE, BEHIND);
        prop_assert!(term.score(&[truth]) > 1.0 - 1e-9);
        // What lies deeper than was seen is not scored.
        let deep = Quadric { center: truth.center + Vector3::z() * by, ..truth };
        let both = term.score(&[truth, deep]);
        prop_assert!(both > 1.0 - 1e-9, "{both}");
        let mut reached = 1.0;
        for share in [0.25, 0.5, 1.0] {
            for side in [-1.0, 1.0] {
                let off = truth.center + Vector3::z() * (by * share * side);
                let score = term.score(&[Quadric { center: off, ..truth }]);
                prop_assert!(score < reached, "{score} after {reached}");
            }
            let off = truth.center - Vector3::z() * (by * share);
            reached = term.score(&[Quadric { center: off, ..truth }]);
        }
    }

    #[test]
    fn moving_the_world_changes_nothing(
        samples in lines(), body in prop::collection::vec(quadrics(), 1..4),
        turn in prop::array::uniform3(0.0..1.0), to in prop::array::uniform3(-5.0..5.0),
    ) {
        let turn: [f64; 3] = turn;
        let motion = Pose::from_rotation(even_turn(turn[0], turn[1], turn[2]), Vector3::from(to));
        let before = RangeSamples::new(samples.clone(), BEFORE, BEHIND).score(&body);
        let moved = samples.iter().map(|s| RangeSample {
            point: motion.transform(&s.point), direction: motion.rotation() * s.direction, ..*s
        });
        let solid = |q: &Quadric| Ellipsoid::from_quadric(q, 0.0).transformed(&motion, 1.0);
        let there: Vec<_> = body.iter().map(|q| solid(q).quadric()).collect();
        let after = RangeSamples::new(moved.collect(), BEFORE, BEHIND).score(&there);
        prop_assert!((after - before).abs() < 1e-6, "{after} instead of {before}");
    }
}

proptest! {
    #[test]
    fn what_floats_between_the_eye_and_the_surface_lowers_the_score_however_far_before_it(
        share in 0.1_f64..0.9, eye in 5.0..50.0_f64, radius in 0.05..0.3_f64,
    ) {
        let truth = Quadric { center: Vector3::zeros(), factor: Matrix3::identity() };
        let samples: Vec<RangeSample> =
            all_around(&truth, 60).into_iter().map(|sample| RangeSample { eye, ..sample }).collect();
        let RangeSample { point, direction, .. } = samples[7];
        let factor = Matrix3::identity() * radius;
        let floats = Quadric { center: point - direction * (share * eye), factor };
        let beyond = Quadric { center: point - direction * (eye + 1.1 * radius), factor };
        let term = RangeSamples::new(samples, BEFORE, BEHIND);
        let alone = term.score(&[truth]);
        prop_assert!(term.score(&[truth, floats]) < alone - 1e-4);
        prop_assert!(term.open(&[truth]).score(&[floats]) < 0.0);
        // Behind the eye nothing was seen.
        prop_assert!((term.score(&[truth, beyond]) - alone).abs() < 1e-12);
    }
}

#[test]
fn directions_determine_the_distance_of_the_eye() {
    let points = [[1.0, 2.0, 3.0]; 3];
    let given = [[0.0, 3.0, 4.0], [0.0, -1e-9, 0.0], [f64::MAX, f64::MAX, 0.0]];
    let samples = RangeSample::join(&points, &given).unwrap();
    for (sample, eye) in samples.iter().zip([5.0, 1e-9, f64::INFINITY]) {
        assert!((sample.direction.norm() - 1.0).abs() < 1e-12);
        assert!(sample.eye == eye || (sample.eye - eye).abs() < 1e-12 * eye, "{}", sample.eye);
    }
}

#[test]
fn a_body_that_no_line_meets_and_a_body_of_none_agree_with_nothing() {
    let truth = Quadric { center: Vector3::zeros(), factor: Matrix3::identity() };
    let away = Quadric { center: Vector3::x() * 9.0, ..truth };
    let flat = Quadric { factor: Matrix3::zeros(), ..truth };
    let term = RangeSamples::new(all_around(&truth, 50), BEFORE, BEHIND);
    let mut slopes = [QuadricGradient::default(); 2];
    for body in [&[][..], &[away], &[flat, away]] {
        assert_eq!(term.score(body), 0.0);
    }
    assert_eq!(term.score_and_gradient(&[flat, away], &mut slopes), 0.0);
    assert_eq!(slopes, [QuadricGradient::default(); 2]);
    // Completely in front of the surface: nothing is filled by both.
    let seen = all_around(&truth, 50)[7].point;
    let before = Quadric { factor: Matrix3::identity() * 0.1, center: seen * 1.3 };
    assert!(term.score(&[before]) < 1e-12);
    assert!(term.open(&[]).score(&[before]) < 0.0);
    let none = RangeSamples::new(vec![], BEFORE, BEHIND);
    assert_eq!(none.score(&[truth]), 0.0);
    assert_eq!(none.open(&[truth]).score(&[truth]), 0.0);
}

#[test]
fn numbers_that_are_no_lines_of_sight_are_refused() {
    let ok = [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    let joined = RangeSample::join(&ok, &[[0.0, 0.0, 9.0], [0.0, 3.0, 4.0]]).unwrap();
    assert_eq!(joined[0].direction, Vector3::z());
    assert!((joined[1].direction - Vector3::new(0.0, 0.6, 0.8)).norm() < 1e-15);
    let short = RangeSample::join(&ok, &ok[..1]).unwrap_err();
    assert_eq!(short, RangeSampleError::Count { points: 2, directions: 1 });
    for length in [1e300, 1e-300, f64::MIN_POSITIVE] {
        let direction = RangeSample::join(&ok[..1], &[[length, 0.0, length]]).unwrap()[0].direction;
        assert!((direction.norm() - 1.0).abs() < 1e-12, "{length}");
    }
    for bad in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        let error = RangeSample::join(&ok, &[ok[0], bad]).unwrap_err();
        assert!(matches!(error, RangeSampleError::Numbers { index: 1, .. }));
    }
    let error = RangeSample::join(&[[f64::NAN; 3]], &ok[..1]).unwrap_err();
    assert!(error.to_string().starts_with("point 0"));
}
