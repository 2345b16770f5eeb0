//! Where an image shows the boundary of the object, by its colours.

use nalgebra::{Vector2, Vector3};

use super::colors::Colors;
use super::sides::{cut, holds, scores};
use super::solid::Solid;
use crate::camera::ImageView;
use crate::pose::Pose;
use crate::track::frame::window::Window;

/// The outer boundary of the object in an image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Look {
    /// Points about evenly along the boundary, in pixels, and the directions out of the object.
    pub(crate) points: Vec<(Vector2<f64>, Vector2<f64>)>,
}

/// Distance beyond the body's outline up to which pixels may belong to the object, as a share of the
/// window.
const BEYOND: f64 = 0.12;
/// Most and least points of a boundary.
const POINTS: f64 = 110.0;
const FEWEST: usize = 24;
/// Pixels at the edge of a window whose scores are unknown.
const EDGE: usize = 4;
/// Largest share of a boundary at the edge of what may belong to the object.
const CUT: f64 = 0.05;
/// Distance, in pixels, up to which the boundary is straight.
const STRAIGHT_PX: f64 = 3.0;

/// What is known of a pixel.
#[derive(Clone, Copy, PartialEq)]
enum Region {
    Unknown,
    Object,
    Outside,
}

impl Look {
    /// Finds the boundary in an open window, where the body is believed to be at a pose; none if the
    /// colours do not show all of it.
    pub(crate) fn find(
        (window, image): (&Window, &ImageView<'_>),
        (solid, pose): (&Solid, &Pose),
        colors: &Colors,
    ) -> Option<Self> {
        let (first, size) = window.place_px();
        let projection = window.projection(pose)?.shifted(first.map(|at| at as f64));
        let pixels = cut(image, first, size);
        let image = ImageView::new(&pixels, size, image.channels()).ok()?;
        let (middle, _) = projection.pixel(&Vector3::zeros())?;
        let scores = scores(&image, colors, &middle);
        let outlines: Vec<_> = solid.outlines(&projection).collect();
        let beyond = BEYOND * size[0].max(size[1]) as f64;
        let inside = |by_px: f64, at: usize| holds(&outlines, by_px, [at % size[0], at / size[0]]);
        let mut map = Map { regions: vec![Region::Unknown; scores.len()], size, scores };
        let seeds = (0..map.scores.len()).filter(|&at| map.scores[at] > 0.0 && inside(0.0, at));
        let seeds: Vec<_> = seeds.collect();
        let may = |map: &Map, at: usize| map.scores[at] > 0.0 && inside(beyond, at);
        map.fill(seeds, Region::Object, may);
        map.fill(map.border(), Region::Outside, |_, _| true);
        map.boundary(first)
    }

    /// Returns the distance of a pixel outside of the boundary, and its gradient.
    pub(crate) fn outside(&self, pixel: &Vector2<f64>) -> Option<(f64, Vector2<f64>)> {
        let away = |(at, _): &&(Vector2<f64>, Vector2<f64>)| (pixel - at).norm_squared();
        let (place, normal) = self.points.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let way = pixel - place;
        let (across, length) = (normal.dot(&way), way.norm());
        if length < STRAIGHT_PX {
            return Some((across, *normal));
        }
        let sign = if across > 0.0 { 1.0 } else { -1.0 };
        Some((sign * length, way * (sign / length)))
    }
}

/// The scores of a window's pixels, and what they are.
struct Map {
    regions: Vec<Region>,
    size: [usize; 2],
    scores: Vec<f32>,
}

impl Map {
    fn border(&self) -> Vec<usize> {
        let [width, height] = self.size;
        let sides = (0..height).flat_map(|v| [v * width, v * width + width - 1]);
        (0..width).flat_map(|u| [u, (height - 1) * width + u]).chain(sides).collect()
    }

    /// Gives all unknown pixels that are connected with some a region.
    fn fill(&mut self, from: Vec<usize>, region: Region, may: impl Fn(&Self, usize) -> bool) {
        let mut open = from;
        while let Some(at) = open.pop() {
            if self.regions[at] != Region::Unknown || !may(self, at) {
                continue;
            }
            self.regions[at] = region;
            open.extend(self.neighbours(at));
        }
    }

