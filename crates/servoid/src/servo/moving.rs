//! Time-dependent rigid motions with their first and second derivatives.

use nalgebra::Matrix4;

use crate::pose::exact::Rows;
use crate::pose::{Pose, PoseError, Twist, check_vector};

/// Returns a pose `a_from_b` translated by the first half of a change and rotated about b's origin
/// by the second, in `a`.
///
/// # Errors
/// If the change, or the new position, is not finite or too large.
pub fn shifted_and_turned(pose: &Pose, change: &[f64; 6]) -> Result<Pose, PoseError> {
    let [x, y, z, a, b, c] = *change;
    check_vector(&[a, b, c])?;
    let turned = Pose::exp(&Twist::new(0.0, 0.0, 0.0, a, b, c)) * *pose;
    let place = pose.translation();
    Pose::from_parts([place.x + x, place.y + y, place.z + z], turned.quaternion())
}

/// Returns translation and rotation, in `a`, from one pose `a_from_b` to another.
///
/// # Errors
/// If the poses are too far from each other.
pub fn change_between(before: &Pose, after: &Pose) -> Result<[f64; 6], PoseError> {
    let motion = *after * before.inverse();
    check_vector(motion.translation().as_slice())?;
    let mut change: [f64; 6] = motion.log().into();
    let (from, to) = (before.translation(), after.translation());
    for (value, (from, to)) in change.iter_mut().zip(from.iter().zip(&to)) {
        *value = to - from;
    }
    Ok(change)
}

/// Returns the 3x3 matrix of the cross product with a vector.
fn cross_matrix([x, y, z]: [f64; 3]) -> Rows {
    Rows { numbers: vec![0.0, -z, y, z, 0.0, -x, -y, x, 0.0], columns: 3 }
}

/// A rigid motion `a_from_b` with its derivatives, 4x4 each.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    matrix: Rows,
    first: Rows,
    second: Rows,
}

impl Moving {
    /// Returns a constant motion.
    #[must_use]
    pub fn at_rest(pose: &Pose) -> Self {
        Self { matrix: rows_of(pose), first: Rows::zeros(4, 4), second: Rows::zeros(4, 4) }
    }

    /// Returns `a_from_b` with the velocity of b's origin and the angular velocity of b, in `a`, in
    /// m/s and rad/s, and their derivatives if they are not constant.
    #[must_use]
    pub fn from_twist(pose: &Pose, twist: &[f64; 6], acceleration: Option<&[f64; 6]>) -> Self {
        let matrix = rows_of(pose);
        let turn = rotation(&matrix);
        let turning = cross_matrix([twist[3], twist[4], twist[5]]);
        let turned = turning.times(&turn);
        let (mut bent, mut sped) = (turning.times(&turned), [0.0; 3]);
        if let Some(&[x, y, z, a, b, c]) = acceleration {
            bent = bent.plus(&cross_matrix([a, b, c]).times(&turn));
            sped = [x, y, z];
        }
        let first = joined(&turned, [twist[0], twist[1], twist[2]]);
        Self { matrix, first, second: joined(&bent, sped) }
    }

    /// Returns the present pose as a matrix.
    #[must_use]
    pub fn matrix(&self) -> &Rows {
        &self.matrix
    }

    /// Returns the first derivative of the matrix by time, in 1/s.
    #[must_use]
    pub fn first(&self) -> &Rows {
        &self.first
    }

    /// Returns the second derivative of the matrix by time, in 1/s².
    #[must_use]
    pub fn second(&self) -> &Rows {
        &self.second
    }

    /// Returns the present pose.
    ///
    /// # Errors
    /// If the matrix is no rigid motion, as its numbers have become too large.
    pub fn pose(&self) -> Result<Pose, PoseError> {
        Pose::from_matrix(&matrix_of(&self.matrix))
    }

    /// Returns the velocity of b's origin in m/s and of b's rotation in rad/s, in `a`.
    #[must_use]
    pub fn twist(&self) -> [f64; 6] {
        let turning = rotation(&self.first).times(&rotation(&self.matrix).transposed());
        let [x, y, z] = place(&self.first);
        [x, y, z, turning.at(2, 1), turning.at(0, 2), turning.at(1, 0)]
    }

    /// Returns `b_from_a`.
    ///
    /// # Errors
    /// If the matrix is no rigid motion, as its numbers have become too large.
    pub fn inverse(&self) -> Result<Self, PoseError> {
        let matrix = rows_of(&self.pose()?.inverse());
        let first = matrix.times(&self.first).times(&matrix).scaled(-1.0);
        let second = matrix.times(&self.second).times(&matrix);
        let both = first.times(&self.first).times(&matrix);
        Ok(Self { second: second.scaled(-1.0).plus(&both.scaled(-2.0)), matrix, first })
    }
}

impl std::ops::Mul for &Moving {
    type Output = Moving;

    /// Composes `a_from_b` with `b_from_c`, by the product rule.
    fn mul(self, other: &Moving) -> Moving {
        let second = self
            .second
            .times(&other.matrix)
            .plus(&self.first.times(&other.first).scaled(2.0))
            .plus(&self.matrix.times(&other.second));
        Moving {
            matrix: self.matrix.times(&other.matrix),
            first: self.first.times(&other.matrix).plus(&self.matrix.times(&other.first)),
            second,
        }
    }
}

/// Returns the matrix of a pose by rows.
pub(super) fn rows_of(pose: &Pose) -> Rows {
    Rows { numbers: pose.matrix().transpose().as_slice().to_vec(), columns: 4 }
}

/// Returns a 4x4 matrix of rows.
pub(super) fn matrix_of(rows: &Rows) -> Matrix4<f64> {
    Matrix4::from_row_slice(&rows.numbers)
}

/// Returns the upper left 3x3 block.
pub(super) fn rotation(matrix: &Rows) -> Rows {
    let numbers = matrix.each().take(3).flat_map(|row| row[..3].to_vec()).collect();
    Rows { numbers, columns: 3 }
}

/// Returns the first three numbers of the last column.
pub(super) fn place(matrix: &Rows) -> [f64; 3] {
    [matrix.at(0, 3), matrix.at(1, 3), matrix.at(2, 3)]
}

/// Joins a 3x3 block and a column to a 4x4 matrix, whose last row is 0.
fn joined(block: &Rows, column: [f64; 3]) -> Rows {
    let mut out = Rows::zeros(4, 4);
    for (row, (values, last)) in out.numbers.chunks_exact_mut(4).zip(block.each().zip(column)) {
        row[..3].copy_from_slice(values);
        row[3] = last;
    }
    out
}
