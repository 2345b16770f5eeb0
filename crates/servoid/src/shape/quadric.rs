use nalgebra::{Matrix3, Vector3};

use super::Ellipsoid;

/// An ellipsoid as used by optimisation: the centre c and any factor F of its shape matrix Σ = F
/// Fᵀ. These are twelve numbers without constraints, of which three (rotations of the unit ball)
/// have no effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadric {
    /// Centre, in metres.
    pub center: Vector3<f64>,
    /// Maps the unit ball to the ellipsoid about its centre; in metres.
    pub factor: Matrix3<f64>,
}

/// The gradient of a score by a [`Quadric`]'s numbers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct QuadricGradient {
    /// By the centre.
    pub center: Vector3<f64>,
    /// By the factor.
    pub factor: Matrix3<f64>,
}

impl QuadricGradient {
    /// Adds another gradient, scaled.
    pub(crate) fn add_scaled(&mut self, other: &Self, scale: f64) {
        self.center += other.center * scale;
        self.factor += other.factor * scale;
    }
}

impl Quadric {
    /// Returns the shape matrix Σ = F Fᵀ.
    #[must_use]
    pub fn shape_matrix(&self) -> Matrix3<f64> {
        self.factor * self.factor.transpose()
    }

    /// Returns two ellipsoids that fill the halves on both sides of the middle, across principal
    /// axis `axis` (0 to 2, the longest first).
    #[must_use]
    pub fn halves(&self, axis: usize) -> [Self; 2] {
        let solid = Ellipsoid::from_quadric(self, 0.0);
        let (mut factor, radius) = (solid.factor(), solid.factor().column(axis).into_owned());
        factor.set_column(axis, &(radius * 0.5));
        [-0.5, 0.5].map(|side| Self { center: self.center + radius * side, factor })
    }

    /// Returns |det F|, to which the volume is proportional.
    #[must_use]
    pub fn bulk(&self) -> f64 {
        self.factor.determinant().abs()
    }
}
