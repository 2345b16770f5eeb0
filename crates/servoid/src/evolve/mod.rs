//! Optimisation: a real-coded genetic algorithm, and a gradient ascent that refines its results.

mod climb;
mod ga;
mod operators;

pub use climb::{Climb, ClimbSettings, climb};
pub use ga::{Ga, GaError, GaSettings, Individual};

/// The random number generator of all searches: the same seed gives the same bits on every machine.
pub type Rng = rand_pcg::Pcg64;

/// Returns the generator of branch `branch` of a search with a seed.
#[must_use]
pub fn rng(seed: u64, branch: u64) -> Rng {
    Rng::new(u128::from(seed), u128::from(branch))
}
