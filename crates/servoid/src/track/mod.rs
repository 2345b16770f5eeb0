//! Tracks a body in images: estimates its pose in six degrees of freedom for each observation.

mod adjust;
mod appearance;
mod begin;
mod clock;
mod estimate;
mod frame;
mod inputs;
mod landscape;
mod motion;
mod one_step;
mod pose;
mod relocalize;
mod settings;
mod start_masks;
mod target;
mod tracker;
mod trust;
mod update;

pub use appearance::Appearance;
pub use estimate::{Estimate, Notice, Status, Timing};
pub use one_step::{Genes, Objective, OneStep, OneStepError, OneStepSettings};
pub use pose::confidence::Evidence;
pub use pose::search::ScoreTerms;
pub use relocalize::{MaskFit, pose_from_masks, poses_from_masks};
pub use settings::TrackSettings;
pub use tracker::Tracker;

use crate::camera::Channels;
use crate::words::{Digits, s, were};

/// Why an object cannot be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackError {
    /// A setting is out of its range.
    #[error("{name} must be {allowed}, but it is {given}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What is allowed.
        allowed: &'static str,
        /// What was given.
        given: String,
    },
    /// The observation does not have one entry per camera.
    #[error(
        "the tracker has {cameras} camera{} and needs as many {what}, but was given {given}",
        s(*cameras)
    )]
    Count {
        /// What is counted.
        what: &'static str,
        /// Cameras of the tracker.
        cameras: usize,
        /// Entries given.
        given: usize,
    },
    /// A tracker needs a camera.
    #[error("a tracker needs at least one camera")]
    NoCamera,
    /// A time stamp is not finite.
    #[error("a time stamp must be a finite number of seconds, but it is {}", Digits(*.0))]
    Time(f64),
    /// Neither colours nor surface points of the object are known.
    #[error(
        "nothing is known of the object's appearance, so it cannot be found: give a mask or \
         another target in the first observation, or its pose there"
    )]
    NothingKnown,
    /// The object's colours were learned in images of the other kind, grey or in colour.
    #[error(
        "the object's appearance was learned in {}, and these images are {}, so it cannot be found \
         in them without a pose: give images as those, a mask or another target in the first \
         observation, or its pose there",
        if *.0 == Channels::Grey { "grey images" } else { "images in colour" },
        if *.0 == Channels::Grey { "in colour" } else { "grey" }
    )]
    LearnedIn(Channels),
    /// `step` was called before any start.
    #[error(
        "the tracker was never started, so the object's appearance is unknown: call start with the \
         object's pose in the first images, or recall an appearance and call find"
    )]
    NotStarted,
    /// The bytes are not an appearance.
    #[error(
        "these {0} bytes are not an appearance that this version can read; leave the appearance \
         out, or save the body again"
    )]
    Appearance(usize),
    /// The bytes are an appearance of a later version.
    #[error(
        "the appearance is of version {0}, and this servoid reads versions 1 and 2: use a newer one, \
         leave the appearance out, or save the body again"
    )]
    Newer(u8),
    /// An appearance has a number that no object has.
    #[error(
        "{what} in the appearance is {given}, but it must be {allowed}: the appearance is damaged, \
         or of another body; leave it out, or save the body again"
    )]
    Impossible {
        /// What the number is.
        what: &'static str,
        /// What is possible.
        allowed: String,
        /// What was given.
        given: String,
    },
    /// A pose was sought from masks, but there is no mask.
    #[error("a pose is estimated from masks, but there is none; give a target or a start")]
    NoMask,
    /// There is not one colour per ellipsoid.
    #[error(
        "a body of {ellipsoids} ellipsoid{} has as many colours, but {given} {} given; give the \
         colours that were made with it, or none",
        s(*ellipsoids),
        were(*given)
    )]
    Colors {
        /// Ellipsoids of the body.
        ellipsoids: usize,
        /// Colours given.
        given: usize,
    },
    /// The body does not fit the masks at any pose.
    #[error(
        "the body does not fit the mask: their intersection over union is {0:.2} at best; check \
         that it is the body of this object, in metres, or give a start"
    )]
    Unfit(f64),
    /// The object is in none of the images at the given pose.
    #[error(
        "the object is in none of the images at the pose that was given; check that it is \
         world_from_object, in metres"
    )]
    NotInView,
    /// No image of the first observation can be used.
    #[error(
        "no image shows where the object is: {}; give images of each camera's size that show the \
         object",
        .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
    )]
    NoUse(Vec<Notice>),
    /// A setting of the search is out of its range.
    #[error(transparent)]
    Search(#[from] crate::evolve::GaError),
    /// The body cannot evolve by these views.
    #[error(transparent)]
    Model(#[from] crate::model::ModelError),
    /// The ellipsoids do not make a body.
    #[error(transparent)]
    Shape(#[from] crate::shape::ShapeError),
    /// An image does not fit its camera.
    #[error(transparent)]
    Image(#[from] crate::camera::RigError),
}
