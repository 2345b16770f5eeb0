use nalgebra::{Matrix3, Vector3};

use super::{Outline, Quadric, QuadricGradient};

/// An ellipsoid cut by planes of constant z: each cut is an ellipse of the same shape, whose centre
/// moves along a line and whose size follows the root of a circle. // (S32)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Section {
    center: Vector3<f64>,
    /// Displacement of a cut's centre in x and y per step in z.
    lean: [f64; 2],
    /// Σ_zz, the square of the reach in z.
    reach_squared: f64,
    /// The cut through the centre, about its own centre.
    middle: Outline,
}

/// Gradient of a score by the parts of a [`Section`], summed over its cuts.
#[derive(Debug, Clone, Copy, Default)]
pub struct SectionGradient {
    center: Vector3<f64>,
    lean: [f64; 2],
    reach_squared: f64,
    slope: f64,
    half_width: f64,
    half_height: f64,
}

/// Below this a cut is so near to a pole that its gradient is meaningless.
const TINY: f64 = 1e-9;

impl Section {
    /// Prepares an ellipsoid to be cut; `None` for one without volume.
    #[must_use]
    pub fn new(quadric: &Quadric) -> Option<Self> {
        let shape = quadric.shape_matrix();
        let reach_squared = shape[(2, 2)];
        let lean = [shape[(0, 2)] / reach_squared, shape[(1, 2)] / reach_squared];
        // Σ conditioned on z.
        let uu = shape[(0, 0)] - lean[0] * shape[(0, 2)];
        let uv = shape[(0, 1)] - lean[0] * shape[(1, 2)];
        let vv = shape[(1, 1)] - lean[1] * shape[(1, 2)];
        let slope = uv / vv;
        let width = uu - slope * uv;
        let solid = reach_squared > 0.0 && vv > 0.0 && width > 0.0;
        solid.then_some(Self {
            center: quadric.center,
            lean,
            reach_squared,
            middle: Outline {
                center_u: 0.0,
                center_v: 0.0,
                slope,
                half_width: width.sqrt(),
                half_height: vv.sqrt(),
            },
        })
    }

    /// Returns the first and the last z inside the ellipsoid.
    #[must_use]
    pub fn extent(&self) -> (f64, f64) {
        let reach = self.reach_squared.sqrt();
        (self.center.z - reach, self.center.z + reach)
    }

    /// Returns the cut by the plane at `z`, with x as u and y as v; `None` where there is none.
    #[must_use]
    pub fn at(&self, z: f64) -> Option<Outline> {
        let off = z - self.center.z;
        let root = (1.0 - off * off / self.reach_squared).max(0.0).sqrt();
        (root > TINY).then(|| Outline {
            center_u: self.center.x + self.lean[0] * off,
            center_v: self.center.y + self.lean[1] * off,
            slope: self.middle.slope,
            half_width: self.middle.half_width * root,
            half_height: self.middle.half_height * root,
        })
    }

    /// Adds the gradient of a score by the five numbers of the cut at `z`.
    pub fn add_slopes(
        &self,
        z: f64,
        [by_u, by_v, by_slope, by_width, by_height]: &[f64; 5],
        sum: &mut SectionGradient,
    ) {
        let off = z - self.center.z;
        let root = (1.0 - off * off / self.reach_squared).max(TINY * TINY).sqrt();
        let by_root = by_width * self.middle.half_width + by_height * self.middle.half_height;
        let by_square = 0.5 * by_root / root;
        let back = 2.0 * off / self.reach_squared * by_square;
        let along = by_u * self.lean[0] + by_v * self.lean[1];
        sum.center += Vector3::new(*by_u, *by_v, back - along);
        sum.lean[0] += by_u * off;
        sum.lean[1] += by_v * off;
        sum.reach_squared += by_square * (off / self.reach_squared).powi(2);
        sum.slope += by_slope;
        sum.half_width += by_width * root;
        sum.half_height += by_height * root;
    }

    /// Converts the summed gradient to one by the quadric. // through (S32)
    #[must_use]
    pub fn pull_back(&self, quadric: &Quadric, sum: &SectionGradient) -> QuadricGradient {
        let Outline { slope, half_width: width, half_height: height, .. } = self.middle;
        let square = height * height;
        let by_uu = 0.5 * sum.half_width / width;
        let by_uv = sum.slope / square - slope * sum.half_width / width;
        let by_vv = 0.5 * sum.half_height / height - slope * sum.slope / square
            + 0.5 * slope * slope * sum.half_width / width;
        let [x, y] = self.lean;
        let [by_x, by_y] = sum.lean.map(|slope| slope / self.reach_squared);
        let by_xz = by_x - 2.0 * by_uu * x - by_uv * y;
        let by_yz = by_y - by_uv * x - 2.0 * by_vv * y;
        let by_zz =
            sum.reach_squared - by_x * x - by_y * y + by_uu * x * x + by_uv * x * y + by_vv * y * y;
        // Each off-diagonal entry occurs twice in Σ.
        let (xy, xz, yz) = (0.5 * by_uv, 0.5 * by_xz, 0.5 * by_yz);
        let by_shape = Matrix3::new(by_uu, xy, xz, xy, by_vv, yz, xz, yz, by_zz);
        QuadricGradient { center: sum.center, factor: by_shape * quadric.factor * 2.0 }
    }
}

impl SectionGradient {
    /// Scales the gradient.
    #[must_use]
    pub fn scaled(&self, by: f64) -> Self {
        Self {
            center: self.center * by,
            lean: self.lean.map(|slope| slope * by),
            reach_squared: self.reach_squared * by,
            slope: self.slope * by,
            half_width: self.half_width * by,
            half_height: self.half_height * by,
        }
    }

    /// Adds another gradient.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            center: self.center + other.center,
            lean: [self.lean[0] + other.lean[0], self.lean[1] + other.lean[1]],
            reach_squared: self.reach_squared + other.reach_squared,
            slope: self.slope + other.slope,
            half_width: self.half_width + other.half_width,
            half_height: self.half_height + other.half_height,
        }
    }
}
