use nalgebra::{Matrix3, Vector3};

use crate::evolve::{ClimbSettings, climb};
use crate::fitness::{Differentiable, Extent, Fitness, Total, anisotropy, anisotropy_gradient};
use crate::shape::{Quadric, QuadricGradient};

/// Numbers that describe an ellipsoid while it is refined.
const NUMBERS: usize = 12;

/// The objective on one level: the evidence, less the cost of the ellipsoids in F.
#[derive(Default)]
pub(in crate::model) struct Objective {
    pub total: Total,
    /// Cost of a unit of anisotropy.
    pub anisotropy_cost: f64,
    /// Extent of the measured points, if ellipsoids far from it have a cost as well.
    pub extent: Option<Extent>,
    /// Least gain for which an ascent continues.
    pub least_gain: f64,
}

/// Cost in F of a centre twice as far from the middle of the measured points as they reach.
const EXTENT_COST: f64 = 0.03;

impl Objective {
    /// Returns the cost of an ellipsoid.
    fn cost(&self, quadric: &Quadric) -> f64 {
        let beyond = self.extent.map_or(0.0, |extent| extent.beyond(quadric).0);
        self.anisotropy_cost * anisotropy(quadric) + EXTENT_COST * beyond
    }

    /// Returns the gradient of the cost; `None` for an ellipsoid without volume.
    fn cost_gradient(&self, quadric: &Quadric) -> Option<QuadricGradient> {
        let beyond = self.extent.map_or_else(Vector3::zeros, |extent| extent.beyond(quadric).1);
        let factor = anisotropy_gradient(quadric)?.factor * self.anisotropy_cost;
        Some(QuadricGradient { center: beyond * EXTENT_COST, factor })
    }
}

/// Ellipsoids and their joint fitness.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::model) struct Fit {
    pub quadrics: Vec<Quadric>,
    /// F: the agreement with all evidence.
    pub fitness: f64,
    /// F less the cost of the ellipsoids, by which fits are compared.
    pub worth: f64,
}

impl Fit {
    /// Adds a small ellipsoid hidden inside the largest, which changes nothing.
    pub fn echo(&self, objective: &Objective) -> Self {
        let mut out = self.clone();
        let largest = self.quadrics.iter().max_by(|a, b| a.bulk().total_cmp(&b.bulk()));
        if let Some(largest) = largest {
            let small = Quadric { center: largest.center, factor: largest.factor * 0.5 };
            out.worth -= objective.cost(&small);
            out.quadrics.push(small);
        }
        out
    }

    /// Joins two bodies; their joint fitness is not computed.
    pub fn join(&self, other: &Self) -> Self {
        let quadrics = [self.quadrics.as_slice(), &other.quadrics].concat();
        Self { quadrics, ..Self::default() }
    }

    /// Returns the ellipsoids without some of them.
    pub fn without(&self, gone: &[usize]) -> Vec<Quadric> {
        let stays =
            |(index, quadric): (usize, &Quadric)| (!gone.contains(&index)).then_some(*quadric);
        self.quadrics.iter().enumerate().filter_map(stays).collect()
    }
}

/// Refines all ellipsoids together by gradient ascent.
pub(in crate::model) fn refine(objective: &Objective, start: &[Quadric], steps: usize) -> Fit {
    let (quadrics, worth) = climb_by(&objective.total, objective, start, steps);
    Fit { fitness: objective.total.score(&quadrics), worth, quadrics }
}

/// Does the same by the heaviest kind of evidence alone.
pub(in crate::model) fn refine_by_lead(
    objective: &Objective,
    start: &[Quadric],
    steps: usize,
) -> Vec<Quadric> {
    objective
        .total
        .lead()
        .map_or_else(|| start.to_vec(), |lead| climb_by(lead, objective, start, steps).0)
}

fn climb_by(
    evidence: &dyn Differentiable,
    objective: &Objective,
    start: &[Quadric],
    steps: usize,
) -> (Vec<Quadric>, f64) {
    let settings = ClimbSettings { steps, first_step: 0.02, least_gain: objective.least_gain };
    let mut slopes = vec![QuadricGradient::default(); start.len()];
    let found = climb(&pack(start), &settings, |at, uphill| {
        let quadrics = unpack(at);
        let mut worth = evidence.score_and_gradient(&quadrics, &mut slopes);
        worth -= quadrics.iter().map(|quadric| objective.cost(quadric)).sum::<f64>();
        for ((numbers, quadric), slope) in
            uphill.chunks_exact_mut(NUMBERS).zip(&quadrics).zip(&slopes)
        {
            let Some(cost) = objective.cost_gradient(quadric) else { return f64::NEG_INFINITY };
            write(numbers, &(slope.center - cost.center), &(slope.factor - cost.factor));
        }
        worth
    });
    (unpack(&found.at), found.score)
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
