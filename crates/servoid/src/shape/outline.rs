use nalgebra::{Matrix2, Matrix2x3, Matrix3, SMatrix, Vector2, Vector3};

use super::{Quadric, QuadricGradient};
use crate::camera::Camera;
use crate::pose::Pose;

/// The projection of a camera at a pose, from the world to homogeneous pixels: x ↦ M x + k with M =
/// K R, k = K t.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Projection {
    /// M = K R.
    pub linear: Matrix3<f64>,
    /// k = K t.
    pub offset: Vector3<f64>,
}

/// The outline of an ellipsoid in an image: an ellipse, described row by row.
///
/// Row v contains the interval `center_u + slope * (v - center_v) ± half_width * root` with
/// `root = sqrt(1 - ((v - center_v) / half_height)²)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outline {
    /// Column of the ellipse's centre, in pixels.
    pub center_u: f64,
    /// Row of the ellipse's centre, in pixels.
    pub center_v: f64,
    /// Displacement of the middle of the interval to the right, in pixels per row.
    pub slope: f64,
    /// Half the length of the interval in the centre's row, in pixels.
    pub half_width: f64,
    /// Half the extent in rows, in pixels.
    pub half_height: f64,
}

impl Projection {
    /// Makes the projection of a camera at a pose.
    #[must_use]
    pub fn new(camera: &Camera, world_from_camera: &Pose) -> Self {
        let camera_from_world = world_from_camera.inverse();
        Self {
            linear: camera.matrix() * camera_from_world.rotation_matrix(),
            offset: camera.matrix() * camera_from_world.translation(),
        }
    }

    /// Returns the projection of the frame of an object at a pose.
    #[must_use]
    pub fn moved(&self, world_from_object: &Pose) -> Self {
        Self {
            linear: self.linear * world_from_object.rotation_matrix(),
            offset: self.apply(&world_from_object.translation()),
        }
    }

    /// Returns the projection to pixels relative to another first pixel.
    #[must_use]
    pub fn shifted(&self, first_px: [f64; 2]) -> Self {
        let mut moved = *self;
        for (row, first) in first_px.into_iter().enumerate() {
            let third = moved.linear.row(2) * first;
            moved.linear.row_mut(row).zip_apply(&third, |x, y| *x -= y);
            moved.offset[row] -= first * moved.offset.z;
        }
        moved
    }

    /// Returns the position of the camera; `None` if the projection is degenerate.
    #[must_use]
    pub fn eye(&self) -> Option<Vector3<f64>> {
        Some(-self.linear.try_inverse()? * self.offset)
    }

    /// Projects a point to homogeneous pixels.
    #[must_use]
    pub fn apply(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let row = |i: usize| {
            let of = |j: usize| self.linear[(i, j)] * point[j];
            of(0) + of(1) + of(2) + self.offset[i]
        };
        Vector3::new(row(0), row(1), row(2))
    }

    /// Projects a point to a pixel and returns the derivative by the point; `None` if the point is
    /// not in front.
    #[must_use]
    pub fn pixel(&self, point: &Vector3<f64>) -> Option<(Vector2<f64>, Matrix2x3<f64>)> {
        let h = self.apply(point);
        if h.z.is_nan() || h.z <= 0.0 {
            return None;
        }
        let per_z = 1.0 / h.z;
        let pixel = Vector2::new(h.x * per_z, h.y * per_z);
        let third = self.linear.row(2);
        let rows = [self.linear.row(0) - third * pixel.x, self.linear.row(1) - third * pixel.y];
        Some((pixel, Matrix2x3::from_rows(&rows) * per_z))
    }

