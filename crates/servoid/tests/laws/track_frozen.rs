//! Laws of frozen images: they are trusted as long as their content cannot be elsewhere.

use nalgebra::{UnitQuaternion, Vector3};
use servoid::pose::Pose;
use servoid::track::{Estimate, Notice, Status, TrackSettings, Tracker};

use crate::shapes::drawn::{Shot, Stage, eyes};
use crate::track_faults::start;

/// Approximate bounding radius of the drawn object, in metres.
const RADIUS: f64 = 0.08;
const RATE_HZ: f64 = 10.0;

/// Pose of an object that moved and rotated by given amounts.
fn moved(across: f64, turn: f64) -> Pose {
    let start = start();
    let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * turn);
    let way = Vector3::new(across, 0.4 * across, 0.0);
    Pose::from_rotation(turn * start.rotation(), start.translation() + way)
}

/// Starts a tracker at the object's pose in a first shot.
fn started(stage: &Stage, first: &Shot, pose: Pose) -> Tracker {
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    tracker.start(&first.observation(), pose, &[]).unwrap();
    tracker
}

/// Returns the error of an estimate's position, in metres.
fn off(found: &Estimate, pose: &Pose) -> f64 {
    (found.world_from_object.translation() - pose.translation()).norm()
}

fn shot(grain: usize, count: usize, pose: &Pose) -> Shot {
    let time_s = count as f64 / RATE_HZ;
    Shot { time_s, ..Stage::textured().shot(grain, &eyes(), Some(pose)) }
}

/// Tracks an object through new images, then repeats the last of them for some seconds; returns the
/// estimates for those, with the seconds since it was new.
fn frozen(poses: &[Pose], grain: GrainOf, seconds: f64) -> Vec<(f64, Estimate)> {
    let stage = Stage::textured();
    let mut last = shot(grain(0), 0, &poses[0]);
    let mut tracker = started(&stage, &last, poses[0]);
    for (count, pose) in poses.iter().enumerate().skip(1) {
        last = shot(grain(count), count, pose);
        tracker.step(&last.observation()).unwrap();
    }
    let (new_s, steps) = (last.time_s, (seconds * RATE_HZ) as usize);
    let again = (1..=steps).map(|step| {
        last.time_s = new_s + step as f64 / RATE_HZ;
        (last.time_s - new_s, tracker.step(&last.observation()).unwrap())
    });
    again.collect()
}

/// Returns the noise seed of an image, by its number.
type GrainOf = fn(usize) -> usize;

fn is_reported(found: &Estimate) -> bool {
    found.notices.contains(&Notice::Outdated)
}

/// Distance moved, in radii, by an object that moves uniformly for a second, then slows down for
/// two, and rests.
fn slowed_down(count: usize) -> f64 {
    let seconds = count as f64 / RATE_HZ;
    let slowing = (0.5 * (seconds - 1.0)).clamp(0.0, 1.0);
    0.3 * (seconds.min(1.0) + 2.0 * slowing - slowing * slowing)
}

#[test]
fn images_that_freeze_before_what_moves_slowly_are_reported_before_they_are_wrong() {
    const SPEED: f64 = 0.15; // radii, and radians, per second
    for (across, turn) in [(SPEED * RADIUS, 0.0), (0.0, SPEED)] {
        let place = |seconds: f64| moved(across * seconds, turn * seconds);
        let poses: Vec<Pose> = (0..25).map(|count| place(count as f64 / RATE_HZ)).collect();
        let estimates = frozen(&poses, |count| count, 10.0);
        for (seconds, found) in &estimates {
            let true_pose = place(24.0 / RATE_HZ + seconds);
            let off = off(found, &true_pose);
            let turned = found.world_from_object.rotation().angle_to(&true_pose.rotation());
            let wrong = off > 0.02 || turned > 15_f64.to_radians();
            assert!(!(wrong && found.status == Status::Tracking), "{seconds} s: {off} m, {turned}");
            assert!(*seconds < 2.0 || is_reported(found), "{across} {turn}: {seconds} s");
        }
    }
}

