//! Occlusion map: for each camera a grid of cells over the object's image, with the log-odds that
//! the object is visible there. What was hidden a moment ago probably still is, so the grid has a
//! memory; each image adds the evidence of its surface points, colours and depths.

use nalgebra::Vector2;

use super::rangefinder::Rangefinder;
use super::window::bounds;
use crate::pose::Pose;
use crate::shape::Outline;
use crate::track::inputs::Inputs;
use crate::track::target::points::Match;
use crate::track::target::solid::Solid;

/// The occlusion maps of all cameras.
#[derive(Debug, Clone, Default)]
pub(crate) struct Occlusion {
    grids: Vec<Grid>,
}

/// Whether the object was at this pose a moment ago: only then is what is not seen assumed to be
/// hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LastSeen {
    There,
    Elsewhere,
}

/// Cells along one side of a grid.
const SIDE: usize = 12;
const CELLS: usize = SIDE * SIDE;
/// Log-odds that a cell without evidence shows the object.
const PRIOR: f64 = 1.5;
/// Largest log-odds.
const MOST_LOG_ODDS: f64 = 3.0;
/// Share of the previous log-odds that is kept for the next image.
const KEPT: f64 = 0.5;
/// Log-odds contributed by a surface point that is recognised, and by one that is not, and the
/// bounds of their sum in a cell.
const POINT: (f64, f64) = (1.5, -1.0);
const POINTS: (f64, f64) = (-2.0, 3.0);
/// Correlation below which a point is not recognised, and above which it is.
const RECOGNISED: (f64, f64) = (0.4, 0.6);
/// Log-odds contributed by colours, per reference log-likelihood ratio above `STRANGE`, and their
/// maximum.
const COLOR: f64 = 3.0;
const COLORS: f64 = 2.5;
/// Share of the object's reference log-likelihood ratio below which colours are foreign.
const STRANGE: f64 = 0.25;
/// Log-odds contributed by a measured depth: of something in front of the body by more than a part
/// of its radius, and of the body itself.
const DEPTH: (f64, f64) = (-4.0, 1.0);
const BEFORE: f64 = 0.35;
/// Positions along one side of a cell whose colours are sampled.
const SAMPLES: usize = 3;
/// Probabilities between which a cell passes from clear to hidden.
const HIDDEN: (f64, f64) = (0.3, 0.7);

/// A camera's cells over the object's image; they move and scale with it.
#[derive(Debug, Clone)]
struct Grid {
    first: Vector2<f64>,
    cell_px: f64,
    /// Log-odds before the newest image.
    before: [f64; CELLS],
    /// Evidence of the newest image.
    evidence: [f64; CELLS],
    /// Probability that something hides the object.
    hidden: [f64; CELLS],
    /// Mean log-likelihood ratio, if the cell is inside the body's outline.
    ratios: [Option<f64>; CELLS],
}

impl Grid {
    fn new() -> Self {
        Self {
            first: Vector2::zeros(),
            cell_px: 1.0,
            before: [PRIOR; CELLS],
            evidence: [0.0; CELLS],
            hidden: [0.0; CELLS],
            ratios: [None; CELLS],
        }
    }

    /// Returns the cell that contains a pixel.
    fn cell(&self, pixel: &Vector2<f64>) -> Option<usize> {
        let at = (pixel - self.first) / self.cell_px;
        let inside = at.iter().all(|x| (0.0..SIDE as f64).contains(x));
        inside.then(|| at.y as usize * SIDE + at.x as usize)
    }

    /// Places the cells over outlines.
    fn lay(&mut self, outlines: &[Outline]) -> bool {
        let Some((low, high)) = bounds(outlines.iter().copied()) else { return false };
        self.cell_px = (high - low).amax().max(1.0) / SIDE as f64;
        self.first = (low + high) * 0.5 - Vector2::repeat(0.5 * SIDE as f64 * self.cell_px);
        true
    }

    fn middle(&self, cell: usize) -> Vector2<f64> {
        let at = Vector2::new((cell % SIDE) as f64 + 0.5, (cell / SIDE) as f64 + 0.5);
        self.first + at * self.cell_px
    }

    /// Reads the colours of the cells inside outlines.
    fn read(&mut self, outlines: &[Outline], ratio: impl Fn(f64, f64) -> Option<f64>) {
        let step = self.cell_px / SAMPLES as f64;
        for cell in 0..CELLS {
            let middle = self.middle(cell);
            self.ratios[cell] = None;
            if !outlines.iter().any(|outline| outline.contains(&middle)) {
                continue;
            }
            let (mut sum, mut count) = (0.0, 0.0);
            for at in 0..SAMPLES * SAMPLES {
                let by = Vector2::new((at % SAMPLES) as f64, (at / SAMPLES) as f64)
                    - Vector2::repeat(0.5 * (SAMPLES - 1) as f64);
                let pixel = middle + by * step;
                if let Some(ratio) = ratio(pixel.x, pixel.y) {
                    sum += ratio;
                    count += 1.0;
                }
            }
            if count > 0.0 {
                self.ratios[cell] = Some(sum / count);
            }
        }
    }

