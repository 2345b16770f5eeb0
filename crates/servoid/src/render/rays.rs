//! Directions of the pixels of a lens.

use std::sync::{Arc, Mutex, PoisonError};

use super::bounds::Spread;
use super::vector::Vector;
use crate::camera::{Distortion, Lens};
use crate::parallel::*;
use crate::simd::{EIGHT, RayLanes, Scalar};

/// Size of a tile in pixels, across and down.
pub(super) const TILE_PX: [usize; 2] = [16, 8];

/// Number of lenses whose rays are cached.
const KEPT: usize = 4;

/// The rays of all pixels and samples of a lens.
#[derive(Debug)]
pub(super) struct Rays<S> {
    lens: Lens,
    samples: usize,
    /// Directions, sample by sample, row by row, with rows padded to whole lanes; NaN where the
    /// lens sees nothing. Empty for a pinhole, whose rays are faster computed than read.
    table: Vec<[Vec<S>; 3]>,
    pitch: usize,
    /// For a pinhole: tangents of pixel (0, 0) for each sample, and their steps from pixel to
    /// pixel.
    first: Vec<[S; 2]>,
    step: [S; 2],
    /// 0 to 7.
    columns: [S; EIGHT],
    /// The directions of each tile's rays; `None` where the lens sees nothing.
    spreads: Vec<Option<Spread<S>>>,
}

/// Returns the positions of samples in a pixel: one in each of as many rows and columns.
fn offsets(samples: usize) -> Vec<[f64; 2]> {
    let n = samples as f64;
    let mut out = Vec::with_capacity(samples * samples);
    for down in 0..samples {
        // Each row starts one sample further, so that successive moments spread over rows and
        // columns.
        for across in (0..samples).map(|i| (i + down) % samples) {
            let (x, y) = (across as f64, down as f64);
            out.push([(x + (y + 0.5) / n) / n - 0.5, (y + (n - x - 0.5) / n) / n - 0.5]);
        }
    }
    out
}

impl<S: Scalar> Rays<S> {
    /// Returns the cached rays of a lens, or computes them.
    pub fn of(lens: &Lens, samples: usize, kept: &Mutex<Vec<Arc<Self>>>) -> Arc<Self> {
        let is_it = |rays: &Arc<Self>| rays.lens == *lens && rays.samples == samples;
        let lock = || kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(rays) = lock().iter().find(|rays| is_it(rays)) {
            return Arc::clone(rays);
        }
        // Computed without holding the lock: waiting threads may run other work that comes here.
        let rays = Arc::new(Self::new(lens, samples));
        let mut kept = lock();
        if kept.len() == KEPT {
            kept.remove(0);
        }
        kept.push(Arc::clone(&rays));
        rays
    }

    fn new(lens: &Lens, samples: usize) -> Self {
        let [width, height] = lens.camera().size_px();
        let pitch = width.div_ceil(EIGHT) * EIGHT;
        let offsets = offsets(samples);
        let is_pinhole = lens.distortion() == Distortion::None;
        let table = if is_pinhole {
            Vec::new()
        } else {
            offsets.iter().map(|&offset| table(lens, offset, [pitch, height])).collect()
        };
        let ([fx, fy], [cx, cy]) = (lens.camera().focal_px(), lens.camera().center_px());
        let first = offsets.iter().map(|[u, v]| [S::of((u - cx) / fx), S::of((v - cy) / fy)]);
        let mut rays = Self {
            lens: *lens,
            samples,
            table,
            pitch,
            first: first.collect(),
            step: [S::of(1.0 / fx), S::of(1.0 / fy)],
            columns: std::array::from_fn(|i| S::of(i as f64)),
            spreads: Vec::new(),
        };
        let [across, down] = rays.tiles();
        rays.spreads = (0..across * down)
            .into_par_iter()
            .map(|tile| rays.spread([tile % across, tile / across]))
            .collect();
        rays
    }

