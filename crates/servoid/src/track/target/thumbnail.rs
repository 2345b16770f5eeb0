//! A small image of the object from one side, by which it is found in a larger one: they are
//! compared by normalised correlation, which gain and offset of the light do not change.

use nalgebra::{Vector2, Vector3};

use super::solid::Solid;
use crate::camera::Pyramid;
use crate::pose::Pose;
use crate::track::frame::window::{Window, bounds};

/// The brightness of the object in the cells of a grid.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Thumbnail {
    /// Columns and rows of cells, and the side of a cell in pixels.
    pub(crate) size: [usize; 2],
    pub(crate) cell_px: f64,
    /// The image of the object's origin, in cells from the corner, and its depth in metres.
    pub(crate) origin: Vector2<f64>,
    pub(crate) depth: f64,
    /// Column, row and brightness of the cells inside the outline; the mean of the brightness is 0,
    /// and the sum of its squares 1.
    pub(crate) cells: Vec<(usize, usize, f32)>,
}

/// Where an image looks like a thumbnail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Detection {
    /// Correlation, -1 to 1.
    pub(crate) correlation: f32,
    /// The image of the object's origin, in pixels, and its depth in metres.
    pub(crate) origin_px: Vector2<f64>,
    pub(crate) depth: f64,
    /// Length of the object's image, but no less than that of the smallest thumbnail, in pixels.
    pub(crate) length_px: f64,
}

/// Cells along the longer side of the object.
const CELLS: f64 = 12.0;
/// Most cells along a side of a thumbnail, rounded up.
pub(crate) const MOST_SIDE: usize = CELLS as usize + 1;
/// Smallest number of cells that show something of the object, and largest along an image that is
/// searched: an object that is smaller in it is not sought.
const LEAST_CELLS: usize = 24;
const MOST_CELLS: f64 = 160.0;
/// Smallest part of a cell that must lie in the image.
const LEAST_PART: f64 = 0.75;
/// Logarithm of the ratio of successive distances at which an object is sought.
const DISTANCE_STEP: f64 = 0.17;
/// Least correlation of a place that may show the object.
const LEAST_CORRELATION: f32 = 0.5;
/// Least standard deviation of the brightness at such a place, in grey levels.
const LEAST_DEVIATION: f32 = 1.0;
/// Level of the pyramid that is read.
const LEVEL: usize = Pyramid::LEVELS - 1;

/// Returns the side of a pixel of that level, in pixels of the image.
fn pixel_px() -> f64 {
    f64::from(1_u32 << LEVEL)
}

/// Returns distances from near to far at which an object is sought.
pub(crate) fn distances(near: f64, far: f64) -> impl Iterator<Item = f64> {
    let steps = (libm::log(far / near) / DISTANCE_STEP).ceil().clamp(1.0, 40.0) as usize;
    (0..steps).map(move |step| near * libm::pow(far / near, (step as f64 + 0.5) / steps as f64))
}

impl Thumbnail {
    /// Takes the image of the body at a pose, in an open window, without what hides it; none if that
    /// shows no pattern.
    pub(crate) fn take(
        window: &Window,
        (solid, pose): (&Solid, &Pose),
        is_hidden: impl Fn(&Vector2<f64>) -> bool,
    ) -> Option<Self> {
        let projection = window.projection(pose)?;
        let (origin, _) = projection.pixel(&Vector3::zeros())?;
        let depth = projection.apply(&Vector3::zeros()).z;
        let outlines: Vec<_> = solid.outlines(&projection).collect();
        let (low, high) = bounds(outlines.iter().cloned())?;
        let cell_px = ((high - low).amax() / CELLS).max(pixel_px());
        let size = [0, 1].map(|i| ((high[i] - low[i]) / cell_px).ceil().max(1.0) as usize);
        let brightness = IntegralImage::of(window).cells((low, cell_px), size);
        let shows = |at: &usize| {
            let place = Vector2::new((at % size[0]) as f64 + 0.5, (at / size[0]) as f64 + 0.5);
            let pixel = low + place * cell_px;
            outlines.iter().any(|outline| outline.contains(&pixel)) && !is_hidden(&pixel)
        };
        let seen: Vec<_> = (0..brightness.len())
            .filter(shows)
            .filter_map(|at| Some((at % size[0], at / size[0], brightness[at]?)))
            .collect();
        let count = seen.len().max(1) as f32;
        let mean = seen.iter().map(|cell| cell.2).sum::<f32>() / count;
        let length = seen.iter().map(|cell| (cell.2 - mean).powi(2)).sum::<f32>().sqrt();
        let is_patterned = f64::from(length / count.sqrt()) >= window.least_contrast();
        (seen.len() >= LEAST_CELLS && is_patterned).then(|| Self {
            size,
            cell_px,
            origin: (origin - low) / cell_px,
            depth,
            cells: seen.iter().map(|&(u, v, x)| (u, v, (x - mean) / length)).collect(),
        })
    }

