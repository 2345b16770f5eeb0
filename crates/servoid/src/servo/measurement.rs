//! Estimates as measurements of a motion, and their noise.

use super::MotionError;
use crate::pose::exact::Rows;

/// Parts of a filter's state: offset, speed, acceleration, and the shared error of estimates.
pub(super) const PARTS: usize = 4;

/// The uncertainty of an estimate of n coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    pub(super) fresh: Rows,
    pub(super) lasting: f64,
    pub(super) fading_s: f64,
}

impl Noise {
    /// Makes the noise of an estimate: `fresh` is the covariance, n x n by rows, of errors that are
    /// independent in each estimate; `lasting` the standard deviation, along any axis, of errors
    /// that successive estimates share. Earlier shared errors decay within `fading_s`, faster than
    /// new ones arise if the estimates have become certain.
    ///
    /// # Errors
    /// If the covariance is empty or not square.
    pub fn new(fresh: Vec<f64>, lasting: f64, fading_s: f64) -> Result<Self, MotionError> {
        let columns = fresh.len().isqrt().max(1);
        fits("the covariance of an estimate", columns * columns, fresh.len())?;
        Ok(Self { fresh: Rows { numbers: fresh, columns }, lasting, fading_s })
    }

    /// Returns the number of coordinates.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.fresh.columns
    }
}

/// A measurement of a motion: a matrix, k x 4 n, times its state, with covariance k x k.
#[derive(Debug, Clone, PartialEq)]
pub struct Measurement {
    pub(super) matrix: Rows,
    pub(super) spread: Rows,
}

impl Measurement {
    /// Returns the measurement of an estimate along axes, k x n by rows: position plus shared error.
    ///
    /// # Errors
    /// If the axes do not have n coordinates.
    pub fn along(axes: &[f64], noise: &Noise) -> Result<Self, MotionError> {
        Self::new(axes, &noise.fresh, [1.0, 0.0, 0.0, 1.0])
    }

    /// Returns a measurement of the position along axes, k x n by rows, with the covariance of n
    /// coordinates.
    ///
    /// # Errors
    /// If the covariance is not square, or the axes do not have n coordinates.
    pub fn of_place(axes: &[f64], spread: Vec<f64>) -> Result<Self, MotionError> {
        let noise = Noise::new(spread, 0.0, 1.0)?;
        Self::new(axes, &noise.fresh, [1.0, 0.0, 0.0, 0.0])
    }

    fn new(axes: &[f64], spread: &Rows, shares: [f64; PARTS]) -> Result<Self, MotionError> {
        let axes = axes_of(axes, spread.columns)?;
        let mut matrix = Rows::zeros(0, PARTS * axes.columns);
        for axis in axes.each() {
            matrix
                .numbers
                .extend(shares.iter().flat_map(|share| axis.iter().map(move |x| share * x)));
        }
        let spread = axes.times(spread).times(&axes.transposed());
        Ok(Self { matrix, spread })
    }

    /// Returns the number of coordinates of the motion.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.matrix.columns / PARTS
    }

    /// Adds the pseudo-measurement of zero speed along axes, m x n by rows, with a standard
    /// deviation.
    ///
    /// # Errors
    /// If the axes do not have n coordinates.
    pub fn and_resting(&self, axes: &[f64], speed: f64) -> Result<Self, MotionError> {
        let coordinates = self.coordinates();
        let axes = axes_of(axes, coordinates)?;
        let mut matrix = self.matrix.clone();
        for axis in axes.each() {
            let from = matrix.numbers.len() + coordinates;
            matrix.numbers.resize(matrix.numbers.len() + PARTS * coordinates, 0.0);
            matrix.numbers[from..from + coordinates].copy_from_slice(axis);
        }
        let (count, all) = (self.spread.columns, matrix.count());
        let mut spread = Rows::zeros(all, all);
        for row in 0..all {
            *spread.at_mut(row, row) = speed * speed;
        }
        for (row, values) in self.spread.each().enumerate() {
            spread.numbers[row * all..row * all + count].copy_from_slice(values);
        }
        Ok(Self { matrix, spread })
    }
}

fn axes_of(axes: &[f64], coordinates: usize) -> Result<Rows, MotionError> {
    let whole = axes.len().next_multiple_of(coordinates.max(1));
    fits("axes", whole, axes.len())?;
    Ok(Rows { numbers: axes.to_vec(), columns: coordinates })
}

/// Rejects a count of numbers that does not fit.
pub(super) fn fits(what: &'static str, wanted: usize, given: usize) -> Result<(), MotionError> {
    if wanted == given { Ok(()) } else { Err(MotionError::Size { what, wanted, given }) }
}
