use crate::shape::{Quadric, QuadricGradient};

/// Returns how far an ellipsoid is from a ball: three times the logarithm of the ratio between the
/// arithmetic and the geometric mean of its squared radii. It is 0 for a ball, does not depend on
/// the size, and grows without bound as the ellipsoid gets flat or thin.
#[must_use]
pub fn anisotropy(quadric: &Quadric) -> f64 {
    3.0 * libm::log(quadric.factor.norm_squared() / 3.0) - 2.0 * libm::log(quadric.bulk())
}

/// Returns the gradient of the anisotropy by the quadric; `None` for one without volume.
#[must_use]
pub fn anisotropy_gradient(quadric: &Quadric) -> Option<QuadricGradient> {
    let inverse = quadric.factor.try_inverse()?;
    let factor = quadric.factor * (6.0 / quadric.factor.norm_squared()) - inverse.transpose() * 2.0;
    Some(QuadricGradient { factor, ..QuadricGradient::default() })
}
