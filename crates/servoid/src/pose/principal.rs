use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion, Vector3};

use super::Pose;

impl Pose {
    /// Returns the frame at a centroid whose x lies along the longest principal axis of `spread` (a
    /// covariance) and y along the next, each with the sign that makes its `lean` non-negative.
    #[must_use]
    pub fn principal(
        centroid: Vector3<f64>,
        spread: &Matrix3<f64>,
        lean: impl Fn(&Vector3<f64>) -> f64,
    ) -> Self {
        let eigen = SymmetricEigen::new(*spread);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let axis = |i: usize| -> Vector3<f64> {
            let axis: Vector3<f64> = eigen.eigenvectors.column(order[i]).into();
            if lean(&axis) < 0.0 { -axis } else { axis }
        };
        let (first, second) = (axis(0), axis(1));
        let axes = Matrix3::from_columns(&[first, second, first.cross(&second)]);
        let rotation =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        Self::from_rotation(rotation, centroid)
    }
}
