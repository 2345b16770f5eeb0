//! Triangles in a tree of boxes, which packets of rays traverse together.

use obvhs::{BvhBuildParams, bvh2::builder::build_bvh2_from_tris, triangle::Triangle};
use std::time::Duration;

use super::look::light::linear;
use super::shape::nudged;
use super::vector::{Vector, splat_single};
use super::{RenderError, corner_normals};
use crate::changing::changeable;
use crate::simd::{RayLanes, Scalar};

/// Most boxes on the traversal stack: the depth of the tree.
const DEPTH: usize = 128;

/// Distance by which a ray may miss a triangle, relative to its sides, so that no ray slips between
/// two.
const MARGIN: f64 = 1e-6;

/// A box that contains two boxes, or triangles if `count` is not zero.
#[derive(Debug, Clone, Copy)]
struct Node {
    low: [f32; 3],
    first: u32,
    high: [f32; 3],
    count: u32,
}

/// Surface attributes at the corners of one triangle.
#[derive(Debug, Clone)]
pub(super) struct Corners {
    pub normals: [[f32; 3]; 3],
    pub texture: [[f32; 2]; 3],
    pub colors: [[f32; 3]; 3],
}

/// Optional attributes of each vertex.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct Details {
    /// Texture coordinates: (0, 0) is the corner of the first pixel, (1, 1) that of the last.
    pub texture_coordinates: Option<Vec<[f64; 2]>>,
    /// Colour as sRGB.
    pub colors: Option<Vec<[u8; 3]>>,
}

changeable!(Details);

/// A surface of triangles that is visible from both sides.
#[derive(Debug, Clone)]
pub(super) struct Mesh {
    nodes: Vec<Node>,
    triangles: Vec<[[f32; 3]; 3]>,
    corners: Vec<Corners>,
    has_colors: bool,
}

/// The first hits of rays.
#[derive(Clone, Copy)]
pub(super) struct Hit<L> {
    pub t: L,
    pub visual: L,
    pub triangle: L,
    /// Weights of the second and the third corner.
    pub shares: [L; 2],
}

impl Mesh {
    pub fn new(
        vertices: &[[f64; 3]],
        faces: &[[usize; 3]],
        details: &Details,
    ) -> Result<Self, RenderError> {
        check(vertices, faces, details)?;
        let place = |i: usize| vertices[i].map(|x| x as f32);
        let vector = |i: usize| place(i).into();
        let given: Vec<Triangle> = faces
            .iter()
            .map(|f| Triangle { v0: vector(f[0]), v1: vector(f[1]), v2: vector(f[2]) })
            .collect();
        // Triangles are not split, so that each is tested once.
        let settings = BvhBuildParams { pre_split: false, ..BvhBuildParams::medium_build() };
        let tree = build_bvh2_from_tris(&given, settings, &mut Duration::default());
        let nodes: Vec<Node> = tree
            .nodes
            .iter()
            .map(|node| {
                let (low, high) = (node.aabb.min.to_array(), node.aabb.max.to_array());
                let wide = |x: f32| 1e-6 * x.abs() + 1e-9;
                Node {
                    low: low.map(|x| x - wide(x)),
                    first: node.first_index,
                    high: high.map(|x| x + wide(x)),
                    count: node.prim_count,
                }
            })
            .collect();
        if depth(&nodes) >= DEPTH {
            return Err(RenderError::Tangled { faces: faces.len() });
        }
        let order: Vec<usize> = tree.primitive_indices.iter().map(|&i| i as usize).collect();
        let normals = corner_normals(vertices, faces);
        Ok(Self {
            nodes,
            triangles: order.iter().map(|&i| faces[i].map(place)).collect(),
            corners: order.iter().map(|&i| corners(faces[i], normals[i], details)).collect(),
            has_colors: details.colors.is_some(),
        })
    }

