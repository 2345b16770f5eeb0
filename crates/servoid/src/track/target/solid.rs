use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use crate::shape::{Body, Ellipsoid, Outline, Projection, Quadric};

/// The body in the object's frame, prepared for outlines and rays.
#[derive(Debug, Clone)]
pub(crate) struct Solid {
    pub(crate) quadrics: Vec<Quadric>,
    to_ball: Vec<Matrix3<f64>>,
    /// Half the size of the body, in metres.
    pub(crate) radius: f64,
}

/// The point at which a ray meets the body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    /// Index of the foremost ellipsoid there.
    pub(crate) ellipsoid: usize,
    pub(crate) point: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
}

impl Solid {
    pub(crate) fn new(body: &Body) -> Self {
        let quadrics: Vec<_> = body.ellipsoids().iter().map(Ellipsoid::quadric).collect();
        let to_ball = body.ellipsoids().iter().map(to_ball).collect();
        let reach = |e: &Ellipsoid| e.center().norm() + e.radii().max();
        let radius = body.ellipsoids().iter().map(reach).fold(f64::MIN_POSITIVE, f64::max);
        Self { quadrics, to_ball, radius }
    }

    /// Returns the outlines of its ellipsoids in a camera that sees the object's frame.
    pub(crate) fn outlines(&self, projection: &Projection) -> impl Iterator<Item = Outline> {
        self.quadrics.iter().filter_map(|quadric| projection.outline(quadric))
    }

    /// Returns the first point at which a ray meets the body.
    pub(crate) fn hit(&self, origin: &Vector3<f64>, direction: &Vector3<f64>) -> Option<Hit> {
        let mut nearest: Option<(f64, usize, Vector3<f64>)> = None;
        let solids = self.quadrics.iter().zip(&self.to_ball).enumerate();
        for (ellipsoid, (quadric, to_ball)) in solids {
            let (from, way) = (to_ball * (origin - quadric.center), to_ball * direction);
            let (a, b) = (way.norm_squared(), from.dot(&way));
            let root = b * b - a * (from.norm_squared() - 1.0);
            let along = (-b - root.max(0.0).sqrt()) / a;
            if root > 0.0 && along > 0.0 && nearest.is_none_or(|(best, ..)| along < best) {
                let normal = to_ball.tr_mul(&(from + way * along));
                nearest = Some((along, ellipsoid, normal));
            }
        }
        nearest.map(|(along, ellipsoid, normal)| Hit {
            ellipsoid,
            point: origin + direction * along,
            normal: normal.normalize(),
        })
    }

    /// Returns whether the body hides a point of its surface from a camera. Points may lie slightly
    /// inside the ellipsoids, so the test starts a little nearer to the camera.
    pub(crate) fn hides(&self, point: &Vector3<f64>, eye: &Vector3<f64>) -> bool {
        let way = eye - point;
        let start = point + way.normalize() * (OUTSIDE * self.radius);
        let way = eye - start;
        self.quadrics.iter().zip(&self.to_ball).any(|(quadric, to_ball)| {
            let (from, way) = (to_ball * (start - quadric.center), to_ball * way);
            let nearest = (-from.dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            (from + way * nearest).norm_squared() < 1.0
        })
    }
}

/// The outlines of a body's ellipsoids, prepared to compute how far inside of them pixels lie. Its
/// memory is reused from image to image.
#[derive(Debug, Clone, Default)]
pub(crate) struct Rims(Vec<(Outline, Matrix2<f64>)>);

impl Rims {
    /// Computes the outlines that a camera sees.
    pub(crate) fn read(&mut self, solid: &Solid, projection: &Projection) {
        let inverse = |outline: &Outline| {
            outline.covariance_px().try_inverse().unwrap_or_else(Matrix2::identity)
        };
        self.0.clear();
        self.0.extend(solid.outlines(projection).map(|outline| (outline, inverse(&outline))));
    }

    /// Returns the approximate distance of a pixel inside the outlines, in pixels; not positive if
    /// outside.
    pub(crate) fn margin(&self, pixel: &Vector2<f64>) -> f64 {
        let depth = |(outline, inverse): &(Outline, Matrix2<f64>)| {
            let away = pixel - outline.center_px();
            // Written out: the general product of matrices takes several times as long.
            let across = inverse[(0, 0)] * away.x + inverse[(0, 1)] * away.y;
            let down = inverse[(1, 0)] * away.x + inverse[(1, 1)] * away.y;
            let distance = (away.x * across + away.y * down).sqrt();
            let length = if distance > 1e-9 {
                away.norm() / distance
            } else {
                outline.half_width.min(outline.half_height)
            };
            (1.0 - distance) * length
        };
        self.0.iter().map(depth).fold(f64::NEG_INFINITY, f64::max)
    }
}

/// Share of the body's radius by which points are lifted before they are tested for being hidden.
const OUTSIDE: f64 = 0.2;

fn to_ball(ellipsoid: &Ellipsoid) -> Matrix3<f64> {
    let back = ellipsoid.rotation().inverse().to_rotation_matrix().into_inner();
    Matrix3::from_diagonal(&ellipsoid.radii().map(|r| 1.0 / r)) * back
}
