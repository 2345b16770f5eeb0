use super::TrackError;
use crate::changing::changeable;
use crate::model::Settings;

/// How tracking proceeds.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TrackSettings {
    /// Seed of every search.
    pub seed: u64,
    /// Hypotheses a generation.
    pub population: usize,
    /// Generations an image while the object is tracked; more follow where the images do not
    /// confirm what they found.
    pub generations: usize,
    /// Seconds after which no further generation is begun; `None` leaves it to the counts, so that a
    /// replay gives the same bits.
    pub budget_s: Option<f64>,
    /// Whether surface points are learned and scored.
    pub surface: bool,
    /// Whether colours are learned and scored.
    pub region: bool,
    /// Whether the background's colours are told apart by where they lie.
    pub local_colors: bool,
    /// Whether keyframes and surface points are adjusted together, in a thread of its own.
    pub adjust: bool,
    /// Whether motion tells the distances of points that one camera sees alone from the start, from a wide guess:
    /// else it does where the body is found to be a bad one. An object that hardly turns is tracked better without.
    pub depth_from_motion: bool,
    /// Surface points that are looked at in each camera.
    pub points: usize,
    /// Share of what should be seen of an object from which on the pose of an object that was not tracked is trusted.
    pub trusted: f64,
    /// Share down to which that of one that was tracked is: part of it may be hidden.
    pub held: f64,
    /// How the body evolves: most ellipsoids and what one more must earn.
    pub growth: Settings,
}

changeable!(TrackSettings);

impl Default for TrackSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            population: 24,
            generations: 1,
            budget_s: None,
            surface: true,
            region: true,
            local_colors: true,
            adjust: true,
            depth_from_motion: false,
            points: 80,
            trusted: 0.5,
            held: 0.35,
            growth: Settings::default(),
        }
    }
}

impl TrackSettings {
    /// Passes the settings on if they are in their ranges.
    ///
    /// # Errors
    /// If one is not.
    pub fn checked(self) -> Result<Self, TrackError> {
        let fail = |name, allowed, given: String| Err(TrackError::Setting { name, allowed, given });
        if !(8..=4096).contains(&self.population) {
            return fail("population", "8 to 4096", self.population.to_string());
        }
        if !(1..=1000).contains(&self.generations) {
            return fail("generations", "1 to 1000", self.generations.to_string());
        }
        if let Some(budget) = self.budget_s.filter(|b| !(b.is_finite() && *b > 0.0)) {
            return fail("budget_s", "a positive number of seconds", budget.to_string());
        }
        if !(self.surface || self.region) {
            return fail("surface and region", "not both switched off", "false, false".into());
        }
        if !(1..=1000).contains(&self.points) {
            return fail("points", "1 to 1000", self.points.to_string());
        }
        for (name, given) in [("trusted", self.trusted), ("held", self.held)] {
            if !(given > 0.0 && given <= 1.0) {
                return fail(name, "above 0 and at most 1", given.to_string());
            }
        }
        if self.held > self.trusted {
            return fail("held", "at most as high as trusted", self.held.to_string());
        }
        self.growth.checked()?;
        Ok(self)
    }
}
