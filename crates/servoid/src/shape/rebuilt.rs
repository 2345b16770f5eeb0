//! Rebuilds a closed surface around the inside of a triangle soup.

use std::collections::HashMap;

use crate::parallel::*;
use nalgebra::Vector3;

use super::{ShapeError, Soup};

/// Winding number at the surface.
const LEVEL: f64 = 0.5;
/// Bisections of an edge of the grid that locate the surface.
const HALVINGS: usize = 5;
/// Cells along a block; a block without nearby triangles is classified as a whole.
const BLOCK: usize = 4;
/// Empty cells around the triangles.
const MARGIN: usize = 2;
/// The tetrahedra of a cell, by the axes of a path from its first corner to its last.
const WALKS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]];

type Spot = [usize; 3];

/// A closed surface: vertices, and triangles in counter-clockwise order seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Rebuilt {
    /// Vertices, in metres.
    pub vertices: Vec<[f64; 3]>,
    /// Triangles.
    pub faces: Vec<[usize; 3]>,
    /// For each vertex, the jump of the winding number across the surface: about 1 on the given
    /// triangles, less where the surface is interpolated.
    pub leaps: Vec<f64>,
    /// Side of a cell of the grid, in metres.
    pub cell: f64,
}

/// A grid of cells over a box.
struct Lattice {
    corner: Vector3<f64>,
    cell: f64,
    size: Spot,
}

impl Lattice {
    fn over(low: Vector3<f64>, high: Vector3<f64>, cells: usize) -> Self {
        let extent = high - low;
        let cell = extent.max() / cells as f64;
        let size = [0, 1, 2].map(|i| (extent[i] / cell).ceil() as usize + 2 * MARGIN + 1);
        let spare = Vector3::from_fn(|i, _| 0.5 * ((size[i] - 1) as f64 * cell - extent[i]));
        Self { corner: low - spare, cell, size }
    }

    fn at(&self, spot: Spot) -> Vector3<f64> {
        self.corner + Vector3::from(spot.map(|i| i as f64)) * self.cell
    }

    fn place(&self, index: usize) -> Vector3<f64> {
        self.at(Shape(self.size).spot(index))
    }
}

/// Number of items along x, y and z; x varies fastest.
#[derive(Debug, Clone, Copy)]
struct Shape(Spot);

impl Shape {
    fn count(self) -> usize {
        self.0.iter().product()
    }

    fn index(self, [x, y, z]: Spot) -> usize {
        (z * self.0[1] + y) * self.0[0] + x
    }

    fn spot(self, index: usize) -> Spot {
        let row = index / self.0[0];
        [index % self.0[0], row % self.0[1], row / self.0[1]]
    }
}

impl Soup {
    /// Most cells along the longest side of a rebuilt surface; their grid takes about 1 GB.
    pub const MAX_CELLS: usize = 1000;

    /// Rebuilds the surface where the winding number is a half, on a grid with `cells` along the
    /// longest side, by marching tetrahedra. Returns none if the triangles enclose nothing.
    ///
    /// # Errors
    /// If there are more cells than `MAX_CELLS`.
    pub fn rebuilt(&self, cells: usize) -> Result<Option<Rebuilt>, ShapeError> {
        if cells > Self::MAX_CELLS {
            return Err(ShapeError::Cells { cells, most: Self::MAX_CELLS });
        }
        let sized = self.bounds().filter(|(low, high)| (high - low).max() > 0.0);
        Ok(sized.and_then(|bounds| self.rebuilt_within(bounds, cells)))
    }

    fn rebuilt_within(
        &self,
        (low, high): (Vector3<f64>, Vector3<f64>),
        cells: usize,
    ) -> Option<Rebuilt> {
        let lattice = Lattice::over(low, high, cells.max(2));
        let is_in = self.insides(&lattice);
        let (edges, faces) = marched(&lattice, &is_in);
        if faces.is_empty() {
            return None;
        }
        let found: Vec<([f64; 3], f64)> =
            edges.par_iter().map(|&[one, two]| self.crossing(&lattice, one, two)).collect();
        let (vertices, leaps) = found.into_iter().unzip();
        Some(Rebuilt { vertices, faces, leaps, cell: lattice.cell })
    }

    /// Returns for each position of a grid whether it is inside. Where no triangle is near, the
    /// winding number hardly changes: a block whose corners agree is classified as a whole.
    fn insides(&self, lattice: &Lattice) -> Vec<bool> {
        let blocks = lattice.size.map(|n| n.div_ceil(BLOCK));
        let (own, corners) = (Shape(blocks), Shape(blocks.map(|n| n + 1)));
        let is_near = self.touched(lattice, own);
        let at_corners: Vec<bool> = (0..corners.count())
            .into_par_iter()
            .map(|index| self.winding(&lattice.at(corners.spot(index).map(|i| i * BLOCK))) > LEVEL)
            .collect();
        let places = Shape(lattice.size);
        let is_in = |index: usize| {
            let spot = places.spot(index);
            // Faces that wind many times around something do so beyond their box, too.
            if spot.iter().zip(&lattice.size).any(|(&at, &size)| at == 0 || at + 1 == size) {
                return false;
            }
            let block = spot.map(|i| i / BLOCK);
            let corner = |i: usize| {
                at_corners[corners.index(std::array::from_fn(|axis| block[axis] + (i >> axis & 1)))]
            };
            let agreed = !is_near[own.index(block)] && (1..8).all(|i| corner(i) == corner(0));
            if agreed { corner(0) } else { self.winding(&lattice.place(index)) > LEVEL }
        };
        (0..places.count()).into_par_iter().map(is_in).collect()
    }