    /// Adds the evidence of a depth image about what lies in front of the object, in the cells
    /// inside outlines.
    fn measure(&mut self, outlines: &[Outline], is_before: impl Fn(&Vector2<f64>) -> Option<bool>) {
        for cell in 0..CELLS {
            let middle = self.middle(cell);
            if !outlines.iter().any(|outline| outline.contains(&middle)) {
                continue;
            }
            match is_before(&middle) {
                Some(true) => self.evidence[cell] += DEPTH.0,
                Some(false) => self.evidence[cell] += DEPTH.1,
                None => {}
            }
        }
    }

    /// Combines the previous state with the evidence of the newest image in each cell and around
    /// it.
    fn conclude(&mut self, last_seen: LastSeen) {
        for cell in 0..CELLS {
            self.hidden[cell] = match last_seen {
                LastSeen::There => 1.0 / (1.0 + libm::exp(self.odds(cell))),
                LastSeen::Elsewhere => 0.0,
            };
        }
    }

    fn odds(&self, cell: usize) -> f64 {
        let (around, count) = self.around(&self.evidence, cell);
        let evidence = if count > 0.0 {
            0.5 * (self.evidence[cell] + around / count)
        } else {
            self.evidence[cell]
        };
        (self.before[cell] + evidence).clamp(-MOST_LOG_ODDS, MOST_LOG_ODDS)
    }

    /// Sums the evidence of those of the eight neighbours of a cell that have any; also returns
    /// their number.
    fn around(&self, of: &[f64; CELLS], cell: usize) -> (f64, f64) {
        let (column, row) = (cell % SIDE, cell / SIDE);
        let (mut sum, mut count) = (0.0, 0.0);
        for beside in row.saturating_sub(1)..=(row + 1).min(SIDE - 1) {
            for next in column.saturating_sub(1)..=(column + 1).min(SIDE - 1) {
                let at = beside * SIDE + next;
                if at != cell && self.ratios[at].is_some() {
                    sum += of[at];
                    count += 1.0;
                }
            }
        }
        (sum, count)
    }

    /// Stores the newest state as the previous one.
    fn remember(&mut self) {
        let mut before = [PRIOR; CELLS];
        for (cell, odds) in before.iter_mut().enumerate() {
            *odds = PRIOR + KEPT * (self.odds(cell) - PRIOR);
        }
        self.before = before;
    }
}

impl Occlusion {
    /// Resets the map.
    pub(crate) fn forget(&mut self) {
        self.grids.iter_mut().for_each(|grid| *grid = Grid::new());
    }

    /// Updates for each cell whether the object is visible there at a pose. Colours are compared
    /// with their usual log-likelihood ratio, the reference.
    pub(crate) fn observe(
        &mut self,
        inputs: &Inputs<'_>,
        (pose, last_seen): (&Pose, LastSeen),
        matches: &[Match],
        outlines: &mut Vec<Outline>,
    ) {
        while self.grids.len() < inputs.windows.len() {
            self.grids.push(Grid::new());
        }
        for (camera, grid) in self.grids.iter_mut().enumerate() {
            grid.evidence = [0.0; CELLS];
            grid.ratios = [None; CELLS];
            outlines.clear();
            if let Some(projection) = inputs.windows[camera].projection(pose) {
                outlines.extend(inputs.solid.outlines(&projection));
            }
            if !grid.lay(outlines) {
                continue;
            }
            let window = &inputs.windows[camera];
            if let (Some(colors), Some(image)) = (inputs.colors, &inputs.images[camera]) {
                grid.read(outlines, |u, v| window.ratio(image, colors, u, v));
            }
            if let Some(seen) = inputs.rangefinder(camera, pose) {
                grid.measure(outlines, |pixel| before(&seen, inputs.solid, pixel));
            }
        }
        for seen in matches.iter().filter(|seen| !seen.is_edgel) {
            let grid = &mut self.grids[seen.view.camera];
            let Some(cell) = seen.pixel.and_then(|pixel| grid.cell(&pixel)) else { continue };
            let correlation = seen.agreement.map_or(0.0, |agreement| agreement.correlation);
            if correlation > RECOGNISED.1 {
                grid.evidence[cell] += POINT.0;
            } else if correlation < RECOGNISED.0 {
                grid.evidence[cell] += POINT.1;
            }
        }
        let reference = inputs.reference.ratio;
        for grid in &mut self.grids {
            for (evidence, ratio) in grid.evidence.iter_mut().zip(&grid.ratios) {
                *evidence = evidence.clamp(POINTS.0, POINTS.1);
                if let Some(ratio) = ratio.filter(|_| reference > 0.0) {
                    *evidence += (COLOR * (ratio / reference - STRANGE)).clamp(-COLORS, COLORS);
                }
            }
            grid.conclude(last_seen);
        }
    }

