use std::time::{Duration, Instant};

use super::estimate::Timing;

/// Measures the time that each stage of a step takes.
pub(super) struct Clock {
    begin: Instant,
    last: Instant,
    timing: Timing,
}

impl Clock {
    pub(super) fn start() -> Self {
        let now = Instant::now();
        Self { begin: now, last: now, timing: Timing::default() }
    }

    /// Adds the time since the last lap to a stage.
    pub(super) fn lap(&mut self, stage: impl Fn(&mut Timing) -> &mut Duration) {
        let now = Instant::now();
        *stage(&mut self.timing) += now - self.last;
        self.last = now;
    }

    /// Returns whether the time budget is spent.
    pub(super) fn is_over(&self, budget_s: Option<f64>) -> bool {
        budget_s.is_some_and(|budget| self.begin.elapsed().as_secs_f64() > budget)
    }

    pub(super) fn timing(&self) -> Timing {
        self.timing
    }
}