    /// Returns the blocks that contain a triangle, or are within a cell of one.
    fn touched(&self, lattice: &Lattice, blocks: Shape) -> Vec<bool> {
        let mut found = vec![false; blocks.count()];
        for [a, b, c] in self.triangles() {
            let (low, high) = (a.inf(b).inf(c), a.sup(b).sup(c));
            let block = |place: f64, axis: usize| {
                (((place - lattice.corner[axis]) / lattice.cell) / BLOCK as f64).max(0.0) as usize
            };
            let range = |axis: usize| {
                let last = block(high[axis] + lattice.cell, axis).min(blocks.0[axis] - 1);
                block(low[axis] - lattice.cell, axis)..=last
            };
            for z in range(2) {
                for y in range(1) {
                    range(0).for_each(|x| found[blocks.index([x, y, z])] = true);
                }
            }
        }
        found
    }

    /// Finds where the line from a position inside to one outside crosses the surface, and the jump
    /// of the winding number there.
    fn crossing(&self, lattice: &Lattice, within: usize, without: usize) -> ([f64; 3], f64) {
        let (mut near, mut far) = (lattice.place(within), lattice.place(without));
        for _ in 0..HALVINGS {
            let middle = 0.5 * (near + far);
            *(if self.winding(&middle) > LEVEL { &mut near } else { &mut far }) = middle;
        }
        let leap = self.winding(&near) - self.winding(&far);
        ((0.5 * (near + far)).into(), leap)
    }
}

/// Marches through all cells: returns the edges, from inside to outside, that the surface crosses,
/// and the triangles between them.
fn marched(lattice: &Lattice, is_in: &[bool]) -> (Vec<[usize; 2]>, Vec<[usize; 3]>) {
    let (mut numbers, mut edges, mut faces) = (HashMap::new(), Vec::new(), Vec::new());
    let places = Shape(lattice.size);
    for first in 0..is_in.len() {
        let [x, y, z] = places.spot(first);
        if [x, y, z].iter().zip(&lattice.size).any(|(at, size)| at + 1 == *size) {
            continue;
        }
        let corners: [usize; 8] =
            std::array::from_fn(|i| places.index([x + (i & 1), y + (i >> 1 & 1), z + (i >> 2)]));
        let inside = corners.iter().filter(|&&corner| is_in[corner]).count();
        if inside == 0 || inside == 8 {
            continue;
        }
        for (walk, way) in WALKS.iter().enumerate() {
            let mut at = 0;
            let mut tetrahedron = [corners[0]; 4];
            for (step, axis) in way.iter().enumerate() {
                at |= 1 << axis;
                tetrahedron[step + 1] = corners[at];
            }
            if walk >= 3 {
                tetrahedron.swap(2, 3); // so that all have the same orientation
            }
            cut(tetrahedron, is_in, |triangle| {
                faces.push(triangle.map(|edge| {
                    *numbers.entry(edge).or_insert_with(|| {
                        edges.push(edge);
                        edges.len() - 1
                    })
                }));
            });
        }
    }
    (edges, faces)
}

/// Cuts a tetrahedron between its corners inside and outside; returns triangles of edges.
fn cut(t: [usize; 4], is_in: &[bool], mut push: impl FnMut([[usize; 2]; 3])) {
    // Even permutations of the corners, with those inside, or the only one outside, first.
    const FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 0, 1, 3], [3, 0, 2, 1]];
    const PAIRS: [[usize; 4]; 6] =
        [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];
    let inside: Vec<usize> = (0..4).filter(|&i| is_in[t[i]]).collect();
    match inside[..] {
        [one] => {
            let [a, b, c, d] = FIRST[one].map(|i| t[i]);
            push([[a, b], [a, c], [a, d]]);
        }
        [one, two] => {
            if let Some(order) = PAIRS.iter().find(|order| order[..2] == [one, two]) {
                let [a, b, c, d] = order.map(|i| t[i]);
                push([[a, c], [a, d], [b, d]]);
                push([[a, c], [b, d], [b, c]]);
            }
        }
        [_, _, _] => {
            let out = 6 - inside.iter().sum::<usize>();
            let [a, b, c, d] = FIRST[out].map(|i| t[i]);
            push([[b, a], [d, a], [c, a]]);
        }
        _ => {}
    }
}
