//! Laws of what a tracker learns: the evolving body, and the appearance that is stored.

use std::sync::OnceLock;

use crate::scenes::holds;
use crate::shapes::drawn::{Stage, eyes};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::camera::Observation;
use servoid::model::{SyntheticView, half_ball_direction, silhouette_ious};
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid};
use servoid::track::{Appearance, Estimate, Status, TrackError, TrackSettings, Tracker};

/// Pose of an object that rotates by about 130 degrees in all.
pub fn turning(index: usize) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.2, 1.0, 0.1) * 0.05 * index as f64);
    Pose::from_rotation(turn, Vector3::new(0.0, 0.0, 0.05))
}

/// The body on the stage, but far too small.
pub fn too_small(stage: &Stage) -> Body {
    let smaller = |e: &Ellipsoid| {
        let radii = (e.radii() * 0.85).into();
        Ellipsoid::new(0, e.center().into(), radii, e.quaternion()).unwrap()
    };
    let ellipsoids = stage.body.ellipsoids().iter().map(smaller).collect();
    Body::new(Pose::identity(), ellipsoids).unwrap()
}

/// Tracks the rotating object with an inaccurate body; also returns the number of images that were
/// not tracked.
pub fn followed(stage: &Stage, body: &Body, count: usize) -> (Tracker, f64) {
    followed_while(stage, body, count, |found| found.status == Status::Tracking)
}

/// The same; returns the number of images that were not as they should be.
pub fn followed_while(
    stage: &Stage,
    body: &Body,
    count: usize,
    does: impl Fn(&Estimate) -> bool,
) -> (Tracker, f64) {
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&turning(index)));
    let settings = TrackSettings::default().with(|it| it.seed = stage.seed);
    let mut tracker = Tracker::new(&stage.cameras(), body, settings).unwrap();
    let pictures: Vec<_> = eyes().iter().map(|eye| stage.mask(eye, &turning(0))).collect();
    let masks = crate::shapes::drawn::masks(&pictures);
    tracker.start(&shot(0).observation(), turning(0), &masks).unwrap();
    let mut others = 0.0;
    for index in 1..count {
        let found = tracker.step(&shot(index).observation()).unwrap();
        others += f64::from(u8::from(!does(&found)));
    }
    (tracker, others)
}

/// A tracker that has tracked a body that is too small; that of seed 0 is cached.
pub fn settled_of(seed: u64) -> (Tracker, f64) {
    static SETTLED: OnceLock<(Tracker, f64)> = OnceLock::new();
    let stage = Stage { seed, ..Stage::textured() };
    let settle = || followed(&stage, &too_small(&stage), 45);
    if seed == 0 { SETTLED.get_or_init(settle).clone() } else { settle() }
}

fn settled() -> Tracker {
    settled_of(0).0
}

/// Mean overlap of a body's silhouettes with those of the stage, from all around.
pub fn overlap(ellipsoids: &[Ellipsoid], stage: &Stage) -> f64 {
    let truth = stage.body.at(Pose::identity());
    let around = (0..12).map(|side| half_ball_direction(side, 12));
    let synthetic_views = SyntheticView::of_body(&truth, around).unwrap();
    let views: Vec<_> = synthetic_views.iter().map(|synthetic| synthetic.view().unwrap()).collect();
    let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
    let ious = silhouette_ious(&body, &views);
    ious.iter().sum::<f64>() / ious.len() as f64
}

#[test]
fn a_body_that_is_too_small_grows_to_what_was_seen_and_its_frame_stays() {
    holds("learning a size");
}

#[test]
fn sides_that_were_not_seen_stay_as_they_are_believed_to_be() {
    holds("learning one side");
}

#[test]
fn the_same_images_let_the_body_evolve_to_the_same_bits_on_any_number_of_threads() {
    let grown = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut tracker = settled();
        pool.install(|| tracker.evolve().unwrap());
        tracker.body().unwrap()
    };
    assert_eq!(grown(1), grown(3));
}

#[test]
fn a_body_evolves_beside_the_tracker_as_it_does_while_that_waits_and_is_in_use_five_images_later() {
    let (mut beside, mut waiting, stage) = (settled(), settled(), Stage::textured());
    assert!(beside.begin_evolving() && !beside.begin_evolving() && waiting.evolve().unwrap());
    let before = beside.body().unwrap();
    for count in 1..=6 {
        let shot = stage.shot(44 + count, &eyes(), Some(&turning(44 + count)));
        let evolved = beside.step(&shot.observation()).unwrap().evolved;
        assert_eq!(evolved, count == 5);
        let body = beside.body().unwrap();
        assert_eq!(body.ellipsoids() == before.ellipsoids(), count < 5);
    }
    let waited = waiting.body().unwrap();
    assert_eq!(beside.body().unwrap().ellipsoids(), waited.ellipsoids());
}

