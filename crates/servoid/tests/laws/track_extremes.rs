//! Laws of the tracker at the limits of its input: far, near, huge and tiny.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::camera::{Camera, Channels, ImageView, Observation};
use servoid::evolve::{GaError, GaSettings};
use servoid::model::{ModelError, Settings};
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid};
use servoid::track::{Estimate, OneStep, OneStepError, OneStepSettings};
use servoid::track::{TrackError, TrackSettings, Tracker};

fn ball(radius: f64) -> Body {
    let solid = Ellipsoid::new(0, [0.0; 3], [radius; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
    Body::new(Pose::identity(), vec![solid]).unwrap()
}

fn at(place: [f64; 3]) -> Pose {
    Pose::from_rotation(UnitQuaternion::identity(), place.into())
}

/// An image that is different for each seed: noise, with a patch of other colours in the middle.
fn noise(size: [usize; 2], seed: usize) -> Vec<u8> {
    let grain = |at: usize| ((at + seed * 7_919).wrapping_mul(2_654_435_761) >> 11) as u8;
    let [width, height] = size;
    let inside = |at: usize| {
        let (u, v) = (at / 3 % width, at / 3 / width);
        (u * 4 / width).abs_diff(2) < 1 && (v * 4 / height).abs_diff(2) < 1
    };
    (0..3 * width * height)
        .map(|at| if inside(at) && at % 3 == 0 { 200 + grain(at) / 5 } else { grain(at) / 2 })
        .collect()
}

/// The pose of the camera, and the given pose of the object.
type There = (Pose, Pose);

/// Feeds noise to a tracker: starts it at one pose, searches near another and everywhere, and
/// continues tracking.
fn shown(tracker: &mut Tracker, camera: &Camera, first: There, then: There) -> Vec<Estimate> {
    let size = camera.size_px();
    let pictures: Vec<_> = (0..5).map(|seed| noise(size, seed)).collect();
    let seen = |index: usize| Observation {
        time_s: index as f64 / 30.0,
        world_from_camera: vec![if index == 0 { first.0 } else { then.0 }],
        images: vec![Some(ImageView::new(&pictures[index], size, Channels::Rgb).unwrap())],
        depths: Vec::new(),
    };
    let mut estimates = vec![];
    estimates.extend(tracker.start(&seen(0), first.1, &[]));
    estimates.extend(tracker.step(&seen(1)));
    estimates.extend(tracker.find(&seen(2), Some(then.1)));
    estimates.extend(tracker.step(&seen(3)));
    estimates.extend(tracker.find(&seen(4), None));
    estimates
}

/// Returns whether an estimate is finite and in range.
fn is_sound(estimate: &Estimate) -> bool {
    let pose = estimate.world_from_object.matrix();
    (0.0..=1.0).contains(&estimate.confidence)
        && pose.iter().chain(&estimate.covariance).all(|x| x.is_finite())
        && estimate.unobservable.iter().flatten().all(|x| x.is_finite())
}

/// Numbers of any size whose squares are finite.
fn any_size() -> impl Strategy<Value = f64> {
    let sized = |(sign, power): (bool, f64)| if sign { 1.0 } else { -1.0 } * 10_f64.powf(power);
    prop_oneof![
        Just(0.0),
        (any::<bool>(), -1.5..1.5_f64).prop_map(sized),
        (any::<bool>(), -30.0..30.0_f64).prop_map(sized),
    ]
}

fn positive() -> impl Strategy<Value = f64> {
    any_size().prop_map(|x| if x == 0.0 { 1.0 } else { x.abs() })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..Default::default() })]

    #[test]
    fn nothing_is_too_far_too_near_too_large_or_too_small_for_the_tracker(
        size in prop::array::uniform2(1..64_usize), focal in prop::array::uniform2(positive()),
        middle in prop::array::uniform2(any_size()), radii in prop::array::uniform3(positive()),
        center in prop::array::uniform3(any_size()), eye in prop::array::uniform3(any_size()),
        place in prop::array::uniform3(any_size()), turn in prop::array::uniform3(-3.0..3.0_f64),
    ) {
        let camera = Camera::new(size, focal, middle).unwrap();
        let solid = Ellipsoid::new(0, center, radii, [1.0, 0.0, 0.0, 0.0]).unwrap();
        let body = Body::new(Pose::identity(), vec![solid]).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
        let place = Pose::from_rotation(turn, place.into());
        let mut tracker = Tracker::new(&[camera], &body, TrackSettings::default()).unwrap();
        let there = (at(eye), place);
        for estimate in shown(&mut tracker, &camera, there, there) {
            prop_assert!(is_sound(&estimate), "{estimate:?}");
        }
    }

    #[test]
    fn an_object_that_leaps_anywhere_does_no_harm(
        size in prop::array::uniform2(24..64_usize), radius in 1e-4..10.0_f64,
        place in prop::array::uniform3(any_size()), eye in prop::array::uniform3(any_size()),
    ) {
        let camera = Camera::new(size, [80.0; 2], size.map(|n| 0.5 * n as f64)).unwrap();
        let mut tracker = Tracker::new(&[camera], &ball(radius), TrackSettings::default()).unwrap();
        let before = (Pose::identity(), at([0.0, 0.0, 2.5 * radius]));
        for estimate in shown(&mut tracker, &camera, before, (at(eye), at(place))) {
            prop_assert!(is_sound(&estimate), "{estimate:?}");
        }
    }

    #[test]
    fn settings_at_the_ends_of_their_ranges_do_no_harm(
        population in prop_oneof![Just(8_usize), Just(4096)], generations in 1..4_usize,
        points in prop_oneof![Just(1_usize), Just(1000)],
        budget_s in prop_oneof![Just(None), Just(Some(1e-300)), Just(Some(f64::MAX))],
        kinds in prop_oneof![Just((true, true)), Just((true, false)), Just((false, true))],
        least in prop_oneof![Just((1.0, 1.0)), Just((1.0, 1e-300)), Just((1e-300, 1e-300))],
        seed in prop_oneof![Just(0), Just(u64::MAX)],
    ) {
        let ((surface, region), (trusted, held)) = (kinds, least);
        let settings = TrackSettings::default().with(|it| { it.population = population; it.generations = generations; it.points = points; it.budget_s = budget_s; it.surface = surface; it.region = region; it.trusted = trusted; it.held = held; it.seed = seed; });
        let camera = Camera::new([64, 48], [80.0; 2], [32.0, 24.0]).unwrap();
        let mut tracker = Tracker::new(&[camera], &ball(0.05), settings).unwrap();
        let there = (Pose::identity(), at([0.0, 0.0, 0.3]));
        for estimate in shown(&mut tracker, &camera, there, there) {
            prop_assert!(is_sound(&estimate), "{estimate:?}");
        }
    }
}

