use super::ArmError;
use crate::pose::exact::Rows;

/// The Jacobian of a hand, 6 x n: its velocity, linear and angular in the world, by joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Jacobian(pub(super) Rows);

impl Jacobian {
    /// Takes the numbers by rows, n in each of 6 rows.
    ///
    /// # Errors
    /// If there are not 6 rows of a number at least.
    pub fn new(matrix: Rows) -> Result<Self, ArmError> {
        if matrix.columns == 0 || matrix.numbers.len() != 6 * matrix.columns {
            return Err(ArmError::Rows(matrix.count()));
        }
        Ok(Self(matrix))
    }

    /// Returns the number of joints.
    #[must_use]
    pub fn count(&self) -> usize {
        self.0.columns
    }

    /// Returns the matrix.
    #[must_use]
    pub fn rows(&self) -> &Rows {
        &self.0
    }

    /// Returns three rows: 0 for those of the linear velocity, 1 for those of the angular.
    pub(super) fn part(&self, part: usize) -> Rows {
        let size = 3 * self.count();
        let numbers = self.0.numbers[part * size..(part + 1) * size].to_vec();
        Rows { numbers, columns: self.count() }
    }

    /// Returns the matrix, the rows of the hand's angular velocity multiplied by a length.
    pub(super) fn weighted(&self, angular_weight: f64) -> Rows {
        let mut weighted = self.0.clone();
        for (row, values) in weighted.numbers.chunks_exact_mut(self.0.columns).enumerate() {
            let weight = weight(row, angular_weight);
            for value in values {
                *value *= weight;
            }
        }
        weighted
    }
}

/// Returns a twist, its angular part multiplied by a length.
pub(super) fn weighted(twist: &[f64; 6], angular_weight: f64) -> [f64; 6] {
    std::array::from_fn(|row| weight(row, angular_weight) * twist[row])
}

const fn weight(row: usize, angular: f64) -> f64 {
    if row < 3 { 1.0 } else { angular }
}