#[test]
fn who_waits_gets_what_was_begun_beside() {
    let (mut begun, mut waiting) = (settled(), settled());
    assert!(begun.begin_evolving() && begun.evolve().unwrap() && waiting.evolve().unwrap());
    assert_eq!(begun.body().unwrap(), waiting.body().unwrap());
}

#[test]
fn a_new_start_discards_a_body_that_evolves_beside_it() {
    let (mut tracker, stage) = (settled(), Stage::textured());
    assert!(tracker.begin_evolving());
    let body = tracker.body().unwrap();
    let shot = stage.shot(50, &eyes(), Some(&turning(50)));
    tracker.start(&shot.observation(), turning(50), &[]).unwrap();
    for index in 51..58 {
        let shot = stage.shot(index, &eyes(), Some(&turning(index)));
        assert!(!tracker.step(&shot.observation()).unwrap().evolved);
    }
    assert_eq!(tracker.body().unwrap().ellipsoids(), body.ellipsoids());
}

#[test]
fn before_anything_is_seen_no_body_evolves() {
    let stage = Stage::textured();
    let settings = TrackSettings::default();
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    assert!(!tracker.evolve().unwrap());
    assert_eq!(tracker.body().unwrap(), stage.body);
}

/// Returns the median distance of a tracker's surface points from the surface of the stage, in
/// millimetres.
pub fn depth_error(tracker: &Tracker, stage: &Stage) -> f64 {
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
    holds("learning depth");
}

#[test]
fn the_outline_of_a_plain_object_is_no_pattern_although_the_body_is_too_large() {
    holds("learning a plain outline");
}

#[test]
fn an_object_is_found_again_by_its_appearance_without_a_pose() {
    holds("learning a look in colour");
    holds("learning looks in grey");
}

#[test]
fn an_appearance_learned_in_colours_is_found_in_grey_images_near_a_pose_only_and_conversely() {
    holds("learning from colour for grey");
    holds("learning from grey for colour");
}

/// Learns the object on the stage from four sides, with eight cameras around the object's frame.
pub fn look_of_all_eyes(stage: &Stage) -> Appearance {
    let sides = [0, 8, 16, 24].map(|index| (index, turning(index)));
    let shots = sides.map(|(index, there)| stage.shot(index, &eyes(), Some(&there)));
    let parts: Vec<_> = shots.iter().map(|shot| shot.observation()).collect();
    let about = |(_, there): &(usize, Pose)| eyes().map(|eye| there.inverse() * eye);
    let all = Observation {
        time_s: 0.0,
        world_from_camera: sides.iter().flat_map(about).collect(),
        images: parts.iter().flat_map(|part| part.images.clone()).collect(),
        depths: Vec::new(),
    };
    let marked = |(_, there): &(usize, Pose)| eyes().map(|eye| stage.mask(&eye, there));
    let pictures: Vec<_> = sides.iter().flat_map(marked).collect();
    let settings = TrackSettings::default().with(|it| it.seed = stage.seed);
    let mut tracker = Tracker::new(&[stage.camera; 8], &stage.body, settings).unwrap();
    tracker.start(&all, Pose::identity(), &crate::shapes::drawn::masks(&pictures)).unwrap();
    tracker.appearance()
}

#[test]
fn an_appearance_learned_by_many_cameras_is_found_by_one() {
    holds("learning with many eyes for one");
}

#[test]
fn an_appearance_that_is_written_is_read_as_it_was() {
    let look = settled().appearance();
    let bytes = look.to_bytes();
    assert_eq!(Appearance::from_bytes(&bytes).as_ref(), Ok(&look));
    assert_eq!(Appearance::from_bytes(&bytes).unwrap().to_bytes(), bytes);
    let empty = Appearance::default();
    assert_eq!(Appearance::from_bytes(&empty.to_bytes()), Ok(empty));
}

#[test]
fn an_appearance_that_is_cut_short_or_too_long_is_refused() {
    let bytes = settled().appearance().to_bytes();
    for length in (0..bytes.len()).step_by(97) {
        let refused = Appearance::from_bytes(&bytes[..length]);
        assert_eq!(refused, Err(TrackError::Appearance(length)));
    }
    let longer = [bytes.as_slice(), &[0]].concat();
    assert_eq!(Appearance::from_bytes(&longer), Err(TrackError::Appearance(longer.len())));
}

