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
    /// Seed of every search.
    pub seed: u64,
    /// Worker threads; 0 takes as many as the machine has. The result does not depend on it.
    pub threads: usize,
    /// Places that are searched independently for each new ellipsoid.
    pub islands: usize,
    /// Generations of each search.
    pub generations: usize,
    /// How each search breeds.
    pub search: GaSettings,
    /// Rounds, for each count, in which ellipsoids are taken out and sought anew.
    pub reseeds: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            max_ellipsoids: 8,
            delta: 0.003,
            seed: 0,
            threads: 0,
            islands: 6,
            generations: 14,
            search: GaSettings::default(),
            reseeds: 3,
        }
    }
}

impl Settings {
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
        if self.islands == 0 {
            return fail("islands", "at least 1".into(), "0".into());
        }
        Ok(self)
    }
}