    /// Stores what was observed last as the previous state.
    pub(crate) fn remember(&mut self) {
        self.grids.iter_mut().for_each(Grid::remember);
    }

    /// Returns how far a pixel's cell counts as hidden, 0 to 1.
    pub(crate) fn hides(&self, camera: usize, pixel: &Vector2<f64>) -> f64 {
        let hidden = self.grids.get(camera).and_then(|grid| Some(grid.hidden[grid.cell(pixel)?]));
        hidden.map_or(0.0, share)
    }

    /// Returns the mean log-likelihood ratio of the clear cells, and their share; none if no cell
    /// inside the outline is clear.
    pub(crate) fn clear(&self) -> Option<(f64, f64)> {
        let (mut sum, mut clear, mut all) = (0.0, 0.0, 0.0);
        for grid in &self.grids {
            for (ratio, hidden) in grid.ratios.iter().zip(&grid.hidden) {
                if let Some(ratio) = ratio {
                    let shows = 1.0 - share(*hidden);
                    sum += shows * ratio;
                    clear += shows;
                    all += 1.0;
                }
            }
        }
        (clear > 0.0).then(|| (sum / clear, clear / all))
    }
}

/// Returns whether a depth image shows something well in front of the body at a pixel, or the body
/// itself; none if it shows something behind the body, or nothing.
fn before(seen: &Rangefinder<'_>, solid: &Solid, pixel: &Vector2<f64>) -> Option<bool> {
    let (behind, _) = seen.behind(solid, pixel)?;
    let most = BEFORE * solid.radius;
    (behind < most).then_some(behind < -most)
}

/// Maps the probability that a cell is hidden to how far it counts as hidden.
fn share(probability: f64) -> f64 {
    ((probability - HIDDEN.0) / (HIDDEN.1 - HIDDEN.0)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid whose cells all contain the object and have the same evidence.
    fn grid_of(evidence: f64) -> Grid {
        Grid { ratios: [Some(1.0); CELLS], evidence: [evidence; CELLS], ..Grid::new() }
    }

    fn hidden(grid: &mut Grid) -> f64 {
        grid.conclude(LastSeen::There);
        grid.hidden[CELLS / 2]
    }

    #[test]
    fn what_was_hidden_a_moment_ago_is_thought_hidden_sooner_than_what_was_clear() {
        let (mut covered, mut clear) = (grid_of(-4.0), grid_of(4.0));
        for _ in 0..5 {
            covered.remember();
            clear.remember();
        }
        for evidence in [-4.0, -2.0, 0.0, 2.0] {
            (covered.evidence, clear.evidence) = ([evidence; CELLS], [evidence; CELLS]);
            assert!(hidden(&mut covered) > hidden(&mut clear), "{evidence}");
        }
    }

    #[test]
    fn a_cell_without_evidence_returns_to_its_prior_and_counts_as_clear() {
        let mut grid = grid_of(-5.0);
        grid.remember();
        assert!(share(hidden(&mut grid)) > 0.9);
        grid.evidence = [0.0; CELLS];
        for _ in 0..20 {
            grid.remember();
        }
        assert!(share(hidden(&mut grid)) == 0.0);
        assert!((grid.before[0] - PRIOR).abs() < 1e-3);
    }

    #[test]
    fn a_cell_whose_evidence_contradicts_all_around_it_has_less_weight() {
        let mut grid = grid_of(4.0);
        let alone = CELLS / 2;
        grid.evidence[alone] = -4.0;
        grid.conclude(LastSeen::There);
        assert!(share(grid.hidden[alone]) < 0.1, "{}", grid.hidden[alone]);
        let mut all = grid_of(-4.0);
        assert!(hidden(&mut all) > grid.hidden[alone]);
    }

    #[test]
    fn nothing_hides_an_object_that_was_not_there_a_moment_ago() {
        let mut grid = grid_of(-5.0);
        grid.conclude(LastSeen::Elsewhere);
        let (first, middle) = (grid.first, grid.middle(CELLS / 2));
        let mut occlusion = Occlusion { grids: vec![grid] };
        assert_eq!(occlusion.hides(0, &middle), 0.0);
        assert_eq!(occlusion.clear().map(|(_, share)| share), Some(1.0));
        occlusion.grids[0].conclude(LastSeen::There);
        assert!(occlusion.hides(0, &middle) > 0.9);
        assert_eq!(
            occlusion.hides(0, &(first - Vector2::repeat(1.0))),
            0.0,
            "outside of all cells"
        );
        assert_eq!(occlusion.hides(1, &middle), 0.0, "a camera that never looked");
        occlusion.forget();
        assert_eq!(occlusion.hides(0, &middle), 0.0);
    }

    #[test]
    fn each_place_lies_in_its_cell() {
        let grid = Grid { first: Vector2::new(-7.0, 12.5), cell_px: 3.25, ..Grid::new() };
        for cell in 0..CELLS {
            assert_eq!(grid.cell(&grid.middle(cell)), Some(cell));
        }
    }
}
