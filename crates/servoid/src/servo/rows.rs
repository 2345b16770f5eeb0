//! Small matrices by rows, whose sums have one order on every processor.

use nalgebra::DMatrix;

/// A matrix by rows.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rows {
    pub numbers: Vec<f64>,
    pub columns: usize,
}

impl Rows {
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { numbers: vec![0.0; rows * columns], columns }
    }

    pub fn count(&self) -> usize {
        self.numbers.len().checked_div(self.columns).unwrap_or(0)
    }

    pub fn each(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks_exact(self.columns.max(1))
    }

    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.numbers[row * self.columns + column]
    }

    pub fn at_mut(&mut self, row: usize, column: usize) -> &mut f64 {
        &mut self.numbers[row * self.columns + column]
    }

    pub fn transposed(&self) -> Self {
        let numbers = (0..self.columns)
            .flat_map(|column| self.numbers.iter().skip(column).step_by(self.columns).copied())
            .collect();
        Self { numbers, columns: self.count() }
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut out = Self::zeros(self.count(), other.columns);
        let sums = out.numbers.chunks_exact_mut(other.columns.max(1));
        for (sums, factors) in sums.zip(self.each()) {
            for (&factor, values) in factors.iter().zip(other.each()) {
                for (sum, &value) in sums.iter_mut().zip(values) {
                    *sum += factor * value;
                }
            }
        }
        out
    }

    pub fn times_vector(&self, vector: &[f64]) -> Vec<f64> {
        self.each().map(|row| dot(row, vector)).collect()
    }

    pub fn plus(mut self, other: &Self) -> Self {
        for (sum, value) in self.numbers.iter_mut().zip(&other.numbers) {
            *sum += value;
        }
        self
    }

    pub fn scaled(&self, factor: f64) -> Self {
        let numbers = self.numbers.iter().map(|x| x * factor).collect();
        Self { numbers, columns: self.columns }
    }

    pub fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.count(), self.columns, &self.numbers)
    }
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |sum, (x, y)| sum + x * y)
}
