//! Laws of the tracker, on small scenes drawn by the tests.

use crate::scenes::holds;
use crate::shapes::drawn::{Shot, Stage, eyes};
use nalgebra::{UnitQuaternion, Vector3};
use servoid::camera::{Channels, ImageView};
use servoid::fitness::Backend;
use servoid::pose::Pose;
use servoid::track::{Estimate, Notice, Status, TrackError, TrackSettings, Tracker};

/// Initial pose of the object.
pub fn start() -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 0.2);
    Pose::from_rotation(turn, Vector3::new(0.01, -0.01, 0.05))
}

/// Pose of an object in uniform motion: 9 cm and 50 degrees per second.
pub fn moving(index: usize) -> Pose {
    let time = index as f64 / 30.0;
    let shift = Vector3::new(0.06, -0.03, 0.06) * time;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 0.6, -0.4) * time);
    Pose::from_rotation(turn * start().rotation(), start().translation() + shift)
}

/// Returns a stage and settings with a seed.
pub fn seeded(seed: u64, stage: Stage) -> (Stage, TrackSettings) {
    (Stage { seed, ..stage }, TrackSettings::default().with(|it| it.seed = seed))
}

pub fn started(stage: &Stage, settings: TrackSettings, shot: &Shot, pose: Pose) -> Tracker {
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    let estimate = tracker.start(&shot.observation(), pose, &[]).unwrap();
    // A given pose is known, even if the images hardly constrain its orientation.
    assert_eq!((estimate.status, estimate.located), (Status::Tracking, true));
    assert!(!estimate.notices.contains(&Notice::TurnOpen));
    tracker
}

/// Tracks the moving object; returns the estimates after the first.
pub fn followed(stage: &Stage, settings: TrackSettings, count: usize) -> Vec<Estimate> {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&moving(index)));
    let mut tracker = started(stage, settings, &shot(0), moving(0));
    (1..count).map(|index| tracker.step(&shot(index).observation()).unwrap()).collect()
}

#[test]
fn a_moving_and_turning_object_is_followed_within_a_millimetre_and_a_degree() {
    holds("track moving");
}

#[test]
fn grey_pictures_will_do() {
    holds("track grey");
}

#[test]
fn points_alone_and_colours_alone_will_do() {
    holds("track by points");
    holds("track plain by colours");
    holds("track plain");
}

#[test]
fn the_same_seed_gives_the_same_bits_with_each_back_end() {
    let bits = || -> Vec<u64> {
        let estimates = followed(&Stage::textured(), TrackSettings::default(), 6);
        let numbers = estimates.iter().flat_map(|e| {
            let pose = e.world_from_object.matrix();
            pose.iter().chain(&e.covariance).copied().chain([e.confidence]).collect::<Vec<_>>()
        });
        numbers.map(f64::to_bits).collect()
    };
    let fastest = bits();
    // Other tests may run with this backend, too: their results do not change.
    for backend in Backend::available() {
        backend.force();
        assert_eq!(bits(), fastest, "{backend:?}");
    }
}

#[test]
fn a_second_start_equals_a_first() {
    let stage = Stage::textured();
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&moving(index)));
    let (one, two, three) = (shot(3), shot(4), shot(5));
    let mut old = started(&stage, TrackSettings::default(), &shot(0), moving(0));
    for index in 1..3 {
        old.step(&shot(index).observation()).unwrap();
    }
    let mut new = Tracker::new(&stage.cameras(), &stage.body, TrackSettings::default()).unwrap();
    let mut estimates = [&mut old, &mut new].map(|tracker| {
        let first = tracker.start(&one.observation(), moving(3), &[]).unwrap();
        let later = [&two, &three].map(|shot| tracker.step(&shot.observation()).unwrap());
        [vec![first], later.into()].concat()
    });
    let numbers = |one: &Estimate| one.keyframes.map(|keyframe| keyframe.map(|(number, _)| number));
    let [again, first] = estimates.each_ref().map(|all| numbers(&all[0])[0].unwrap());
    assert!(again > first, "a keyframe's number means no other one");
    for one in estimates.iter_mut().flatten() {
        (one.timing, one.keyframes) = (Default::default(), [None; 2]);
    }
    let [again, first] = estimates;
    assert_eq!(again, first);
}

