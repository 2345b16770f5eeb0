//! Surface properties at the hits of rays: the normal, and the texture coordinates.

use super::paint::Paint;
use crate::render::mesh::{Hit, Mesh};
use crate::render::scene::Visual;
use crate::render::shape::Shape;
use crate::render::vector::Vector;
use crate::simd::{EIGHT, RayLanes, Single};

/// Normals in the visual's frame, texture coordinates, and colours of the vertices.
pub(in crate::render) struct Surface<L> {
    pub normal: Vector<L>,
    pub place: [L; 2],
    pub tint: Option<Vector<L>>,
}

/// Computes a visual's surface at positions in its own frame, for the rays in `lanes`.
#[inline(always)]
pub(in crate::render) fn surface<L: Single>(
    shape: &Shape,
    at: Vector<L>,
    hit: &Hit<L>,
    lanes: u32,
) -> Surface<L> {
    match shape {
        Shape::Ellipsoid { radii } => plain(ellipsoid(at, *radii)),
        Shape::Capsule { radius, half_length } => plain(capsule(at, *radius, *half_length)),
        Shape::Cylinder { radius, half_length } => plain(cylinder(at, *radius, *half_length)),
        Shape::Box { half_size } => plain(box_faces(at, *half_size)),
        Shape::Plane { half_size: [x, y] } => {
            let normal = Vector { x: L::of(0.0), y: L::of(0.0), z: L::of(1.0) };
            plain((normal, [share(at.x, *x), share(-at.y, *y)]))
        }
        Shape::Mesh(mesh) => corners(mesh, hit, lanes),
    }
}

#[inline(always)]
fn plain<L>((normal, place): (Vector<L>, [L; 2])) -> Surface<L> {
    Surface { normal, place, tint: None }
}

/// Returns the colours of a surface, including those of the texture and the vertices.
#[inline(always)]
pub(in crate::render) fn albedo<L: Single>(
    paint: &Paint,
    surface: &Surface<L>,
    lanes: u32,
) -> Vector<L> {
    let color = crate::render::vector::splat::<L>(paint.color);
    let color = if let Some(tint) = surface.tint { color.times(tint) } else { color };
    let Some(texture) = &paint.texture else { return color };
    let [u, v] = surface.place;
    let place = [u * L::splat(paint.repeat[0]), v * L::splat(paint.repeat[1])];
    color.times(texture.at(place, lanes))
}

/// Converts a coordinate to a share of a side, limited to 0 to 1.
#[inline(always)]
fn share<L: RayLanes>(x: L, half: f64) -> L {
    (x * L::of(0.5 / half) + L::of(0.5)).max(L::of(0.0)).min(L::of(1.0))
}

#[inline(always)]
fn ellipsoid<L: RayLanes>(at: Vector<L>, [x, y, z]: [f64; 3]) -> (Vector<L>, [L; 2]) {
    let by = Vector { x: L::of(1.0 / x), y: L::of(1.0 / y), z: L::of(1.0 / z) };
    let on_ball = at.times(by);
    let across = (on_ball.x * on_ball.x + on_ball.y * on_ball.y).sqrt();
    let down = angle(across, on_ball.z) * L::of(1.0 / std::f64::consts::PI);
    (on_ball.times(by).unit(), [around(on_ball.x, on_ball.y), down])
}

#[inline(always)]
fn capsule<L: RayLanes>(at: Vector<L>, radius: f64, half: f64) -> (Vector<L>, [L; 2]) {
    let axis = at.z.max(L::of(-half)).min(L::of(half));
    let normal = Vector { z: at.z - axis, ..at }.unit();
    (normal, [around(at.x, at.y), share(-at.z, half + radius)])
}

#[inline(always)]
fn cylinder<L: RayLanes>(at: Vector<L>, radius: f64, half: f64) -> (Vector<L>, [L; 2]) {
    let from_wall = L::of(radius) - (at.x * at.x + at.y * at.y).sqrt();
    let on_wall = from_wall.less(L::of(half) - at.z.abs());
    let zero = L::of(0.0);
    let wall = Vector { z: zero, ..at }.unit();
    let end = Vector { x: zero, y: zero, z: sign(at.z) };
    let place = [
        on_wall.select(around(at.x, at.y), share(at.x, radius)),
        on_wall.select(share(-at.z, half), share(-at.y, radius)),
    ];
    (Vector::select(on_wall, wall, end), place)
}

#[inline(always)]
fn box_faces<L: RayLanes>(at: Vector<L>, [x, y, z]: [f64; 3]) -> (Vector<L>, [L; 2]) {
    let gap =
        Vector { x: L::of(x) - at.x.abs(), y: L::of(y) - at.y.abs(), z: L::of(z) - at.z.abs() };
    let (zero, one) = (L::of(0.0), L::of(1.0));
    let on_x = gap.x.less(gap.y.min(gap.z));
    let on_y = gap.y.less(gap.z);
    let y_or_z = Vector { x: zero, y: on_y.select(one, zero), z: on_y.select(zero, one) };
    let axis = Vector::select(on_x, Vector { x: one, y: zero, z: zero }, y_or_z);
    let signs = Vector { x: sign(at.x), y: sign(at.y), z: sign(at.z) };
    let (u, v, w) = (share(at.x, x), share(at.y, y), share(-at.z, z));
    let place = [on_x.select(v, u), on_x.select(w, on_y.select(w, one - v))];
    (axis.times(signs), place)
}

