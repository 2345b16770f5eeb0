use nalgebra::{Matrix6, SymmetricEigen, Vector6};

use super::refine::Normal;
use crate::pose::Twist;

/// Uncertainty of a pose due to the images.
pub(crate) struct Uncertainty {
    /// Covariance of a small motion in the object's frame, by the images alone.
    pub(crate) covariance: Matrix6<f64>,
    /// Motions that the images do not constrain, of unit length in radii and radians.
    pub(crate) unobservable: Vec<Twist>,
}

/// Standard deviation, in radii and radians, from which on a motion counts as unobservable.
const OPEN: f64 = 0.25;

/// Inverts a covariance or an information matrix, with the same bits in any unit of length.
pub(crate) fn inverse(matrix: &Matrix6<f64>) -> Option<Matrix6<f64>> {
    Some(matrix.cholesky()?.inverse())
}

/// Computes the covariance and the unobservable motions from the curvature about a pose. Boundary
/// offsets that the tracker learned do not count: they cannot confirm the poses by which they were
/// learned.
pub(crate) fn uncertainty(normal: &Normal, radius: f64) -> Uncertainty {
    let normal = normal.without_edges();
    let covariance = by_images(&normal, radius);
    let units = Matrix6::from_diagonal(&Vector6::new(radius, radius, radius, 1.0, 1.0, 1.0));
    let information = units * (normal.curvature - normal.prior) * units;
    let eigen = SymmetricEigen::new(information);
    let observable = |i: usize| eigen.eigenvalues[i] > OPEN.powi(-2);
    let open = |i: &usize| !observable(*i);
    let unobservable = (0..6).filter(open).map(|i| eigen.eigenvectors.column(i).into()).collect();
    Uncertainty { covariance, unobservable }
}

/// Returns the variance of the orientation by the images alone.
pub(crate) fn turn_variance(normal: &Normal, radius: f64) -> f64 {
    by_images(&normal.without_edges(), radius).fixed_view::<3, 3>(3, 3).trace()
}

fn by_images(normal: &Normal, radius: f64) -> Matrix6<f64> {
    let images = normal.curvature - normal.prior + Normal::new(radius).prior;
    inverse(&images).unwrap_or_else(Matrix6::identity)
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::track::target::bias::Bias;

    #[test]
    fn a_rotation_that_only_an_outline_measures_is_uncertain_but_not_unobservable() {
        for radius in [0.02, 0.05, 0.2] {
            let mut normal = Normal::new(radius);
            assert_eq!(uncertainty(&normal, radius).unobservable.len(), 6, "nothing is seen");
            let sharp = Vector6::new(radius, radius, radius, 1.0, 1.0, 1.0).map(|x| 1e6 / (x * x));
            let sharp = (Matrix6::from_diagonal(&sharp), Vector6::zeros());
            normal.curvature += Bias::unknown(radius).freed(&Vector3::z(), sharp).0;
            let found = uncertainty(&normal, radius);
            assert!(found.unobservable.is_empty());
            assert!((3..6).all(|axis| found.covariance[(axis, axis)] > 0.1_f64.powi(2)));
        }
    }
}