    /// Returns the numbers of tiles across and down.
    pub fn tiles(&self) -> [usize; 2] {
        let [width, height] = self.lens.camera().size_px();
        [width.div_ceil(TILE_PX[0]), height.div_ceil(TILE_PX[1])]
    }

    /// Returns the number of rays per pixel.
    pub fn per_pixel(&self) -> usize {
        self.first.len()
    }

    /// Returns the directions of all rays of a tile; `None` if the lens sees nothing there.
    pub fn spread_of(&self, [across, down]: [usize; 2]) -> Option<&Spread<S>> {
        self.spreads[down * self.tiles()[0] + across].as_ref()
    }

    /// Returns the directions of eight pixels of a row.
    #[inline(always)]
    pub fn eight<L: RayLanes<Scalar = S>>(&self, sample: usize, u: usize, v: usize) -> Vector<L> {
        if let Some(planes) = self.table.get(sample) {
            let at = v * self.pitch + u;
            let [x, y, z] = planes;
            return Vector { x: read(x, at), y: read(y, at), z: read(z, at) };
        }
        let ([x, y], [across, down]) = (self.first[sample], self.step);
        let (columns, row) = (L::read(self.columns) + L::of(u as f64), L::of(v as f64));
        Vector {
            x: columns * L::splat(across) + L::splat(x),
            y: row * L::splat(down) + L::splat(y),
            z: L::of(1.0),
        }
    }

    fn spread(&self, [across, down]: [usize; 2]) -> Option<Spread<S>> {
        let directions = self.directions(across * TILE_PX[0], down * TILE_PX[1]);
        let (mut low, mut high) = (*directions.first()?, *directions.first()?);
        for direction in &directions {
            for axis in 0..3 {
                low[axis] = low[axis].min(direction[axis]);
                high[axis] = high[axis].max(direction[axis]);
            }
        }
        Some(Spread::of_directions(low, high))
    }

    /// Returns directions of a tile's rays, between which all others lie.
    fn directions(&self, u: usize, v: usize) -> Vec<[f64; 3]> {
        let [width, height] = self.lens.camera().size_px();
        let (right, bottom) = ((u + TILE_PX[0]).min(width), (v + TILE_PX[1]).min(height));
        if self.table.is_empty() {
            let ([fx, fy], [cx, cy]) =
                (self.lens.camera().focal_px(), self.lens.camera().center_px());
            let at =
                |u: usize, v: usize| [(u as f64 - 0.5 - cx) / fx, (v as f64 - 0.5 - cy) / fy, 1.0];
            return vec![at(u, v), at(right, bottom)];
        }
        let mut out = Vec::new();
        for [x, y, z] in &self.table {
            for row in v..bottom {
                let (from, to) = (row * self.pitch + u, row * self.pitch + right);
                let all = (from..to).map(|i| [x[i].to_f64(), y[i].to_f64(), z[i].to_f64()]);
                out.extend(all.filter(|d| !d[0].is_nan()));
            }
        }
        out
    }
}

#[inline(always)]
fn read<L: RayLanes>(plane: &[L::Scalar], at: usize) -> L {
    let mut values = [L::Scalar::of(0.0); EIGHT];
    values.copy_from_slice(&plane[at..at + EIGHT]);
    L::read(values)
}

fn table<S: Scalar>(lens: &Lens, offset: [f64; 2], [pitch, height]: [usize; 2]) -> [Vec<S>; 3] {
    let width = lens.camera().size_px()[0];
    let rays: Vec<[f64; 3]> = (0..pitch * height)
        .into_par_iter()
        .map(|i| {
            let (u, v) = (i % pitch, i / pitch);
            let pixel = [u as f64 + offset[0], v as f64 + offset[1]];
            let seen = (u < width).then(|| lens.ray(pixel)).flatten();
            seen.map_or([f64::NAN; 3], <[f64; 3]>::from)
        })
        .collect();
    std::array::from_fn(|axis| rays.iter().map(|ray| S::of(ray[axis])).collect())
}