    /// Returns the outline of an ellipsoid, or `None` if the ellipsoid is not completely in front
    /// of the camera.
    #[must_use]
    pub fn outline(&self, quadric: &Quadric) -> Option<Outline> {
        let spread = rows(&product(&self.linear, &quadric.factor));
        let p = self.apply(&quadric.center);
        let depth = p.z * p.z - dot(&spread[2], &spread[2]);
        if !(p.z > 0.0 && depth > 0.0) {
            return None;
        }
        // The dual conic C* = M Σ Mᵀ - p pᵀ about the image (x, y) of the centre, where the large
        // products that would cancel are zero; then moved there.
        let per_z = 1.0 / p.z;
        let (x, y) = (p.x * per_z, p.y * per_z);
        let third = &spread[2];
        let about = |row: &Row, by: f64| [0, 1, 2].map(|j| row[j] - third[j] * by);
        let (across, down) = (about(&spread[0], x), about(&spread[1], y));
        let per_depth = 1.0 / depth;
        let shift_u = -dot(&across, third) * per_depth;
        let shift_v = -dot(&down, third) * per_depth;
        let uu = dot(&across, &across) * per_depth + shift_u * shift_u;
        let uv = dot(&across, &down) * per_depth + shift_u * shift_v;
        let vv = dot(&down, &down) * per_depth + shift_v * shift_v;
        let slope = if vv > 0.0 { uv / vv } else { 0.0 };
        Some(Outline {
            center_u: x + shift_u,
            center_v: y + shift_v,
            slope,
            half_width: (uu - slope * uv).max(0.0).sqrt(),
            half_height: vv.sqrt(),
        })
    }

    /// Converts the gradient of a score by the five numbers of an outline to one by the quadric.
    #[must_use]
    pub fn pull_back(
        &self,
        quadric: &Quadric,
        outline: &Outline,
        [by_u, by_v, by_slope, by_width, by_height]: &[f64; 5],
    ) -> QuadricGradient {
        let Outline { center_u: u, center_v: v, slope, half_width, half_height } = *outline;
        let (width, height) = (half_width.max(TINY), half_height.max(TINY));
        // By the covariance of the ellipse.
        let by_uu = 0.5 * by_width / width;
        let by_uv = by_slope / (height * height) - slope * by_width / width;
        let by_vv = 0.5 * by_height / height - slope * by_slope / (height * height)
            + 0.5 * slope * slope * by_width / width;
        // By the normalised dual conic, whose last column is the centre.
        let to_u = by_u + 2.0 * u * by_uu + v * by_uv;
        let to_v = by_v + u * by_uv + 2.0 * v * by_vv;
        let covariance = outline.covariance_px();
        let scaled = -by_uu * (u * u - covariance[(0, 0)])
            - by_uv * (u * v - covariance[(0, 1)])
            - by_vv * (v * v - covariance[(1, 1)])
            + to_u * u
            + to_v * v;
        let spread = product(&self.linear, &quadric.factor);
        let p = self.apply(&quadric.center);
        let third = [0, 1, 2].map(|j| spread[(2, j)]);
        let scale = 1.0 / (dot(&third, &third) - p.z * p.z);
        let by_conic = scale
            * Matrix3::new(
                -by_uu,
                -0.5 * by_uv,
                0.5 * to_u,
                -0.5 * by_uv,
                -by_vv,
                0.5 * to_v,
                0.5 * to_u,
                0.5 * to_v,
                -scaled,
            );
        // C* = M Σ Mᵀ - p pᵀ.
        let back = product(&self.linear.transpose(), &by_conic);
        let row = |i: usize| (back[(i, 0)] * p.x + back[(i, 1)] * p.y + back[(i, 2)] * p.z) * -2.0;
        QuadricGradient {
            center: Vector3::new(row(0), row(1), row(2)),
            factor: product(&back, &spread) * 2.0,
        }
    }
}

type Row = [f64; 3];

/// Multiplies matrices with the bits of the operator, which is not inlined and takes several times as
/// long: a fifth of a fit, as an outline is computed for each ellipsoid in each image.
#[inline(always)]
pub(crate) fn product<const R: usize>(
    a: &SMatrix<f64, R, 3>,
    b: &Matrix3<f64>,
) -> SMatrix<f64, R, 3> {
    let mut out = SMatrix::zeros();
    for j in 0..3 {
        for i in 0..R {
            out[(i, j)] = a[(i, 0)] * b[(0, j)] + a[(i, 1)] * b[(1, j)] + a[(i, 2)] * b[(2, j)];
        }
    }
    out
}

#[inline(always)]
fn rows(matrix: &Matrix3<f64>) -> [Row; 3] {
    [0, 1, 2].map(|i| [matrix[(i, 0)], matrix[(i, 1)], matrix[(i, 2)]])
}

