//! Laws of the tracker, on small scenes drawn by the tests.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod shapes;

use nalgebra::{UnitQuaternion, Vector3};
use servoid::model::Settings;
use servoid::observe::Channels;
use servoid::pose::{Pose, Twist};
use servoid::track::{Estimate, Notice, Status, TrackError, TrackSettings, Tracker};
use shapes::drawn::{Shot, Stage, eyes, eyes_at};

/// Where the object starts.
fn start() -> Pose {
    let turn = UnitQuaternion::from_euler_angles(0.3, -0.4, 0.2);
    Pose::from_rotation(turn, Vector3::new(0.01, -0.01, 0.05))
}

/// Where an object is that moves and turns evenly: 9 cm and 50 degrees a second.
fn moving(index: usize) -> Pose {
    let time = index as f64 / 30.0;
    let shift = Vector3::new(0.06, -0.03, 0.06) * time;
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.5, 0.6, -0.4) * time);
    Pose::from_rotation(turn * start().rotation(), start().translation() + shift)
}

/// Gives how far two poses are apart, in millimetres and degrees.
fn apart(one: &Pose, other: &Pose) -> (f64, f64) {
    let off = one.inverse() * *other;
    (1000.0 * off.translation().norm(), off.rotation().angle().to_degrees())
}

fn started(stage: &Stage, settings: TrackSettings, shot: &Shot, pose: Pose) -> Tracker {
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    let estimate = tracker.start(&shot.observation(), pose, &[]).unwrap();
    assert_eq!(estimate.status, Status::Tracking);
    tracker
}

/// Follows the moving object; gives the estimates after the first.
fn followed(stage: &Stage, settings: TrackSettings, count: usize) -> Vec<Estimate> {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&moving(index)));
    let mut tracker = started(stage, settings, &shot(0), moving(0));
    (1..count).map(|index| tracker.step(&shot(index).observation()).unwrap()).collect()
}

fn assert_near(estimates: &[Estimate], most: (f64, f64)) {
    for (index, estimate) in estimates.iter().enumerate() {
        let (across, turned) = apart(&estimate.world_from_object, &moving(index + 1));
        assert_eq!(estimate.status, Status::Tracking, "image {index}: {}", estimate.confidence);
        assert!(across < most.0 && turned < most.1, "image {index}: {across} mm, {turned} deg");
    }
}

#[test]
fn a_moving_and_turning_object_is_followed_within_a_millimetre_and_a_degree() {
    let estimates = followed(&Stage::textured(), TrackSettings::default(), 20);
    assert_near(&estimates, (1.0, 1.0));
    for estimate in &estimates {
        assert!(estimate.notices.is_empty(), "{:?}", estimate.notices);
        assert!(estimate.unobservable.is_empty() && estimate.evaluations > 0);
        assert!((0.8..=1.0).contains(&estimate.confidence), "{}", estimate.confidence);
    }
}

#[test]
fn grey_pictures_will_do() {
    let stage = Stage { channels: Channels::Grey, ..Stage::textured() };
    assert_near(&followed(&stage, TrackSettings::default(), 10), (1.5, 1.5));
}

#[test]
fn points_alone_and_colours_alone_will_do() {
    let usual = TrackSettings::default();
    let stage = Stage::textured();
    assert_near(&followed(&stage, TrackSettings { region: false, ..usual }, 10), (1.5, 1.5));
    // Outlines tell less: of a plain object they are all that there is.
    let plain = Stage { pattern: 0.0, ..Stage::textured() };
    for settings in [TrackSettings { surface: false, ..usual }, usual] {
        assert_near(&followed(&plain, settings, 10), (4.0, 8.0));
    }
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let bits = || -> Vec<u64> {
        let estimates = followed(&Stage::textured(), TrackSettings::default(), 6);
        let numbers = estimates.iter().flat_map(|e| {
            let pose = e.world_from_object.matrix();
            pose.iter().chain(&e.covariance).copied().chain([e.confidence]).collect::<Vec<_>>()
        });
        numbers.map(f64::to_bits).collect()
    };
    assert_eq!(bits(), bits());
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
    let [plain, patterned] = [0.0, 1.0].map(|pattern| followed_ball(&Stage::ball(pattern)));
    // Of how far away it is, its small outline tells little, too.
    assert!((3..=4).contains(&plain.unobservable.len()), "{:?}", plain.unobservable);
    for axis in 3..6 {
        let share: f64 = plain.unobservable.iter().map(|open| open[axis].powi(2)).sum();
        assert!(share > 0.99, "axis {axis}: {share}");
    }
    for open in &plain.unobservable {
        assert!((open.norm() - 1.0).abs() < 1e-9);
    }
    assert!(patterned.unobservable.is_empty(), "{:?}", patterned.unobservable);
}

