use std::sync::{Mutex, PoisonError};

use super::best_by_count::BestByCount;
use super::progressive::{Progress, Step};
use super::{ModelError, Settings};

/// Tells the caller how far the lines of growth have come. It has no part in the result.
pub(super) struct Watch<'a> {
    fits: usize,
    seen: Mutex<Seen<'a>>,
}

struct Seen<'a> {
    done: usize,
    stopped: bool,
    count: usize,
    fitness: f64,
    progress: Progress<'a>,
}

impl<'a> Watch<'a> {
    pub fn new(settings: &Settings, progress: Progress<'a>) -> Self {
        let line = settings.max_ellipsoids + settings.overshoot + 1;
        let fits = settings.lines * line + settings.lines * settings.lines.saturating_sub(1) / 2;
        Self {
            fits,
            seen: Mutex::new(Seen { done: 0, stopped: false, count: 0, fitness: 0.0, progress }),
        }
    }

    /// Counts one fit; tells the greatest body so far.
    pub fn report(&self, by_count: &BestByCount, count: usize) -> Result<(), ModelError> {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        seen.done += 1;
        let better = (count, by_count.fitness(count)) > (seen.count, seen.fitness);
        if better {
            (seen.count, seen.fitness) = (count, by_count.fitness(count));
        }
        let share = (seen.done as f64 / (self.fits + 1) as f64).min(1.0);
        let (count, fitness) = (seen.count, seen.fitness);
        seen.tell(count, fitness, share)
    }

    /// Tells what came out.
    pub fn finish(&self, steps: &[Step]) -> Result<(), ModelError> {
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        let fitness = steps.last().map_or(0.0, |step| step.fitness);
        seen.tell(steps.len(), fitness, 1.0)
    }
}

impl Seen<'_> {
    /// Tells the caller; once it has refused, nothing is told any more and all lines stop.
    fn tell(&mut self, count: usize, fitness: f64, share: f64) -> Result<(), ModelError> {
        self.stopped = self.stopped || !(self.progress)(count, fitness, share);
        if self.stopped { Err(ModelError::Stopped) } else { Ok(()) }
    }
}
