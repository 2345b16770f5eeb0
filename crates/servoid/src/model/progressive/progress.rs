use std::sync::{Mutex, PoisonError};

use super::best_by_count::BestByCount;
use crate::model::progressive::{Progress, Step};
use crate::model::{ModelError, Settings};

/// Reports the progress of the lines of growth to the caller. It does not affect the result.
pub(in crate::model) struct ProgressReporter<'a> {
    fits: usize,
    state: Mutex<State<'a>>,
}

struct State<'a> {
    done: usize,
    stopped: bool,
    count: usize,
    fitness: f64,
    progress: Progress<'a>,
}

impl<'a> ProgressReporter<'a> {
    pub fn new(settings: &Settings, progress: Progress<'a>) -> Self {
        let line = settings.max_ellipsoids + settings.overshoot + 1;
        let fits = settings.lines * line + settings.lines * settings.lines.saturating_sub(1) / 2;
        Self {
            fits,
            state: Mutex::new(State { done: 0, stopped: false, count: 0, fitness: 0.0, progress }),
        }
    }

    /// Counts one fit; reports the greatest body so far.
    pub fn report(&self, by_count: &BestByCount, count: usize) -> Result<(), ModelError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += 1;
        let better = (count, by_count.fitness(count)) > (state.count, state.fitness);
        if better {
            (state.count, state.fitness) = (count, by_count.fitness(count));
        }
        let share = (state.done as f64 / (self.fits + 1) as f64).min(1.0);
        let (count, fitness) = (state.count, state.fitness);
        state.report(count, fitness, share)
    }

    /// Reports the final result.
    pub fn finish(&self, steps: &[Step]) -> Result<(), ModelError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let fitness = steps.last().map_or(0.0, |step| step.fitness);
        state.report(steps.len(), fitness, 1.0)
    }
}

impl State<'_> {
    /// Reports to the caller; once the caller has stopped the work, nothing more is reported and
    /// all lines stop.
    fn report(&mut self, count: usize, fitness: f64, share: f64) -> Result<(), ModelError> {
        self.stopped = self.stopped || !(self.progress)(count, fitness, share);
        if self.stopped { Err(ModelError::Stopped) } else { Ok(()) }
    }
}
