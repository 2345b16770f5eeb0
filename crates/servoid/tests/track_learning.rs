//! Laws of what a tracker learns: the body that evolves, and the look that is kept for another day.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod shapes;

use std::sync::OnceLock;

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::model::{Portrait, half_ball_direction, silhouette_ious};
use servoid::observe::{Channels, Observation};
use servoid::pose::{Pose, Twist};
use servoid::shape::{Body, Ellipsoid};
use servoid::track::{Appearance, Status, TrackError, TrackSettings, Tracker};
use shapes::drawn::{Stage, eyes};

/// Where an object is that turns by about 130 degrees in all.
fn turning(index: usize) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 1.0, 0.1) * 0.05 * index as f64);
    Pose::from_rotation(turn, Vector3::new(0.0, 0.0, 0.05))
}

/// The body that the stage shows, but all too small.
fn too_small(stage: &Stage) -> Body {
    let smaller = |e: &Ellipsoid| {
        let radii = (e.radii() * 0.85).into();
        Ellipsoid::new(0, e.center().into(), radii, e.quaternion()).unwrap()
    };
    let ellipsoids = stage.body.ellipsoids().iter().map(smaller).collect();
    Body::new(Pose::identity(), ellipsoids).unwrap()
}

/// Follows the turning object with a body that is not quite right.
fn followed(stage: &Stage, body: &Body, count: usize) -> Tracker {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&turning(index)));
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&stage.cameras(), body, settings).unwrap();
    let pictures: Vec<_> = eyes().iter().map(|eye| stage.mask(eye, &turning(0))).collect();
    let masks = shapes::drawn::masks(&pictures);
    tracker.start(&shot(0).observation(), turning(0), &masks).unwrap();
    for index in 1..count {
        let found = tracker.step(&shot(index).observation()).unwrap();
        assert_eq!(found.status, Status::Tracking, "image {index}: {}", found.confidence);
    }
    tracker
}

fn settled() -> &'static Tracker {
    static SETTLED: OnceLock<Tracker> = OnceLock::new();
    SETTLED.get_or_init(|| followed(&Stage::textured(), &too_small(&Stage::textured()), 45))
}

/// Mean overlap of a body's silhouettes with those of what the stage shows, from all around.
fn overlap(ellipsoids: &[Ellipsoid], stage: &Stage) -> f64 {
    let truth = stage.body.at(Pose::identity());
    let around = (0..12).map(|side| half_ball_direction(side, 12));
    let portraits = Portrait::of_body(&truth, around).unwrap();
    let views: Vec<_> = portraits.iter().map(|portrait| portrait.view().unwrap()).collect();
    let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
    let ious = silhouette_ious(&body, &views);
    ious.iter().sum::<f64>() / ious.len() as f64
}

fn off(found: &Pose, truth: &Pose) -> (f64, f64) {
    let off = truth.inverse() * *found;
    (1000.0 * off.translation().norm(), off.rotation().angle().to_degrees())
}

#[test]
fn a_body_that_is_too_small_grows_to_what_was_seen_and_its_frame_stays() {
    let stage = Stage::textured();
    let mut tracker = settled().clone();
    let (before, pose) = (overlap(too_small(&stage).ellipsoids(), &stage), turning(44));
    assert!(tracker.evolve().unwrap());
    let grown = tracker.body().unwrap();
    let after = overlap(grown.ellipsoids(), &stage);
    assert!(before < 0.8 && after > before + 0.1, "{before} to {after}");
    let (across, turned) = off(&grown.world_from_object(), &pose);
    assert!(across < 3.0 && turned < 2.0, "{across} mm, {turned} deg");
    // Nothing new was seen since: nothing changes.
    assert!(!tracker.evolve().unwrap());
    assert_eq!(tracker.body().unwrap(), grown);
    // The next pose means the same as the one before.
    for index in 45..50 {
        let shot = stage.shot(index, &eyes(), Some(&turning(index)));
        let found = tracker.step(&shot.observation()).unwrap();
        let (across, turned) = off(&found.world_from_object, &turning(index));
        assert_eq!(found.status, Status::Tracking);
        assert!(across < 3.0 && turned < 2.0, "{across} mm, {turned} deg");
    }
}

