use nalgebra::{UnitQuaternion, Vector3};

use super::MaskFit;
use crate::camera::View;
use crate::evolve::{ClimbSettings, climb};
use crate::fitness::Overlap;
use crate::model::{ModelError, shrunk_overlap};
use crate::pose::{Pose, Twist, left_jacobian};
use crate::shape::Quadric;
use crate::track::target::solid::Solid;

/// Scores how well a body fits downsampled masks.
pub(super) struct Fit<'a> {
    overlap: Overlap,
    quadrics: &'a [Quadric],
    /// Half the size of the body, in metres: the unit of motions.
    radius: f64,
}

/// Settings of the ascent from each orientation, and of the final one.
pub(super) const FIRST: ClimbSettings =
    ClimbSettings { steps: 40, first_step: 0.1, least_gain: 1e-4 };
pub(super) const LAST: ClimbSettings =
    ClimbSettings { steps: 60, first_step: 0.01, least_gain: 1e-6 };

impl<'a> Fit<'a> {
    /// Downsamples masks until the object spans about `extent_px` in each.
    pub(super) fn new(
        solid: &'a Solid,
        views: &[View<'_>],
        extent_px: usize,
    ) -> Result<Self, ModelError> {
        let overlap = shrunk_overlap(views, extent_px)?;
        Ok(Self { overlap, quadrics: &solid.quadrics, radius: solid.radius })
    }

    pub(super) fn scored(&self, world_from_object: Pose) -> MaskFit {
        let iou = self.overlap.score_at(&world_from_object, self.quadrics);
        MaskFit { world_from_object, iou }
    }

    /// Climbs to the best fit nearby, in position and orientation at once.
    pub(super) fn climbed(&self, start: &MaskFit, settings: &ClimbSettings) -> MaskFit {
        let expected = start.world_from_object;
        let reached = climb(&[0.0; 6], settings, |at, uphill| {
            let motion = self.motion(at);
            let (score, slope) = self.overlap.slope_at(&(expected * motion), self.quadrics);
            uphill.copy_from_slice(self.pull_back(at, &motion, &slope).as_slice());
            score
        });
        MaskFit { world_from_object: expected * self.motion(&reached.at), iou: reached.score }
    }

    /// Converts six numbers to a motion: a translation in radii, and a rotation vector in radians.
    fn motion(&self, numbers: &[f64]) -> Pose {
        let part = |first: usize| Vector3::from_fn(|i, _| numbers[first + i]);
        Pose::from_rotation(UnitQuaternion::from_scaled_axis(part(3)), part(0) * self.radius)
    }

    /// Converts a slope by small motions of the object to one by those numbers.
    fn pull_back(&self, numbers: &[f64], motion: &Pose, slope: &Twist) -> Twist {
        let half = |first: usize| slope.fixed_rows::<3>(first).into_owned();
        let linear = motion.rotation() * half(0) * self.radius;
        // The slope by the rotation vector needs the right Jacobian, transposed, which is the left
        // one.
        let angular = left_jacobian(&Vector3::from_fn(|i, _| numbers[3 + i])) * half(3);
        Twist::from_fn(|i, _| if i < 3 { linear[i] } else { angular[i - 3] })
    }
}