    /// Finds the places in an image where the object looks as here, at depths from near to far.
    pub(crate) fn search(&self, image: &IntegralImage<'_>, near: f64, far: f64) -> Vec<Detection> {
        let (first, size_px) = image.window.place_px();
        let corner = Vector2::new(first[0] as f64 - 0.5, first[1] as f64 - 0.5);
        let mut found = Vec::new();
        for depth in distances(near, far) {
            let cell_px = self.cell_px * self.depth / depth;
            let cells = size_px.map(|px| px as f64 / cell_px);
            if !(cells[0] <= MOST_CELLS && cells[1] <= MOST_CELLS) {
                continue;
            }
            let size = cells.map(|count| count as usize);
            if (0..2).any(|i| size[i] < self.size[i]) {
                continue;
            }
            let brightness = levelled(&image.cells((corner, cell_px), size));
            let places = [0, 1].map(|i| size[i] - self.size[i] + 1);
            let correlations = self.correlations(&brightness, size[0], places);
            for (at, correlation) in correlations.into_iter().enumerate() {
                if correlation >= LEAST_CORRELATION {
                    let place = Vector2::new((at % places[0]) as f64, (at / places[0]) as f64);
                    let origin_px = corner + (place + self.origin) * cell_px;
                    let length_px = CELLS * cell_px;
                    found.push(Detection { correlation, origin_px, depth, length_px });
                }
            }
        }
        found
    }

    /// Returns the correlation at each place, row by row, in an image of cells with a width.
    fn correlations(
        &self,
        brightness: &[f32],
        width: usize,
        [columns, rows]: [usize; 2],
    ) -> Vec<f32> {
        let [mut sum, mut squares, mut product] = [(); 3].map(|()| vec![0.0_f32; columns * rows]);
        for &(u, v, own) in &self.cells {
            let parts =
                [&mut sum, &mut squares, &mut product].map(|all| all.chunks_exact_mut(columns));
            let [sums, squares, products] = parts;
            for (row, ((sums, squares), products)) in sums.zip(squares).zip(products).enumerate() {
                let there = &brightness[(row + v) * width + u..][..columns];
                let places = sums.iter_mut().zip(squares).zip(products).zip(there);
                for (((sum, square), product), &there) in places {
                    *sum += there;
                    *square += there * there;
                    *product += there * own;
                }
            }
        }
        let count = self.cells.len() as f32;
        let least = count * LEAST_DEVIATION * LEAST_DEVIATION;
        let correlation = |at: usize| {
            let variance = squares[at] - sum[at] * sum[at] / count;
            (product[at] / variance.max(least).sqrt()).clamp(-1.0, 1.0)
        };
        (0..columns * rows).map(correlation).collect()
    }
}

/// Returns brightness without its mean, which cells outside of the image have.
fn levelled(cells: &[Option<f32>]) -> Vec<f32> {
    let (sum, count) =
        cells.iter().flatten().fold((0.0, 0.0), |(sum, count), cell| (sum + cell, count + 1.0_f32));
    let mean = sum / count.max(1.0);
    cells.iter().map(|cell| cell.unwrap_or(mean) - mean).collect()
}

/// The brightness of a window, summed up so that the mean of any part of it is quickly known.
pub(crate) struct IntegralImage<'a> {
    window: &'a Window,
    /// Columns and rows; one more of each than there are pixels.
    size: [usize; 2],
    /// The sum over all pixels above and to the left.
    sums: Vec<f64>,
}