#[test]
fn sides_that_were_not_seen_stay_as_they_are_believed_to_be() {
    let stage = Stage::textured();
    let mut tracker = followed(&stage, &stage.body, 6);
    tracker.evolve().unwrap();
    let after = overlap(tracker.body().unwrap().ellipsoids(), &stage);
    assert!(after > 0.94, "{after}");
}

#[test]
fn the_same_images_let_the_body_evolve_to_the_same_bits_on_any_number_of_threads() {
    let grown = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut tracker = settled().clone();
        pool.install(|| tracker.evolve().unwrap());
        tracker.body().unwrap()
    };
    assert_eq!(grown(1), grown(3));
}

#[test]
fn before_anything_is_seen_no_body_evolves() {
    let stage = Stage::textured();
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    assert!(!tracker.evolve().unwrap());
    assert_eq!(tracker.body().unwrap(), stage.body);
}

/// Gives how far from what the stage shows the surface points lie that a tracker learned, the
/// median in millimetres.
fn depth_error(tracker: &Tracker, stage: &Stage) -> f64 {
    let off = |place: &Vector3<f64>, solid: &Ellipsoid| {
        let away = place - solid.center();
        let share = (solid.factor().try_inverse().unwrap() * away).norm();
        1000.0 * ((share - 1.0) * away.norm() / share).abs()
    };
    let solids = stage.body.ellipsoids();
    let nearest = |place: &Vector3<f64>| solids.iter().map(|e| off(place, e)).fold(1e9, f64::min);
    let mut all: Vec<_> = tracker.surface().map(|point| nearest(&point.position)).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

#[test]
fn two_eyes_see_where_the_surface_is_although_the_body_is_too_small() {
    let (stage, body) = (Stage::textured(), too_small(&Stage::textured()));
    let off = depth_error(&followed(&stage, &body, 1), &stage);
    assert!(off < 1.5, "{off} mm");
    // Later images do not spoil it.
    let later = depth_error(settled(), &stage);
    assert!(later < 1.5, "{later} mm");
}

#[test]
fn the_outline_of_a_plain_object_is_no_pattern_although_the_body_is_too_large() {
    let stage = Stage::ball(0.0);
    let larger = Ellipsoid::new(0, [0.0; 3], [0.056; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let body = Body::new(Pose::identity(), vec![larger]).unwrap();
    let tracker = followed(&stage, &body, 20);
    assert!(tracker.surface().count() <= 2, "{}", tracker.surface().count());
}

#[test]
fn an_object_is_found_again_by_its_look_without_a_pose() {
    for channels in [Channels::Rgb, Channels::Grey] {
        let stage = Stage { channels, ..Stage::textured() };
        let look = followed(&stage, &stage.body, 6).appearance();
        assert!(look.points() > 20);
        let settings = TrackSettings::default();
        let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
        tracker.recall(&Appearance::from_bytes(&look.to_bytes()).unwrap());
        let there = turning(0) * Pose::exp(&Twist::new(0.06, -0.03, 0.04, 0.2, -0.2, 0.4));
        let shot = |index: usize| stage.shot(index, &eyes(), Some(&there));
        let mut found = tracker.find(&shot(0).observation(), None).unwrap();
        for index in 1..4 {
            found = tracker.step(&shot(index).observation()).unwrap();
        }
        let (across, turned) = off(&found.world_from_object, &there);
        assert_eq!(found.status, Status::Tracking, "{channels:?}");
        assert!(across < 1.5 && turned < 1.5, "{channels:?}: {across} mm, {turned} deg");
    }
}

#[test]
fn a_look_learned_in_colours_is_known_in_grey_pictures_near_a_pose_only_and_so_is_the_reverse() {
    let near = turning(3) * Pose::exp(&Twist::new(0.01, -0.005, 0.01, 0.1, -0.1, 0.1));
    let [rgb, grey] =
        [Channels::Rgb, Channels::Grey].map(|channels| Stage { channels, ..Stage::textured() });
    for (learned, seen) in [(&rgb, &grey), (&grey, &rgb)] {
        let look = followed(learned, &learned.body, 6).appearance();
        let settings = TrackSettings::default();
        let mut tracker = Tracker::new(&seen.cameras(), &seen.body, settings).unwrap();
        tracker.recall(&look);
        let shot = |index: usize| seen.shot(index, &eyes(), Some(&turning(3)));
        let refused = tracker.find(&shot(0).observation(), None);
        assert_eq!(refused, Err(TrackError::NothingKnown));
        let mut found = tracker.find(&shot(1).observation(), Some(near)).unwrap();
        for index in 2..8 {
            found = tracker.step(&shot(index).observation()).unwrap();
        }
        let (across, turned) = off(&found.world_from_object, &turning(3));
        assert_eq!(found.status, Status::Tracking, "{:?}", seen.channels);
        assert!(across < 1.5 && turned < 1.5, "{across} mm, {turned} deg");
    }
}

/// Learns what the stage shows from four sides, with eight eyes about the object's frame.
fn look_of_all_eyes(stage: &Stage) -> Appearance {
    let sides = [0, 8, 16, 24].map(|index| (index, turning(index)));
    let shots = sides.map(|(index, there)| stage.shot(index, &eyes(), Some(&there)));
    let parts: Vec<_> = shots.iter().map(|shot| shot.observation()).collect();
    let about = |(_, there): &(usize, Pose)| eyes().map(|eye| there.inverse() * eye);
    let all = Observation {
        time_s: 0.0,
        world_from_camera: sides.iter().flat_map(about).collect(),
        images: parts.iter().flat_map(|part| part.images.clone()).collect(),
    };
    let marked = |(_, there): &(usize, Pose)| eyes().map(|eye| stage.mask(&eye, there));
    let pictures: Vec<_> = sides.iter().flat_map(marked).collect();
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&[stage.camera; 8], &stage.body, settings).unwrap();
    tracker.start(&all, Pose::identity(), &shapes::drawn::masks(&pictures)).unwrap();
    tracker.appearance()
}

#[test]
fn a_look_that_many_eyes_learned_is_known_to_one() {
    let stage = Stage::textured();
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&[stage.camera], &stage.body, settings).unwrap();
    tracker.recall(&look_of_all_eyes(&stage));
    let mut found = None;
    for index in 8..12 {
        let shot = stage.shot(index, &eyes(), Some(&turning(8)));
        let mut seen = shot.observation();
        seen.images.truncate(1);
        seen.world_from_camera.truncate(1);
        found = Some(match found {
            None => tracker.find(&seen, None).unwrap(),
            Some(_) => tracker.step(&seen).unwrap(),
        });
    }
    let found = found.unwrap();
    let (across, turned) = off(&found.world_from_object, &turning(8));
    assert_eq!(found.status, Status::Tracking, "{}", found.confidence);
    assert!(across < 4.0 && turned < 2.0, "{across} mm, {turned} deg");
}

#[test]
fn a_look_that_is_written_is_read_as_it_was() {
    let look = settled().appearance();
    let bytes = look.to_bytes();
    assert_eq!(Appearance::from_bytes(&bytes).as_ref(), Ok(&look));
    assert_eq!(Appearance::from_bytes(&bytes).unwrap().to_bytes(), bytes);
    let empty = Appearance::default();
    assert_eq!(Appearance::from_bytes(&empty.to_bytes()), Ok(empty));
}

#[test]
fn a_look_that_is_cut_short_or_goes_on_is_refused() {
    let bytes = settled().appearance().to_bytes();
    for length in (0..bytes.len()).step_by(97) {
        let refused = Appearance::from_bytes(&bytes[..length]);
        assert_eq!(refused, Err(TrackError::Appearance(length)));
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert_eq!(Appearance::from_bytes(&longer), Err(TrackError::Appearance(longer.len())));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_bytes_of_a_look_make_the_tracker_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..40),
    ) {
        let mut bytes = settled().appearance().to_bytes();
        for (place, byte) in &changes {
            let at = 17 + place.index(bytes.len() - 17);
            bytes[at] = *byte;
        }
        if let Ok(look) = Appearance::from_bytes(&bytes) {
            let stage = Stage::textured();
            let mut tracker = settled().clone();
            tracker.recall(&look);
            for index in 45..47 {
                let shot = stage.shot(index, &eyes(), Some(&turning(index)));
                let found = tracker.step(&shot.observation()).unwrap();
                prop_assert!((0.0..=1.0).contains(&found.confidence));
                prop_assert!(found.world_from_object.matrix().iter().all(|x| x.is_finite()));
            }
        }
    }
}
