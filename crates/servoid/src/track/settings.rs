use super::TrackError;
use crate::changing::changeable;
use crate::model::Settings;

/// Settings of tracking.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TrackSettings {
    /// Seed of every search.
    pub seed: u64,
    /// Hypotheses per generation.
    pub population: usize,
    /// Generations per image while the object is tracked; more follow if the images do not confirm
    /// the result.
    pub generations: usize,
    /// Seconds after which no further generation starts, nor a search beside a proved pose. An object
    /// that is missed, or not proved to be the lost one, is sought all the same. With `None` only the
    /// counts decide, so a replay gives the same bits.
    pub budget_s: Option<f64>,
    /// Whether surface points are learned and scored.
    pub surface: bool,
    /// Whether colours are learned and scored.
    pub region: bool,
    /// Whether the background's colours are learned separately for the sides of the object.
    pub local_colors: bool,
    /// Whether keyframes and surface points are adjusted together, in a separate thread.
    pub adjust: bool,
    /// Whether the outlines of an object without print adjust its body and its keyframes together, if
    /// two or more cameras see it, in a separate thread. A step may wait for it. Its body is then one of a
    /// first look, a guess in depth, and one camera doubts it.
    pub adjust_outlines: bool,
    /// Whether the distances of points that only one camera sees are estimated from motion from the
    /// start, beginning with a wide guess. Otherwise this starts once the body is found to be
    /// inaccurate. An object that hardly rotates is tracked better without it.
    pub depth_from_motion: bool,
    /// Whether the body has the object's shape on all sides, as one made from a mesh has. Its
    /// outline then outweighs surface points that only shading shows, since these slide along the
    /// surface.
    pub known_shape: bool,
    /// Most surface points compared per camera.
    pub points: usize,
    /// Least share of what should be visible of an object to trust the pose of one that was not
    /// tracked before.
    pub trusted: f64,
    /// The same for an object that was tracked: part of it may be hidden.
    pub held: f64,
    /// How the body evolves: most ellipsoids and the gain that one more requires.
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
            adjust_outlines: false,
            depth_from_motion: false,
            known_shape: false,
            points: 80,
            trusted: 0.5,
            held: 0.35,
            growth: Settings::default(),
        }
    }
}

impl TrackSettings {
    /// Returns whether the body is of one look, and so a guess in depth: only such bodies are adjusted.
    pub(super) fn is_of_one_look(&self) -> bool {
        self.adjust_outlines && !self.known_shape
    }

    /// Returns the settings if all are in their ranges.
    ///
    /// # Errors
    /// If a setting is out of its range.
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
