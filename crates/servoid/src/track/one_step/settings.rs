use crate::camera::{ImageError, RigError};
use crate::changing::changeable;
use crate::evolve::{GaError, GaSettings};
use crate::fitness::{Margin, PointsError};

/// The unknowns that an individual encodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Genes {
    /// The position x, y, z; the orientation stays as given.
    Place,
    /// Position and orientation.
    Pose,
}

/// The score of an individual, which is maximised.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Objective {
    /// The paper's points: on each surface, and on an envelope around it.
    Points {
        /// m: points on each surface, and on each envelope.
        count: usize,
        /// α: the amount by which an envelope's radii exceed its ellipsoid's.
        alpha: Margin,
    },
    /// Whole areas: the colours' log-likelihood ratios, summed inside the outlines.
    Region,
}

/// Settings of tracking with the 1-step genetic algorithm. The paper gives none of these numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct OneStepSettings {
    /// Seed of the search.
    pub seed: u64,
    /// The unknowns that are estimated.
    pub genes: Genes,
    /// The score that is maximised.
    pub objective: Objective,
    /// Search range around the last position, along each axis, in object sizes.
    pub reach: f64,
    /// Search range around the last orientation, about each axis, in radians.
    pub turn: f64,
    /// Least confidence that counts as tracking.
    pub tracking_from: f64,
    /// Confidence below which an image is taken not to show the object in the search range.
    pub missing_below: f64,
    /// Number of consecutive images of that kind after which the object counts as lost.
    pub lost_after: usize,
    /// Settings of the genetic algorithm.
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
                // An object at rest must not narrow the search so far that it is lost when it
                // moves.
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
    /// Nothing was learned yet.
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
    /// The settings do not make a points term.
    #[error(transparent)]
    Points(#[from] PointsError),
    /// A setting of the search is out of its range.
    #[error(transparent)]
    Search(#[from] GaError),
}

impl OneStepSettings {
    /// Returns the settings if all are in their ranges.
    ///
    /// # Errors
    /// If a setting is out of its range.
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
