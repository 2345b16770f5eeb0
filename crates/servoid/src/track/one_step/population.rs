use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use super::Genes;
use crate::pose::{Pose, Twist};

/// The range of the search around the last pose, which is also the unit of the moments.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchRange {
    /// Along each axis, in metres.
    pub place: f64,
    /// About each axis, in radians; 0 where the orientation is fixed.
    pub turn: f64,
    /// Metres per object size.
    pub size: f64,
}

/// The spread of the population, and the motions along which selection does not narrow it.
///
/// Second moments (linear, angular) as shares of the range: a motion that the images do not
/// constrain is as frequent among the better individuals as among all, however far the population
/// has drifted along it.
pub(super) struct PopulationMoments {
    range: SearchRange,
    all: Matrix6<f64>,
    better: Matrix6<f64>,
}

/// Weight of the previous moments in those of the next image.
const MEMORY: f64 = 0.9;
/// Ratio of the better individuals' variance to that of all above which a motion is unobservable.
const OPEN: f64 = 0.75;

impl SearchRange {
    pub fn ranges(&self, genes: Genes) -> Vec<(f64, f64)> {
        let (place, turn) = ((-self.place, self.place), (-self.turn, self.turn));
        match genes {
            Genes::Place => vec![place; 3],
            Genes::Pose => vec![place, place, place, turn, turn, turn],
        }
    }

    fn scales(&self) -> Vector6<f64> {
        let Self { place, turn, .. } = *self;
        Vector6::new(place, place, place, turn, turn, turn)
    }
}

impl PopulationMoments {
    /// Starts without any data.
    pub fn new(range: SearchRange) -> Self {
        Self { range, all: Matrix6::zeros(), better: Matrix6::zeros() }
    }

    /// Updates the moments by a generation, the best first, and returns the covariance of its
    /// better half about the best, weighted by rank.
    ///
    /// Source of the weights: Hansen, Ostermeier, *Completely derandomized self-adaptation in
    /// evolution strategies* (2001).
    pub fn update(&mut self, ranked: &[Pose]) -> Matrix6<f64> {
        let motions = self.motions(ranked);
        let half = motions.len().div_ceil(2);
        let by_rank = |rank: usize| libm::log((half as f64 + 0.5) / (rank as f64 + 1.0));
        let weights: Vec<_> = (0..half).map(by_rank).collect();
        let (about_best, about_mean) = moments(&motions, &weights);
        let (_, of_all) = moments(&motions, &vec![1.0; motions.len()]);
        self.better = self.better * MEMORY + about_mean * (1.0 - MEMORY);
        self.all = self.all * MEMORY + of_all * (1.0 - MEMORY);
        let scale = Matrix6::from_diagonal(&self.range.scales());
        scale * about_best * scale
    }

    /// Returns the covariance of an object that may be anywhere in the range.
    pub fn anywhere(&self) -> Matrix6<f64> {
        let scales = self.range.scales();
        Matrix6::from_diagonal(&scales.component_mul(&scales)) / 3.0
    }

    /// Returns the unit motions that the images do not constrain.
    ///
    /// If scores depend on B x alone, selection narrows the moments to A - A Bᵀ (..) B A. Then S v
    /// = A v only where B A v = 0, and A v is a motion that no score constrains.
    pub fn unobservable(&self) -> Vec<Twist> {
        // A fixed orientation does not move; a motion without spread is not known to be
        // unobservable.
        let floor = Matrix6::from_diagonal_element(1e-12);
        let Some(cholesky) = (self.all + floor).cholesky() else { return vec![] };
        let factor = cholesky.l();
        let Some(inverse) = factor.try_inverse() else { return vec![] };
        let eigen = SymmetricEigen::new(inverse * self.better * inverse.transpose());
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let open = order.into_iter().filter(|&axis| eigen.eigenvalues[axis] > OPEN);
        let motion = |axis: usize| {
            let shares = factor * eigen.eigenvectors.column(axis);
            let mut motion = shares.component_mul(&self.range.scales());
            motion.fixed_rows_mut::<3>(0).unscale_mut(self.range.size);
            motion.normalize()
        };
        open.map(motion).collect()
    }

    /// Returns the motions from the best to each, as shares of the range.
    fn motions(&self, ranked: &[Pose]) -> Vec<Twist> {
        let scales = self.range.scales();
        let share = |by: f64, scale: f64| if scale > 0.0 { by / scale } else { 0.0 };
        let from_best = ranked.first().map(Pose::inverse);
        let motion = |pose: &Pose| {
            let motion = from_best.unwrap_or(*pose) * *pose;
            motion.log().zip_map(&scales, share)
        };
        ranked.iter().map(motion).collect()
    }
}

/// Returns the weighted second moments about the origin and about the mean.
fn moments(motions: &[Twist], weights: &[f64]) -> (Matrix6<f64>, Matrix6<f64>) {
    let total: f64 = weights.iter().sum();
    let both = || motions.iter().zip(weights);
    let mean: Twist = both().map(|(motion, weight)| motion * *weight).sum::<Twist>() / total;
    let second: Matrix6<f64> =
        both().map(|(motion, weight)| motion * motion.transpose() * *weight).sum();
    let about_origin = second / total;
    (about_origin, about_origin - mean * mean.transpose())
}