    fn neighbours(&self, at: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size;
        let (u, v) = (at % width, at / width);
        let left = (u > 0).then(|| at - 1);
        let right = (u + 1 < width).then(|| at + 1);
        let above = (v > 0).then(|| at - width);
        let below = (v + 1 < height).then(|| at + width);
        [left, right, above, below].into_iter().flatten()
    }

    /// Returns the boundary between object and outside, to a fraction of a pixel.
    fn boundary(&self, first: [usize; 2]) -> Option<Look> {
        let [width, height] = self.size;
        let (mut all, mut cut_off) = (Vec::new(), 0);
        for v in EDGE..height.saturating_sub(EDGE) {
            for u in EDGE..width.saturating_sub(EDGE) {
                let at = v * width + u;
                if self.regions[at] != Region::Object {
                    continue;
                }
                let (right, down) = (Vector2::x(), Vector2::y());
                let sides =
                    [(at - 1, -right), (at + 1, right), (at - width, -down), (at + width, down)];
                for (next, way) in sides {
                    if self.regions[next] != Region::Outside {
                        continue;
                    }
                    let (here, there) = (self.scores[at], self.scores[next]);
                    if there > 0.0 {
                        cut_off += 1;
                        continue;
                    }
                    let part = f64::from(here / (here - there));
                    let place = Vector2::new(u as f64, v as f64) + way * part;
                    let outward = Vector2::new(
                        f64::from(self.scores[at - 1] - self.scores[at + 1]),
                        f64::from(self.scores[at - width] - self.scores[at + width]),
                    );
                    if let Some(outward) = outward.try_normalize(1e-6) {
                        all.push((place + Vector2::new(first[0] as f64, first[1] as f64), outward));
                    }
                }
            }
        }
        let whole = f64::from(cut_off) <= CUT * all.len() as f64;
        let points = thinned(&all);
        (whole && points.len() >= FEWEST).then_some(Look { points })
    }
}

/// Keeps points that are about evenly apart.
fn thinned(all: &[(Vector2<f64>, Vector2<f64>)]) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let apart = all.len() as f64 * 0.7 / POINTS;
    let mut kept: Vec<(Vector2<f64>, Vector2<f64>)> = Vec::new();
    for one in all {
        if kept.iter().all(|other| (other.0 - one.0).norm_squared() >= apart * apart) {
            kept.push(*one);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scores of a disc, with a hole in it, and of a bar that leads away from it.
    fn map(bar: bool) -> Map {
        let size = [100, 80];
        let (mut scores, mut may) = (Vec::new(), Vec::new());
        for at in 0..size[0] * size[1] {
            let way = Vector2::new((at % 100) as f64 - 50.0, (at / 100) as f64 - 40.0);
            let disc = 25.0 - way.norm();
            let hole = (way - Vector2::new(8.0, 0.0)).norm() - 6.0;
            let inside =
                disc.min(hole).max(if bar && way.x > 0.0 { 15.0 - way.y.abs() } else { -99.0 });
            scores.push(inside as f32);
            may.push(way.norm() < 35.0);
        }
        let mut map = Map { regions: vec![Region::Unknown; scores.len()], size, scores };
        map.fill(vec![40 * 100 + 35], Region::Object, |map, at| map.scores[at] > 0.0 && may[at]);
        map.fill(map.border(), Region::Outside, |_, _| true);
        map
    }

    #[test]
    fn a_boundary_is_the_outer_one_to_a_fraction_of_a_pixel() {
        let look = map(false).boundary([7, 3]).unwrap();
        assert!(look.points.len() > 60);
        for (place, outward) in &look.points {
            let way = place - Vector2::new(57.0, 43.0);
            assert!(
                (way.norm() - 25.0).abs() < 0.2 && outward.dot(&way.normalize()) > 0.98,
                "{place}"
            );
        }
        let (off, by) = look.outside(&Vector2::new(57.0, 43.0 + 26.5)).unwrap();
        assert!((off - 1.5).abs() < 0.3 && by.y > 0.95);
    }

    #[test]
    fn there_is_no_boundary_where_the_surroundings_have_the_colours_of_the_object() {
        assert!(map(true).boundary([0, 0]).is_none());
    }
}