    /// Returns middle and half sizes of a box around it.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in self.triangles.iter().flatten() {
            for axis in 0..3 {
                low[axis] = low[axis].min(f64::from(corner[axis]));
                high[axis] = high[axis].max(f64::from(corner[axis]));
            }
        }
        (
            std::array::from_fn(|i| 0.5 * (low[i] + high[i])),
            std::array::from_fn(|i| 0.5 * (high[i] - low[i])),
        )
    }

    pub fn corners(&self, triangle: usize) -> &Corners {
        &self.corners[triangle]
    }

    pub fn has_colors(&self) -> bool {
        self.has_colors
    }

    /// Finds hits before `hit.t`, for rays that start beyond `near`.
    #[inline(always)]
    pub fn intersect<L: RayLanes>(
        &self,
        from: Vector<L>,
        along: Vector<L>,
        (near, visual): (L, L),
        hit: &mut Hit<L>,
    ) {
        let one = L::of(1.0);
        let by =
            Vector { x: one / nudged(along.x), y: one / nudged(along.y), z: one / nudged(along.z) };
        let mut waiting = [0_u32; DEPTH];
        let mut count = 0;
        let mut at = 0_usize;
        if self.enters(0, from, by, hit.t).0 == 0 {
            return;
        }
        loop {
            let node = &self.nodes[at];
            let first = node.first as usize;
            if node.count > 0 {
                for triangle in first..first + node.count as usize {
                    self.touch(triangle, (from, along), (near, visual), hit);
                }
            } else {
                let (left, left_at) = self.enters(first, from, by, hit.t);
                let (right, right_at) = self.enters(first + 1, from, by, hit.t);
                match (left != 0, right != 0) {
                    (true, true) => {
                        let lane = (left & right).trailing_zeros().min(7) as usize;
                        let swap = right_at.write()[lane].to_f64() < left_at.write()[lane].to_f64();
                        let (next, later) =
                            if swap { (first + 1, first) } else { (first, first + 1) };
                        waiting[count] = later as u32;
                        count += 1;
                        at = next;
                        continue;
                    }
                    (true, false) => {
                        at = first;
                        continue;
                    }
                    (false, true) => {
                        at = first + 1;
                        continue;
                    }
                    (false, false) => {}
                }
            }
            if count == 0 {
                return;
            }
            count -= 1;
            at = waiting[count] as usize;
        }
    }

    /// Returns which rays pass through a box before `until`, and where they enter it.
    #[inline(always)]
    fn enters<L: RayLanes>(
        &self,
        node: usize,
        from: Vector<L>,
        by: Vector<L>,
        until: L,
    ) -> (u32, L) {
        let node = &self.nodes[node];
        let low = (splat_single::<L>(node.low) - from).times(by);
        let high = (splat_single::<L>(node.high) - from).times(by);
        let ((x0, x1), (y0, y1), (z0, z1)) = ((low.x, high.x), (low.y, high.y), (low.z, high.z));
        let enter = x0.min(x1).max(y0.min(y1)).max(z0.min(z1)).max(L::of(0.0));
        let leave = x0.max(x1).min(y0.max(y1)).min(z0.max(z1)).min(until);
        (enter.at_most(leave).bits(), enter)
    }

    /// Records a triangle where it is the first hit.
    ///
    /// Source: Möller and Trumbore, *Fast, minimum storage ray-triangle intersection* (1997).
    #[inline(always)]
    fn touch<L: RayLanes>(
        &self,
        triangle: usize,
        (from, along): (Vector<L>, Vector<L>),
        (near, visual): (L, L),
        hit: &mut Hit<L>,
    ) {
        let [a, b, c] = self.triangles[triangle];
        let corner = splat_single::<L>(a);
        let (one, two) = (splat_single::<L>(b) - corner, splat_single::<L>(c) - corner);
        let across = along.cross(two);
        let by = L::of(1.0) / one.dot(across);
        let gap = from - corner;
        let u = gap.dot(across) * by;
        let turned = gap.cross(one);
        let v = along.dot(turned) * by;
        let t = two.dot(turned) * by;
        let inside = L::of(-MARGIN)
            .at_most(u.min(v))
            .both((u + v).at_most(L::of(1.0 + MARGIN)))
            .both(near.less(t))
            .both(t.less(hit.t));
        if inside.bits() == 0 {
            return;
        }
        hit.t = inside.select(t, hit.t);
        hit.visual = inside.select(visual, hit.visual);
        hit.triangle = inside.select(L::of(triangle as f64), hit.triangle);
        hit.shares = [inside.select(u, hit.shares[0]), inside.select(v, hit.shares[1])];
    }
}

fn corners(face: [usize; 3], normals: [[f32; 3]; 3], details: &Details) -> Corners {
    let texture = |i: usize| details.texture_coordinates.as_ref().map_or([0.0; 2], |t| t[i]);
    let color = |i: usize| details.colors.as_ref().map_or([255; 3], |c| c[i]);
    Corners {
        normals,
        texture: face.map(|i| texture(i).map(|x| x as f32)),
        colors: face.map(|i| linear(color(i))),
    }
}

fn depth(nodes: &[Node]) -> usize {
    let (mut waiting, mut deepest) = (vec![(0, 1)], 0);
    while let Some((at, depth)) = waiting.pop() {
        deepest = deepest.max(depth);
        let node: &Node = &nodes[at];
        if node.count == 0 {
            let first = node.first as usize;
            waiting.extend([(first, depth + 1), (first + 1, depth + 1)]);
        }
    }
    deepest
}

/// Most triangles of a mesh: their indices are stored in single precision.
const MAX_FACES: usize = 1 << 24;

fn check(
    vertices: &[[f64; 3]],
    faces: &[[usize; 3]],
    details: &Details,
) -> Result<(), RenderError> {
    if faces.is_empty() || faces.len() > MAX_FACES {
        return Err(RenderError::Faces { given: faces.len(), max: MAX_FACES });
    }
    let wild = |v: &[f64; 3]| !v.iter().all(|x| x.is_finite() && x.abs() <= super::MAX_LENGTH);
    if let Some(index) = vertices.iter().position(wild) {
        return Err(RenderError::Corner { index, corner: vertices[index] });
    }
    let corners = vertices.len();
    if let Some((index, face)) =
        faces.iter().enumerate().find(|(_, f)| f.iter().any(|&i| i >= corners))
    {
        return Err(RenderError::Face { index, face: *face, corners });
    }
    let lengths = [
        ("texture_coordinates", details.texture_coordinates.as_ref().map(Vec::len)),
        ("colors", details.colors.as_ref().map(Vec::len)),
    ];
    for (what, given) in lengths {
        if let Some(given) = given.filter(|&n| n != corners) {
            return Err(RenderError::Details { what, given, corners });
        }
    }
    let places = details.texture_coordinates.iter().flatten().flatten();
    match places.into_iter().find(|x| x.is_nan() || x.abs() > 1e4) {
        Some(&value) => Err(RenderError::TexturePlace(value)),
        None => Ok(()),
    }
}
