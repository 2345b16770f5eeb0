use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

use super::{Quadric, ShapeError};
use crate::pose::Pose;

/// An ellipsoid: the points `center + R diag(radii) x` with |x| <= 1.
///
/// Projections and comparisons use its shape matrix Σ = R diag(radii²) Rᵀ; with the centre c it is
/// the dual quadric of the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipsoid {
    center: Vector3<f64>,
    radii: Vector3<f64>,
    rotation: UnitQuaternion<f64>,
}

impl Ellipsoid {
    /// Smallest radius in metres: moments of inertia hold its fifth power.
    pub const MIN_RADIUS: f64 = 1e-50;
    /// Largest radius and coordinate of a centre in metres.
    pub const MAX_LENGTH: f64 = 1e50;

    /// Makes an ellipsoid of centre and radii in metres and an orientation (w, x, y, z). Errors
    /// refer to it by `index`.
    ///
    /// # Errors
    /// If a number is not finite or too large, a radius is not positive or too small, or the
    /// quaternion is not of unit length.
    pub fn new(
        index: usize,
        center: [f64; 3],
        radii: [f64; 3],
        rotation: [f64; 4],
    ) -> Result<Self, ShapeError> {
        for (what, values) in [("center", &center), ("radii", &radii)] {
            if let Some(&value) = values.iter().find(|x| !x.is_finite()) {
                return Err(ShapeError::NotFinite { index, what, value });
            }
        }
        if !radii.iter().all(|&r| r > 0.0) {
            return Err(ShapeError::Radii { index, radii });
        }
        let (least, most) = (Self::MIN_RADIUS, Self::MAX_LENGTH);
        if let Some(&value) = radii.iter().find(|&&r| !(least..=most).contains(&r)) {
            return Err(ShapeError::Size { index, what: "radii", value, least, most });
        }
        if let Some(&value) = center.iter().find(|x| x.abs() > most) {
            return Err(ShapeError::Size { index, what: "center", value, least, most });
        }
        let rotation = Pose::from_parts([0.0; 3], rotation)
            .map_err(|source| ShapeError::Rotation { index, source })?
            .rotation();
        Ok(Self { center: center.into(), radii: radii.into(), rotation })
    }

    /// Returns the ellipsoid with another orientation, which is stored to the last bit.
    #[must_use]
    pub fn turned_to(self, rotation: UnitQuaternion<f64>) -> Self {
        Self { rotation, ..self }
    }

    /// Makes the ellipsoid of a quadric, with decreasing radii. Radii below `least` are raised to
    /// it, so that a flat quadric still makes a solid.
    #[must_use]
    pub fn from_quadric(quadric: &Quadric, least: f64) -> Self {
        let eigen = SymmetricEigen::new(quadric.shape_matrix());
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let radii = Vector3::from_fn(|i, _| eigen.eigenvalues[order[i]].max(0.0).sqrt().max(least));
        let axis = |i: usize| upright(eigen.eigenvectors.column(order[i]).into());
        let (first, second) = (axis(0), axis(1));
        let axes = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Self { center: quadric.center, radii, rotation }
    }

    /// Returns the ellipsoid as a quadric, as used by optimisation.
    #[must_use]
    pub fn quadric(&self) -> Quadric {
        Quadric { center: self.center, factor: self.factor() }
    }

    /// Returns the centre in metres.
    #[must_use]
    pub fn center(&self) -> Vector3<f64> {
        self.center
    }

    /// Returns the three radii in metres.
    #[must_use]
    pub fn radii(&self) -> Vector3<f64> {
        self.radii
    }

    /// Returns the orientation.
    #[must_use]
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.rotation
    }

    /// Returns the orientation as a quaternion (w, x, y, z) with w >= 0.
    #[must_use]
    pub fn quaternion(&self) -> [f64; 4] {
        Pose::from_rotation(self.rotation, Vector3::zeros()).quaternion()
    }

    /// Returns F = R diag(radii): it maps the unit ball to the ellipsoid about its centre.
    #[must_use]
    pub fn factor(&self) -> Matrix3<f64> {
        self.rotation.to_rotation_matrix().into_inner() * Matrix3::from_diagonal(&self.radii)
    }

    /// Returns the shape matrix Σ = F Fᵀ in square metres.
    #[must_use]
    pub fn shape_matrix(&self) -> Matrix3<f64> {
        let factor = self.factor();
        factor * factor.transpose()
    }

    /// Returns the volume in cubic metres.
    #[must_use]
    pub fn volume(&self) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * self.radii.product()
    }

    /// Returns whether a point is inside.
    #[must_use]
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        let local = self.rotation.inverse_transform_vector(&(point - self.center));
        local.component_div(&self.radii).norm_squared() < 1.0
    }

    /// Returns whether the straight line between two points passes through the inside.
    #[must_use]
    pub fn intersects(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        let local = |point: &Vector3<f64>| {
            self.rotation
                .inverse_transform_vector(&(point - self.center))
                .component_div(&self.radii)
        };
        let (begin, end) = (local(from), local(to));
        let way = end - begin;
        let nearest = (-begin.dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
        (begin + way * nearest).norm_squared() < 1.0
    }

    /// Scales about the origin, then transforms by a pose.
    #[must_use]
    pub fn transformed(&self, pose: &Pose, scale: f64) -> Self {
        Self {
            center: pose.transform(&(self.center * scale)),
            radii: self.radii * scale,
            rotation: pose.rotation() * self.rotation,
        }
    }
}

/// Of an axis and its opposite, which are the same axis, returns the one whose largest entry is
/// positive.
fn upright(axis: Vector3<f64>) -> Vector3<f64> {
    if axis[axis.iamax()] < 0.0 { -axis } else { axis }
}
