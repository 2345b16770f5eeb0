use super::best_by_count::BestByCount;
use crate::camera::View;
use crate::fitness::{Fitness, RangeSample};
use crate::model::scene::Scene;
use crate::model::{ModelError, ModelInput, Settings};

/// One view or stripe of seen points in so many is held out.
const ONE_IN: usize = 4;
/// Fewer views than this are all needed to model from.
const LEAST_VIEWS: usize = 6;
/// Stripes into which seen points are cut, in the order in which they were given.
const STRIPES: usize = 16;
/// Fewer seen points than this are all needed.
const LEAST_SAMPLES: usize = 200;

/// Evidence in two parts: to model from, and to select the count of ellipsoids by.
pub(in crate::model) struct HoldOut<'a> {
    views: [Vec<View<'a>>; 2],
    samples: [Vec<RangeSample>; 2],
}

impl<'a> HoldOut<'a> {
    /// Holds a part of the views and of the seen points out; `None` where there are too few of
    /// those that count. Evidence without weight stays in the first part: it could not select.
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

    /// Selects the count: the one whose body agrees best with what was held out, where each
    /// ellipsoid must earn δ.
    pub fn choose(
        &self,
        given: &ModelInput<'a>,
        by_count: &BestByCount,
        scene: &Scene,
        settings: &Settings,
    ) -> Result<usize, ModelError> {
        let held = ModelInput {
            views: &self.views[1],
            samples: &self.samples[1],
            mesh: None,
            weights: given.weights,
        };
        let objective = Scene::in_frame(&held, scene.world_from_scene, scene.unit)?.finest;
        let worth = |count: usize| {
            objective.total.score(&by_count.at(count).quadrics) - settings.delta * count as f64
        };
        let counts = 1..=by_count.max_count().min(settings.max_ellipsoids);
        let best = counts.rev().max_by(|&a, &b| worth(a).total_cmp(&worth(b)));
        Ok(best.unwrap_or(1))
    }
}

fn divide<T: Clone>(all: &[T], held: impl Fn(usize) -> bool) -> [Vec<T>; 2] {
    [false, true].map(|wanted| {
        let part = all.iter().enumerate().filter(|(index, _)| held(*index) == wanted);
        part.map(|(_, one)| one.clone()).collect()
    })
}
