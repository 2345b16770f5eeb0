//! Sequences in which a tracker learns a body or an appearance.

use servoid::camera::Channels;
use servoid::pose::{Pose, Twist};
use servoid::shape::{Body, Ellipsoid};
use servoid::track::{Appearance, TrackError, TrackSettings, Tracker};

use super::Sense::{AtLeast, AtMost};
use super::{Figures, MISSED, Measure, NOT_LOCATED, NOT_TRACKING, OFF, Scene, TURNED, Worst};
use crate::shapes::drawn::{Stage, eyes};
use crate::track_learning::{
    depth_error, followed, followed_while, look_of_all_eyes, overlap, settled_of, too_small,
    turning,
};

const USUAL: &[Measure] = &[NOT_TRACKING, OFF, TURNED];
const FOUND: &[Measure] = &[("points", "1", AtLeast), NOT_TRACKING, OFF, TURNED];

pub const SCENES: &[Scene] = &[
    Scene {
        name: "learning a size",
        measures: &[("gained", "1", AtLeast), NOT_TRACKING, OFF, TURNED],
        run: size,
    },
    Scene { name: "learning one side", measures: &[MISSED], run: one_side },
    Scene {
        name: "learning depth",
        measures: &[("at first", "mm", AtMost), ("later", "mm", AtMost)],
        run: depth,
    },
    Scene {
        name: "learning a plain outline",
        measures: &[("points", "1", AtMost), NOT_LOCATED],
        run: plain_outline,
    },
    Scene { name: "learning a look in colour", measures: FOUND, run: in_colour },
    Scene {
        name: "learning looks in grey",
        measures: &[("found", "courses", AtLeast), ("false", "courses", AtMost)],
        run: in_grey,
    },
    Scene { name: "learning from colour for grey", measures: USUAL, run: for_grey },
    Scene { name: "learning from grey for colour", measures: USUAL, run: for_colour },
    Scene { name: "learning with many eyes for one", measures: USUAL, run: for_one_eye },
];

fn seeded(seed: u64, channels: Channels) -> Stage {
    Stage { seed, channels, ..Stage::textured() }
}

fn settings(seed: u64) -> TrackSettings {
    TrackSettings::default().with(|it| it.seed = seed)
}

/// A body that is too small is tracked, evolves, and is tracked further.
fn size(seed: u64) -> Figures {
    let stage = seeded(seed, Channels::Rgb);
    let (mut tracker, mut not_tracking) = settled_of(seed);
    let before = overlap(too_small(&stage).ellipsoids(), &stage);
    assert!(before < 0.8 && tracker.evolve().unwrap());
    let grown = tracker.body().unwrap();
    let gained = overlap(grown.ellipsoids(), &stage) - before;
    let mut worst = Worst::default();
    worst.add_pose(&grown.world_from_object(), &turning(44));
    // Nothing new was seen since, so nothing changes.
    assert!(!tracker.evolve().unwrap());
    assert_eq!(tracker.body().unwrap(), grown);
    // The next pose means the same as the one before.
    for index in 45..50 {
        let shot = stage.shot(index, &eyes(), Some(&turning(index)));
        worst.add(&tracker.step(&shot.observation()).unwrap(), &turning(index));
    }
    not_tracking += worst.not_tracking;
    let Worst { off, turned, .. } = worst;
    vec![("gained", gained), ("not tracking", not_tracking), ("off", off), ("turned", turned)]
}

fn one_side(seed: u64) -> Figures {
    let stage = seeded(seed, Channels::Rgb);
    let (mut tracker, _) = followed(&stage, &stage.body, 6);
    tracker.evolve().unwrap();
    vec![("missed", 1.0 - overlap(tracker.body().unwrap().ellipsoids(), &stage))]
}

fn depth(seed: u64) -> Figures {
    let stage = seeded(seed, Channels::Rgb);
    let (first, _) = followed(&stage, &too_small(&stage), 1);
    let (later, _) = settled_of(seed);
    vec![("at first", depth_error(&first, &stage)), ("later", depth_error(&later, &stage))]
}

