use nalgebra::{Matrix3, Vector3};

use crate::evolve::{ClimbSettings, climb};
use crate::fitness::Differentiable;
use crate::shape::{Quadric, QuadricGradient};

/// Numbers that an ellipsoid has while it is refined.
const NUMBERS: usize = 12;

/// Ellipsoids and what they are worth together.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Fit {
    pub quadrics: Vec<Quadric>,
    pub fitness: f64,
}

impl Fit {
    /// Hides a small ellipsoid inside the largest: one more that changes nothing.
    pub fn echo(&self) -> Self {
        let mut out = self.clone();
        let largest = self.quadrics.iter().max_by(|a, b| a.bulk().total_cmp(&b.bulk()));
        if let Some(largest) = largest {
            out.quadrics.push(Quadric { center: largest.center, factor: largest.factor * 0.5 });
        }
        out
    }

    /// Gives the ellipsoids without one of them.
    pub fn without(&self, gone: usize) -> Vec<Quadric> {
        let mut rest = self.quadrics.clone();
        rest.remove(gone);
        rest
    }
}

/// Moves and shapes all ellipsoids together, uphill.
pub(super) fn refine(fitness: &impl Differentiable, start: &[Quadric], steps: usize) -> Fit {
    let settings = ClimbSettings { steps, first_step: 0.02, least_gain: 2e-6 };
    let mut slopes = vec![QuadricGradient::default(); start.len()];
    let found = climb(&pack(start), &settings, |at, uphill| {
        let score = fitness.score_and_gradient(&unpack(at), &mut slopes);
        for (numbers, slope) in uphill.chunks_exact_mut(NUMBERS).zip(&slopes) {
            write(numbers, &slope.center, &slope.factor);
        }
        score
    });
    Fit { quadrics: unpack(&found.at), fitness: found.score }
}

fn write(numbers: &mut [f64], center: &Vector3<f64>, factor: &Matrix3<f64>) {
    numbers[..3].copy_from_slice(center.as_slice());
    numbers[3..].copy_from_slice(factor.as_slice());
}

fn pack(quadrics: &[Quadric]) -> Vec<f64> {
    let mut out = vec![0.0; quadrics.len() * NUMBERS];
    for (numbers, quadric) in out.chunks_exact_mut(NUMBERS).zip(quadrics) {
        write(numbers, &quadric.center, &quadric.factor);
    }
    out
}

fn unpack(numbers: &[f64]) -> Vec<Quadric> {
    let read = |numbers: &[f64]| Quadric {
        center: Vector3::from_column_slice(&numbers[..3]),
        factor: Matrix3::from_column_slice(&numbers[3..]),
    };
    numbers.chunks_exact(NUMBERS).map(read).collect()
}
