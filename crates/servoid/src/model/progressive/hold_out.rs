use super::best_by_count::BestByCount;
use crate::camera::View;
use crate::fitness::{Fitness, RangeSample};
use crate::model::scene::{Scene, silhouette_ious};
use crate::model::{ModelError, ModelInput, Settings};

/// One view or stripe of measured points in this many is held out.
const ONE_IN: usize = 4;
/// With fewer views than this, all are needed to model from.
const LEAST_VIEWS: usize = 6;
/// Stripes into which measured points are divided, in the given order.
const STRIPES: usize = 16;
/// With fewer measured points than this, all are needed.
const LEAST_SAMPLES: usize = 200;
/// Overlap with the mask of each view from which on measured points choose alone.
const EXPLAINED: f64 = 0.85;

/// Evidence in two parts: one to model from, and one to select the number of ellipsoids by.
pub(in crate::model) struct HoldOut<'a> {
    views: [Vec<View<'a>>; 2],
    samples: [Vec<RangeSample>; 2],
}

impl<'a> HoldOut<'a> {
    /// Holds out a part of the views and of the measured points; `None` if there are too few of
    /// those with weight. Evidence without weight stays in the first part, since it cannot select.
    pub fn of(given: &ModelInput<'a>) -> Option<Self> {
        if given.mesh.is_some() {
            return None;
        }
        let weights = given.weights;
        let many = weights.silhouettes > 0.0 && given.views.len() >= LEAST_VIEWS;
        let held = |index: usize| many && index % ONE_IN == ONE_IN - 1;
        let views = divide(given.views, held);
        let stripe = given.samples.len().div_ceil(STRIPES).max(1);
        let enough = weights.depth > 0.0 && given.samples.len() >= LEAST_SAMPLES;
        let samples =
            divide(given.samples, |index| enough && (index / stripe) % ONE_IN == ONE_IN - 1);
        let any = !(views[1].is_empty() && samples[1].is_empty());
        any.then_some(Self { views, samples })
    }

    /// Returns the part to model from.
    pub fn training<'b>(&'b self, given: &ModelInput<'a>) -> ModelInput<'b>
    where
        'a: 'b,
    {
        ModelInput {
            views: &self.views[0],
            samples: &self.samples[0],
            mesh: None,
            weights: given.weights,
        }
    }

    /// Selects the number of ellipsoids whose body agrees best with the held-out part, where each
    /// ellipsoid must gain δ. If that body leaves out much of views that are too few to hold one out,
    /// these count as well: they show what has no measured point, such as the handle of a plain jug.
    pub fn choose(
        &self,
        given: &ModelInput<'a>,
        by_count: &BestByCount,
        scene: &Scene,
        settings: &Settings,
    ) -> Result<usize, ModelError> {
        let best_by = |views: &[View<'_>]| {
            let (samples, weights) = (&*self.samples[1], given.weights);
            let held = ModelInput { views, samples, mesh: None, weights };
            let objective = scene.finest(&held)?;
            let worth = |count: usize| {
                objective.total.score(&by_count.at(count).quadrics) - settings.delta * count as f64
            };
            let counts = 1..=by_count.max_count().min(settings.max_ellipsoids);
            let best = counts.rev().max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
            Ok::<_, ModelError>(best.unwrap_or(1))
        };
        let [all, held] = &self.views;
        let best = best_by(held)?;
        if !held.is_empty() || given.weights.silhouettes == 0.0 {
            return Ok(best);
        }
        let overlaps = silhouette_ious(&scene.body(&by_count.at(best).quadrics)?, all);
        let is_explained = overlaps.iter().all(|overlap| *overlap >= EXPLAINED);
        if is_explained { Ok(best) } else { best_by(all) }
    }
}

fn divide<T: Clone>(all: &[T], held: impl Fn(usize) -> bool) -> [Vec<T>; 2] {
    [false, true].map(|wanted| {
        let part = all.iter().enumerate().filter(|(index, _)| held(*index) == wanted);
        part.map(|(_, one)| one.clone()).collect()
    })
}