#[test]
fn an_object_beyond_all_pixels_is_in_no_image() {
    let camera = Camera::new([64, 48], [80.0; 2], [32.0, 24.0]).unwrap();
    let picture = noise([64, 48], 0);
    let seen = Observation {
        time_s: 0.0,
        world_from_camera: vec![Pose::identity()],
        images: vec![Some(ImageView::new(&picture, [64, 48], Channels::Rgb).unwrap())],
        depths: Vec::new(),
    };
    for far in [1e6, 1e18, 1e30, -1e6, -1e18, -1e30] {
        for place in [[far, 0.0, 0.5], [0.0, far, 0.5]] {
            let settings = TrackSettings::default();
            let mut tracker = Tracker::new(&[camera], &ball(0.05), settings).unwrap();
            assert_eq!(tracker.start(&seen, at(place), &[]), Err(TrackError::NotInView));
        }
    }
}

#[test]
fn seeking_anywhere_costs_no_more_in_images_of_odd_shapes() {
    let cost_of = |size: [usize; 2]| {
        let camera = Camera::new(size, [80.0; 2], size.map(|n| 0.5 * n as f64)).unwrap();
        let place = at([0.0, 0.0, 0.3]);
        let learned = Camera::new([64, 48], [80.0; 2], [32.0, 24.0]).unwrap();
        let settings = TrackSettings::default();
        let mut teacher = Tracker::new(&[learned], &ball(0.05), settings).unwrap();
        let picture = noise([64, 48], 0);
        let image = ImageView::new(&picture, [64, 48], Channels::Rgb).unwrap();
        let world_from_camera = vec![Pose::identity()];
        let images = vec![Some(image)];
        let seen = Observation { time_s: 0.0, world_from_camera, images, depths: Vec::new() };
        teacher.start(&seen, place, &[]).unwrap();
        let mut tracker = Tracker::new(&[camera], &ball(0.05), settings).unwrap();
        tracker.recall(&teacher.appearance()).unwrap();
        let picture = noise(size, 1);
        let image = ImageView::new(&picture, size, Channels::Rgb).unwrap();
        let world_from_camera = vec![Pose::identity()];
        let seen = Observation {
            time_s: 0.0,
            world_from_camera,
            images: vec![Some(image)],
            depths: Vec::new(),
        };
        tracker.find(&seen, None).unwrap().evaluations
    };
    let usual = cost_of([64, 48]);
    for size in [[48, 64], [8192, 8], [8, 8192], [1, 8192], [1, 1]] {
        let cost = cost_of(size);
        // Five rounds at most, and at least one if it is found.
        assert!(cost <= 15 * usual, "{size:?}: {cost} hypotheses, {usual} usually");
    }
}