#[test]
fn the_covariance_is_symmetric_and_positive() {
    for stage in [Stage::textured(), Stage::ball(0.0)] {
        for estimate in followed(&stage, TrackSettings::default(), 4) {
            let covariance = estimate.covariance;
            assert!((covariance - covariance.transpose()).amax() < 1e-9 * covariance.amax());
            assert!(covariance.symmetric_eigenvalues().min() > 0.0, "{covariance}");
        }
    }
}

#[test]
fn the_turns_of_a_plain_ball_are_open_and_those_of_a_patterned_one_are_not() {
    holds("track balls");
}

/// Tracks a ball at rest; returns the last estimate.
pub fn followed_ball(stage: &Stage, settings: TrackSettings) -> Estimate {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&start()));
    let mut tracker = started(stage, settings, &shot(0), start());
    (1..4).map(|index| tracker.step(&shot(index).observation()).unwrap()).last().unwrap()
}

#[test]
fn where_the_eyes_turn_after_it_an_object_at_rest_stays_at_rest() {
    holds("track turning eyes");
}

#[test]
fn an_object_that_is_gone_is_lost_and_found_again_when_it_is_back() {
    holds("track gone");
}

#[test]
fn an_object_that_is_half_hidden_is_followed_and_reported_as_hidden() {
    holds("track half hidden");
}

#[test]
fn an_object_that_grows_beyond_the_images_is_tracked_as_surely_as_before() {
    holds("track into the camera");
}

#[test]
fn what_lies_beside_the_image_is_not_reported_as_hidden() {
    holds("track out of the image");
}

#[test]
fn a_grey_camera_beside_one_with_colours_will_do() {
    holds("track grey beside colour");
}

#[test]
fn a_budget_that_is_over_at_once_leaves_one_generation_and_no_rival_and_few_points_will_do() {
    let few = TrackSettings::default().with(|it| it.points = 3);
    let light = few.with(|it| {
        it.generations = 1000;
        it.budget_s = Some(1e-9);
    });
    let [one, other] = [few, light].map(|settings| {
        let mut estimates = followed(&Stage::textured(), settings, 8);
        estimates.iter_mut().for_each(|one| one.timing = Default::default());
        estimates
    });
    assert!(other.iter().all(|light| light.evaluations <= few.population));
    let sought = one.iter().position(|one| one.evaluations > few.population);
    let before = sought.expect("a rival is sought where the orientation may have drifted");
    assert_eq!(one[..before], other[..before]);
    for (index, estimate) in one.iter().chain(&other).enumerate() {
        let index = index % one.len();
        let off = estimate.world_from_object.inverse() * moving(index + 1);
        assert!(
            estimate.located && off.translation().norm() < 0.005,
            "image {index}: {estimate:?}"
        );
    }
}

#[test]
fn an_object_is_found_near_a_pose_and_anywhere_without_one() {
    holds("track found anywhere");
    holds("track found near");
}

