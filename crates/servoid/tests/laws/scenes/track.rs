//! Sequences of the tracker in which the object is visible all the time.

use nalgebra::Vector3;
use servoid::camera::Channels;
use servoid::track::{Notice, TrackSettings};

use super::Sense::{AtLeast, AtMost};
use super::{Figures, Measure, NOT_LOCATED, NOT_TRACKING, OFF, Scene, TURNED, Worst};
use crate::shapes::drawn::{Stage, eyes, eyes_at};
use crate::track::{around_the_start, followed, followed_ball, moving, seeded, start, started};

const USUAL: &[Measure] = &[NOT_TRACKING, OFF, TURNED];
const PLAIN: &[Measure] = &[NOT_LOCATED, OFF, TURNED];

pub const SCENES: &[Scene] = &[
    Scene {
        name: "track moving",
        measures: &[
            NOT_TRACKING,
            OFF,
            TURNED,
            ("doubt", "1", AtMost),
            ("notices", "1", AtMost),
            ("open", "axes", AtMost),
        ],
        run: in_colour,
    },
    Scene { name: "track grey", measures: USUAL, run: grey },
    Scene { name: "track by points", measures: USUAL, run: by_points },
    Scene { name: "track plain by colours", measures: PLAIN, run: plain_by_colours },
    Scene { name: "track plain", measures: PLAIN, run: plain },
    Scene { name: "track turning eyes", measures: USUAL, run: turning_eyes },
    Scene {
        name: "track half hidden",
        measures: &[("unsaid", "images", AtMost), OFF, TURNED],
        run: half_hidden,
    },
    Scene {
        name: "track balls",
        measures: &[
            ("open beside turns", "axes", AtMost),
            ("turns shown", "axes", AtMost),
            ("patterned open", "axes", AtMost),
        ],
        run: balls,
    },
    Scene {
        name: "track worth",
        measures: &[
            ("more than elsewhere", "1", AtLeast),
            ("region", "1", AtLeast),
            ("surface", "1", AtLeast),
        ],
        run: worth,
    },
];

fn usual(stage: &Stage, settings: TrackSettings, count: usize) -> Worst {
    let mut worst = Worst::default();
    for (index, found) in followed(stage, settings, count).iter().enumerate() {
        worst.add(found, &moving(index + 1));
    }
    worst
}

fn in_colour(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let (mut worst, mut doubt, mut notices, mut open) = (Worst::default(), 0.0_f64, 0, 0);
    for (index, found) in followed(&stage, settings, 20).iter().enumerate() {
        assert!(found.evaluations > 0 && found.confidence <= 1.0);
        worst.add(found, &moving(index + 1));
        doubt = doubt.max(1.0 - found.confidence);
        notices += found.notices.len();
        open += found.unobservable.len();
    }
    let more = vec![("doubt", doubt), ("notices", notices as f64), ("open", open as f64)];
    [worst.figures(), more].concat()
}

fn grey(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    usual(&Stage { channels: Channels::Grey, ..stage }, settings, 10).figures()
}

fn by_points(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    usual(&stage, settings.with(|it| it.region = false), 10).figures()
}

/// A plain object shows nothing but outlines.
fn plain(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage { pattern: 0.0, ..Stage::textured() });
    usual(&stage, settings, 10).plain_figures()
}

fn plain_by_colours(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage { pattern: 0.0, ..Stage::textured() });
    usual(&stage, settings.with(|it| it.surface = false), 10).plain_figures()
}

/// An object at rest, and cameras that follow a circling point.
fn turning_eyes(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let looks = |index: usize| {
        let angle = 0.15 * index as f64;
        eyes_at(&(start().translation() + Vector3::new(angle.sin(), angle.cos() - 1.0, 0.0) * 0.06))
    };
    let shot = |index: usize| stage.shot(index, &looks(index), Some(&start()));
    let mut tracker = started(&stage, settings, &shot(0), start());
    let mut worst = Worst::default();
    for index in 1..15 {
        worst.add(&tracker.step(&shot(index).observation()).unwrap(), &start());
    }
    worst.figures()
}

fn half_hidden(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let whole = |index: usize| stage.shot(index, &eyes(), Some(&moving(index)));
    let mut tracker = started(&stage, settings, &whole(0), moving(0));
    for index in 1..4 {
        tracker.step(&whole(index).observation()).unwrap();
    }
    let half = Stage { hidden_left_of: 160, ..stage };
    let (mut worst, mut unreported) = (Worst::default(), 0.0);
    for index in 4..12 {
        let shot = half.shot(index, &eyes(), Some(&moving(index)));
        let found = tracker.step(&shot.observation()).unwrap();
        worst.add(&found, &moving(index));
        let reported = found.notices.iter().any(|notice| matches!(notice, Notice::Hidden { .. }));
        // What stays hidden is no longer expected, so only the first images report it.
        unreported += f64::from(u8::from(!reported && index <= 5));
    }
    vec![("unsaid", unreported), ("off", worst.off), ("turned", worst.turned)]
}

fn balls(seed: u64) -> Figures {
    let [plain, patterned] = [0.0, 1.0].map(|pattern| {
        let (stage, settings) = seeded(seed, Stage::ball(pattern));
        followed_ball(&stage, settings)
    });
    let shown = |axis: &usize| {
        plain.unobservable.iter().map(|open| open[*axis].powi(2)).sum::<f64>() < 0.99
    };
    assert!(plain.unobservable.iter().all(|open| (open.norm() - 1.0).abs() < 1e-9));
    vec![
        ("open beside turns", plain.unobservable.len() as f64 - 3.0),
        ("turns shown", (3..6).filter(shown).count() as f64),
        ("patterned open", patterned.unobservable.len() as f64),
    ]
}

fn worth(seed: u64) -> Figures {
    let (stage, settings) = seeded(seed, Stage::textured());
    let first = stage.shot(0, &eyes(), Some(&moving(3)));
    let tracker = started(&stage, settings, &first, moving(3));
    let shot = stage.shot(1, &eyes(), Some(&start()));
    let poses = around_the_start();
    let score_terms = tracker.score_terms(&shot.observation(), &poses, 0, 0).unwrap();
    let elsewhere = poses.iter().zip(&score_terms).filter(|(pose, _)| **pose != start());
    let best = elsewhere.map(|(_, one)| one.total()).fold(f64::NEG_INFINITY, f64::max);
    vec![
        ("more than elsewhere", score_terms[0].total() - best),
        ("region", score_terms[0].region),
        ("surface", score_terms[0].surface),
    ]
}
