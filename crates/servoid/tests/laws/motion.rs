//! Laws of the estimated motion of an object.

use proptest::prelude::*;
use servoid::servo::{Measurement, Motion, MotionError, MotionModel, MotionPrior, Noise};

const NOISE: f64 = 3e-4; // m

fn prior() -> MotionPrior {
    let singer = |jerk| MotionModel::Singer { jerk, lasting_s: 2.0 };
    MotionPrior {
        rest: 1e-3,
        models: vec![singer(0.7), singer(0.05)],
        change_s: 1.5,
        lasting_s: 3.0,
    }
}

/// Independent noise of three coordinates.
fn noise() -> Noise {
    let mut fresh = vec![0.0; 9];
    for i in 0..3 {
        fresh[4 * i] = NOISE * NOISE;
    }
    Noise::new(fresh, 0.0, 10.0).unwrap()
}

const AXES: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Returns where a motion is expected after places that come with a gap in seconds each.
fn told(places: &[([f64; 3], f64)], axes: &[f64; 9], ahead_s: f64) -> [f64; 3] {
    let mut motion = Motion::new(prior(), noise(), [0.3, 0.2]);
    let measurement = Measurement::along(axes, &noise()).unwrap();
    let mut reference = [0.0; 3];
    for (place, elapsed_s) in places {
        motion.advance(*elapsed_s, noise()).unwrap();
        let gap: [f64; 3] = std::array::from_fn(|i| place[i] - reference[i]);
        let along: Vec<f64> =
            axes.chunks(3).map(|axis| (0..3).map(|i| axis[i] * gap[i]).sum()).collect();
        motion.correct(&measurement, &along, 16.0).unwrap();
        for (sum, moved) in reference.iter_mut().zip(motion.settle()) {
            *sum += moved;
        }
    }
    let state = motion.ahead(ahead_s).state;
    std::array::from_fn(|i| reference[i] + state[i])
}

proptest! {
    #[test]
    fn the_axes_along_which_a_place_is_measured_do_not_matter(
        angle in 0.0..6.0_f64,
        steps in prop::collection::vec((prop::array::uniform3(-0.01..0.01_f64), 0.01..0.1_f64), 1..20),
    ) {
        let (sin, cos) = angle.sin_cos();
        let turned = [cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0];
        let (one, other) = (told(&steps, &AXES, 0.05), told(&steps, &turned, 0.05));
        for (a, b) in one.iter().zip(other) {
            prop_assert!((a - b).abs() < 1e-9, "{one:?} {other:?}");
        }
    }
}

#[test]
fn a_target_that_goes_evenly_is_expected_where_it_will_be() {
    let at = |time_s: f64| [0.1 * time_s, -0.05 * time_s, 0.0];
    let steps: Vec<_> = (1..60).map(|i| (at(f64::from(i) / 30.0), 1.0 / 30.0)).collect();
    let (expected, true_place) = (told(&steps, &AXES, 0.1), at(59.0 / 30.0 + 0.1));
    for (a, b) in expected.iter().zip(true_place) {
        assert!((a - b).abs() < 1e-3, "{expected:?} {true_place:?}");
    }
}

#[test]
fn numbers_of_another_count_are_refused() {
    let mut motion = Motion::new(prior(), noise(), [0.3, 0.2]);
    let refused = motion.inflate(&[0.0; 4]).unwrap_err();
    assert_eq!(refused, MotionError::Size { what: "an added covariance", wanted: 9, given: 4 });
    assert!(Measurement::along(&[1.0, 0.0], &noise()).is_err());
    assert!(Noise::new(vec![1.0; 5], 0.0, 1.0).is_err());
    assert!(Noise::new(Vec::new(), 0.0, 1.0).is_err());
}

#[test]
fn a_measurement_that_tells_nothing_is_refused_and_changes_nothing() {
    let mut motion = Motion::new(prior(), noise(), [0.3, 0.2]);
    let before = motion.ahead(0.1);
    let usual = Measurement::along(&AXES, &noise()).unwrap();
    let nowhere = motion.correct(&usual, &[f64::NAN, 0.0, 0.0], 16.0);
    assert!(matches!(nowhere, Err(MotionError::NotFinite(_))));
    let none = Measurement::along(&[], &noise()).unwrap();
    assert_eq!(motion.correct(&none, &[], 16.0), Err(MotionError::NoAxis));
    for variance in [-1.0, f64::NAN] {
        let spread = AXES.map(|x| variance * x).to_vec();
        let odd = Measurement::of_place(&AXES, spread).unwrap();
        let refused = motion.correct(&odd, &[0.0; 3], 16.0);
        assert!(matches!(refused, Err(MotionError::Innovation(_))), "{variance}");
    }
    assert_eq!(motion.ahead(0.1), before);
}

#[test]
fn a_motion_that_only_rests_goes_on() {
    let resting = MotionPrior { models: Vec::new(), ..prior() };
    let mut motion = Motion::new(resting, noise(), [0.3, 0.2]);
    for elapsed_s in [0.0, 0.1] {
        motion.advance(elapsed_s, noise()).unwrap();
        assert_eq!(motion.going(), 0.0);
        assert!(motion.ahead(0.1).covariance.iter().all(|x| x.is_finite()));
    }
}
