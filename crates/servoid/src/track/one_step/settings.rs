use crate::camera::{ImageError, RigError};
use crate::changing::changeable;
use crate::evolve::{GaError, GaSettings};
use crate::fitness::{Margin, PointsError};

/// What an individual says of the object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Genes {
    /// Its place x, y, z; the orientation is held as it was given.
    Place,
    /// Its place and its orientation.
    Pose,
}

/// What is maximised: the score of an individual.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Objective {
    /// The paper's points: on each surface, and on an envelope around it.
    Points {
        /// m: points on each surface, and on each envelope.
        count: usize,
        /// α: by how much an envelope's radii exceed its ellipsoid's.
        alpha: Margin,
    },
    /// Whole areas: the colours' log-likelihood ratios, summed inside the outlines.
    Region,
}

/// How the 1-step genetic algorithm tracks. The paper gives none of these numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct OneStepSettings {
    /// Seed of the search.
    pub seed: u64,
    /// What is sought.
    pub genes: Genes,
    /// What is maximised.
    pub objective: Objective,
    /// How far from the last place the next one is sought, along each axis, in object sizes.
    pub reach: f64,
    /// How far the next orientation is sought from the last, about each axis, in radians.
    pub turn: f64,
    /// Least confidence that counts as tracking.
    pub tracking_from: f64,
    /// Confidence below which an image is taken not to show the object where it was sought.
    pub missing_below: f64,
    /// Such images on end after which the object counts as lost.
    pub lost_after: usize,
    /// How the population breeds.
    pub search: GaSettings,
}

changeable!(OneStepSettings);

impl Default for OneStepSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            genes: Genes::Pose,
            objective: Objective::Points { count: 200, alpha: Margin::Share(0.3) },
            reach: 0.4,
            turn: 0.2,
            tracking_from: 0.5,
            missing_below: 0.25,
            lost_after: 15,
            search: GaSettings {
                population: 100,
                mutation_width: 0.1,
                // An object at rest must not narrow the search so far that it gets away when it moves.
                least_width: 0.03,
                ..GaSettings::default()
            },
        }
    }
}

/// Why the 1-step genetic algorithm cannot track.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OneStepError {
    /// Nothing was learnt yet.
    #[error("the tracker was not started: start it with an observation and the object's pose")]
    NotStarted,
    /// The first observation does not show the object.
    #[error(
        "no image of the first observation shows the object: {images} were usable, and in none \
         of them does it cover a part, but not all, of the image; give masks, or a pose at which \
         the cameras see it"
    )]
    Unseen {
        /// Images that had the right size.
        images: usize,
    },
    /// A setting is out of its range.
    #[error("{name} must be {allowed}, but it is {given}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What is allowed.
        allowed: &'static str,
        /// What was given.
        given: f64,
    },
    /// The observation does not belong to the cameras.
    #[error(transparent)]
    Observation(#[from] RigError),
    /// An image cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The settings make no points term.
    #[error(transparent)]
    Points(#[from] PointsError),
    /// The search was misconfigured.
    #[error(transparent)]
    Search(#[from] GaError),
}

impl OneStepSettings {
    /// Passes the settings on if they are in their ranges.
    ///
    /// # Errors
    /// If one is not.
    pub fn checked(self) -> Result<Self, OneStepError> {
        let bounded = |name, allowed, given: f64, fits: bool| {
            if fits { Ok(()) } else { Err(OneStepError::Setting { name, allowed, given }) }
        };
        let positive = |x: f64| x > 0.0 && x.is_finite();
        bounded("reach", "a positive number of object sizes", self.reach, positive(self.reach))?;
        let turns = positive(self.turn) && self.turn <= std::f64::consts::PI;
        bounded("turn", "above 0 and at most pi radians", self.turn, turns)?;
        let (missing, tracking) = (self.missing_below, self.tracking_from);
        bounded("tracking_from", "0 to 1", tracking, (0.0..=1.0).contains(&tracking))?;
        let below = (0.0..=tracking).contains(&missing);
        bounded("missing_below", "0 to tracking_from", missing, below)?;
        let images = self.lost_after as f64;
        bounded("lost_after", "at least 1", images, self.lost_after > 0)?;
        Ok(self)
    }
}
