use nalgebra::Vector3;

use super::record::Record;
use crate::fitness::SurfacePoint;
use crate::pose::Pose;

/// A surface point with how well its distance is known and how it has done.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    /// Counts the points that were ever known: those with a greater one were learned later.
    pub(crate) id: usize,
    pub(crate) point: SurfacePoint,
    pub(crate) learned: Learned,
    /// Variance of its place along `toward`, in square metres.
    pub(crate) variance: f64,
    /// Variance of the object's turn since the first image where it was learned, in square radians: what it
    /// tells is only as true.
    pub(crate) drift: f64,
    /// How far the object had turned since then when it was recognised among many others, in radians: it does
    /// not slip that far.
    pub(super) proved: f64,
    pub(super) record: Record,
}

impl Known {
    pub(crate) fn new(point: SurfacePoint, variance: f64) -> Self {
        let (position, toward) = (point.position, point.toward);
        let learned = Learned { keyframe: None, position, toward, variance };
        Self { id: 0, point, learned, variance, drift: 0.0, proved: 0.0, record: Record::new() }
    }

    /// Notes with which keyframe the point was learned, which stood at a pose; and how well the turn was known.
    pub(crate) fn learn_with(&mut self, (keyframe, pose): (usize, &Pose), drift: f64) {
        self.learned.keyframe = Some(keyframe);
        self.learned.position = pose.transform(&self.point.position);
        self.learned.toward = pose.rotation() * self.point.toward;
        self.drift = drift;
    }

    pub(crate) fn quality(&self) -> f32 {
        self.record.quality()
    }
}

/// Where a point was found when it was learned, in the world's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Learned {
    /// The keyframe that its view belonged to: the point moves with it. None for a point that was given.
    pub(crate) keyframe: Option<usize>,
    pub(crate) position: Vector3<f64>,
    pub(crate) toward: Vector3<f64>,
    /// Of the place along `toward`, in square metres.
    pub(crate) variance: f64,
}

impl Learned {
    /// Has a point move with another keyframe if its own one is no more; `moved` leads from where the object
    /// stood then to where it stood now.
    pub(crate) fn adopt(&mut self, dropped: usize, (heir, moved): (usize, &Pose)) {
        if self.keyframe == Some(dropped) {
            self.keyframe = Some(heir);
            self.position = moved.transform(&self.position);
            self.toward = moved.rotation() * self.toward;
        }
    }
}