impl<'a> IntegralImage<'a> {
    pub(crate) fn of(window: &'a Window) -> Self {
        let plane = window.pyramid.plane(LEVEL);
        let size = plane.size_px().map(|n| n + 1);
        let mut sums = vec![0.0; size[0] * size[1]];
        for (v, row) in plane.rows().enumerate() {
            let mut along = 0.0;
            for (u, brightness) in row.iter().enumerate() {
                along += f64::from(*brightness);
                sums[(v + 1) * size[0] + u + 1] = sums[v * size[0] + u + 1] + along;
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
        if self.size.contains(&1) {
            return vec![None; columns * rows];
        }
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
        let least = LEAST_PART * (cell_px / pixel_px()).powi(2);
        let mut cells = Vec::with_capacity(columns * rows);
        let mut upper = sums_along(&down[0]);
        for v in down.windows(2) {
            let lower = sums_along(&v[1]);
            cells.extend(across.windows(2).enumerate().map(|(at, u)| {
                let area = v[0].to(&v[1]) * u[0].to(&u[1]);
                let sum = lower[at + 1] - lower[at] - upper[at + 1] + upper[at];
                (area >= least).then_some((sum / area) as f32)
            }));
            upper = lower;
        }
        cells
    }
}

/// The edge of a cell, as far as it lies in the image: between two sums.
struct Edge {
    index: usize,
    share: f64,
}

impl Edge {
    /// Returns the edge at a place among a number of sums.
    fn at(place: f64, count: usize) -> Self {
        let inside = place.clamp(0.0, count.saturating_sub(1) as f64);
        let index = (inside as usize).min(count.saturating_sub(2));
        Self { index, share: inside - index as f64 }
    }

    /// Returns the distance to another edge, in pixels of the level.
    fn to(&self, other: &Self) -> f64 {
        (other.index as f64 + other.share) - (self.index as f64 + self.share)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::{Camera, Channels, ImageView};
    use crate::pose::Twist;
    use crate::shape::{Body, Ellipsoid, Projection};

    const SIZE: [usize; 2] = [320, 240];
    const FOCAL_PX: f64 = 300.0;
    const RADIUS_M: f64 = 0.05;
    const KNOWN: [f64; 3] = [0.0, 0.0, 0.5];

    fn camera(size: [usize; 2]) -> Camera {
        let middle = size.map(|n| n as f64 / 2.0);
        Camera::new(size, [FOCAL_PX; 2], middle).unwrap()
    }

    fn solid() -> Solid {
        let ball = Ellipsoid::new(0, [0.0; 3], [RADIUS_M; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        Solid::new(&Body::new(Pose::identity(), vec![ball]).unwrap())
    }

    fn at([x, y, z]: [f64; 3]) -> Pose {
        Pose::exp(&Twist::new(x, y, z, 0.0, 0.0, 0.0))
    }

    /// Draws a printed disc where a ball is, and another pattern around it; `light` is a gain and an
    /// offset.
    fn drawn(place: [f64; 3], (gain, offset): (f64, f64), contrast: f64) -> Vec<u8> {
        let projection = Projection::new(&camera(SIZE), &Pose::identity());
        let middle = projection.pixel(&Vector3::from(place)).unwrap().0;
        let radius_px = FOCAL_PX * RADIUS_M / place[2];
        let brightness = |at: usize| {
            let (u, v) = ((at % SIZE[0]) as f64, (at / SIZE[0]) as f64);
            let (x, y) = ((u - middle.x) / radius_px, (v - middle.y) / radius_px);
            let print = libm::sin(4.0 * x + 1.0) * libm::cos(5.0 * y) + libm::sin(3.0 * x * y);
            let around = libm::sin(u / 17.0 + 0.4) * libm::cos(v / 13.0);
            let shown = if libm::hypot(x, y) < 1.0 { contrast * print } else { 30.0 * around };
            (gain * (110.0 + shown) + offset) as u8
        };
        (0..SIZE[0] * SIZE[1]).map(brightness).collect()
    }

    fn open(grey: &[u8], size: [usize; 2]) -> Window {
        let image = ImageView::new(grey, size, Channels::Grey).unwrap();
        let mut window = Window::default();
        window.open_all_over(&camera(size), &Pose::identity(), &image, None);
        window
    }

    fn taken(contrast: f64) -> Option<Thumbnail> {
        let window = open(&drawn(KNOWN, (1.0, 0.0), contrast), SIZE);
        Thumbnail::take(&window, (&solid(), &at(KNOWN)), |_| false)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn an_object_is_found_where_it_is_at_its_depth_and_in_other_light(
            (x, y) in (-0.3..0.3, -0.2..0.2),
            depth in 0.4..0.7,
            light in (0.5..1.2, 0.0..40.0),
        ) {
            let place = [x * depth, y * depth, depth];
            let window = open(&drawn(place, light, 40.0), SIZE);
            let found = taken(40.0).unwrap().search(&IntegralImage::of(&window), 0.3, 0.8);
            let best = found.into_iter().max_by(|a, b| a.correlation.total_cmp(&b.correlation));
            let best = best.unwrap();
            prop_assert!(best.correlation > 0.8, "{best:?}");
            let seen = window.point(&best.origin_px, best.depth).unwrap();
            // The nearest of the distances that are tried, or the one beside it.
            prop_assert!(libm::log(seen.z / depth).abs() < 1.5 * DISTANCE_STEP, "{seen}");
            let across = (seen / seen.z - Vector3::from(place) / depth).norm() * depth;
            prop_assert!(across < 0.2 * RADIUS_M, "{across}");
        }

        #[test]
        fn cells_of_an_even_image_are_even_up_to_its_border(
            (width, height) in (9_usize..60, 9_usize..60),
            (u, v) in (-9.0..9.0, -9.0..9.0),
            cell_px in 2.0..20.0,
        ) {
            let window = open(&vec![100; width * height], [width, height]);
            let cells = IntegralImage::of(&window).cells((Vector2::new(u, v), cell_px), [8, 8]);
            prop_assert!(cells.iter().flatten().all(|cell| (cell - 100.0).abs() < 1e-3));
        }
    }

    #[test]
    fn an_object_without_a_pattern_has_no_thumbnail_nor_has_one_that_is_hidden() {
        assert!(taken(40.0).is_some());
        assert!(taken(0.0).is_none());
        let window = open(&drawn(KNOWN, (1.0, 0.0), 40.0), SIZE);
        let half = |pixel: &Vector2<f64>| pixel.x < 160.0;
        let seen = Thumbnail::take(&window, (&solid(), &at(KNOWN)), half).unwrap();
        assert!(seen.cells.len() < taken(40.0).unwrap().cells.len() * 2 / 3);
        assert!(Thumbnail::take(&window, (&solid(), &at(KNOWN)), |_| true).is_none());
    }

    #[test]
    fn a_thumbnail_from_a_window_around_the_object_is_that_from_the_whole_image() {
        let grey = drawn(KNOWN, (1.0, 0.0), 40.0);
        let image = ImageView::new(&grey, SIZE, Channels::Grey).unwrap();
        let mut window = Window::default();
        let around = (&at(KNOWN), &solid(), 0.2);
        assert!(window.open(&camera(SIZE), &Pose::identity(), &image, around, None));
        assert!(window.place_px().0[0] > 0);
        let narrow = Thumbnail::take(&window, (&solid(), &at(KNOWN)), |_| false).unwrap();
        let whole = taken(40.0).unwrap();
        let pairs = narrow.cells.iter().zip(&whole.cells);
        assert_eq!(narrow.cells.len(), whole.cells.len());
        // Four pixels of the image, that begin elsewhere, are one of the level.
        assert!(pairs.map(|(a, b)| a.2 * b.2).sum::<f32>() > 0.98);
    }

    #[test]
    fn nothing_is_found_in_an_even_image_or_a_small_one_or_at_absurd_depths() {
        let thumbnail = taken(40.0).unwrap();
        for size in [SIZE, [20, 16], [3, 200]] {
            let window = open(&vec![90; size[0] * size[1]], size);
            assert!(thumbnail.search(&IntegralImage::of(&window), 0.3, 0.8).is_empty());
        }
        let window = open(&drawn(KNOWN, (1.0, 0.0), 40.0), SIZE);
        let image = IntegralImage::of(&window);
        let absurd = [
            (1e3, 1e4),
            (1e99, 1e100),
            (1e-9, 1e-8),
            (0.0, 0.0),
            (f64::NAN, 1.0),
            (0.5, f64::INFINITY),
        ];
        for (near, far) in absurd {
            assert!(thumbnail.search(&image, near, far).is_empty(), "{near} to {far}");
        }
    }
}
