use nalgebra::{Matrix3, Vector3};

use super::{Ellipsoid, ShapeError};
use crate::pose::{Pose, even_direction};

/// A rigid set of ellipsoids in the object's own frame, and the pose of that frame in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    world_from_object: Pose,
    ellipsoids: Vec<Ellipsoid>,
}

/// Sample points per ellipsoid for the moments of the union, and for what two bodies share.
const MOMENT_POINTS: usize = 256;
const SHARED_POINTS: usize = 64;
/// Share of the volume of each of two bodies inside the other from which on they are at one place:
/// beside each other they share next to nothing, and a body in a bowl is not as large as that.
const AT_ONE_PLACE: f64 = 0.4;

impl Body {
    /// Most ellipsoids in a body.
    pub const MAX_ELLIPSOIDS: usize = 64;

    /// Makes a body of ellipsoids, given in the object's frame, and the pose of that frame.
    ///
    /// # Errors
    /// If there is no ellipsoid or there are more than [`Body::MAX_ELLIPSOIDS`].
    pub fn new(world_from_object: Pose, ellipsoids: Vec<Ellipsoid>) -> Result<Self, ShapeError> {
        let (given, max) = (ellipsoids.len(), Self::MAX_ELLIPSOIDS);
        if given == 0 || given > max {
            return Err(ShapeError::Count { given, max });
        }
        Ok(Self { world_from_object, ellipsoids })
    }

    /// Makes a body of ellipsoids given in the world and chooses the object's frame: its origin at
    /// the centroid of their union, x along its longest principal axis, y along the next, each
    /// pointing to the heavier side.
    ///
    /// # Errors
    /// As for [`Body::new`].
    pub fn around(ellipsoids_in_world: &[Ellipsoid]) -> Result<Self, ShapeError> {
        let world_from_object = principal_frame(ellipsoids_in_world);
        let object_from_world = world_from_object.inverse();
        let moved = |e: &Ellipsoid| e.transformed(&object_from_world, 1.0);
        Self::new(world_from_object, ellipsoids_in_world.iter().map(moved).collect())
    }

    /// Returns the pose of the object in the world.
    #[must_use]
    pub fn world_from_object(&self) -> Pose {
        self.world_from_object
    }

    /// Returns the ellipsoids in the object's frame.
    #[must_use]
    pub fn ellipsoids(&self) -> &[Ellipsoid] {
        &self.ellipsoids
    }

    /// Returns the ellipsoids in the world.
    #[must_use]
    pub fn in_world(&self) -> Vec<Ellipsoid> {
        self.ellipsoids.iter().map(|e| e.transformed(&self.world_from_object, 1.0)).collect()
    }

    /// Returns the body at another pose.
    #[must_use]
    pub fn at(&self, world_from_object: Pose) -> Self {
        Self { world_from_object, ellipsoids: self.ellipsoids.clone() }
    }

    /// Returns the share of its volume that each of two bodies has inside the other, the lesser of
    /// both: 1 for equal bodies at one place, 0 for bodies apart. It is sampled, and good to a
    /// tenth.
    #[must_use]
    pub fn overlap(&self, other: &Self) -> f64 {
        let apart = self.world_from_object.translation() - other.world_from_object.translation();
        if apart.norm() > self.reach() + other.reach() {
            return 0.0;
        }
        let (own, others) = (self.in_world(), other.in_world());
        share_inside(&own, &others).min(share_inside(&others, &own))
    }

    /// Returns the radius of a ball about the origin of the object's frame that holds the body.
    fn reach(&self) -> f64 {
        self.ellipsoids.iter().map(|e| e.center().norm() + e.radii().max()).fold(0.0, f64::max)
    }

    /// Returns whether two bodies are at one place, as two solid objects never are.
    #[must_use]
    pub fn shares_place(&self, other: &Self) -> bool {
        self.overlap(other) >= AT_ONE_PLACE
    }

    /// Scales about the world's origin, then transforms by a pose.
    #[must_use]
    pub fn transformed(&self, pose: &Pose, scale: f64) -> Self {
        let here = self.world_from_object;
        let scaled = Pose::from_rotation(here.rotation(), here.translation() * scale);
        let resize = |e: &Ellipsoid| e.transformed(&Pose::identity(), scale);
        Self {
            world_from_object: *pose * scaled,
            ellipsoids: self.ellipsoids.iter().map(resize).collect(),
        }
    }
}

fn principal_frame(ellipsoids: &[Ellipsoid]) -> Pose {
    let points = weighted_points(ellipsoids, MOMENT_POINTS);
    let total: f64 = points.iter().map(|(_, weight)| weight).sum();
    let centroid = points.iter().map(|(p, w)| p * *w).sum::<Vector3<f64>>() / total;
    let spread: Matrix3<f64> =
        points.iter().map(|(p, w)| (p - centroid) * (p - centroid).transpose() * *w).sum();
    Pose::principal(centroid, &(spread / total), |axis| {
        points.iter().map(|(p, w)| w * (p - centroid).dot(axis).powi(3)).sum()
    })
}

/// Returns the share of the volume of ellipsoids that is inside others.
fn share_inside(ellipsoids: &[Ellipsoid], others: &[Ellipsoid]) -> f64 {
    let (mut all, mut inside) = (0.0, 0.0);
    for (point, weight) in weighted_points(ellipsoids, SHARED_POINTS) {
        all += weight;
        if others.iter().any(|other| other.contains(&point)) {
            inside += weight;
        }
    }
    inside / all
}

/// Spreads `count` points evenly over each ellipsoid, weighted by volume; a point inside several
/// ellipsoids is shared among them, so that sums are over the union.
fn weighted_points(ellipsoids: &[Ellipsoid], count: usize) -> Vec<(Vector3<f64>, f64)> {
    let mut out = Vec::with_capacity(ellipsoids.len() * count);
    for ellipsoid in ellipsoids {
        let factor = ellipsoid.factor();
        for unit in (0..count).map(|i| ball_point(i, count)) {
            let point = ellipsoid.center() + factor * unit;
            let holders = ellipsoids.iter().filter(|other| other.contains(&point)).count().max(1);
            out.push((point, ellipsoid.volume() / holders as f64));
        }
    }
    out
}

/// Returns point `i` of the `count` of a Fibonacci spiral through the unit ball.
fn ball_point(i: usize, count: usize) -> Vector3<f64> {
    let share = (i as f64 + 0.5) / count as f64;
    // A second irrational step decouples the radius from the height.
    let radius = libm::cbrt((i as f64 * 0.754_877_666_246_693).fract());
    even_direction(i, 1.0 - 2.0 * share) * radius
}
