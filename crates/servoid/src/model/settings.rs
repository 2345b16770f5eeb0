use super::ModelError;
use crate::evolve::GaSettings;
use crate::shape::Body;

/// How modelling proceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Most ellipsoids.
    pub max_ellipsoids: usize,
    /// Modelling stops when another ellipsoid raises F by less; 0 goes on to the maximum.
    pub delta: f64,
    /// Whether a part of the evidence is held out to choose the count by, where there is enough of
    /// it; δ is then what an ellipsoid must earn there.
    pub held_out: bool,
    /// Seed of every search.
    pub seed: u64,
    /// Worker threads; 0 takes as many as the machine has. The result does not depend on it.
    pub threads: usize,
    /// Places that are searched independently for each new ellipsoid.
    pub islands: usize,
    /// Splits of standing ellipsoids that are tried for each new one.
    pub splits: usize,
    /// Generations of each search.
    pub generations: usize,
    /// How each search breeds.
    pub search: GaSettings,
    /// Rounds, for each count, in which ellipsoids are taken out and sought anew.
    pub reseeds: usize,
    /// Single ellipsoids that each such round tries to take out.
    pub singles: usize,
    /// Pairs of ellipsoids that each such round tries to take out.
    pub pairs: usize,
    /// Independent lines of growth, which are crossed in the end.
    pub lines: usize,
    /// Ellipsoids by which the count exceeds the maximum before it goes down.
    pub overshoot: usize,
}

/// Up to this count independent lines of growth cost little.
const FEW: usize = 10;

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
    /// Searches as little as gives a useful body, for one that is only a step to another.
    #[must_use]
    pub fn quick(self) -> Self {
        Self { lines: 1, islands: 2, splits: 2, reseeds: 0, overshoot: 0, ..self }
    }

    /// Searches less: a volume leaves less open than outlines do, and costs more to score.
    pub(super) fn for_solids(self) -> Self {
        let lines = if self.max_ellipsoids > FEW { 2 } else { 4 };
        Self { lines, islands: 3, splits: 3, reseeds: 0, overshoot: 1, ..self }
    }

    /// Searches less still: seen points say where the surface is.
    pub(super) fn for_sights(self) -> Self {
        Self { lines: 2, islands: 2, splits: 2, reseeds: 0, overshoot: 1, ..self }
    }

    /// Passes the settings on if they are in their ranges.
    pub(super) fn checked(self) -> Result<Self, ModelError> {
        let most = Body::MAX_ELLIPSOIDS;
        let fail = |name, allowed: String, given: String| {
            Err(ModelError::Setting { name, allowed, given })
        };
        if self.max_ellipsoids == 0 || self.max_ellipsoids > most {
            let given = self.max_ellipsoids.to_string();
            return fail("max_ellipsoids", format!("1 to {most}"), given);
        }
        if !(0.0..1.0).contains(&self.delta) {
            return fail("delta", "at least 0 and below 1".into(), self.delta.to_string());
        }
        for (name, given) in [("islands", self.islands), ("lines", self.lines)] {
            if given == 0 {
                return fail(name, "at least 1".into(), given.to_string());
            }
        }
        Ok(self)
    }
}
