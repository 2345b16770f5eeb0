//! Small linear algebra whose sums have one order, so that it has the same bits on every processor.

use nalgebra::DMatrix;

/// A matrix by rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// Its numbers, row by row.
    pub numbers: Vec<f64>,
    /// The length of a row.
    pub columns: usize,
}

impl Rows {
    /// Returns a matrix of zeros.
    #[must_use]
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { numbers: vec![0.0; rows * columns], columns }
    }

    /// Returns the number of rows.
    #[must_use]
    pub fn count(&self) -> usize {
        self.numbers.len().checked_div(self.columns).unwrap_or(0)
    }

    /// Returns the rows, one after another.
    pub fn each(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks_exact(self.columns.max(1))
    }

    /// Returns one number.
    #[must_use]
    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.numbers[row * self.columns + column]
    }

    /// Returns one number, to be changed.
    pub fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.numbers[row * self.columns + column]
    }

    /// Returns the transpose.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let numbers = (0..self.columns)
            .flat_map(|column| self.numbers.iter().skip(column).step_by(self.columns).copied())
            .collect();
        Self { numbers, columns: self.count() }
    }

    /// Multiplies it from the left with another matrix that fits; see [`product`].
    #[must_use]
    pub fn times(&self, other: &Self) -> Self {
        let numbers = product(&self.numbers, &other.numbers, self.columns, other.columns);
        Self { numbers, columns: other.columns }
    }

    /// Multiplies it with a vector.
    #[must_use]
    pub fn times_vector(&self, vector: &[f64]) -> Vec<f64> {
        self.each().map(|row| dot(row, vector)).collect()
    }

    /// Adds another matrix.
    #[must_use]
    pub fn plus(mut self, other: &Self) -> Self {
        for (sum, value) in self.numbers.iter_mut().zip(&other.numbers) {
            *sum += value;
        }
        self
    }

    /// Multiplies all numbers by a factor.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let numbers = self.numbers.iter().map(|x| x * factor).collect();
        Self { numbers, columns: self.columns }
    }

    /// Solves this matrix times x = right, for each column; `None` if it is singular or does not
    /// fit.
    #[must_use]
    pub fn solve(&self, right: &Self) -> Option<Self> {
        if !self.is_square() || self.count() != right.count() {
            return None;
        }
        self.dense().lu().solve(&right.dense()).map(|found| Self::from(&found))
    }

    /// Returns the eigenvalues of a symmetric matrix, the least first, and the eigenvectors as
    /// columns; `None` if they cannot be found, or it is not square or not finite.
    #[must_use]
    pub fn symmetric_eigen(&self) -> Option<(Vec<f64>, Self)> {
        // The search for those of other numbers would not end.
        if !self.is_square() || !is_finite(&self.numbers) {
            return None;
        }
        let found = self.dense().try_symmetric_eigen(f64::EPSILON, 0)?;
        let mut order: Vec<usize> = (0..found.eigenvalues.len()).collect();
        order.sort_by(|&i, &j| found.eigenvalues[i].total_cmp(&found.eigenvalues[j]));
        let values = order.iter().map(|&i| found.eigenvalues[i]).collect();
        Some((values, Self::from(&found.eigenvectors.select_columns(&order))))
    }

    fn is_square(&self) -> bool {
        self.columns > 0 && self.count() == self.columns
    }

    fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.count(), self.columns, &self.numbers)
    }
}

impl From<&DMatrix<f64>> for Rows {
    fn from(matrix: &DMatrix<f64>) -> Self {
        // The columns of the transpose are the rows of the matrix.
        Self { numbers: matrix.transpose().as_slice().to_vec(), columns: matrix.ncols() }
    }
}

/// Multiplies matrices by rows, whose inner index has a length: each sum is in the order of it.
/// `left` must be made of whole rows, and `right` of `inner` rows of a width; what is left over does
/// not count.
#[must_use]
pub fn product(left: &[f64], right: &[f64], inner: usize, width: usize) -> Vec<f64> {
    if inner == 0 || width == 0 {
        return Vec::new();
    }
    debug_assert!(
        left.len().is_multiple_of(inner) && right.len() == inner * width,
        "{} numbers in rows of {inner} and {} in rows of {width} have no product",
        left.len(),
        right.len(),
    );
    // The width in the type keeps the sums of a row in registers.
    match width {
        1 => sums::<1>(left, right, inner),
        3 => sums::<3>(left, right, inner),
        4 => sums::<4>(left, right, inner),
        6 => sums::<6>(left, right, inner),
        7 => sums::<7>(left, right, inner),
        12 => sums::<12>(left, right, inner),
        _ => sums_of_any_width(left, right, inner, width),
    }
}

