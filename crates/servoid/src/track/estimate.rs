use std::time::Duration;

use nalgebra::Matrix6;

use super::pose::confidence::Evidence;
use crate::pose::{Pose, Twist};
use crate::words::Seconds;

/// What the tracker reports about its own pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// The images confirm the pose.
    Tracking,
    /// The images do not confirm a pose; the object is sought near its last pose, or everywhere if
    /// it was never tracked.
    Searching,
    /// The object was not found for a while; it is sought everywhere.
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

/// What was wrong with an observation, or what was noticed in it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Notice {
    /// A camera delivered no image.
    #[error("camera {0} delivered no image")]
    NoImage(usize),
    /// An image does not have its camera's size.
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
    /// A depth image does not have its camera's size.
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
    /// The depth images of a camera do not show the surface of the object.
    #[error(
        "camera {0}: the depth image does not show the object where it is, and is not used: is it of \
         another camera, or in another unit?"
    )]
    StrangeDepth(usize),
    /// An image is black, white or of a single colour where the object should be.
    #[error("camera {0}: the image shows nothing where the object should be")]
    Blank(usize),
    /// An image is identical to the previous one.
    #[error("camera {0}: the image repeats the previous one")]
    Repeated(usize),
    /// All images are identical to the previous ones, although the object or the cameras moved.
    #[error("the images repeat the previous ones, but their content must have moved since")]
    Outdated,
    /// Time did not advance.
    #[error("time goes back or stands still: {} s, then {} s", Seconds(*before), Seconds(*now))]
    Time {
        /// The previous time stamp, in seconds.
        before: f64,
        /// The current time stamp, in seconds.
        now: f64,
    },
    /// Time jumped: the motion is not predicted across the gap.
    #[error("time jumps by {} s", Seconds(*.0))]
    Jump(f64),
    /// The object is outside the image.
    #[error("camera {0}: the object is not in the image")]
    OutOfImage(usize),
    /// A mask of the start lies where the body is not at the given pose.
    #[error(
        "camera {camera}: only {inside:.0} % of the mask is where the object is at the given pose, so \
         the mask is not used; if it is the object's mask, correct the pose"
    )]
    MaskElsewhere {
        /// Which camera.
        camera: usize,
        /// Share of the mask inside the body's silhouette, in per cent.
        inside: f64,
    },
    /// The images determine the object's position, but its rotation not well enough.
    #[error("the images determine the object's position, but not its rotation")]
    TurnOpen,
    /// The rotation may have drifted too far since the first image, on sides that were not known
    /// before.
    #[error("the rotation may have drifted by {degrees:.0} degrees since the first image")]
    Drifted {
        /// Standard deviation of the drift, in degrees.
        degrees: f64,
    },
    /// A side that is known better is seen again, and the drift accumulated since is corrected.
    #[error("a known side is seen again: the rotation is corrected by {degrees:.1} degrees")]
    LoopClosed {
        /// Size of the correction, in degrees.
        degrees: f64,
    },
    /// Poses and surface points were adjusted together, which corrects accumulated drift.
    #[error("what was seen so far is adjusted: the rotation is corrected by {degrees:.1} degrees")]
    Adjusted {
        /// Size of the correction, in degrees.
        degrees: f64,
    },
    /// What was marked as the object is more than one thing.
    #[error(
        "points that were marked as the object move otherwise than the rest: the mask holds more than \
         one thing, and which of them is meant is not known; or the cameras are out of step, or their \
         calibration is wrong; mark the object alone, or check these"
    )]
    Parted,
    /// What is found elsewhere was already there while the object was seen: it is another one.
    #[error(
        "something that looks like the object was already there while the object was seen elsewhere: \
         it is another one; to track it, start anew with it"
    )]
    LookAlike,
    /// Another tracked object is where this one was found.
    #[error("what was found is another tracked object, so that it is not this one")]
    Taken,
    /// Part of the object is hidden.
    #[error("{hidden:.0} % of the part of the object that should be visible is not seen")]
    Hidden {
        /// Hidden share in per cent.
        hidden: f64,
    },
}

impl Notice {
    /// Returns whether the image itself is at fault, regardless of where the object is.
    pub(super) fn is_of_image(&self) -> bool {
        matches!(self, Self::NoImage(_) | Self::WrongSize { .. } | Self::Blank(_))
    }
}

/// Time spent in each stage of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Timing {
    /// Extracting windows from the images and scoring their pixels.
    pub prepare: Duration,
    /// Scoring hypotheses.
    pub search: Duration,
    /// Refining the best one.
    pub refine: Duration,
    /// Verifying it: quality, confidence, covariance, status.
    pub verify: Duration,
    /// Updating colours, surface points and keyframes.
    pub update: Duration,
}

/// The pose of the object, with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Time stamp in seconds.
    pub time_s: f64,
    /// Pose of the object; while it is not tracked, the last pose or the best guess.
    pub world_from_object: Pose,
    /// Covariance of a small motion (linear, angular) of the object in its own frame, in metres and
    /// radians.
    pub covariance: Matrix6<f64>,
    /// Unit motions (linear in object sizes, angular in radians), in the object's frame, that the
    /// images do not constrain.
    pub unobservable: Vec<Twist>,
    /// Probability that the pose is right, 0 to 1. A pose is right if it is not off by more than 20
    /// mm, or a tenth of the object's diameter if that is more, and 15 degrees.
    pub confidence: f64,
    /// The evidence for the pose, if the object is followed.
    pub evidence: Option<Evidence>,
    /// Status of the tracker.
    pub status: Status,
    /// Whether the images confirm the object's position. While they do not constrain its
    /// orientation, the object is located, but not tracked.
    pub located: bool,
    /// Number and pose, `world_from_object`, of the keyframe to which this pose belongs, if the
    /// object is followed, and of the keyframe of the previous pose if that was another one. A
    /// later correction of a keyframe applies to its poses as well.
    pub keyframes: [Option<(usize, Pose)>; 2],
    /// Whether the body changed since the last estimate because it evolved in the worker.
    pub evolved: bool,
    /// What was wrong with the observation.
    pub notices: Vec<Notice>,
    /// Number of hypotheses scored.
    pub evaluations: usize,
    /// Time spent in each stage.
    pub timing: Timing,
}

impl Estimate {
    /// Returns the same estimate for a start in doubt: nothing confirms its pose; `located` says
    /// whether its position is confirmed. What is lost stays lost.
    #[must_use]
    pub fn in_doubt(self, located: bool) -> Self {
        let is_lost = self.status == Status::Lost;
        let status = if is_lost { Status::Lost } else { Status::Searching };
        Self { status, located: located && !is_lost, confidence: 0.0, ..self }
    }
}
