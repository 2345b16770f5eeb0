//! What rays meet first, and whether anything stands between a place and the lamp.

use super::lanes::Lanes;
use super::mesh::Hit;
use super::placed::Moment;
use super::shape::{Shape, span};
use super::stage::Thing;
use super::vector::{Vector, splat};

/// Marks rays that meet nothing.
pub(super) const NOTHING: f64 = -1.0;

/// Things nearer to the lens than this, as a multiple of a ray's direction, are not seen.
const NEAR: f64 = 1e-4;

/// Gives what rays from the lens meet first of some things.
#[inline(always)]
pub(super) fn nearest<L: Lanes>(
    things: &[Thing],
    moment: &Moment<L::Scalar>,
    some: &[usize],
    ray: Vector<L>,
) -> Hit<L> {
    let zero = L::of(0.0);
    let mut hit =
        Hit { t: L::of(f64::INFINITY), thing: L::of(NOTHING), triangle: zero, shares: [zero; 2] };
    let near = L::of(NEAR);
    for &index in some {
        let placed = &moment.things[index];
        let from = splat(placed.lens_in_thing);
        let along = ray.turned(&placed.thing_from_lens);
        let thing = L::of(index as f64);
        if let Shape::Mesh(mesh) = &things[index].shape {
            mesh.meet(from, along, (near, thing), &mut hit);
        } else {
            let t = span(&things[index].shape, placed.sizes, from, along).first(near);
            let closer = t.less(hit.t);
            hit.t = closer.select(t, hit.t);
            hit.thing = closer.select(thing, hit.thing);
        }
    }
    hit
}

/// Gives where something stands between places, in the lens's frame, and the lamp; `open` says
/// for which places that matters.
#[inline(always)]
pub(super) fn shaded<L: Lanes>(
    things: &[Thing],
    moment: &Moment<L::Scalar>,
    some: &[usize],
    (place, open): (Vector<L>, L),
) -> L {
    let (zero, far) = (L::of(0.0), L::of(f64::INFINITY));
    let mut hit = Hit { t: open.select(far, zero), thing: zero, triangle: zero, shares: [zero; 2] };
    for &index in some {
        let placed = &moment.things[index];
        let from = place.turned(&placed.thing_from_lens) + splat(placed.lens_in_thing);
        let along = splat(placed.toward);
        if let Shape::Mesh(mesh) = &things[index].shape {
            mesh.meet(from, along, (zero, zero), &mut hit);
        } else {
            let t = span(&things[index].shape, placed.sizes, from, along).first(zero);
            hit.t = t.less(hit.t).select(t, hit.t);
        }
        if hit.t.less(far).bits() == 0xff {
            break;
        }
    }
    hit.t.less(far)
}
