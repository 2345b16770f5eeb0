//! Sequences of the tracker in which some of the object's known features cannot be used: they are
//! outside the images, or a camera shows no colours.

use nalgebra::{UnitQuaternion, Vector3};
use servoid::camera::{Channels, ImageView, Observation};
use servoid::pose::Pose;
use servoid::track::{Estimate, Notice, Tracker};

use super::Sense::AtMost;
use super::{Figures, Measure, NOT_TRACKING, OFF, Scene, TURNED, Worst};
use crate::shapes::drawn::{SIZE, Shot, Stage, eyes};
use crate::track::{moving, seeded, start, started};

const DOUBT: Measure = ("doubt", "1", AtMost);
const HIDDEN: Measure = ("said to be hidden", "images", AtMost);

pub const SCENES: &[Scene] = &[
    Scene {
        name: "track into the camera",
        measures: &[NOT_TRACKING, OFF, TURNED, DOUBT, HIDDEN],
        run: approached,
    },
    Scene {
        name: "track out of the image",
        measures: &[NOT_TRACKING, OFF, TURNED, DOUBT, HIDDEN],
        run: leaving,
    },
    Scene {
        name: "track grey beside colour",
        measures: &[NOT_TRACKING, OFF, TURNED, DOUBT],
        run: grey_beside_colour,
    },
];

/// The worst of some estimates, with what they report about hidden parts.
#[derive(Default)]
struct Seen {
    worst: Worst,
    doubt: f64,
    hidden: f64,
}

impl Seen {
    fn add(&mut self, found: &Estimate, truth: &Pose) {
        self.worst.add(found, truth);
        self.doubt = self.doubt.max(1.0 - found.confidence);
        let hides = |notice: &Notice| matches!(notice, Notice::Hidden { .. });
        self.hidden += f64::from(u8::from(found.notices.iter().any(hides)));
    }

    fn figures(&self) -> Figures {
        [self.worst.figures(), vec![("doubt", self.doubt)]].concat()
    }

    fn all_figures(&self) -> Figures {
        [self.figures(), vec![("said to be hidden", self.hidden)]].concat()
    }
}

/// Returns the worst once the object is as far away as it gets.
fn followed(
    seed: u64,
    count: usize,
    from: usize,
    shot: impl Fn(&Stage, usize) -> (Shot, Pose),
) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let (first, place) = shot(&stage, 0);
    let mut tracker = started(&stage, settings, &first, place);
    let mut seen = Seen::default();
    for index in 1..count {
        let (shot, truth) = shot(&stage, index);
        let found = tracker.step(&shot.observation()).unwrap();
        if index >= from {
            seen.add(&found, &truth);
        }
    }
    seen.all_figures()
}

/// The cameras come so near that the object is larger than the images.
fn approached(seed: u64) -> Figures {
    followed(seed, 28, 16, |stage, index| {
        let far = 0.5 * 0.93_f64.powi(index.min(20) as i32);
        let near = Vector3::new(0.0, 0.0, 0.5 - far);
        let looks = eyes()
            .map(|eye| Pose::from_rotation(UnitQuaternion::identity(), eye.translation() + near));
        (stage.shot(index, &looks, Some(&start())), start())
    })
}

/// The object moves sideways until a third of it is outside the left image.
fn leaving(seed: u64) -> Figures {
    followed(seed, 28, 16, |stage, index| {
        let aside = Vector3::new(0.009 * index.min(20) as f64, 0.0, 0.0);
        let there = Pose::from_rotation(start().rotation(), start().translation() + aside);
        (stage.shot(index, &eyes(), Some(&there)), there)
    })
}

/// Converts the left camera's image to grey.
fn grey_left(shot: &Shot) -> Vec<u8> {
    shot.pictures[0].iter().skip(1).step_by(3).copied().collect()
}

fn beside<'a>(shot: &'a Shot, grey: &'a [u8]) -> Observation<'a> {
    let left = ImageView::new(grey, SIZE, Channels::Grey).unwrap();
    let right = ImageView::new(&shot.pictures[1], SIZE, Channels::Rgb).unwrap();
    Observation { images: vec![Some(left), Some(right)], ..shot.observation() }
}

/// The left camera shows no colours; in the end the object is found anywhere by its appearance.
fn grey_beside_colour(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let new = || Tracker::new(&stage.cameras(), &stage.body, settings).unwrap();
    let (mut tracker, mut seen) = (new(), Seen::default());
    for index in 0..20 {
        let shot = stage.shot(index, &eyes(), Some(&moving(index)));
        let grey = grey_left(&shot);
        let now = beside(&shot, &grey);
        if index == 0 {
            tracker.start(&now, moving(0), &[]).unwrap();
        } else {
            seen.add(&tracker.step(&now).unwrap(), &moving(index));
        }
    }
    let mut other = new();
    other.recall(&tracker.appearance()).unwrap();
    let shot = stage.shot(20, &eyes(), Some(&moving(20)));
    seen.add(&other.find(&beside(&shot, &grey_left(&shot)), None).unwrap(), &moving(20));
    seen.figures()
}