fn plain_outline(seed: u64) -> Figures {
    let stage = Stage { seed, ..Stage::ball(0.0) };
    let larger = Ellipsoid::new(0, [0.0; 3], [0.056; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let body = Body::new(Pose::identity(), vec![larger]).unwrap();
    let (tracker, others) = followed_while(&stage, &body, 20, |found| found.located);
    vec![("points", tracker.surface().count() as f64), ("not located", others)]
}

fn look_of(stage: &Stage) -> Appearance {
    let look = followed(stage, &stage.body, 6).0.appearance();
    Appearance::from_bytes(&look.to_bytes()).unwrap()
}

/// An appearance is recalled, and the object is found by it where it was not before.
fn found_by(look: &Appearance, stage: &Stage, course: u64) -> Worst {
    let settings = settings(stage.seed + 1000 * course);
    let mut tracker = Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    tracker.recall(look).unwrap();
    let there = turning(0) * Pose::exp(&Twist::new(0.06, -0.03, 0.04, 0.2, -0.2, 0.4));
    let shot = |index: usize| stage.shot(4 * course as usize + index, &eyes(), Some(&there));
    let mut found = tracker.find(&shot(0).observation(), None).unwrap();
    for index in 1..4 {
        found = tracker.step(&shot(index).observation()).unwrap();
    }
    let mut worst = Worst::default();
    worst.add(&found, &there);
    worst
}

fn in_colour(seed: u64) -> Figures {
    let stage = seeded(seed, Channels::Rgb);
    let look = look_of(&stage);
    let found = found_by(&look, &stage, 0);
    [vec![("points", look.points() as f64)], found.figures()].concat()
}

/// Sequences whose shares are averaged, as some fail: appearances, and sequences of each.
const LOOKS: u64 = 4;
const COURSES: u64 = 5;

/// Returns the shares of sequences with a tracked pose that is right, and that is not.
fn in_grey(seed: u64) -> Figures {
    let (mut right, mut wrong) = (0, 0);
    for look in 0..LOOKS {
        let stage = seeded(LOOKS * seed + look, Channels::Grey);
        let look = look_of(&stage);
        for course in 0..COURSES {
            let Worst { not_tracking, off, turned, .. } = found_by(&look, &stage, course);
            let fits = off < 1.5 && turned < 1.5;
            right += u64::from(not_tracking == 0.0 && fits);
            wrong += u64::from(not_tracking == 0.0 && !fits);
        }
    }
    let share = |count: u64| count as f64 / (LOOKS * COURSES) as f64;
    vec![("found", share(right)), ("false", share(wrong))]
}

/// The appearance from one kind of images is recalled for the other kind; a pose near the true one
/// is given.
fn across(learned: &Stage, seen: &Stage) -> Figures {
    let near = turning(3) * Pose::exp(&Twist::new(0.01, -0.005, 0.01, 0.1, -0.1, 0.1));
    let look = followed(learned, &learned.body, 6).0.appearance();
    let mut tracker = Tracker::new(&seen.cameras(), &seen.body, settings(seen.seed)).unwrap();
    tracker.recall(&look).unwrap();
    let shot = |index: usize| seen.shot(index, &eyes(), Some(&turning(3)));
    let refused = tracker.find(&shot(0).observation(), None);
    assert_eq!(refused, Err(TrackError::LearnedIn(learned.channels)));
    let mut found = tracker.find(&shot(1).observation(), Some(near)).unwrap();
    for index in 2..8 {
        found = tracker.step(&shot(index).observation()).unwrap();
    }
    let mut worst = Worst::default();
    worst.add(&found, &turning(3));
    worst.figures()
}

fn for_grey(seed: u64) -> Figures {
    across(&seeded(seed, Channels::Rgb), &seeded(seed, Channels::Grey))
}

fn for_colour(seed: u64) -> Figures {
    across(&seeded(seed, Channels::Grey), &seeded(seed, Channels::Rgb))
}

fn for_one_eye(seed: u64) -> Figures {
    let stage = seeded(seed, Channels::Rgb);
    let mut tracker = Tracker::new(&[stage.camera], &stage.body, settings(seed)).unwrap();
    tracker.recall(&look_of_all_eyes(&stage)).unwrap();
    let mut last = None;
    for index in 8..12 {
        let shot = stage.shot(index, &eyes(), Some(&turning(8)));
        let mut seen = shot.observation();
        seen.images.truncate(1);
        seen.world_from_camera.truncate(1);
        last = Some(match last {
            None => tracker.find(&seen, None).unwrap(),
            Some(_) => tracker.step(&seen).unwrap(),
        });
    }
    let mut worst = Worst::default();
    worst.add(&last.unwrap(), &turning(8));
    worst.figures()
}
