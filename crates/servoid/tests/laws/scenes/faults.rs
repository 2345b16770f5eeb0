//! Sequences of the tracker in which cameras fail.

use servoid::camera::{Channels, ImageView, Observation};
use servoid::track::{Notice, Status};

use super::Sense::AtMost;
use super::{Figures, NOT_TRACKING, OFF, Scene, Worst};
use crate::shapes::drawn::{SIZE, eyes};
use crate::track_faults::{one_color, settled_of, shot_of, start, view};

pub const SCENES: &[Scene] = &[
    Scene {
        name: "faults of one camera",
        measures: &[NOT_TRACKING, OFF, ("notices after it", "1", AtMost)],
        run: one_camera,
    },
    Scene {
        name: "faults of all cameras",
        measures: &[("called tracked", "images", AtMost), NOT_TRACKING, OFF],
        run: all_cameras,
    },
    Scene { name: "faults of repetition", measures: &[NOT_TRACKING, OFF], run: repetition },
    Scene { name: "faults of time", measures: &[NOT_TRACKING, OFF], run: time },
];

fn off(worst: &Worst) -> Figures {
    vec![("not tracking", worst.not_tracking), ("off", worst.off)]
}

/// One camera fails for one image, in each of four ways.
fn one_camera(seed: u64) -> Figures {
    let (black, small, before) = (one_color(0), vec![7; 3 * 64 * 48], shot_of(seed, 5));
    let small = ImageView::new(&small, [64, 48], Channels::Rgb).unwrap();
    let faults = [
        (None, Notice::NoImage(1)),
        (Some(view(&black)), Notice::Blank(1)),
        (Some(small), Notice::WrongSize { camera: 1, expected: SIZE, given: [64, 48] }),
        (Some(view(&before.pictures[1])), Notice::Repeated(1)),
    ];
    let (mut worst, mut after) = (Worst::default(), 0);
    for (image, notice) in faults {
        let mut tracker = settled_of(seed);
        let shot = shot_of(seed, 6);
        let mut observation = shot.observation();
        observation.images[1] = image;
        let found = tracker.step(&observation).unwrap();
        assert!(found.notices.contains(&notice), "{notice}: {:?}", found.notices);
        worst.add(&found, &start());
        // The camera works again.
        let found = tracker.step(&shot_of(seed, 7).observation()).unwrap();
        worst.add(&found, &start());
        after += found.notices.len();
    }
    [off(&worst), vec![("notices after it", after as f64)]].concat()
}

/// All cameras show a single colour for 0.8 s.
fn all_cameras(seed: u64) -> Figures {
    let (mut tracked, mut worst) = (0.0, Worst::default());
    for level in [0, 128, 255] {
        let mut tracker = settled_of(seed);
        let blank = one_color(level);
        for index in 6..30 {
            let images = vec![Some(view(&blank)); 2];
            let time_s = index as f64 / 30.0;
            let world_from_camera = eyes().to_vec();
            let found = tracker
                .step(&Observation { time_s, world_from_camera, images, depths: Vec::new() })
                .unwrap();
            assert!(!found.notices.is_empty());
            tracked += f64::from(u8::from(found.status == Status::Tracking));
        }
        for index in 30..35 {
            tracker.step(&shot_of(seed, index).observation()).unwrap();
        }
        worst.add(&tracker.step(&shot_of(seed, 35).observation()).unwrap(), &start());
    }
    [vec![("called tracked", tracked)], off(&worst)].concat()
}

fn repetition(seed: u64) -> Figures {
    let (mut tracker, mut worst) = (settled_of(seed), Worst::default());
    let learned = tracker.surface().count();
    for _ in 0..3 {
        let mut again = shot_of(seed, 5);
        again.time_s += 0.01;
        let found = tracker.step(&again.observation()).unwrap();
        assert!(found.notices.contains(&Notice::Repeated(0)));
        assert!(found.notices.contains(&Notice::Repeated(1)));
        assert_eq!(tracker.surface().count(), learned);
        worst.add(&found, &start());
    }
    off(&worst)
}

/// Time goes back, stands still, jumps, and continues after a short gap.
fn time(seed: u64) -> Figures {
    let mut worst = Worst::default();
    let mut notices_at = |time_s: f64| {
        let (mut tracker, mut shot) = (settled_of(seed), shot_of(seed, 6));
        shot.time_s = time_s;
        let found = tracker.step(&shot.observation()).unwrap();
        worst.add(&found, &start());
        found.notices
    };
    let before = 5.0 / 30.0;
    for now in [0.1, -1e9, before] {
        assert_eq!(notices_at(now), [Notice::Time { before, now }]);
    }
    assert_eq!(notices_at(before + 100.0), [Notice::Jump(before + 100.0 - before)]);
    assert_eq!(notices_at(before + 0.1), []);
    off(&worst)
}