#[test]
fn an_appearance_with_too_many_parts_is_refused_in_words_before_they_are_read() {
    let written = settled().appearance().to_bytes();
    let parts = [(9, "points"), (13, "colours"), (17, "views")];
    for (at, what) in parts {
        let mut bytes = written[..21].to_vec();
        bytes[at..at + 4].copy_from_slice(&u32::MAX.to_le_bytes());
        let refused = Appearance::from_bytes(&bytes).unwrap_err().to_string();
        let words = format!("the number of {what} in the appearance is 4294967295, but it must");
        assert!(refused.starts_with(&words), "{refused}");
    }
}

#[test]
fn an_appearance_that_is_recalled_is_known_as_it_was() {
    let look = settled().appearance();
    let mut other = settled();
    other.recall(&look).unwrap();
    assert_eq!(other.appearance(), look);
}

#[test]
fn an_appearance_of_a_later_version_is_refused_with_that_version() {
    let mut bytes = settled().appearance().to_bytes();
    for (version, refused) in [(b'3', TrackError::Newer(3)), (b'9', TrackError::Newer(9))] {
        bytes[7] = version;
        assert_eq!(Appearance::from_bytes(&bytes), Err(refused));
    }
    bytes[7] = b'x';
    assert_eq!(Appearance::from_bytes(&bytes), Err(TrackError::Appearance(bytes.len())));
}

#[test]
fn an_appearance_with_impossible_numbers_is_refused_in_words() {
    let written = settled().appearance().to_bytes();
    let colors = u32::from_le_bytes(written[13..17].try_into().unwrap()) as usize;
    let first_color = 21 + 7 * 8;
    let (first_share, first_point) = (first_color + 4, first_color + 8 * colors);
    let statistics = first_point + 16 * 8 + 3 + 3 * 65;
    let refusal = |at: usize, number: &[u8]| -> String {
        let mut bytes = written.clone();
        bytes[at..at + number.len()].copy_from_slice(number);
        let read = Appearance::from_bytes(&bytes).and_then(|look| settled().recall(&look));
        read.unwrap_err().to_string()
    };
    let double =
        |place: usize, number: f64| refusal(first_point + 8 * place, &number.to_le_bytes());
    let says = |said: String, words: &str| assert!(said.starts_with(words), "{said}");
    for share in [-0.1_f32, 1.5] {
        says(refusal(first_share, &share.to_le_bytes()), "a colour's share of the object in the");
    }
    says(double(15, -1e-6), "the variance of a point in the appearance is -1e-6, but it must be 0");
    says(double(3, 9.0), "the normal of a point in the appearance is 9.");
    says(double(12, 9.0), "the view of a point in the appearance is 9.");
    says(double(0, 5.0), "a point's distance, in radii of the body, in the appearance is ");
    let more = |place: usize, number: f64| refusal(statistics + place, &number.to_le_bytes());
    says(more(3, -1.0), "the drift of a point in the appearance is -1, but it must be 0 or more");
    says(more(11, -0.1), "the turn in which a point was recognised in the appearance is -0.1");
    let single = |place: usize, number: f32| refusal(statistics + place, &number.to_le_bytes());
    says(single(19, -2.0), "the hit rate of a point in the appearance is -1");
    says(single(23, 99.0), "the hit rate of a point in the appearance is ");
    let shown = refusal(statistics + 31, &u32::MAX.to_le_bytes());
    says(shown, "the number of images in which a point showed a pattern in the appearance is 4294");
    let further = refusal(statistics + 39, &[200]);
    says(further, "the number of further templates of a point in the appearance is 200");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_bytes_of_an_appearance_make_the_tracker_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..40),
    ) {
        let mut bytes = settled().appearance().to_bytes();
        for (place, byte) in &changes {
            let at = 21 + place.index(bytes.len() - 21);
            bytes[at] = *byte;
        }
        if let Ok(look) = Appearance::from_bytes(&bytes) {
            let stage = Stage::textured();
            let mut tracker = settled();
            if tracker.recall(&look).is_err() {
                return Ok(());
            }
            for index in 45..47 {
                let shot = stage.shot(index, &eyes(), Some(&turning(index)));
                let found = tracker.step(&shot.observation()).unwrap();
                prop_assert!((0.0..=1.0).contains(&found.confidence));
                prop_assert!(found.world_from_object.matrix().iter().all(|x| x.is_finite()));
            }
        }
    }
}
