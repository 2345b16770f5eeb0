use super::overlap::open_map;
use super::{Differentiable, Evidence, Fitness, Region, RegionView};
use crate::shape::{Projection, Quadric, QuadricGradient};

/// One image of the likelihood: log-likelihood ratios of its pixels, and the projection of the
/// world.
#[derive(Debug, Clone)]
pub struct LikelihoodView {
    /// log p(pixel | object) / p(pixel | background), row by row, in nats.
    pub scores: Vec<f64>,
    /// (width, height) in pixels.
    pub size_px: [usize; 2],
    /// Projection from the world to these pixels.
    pub projection: Projection,
}

/// The region score as evidence: in each image the sum of the log-likelihood ratios inside the
/// outline, as a share of its maximum; averaged over the images.
#[derive(Debug, Clone)]
pub struct Likelihood {
    views: Vec<LikelihoodView>,
    region: Region,
}

impl Likelihood {
    /// Makes the term of its images.
    #[must_use]
    pub fn new(views: Vec<LikelihoodView>) -> Self {
        let region = region(&views, &[]);
        Self { views, region }
    }
}

fn region(views: &[LikelihoodView], current: &[Quadric]) -> Region {
    let share = 1.0 / views.len().max(1) as f64;
    let region_view = |view: &LikelihoodView| {
        let most: f64 = view.scores.iter().map(|score| score.max(0.0)).sum();
        let map = open_map(view.scores.clone(), view.size_px, &view.projection, current);
        RegionView { map, projection: view.projection, weight: share / most.max(1.0) }
    };
    Region::new(views.iter().map(region_view).collect())
}

impl Fitness for Likelihood {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        self.region.score(hypothesis)
    }
}

impl Differentiable for Likelihood {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        self.region.score_and_gradient(hypothesis, gradient)
    }
}

impl Evidence for Likelihood {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        Box::new(region(&self.views, current))
    }
}
