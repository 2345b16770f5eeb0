//! Triangles that need not be closed or consistently oriented, and the winding numbers around them.

use crate::parallel::*;
use nalgebra::{Matrix3, Vector3};

use super::ShapeError;
use crate::pose::even_direction;

/// Triangles in a tree of balls.
#[derive(Debug, Clone)]
pub struct Soup {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[Vector3<f64>; 3]>,
    nodes: Vec<Node>,
}

/// A ball around the triangles from `first` on, or around the two balls at `children`.
#[derive(Debug, Clone)]
struct Node {
    center: Vector3<f64>,
    radius: f64,
    first: usize,
    count: usize,
    children: Option<usize>,
    /// Sum of the triangles' area vectors, and its outer products with the offset of each from the
    /// centre.
    dipole: Vector3<f64>,
    spread: Matrix3<f64>,
}

/// Most triangles in a ball that is not split.
const LEAF: usize = 8;
/// Distance from a ball's centre, in radii, beyond which its triangles are summed together: to an
/// accuracy of about a hundredth.
const FAR: f64 = 3.0;
/// Directions in which visibility of the sky is tested, and faces of a patch from which it is.
const DIRECTIONS: usize = 24;
const LOOKS: usize = 48;
/// Distance from a face at which a ray starts, relative to the size of everything.
const BESIDE: f64 = 1e-6;

impl Soup {
    /// Makes a soup of vertices, in metres, and triangles; the order of a triangle's vertices
    /// defines its outside.
    ///
    /// # Errors
    /// If a number is not finite, or a triangle refers to a vertex that does not exist.
    pub fn new(vertices: &[[f64; 3]], faces: &[[usize; 3]]) -> Result<Self, ShapeError> {
        if let Some(index) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(ShapeError::Corner { index, corner: vertices[index] });
        }
        if let Some(&face) = faces.iter().find(|face| face.iter().any(|&i| i >= vertices.len())) {
            return Err(ShapeError::Face { face, corners: vertices.len() });
        }
        let vertices: Vec<Vector3<f64>> = vertices.iter().map(|&v| v.into()).collect();
        let mut triangles: Vec<_> = faces.iter().map(|face| face.map(|i| vertices[i])).collect();
        let mut nodes = Vec::new();
        if !triangles.is_empty() {
            nodes.push(Node::around(&triangles, 0));
            split(&mut triangles, 0, &mut nodes);
        }
        Ok(Self { vertices, triangles, nodes })
    }

    /// Returns the winding number of the triangles around a point: 1 inside a closed surface and 0
    /// outside, and a value in between where it has holes.
    ///
    /// Source: Jacobson, Kavan, Sorkine-Hornung, *Robust inside-outside segmentation using
    /// generalized winding numbers* (2013); far triangles together as in Barill and others, *Fast
    /// winding numbers for soups and clouds* (2018).
    #[must_use]
    pub fn winding(&self, point: &Vector3<f64>) -> f64 {
        let mut sum = 0.0;
        let mut waiting = Vec::with_capacity(64);
        waiting.extend(self.nodes.first());
        while let Some(node) = waiting.pop() {
            let away = node.center - point;
            let far = away.norm();
            if far > FAR * node.radius {
                sum += node.seen_from_afar(&away, far);
            } else if let Some(children) = node.children {
                waiting.extend(&self.nodes[children..children + 2]);
            } else {
                let own = &self.triangles[node.first..node.first + node.count];
                sum += own.iter().map(|triangle| solid_angle(triangle, point)).sum::<f64>();
            }
        }
        sum / (4.0 * std::f64::consts::PI)
    }

    /// Returns the winding numbers around many points.
    #[must_use]
    pub fn windings(&self, points: &[Vector3<f64>]) -> Vec<f64> {
        points.par_iter().map(|point| self.winding(point)).collect()
    }

    /// Returns whether a ray from a point in a direction hits nothing.
    fn is_clear(&self, from: &Vector3<f64>, along: &Vector3<f64>) -> bool {
        let mut waiting = Vec::with_capacity(64);
        waiting.extend(self.nodes.first());
        while let Some(node) = waiting.pop() {
            let away = node.center - from;
            let ahead = away.dot(along);
            let beside = away.norm_squared() - ahead * ahead;
            let wide = node.radius * node.radius;
            if beside > wide || (ahead < 0.0 && away.norm_squared() > wide) {
                continue;
            }
            if let Some(children) = node.children {
                waiting.extend(&self.nodes[children..children + 2]);
            } else {
                let own = &self.triangles[node.first..node.first + node.count];
                if own.iter().any(|triangle| intersects(triangle, from, along)) {
                    return false;
                }
            }
        }
        true
    }

    /// Returns, from -1 to 1, how much more of the sky the fronts of some triangles see than their
    /// backs.
    ///
    /// # Errors
    /// If a triangle refers to a vertex that does not exist.
    ///
    /// Source: Takayama, Jacobson, Kavan, Sorkine-Hornung, *A simple method for correcting facet
    /// orientations in polygon meshes based on ray casting* (2014).
    pub fn openness(&self, faces: &[[usize; 3]]) -> Result<f64, ShapeError> {
        let corners = self.vertices.len();
        if let Some(&face) = faces.iter().find(|face| face.iter().any(|&i| i >= corners)) {
            return Err(ShapeError::Face { face, corners });
        }
        let step = faces.len().div_ceil(LOOKS).max(1);
        let chosen: Vec<_> = faces.iter().step_by(step).collect();
        let looks: Vec<(f64, f64)> = chosen.par_iter().map(|face| self.balance(face)).collect();
        let (sum, all) = looks.iter().fold((0.0, 0.0), |(s, a), (x, y)| (s + x, a + y));
        // The directions are even, but their numbers in front of and behind each face differ.
        Ok(if all > 0.0 { (sum / all).clamp(-1.0, 1.0) } else { 0.0 })
    }

    /// Weighs by a triangle's area how much more of the sky its front sees; also returns the area.
    fn balance(&self, face: &[usize; 3]) -> (f64, f64) {
        let [a, b, c] = face.map(|i| self.vertices[i]);
        let across = (b - a).cross(&(c - a));
        let area = across.norm();
        if area == 0.0 {
            return (0.0, 0.0);
        }
        let (middle, normal) = ((a + b + c) / 3.0, across / area);
        let beside = BESIDE * self.nodes.first().map_or(0.0, |node| node.radius);
        let seen = |index: usize| {
            let along = even_direction(index, (2 * index + 1) as f64 / DIRECTIONS as f64 - 1.0);
            let front = along.dot(&normal).signum();
            let clear = self.is_clear(&(middle + normal * (front * beside)), &along);
            if clear { front } else { 0.0 }
        };
        let balance: f64 = (0..DIRECTIONS).map(seen).sum();
        (area * balance * 2.0 / DIRECTIONS as f64, area)
    }

    pub(super) fn triangles(&self) -> &[[Vector3<f64>; 3]] {
        &self.triangles
    }

    /// Returns the bounding box of all triangles, if there are any.
    pub(super) fn bounds(&self) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let mut corners = self.triangles.iter().flatten();
        let first = *corners.next()?;
        Some(corners.fold((first, first), |(low, high), v| (low.inf(v), high.sup(v))))
    }
}

