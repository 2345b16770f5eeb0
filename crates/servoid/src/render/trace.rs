//! First hits of rays, and shadows.

use super::mesh::Hit;
use super::placed::Moment;
use super::scene::Visual;
use super::shape::{Shape, span};
use super::vector::{Vector, splat};
use crate::simd::RayLanes;

/// Marks rays without a hit.
pub(super) const NOTHING: f64 = -1.0;

/// Visuals nearer to the lens than this, as a multiple of a ray's direction, are ignored.
const NEAR: f64 = 1e-4;

/// Returns the first hits of rays from the lens among some visuals.
#[inline(always)]
pub(super) fn nearest<L: RayLanes>(
    visuals: &[Visual],
    moment: &Moment<L::Scalar>,
    some: &[usize],
    ray: Vector<L>,
) -> Hit<L> {
    let zero = L::of(0.0);
    let mut hit =
        Hit { t: L::of(f64::INFINITY), visual: L::of(NOTHING), triangle: zero, shares: [zero; 2] };
    let near = L::of(NEAR);
    for &index in some {
        let placed = &moment.visuals[index];
        let from = splat(placed.lens_in_visual);
        let along = ray.turned(&placed.visual_from_lens);
        let visual = L::of(index as f64);
        if let Shape::Mesh(mesh) = &visuals[index].shape {
            mesh.intersect(from, along, (near, visual), &mut hit);
        } else {
            let t = span(&visuals[index].shape, placed.sizes, from, along).first(near);
            let closer = t.less(hit.t);
            hit.t = closer.select(t, hit.t);
            hit.visual = closer.select(visual, hit.visual);
        }
    }
    hit
}

/// Returns where something lies between positions, in the lens's frame, and the lamp; `open` marks
/// the positions for which that matters.
#[inline(always)]
pub(super) fn shaded<L: RayLanes>(
    visuals: &[Visual],
    moment: &Moment<L::Scalar>,
    some: &[usize],
    (place, open): (Vector<L>, L),
) -> L {
    let (zero, far) = (L::of(0.0), L::of(f64::INFINITY));
    let mut hit =
        Hit { t: open.select(far, zero), visual: zero, triangle: zero, shares: [zero; 2] };
    for &index in some {
        let placed = &moment.visuals[index];
        let from = place.turned(&placed.visual_from_lens) + splat(placed.lens_in_visual);
        let along = splat(placed.toward);
        if let Shape::Mesh(mesh) = &visuals[index].shape {
            mesh.intersect(from, along, (zero, zero), &mut hit);
        } else {
            let t = span(&visuals[index].shape, placed.sizes, from, along).first(zero);
            hit.t = t.less(hit.t).select(t, hit.t);
        }
        if hit.t.less(far).bits() == 0xff {
            break;
        }
    }
    hit.t.less(far)
}
