use nalgebra::Vector3;

use super::{Quadric, QuadricGradient};

/// A box of voxels, each with the share of it that a solid fills.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Centre of the first voxel.
    pub origin: Vector3<f64>,
    /// From one voxel to the next along each axis.
    pub pitch: f64,
    /// Voxels along x, y and z.
    pub size: [usize; 3],
    /// Share of each voxel that is filled, 0 to 1; x runs fastest, then y.
    pub filled: Vec<f64>,
}

impl Grid {
    /// Returns an ellipsoid in units of voxels, counted from the centre of the first.
    #[must_use]
    pub fn to_voxels(&self, quadric: &Quadric) -> Quadric {
        let scale = 1.0 / self.pitch;
        Quadric { center: (quadric.center - self.origin) * scale, factor: quadric.factor * scale }
    }

    /// Carries slopes by a quadric in voxels back.
    #[must_use]
    pub fn from_voxels(&self, by_voxels: &QuadricGradient) -> QuadricGradient {
        let scale = 1.0 / self.pitch;
        QuadricGradient { center: by_voxels.center * scale, factor: by_voxels.factor * scale }
    }
}