fn sums<const WIDTH: usize>(left: &[f64], right: &[f64], inner: usize) -> Vec<f64> {
    let mut numbers = Vec::with_capacity(left.len() / inner * WIDTH);
    for factors in left.chunks_exact(inner) {
        let mut sums = [0.0; WIDTH];
        for (&factor, values) in factors.iter().zip(right.chunks_exact(WIDTH)) {
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        }
        numbers.extend(sums);
    }
    numbers
}

fn sums_of_any_width(left: &[f64], right: &[f64], inner: usize, width: usize) -> Vec<f64> {
    let mut numbers = vec![0.0; left.len() / inner * width];
    for (sums, factors) in numbers.chunks_exact_mut(width).zip(left.chunks_exact(inner)) {
        for (&factor, values) in factors.iter().zip(right.chunks_exact(width)) {
            for (sum, &value) in sums.iter_mut().zip(values) {
                *sum += factor * value;
            }
        }
    }
    numbers
}

/// Returns whether all numbers are finite.
#[must_use]
pub fn is_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| x.is_finite())
}

/// Returns whether each number is from its lower to its upper bound; NaN is not. Numbers without
/// bounds do not count.
#[must_use]
pub fn is_between(numbers: &[f64], lower: &[f64], upper: &[f64]) -> bool {
    let bounds = lower.iter().zip(upper);
    numbers.iter().zip(bounds).all(|(x, (lower, upper))| lower <= x && x <= upper)
}

/// Returns the lesser of two numbers, the second of equal ones, and NaN if one is.
#[must_use]
pub fn lesser(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

/// Returns the greater of two numbers, the second of equal ones, and NaN if one is.
#[must_use]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

/// Returns the length of a vector.
#[must_use]
pub fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// Returns the dot product of two vectors.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Returns a matrix of numbers of very different sizes, so that the order of a sum shows.
    fn matrix(seed: u64, rows: usize, columns: usize) -> Rows {
        let mut state = seed.wrapping_mul(2).wrapping_add(1);
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040);
            let unit = (state >> 11) as f64 / (1_u64 << 53) as f64;
            (2.0 * unit - 1.0) * libm::pow(10.0, (state % 7) as f64 - 3.0)
        };
        let numbers = (0..rows * columns).map(|_| draw()).collect();
        Rows { numbers, columns }
    }

    proptest! {
        #[test]
        fn products_of_any_width_have_the_bits_of_sums_in_the_order_of_the_inner_index(
            seed in any::<u64>(),
            rows in 1..5_usize,
            inner in 1..14_usize,
            width in 1..14_usize,
        ) {
            let (a, b) = (matrix(seed, rows, inner), matrix(seed ^ 7, inner, width));
            let product = a.times(&b);
            for row in 0..rows {
                for column in 0..width {
                    let sum = (0..inner).fold(0.0, |sum, k| sum + a.at(row, k) * b.at(k, column));
                    prop_assert_eq!(product.at(row, column).to_bits(), sum.to_bits());
                }
            }
            prop_assert_eq!(a.times_vector(&b.transposed().numbers[..inner]), (0..rows)
                .map(|row| product.at(row, 0)).collect::<Vec<_>>());
        }

        #[test]
        fn what_is_solved_gives_the_right_side_and_eigenvectors_the_matrix(
            seed in any::<u64>(),
            count in 1..7_usize,
        ) {
            let half = matrix(seed, count, count);
            let mut even = half.times(&half.transposed());
            for at in 0..count {
                *even.at_mut(at, at) += 1e4;
            }
            let right = matrix(seed ^ 5, count, 3);
            let solved = even.solve(&right).unwrap();
            let scale = even.numbers.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            for (one, other) in even.times(&solved).numbers.iter().zip(&right.numbers) {
                prop_assert!((one - other).abs() < 1e-9 * scale);
            }
            let (values, vectors) = even.symmetric_eigen().unwrap();
            prop_assert!(values.is_sorted());
            let along = even.times(&vectors);
            for (at, value) in along.numbers.iter().enumerate() {
                let (row, column) = (at / count, at % count);
                prop_assert!((value - values[column] * vectors.at(row, column)).abs() < 1e-9 * scale);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_singular_or_does_not_fit_solves_nothing() {
        assert!(Rows::zeros(2, 2).solve(&Rows::zeros(2, 1)).is_none());
        let one = Rows { numbers: vec![1.0], columns: 1 };
        assert!(one.solve(&Rows::zeros(2, 1)).is_none());
        for odd in [Rows::zeros(2, 3), Rows::zeros(0, 0)] {
            assert!(odd.solve(&Rows::zeros(2, 1)).is_none() && odd.symmetric_eigen().is_none());
        }
    }
}