#[inline(always)]
fn sign<L: RayLanes>(x: L) -> L {
    x.less(L::of(0.0)).select(L::of(-1.0), L::of(1.0))
}

/// Returns the azimuth of a position around z, from 0 at -x over 1/4 at -y to 1.
#[inline(always)]
fn around<L: RayLanes>(x: L, y: L) -> L {
    angle(y, x) * L::of(0.5 / std::f64::consts::PI) + L::of(0.5)
}

/// Returns the angle of (x, y) from the x axis, to about 1e-5.
///
/// Source: Abramowitz and Stegun, *Handbook of Mathematical Functions* (1964), 4.4.49.
#[inline(always)]
fn angle<L: RayLanes>(y: L, x: L) -> L {
    use std::f64::consts::{FRAC_PI_2, PI};
    let (across, up) = (x.abs(), y.abs());
    let a = across.min(up) / across.max(up).max(L::of(1e-30));
    let s = a * a;
    let mut sum = L::of(0.020_835_1);
    for term in [-0.085_133_0, 0.180_141_0, -0.330_299_5, 0.999_866_0] {
        sum = sum * s + L::of(term);
    }
    let first = a * sum;
    let quarter = across.less(up).select(L::of(FRAC_PI_2) - first, first);
    let half = x.less(L::of(0.0)).select(L::of(PI) - quarter, quarter);
    y.less(L::of(0.0)).select(-half, half)
}

#[inline(always)]
fn corners<L: Single>(mesh: &Mesh, hit: &Hit<L>, lanes: u32) -> Surface<L> {
    let (triangle, one, two) = (hit.triangle.write(), hit.shares[0].write(), hit.shares[1].write());
    let (mut normal, mut place, mut tint) =
        ([[0.0; EIGHT]; 3], [[0.0; EIGHT]; 2], [[1.0; EIGHT]; 3]);
    for lane in (0..EIGHT).filter(|lane| lanes >> lane & 1 == 1) {
        let corners = mesh.corners(triangle[lane] as usize);
        let shares = [1.0 - one[lane] - two[lane], one[lane], two[lane]];
        mix(&corners.normals, shares, &mut normal, lane);
        mix(&corners.texture, shares, &mut place, lane);
        if mesh.has_colors() {
            mix(&corners.colors, shares, &mut tint, lane);
        }
    }
    Surface {
        normal: vector::<L>(normal).unit(),
        place: [L::read(place[0]), L::read(place[1])],
        tint: if mesh.has_colors() { Some(vector(tint)) } else { None },
    }
}

#[inline(always)]
fn vector<L: Single>([x, y, z]: [[f32; EIGHT]; 3]) -> Vector<L> {
    Vector { x: L::read(x), y: L::read(y), z: L::read(z) }
}

#[inline(always)]
fn mix<const K: usize>(
    corners: &[[f32; K]; 3],
    shares: [f32; 3],
    into: &mut [[f32; EIGHT]; K],
    lane: usize,
) {
    for k in 0..K {
        into[k][lane] =
            corners[0][k] * shares[0] + corners[1][k] * shares[1] + corners[2][k] * shares[2];
    }
}

/// Surface properties at the hits of eight rays: for each, those of its visual.
#[derive(Clone, Copy)]
pub(in crate::render) struct Seen<L> {
    /// In the lens's frame, towards the lens.
    pub normal: Vector<L>,
    pub albedo: Vector<L>,
    pub gloss: L,
}

/// Combines the surfaces of all visuals that eight rays hit.
#[inline(always)]
pub(in crate::render) fn seen<L: Single>(
    visuals: &[Visual],
    moment: &crate::render::placed::Moment<f32>,
    ray: Vector<L>,
    hit: &Hit<L>,
) -> Seen<L> {
    let zero = L::of(0.0);
    let nothing = Vector { x: zero, y: zero, z: zero };
    let mut out = Seen { normal: nothing, albedo: nothing, gloss: zero };
    let numbers = hit.visual.write();
    let mut open = zero.at_most(hit.visual).bits();
    while open != 0 {
        let number = numbers[open.trailing_zeros() as usize];
        let same = hit.visual.at_most(L::splat(number)).both(L::splat(number).at_most(hit.visual));
        let lanes = same.bits();
        open &= !lanes;
        let (visual, placed) = (&visuals[number as usize], &moment.visuals[number as usize]);
        let at = (ray * hit.t).turned(&placed.visual_from_lens)
            + crate::render::vector::splat(placed.lens_in_visual);
        let surface = surface(&visual.shape, at, hit, lanes);
        let albedo = albedo(&visual.paint, &surface, lanes);
        let normal = surface.normal.turned_back(&placed.visual_from_lens);
        out.normal = Vector::select(same, normal, out.normal);
        out.albedo = Vector::select(same, albedo, out.albedo);
        out.gloss = same.select(L::splat(visual.paint.gloss), out.gloss);
    }
    let away = zero.less(out.normal.dot(ray));
    out.normal = Vector::select(away, -out.normal, out.normal);
    out
}
