use crate::parallel::*;
use nalgebra::{Matrix3, Vector3};

use super::{Grid, Projection, ShapeError};
use crate::pose::Pose;

/// A closed triangle mesh with vertices in counter-clockwise order seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Vector3<f64>>,
    faces: Vec<[usize; 3]>,
    volume: f64,
    centroid: Vector3<f64>,
    /// Mean outer product of the offsets from the centroid.
    spread: Matrix3<f64>,
}

/// Lines along each side of a voxel on which the filled share is measured.
const LINES: usize = 2;

impl Mesh {
    /// Makes a mesh of vertices, in metres, and triangles.
    ///
    /// # Errors
    /// If a number is not finite, a triangle refers to a vertex that does not exist, the surface is
    /// not closed or its volume is not positive.
    pub fn new(vertices: Vec<[f64; 3]>, faces: Vec<[usize; 3]>) -> Result<Self, ShapeError> {
        if let Some(index) = vertices.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            return Err(ShapeError::Corner { index, corner: vertices[index] });
        }
        if let Some(&face) = faces.iter().find(|face| face.iter().any(|&i| i >= vertices.len())) {
            return Err(ShapeError::Face { face, corners: vertices.len() });
        }
        let open = open_edges(&faces);
        if open > 0 {
            return Err(ShapeError::Open { edges: open });
        }
        let vertices: Vec<Vector3<f64>> = vertices.into_iter().map(Into::into).collect();
        let (volume, centroid, spread) = moments(&vertices, &faces);
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(ShapeError::Volume(volume));
        }
        Ok(Self { vertices, faces, volume, centroid, spread })
    }

    /// Returns the vertices.
    #[must_use]
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// Returns the volume in cubic metres.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Returns the frame at the centroid whose x lies along the longest principal axis and y along
    /// the next, each pointing to the side that reaches farther.
    #[must_use]
    pub fn principal_frame(&self) -> Pose {
        Pose::principal(self.centroid, &self.spread, |axis| {
            let heights = self.vertices.iter().map(|v| (v - self.centroid).dot(axis));
            let (low, high) = heights.fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
            high + low
        })
    }

    /// Returns the radius of the ball with the same mean squared distance from its centroid as the
    /// solid.
    #[must_use]
    pub fn extent(&self) -> f64 {
        (self.spread.trace() * 5.0 / 3.0).sqrt()
    }

    /// Returns the ratio of the longest side to the mean thickness, 2 V / A.
    #[must_use]
    pub fn slenderness(&self) -> f64 {
        let corners = |face: &[usize; 3]| face.map(|i| self.vertices[i]);
        let area = |[a, b, c]: [Vector3<f64>; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
        let total: f64 = self.faces.iter().map(|face| area(corners(face))).sum();
        let (low, high) = self.bounds();
        (high - low).max() * total / (2.0 * self.volume)
    }

    /// Transforms by a pose, then scales about the origin.
    #[must_use]
    pub fn moved(&self, pose: &Pose, scale: f64) -> Self {
        let rotation = pose.rotation_matrix();
        Self {
            vertices: self.vertices.iter().map(|v| pose.transform(v) * scale).collect(),
            faces: self.faces.clone(),
            volume: self.volume * scale.powi(3),
            centroid: pose.transform(&self.centroid) * scale,
            spread: rotation * self.spread * rotation.transpose() * (scale * scale),
        }
    }

    /// Fills a grid with `count` voxels along the longest side of the mesh, and `margin` empty
    /// voxels around it.
    #[must_use]
    pub fn fill(&self, count: usize, margin: usize) -> Grid {
        let (low, high) = self.bounds();
        let extent = high - low;
        let pitch = extent.max() / count as f64;
        let size = [0, 1, 2].map(|i| (extent[i] / pitch).ceil() as usize + 2 * margin);
        let spare = Vector3::from_fn(|i, _| 0.5 * (size[i] as f64 * pitch - extent[i]));
        let corner = low - spare;
        let lines = [size[1] * LINES, size[2] * LINES];
        let crossings = self.crossings(&corner, pitch, lines);
        let layer = |z: usize| -> Vec<f64> {
            let mut filled = vec![0.0; size[0] * size[1]];
            for line_z in z * LINES..(z + 1) * LINES {
                for line_y in 0..lines[0] {
                    let row = &mut filled[line_y / LINES * size[0]..][..size[0]];
                    for (begin, end) in inside(&crossings[line_z * lines[0] + line_y]) {
                        add_interval(row, (begin - corner.x) / pitch, (end - corner.x) / pitch);
                    }
                }
            }
            filled.iter().map(|sum| (sum / (LINES * LINES) as f64).min(1.0)).collect()
        };
        let layers: Vec<Vec<f64>> = (0..size[2]).into_par_iter().map(layer).collect();
        let origin = corner.add_scalar(0.5 * pitch);
        Grid { origin, pitch, size, filled: layers.concat() }
    }

    /// Returns, for each line along x, where it crosses the surface and whether it enters (1) or
    /// leaves (-1) there.
    fn crossings(
        &self,
        corner: &Vector3<f64>,
        pitch: f64,
        lines: [usize; 2],
    ) -> Vec<Vec<(f64, i32)>> {
        let step = pitch / LINES as f64;
        let mut out = vec![Vec::new(); lines[0] * lines[1]];
        let flat: Vec<[f64; 2]> = self
            .vertices
            .iter()
            .map(|v| [(v.y - corner.y) / step - 0.5, (v.z - corner.z) / step - 0.5])
            .collect();
        for face in &self.faces {
            let sign = if turn(&flat, *face) > 0.0 { -1 } else { 1 };
            for_each_covered(&flat, *face, lines, |at, shares| {
                let x = (0..3).map(|i| shares[i] * self.vertices[face[i]].x).sum();
                out[at[1] * lines[0] + at[0]].push((x, sign));
            });
        }
        out
    }

    /// Draws the silhouette: row by row, 255 at each pixel whose centre the mesh covers. A mesh
    /// that is not completely in front of the camera is not drawn.
    #[must_use]
    pub fn silhouette(&self, projection: &Projection, size_px: [usize; 2]) -> Vec<u8> {
        let mut pixels = vec![0; size_px[0] * size_px[1]];
        let seen: Vec<Vector3<f64>> = self.vertices.iter().map(|v| projection.apply(v)).collect();
        if seen.iter().any(|p| p.z <= 0.0) {
            return pixels;
        }
        let flat: Vec<[f64; 2]> = seen.iter().map(|p| [p.x / p.z, p.y / p.z]).collect();
        for face in &self.faces {
            for_each_covered(&flat, *face, size_px, |at, _| {
                pixels[at[1] * size_px[0] + at[0]] = u8::MAX;
            });
        }
        pixels
    }

    fn bounds(&self) -> (Vector3<f64>, Vector3<f64>) {
        let first = self.vertices.first().copied().unwrap_or_default();
        let join =
            |(low, high): (Vector3<f64>, Vector3<f64>), v: &Vector3<f64>| (low.inf(v), high.sup(v));
        self.vertices.iter().fold((first, first), join)
    }
}