/// Multiplies rows, with the bits of the method.
#[inline(always)]
fn dot(a: &Row, b: &Row) -> f64 {
    0.0 + a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Below this size, in pixels, an outline has no direction in which it grows.
const TINY: f64 = 1e-9;

impl Outline {
    /// Returns the share of `1 - t²`, with t from -1 at the first row to 1 at the last, below which
    /// a row counts as at a pole if rows are `stride` pixels apart.
    #[must_use]
    pub fn bluntness(&self, stride: f64) -> f64 {
        0.5 * stride / self.half_height.max(TINY)
    }

    /// Returns the largest distance from the centre of rows that contain a part of the outline.
    #[must_use]
    pub fn reach(&self, stride: f64) -> f64 {
        self.half_height * (1.0 + self.bluntness(stride)).sqrt()
    }

    /// Returns the interval of columns that represents the whole strip of `stride` pixels about row
    /// `v`, if any. Near the poles, where the outline opens like a square root, it is about the
    /// mean over the strip, so that sums over rows change smoothly with the outline.
    #[must_use]
    pub fn mean_interval(&self, v: f64, stride: f64) -> Option<(f64, f64)> {
        let below = v - self.center_v;
        let (square, blunt) = (1.0 - (below / self.half_height).powi(2), self.bluntness(stride));
        let near = (square.min(blunt) + blunt).max(0.0);
        let root = (near * near / (4.0 * blunt) + (square - blunt).max(0.0)).sqrt();
        let (middle, half) = (self.center_u + self.slope * below, self.half_width * root);
        (root > 0.0).then_some((middle - half, middle + half))
    }

    /// Returns the interval of columns of row `v` inside the outline, if any.
    #[must_use]
    pub fn interval(&self, v: f64) -> Option<(f64, f64)> {
        let below = v - self.center_v;
        let root = 1.0 - (below / self.half_height).powi(2);
        let (middle, half) = (self.center_u + self.slope * below, self.half_width * root.sqrt());
        (root > 0.0).then_some((middle - half, middle + half))
    }

    /// Returns the outline about `by_px` pixels outside; inside if that is negative.
    #[must_use]
    pub fn grown(&self, by_px: f64) -> Self {
        let longer = |half: f64| (half + by_px).max(0.1);
        Self { half_width: longer(self.half_width), half_height: longer(self.half_height), ..*self }
    }

    /// Returns whether a pixel is inside.
    #[must_use]
    pub fn contains(&self, pixel: &Vector2<f64>) -> bool {
        let below = pixel.y - self.center_v;
        let across = (pixel.x - self.center_u - self.slope * below) / self.half_width;
        across * across + (below / self.half_height).powi(2) < 1.0
    }

    /// Returns the centre in pixels.
    #[must_use]
    pub fn center_px(&self) -> Vector2<f64> {
        Vector2::new(self.center_u, self.center_v)
    }

    /// Returns the 2x2 matrix S of the ellipse (x - c)ᵀ S⁻¹ (x - c) = 1, in square pixels.
    #[must_use]
    pub fn covariance_px(&self) -> Matrix2<f64> {
        let vv = self.half_height * self.half_height;
        let uv = self.slope * vv;
        Matrix2::new(self.half_width * self.half_width + self.slope * uv, uv, uv, vv)
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::evolve::rng;

    #[test]
    fn products_that_are_written_out_have_the_bits_of_the_general_ones() {
        let mut random = rng(0, 7);
        for _ in 0..200 {
            let mut draw = || Matrix3::from_fn(|_, _| random.random_range(-3.0..3.0));
            let (linear, b) = (draw(), draw());
            assert_eq!(product(&linear, &b), linear * b);
            let ([first, .., last], point) = (rows(&b), b.column(1).into_owned());
            assert_eq!(dot(&first, &last), b.row(0).dot(&b.row(2)));
            assert_eq!(dot(&first, &first), b.row(0).norm_squared());
            let projection = Projection { linear, offset: b.column(2).into_owned() };
            assert_eq!(projection.apply(&point), linear * point + projection.offset);
        }
    }
}
