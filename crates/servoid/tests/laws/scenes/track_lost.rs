//! Sequences of the tracker in which the object disappears for a while, or must be found.

use servoid::pose::{Pose, Twist};
use servoid::track::Status;

use super::Sense::AtMost;
use super::{Figures, NOT_TRACKING, OFF, Scene, TURNED, Worst};
use crate::shapes::drawn::{Stage, eyes};
use crate::track::{seeded, start, started};

pub const SCENES: &[Scene] = &[
    Scene {
        name: "track gone",
        measures: &[
            ("called tracked", "images", AtMost),
            ("not lost", "courses", AtMost),
            NOT_TRACKING,
            OFF,
            TURNED,
        ],
        run: gone,
    },
    Scene { name: "track found anywhere", measures: FOUND, run: anywhere },
    Scene { name: "track found near", measures: FOUND, run: near },
];

const FOUND: &[super::Measure] = &[NOT_TRACKING, OFF, TURNED];

/// The object disappears, and returns elsewhere and rotated.
fn gone(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let shot = |index: usize, pose: Option<&Pose>| stage.shot(index, &eyes(), pose);
    let mut tracker = started(&stage, settings, &shot(0, Some(&start())), start());
    for index in 1..5 {
        tracker.step(&shot(index, Some(&start())).observation()).unwrap();
    }
    let (mut tracked, mut status) = (0.0, Status::Tracking);
    for index in 5..25 {
        status = tracker.step(&shot(index, None).observation()).unwrap().status;
        tracked += f64::from(u8::from(status == Status::Tracking));
    }
    let back = start() * Pose::exp(&Twist::new(0.03, -0.04, 0.02, 0.2, -0.3, 0.3));
    for index in 25..31 {
        tracker.step(&shot(index, Some(&back)).observation()).unwrap();
    }
    let mut worst = Worst::default();
    worst.add(&tracker.step(&shot(31, Some(&back)).observation()).unwrap(), &back);
    let not_lost = f64::from(u8::from(status != Status::Lost));
    [vec![("called tracked", tracked), ("not lost", not_lost)], worst.figures()].concat()
}

fn found(seed: u64, given: Option<Pose>) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let shot = |index: usize| stage.shot(index, &eyes(), Some(&start()));
    let mut tracker = started(&stage, settings, &shot(0), start());
    for index in 1..6 {
        tracker.step(&shot(index).observation()).unwrap();
    }
    let mut worst = Worst::default();
    worst.add(&tracker.find(&shot(7).observation(), given).unwrap(), &start());
    worst.figures()
}

fn anywhere(seed: u64) -> Figures {
    found(seed, None)
}

fn near(seed: u64) -> Figures {
    found(seed, Some(start() * Pose::exp(&Twist::new(0.02, 0.0, -0.02, 0.2, 0.2, 0.2))))
}
