use std::collections::HashMap;

use nalgebra::Vector3;

/// Cosine of the angle between adjacent faces below which they are shaded as one curved surface.
const SMOOTH: f64 = 0.766;

/// Returns the normal at each corner of each triangle: the mean of the triangles that meet there at
/// a flat angle, weighted by area.
pub(super) fn corner_normals(vertices: &[[f64; 3]], faces: &[[usize; 3]]) -> Vec<[[f32; 3]; 3]> {
    let across: Vec<Vector3<f64>> = faces
        .iter()
        .map(|face| {
            let [a, b, c] = face.map(|i| Vector3::from(vertices[i]));
            (b - a).cross(&(c - a))
        })
        .collect();
    // Vertices at the same position count as one, even if a texture's seam has duplicated them.
    let place = |i: usize| vertices[i].map(|x| (x + 0.0).to_bits());
    let mut adjoining: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
    for (index, face) in faces.iter().enumerate() {
        for &corner in face {
            adjoining.entry(place(corner)).or_default().push(index);
        }
    }
    let normal = |corner: usize, face: usize| {
        let own = across[face].try_normalize(0.0).unwrap_or_else(Vector3::z);
        let near = adjoining[&place(corner)].iter().map(|&other| across[other]);
        let sum: Vector3<f64> = near.filter(|n| n.dot(&own) >= SMOOTH * n.norm()).sum();
        let mean = sum.try_normalize(0.0).unwrap_or(own);
        <[f64; 3]>::from(mean).map(|x| x as f32)
    };
    faces.iter().enumerate().map(|(index, face)| face.map(|corner| normal(corner, index))).collect()
}
