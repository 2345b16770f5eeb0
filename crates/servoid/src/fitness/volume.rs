use super::overlap::{agreement, balance, clear};
use super::sums::boundary::{OutlineGradients, gradients as gradients_of};
use super::sums::rows::{RowOutline, RowOutlines, Sums};
use super::sums::sweep::sums as sums_of;
use super::{Backend, Differentiable, Evidence, Fitness, ScoreMap};
use crate::shape::{Body, Grid, Quadric, QuadricGradient, Section, SectionGradient};

/// The volumetric overlap, intersection over union, between the body and a solid.
///
/// The solid is cut into slices, and each slice is treated like an image: an ellipsoid covers one
/// interval of each row. The sums over the union are those of the region score, slice by slice.
#[derive(Debug, Clone)]
pub struct Volume {
    grid: Grid,
    slices: Vec<ScoreMap>,
    filled: f64,
    backend: Backend,
}

impl Volume {
    /// Cuts a filled grid into slices.
    #[must_use]
    pub fn new(grid: Grid) -> Self {
        let slices = slices(&grid, &balance(&grid.filled));
        let filled = grid.filled.iter().sum();
        Self { grid, slices, filled, backend: Backend::used() }
    }

    fn sums(&self, hypothesis: &[Quadric]) -> Sums {
        let sections = sections(&self.grid, hypothesis);
        let mut total = Sums::default();
        for (z, map) in self.slices.iter().enumerate() {
            let mut outlines = RowOutlines::new();
            for (_, section) in reaching(&sections, z) {
                if let Some(rows) = section.at(z as f64).and_then(|cut| RowOutline::new(&cut, map))
                {
                    outlines.push(rows);
                }
            }
            let sums = sums_of(self.backend, map, &outlines);
            total.score += sums.score;
            total.area += sums.area;
        }
        total
    }
}

/// A section with its index in the hypothesis and its first and last z.
type Reaching = (usize, Section, (f64, f64));

fn sections(grid: &Grid, hypothesis: &[Quadric]) -> Vec<Reaching> {
    let section = |(index, quadric): (usize, &Quadric)| {
        let section = Section::new(&grid.to_voxels(quadric))?;
        Some((index, section, section.extent()))
    };
    hypothesis.iter().take(Body::MAX_ELLIPSOIDS).enumerate().filter_map(section).collect()
}

/// Returns the sections that a slice cuts, with their indices in the list.
fn reaching(sections: &[Reaching], z: usize) -> impl Iterator<Item = (usize, &Section)> {
    let z = z as f64;
    let all = sections.iter().enumerate();
    all.filter(move |(_, (_, _, (first, last)))| *first < z && *last > z)
        .map(|(place, (_, section, _))| (place, section))
}

fn slices(grid: &Grid, scores: &[f64]) -> Vec<ScoreMap> {
    let [width, height, _] = grid.size;
    let slice = |scores: &[f64]| ScoreMap::from_scores(scores, [width, height], 1);
    scores.chunks_exact(width * height).map(slice).collect()
}

impl Fitness for Volume {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        agreement(self.sums(hypothesis), self.filled).0
    }
}

impl Differentiable for Volume {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        gradient.fill(QuadricGradient::default());
        let sections = sections(&self.grid, hypothesis);
        let mut by = vec![(SectionGradient::default(), SectionGradient::default()); sections.len()];
        let mut total = Sums::default();
        let (mut seen, mut moved) = (Vec::new(), Vec::new());
        for (z, map) in self.slices.iter().enumerate() {
            let mut outlines = RowOutlines::new();
            seen.clear();
            for (place, section) in reaching(&sections, z) {
                if let Some(rows) = section.at(z as f64).and_then(|cut| RowOutline::new(&cut, map))
                {
                    outlines.push(rows);
                    seen.push(place);
                }
            }
            moved.resize(seen.len(), OutlineGradients::default());
            let sums = gradients_of(self.backend, map, &outlines, &mut moved);
            total.score += sums.score;
            total.area += sums.area;
            for (&place, moved) in seen.iter().zip(&moved) {
                let section = &sections[place].1;
                section.add_slopes(z as f64, &moved.score, &mut by[place].0);
                section.add_slopes(z as f64, &moved.area, &mut by[place].1);
            }
        }
        let (score, by_score, by_area) = agreement(total, self.filled);
        for ((index, section, _), (of_score, of_area)) in sections.iter().zip(&by) {
            let sum = of_score.scaled(by_score).plus(&of_area.scaled(by_area));
            let quadric = self.grid.to_voxels(&hypothesis[*index]);
            gradient[*index] = self.grid.from_voxels(&section.pull_back(&quadric, &sum));
        }
        score
    }
}

impl Evidence for Volume {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        let mut scores = balance(&self.grid.filled);
        let [width, height, _] = self.grid.size;
        for (_, section, _) in sections(&self.grid, current) {
            for (z, slice) in scores.chunks_exact_mut(width * height).enumerate() {
                if let Some(cut) = section.at(z as f64) {
                    clear(slice, width, &cut);
                }
            }
        }
        Box::new(OpenVolume(Self { slices: slices(&self.grid, &scores), ..self.clone() }))
    }
}

/// A volume with filled cells that no longer count.
struct OpenVolume(Volume);

impl Fitness for OpenVolume {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        self.0.sums(hypothesis).score / self.0.filled.max(1.0)
    }
}
