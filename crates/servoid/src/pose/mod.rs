//! Rigid motions: the group SE(3) with its exponential, logarithm and adjoint.

mod euler;
mod even;
pub mod exact;
mod principal;
mod se3;

pub use euler::EulerSequence;
pub use even::{even_direction, even_turn};
pub(crate) use se3::left_jacobian;
pub use se3::{Pose, Twist};

use nalgebra::Matrix4;

/// Why numbers do not make a rigid motion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseError {
    /// A number is NaN or infinite.
    #[error("a pose must be made of finite numbers, but it holds {0}")]
    NotFinite(f64),
    /// A length or an angle is too large to compute with.
    #[error(
        "a pose is made of lengths and angles of at most {most:e} metres or radians, but one is \
         {given:e}"
    )]
    TooLarge {
        /// The length or the angle.
        given: f64,
        /// The most that is accepted.
        most: f64,
    },
    /// The 3x3 block is not a rotation.
    #[error(
        "the 3x3 block of a pose must be a rotation, but its columns are off by {deviation:.3e} \
         from orthonormal (allowed: {allowed:.0e}) and its determinant is {determinant:.6}; a \
         matrix with scale, shear or a mirrored axis is not a rigid motion"
    )]
    NotRigid {
        /// Largest entry of |RᵀR − 1|.
        deviation: f64,
        /// Largest deviation that is accepted.
        allowed: f64,
        /// Determinant of the block.
        determinant: f64,
    },
    /// The last row is not (0, 0, 0, 1).
    #[error("the last row of a pose must be 0 0 0 1, but it is {0:?}")]
    LastRow([f64; 4]),
    /// The quaternion is too far from unit length to be meant as a rotation.
    #[error("a rotation quaternion must have length 1 (within 1e-3), but its length is {0:.6}")]
    NotUnit(f64),
    /// A name is not a sequence of axes.
    #[error(
        "a sequence of axes is one to three of x, y, z, none twice in a row, in lower case for \
         fixed axes and in upper case for axes that rotate with the object, such as 'xyz' or 'ZYX', \
         but it is '{0}'"
    )]
    Euler(String),
    /// Angles were requested for a sequence that does not have three axes.
    #[error("a rotation has angles about three axes, but the sequence has {0}; give three")]
    EulerCount(usize),
}

/// Largest entry of |RᵀR − 1| that is accepted as rounding of printed numbers.
const RIGID_TOLERANCE: f64 = 1e-4;

/// Rejects a vector of metres or radians, of a pose's translation, rotation or velocity, that poses
/// cannot be computed with.
///
/// # Errors
/// If a number is not finite, or the vector is longer than `Pose::MAX_LENGTH`.
pub fn check_vector(vector: &[f64]) -> Result<(), PoseError> {
    if let Some(&bad) = vector.iter().find(|x| !x.is_finite()) {
        return Err(PoseError::NotFinite(bad));
    }
    let length = vector.iter().fold(0.0, |length, &x| libm::hypot(length, x));
    let most = Pose::MAX_LENGTH;
    if length > most {
        return Err(PoseError::TooLarge { given: length, most });
    }
    Ok(())
}

fn check_rigid(matrix: &Matrix4<f64>) -> Result<(), PoseError> {
    if let Some(&bad) = matrix.iter().find(|x| !x.is_finite()) {
        return Err(PoseError::NotFinite(bad));
    }
    check_vector(&[matrix[(0, 3)], matrix[(1, 3)], matrix[(2, 3)]])?;
    let last = [matrix[(3, 0)], matrix[(3, 1)], matrix[(3, 2)], matrix[(3, 3)]];
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(PoseError::LastRow(last));
    }
    let block = matrix.fixed_view::<3, 3>(0, 0);
    let deviation = (block.transpose() * block - nalgebra::Matrix3::identity()).amax();
    let determinant = block.determinant();
    if deviation > RIGID_TOLERANCE || determinant <= 0.0 {
        return Err(PoseError::NotRigid { deviation, allowed: RIGID_TOLERANCE, determinant });
    }
    Ok(())
}