#[test]
fn a_search_without_bounds_is_refused_before_it_takes_memory() {
    let breeds = |population| GaSettings::default().with(|it| it.population = population);
    let camera = Camera::new([64, 48], [80.0; 2], [32.0, 24.0]).unwrap();
    let search = breeds(usize::MAX);
    let settings = OneStepSettings::default().with(|it| it.search = search);
    let refused = OneStep::new(&[camera], &ball(0.05), settings).map(|_| ());
    let is_population =
        |error: &GaError| matches!(error, GaError::Setting { name, .. } if *name == "population");
    assert!(matches!(&refused, Err(OneStepError::Search(e)) if is_population(e)), "{refused:?}");
    let usual = Settings::default();
    for (growth, what) in [
        (usual.with(|it| it.islands = usize::MAX), "islands"),
        (usual.with(|it| it.lines = usize::MAX), "lines"),
        (usual.with(|it| it.splits = usize::MAX), "splits"),
        (usual.with(|it| it.generations = usize::MAX), "generations"),
        (usual.with(|it| it.reseeds = usize::MAX), "reseeds"),
        (usual.with(|it| it.singles = usize::MAX), "singles"),
        (usual.with(|it| it.pairs = usize::MAX), "pairs"),
        (usual.with(|it| it.overshoot = usize::MAX), "overshoot"),
        (usual.with(|it| it.threads = usize::MAX), "threads"),
    ] {
        let settings = TrackSettings::default().with(|it| it.growth = growth);
        let refused = Tracker::new(&[camera], &ball(0.05), settings).map(|_| ());
        let Err(TrackError::Model(ModelError::Setting { name, .. })) = refused else {
            panic!("{what}: {refused:?}");
        };
        assert_eq!(name, what);
    }
    let settings = TrackSettings::default()
        .with(|it| it.growth = usual.with(|it| it.search = breeds(usize::MAX)));
    let refused = Tracker::new(&[camera], &ball(0.05), settings).map(|_| ());
    assert!(matches!(refused, Err(TrackError::Model(ModelError::Search(_)))), "{refused:?}");
}
