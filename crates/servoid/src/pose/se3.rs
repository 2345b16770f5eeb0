use nalgebra::{
    Isometry3, Matrix3, Matrix4, Matrix6, Point3, Quaternion, Rotation3, Translation3,
    UnitQuaternion, Vector3, Vector6,
};

use super::{PoseError, check_rigid, check_vector};

/// A velocity or a small motion: (linear, angular), in metres and radians.
pub type Twist = Vector6<f64>;

/// A rigid motion: an element of SE(3).
///
/// `a_from_b` maps coordinates in `b` to coordinates in `a`; it is also the pose of `b` in `a`.
/// The product composes, so that inner names cancel: `a_from_c = a_from_b * b_from_c`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose(Isometry3<f64>);

impl Pose {
    /// Longest translation in metres, and rotation vector in radians, that poses are made of: up to
    /// it all that is computed with one or two of them is finite.
    pub const MAX_LENGTH: f64 = 1e100;

    /// Returns the identity.
    #[must_use]
    pub fn identity() -> Self {
        Self(Isometry3::identity())
    }

    /// Reads a 4x4 homogeneous matrix.
    ///
    /// # Errors
    /// If a number is not finite or too large, the 3x3 block is not a rotation or the last row is not 0 0 0 1.
    pub fn from_matrix(matrix: &Matrix4<f64>) -> Result<Self, PoseError> {
        check_rigid(matrix)?;
        let block: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into();
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(block));
        let rotation = UnitQuaternion::new_normalize(rotation.into_inner());
        Ok(Self::from_rotation(rotation, matrix.fixed_view::<3, 1>(0, 3).into()))
    }

    /// Makes a pose of a translation in metres and a quaternion (w, x, y, z).
    ///
    /// # Errors
    /// If a number is not finite or too large, or the quaternion is not of unit length.
    pub fn from_parts(translation: [f64; 3], quaternion: [f64; 4]) -> Result<Self, PoseError> {
        if let Some(&bad) = translation.iter().chain(&quaternion).find(|x| !x.is_finite()) {
            return Err(PoseError::NotFinite(bad));
        }
        check_vector(&translation)?;
        let [w, x, y, z] = quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        if (quaternion.norm() - 1.0).abs() > 1e-3 {
            return Err(PoseError::NotUnit(quaternion.norm()));
        }
        Ok(Self::from_rotation(UnitQuaternion::new_normalize(quaternion), translation.into()))
    }

    /// Makes a pose of a rotation and a translation.
    #[must_use]
    pub fn from_rotation(rotation: UnitQuaternion<f64>, translation: Vector3<f64>) -> Self {
        Self(Isometry3::from_parts(Translation3::from(translation), rotation))
    }

    /// Integrates a constant twist over unit time: the exponential of se(3).
    ///
    /// Source: Murray, Li, Sastry, *A Mathematical Introduction to Robotic Manipulation* (1994),
    /// Sec. 2.3.
    #[must_use]
    pub fn exp(twist: &Twist) -> Self {
        let (linear, angular) = halves(twist);
        let translation = left_jacobian(&angular) * linear;
        Self::from_rotation(UnitQuaternion::from_scaled_axis(angular), translation)
    }

    /// Returns the twist whose exponential is this motion; its angle is at most π.
    #[must_use]
    pub fn log(&self) -> Twist {
        let angular = self.rotation().scaled_axis();
        let linear = inverse_left_jacobian(&angular) * self.translation();
        Twist::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    }

    /// Returns the 6x6 adjoint matrix, which transforms twists: `exp(Ad ξ) = T exp(ξ) T⁻¹`.
    #[must_use]
    pub fn adjoint(&self) -> Matrix6<f64> {
        let rotation = self.rotation().to_rotation_matrix().into_inner();
        let mut out = Matrix6::zeros();
        out.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
        out.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
        let corner = self.translation().cross_matrix() * rotation;
        out.fixed_view_mut::<3, 3>(0, 3).copy_from(&corner);
        out
    }

    /// Returns the inverse motion.
    #[must_use]
    pub fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// Returns the pose with its quaternion normalised: rounding errors of its length accumulate in
    /// products of many poses.
    #[must_use]
    pub(crate) fn renormalized(&self) -> Self {
        let rotation = UnitQuaternion::new_normalize(self.rotation().into_inner());
        Self::from_rotation(rotation, self.translation())
    }

    /// Returns the rotation.
    #[must_use]
    pub fn rotation(&self) -> UnitQuaternion<f64> {
        self.0.rotation
    }

    /// Returns the rotation as a 3x3 matrix.
    #[must_use]
    pub fn rotation_matrix(&self) -> Matrix3<f64> {
        self.0.rotation.to_rotation_matrix().into_inner()
    }

    /// Returns the translation in metres.
    #[must_use]
    pub fn translation(&self) -> Vector3<f64> {
        self.0.translation.vector
    }

    /// Returns the distance between the positions of two poses, in metres.
    pub(crate) fn apart(&self, other: &Self) -> f64 {
        (self.translation() - other.translation()).norm()
    }

    /// Returns the quaternion (w, x, y, z) with w >= 0.
    #[must_use]
    pub fn quaternion(&self) -> [f64; 4] {
        let q = self.0.rotation.quaternion();
        let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
        [q.w, q.i, q.j, q.k].map(|x| sign * x)
    }

    /// Returns the 4x4 homogeneous matrix.
    #[must_use]
    pub fn matrix(&self) -> Matrix4<f64> {
        self.0.to_homogeneous()
    }

    /// Transforms a point.
    #[must_use]
    pub fn transform(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.0.transform_point(&Point3::from(*point)).coords
    }
}

impl std::ops::Mul for Pose {
    type Output = Self;

    fn mul(self, right: Self) -> Self {
        Self(self.0 * right.0)
    }
}

fn halves(twist: &Twist) -> (Vector3<f64>, Vector3<f64>) {
    (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into())
}

/// Below this angle (radians) the Taylor series is more accurate than the closed form.
const SMALL_ANGLE: f64 = 1e-4;

/// Returns the derivative of a rotation, as a rotation vector in the fixed frame, by its scaled
/// axis.
pub(crate) fn left_jacobian(angular: &Vector3<f64>) -> Matrix3<f64> {
    let angle = angular.norm();
    let cross = angular.cross_matrix();
    let (first, second) = if angle < SMALL_ANGLE {
        (0.5 - angle * angle / 24.0, 1.0 / 6.0 - angle * angle / 120.0)
    } else {
        ((1.0 - libm::cos(angle)) / angle.powi(2), (angle - libm::sin(angle)) / angle.powi(3))
    };
    Matrix3::identity() + cross * first + cross * cross * second
}

fn inverse_left_jacobian(angular: &Vector3<f64>) -> Matrix3<f64> {
    let angle = angular.norm();
    let cross = angular.cross_matrix();
    let second = if angle < SMALL_ANGLE {
        1.0 / 12.0 + angle * angle / 720.0
    } else {
        let half = 0.5 * angle;
        (1.0 - half * libm::cos(half) / libm::sin(half)) / angle.powi(2)
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * second
}