impl Node {
    fn around(triangles: &[[Vector3<f64>; 3]], first: usize) -> Self {
        let (mut total, mut moment) = (0.0, Vector3::zeros());
        for [a, b, c] in triangles {
            // A tiny weight, so that triangles without area have a middle, too.
            let area = (b - a).cross(&(c - a)).norm() + f64::MIN_POSITIVE.sqrt();
            total += area;
            moment += (a + b + c) * (area / 3.0);
        }
        let center = moment / total;
        let (mut dipole, mut spread, mut radius) = (Vector3::zeros(), Matrix3::zeros(), 0.0_f64);
        for [a, b, c] in triangles {
            let normal = 0.5 * (b - a).cross(&(c - a));
            dipole += normal;
            spread += ((a + b + c) / 3.0 - center) * normal.transpose();
            radius = [a, b, c].iter().map(|p| (*p - center).norm()).fold(radius, f64::max);
        }
        Self { center, radius, first, count: triangles.len(), children: None, dipole, spread }
    }

    /// Returns the solid angle of all triangles by two terms of a series; `away` is the offset to
    /// the centre.
    fn seen_from_afar(&self, away: &Vector3<f64>, far: f64) -> f64 {
        let cube = far.powi(3);
        let slope = self.spread.trace() - 3.0 * away.dot(&(self.spread * away)) / (far * far);
        (away.dot(&self.dipole) + slope) / cube
    }
}

/// Splits a node at the median of its triangles along its longest side, and its halves likewise.
fn split(triangles: &mut [[Vector3<f64>; 3]], at: usize, nodes: &mut Vec<Node>) {
    let mut waiting = vec![at];
    while let Some(at) = waiting.pop() {
        let (first, count) = (nodes[at].first, nodes[at].count);
        if count <= LEAF {
            continue;
        }
        let own = &mut triangles[first..first + count];
        let middle = |[a, b, c]: &[Vector3<f64>; 3]| a + b + c;
        let mut low = middle(&own[0]);
        let mut high = low;
        for triangle in own.iter() {
            (low, high) = (low.inf(&middle(triangle)), high.sup(&middle(triangle)));
        }
        let axis = (high - low).imax();
        let half = count / 2;
        own.select_nth_unstable_by(half, |a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
        let children = nodes.len();
        nodes.push(Node::around(&own[..half], first));
        nodes.push(Node::around(&own[half..], first + half));
        nodes[at].children = Some(children);
        waiting.extend([children, children + 1]);
    }
}

/// Returns the solid angle of a triangle, positive if its back is seen.
///
/// Source: van Oosterom, Strackee, *The solid angle of a plane triangle* (1983).
fn solid_angle([a, b, c]: &[Vector3<f64>; 3], point: &Vector3<f64>) -> f64 {
    let [a, b, c] = [a - point, b - point, c - point];
    let [x, y, z] = [a.norm(), b.norm(), c.norm()];
    let above = a.dot(&b.cross(&c));
    let below = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
    2.0 * libm::atan2(above, below)
}

/// Returns whether a ray hits a triangle.
fn intersects([a, b, c]: &[Vector3<f64>; 3], from: &Vector3<f64>, along: &Vector3<f64>) -> bool {
    let (one, two, gap) = (b - a, c - a, from - a);
    let across = along.cross(&two);
    let by = 1.0 / one.dot(&across);
    let u = gap.dot(&across) * by;
    let turned = gap.cross(&one);
    let v = along.dot(&turned) * by;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && two.dot(&turned) * by > 0.0
}
