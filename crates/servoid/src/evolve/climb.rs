/// Settings of a gradient ascent.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct ClimbSettings {
    /// Most steps.
    pub steps: usize,
    /// Length of the first step, in the units of the variables.
    pub first_step: f64,
    /// Least gain per step, averaged over a few steps.
    pub least_gain: f64,
}

impl ClimbSettings {
    /// Makes settings of the three fields, in their order.
    #[must_use]
    pub const fn new(steps: usize, first_step: f64, least_gain: f64) -> Self {
        Self { steps, first_step, least_gain }
    }
}

/// The result of a gradient ascent.
#[derive(Debug, Clone, PartialEq)]
pub struct Climb {
    /// The variables.
    pub at: Vec<f64>,
    /// Their score.
    pub score: f64,
    /// Number of evaluations of the score.
    pub evaluations: usize,
}

/// Pairs of steps and slope changes that approximate the curvature.
const MEMORY: usize = 8;
/// Share of the predicted gain that a step must reach (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Halvings of a step before its direction is given up.
const HALVINGS: usize = 10;
/// Steps over which the gain is averaged.
const PATIENCE: usize = 5;

/// Maximises a score along its gradient by limited-memory BFGS with a backtracking line search;
/// never ends below its start.
///
/// `slope(at, gradient)` writes the gradient and returns the score.
///
/// Source: Nocedal, *Updating quasi-Newton matrices with limited storage* (1980).
pub fn climb(
    start: &[f64],
    settings: &ClimbSettings,
    mut slope: impl FnMut(&[f64], &mut [f64]) -> f64,
) -> Climb {
    let mut here = Place { at: start.to_vec(), uphill: vec![0.0; start.len()], score: 0.0 };
    here.score = slope(&here.at, &mut here.uphill);
    let mut next = here.clone();
    let mut evaluations = 1;
    let mut history = History::default();
    let mut reached = vec![here.score];
    for _ in 0..settings.steps {
        let fresh = history.is_empty();
        let direction = history.direction(&here.uphill);
        let rise = dot(&direction, &here.uphill);
        // Ends also if the slope is not a number.
        let rises = rise > 0.0 && rise.is_finite();
        let first =
            if fresh { settings.first_step / dot(&direction, &direction).sqrt() } else { 1.0 };
        let tries =
            if rises { search(&here, &mut next, &direction, first, &mut slope) } else { None };
        evaluations += tries.unwrap_or(if rises { HALVINGS } else { 0 });
        if tries.is_none() {
            if fresh {
                break;
            }
            history = History::default();
            continue;
        }
        history.push(&here, &next);
        std::mem::swap(&mut here, &mut next);
        reached.push(here.score);
        let before = reached[reached.len().saturating_sub(PATIENCE + 1)];
        let gain = here.score - before;
        if reached.len() > PATIENCE && gain < settings.least_gain * PATIENCE as f64 {
            break;
        }
    }
    Climb { at: here.at, score: here.score, evaluations }
}

#[derive(Clone)]
struct Place {
    at: Vec<f64>,
    uphill: Vec<f64>,
    score: f64,
}

/// Halves a step until it gains enough; returns the number of tries, or `None` if no step does.
fn search(
    here: &Place,
    next: &mut Place,
    direction: &[f64],
    first: f64,
    slope: &mut impl FnMut(&[f64], &mut [f64]) -> f64,
) -> Option<usize> {
    let rise = dot(direction, &here.uphill);
    let mut share = first;
    for tries in 1..=HALVINGS {
        for (to, (from, by)) in next.at.iter_mut().zip(here.at.iter().zip(direction)) {
            *to = from + share * by;
        }
        next.score = slope(&next.at, &mut next.uphill);
        if next.score >= here.score + SUFFICIENT * share * rise {
            return Some(tries);
        }
        share *= 0.5;
    }
    None
}

#[derive(Default)]
struct History {
    steps: Vec<Vec<f64>>,
    bends: Vec<Vec<f64>>,
}

impl History {
    fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    fn push(&mut self, here: &Place, next: &Place) {
        let step: Vec<f64> = next.at.iter().zip(&here.at).map(|(b, a)| b - a).collect();
        let bend: Vec<f64> = here.uphill.iter().zip(&next.uphill).map(|(a, b)| a - b).collect();
        // Only a step along which the slope decreases gives information about a maximum.
        if dot(&step, &bend) > 1e-10 * dot(&bend, &bend) {
            if self.steps.len() == MEMORY {
                self.steps.remove(0);
                self.bends.remove(0);
            }
            self.steps.push(step);
            self.bends.push(bend);
        }
    }

    /// The two-loop recursion.
    fn direction(&self, uphill: &[f64]) -> Vec<f64> {
        let mut out = uphill.to_vec();
        let pairs = || self.steps.iter().zip(&self.bends);
        let mut shares = Vec::with_capacity(self.steps.len());
        for (step, bend) in pairs().rev() {
            let share = dot(step, &out) / dot(step, bend);
            add(&mut out, -share, bend);
            shares.push(share);
        }
        if let (Some(step), Some(bend)) = (self.steps.last(), self.bends.last()) {
            let scale = dot(step, bend) / dot(bend, bend);
            out.iter_mut().for_each(|x| *x *= scale);
        }
        for ((step, bend), share) in pairs().zip(shares.iter().rev()) {
            let back = share - dot(bend, &out) / dot(step, bend);
            add(&mut out, back, step);
        }
        out
    }
}

fn dot(one: &[f64], two: &[f64]) -> f64 {
    one.iter().zip(two).map(|(a, b)| a * b).sum()
}

fn add(out: &mut [f64], scale: f64, other: &[f64]) {
    out.iter_mut().zip(other).for_each(|(x, y)| *x += scale * y);
}