#[test]
fn images_that_freeze_as_an_object_starts_are_reported_before_they_are_wrong() {
    const RATE_HZ: f64 = 30.0;
    const STARTS_AT: usize = 20;
    // Its acceleration grows, so that no velocity seen before tells how far it goes.
    let place = |count: usize| {
        let seconds = count.saturating_sub(STARTS_AT) as f64 / RATE_HZ;
        moved(0.07 * RADIUS * seconds.powi(3), 0.0)
    };
    let stage = Stage::textured();
    for frozen_from in [STARTS_AT + 15, STARTS_AT + 18] {
        let first = stage.shot(0, &eyes(), Some(&place(0)));
        let mut tracker = started(&stage, &first, place(0));
        let mut last = first;
        for count in 1..frozen_from + 60 {
            if count <= frozen_from {
                last = stage.shot(count, &eyes(), Some(&place(count)));
            }
            last.time_s = count as f64 / RATE_HZ;
            let found = tracker.step(&last.observation()).unwrap();
            let off = off(&found, &place(count));
            let trusted = found.status == Status::Tracking;
            assert!(trusted || count > frozen_from, "{frozen_from}, {count}: not followed");
            assert!(!trusted || off < 0.02, "{frozen_from}, {count}: {off} m");
        }
    }
}

#[test]
fn what_rests_is_believed_however_long_its_images_stay_the_same() {
    let rests: Vec<Pose> = (0..25).map(|_| start()).collect();
    let stops: Vec<Pose> = (0..40).map(|count| moved(RADIUS * slowed_down(count), 0.0)).collect();
    // With different noise in all images, with the same noise, and with the same since it came to
    // rest.
    let cases: [(&[Pose], GrainOf); 4] =
        [(&rests, |count| count), (&rests, |_| 0), (&stops, |count| count), (&stops, |_| 0)];
    for (case, (poses, grain)) in cases.into_iter().enumerate() {
        let estimates = frozen(poses, grain, 60.0);
        let reported = estimates.iter().find(|(_, found)| is_reported(found));
        assert!(reported.is_none(), "case {case}: told after {} s", reported.unwrap().0);
        let (_, last) = estimates.last().unwrap();
        assert_eq!(last.status, Status::Tracking, "case {case}");
    }
}

#[test]
fn one_new_image_between_two_freezes_does_not_make_what_moves_rest() {
    const RATE_HZ: f64 = 30.0;
    // It moves to and fro, and turns back shortly before the images freeze.
    let place = |count: usize| moved(0.75 * RADIUS * (0.0628 * count as f64).sin(), 0.0);
    let stage = Stage::textured();
    let taken = |count: usize| {
        let time_s = count as f64 / RATE_HZ;
        Shot { time_s, ..stage.shot(count, &eyes(), Some(&place(count))) }
    };
    for single in [43, 58] {
        let mut last = taken(0);
        let mut tracker = started(&stage, &last, place(0));
        for count in 1..single + 20 {
            let is_new = count < 33 || count == single;
            last =
                if is_new { taken(count) } else { Shot { time_s: count as f64 / RATE_HZ, ..last } };
            let found = tracker.step(&last.observation()).unwrap();
            let off = off(&found, &place(count));
            let trusted = found.status == Status::Tracking;
            assert!(trusted || count != single, "{count}: not found again");
            assert!(!trusted || off < 0.02, "{single}, {count}: {off} m");
        }
    }
}

#[test]
fn eyes_that_went_along_for_a_while_do_not_hide_that_what_circles_went_on() {
    const RATE_HZ: f64 = 30.0;
    const FROZEN_FROM: usize = 60;
    const AWAY: f64 = 0.04; // metres from the centre of its circle, which takes eight seconds
    let place = |count: usize| {
        let (sin, cos) = (count as f64 / RATE_HZ * std::f64::consts::FRAC_PI_4).sin_cos();
        let way = AWAY * Vector3::new(cos - 1.0, sin, 0.0);
        Pose::from_rotation(start().rotation(), start().translation() + way)
    };
    // The cameras rest, except just after the images froze: then they move along with the object.
    let gone = |count: usize| {
        place(count.clamp(FROZEN_FROM, FROZEN_FROM + 12)).translation()
            - place(FROZEN_FROM).translation()
    };
    let eyes_of = |count: usize| {
        eyes().map(|eye| Pose::from_rotation(eye.rotation(), eye.translation() + gone(count)))
    };
    let stage = Stage::textured();
    let taken = |count: usize| {
        let time_s = count as f64 / RATE_HZ;
        Shot { time_s, ..stage.shot(count, &eyes_of(count), Some(&place(count))) }
    };
    let mut last = taken(0);
    let mut tracker = started(&stage, &last, place(0));
    for count in 1..FROZEN_FROM + 45 {
        last = if count <= FROZEN_FROM {
            taken(count)
        } else {
            let (time_s, eyes) = (count as f64 / RATE_HZ, eyes_of(count).to_vec());
            Shot { time_s, eyes, ..last }
        };
        let found = tracker.step(&last.observation()).unwrap();
        let off = off(&found, &place(count));
        let trusted = found.status == Status::Tracking;
        assert!(trusted || count > FROZEN_FROM, "{count}: not followed");
        assert!(!trusted || off < 0.02, "{count}: {off} m");
    }
}

