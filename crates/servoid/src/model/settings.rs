use super::ModelError;
use crate::changing::changeable;
use crate::evolve::GaSettings;
use crate::parallel::{Pool, pool};
use crate::shape::Body;

/// Settings of modelling.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Settings {
    /// Most ellipsoids.
    pub max_ellipsoids: usize,
    /// Modelling stops when another ellipsoid raises F by less; with 0 it continues to the maximum.
    pub delta: f64,
    /// Whether a part of the evidence is held out to select the number of ellipsoids, if there is
    /// enough of it; δ is then the gain that each ellipsoid must reach there.
    pub held_out: bool,
    /// Seed of every search.
    pub seed: u64,
    /// Worker threads; 0 uses as many as the machine has. The result does not depend on it.
    pub threads: usize,
    /// Independent searches for each new ellipsoid. From a mesh or range samples, a value of its own
    /// replaces this one, `splits`, `reseeds`, `lines` and `overshoot`.
    pub islands: usize,
    /// Splits of existing ellipsoids that are tried for each new one.
    pub splits: usize,
    /// Generations of each search.
    pub generations: usize,
    /// Settings of the genetic algorithm.
    pub search: GaSettings,
    /// Rounds, for each number of ellipsoids, in which some are removed and searched anew.
    pub reseeds: usize,
    /// Single ellipsoids that each such round tries to remove.
    pub singles: usize,
    /// Pairs of ellipsoids that each such round tries to remove.
    pub pairs: usize,
    /// Independent lines of growth, which are combined in the end.
    pub lines: usize,
    /// Number of ellipsoids beyond the maximum up to which a line grows before it shrinks.
    pub overshoot: usize,
}

/// Number of ellipsoids up to which independent lines of growth cost little.
const FEW: usize = 10;

changeable!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_ellipsoids: 8,
            delta: 0.003,
            held_out: false,
            seed: 0,
            threads: 0,
            islands: 3,
            splits: 2,
            generations: 14,
            search: GaSettings::default(),
            reseeds: 1,
            singles: 3,
            pairs: 2,
            lines: 3,
            overshoot: 1,
        }
    }
}

impl Settings {
    /// Most worker threads.
    pub const MAX_THREADS: usize = 256;

    /// Returns settings for a short search, for a body that is only an intermediate step.
    #[must_use]
    pub fn quick(self) -> Self {
        Self { lines: 1, islands: 2, splits: 2, reseeds: 0, overshoot: 0, ..self }
    }

    /// Replaces `lines`, `islands`, `splits`, `reseeds` and `overshoot` by the values for a mesh: a
    /// volume constrains more than outlines do, and costs more to score, so that no round removes
    /// ellipsoids and searches them anew. Up to [`FEW`] ellipsoids, lines of growth cost little, and
    /// there are more of them than by default.
    pub(super) fn for_solids(self) -> Self {
        let lines = if self.max_ellipsoids > FEW { 2 } else { 4 };
        Self { lines, islands: 3, splits: 3, reseeds: 0, overshoot: 1, ..self }
    }

    /// Replaces the same five by the values of a shorter search: measured points determine the
    /// surface.
    pub(super) fn for_samples(self) -> Self {
        Self { lines: 2, islands: 2, splits: 2, reseeds: 0, overshoot: 1, ..self }
    }

    /// Returns the settings if all are in their ranges.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn checked(self) -> Result<Self, ModelError> {
        check_common(self.max_ellipsoids, self.delta)?;
        check_threads(self.threads)?;
        self.search.checked()?;
        check_count("islands", self.islands, 1)?;
        check_count("lines", self.lines, 1)?;
        check_count("splits", self.splits, 0)?;
        check_count("generations", self.generations, 0)?;
        check_count("reseeds", self.reseeds, 0)?;
        check_count("singles", self.singles, 0)?;
        check_count("pairs", self.pairs, 0)?;
        check_count("overshoot", self.overshoot, 0)?;
        Ok(self)
    }
}

/// Checks the settings that all methods share.
pub(super) fn check_common(max_ellipsoids: usize, delta: f64) -> Result<(), ModelError> {
    check_range("max_ellipsoids", max_ellipsoids, 1, Body::MAX_ELLIPSOIDS)?;
    if !(0.0..1.0).contains(&delta) {
        return Err(ModelError::Setting {
            name: "delta",
            allowed: "at least 0 and below 1".into(),
            given: delta.to_string(),
        });
    }
    Ok(())
}

/// Largest value of a count in the settings: each costs time or memory.
const MOST: usize = 10_000;

/// Checks that a count is at least `least`.
pub(super) fn check_count(
    name: &'static str,
    given: usize,
    least: usize,
) -> Result<(), ModelError> {
    check_range(name, given, least, MOST)
}

fn check_threads(threads: usize) -> Result<(), ModelError> {
    check_range("threads", threads, 0, Settings::MAX_THREADS)
}

fn check_range(
    name: &'static str,
    given: usize,
    least: usize,
    most: usize,
) -> Result<(), ModelError> {
    if (least..=most).contains(&given) {
        return Ok(());
    }
    let (allowed, given) = (format!("{least} to {most}"), given.to_string());
    Err(ModelError::Setting { name, allowed, given })
}

/// Starts worker threads; 0 uses as many as the machine has.
pub(crate) fn workers(threads: usize) -> Result<Pool, ModelError> {
    check_threads(threads)?;
    pool(threads).map_err(|_| ModelError::Threads(threads))
}