fn followed_ball(stage: &Stage) -> Estimate {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&start()));
    let mut tracker = started(stage, TrackSettings::default(), &shot(0), start());
    (1..4).map(|index| tracker.step(&shot(index).observation()).unwrap()).last().unwrap()
}

#[test]
fn where_the_eyes_turn_after_it_an_object_at_rest_stays_at_rest() {
    let stage = Stage::textured();
    let looks = |index: usize| {
        let angle = 0.15 * index as f64;
        eyes_at(&(start().translation() + Vector3::new(angle.sin(), angle.cos() - 1.0, 0.0) * 0.06))
    };
    let shot = |index: usize| stage.shot(index, &looks(index), Some(&start()));
    let mut tracker = started(&stage, TrackSettings::default(), &shot(0), start());
    for index in 1..15 {
        let found = tracker.step(&shot(index).observation()).unwrap();
        let (across, turned) = apart(&found.world_from_object, &start());
        assert!(across < 0.5 && turned < 0.5, "image {index}: {across} mm, {turned} deg");
        assert_eq!(found.status, Status::Tracking);
    }
}

#[test]
fn an_object_that_is_gone_is_lost_and_found_again_when_it_is_back() {
    let stage = Stage::textured();
    let shot = |index: usize, pose: Option<&Pose>| stage.shot(index, &eyes(), pose);
    let mut tracker = started(&stage, TrackSettings::default(), &shot(0, Some(&start())), start());
    for index in 1..5 {
        tracker.step(&shot(index, Some(&start())).observation()).unwrap();
    }
    for index in 5..24 {
        let found = tracker.step(&shot(index, None).observation()).unwrap();
        assert_ne!(found.status, Status::Tracking, "image {index}: {}", found.confidence);
    }
    let gone = tracker.step(&shot(24, None).observation()).unwrap();
    assert_eq!(gone.status, Status::Lost);
    // It comes back elsewhere and turned.
    let back = start() * Pose::exp(&Twist::new(0.03, -0.04, 0.02, 0.2, -0.3, 0.3));
    let mut last = None;
    for index in 25..32 {
        last = Some(tracker.step(&shot(index, Some(&back)).observation()).unwrap());
    }
    let last = last.unwrap();
    let (across, turned) = apart(&last.world_from_object, &back);
    assert_eq!(last.status, Status::Tracking);
    assert!(across < 1.0 && turned < 1.0, "{across} mm, {turned} deg");
}

#[test]
fn an_object_that_is_half_hidden_is_followed_and_said_to_be() {
    let stage = Stage::textured();
    let half = Stage { hidden_left_of: 160, ..Stage::textured() };
    let whole = |index: usize| stage.shot(index, &eyes(), Some(&moving(index)));
    let mut tracker = started(&stage, TrackSettings::default(), &whole(0), moving(0));
    for index in 1..4 {
        tracker.step(&whole(index).observation()).unwrap();
    }
    for index in 4..12 {
        let shot = half.shot(index, &eyes(), Some(&moving(index)));
        let found = tracker.step(&shot.observation()).unwrap();
        let (across, turned) = apart(&found.world_from_object, &moving(index));
        assert!(across < 3.0 && turned < 3.0, "image {index}: {across} mm, {turned} deg");
        let said = found.notices.iter().any(|notice| matches!(notice, Notice::Hidden { .. }));
        // What stays hidden is no longer expected, so that only the first images say so.
        assert!(said || index > 5, "image {index}: {:?} {}", found.notices, found.confidence);
    }
}

#[test]
fn an_object_is_found_near_a_pose_and_anywhere_without_one() {
    let stage = Stage::textured();
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&start()));
    let mut tracker = started(&stage, TrackSettings::default(), &shot(0), start());
    for index in 1..6 {
        tracker.step(&shot(index).observation()).unwrap();
    }
    let found = tracker.clone().find(&shot(7).observation(), None).unwrap();
    let (across, turned) = apart(&found.world_from_object, &start());
    assert!(across < 1.0 && turned < 1.0, "{across} mm, {turned} deg");
    let near = start() * Pose::exp(&Twist::new(0.02, 0.0, -0.02, 0.2, 0.2, 0.2));
    let found = tracker.find(&shot(7).observation(), Some(near)).unwrap();
    let (across, turned) = apart(&found.world_from_object, &start());
    assert!(across < 1.0 && turned < 1.0, "{across} mm, {turned} deg");
}

