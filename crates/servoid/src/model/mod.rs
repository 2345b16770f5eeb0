//! Computes a body from observations: the progressive flow of the paper's Fig. 1, and what makes it
//! fast.

mod color;
mod coverage;
mod evolved;
mod initial;
mod input;
mod levels;
mod paper;
mod progressive;
mod scene;
mod settings;
mod synthetic_views;

pub use color::ellipsoid_colors;
pub use coverage::{Coverage, coverage};
pub use evolved::evolved;
pub(crate) use evolved::{Attempt, evolved_after};
pub use initial::{UnmaskedImage, initial_body};
pub use input::{ModelInput, Weights};
pub(crate) use levels::shrunk_overlap;
pub use paper::{PaperSettings, paper, paper_scores};
pub use progressive::{Progress, Step, progressive};
pub use scene::silhouette_ious;
pub use settings::Settings;
pub(crate) use settings::workers;
pub use synthetic_views::{SyntheticView, half_ball_direction};

use crate::words::{Digits, were};

/// Why an object cannot be modelled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// There are too few views.
    #[error(
        "modelling needs at least two views from different places, but {} {} given: one image \
         cannot distinguish a small near object from a large far one",
        .0,
        were(*.0)
    )]
    TooFewViews(usize),
    /// There are too few measured points, and no second view.
    #[error(
        "modelling needs at least {least} measured points of the surface, or two views from \
         different places, but only {given} {} measured, and there is no second view",
        were(*given)
    )]
    TooFewRangeSamples {
        /// Points given.
        given: usize,
        /// Points required.
        least: usize,
    },
    /// The measured points are one point, or lie on a line.
    #[error(
        "the {given} measured points {what}, and so determine no shape; measure points over the \
         whole surface that is seen, and check that their x, y and z were read from the right \
         columns"
    )]
    NoSurface {
        /// Points given.
        given: usize,
        /// What they do instead of covering a surface.
        what: &'static str,
    },
    /// The lines of sight are parallel or the cameras are at one position.
    #[error(
        "the views' lines of sight to the object are parallel or start at one position, so its \
         distance is not determined: images cannot distinguish a small near object from a large \
         far one; add views from other positions, and check that each has its own pose"
    )]
    NoBaseline,
    /// Every kind of evidence has weight 0.
    #[error("nothing is left to model from: every kind of evidence that was given has weight 0")]
    Nothing,
    /// The views look at different places.
    #[error(
        "the views see no common point: the lines of sight to the masks' centres come closest at \
         ({}, {}, {}) m, which view {view} {what}; check that poses are world_from_rig, in metres, \
         in the order of the images, that focal_px and center_px are the camera's, and that every \
         mask marks the same object",
        Digits(point[0]), Digits(point[1]), Digits(point[2])
    )]
    NoCommonPoint {
        /// Where the lines of sight come closest.
        point: [f64; 3],
        /// Index of the first view that disagrees, in the list of used views.
        view: usize,
        /// How it disagrees.
        what: &'static str,
    },
    /// A setting is out of its range.
    #[error("{name} must be {allowed}, but it is {given}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What is allowed.
        allowed: String,
        /// What was given.
        given: String,
    },
    /// An image does not show the object.
    #[error(transparent)]
    Picture(#[from] crate::camera::ImageError),
    /// An image does not fit its view.
    #[error(transparent)]
    Image(#[from] crate::camera::RigError),
    /// A camera cannot be cropped to the object.
    #[error(transparent)]
    Camera(#[from] crate::camera::CameraError),
    /// The views do not make a points term.
    #[error(transparent)]
    Points(#[from] crate::fitness::PointsError),
    /// A setting of the search is out of its range.
    #[error(transparent)]
    Search(#[from] crate::evolve::GaError),
    /// The ellipsoids do not make a body.
    #[error(transparent)]
    Shape(#[from] crate::shape::ShapeError),
    /// The worker threads could not be started.
    #[error("{0} worker threads could not be started; use fewer")]
    Threads(usize),
    /// The caller's progress callback requested a stop.
    #[error("modelling was stopped")]
    Stopped,
}
