//! Entry and exit of rays through the simple shapes, each about the origin of its own frame.

use super::mesh::Mesh;
use super::vector::{Vector, splat};
use crate::simd::RayLanes;

/// The shape of a visual, in metres.
#[derive(Debug, Clone)]
pub(super) enum Shape {
    Ellipsoid { radii: [f64; 3] },
    Capsule { radius: f64, half_length: f64 },
    Cylinder { radius: f64, half_length: f64 },
    Box { half_size: [f64; 3] },
    Plane { half_size: [f64; 2] },
    Mesh(Mesh),
}

impl Shape {
    /// Returns the sizes that [`span`] reads.
    pub fn sizes(&self) -> [f64; 3] {
        match *self {
            Self::Ellipsoid { radii } => radii.map(|r| 1.0 / r),
            Self::Capsule { radius, half_length } | Self::Cylinder { radius, half_length } => {
                [radius, half_length, 0.0]
            }
            Self::Box { half_size } => half_size,
            Self::Plane { half_size: [x, y] } => [x, y, 0.0],
            Self::Mesh(_) => [0.0; 3],
        }
    }

    /// Returns middle and half sizes of a box around it, in its own frame, with a margin for
    /// rounding.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let (middle, half) = match *self {
            Self::Ellipsoid { radii } => ([0.0; 3], radii),
            Self::Capsule { radius: r, half_length } => ([0.0; 3], [r, r, r + half_length]),
            Self::Cylinder { radius: r, half_length } => ([0.0; 3], [r, r, half_length]),
            Self::Box { half_size } => ([0.0; 3], half_size),
            Self::Plane { half_size: [x, y] } => ([0.0; 3], [x, y, 0.0]),
            Self::Mesh(ref mesh) => mesh.bounds(),
        };
        let longest = half.iter().copied().fold(0.0, f64::max);
        (middle, half.map(|x| x + 1e-5 * longest + 1e-6))
    }
}

/// Interval of a ray inside a convex shape, in multiples of its direction; empty if `enter` is
/// beyond `leave`.
#[derive(Clone, Copy)]
pub(super) struct Span<L> {
    pub enter: L,
    pub leave: L,
}

impl<L: RayLanes> Span<L> {
    /// Returns the span where a truth holds, an empty one elsewhere.
    #[inline(always)]
    fn where_true(self, truth: L) -> Self {
        Self {
            enter: truth.select(self.enter, L::of(f64::INFINITY)),
            leave: truth.select(self.leave, L::of(f64::NEG_INFINITY)),
        }
    }

    #[inline(always)]
    fn and(self, other: Self) -> Self {
        Self { enter: self.enter.max(other.enter), leave: self.leave.min(other.leave) }
    }

    /// Joins two spans that touch, or of which one is empty.
    #[inline(always)]
    fn or(self, other: Self) -> Self {
        Self { enter: self.enter.min(other.enter), leave: self.leave.max(other.leave) }
    }

    /// Returns the first position beyond `near` on the surface, or infinity.
    #[inline(always)]
    pub fn first(self, near: L) -> L {
        let t = near.less(self.enter).select(self.enter, self.leave);
        let is_hit = self.enter.at_most(self.leave).both(near.less(t));
        is_hit.select(t, L::of(f64::INFINITY))
    }
}

/// Returns the intervals of rays inside a convex shape of given sizes; empty for a mesh.
#[inline(always)]
pub(super) fn span<L: RayLanes>(
    shape: &Shape,
    sizes: [L::Scalar; 3],
    from: Vector<L>,
    along: Vector<L>,
) -> Span<L> {
    let size = splat::<L>(sizes);
    match shape {
        Shape::Ellipsoid { .. } => ball(from.times(size), along.times(size), L::of(1.0)),
        Shape::Capsule { .. } => capsule(from, along, size.x, size.y),
        Shape::Cylinder { .. } => tube(from, along, size.x).and(slab(from.z, along.z, size.y)),
        Shape::Box { .. } => {
            let sides = slab(from.x, along.x, size.x).and(slab(from.y, along.y, size.y));
            sides.and(slab(from.z, along.z, size.z))
        }
        Shape::Plane { .. } => plane(from, along, [size.x, size.y]),
        Shape::Mesh(_) => Span { enter: L::of(f64::INFINITY), leave: L::of(f64::NEG_INFINITY) },
    }
}

/// Returns a number whose inverse does not overflow.
#[inline(always)]
pub(super) fn nudged<L: RayLanes>(x: L) -> L {
    x.abs().less(L::of(1e-20)).select(L::of(1e-20), x)
}

#[inline(always)]
fn ball<L: RayLanes>(from: Vector<L>, along: Vector<L>, radius: L) -> Span<L> {
    let a = along.dot(along);
    let middle = -(from.dot(along) / a);
    // Evaluated at the position closest to the centre, where nothing cancels.
    let closest = from + along * middle;
    let room = radius * radius - closest.dot(closest);
    let half = (room.max(L::of(0.0)) / a).sqrt();
    let inside = L::of(0.0).at_most(room);
    Span { enter: middle - half, leave: middle + half }.where_true(inside)
}

/// Intersects an infinite cylinder along z.
#[inline(always)]
fn tube<L: RayLanes>(from: Vector<L>, along: Vector<L>, radius: L) -> Span<L> {
    let a = (along.x * along.x + along.y * along.y).max(L::of(1e-20));
    let middle = -((from.x * along.x + from.y * along.y) / a);
    let (x, y) = (from.x + along.x * middle, from.y + along.y * middle);
    let room = radius * radius - (x * x + y * y);
    let half = (room.max(L::of(0.0)) / a).sqrt();
    let inside = L::of(0.0).at_most(room);
    Span { enter: middle - half, leave: middle + half }.where_true(inside)
}

#[inline(always)]
fn slab<L: RayLanes>(from: L, along: L, half: L) -> Span<L> {
    let by = L::of(1.0) / nudged(along);
    let (one, two) = ((-half - from) * by, (half - from) * by);
    Span { enter: one.min(two), leave: one.max(two) }
}

#[inline(always)]
fn capsule<L: RayLanes>(from: Vector<L>, along: Vector<L>, radius: L, half: L) -> Span<L> {
    let wall = tube(from, along, radius).and(slab(from.z, along.z, half));
    let wall = wall.where_true(wall.enter.at_most(wall.leave));
    let top = Vector { z: from.z - half, ..from };
    let bottom = Vector { z: from.z + half, ..from };
    wall.or(ball(top, along, radius)).or(ball(bottom, along, radius))
}

#[inline(always)]
fn plane<L: RayLanes>(from: Vector<L>, along: Vector<L>, half_size: [L; 2]) -> Span<L> {
    let t = -(from.z / nudged(along.z));
    let (x, y) = (from.x + along.x * t, from.y + along.y * t);
    let inside = x.abs().at_most(half_size[0]).both(y.abs().at_most(half_size[1]));
    Span { enter: t, leave: t }.where_true(inside)
}
