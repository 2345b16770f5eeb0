use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use super::Genes;
use crate::pose::{Pose, Twist};

/// How far the population may reach, and so what its spread is measured in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reach {
    /// Along each axis, in metres.
    pub place: f64,
    /// About each axis, in radians; 0 where the orientation is held.
    pub turn: f64,
    /// Metres an object size.
    pub size: f64,
}

/// How well the population agrees.
pub(super) struct Spread {
    pub covariance: Matrix6<f64>,
    pub unobservable: Vec<Twist>,
}

/// Standard deviation, as a share of the reach, from which the images leave a motion open.
const OPEN: f64 = 0.2;

impl Reach {
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

impl Spread {
    /// Takes the better half of the poses, the best first, about the best, weighted by rank.
    ///
    /// Source of the weights: Hansen, Ostermeier, *Completely derandomized self-adaptation in
    /// evolution strategies* (2001).
    pub fn of(ranked: &[Pose], best: &Pose, reach: &Reach) -> Self {
        let half = ranked.len().div_ceil(2);
        let weight = |rank: usize| ((half as f64 + 0.5) / (rank as f64 + 1.0)).ln();
        let (mut sum, mut total) = (Matrix6::zeros(), 0.0);
        for (rank, pose) in ranked.iter().take(half).enumerate() {
            let mut motion = (best.inverse() * *pose).log();
            if reach.turn == 0.0 {
                // Only rounding: the orientation is held.
                motion.fixed_rows_mut::<3>(3).fill(0.0);
            }
            sum += motion * motion.transpose() * weight(rank);
            total += weight(rank);
        }
        Self::from_covariance(sum / total.max(f64::MIN_POSITIVE), reach)
    }

    /// Says that the object may be anywhere within reach.
    pub fn anywhere(reach: &Reach) -> Self {
        let variances = reach.scales().map(|scale| scale * scale / 3.0);
        Self::from_covariance(Matrix6::from_diagonal(&variances), reach)
    }

    fn from_covariance(covariance: Matrix6<f64>, reach: &Reach) -> Self {
        let scales = reach.scales();
        let per_scale = scales.map(|scale| if scale > 0.0 { 1.0 / scale } else { 0.0 });
        let scaled = Matrix6::from_diagonal(&per_scale) * covariance;
        let eigen = SymmetricEigen::new(scaled * Matrix6::from_diagonal(&per_scale));
        let mut order = [0, 1, 2, 3, 4, 5];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let open = order.into_iter().filter(|&axis| eigen.eigenvalues[axis] > OPEN * OPEN);
        let motion = |axis: usize| {
            let mut motion = eigen.eigenvectors.column(axis).component_mul(&scales);
            motion.fixed_rows_mut::<3>(0).unscale_mut(reach.size);
            motion.normalize()
        };
        Self { covariance, unobservable: open.map(motion).collect() }
    }
}
