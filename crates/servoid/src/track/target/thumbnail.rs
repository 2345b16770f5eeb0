//! A small picture of the object from one side, by which it is found in a whole image: it is
//! compared by its normalised correlation, which no gain and no offset of the light changes.

use nalgebra::Vector2;

use super::solid::Solid;
use crate::camera::Pyramid;
use crate::pose::Pose;
use crate::track::frame::window::{Window, bounds};

/// The brightness of the object in cells of an image.
#[derive(Debug, Clone)]
pub(crate) struct Thumbnail {
    /// Columns and rows of cells, and the side of a cell in pixels.
    size: [usize; 2],
    cell_px: f64,
    /// The image of the object's origin, in cells from the corner.
    origin: Vector2<f64>,
    /// Distance of the origin from the camera.
    distance: f64,
    /// Column, row and brightness of the cells inside the outline; the mean of the brightness is 0,
    /// and the sum of its squares 1.
    cells: Vec<(usize, usize, f32)>,
}

/// Where a thumbnail may be in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Spot {
    /// Correlation, -1 to 1.
    pub(crate) likeness: f32,
    /// The image of the object's origin, in pixels.
    pub(crate) origin_px: Vector2<f64>,
    /// Distance of the origin from the camera, in metres.
    pub(crate) distance: f64,
}

/// Cells along the longer side of the object.
const CELLS: f64 = 12.0;
/// Smallest number of cells that show something of the object.
const FEWEST: usize = 24;
/// Level of the pyramid that is averaged, and the side of its pixels in those of the image.
const LEVEL: usize = Pyramid::LEVELS - 1;
const PIXEL: f64 = (1 << LEVEL) as f64;
/// Logarithm of the ratio of successive distances at which it is sought.
const DISTANCE_STEP: f64 = 0.17;
/// Least correlation of a place that may show the object.
const LEAST_LIKENESS: f32 = 0.5;

impl Thumbnail {
    /// Takes a picture of the body at a pose, in an open window; none if there is nothing to see.
    pub(crate) fn take(window: &Window, solid: &Solid, pose: &Pose) -> Option<Self> {
        let projection = window.projection(pose)?;
        let (origin, _) = projection.pixel(&nalgebra::Vector3::zeros())?;
        let distance = projection.eye()?.norm();
        let outlines: Vec<_> = solid.outlines(&projection).collect();
        let (low, high) = bounds(outlines.iter().cloned())?;
        let cell_px = ((high - low).amax() / CELLS).max(PIXEL);
        let size = [0, 1].map(|i| ((high[i] - low[i]) / cell_px).ceil().max(1.0) as usize);
        let brightness = Sums::of(window).cells((low, cell_px), size);
        let is_inside = |at: &usize| {
            let place = Vector2::new((at % size[0]) as f64 + 0.5, (at / size[0]) as f64 + 0.5);
            outlines.iter().any(|outline| outline.contains(&(low + place * cell_px)))
        };
        let seen: Vec<_> = (0..brightness.len())
            .filter(is_inside)
            .filter_map(|at| Some((at % size[0], at / size[0], brightness[at]?)))
            .collect();
        let count = seen.len();
        let mean = seen.iter().map(|cell| cell.2).sum::<f32>() / count.max(1) as f32;
        let length = seen.iter().map(|cell| (cell.2 - mean).powi(2)).sum::<f32>().sqrt();
        let shows = f64::from(length / (count.max(1) as f32).sqrt()) >= window.least_contrast();
        (count >= FEWEST && shows).then(|| Self {
            size,
            cell_px,
            origin: (origin - low) / cell_px,
            distance,
            cells: seen.iter().map(|&(u, v, x)| (u, v, (x - mean) / length)).collect(),
        })
    }

    /// Finds the places in a window where the object looks as here, at distances from near to
    /// far, and adds them.
    pub(crate) fn seek(&self, sums: &Sums<'_>, (near, far): (f64, f64), out: &mut Vec<Spot>) {
        let steps = (libm::log(far / near) / DISTANCE_STEP).ceil().clamp(1.0, 40.0) as usize;
        let (first, size_px) = sums.window.place_px();
        let corner = Vector2::new(first[0] as f64, first[1] as f64);
        for step in 0..steps {
            let distance = near * libm::pow(far / near, (step as f64 + 0.5) / steps as f64);
            let cell_px = self.cell_px * self.distance / distance;
            let size = size_px.map(|px| (px as f64 / cell_px) as usize);
            if (0..2).any(|i| size[i] < self.size[i]) {
                continue;
            }
            let image = sums.cells((corner, cell_px), size);
            let image: Vec<f32> = image.into_iter().map(Option::unwrap_or_default).collect();
            let places = [0, 1].map(|i| size[i] - self.size[i] + 1);
            for row in 0..places[1] {
                let along = self.likeness_along((&image, size[0]), (row, places[0]));
                for (column, likeness) in along.into_iter().enumerate() {
                    if likeness >= LEAST_LIKENESS {
                        let place = Vector2::new(column as f64, row as f64) + self.origin;
                        out.push(Spot { likeness, origin_px: corner + place * cell_px, distance });
                    }
                }
            }
        }
    }