/// Counts edges that do not have as many triangles on one side as on the other.
fn open_edges(faces: &[[usize; 3]]) -> usize {
    let mut edges: Vec<(usize, usize, i32)> = Vec::with_capacity(3 * faces.len());
    for &[a, b, c] in faces {
        for (from, to) in [(a, b), (b, c), (c, a)] {
            let way = if from < to { 1 } else { -1 };
            edges.push((from.min(to), from.max(to), way));
        }
    }
    edges.sort_unstable();
    let balance = |twins: &[(usize, usize, i32)]| twins.iter().map(|edge| edge.2).sum::<i32>();
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|twins| balance(twins) != 0).count()
}

/// Integrates volume, centroid and spread over the tetrahedra between a point and the triangles.
fn moments(vertices: &[Vector3<f64>], faces: &[[usize; 3]]) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let pivot = vertices.iter().sum::<Vector3<f64>>() / vertices.len().max(1) as f64;
    let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
    for face in faces {
        let [a, b, c] = face.map(|i| vertices[i] - pivot);
        let part = a.dot(&b.cross(&c)) / 6.0;
        let sum = a + b + c;
        volume += part;
        first += sum * (part / 4.0);
        let squares = a * a.transpose() + b * b.transpose() + c * c.transpose();
        second += (sum * sum.transpose() + squares) * (part / 20.0);
    }
    let off = first / volume;
    (volume, pivot + off, second / volume - off * off.transpose())
}

