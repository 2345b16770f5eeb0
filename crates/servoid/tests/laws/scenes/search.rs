//! Searches of the genetic algorithm.

use super::Sense::{AtLeast, AtMost};
use super::{Figures, Scene};
use crate::search::{evolved, spread};

pub const SCENES: &[Scene] = &[
    Scene { name: "search of a summit", measures: &[("below", "1", AtMost)], run: summit },
    Scene {
        name: "search on a plateau",
        measures: &[("wide", "1", AtLeast), ("narrow", "1", AtMost)],
        run: plateau,
    },
];

/// Maximises a function of six genes whose maximum is at 0, for 80 generations.
fn summit(seed: u64) -> Figures {
    let (ga, best) = evolved(seed, 80);
    assert!(best.windows(2).all(|pair| pair[1] >= pair[0]), "{best:?}");
    vec![("below", -ga.best().score)]
}

/// Mutations narrow where nothing is better, to one of two least widths.
fn plateau(seed: u64) -> Figures {
    vec![("wide", spread(seed, 0.05)), ("narrow", spread(seed, 1e-4))]
}