    /// Returns the correlation at each of the first places along a row of an image of cells.
    fn likeness_along(
        &self,
        (image, width): (&[f32], usize),
        (row, places): (usize, usize),
    ) -> Vec<f32> {
        let [mut sum, mut squares, mut product] = [(); 3].map(|()| vec![0.0_f32; places]);
        for &(u, v, brightness) in &self.cells {
            let from = &image[(row + v) * width + u..][..places];
            let sums = sum.iter_mut().zip(&mut squares).zip(&mut product);
            for (((sum, squares), product), &there) in sums.zip(from) {
                *sum += there;
                *squares += there * there;
                *product += there * brightness;
            }
        }
        let count = self.cells.len() as f32;
        let likeness = |at: usize| {
            let variance = squares[at] - sum[at] * sum[at] / count;
            product[at] / variance.max(count).sqrt()
        };
        (0..places).map(likeness).collect()
    }
}

/// The brightness of a window, summed up so that the mean of any part of it is quickly known.
pub(crate) struct Sums<'a> {
    window: &'a Window,
    /// Columns and rows; one more of each than there are pixels.
    size: [usize; 2],
    /// The sum over all pixels above and to the left.
    sums: Vec<f64>,
}

impl<'a> Sums<'a> {
    pub(crate) fn of(window: &'a Window) -> Self {
        let plane = window.pyramid.plane(LEVEL);
        let size = plane.size_px().map(|n| n + 1);
        let mut sums = vec![0.0; size[0] * size[1]];
        for v in 1..size[1] {
            let mut along = 0.0;
            for (u, brightness) in plane.row(v - 1).iter().enumerate() {
                along += f64::from(*brightness);
                sums[v * size[0] + u + 1] = sums[(v - 1) * size[0] + u + 1] + along;
            }
        }
        Self { window, size, sums }
    }

    /// Returns the mean brightness of square cells, row by row from a corner in pixels; none of
    /// those that leave the window.
    fn cells(
        &self,
        (corner, cell_px): (Vector2<f64>, f64),
        [columns, rows]: [usize; 2],
    ) -> Vec<Option<f32>> {
        let edges = |axis: usize, count: usize| -> Vec<Edge> {
            let edge = |at: usize| corner[axis] + cell_px * at as f64;
            let place = |at: f64| self.window.pyramid.place(at, at, LEVEL)[axis] + 0.5;
            (0..=count).map(|at| Edge::at(place(edge(at)), self.size[axis])).collect()
        };
        let (across, down) = (edges(0, columns), edges(1, rows));
        let sums_along = |v: &Edge| -> Vec<f64> {
            let at = |u: &Edge, row: usize| {
                let from = row * self.size[0] + u.index;
                self.sums[from] + u.share * (self.sums[from + 1] - self.sums[from])
            };
            let sum = |u| at(u, v.index) + v.share * (at(u, v.index + 1) - at(u, v.index));
            across.iter().map(sum).collect()
        };
        let area = (cell_px / PIXEL) * (cell_px / PIXEL);
        let mut cells = Vec::with_capacity(columns * rows);
        let mut upper = sums_along(&down[0]);
        for v in down.windows(2) {
            let lower = sums_along(&v[1]);
            let is_inside = v.iter().all(|edge| edge.is_inside);
            cells.extend((0..columns).map(|u| {
                let sum = lower[u + 1] - lower[u] - upper[u + 1] + upper[u];
                let is_inside = is_inside && across[u].is_inside && across[u + 1].is_inside;
                is_inside.then_some((sum / area) as f32)
            }));
            upper = lower;
        }
        cells
    }
}

/// Where the edge of a cell lies between two sums.
struct Edge {
    index: usize,
    share: f64,
    is_inside: bool,
}

