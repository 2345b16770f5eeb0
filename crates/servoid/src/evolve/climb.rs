/// When a climb ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClimbSettings {
    /// Most steps.
    pub steps: usize,
    /// Length of the first step, in the units of the numbers.
    pub first_step: f64,
    /// Least gain a step, as an average over [`PATIENCE`] steps.
    pub least_gain: f64,
}

/// What a climb reached.
#[derive(Debug, Clone, PartialEq)]
pub struct Climb {
    /// The numbers.
    pub at: Vec<f64>,
    /// Their score.
    pub score: f64,
    /// How often the score was asked for.
    pub evaluations: usize,
}

/// Pairs of steps and slope changes that stand for the curvature.
const MEMORY: usize = 8;
/// Share of the predicted gain that a step must reach (Armijo).
const SUFFICIENT: f64 = 1e-4;
/// Halvings of a step before the climb gives up on its direction.
const HALVINGS: usize = 10;
/// Steps over which the gain is averaged.
const PATIENCE: usize = 5;

/// Climbs a score along its gradient by limited-memory BFGS with a backtracking search; never
/// ends below its start.
///
/// `slope(at, gradient)` writes the gradient and gives the score.
///
/// Source: Nocedal, *Updating quasi-Newton matrices with limited storage* (1980).
pub fn climb(
    start: &[f64],
    settings: &ClimbSettings,
    mut slope: impl FnMut(&[f64], &mut [f64]) -> f64,
) -> Climb {
    let size = start.len();
    let (mut at, mut uphill) = (start.to_vec(), vec![0.0; size]);
    let mut score = slope(&at, &mut uphill);
    let mut evaluations = 1;
    let mut history = History::default();
    let mut reached = vec![score];
    let (mut next, mut next_uphill) = (vec![0.0; size], vec![0.0; size]);
    for _ in 0..settings.steps {
        let mut direction = history.direction(&uphill);
        let mut rise = dot(&direction, &uphill);
        if !(rise > 0.0) {
            history = History::default();
            direction = uphill.clone();
            rise = dot(&direction, &uphill);
        }
        if !(rise > 0.0 && rise.is_finite()) {
            break;
        }
        let mut share =
            if history.is_empty() { settings.first_step / dot(&direction, &direction).sqrt() } else { 1.0 };
        let mut found = None;
        for _ in 0..HALVINGS {
            for (to, (from, by)) in next.iter_mut().zip(at.iter().zip(&direction)) {
                *to = from + share * by;
            }
            let there = slope(&next, &mut next_uphill);
            evaluations += 1;
            if there >= score + SUFFICIENT * share * rise {
                found = Some(there);
                break;
            }
            share *= 0.5;
        }
        let Some(there) = found else {
            if history.is_empty() {
                break;
            }
            history = History::default();
            continue;
        };
        history.push(&at, &next, &uphill, &next_uphill);
        std::mem::swap(&mut at, &mut next);
        std::mem::swap(&mut uphill, &mut next_uphill);
        score = there;
        reached.push(score);
        let before = reached[reached.len().saturating_sub(PATIENCE + 1)];
        if reached.len() > PATIENCE && score - before < settings.least_gain * PATIENCE as f64 {
            break;
        }
    }
    Climb { at, score, evaluations }
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

    fn push(&mut self, from: &[f64], to: &[f64], uphill: &[f64], next_uphill: &[f64]) {
        let step: Vec<f64> = to.iter().zip(from).map(|(b, a)| b - a).collect();
        let bend: Vec<f64> = uphill.iter().zip(next_uphill).map(|(a, b)| a - b).collect();
        // Only a step along which the slope falls tells of a summit.
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
