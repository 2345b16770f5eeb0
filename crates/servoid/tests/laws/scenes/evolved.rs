//! Bodies that evolve in their own frame.

use super::Sense::{AtLeast, AtMost};
use super::{Figures, MISCOUNTED, MISSED, Measure, Scene};
use crate::evolved::{Seen, at_most, disturbed, pair, solid};
use servoid::model::Settings;

/// Decrease of the overlap.
const FELL: Measure = ("fell", "1", AtMost);
const GAINED: Measure = ("gained", "1", AtLeast);

pub const SCENES: &[Scene] = &[
    Scene { name: "evolving to what was seen", measures: &[MISSED, GAINED], run: to_what_was_seen },
    Scene {
        name: "evolving what fits",
        measures: &[MISCOUNTED, FELL, ("moved", "mm", AtMost), ("swelled", "1", AtMost)],
        run: what_fits,
    },
    Scene { name: "evolving one inside", measures: &[MISCOUNTED, FELL], run: one_inside },
    Scene { name: "evolving one that floats", measures: &[MISSED, GAINED], run: one_that_floats },
    Scene { name: "evolving one more", measures: &[MISCOUNTED, GAINED], run: one_more },
];

fn settings(seed: u64, count: usize) -> Settings {
    at_most(count).with(|it| it.seed = seed)
}

/// Three bodies whose parts were moved a little, more, and a lot.
fn to_what_was_seen(seed: u64) -> Figures {
    let seen = Seen::new(&pair(), seed);
    let (mut missed, mut gained) = (0.0_f64, f64::INFINITY);
    for by in [0.3, 1.0, 2.0] {
        let (_, before, after) = seen.evolve(&disturbed(&pair(), by), settings(seed, 2));
        // The frame does not move: the overlap is measured at the same camera poses.
        (missed, gained) = (missed.max(1.0 - after), gained.min(after - before));
    }
    vec![("missed", missed), ("gained", gained)]
}

fn what_fits(seed: u64) -> Figures {
    let (grown, before, after) = Seen::new(&pair(), seed).evolve(&pair(), settings(seed, 4));
    let (mut moved, mut swelled) = (0.0_f64, 0.0_f64);
    for (one, other) in grown.iter().zip(pair()) {
        moved = moved.max(1e3 * (one.center() - other.center()).norm());
        swelled = swelled.max((one.volume() / other.volume() - 1.0).abs());
    }
    vec![
        ("miscounted", f64::from(u8::from(grown.len() != 2))),
        ("fell", (before - after).max(0.0)),
        ("moved", moved),
        ("swelled", swelled),
    ]
}

/// An ellipsoid lies inside another, so that nothing supports it.
fn one_inside(seed: u64) -> Figures {
    let inside = solid([0.04, 0.0, 0.01], [0.02, 0.02, 0.01]);
    let from = [pair(), vec![inside]].concat();
    let (grown, before, after) = Seen::new(&pair(), seed).evolve(&from, settings(seed, 3));
    let miscounted = f64::from(u8::from(grown.len() != 2));
    vec![("miscounted", miscounted), ("fell", (before - after).max(0.0))]
}

/// An ellipsoid floats where nothing was seen.
fn one_that_floats(seed: u64) -> Figures {
    let floating = solid([-0.1, -0.1, 0.0], [0.02; 3]);
    let from = [pair(), vec![floating]].concat();
    let (_, before, after) = Seen::new(&pair(), seed).evolve(&from, settings(seed, 3));
    vec![("missed", 1.0 - after), ("gained", after - before)]
}

/// An ellipsoid is missing; then no more than the existing ones are allowed.
fn one_more(seed: u64) -> Figures {
    let seen = Seen::new(&pair(), seed);
    let (grown, before, after) = seen.evolve(&pair()[..1], settings(seed, 3));
    assert_eq!(seen.evolve(&pair()[..1], settings(seed, 1)).0.len(), 1);
    let miscounted = f64::from(u8::from(grown.len() != 2));
    vec![("miscounted", miscounted), ("gained", after - before)]
}