impl Edge {
    /// Returns an edge at a place among a number of sums; less than a pixel outside is inside.
    fn at(place: f64, count: usize) -> Self {
        let last = count.saturating_sub(1) as f64;
        let clamped = place.clamp(0.0, last);
        let index = (clamped as usize).min(count.saturating_sub(2));
        let is_inside = (place - clamped).abs() < 1.0;
        Self { index, share: clamped - index as f64, is_inside }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::{Camera, ImageView};
    use crate::shape::{Body, Ellipsoid};

    const SIZE: [usize; 2] = [320, 240];
    const FOCAL_PX: f64 = 300.0;
    const FAR_M: f64 = 0.5;

    fn camera() -> Camera {
        Camera::new(SIZE, [FOCAL_PX; 2], [160.0, 120.0]).unwrap()
    }

    fn solid() -> Solid {
        let ball = Ellipsoid::new(0, [0.0; 3], [0.05; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        Solid::new(&Body::new(Pose::identity(), vec![ball]).unwrap())
    }

    /// Draws a disc with a pattern at a pixel, and another pattern around it, and opens a window on
    /// it; `light` is a gain and an offset.
    fn open(
        (place, radius_px): ([f64; 2], f64),
        (gain, offset): (f64, f64),
        contrast: f64,
    ) -> Window {
        let brightness = |at: usize| {
            let (u, v) = ((at % SIZE[0]) as f64, (at / SIZE[0]) as f64);
            let (x, y) = ((u - place[0]) / radius_px, (v - place[1]) / radius_px);
            let print = libm::sin(4.0 * x + 1.0) * libm::cos(5.0 * y) + libm::sin(3.0 * x * y);
            let around = libm::sin(u / 17.0 + 0.4) * libm::cos(v / 13.0);
            let shown = if libm::hypot(x, y) < 1.0 { contrast * print } else { 30.0 * around };
            (gain * (110.0 + shown) + offset) as u8
        };
        let grey: Vec<_> = (0..SIZE[0] * SIZE[1]).map(brightness).collect();
        let image = ImageView::new(&grey, SIZE, crate::camera::Channels::Grey).unwrap();
        let mut window = Window::default();
        window.open_all_over(&camera(), &Pose::identity(), &image, None);
        window
    }

    fn radius_px(distance: f64) -> f64 {
        FOCAL_PX * 0.05 / distance
    }

    fn taken(contrast: f64) -> Option<Thumbnail> {
        let window = open(([160.0, 120.0], radius_px(FAR_M)), (1.0, 0.0), contrast);
        let pose = Pose::exp(&crate::pose::Twist::new(0.0, 0.0, FAR_M, 0.0, 0.0, 0.0));
        Thumbnail::take(&window, &solid(), &pose)
    }

    fn best(window: &Window) -> Spot {
        let mut spots = Vec::new();
        taken(40.0).unwrap().seek(&Sums::of(window), (0.3, 0.8), &mut spots);
        spots.into_iter().max_by(|a, b| a.likeness.total_cmp(&b.likeness)).unwrap()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn an_object_is_found_where_it_is_at_its_distance_and_in_other_light(
            (u, v) in (60.0..260.0, 60.0..180.0),
            distance in 0.4..0.7,
            light in (0.5..1.2, 0.0..40.0),
        ) {
            let spot = best(&open(([u, v], radius_px(distance)), light, 40.0));
            prop_assert!(spot.likeness > 0.8, "{spot:?}");
            let off = (spot.origin_px - Vector2::new(u, v)).norm();
            prop_assert!(off < 0.2 * radius_px(distance), "{off} px");
            prop_assert!(libm::log(spot.distance / distance).abs() < 1.5 * DISTANCE_STEP);
        }
    }

    #[test]
    fn an_object_without_a_pattern_has_no_picture() {
        assert!(taken(40.0).is_some());
        assert!(taken(0.0).is_none());
    }

    #[test]
    fn nothing_is_found_in_an_image_of_one_brightness_or_smaller_than_the_object() {
        let picture = taken(40.0).unwrap();
        let mut spots = Vec::new();
        let grey = vec![90; SIZE[0] * SIZE[1]];
        for size in [SIZE, [20, 16]] {
            let pixels = &grey[..size[0] * size[1]];
            let image = ImageView::new(pixels, size, crate::camera::Channels::Grey).unwrap();
            let camera = Camera::new(size, [FOCAL_PX; 2], [10.0, 8.0]).unwrap();
            let mut window = Window::default();
            window.open_all_over(&camera, &Pose::identity(), &image, None);
            picture.seek(&Sums::of(&window), (0.3, 0.8), &mut spots);
        }
        assert!(spots.is_empty());
    }
}