#[test]
fn what_cannot_be_tracked_is_refused() {
    let stage = Stage::textured();
    let made = |settings| Tracker::new(&stage.cameras(), &stage.body, settings).map(|_| ());
    let usual = TrackSettings::default();
    for (settings, what) in [
        (usual.with(|it| it.population = 7), "population"),
        (usual.with(|it| it.generations = 0), "generations"),
        (usual.with(|it| it.budget_s = Some(0.0)), "budget_s"),
        (usual.with(|it| it.budget_s = Some(f64::NAN)), "budget_s"),
        (
            usual.with(|it| {
                it.surface = false;
                it.region = false;
            }),
            "surface and region",
        ),
        (usual.with(|it| it.points = 0), "points"),
        (usual.with(|it| it.trusted = 1.1), "trusted"),
        (usual.with(|it| it.trusted = f64::NAN), "trusted"),
        (usual.with(|it| it.held = 0.0), "held"),
        (
            usual.with(|it| {
                it.trusted = 0.3;
                it.held = 0.4;
            }),
            "held",
        ),
    ] {
        let refused = made(settings);
        assert!(matches!(refused, Err(TrackError::Setting { name, .. }) if name == what));
    }
    let growth = usual.growth.with(|it| it.max_ellipsoids = 0);
    assert!(matches!(made(usual.with(|it| it.growth = growth)), Err(TrackError::Model(_))));
    let none = Tracker::new(&[], &stage.body, usual);
    assert!(matches!(none, Err(TrackError::NoCamera)));
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, usual).unwrap();
    let behind = Pose::from_rotation(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, -3.0));
    let unseen = tracker.start(&shot.observation(), behind, &[]);
    assert_eq!(unseen, Err(TrackError::NotInView));
    let size = stage.cameras()[0].size_px();
    let black = vec![0_u8; 3 * size[0] * size[1]];
    let mut dark = shot.observation();
    let image = ImageView::new(&black, size, Channels::Rgb).unwrap();
    dark.images.iter_mut().for_each(|seen| *seen = Some(image));
    let blank = vec![Notice::Blank(0), Notice::Blank(1)];
    assert_eq!(tracker.start(&dark, start(), &[]), Err(TrackError::NoUse(blank)));
    let mut fresh = Tracker::new(&stage.cameras(), &stage.body, usual).unwrap();
    assert_eq!(fresh.find(&shot.observation(), None), Err(TrackError::NothingKnown));
    assert_eq!(fresh.step(&shot.observation()), Err(TrackError::NotStarted));
    let mut one_eyed = shot.observation();
    one_eyed.images.pop();
    let wrong = TrackError::Count { what: "images", cameras: 2, given: 1 };
    assert_eq!(fresh.step(&one_eyed), Err(wrong));
    let mut timeless = shot.observation();
    timeless.time_s = f64::INFINITY;
    assert_eq!(fresh.step(&timeless), Err(TrackError::Time(f64::INFINITY)));
}

/// Poses around the start, on a grid, the start itself first.
pub fn around_the_start() -> Vec<Pose> {
    let offs = (0..700).map(|index| {
        let step = |axis: i32| f64::from(index / 7_i32.pow(axis as u32) % 7 - 3) * 0.004;
        Vector3::new(step(0), step(1), step(2))
    });
    let start = start();
    let moved = offs.map(|off| Pose::from_rotation(start.rotation(), start.translation() + off));
    std::iter::once(start).chain(moved).collect()
}

#[test]
fn no_pose_around_is_worth_more_than_the_true_one() {
    holds("track worth");
}

#[test]
fn poses_are_worth_the_same_bits_on_any_number_of_threads_and_nothing_is_learned() {
    let stage = Stage::textured();
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let tracker = started(&stage, TrackSettings::default(), &shot, start());
    let next = stage.shot(1, &eyes(), Some(&start()));
    let bits = |threads: usize| -> Vec<u64> {
        let score_terms =
            tracker.score_terms(&next.observation(), &around_the_start(), 2, threads).unwrap();
        score_terms.iter().flat_map(|one| [one.region.to_bits(), one.surface.to_bits()]).collect()
    };
    assert_eq!(bits(1), bits(3));
    assert_eq!(bits(1), bits(1));
}

#[test]
fn what_is_not_known_or_not_there_is_worth_an_error() {
    let stage = Stage::textured();
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let fresh = Tracker::new(&stage.cameras(), &stage.body, TrackSettings::default()).unwrap();
    let asked = fresh.score_terms(&shot.observation(), &[start()], 0, 1);
    assert_eq!(asked.unwrap_err(), TrackError::NothingKnown);
    let tracker = started(&stage, TrackSettings::default(), &shot, start());
    let asked = tracker.score_terms(&shot.observation(), &[start()], 3, 1);
    assert!(asked.unwrap_err().to_string().contains("resolution"));
}