#[test]
fn what_a_camera_hung_at_is_not_believed_where_the_other_one_fails() {
    const RATE_HZ: f64 = 30.0;
    const HANGS_FROM: usize = 10;
    const ALONE_FROM: usize = 40;
    let place = |count: usize| moved(0.03 * count as f64 / RATE_HZ, 0.0);
    let stage = Stage::textured();
    let first = stage.shot(0, &eyes(), Some(&place(0)));
    let mut tracker = started(&stage, &first, place(0));
    let hung = stage.shot(HANGS_FROM, &eyes(), Some(&place(HANGS_FROM)));
    for count in 1..ALONE_FROM + 20 {
        let mut shot = stage.shot(count, &eyes(), Some(&place(count)));
        if count > HANGS_FROM {
            shot.pictures[0].clone_from(&hung.pictures[0]);
        }
        let mut observation = shot.observation();
        if count >= ALONE_FROM {
            observation.images[1] = None;
        }
        let found = tracker.step(&observation).unwrap();
        let trusted = found.status == Status::Tracking;
        assert_eq!(trusted, count < ALONE_FROM, "{count}");
        assert_eq!(found.notices.contains(&Notice::Repeated(0)), count > HANGS_FROM, "{count}");
    }
    // Once it shows something new it is used again.
    let shot = stage.shot(ALONE_FROM + 20, &eyes(), Some(&place(ALONE_FROM + 20)));
    let mut observation = shot.observation();
    observation.images[1] = None;
    let found = tracker.step(&observation).unwrap();
    assert!(!found.notices.contains(&Notice::Repeated(0)) && found.evidence.is_some());
}

#[test]
fn eyes_that_turn_towards_each_other_while_images_are_frozen_measure_no_distance() {
    const FROZEN_FROM: usize = 10;
    let stage = Stage::textured();
    let mut last = stage.shot(0, &eyes(), Some(&start()));
    let mut tracker = started(&stage, &last, start());
    for count in 1..=FROZEN_FROM {
        last = stage.shot(count, &eyes(), Some(&start()));
        assert_eq!(tracker.step(&last.observation()).unwrap().status, Status::Tracking);
    }
    // By 0.1 degrees per image: one camera's image moves by 0.8 mm, the triangulated position by 6
    // mm.
    for count in 1..=10 {
        let turn =
            UnitQuaternion::from_scaled_axis(Vector3::y() * (0.1 * count as f64).to_radians());
        last.eyes[1] = Pose::from_rotation(eyes()[1].rotation() * turn, eyes()[1].translation());
        last.time_s += 1.0 / 30.0;
        let found = tracker.step(&last.observation()).unwrap();
        let off = off(&found, &start());
        assert!(found.status != Status::Tracking || off < 0.02, "{count}: {off} m");
        assert!(count < 3 || is_reported(&found), "{count}");
    }
}

#[test]
fn an_image_that_comes_again_after_a_gap_is_as_old_as_before_it() {
    const RATE_HZ: f64 = 30.0;
    const NEW_TO: usize = 30;
    const GONE_TO: usize = 55;
    let place = |count: usize| moved(0.03 * count as f64 / RATE_HZ, 0.0);
    let stage = Stage::textured();
    let mut last = stage.shot(0, &eyes(), Some(&place(0)));
    let mut tracker = started(&stage, &last, place(0));
    for count in 1..GONE_TO + 15 {
        if count <= NEW_TO {
            last = stage.shot(count, &eyes(), Some(&place(count)));
        }
        last.time_s = count as f64 / RATE_HZ;
        let mut observation = last.observation();
        if count > NEW_TO && count <= GONE_TO {
            observation.images.fill(None);
        }
        let found = tracker.step(&observation).unwrap();
        let off = off(&found, &place(count));
        let trusted = found.status == Status::Tracking;
        assert!(trusted || count > NEW_TO, "{count}: not followed");
        assert!(!trusted || off < 0.02, "{count}: {off} m");
    }
}