#[test]
fn what_cannot_be_tracked_is_refused() {
    let stage = Stage::textured();
    let made = |settings| Tracker::new(&stage.cameras(), &stage.body, settings).map(|_| ());
    let usual = TrackSettings::default();
    for (settings, what) in [
        (TrackSettings { population: 7, ..usual }, "population"),
        (TrackSettings { generations: 0, ..usual }, "generations"),
        (TrackSettings { budget_s: Some(0.0), ..usual }, "budget_s"),
        (TrackSettings { budget_s: Some(f64::NAN), ..usual }, "budget_s"),
        (TrackSettings { surface: false, region: false, ..usual }, "surface and region"),
        (TrackSettings { points: 0, ..usual }, "points"),
        (TrackSettings { trusted: 1.1, ..usual }, "trusted"),
        (TrackSettings { trusted: f64::NAN, ..usual }, "trusted"),
        (TrackSettings { held: 0.0, ..usual }, "held"),
        (TrackSettings { trusted: 0.3, held: 0.4, ..usual }, "held"),
    ] {
        let refused = made(settings);
        assert!(matches!(refused, Err(TrackError::Setting { name, .. }) if name == what));
    }
    let growth = Settings { max_ellipsoids: 0, ..usual.growth };
    assert!(matches!(made(TrackSettings { growth, ..usual }), Err(TrackError::Model(_))));
    let none = Tracker::new(&[], &stage.body, usual);
    assert!(matches!(none, Err(TrackError::NoCamera)));
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, usual).unwrap();
    let behind = Pose::from_rotation(UnitQuaternion::identity(), Vector3::new(0.0, 0.0, -3.0));
    let start = tracker.start(&shot.observation(), behind, &[]);
    assert_eq!(start, Err(TrackError::NotInView));
    let mut fresh = Tracker::new(&stage.cameras(), &stage.body, usual).unwrap();
    assert_eq!(fresh.find(&shot.observation(), None), Err(TrackError::NothingKnown));
    let mut one_eyed = shot.observation();
    one_eyed.images.pop();
    let wrong = TrackError::Count { what: "images", cameras: 2, given: 1 };
    assert_eq!(fresh.step(&one_eyed), Err(wrong));
    let mut timeless = shot.observation();
    timeless.time_s = f64::INFINITY;
    assert_eq!(fresh.step(&timeless), Err(TrackError::Time(f64::INFINITY)));
}

/// Poses around the start, on a grid, the start itself first.
fn around_the_start() -> Vec<Pose> {
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
    let stage = Stage::textured();
    let tracker = started(
        &stage,
        TrackSettings::default(),
        &stage.shot(0, &eyes(), Some(&moving(3))),
        moving(3),
    );
    let shot = stage.shot(1, &eyes(), Some(&start()));
    let worths = tracker.worths(&shot.observation(), &around_the_start(), 0, 0).unwrap();
    let best = worths.iter().map(|one| one.total()).fold(f64::NEG_INFINITY, f64::max);
    assert!(worths[0].total() > best - 0.02, "{} of {best}", worths[0].total());
    assert!(worths[0].region > 0.5 && worths[0].surface > 0.5, "{:?}", worths[0]);
}

#[test]
fn poses_are_worth_the_same_bits_on_any_number_of_threads_and_nothing_is_learned() {
    let stage = Stage::textured();
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let tracker = started(&stage, TrackSettings::default(), &shot, start());
    let next = stage.shot(1, &eyes(), Some(&start()));
    let bits = |threads: usize| -> Vec<u64> {
        let worths = tracker.worths(&next.observation(), &around_the_start(), 2, threads).unwrap();
        worths.iter().flat_map(|one| [one.region.to_bits(), one.surface.to_bits()]).collect()
    };
    assert_eq!(bits(1), bits(3));
    assert_eq!(bits(1), bits(1));
}

#[test]
fn what_is_not_known_or_not_there_is_worth_an_error() {
    let stage = Stage::textured();
    let shot = stage.shot(0, &eyes(), Some(&start()));
    let fresh = Tracker::new(&stage.cameras(), &stage.body, TrackSettings::default()).unwrap();
    let asked = fresh.worths(&shot.observation(), &[start()], 0, 1);
    assert_eq!(asked.unwrap_err(), TrackError::NothingKnown);
    let tracker = started(&stage, TrackSettings::default(), &shot, start());
    let asked = tracker.worths(&shot.observation(), &[start()], 3, 1);
    assert!(asked.unwrap_err().to_string().contains("resolution"));
}
