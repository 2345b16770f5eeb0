use nalgebra::Vector3;

use super::{Quadric, QuadricGradient};

/// A box of voxels, each with the share that a solid fills.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Centre of the first voxel.
    pub origin: Vector3<f64>,
    /// Distance between voxels along each axis.
    pub pitch: f64,
    /// Voxels along x, y and z.
    pub size: [usize; 3],
    /// Share of each voxel that is filled, 0 to 1; x varies fastest, then y.
    pub filled: Vec<f64>,
}

impl Grid {
    /// Returns an ellipsoid in units of voxels, relative to the centre of the first.
    #[must_use]
    pub fn to_voxels(&self, quadric: &Quadric) -> Quadric {
        let scale = 1.0 / self.pitch;
        Quadric { center: (quadric.center - self.origin) * scale, factor: quadric.factor * scale }
    }

    /// Converts a gradient by a quadric in voxels to one by a quadric in metres.
    #[must_use]
    pub fn from_voxels(&self, by_voxels: &QuadricGradient) -> QuadricGradient {
        let scale = 1.0 / self.pitch;
        QuadricGradient { center: by_voxels.center * scale, factor: by_voxels.factor * scale }
    }
}
