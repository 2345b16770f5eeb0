use std::time::Duration;

use nalgebra::Matrix6;

use super::pose::confidence::Evidence;
use crate::pose::{Pose, Twist};
use crate::words::Seconds;

/// What a tracker believes about its own answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The images confirm the pose.
    Tracking,
    /// The images do not confirm a pose; the object is sought near where it was, or everywhere if
    /// it was never tracked.
    Searching,
    /// It was not found for a while; it is sought everywhere.
    Lost,
}

impl Status {
    /// Returns the word that files use.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracking => "tracking",
            Self::Searching => "searching",
            Self::Lost => "lost",
        }
    }
}

/// What was wrong with an observation, as far as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Notice {
    /// A camera delivered no image.
    #[error("camera {0} delivered no image")]
    NoImage(usize),
    /// An image has not its camera's size.
    #[error("camera {camera}: the image is {}x{} pixels, its camera's are {}x{}", given[0], given[1],
        expected[0], expected[1])]
    WrongSize {
        /// Which camera.
        camera: usize,
        /// (width, height) of the camera.
        expected: [usize; 2],
        /// (width, height) of the image.
        given: [usize; 2],
    },
    /// A depth image has not its camera's size.
    #[error("camera {camera}: the depth image is {}x{} pixels, its camera's images are {}x{}", given[0],
        given[1], expected[0], expected[1])]
    WrongDepth {
        /// Which camera.
        camera: usize,
        /// (width, height) of the camera.
        expected: [usize; 2],
        /// (width, height) of the depth image.
        given: [usize; 2],
    },
    /// An image is black, white or of one colour where the object should be.
    #[error("camera {0}: the image says nothing where the object should be")]
    Blank(usize),
    /// An image is the one before, bit for bit.
    #[error("camera {0}: the image is the one before, once more")]
    Repeated(usize),
    /// All images are those before, but the object or the cameras moved.
    #[error("the images are those before, but what they show must have moved on since")]
    Outdated,
    /// Time did not go on.
    #[error("time goes back or stands still: {} s, then {} s", Seconds(*before), Seconds(*now))]
    Time {
        /// The time before, in seconds.
        before: f64,
        /// The time now, in seconds.
        now: f64,
    },
    /// Time jumped: motion is not predicted over the gap.
    #[error("time jumps by {} s", Seconds(*.0))]
    Jump(f64),
    /// The object leaves the image.
    #[error("camera {0}: the object is not in the image")]
    OutOfImage(usize),
    /// The images tell where the object is, but not well enough how it is turned.
    #[error("the images tell where the object is, but not how it is turned")]
    TurnOpen,
    /// A side is seen again that is known better, and what had drifted on the way is corrected.
    #[error("a known side is seen again: the turn is corrected by {degrees:.1} degrees")]
    LoopClosed {
        /// By how much, in degrees.
        degrees: f64,
    },
    /// Poses and surface points were adjusted together, and what had drifted is corrected.
    #[error("what was seen so far is adjusted: the turn is corrected by {degrees:.1} degrees")]
    Adjusted {
        /// By how much, in degrees.
        degrees: f64,
    },
    /// Part of the object is hidden.
    #[error("{hidden:.0} % of what should be seen of the object is not")]
    Hidden {
        /// Share in per cent.
        hidden: f64,
    },
}

impl Notice {
    /// Returns whether an image itself is at fault, wherever the object is.
    pub(super) fn is_of_image(&self) -> bool {
        matches!(self, Self::NoImage(_) | Self::WrongSize { .. } | Self::Blank(_))
    }
}

/// Where a step spent its time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Timing {
    /// Cutting windows out of the images and scoring their pixels.
    pub prepare: Duration,
    /// Scoring hypotheses.
    pub search: Duration,
    /// Making the best one precise.
    pub refine: Duration,
    /// Verifying it: quality, confidence, covariance, status.
    pub verify: Duration,
    /// Updating colours, surface points and keyframes by it.
    pub update: Duration,
}

/// Where the object is, and how well that is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// When, in seconds.
    pub time_s: f64,
    /// Where the object is; while it is not tracked, where it was last or is supposed.
    pub world_from_object: Pose,
    /// Covariance of a small motion (linear, angular) of the object in its own frame, in metres and
    /// radians.
    pub covariance: Matrix6<f64>,
    /// Unit motions (linear in object sizes, angular in radians), in the object's frame, which the
    /// images leave open.
    pub unobservable: Vec<Twist>,
    /// Probability that the pose is right, 0 to 1: not more than 20 mm, or a tenth of the object's
    /// diameter if that is more, and 15 degrees off.
    pub confidence: f64,
    /// What speaks for the pose, where the object is followed.
    pub evidence: Option<Evidence>,
    /// What the tracker believes.
    pub status: Status,
    /// Whether the images confirm where the object is: while they leave its turn open, it is
    /// located, but not tracked.
    pub located: bool,
    /// Number and pose, `world_from_object`, of the keyframe that the pose belongs to, if the
    /// object is followed, and of the one that the last pose belonged to if that was another one:
    /// as its keyframe is corrected later, so is the pose.
    pub keyframes: [Option<(usize, Pose)>; 2],
    /// Whether the body changed since the last estimate, as it evolved in the worker.
    pub evolved: bool,
    /// What was wrong with the observation.
    pub notices: Vec<Notice>,
    /// Hypotheses that were scored.
    pub evaluations: usize,
    /// Where the time went.
    pub timing: Timing,
}