/// Returns twice the signed area of a planar triangle.
fn turn(flat: &[[f64; 2]], [a, b, c]: [usize; 3]) -> f64 {
    side(flat[a], flat[b], flat[c])
}

fn side(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Returns the side on which a position lies. A position on the line is treated as shifted by an
/// infinitesimal amount to the right, and up by far less, so that exactly one of the triangles
/// about an edge or a vertex covers it.
fn side_or_beside(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    let (value, [along, up]) = (side(a, b, p), [b[0] - a[0], b[1] - a[1]]);
    let tie = if up == 0.0 { along } else { -up };
    if value == 0.0 { f64::MIN_POSITIVE.copysign(tie) } else { value }
}

/// Visits the integer positions that a planar triangle covers, with the barycentric weight of each
/// vertex. A position on an edge shared by two triangles belongs to one of them.
fn for_each_covered(
    flat: &[[f64; 2]],
    face: [usize; 3],
    size: [usize; 2],
    mut visit: impl FnMut([usize; 2], [f64; 3]),
) {
    let corners = face.map(|i| flat[i]);
    let range = |axis: usize| {
        let values = corners.map(|corner| corner[axis]);
        let low = values.iter().fold(f64::INFINITY, |a, &b| a.min(b)).ceil().max(0.0);
        let high = values.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)).floor();
        low as usize..((high + 1.0).clamp(0.0, size[axis] as f64) as usize)
    };
    let whole = turn(flat, face);
    if whole == 0.0 {
        return;
    }
    for v in range(1) {
        for u in range(0) {
            let at = [u as f64, v as f64];
            let shares = [1, 2, 0].map(|i| {
                let (from, to) = (face[i], face[(i + 1) % 3]);
                // Evaluated in the same order from both sides, so that neighbours agree to the bit.
                let (one, two) = (from.min(to), from.max(to));
                let value = side_or_beside(flat[one], flat[two], at);
                (if from < to { value } else { -value }) / whole
            });
            if shares.iter().all(|share| *share > 0.0) {
                visit([u, v], shares);
            }
        }
    }
}

/// Returns the intervals of a line that are inside.
fn inside(crossings: &[(f64, i32)]) -> Vec<(f64, f64)> {
    let mut sorted = crossings.to_vec();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut depth, mut begin, mut out) = (0, 0.0, Vec::new());
    for (x, way) in sorted {
        if depth == 0 {
            begin = x;
        }
        depth += way;
        if depth == 0 {
            out.push((begin, x));
        }
    }
    out
}

/// Adds an interval, in voxels from the row's edge, to the shares of a row.
fn add_interval(row: &mut [f64], begin: f64, end: f64) {
    let last = row.len() as f64;
    let (begin, end) = (begin.clamp(0.0, last), end.clamp(0.0, last));
    for (index, share) in row.iter_mut().enumerate().take(end.ceil() as usize).skip(begin as usize)
    {
        let left = index as f64;
        *share += (end.min(left + 1.0) - begin.max(left)).max(0.0);
    }
}
