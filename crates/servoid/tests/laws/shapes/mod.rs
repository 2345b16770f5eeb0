//! Solids for the tests.

#![allow(dead_code, clippy::unwrap_used, reason = "each test file takes what it needs")]

pub mod drawn;

use std::collections::HashMap;

use nalgebra::{Matrix3, Vector3};
use servoid::shape::{Mesh, Quadric};

/// Vertices and triangles.
pub type Surface = (Vec<[f64; 3]>, Vec<[usize; 3]>);

/// A unit ball of 20 * 4^depth triangles.
pub fn ball(depth: usize) -> Surface {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut corners = vec![];
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        corners.extend([[a, b, 0.0], [0.0, a, b], [b, 0.0, a]]);
    }
    let mut points: Vec<Vector3<f64>> =
        corners.into_iter().map(|c| Vector3::from(c).normalize()).collect();
    // Its faces are the triples of mutual neighbours.
    let near = |i: usize, j: usize| i != j && (points[i] - points[j]).norm() < 1.1;
    let mut faces = vec![];
    for a in 0..12 {
        for b in 0..12 {
            for c in 0..12 {
                let outward = points[a].dot(&points[b].cross(&points[c])) > 0.0;
                if a < b.min(c) && near(a, b) && near(b, c) && near(c, a) && outward {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    for _ in 0..depth {
        faces = split(&mut points, &faces);
    }
    (points.into_iter().map(Into::into).collect(), faces)
}

fn split(points: &mut Vec<Vector3<f64>>, faces: &[[usize; 3]]) -> Vec<[usize; 3]> {
    let mut known: HashMap<(usize, usize), usize> = HashMap::new();
    let mut middle = |a: usize, b: usize| {
        *known.entry((a.min(b), a.max(b))).or_insert_with(|| {
            points.push((points[a] + points[b]).normalize());
            points.len() - 1
        })
    };
    let of_one = |&[a, b, c]: &[usize; 3]| {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
    };
    faces.iter().flat_map(of_one).collect()
}

/// The box from -1 to 1 along each axis.
pub fn cube() -> Surface {
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let sides =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    ((0..8).map(corner).collect(), faces)
}

/// Scales and rotates a surface, then moves it.
pub fn placed((corners, faces): Surface, factor: &Matrix3<f64>, center: Vector3<f64>) -> Surface {
    let place = |c: [f64; 3]| (factor * Vector3::from(c) + center).into();
    (corners.into_iter().map(place).collect(), faces)
}

/// Scales a surface along the axes, then moves it.
pub fn stretched(surface: Surface, radii: [f64; 3], center: [f64; 3]) -> Surface {
    placed(surface, &Matrix3::from_diagonal(&radii.into()), center.into())
}

/// Reverses the orientation of a surface.
pub fn inside_out((corners, faces): Surface) -> Surface {
    (corners, faces.into_iter().map(|[a, b, c]| [a, c, b]).collect())
}

/// Joins surfaces into one mesh.
pub fn joined(parts: &[Surface]) -> Surface {
    let (mut corners, mut faces) = (vec![], vec![]);
    for (more, triangles) in parts {
        let before = corners.len();
        corners.extend(more);
        faces.extend(triangles.iter().map(|face| face.map(|i| i + before)));
    }
    (corners, faces)
}

pub fn mesh((corners, faces): Surface) -> Mesh {
    Mesh::new(corners, faces).unwrap()
}

/// A finely triangulated ellipsoid, slightly enlarged so that it has the same volume.
pub fn mesh_of(quadric: &Quadric, depth: usize) -> Mesh {
    let volume = mesh(ball(depth)).volume();
    let larger = (4.0 / 3.0 * std::f64::consts::PI / volume).cbrt();
    mesh(placed(ball(depth), &(quadric.factor * larger), quadric.center))
}
