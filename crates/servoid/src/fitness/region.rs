use super::sums::boundary::{OutlineGradients, gradients as gradients_of};
use super::sums::rows::{RowOutline, RowOutlines, Sums};
use super::sums::sweep::sums as sums_of;
use super::{Backend, Differentiable, Fitness, ScoreMap};
use crate::shape::{Body, Outline, Projection, Quadric, QuadricGradient};

/// One image of the region score: its map and the projection of the world.
#[derive(Debug, Clone)]
pub struct RegionView {
    /// Scores of the pixels.
    pub map: ScoreMap,
    /// Projection from the world to the map's pixels.
    pub projection: Projection,
    /// Weight of this image.
    pub weight: f64,
}

/// The region score: each image's map summed over the union of the outlines. // Eq. (7)
///
/// It is the limit of the paper's fitness: object pixels inside count for the hypothesis and
/// background inside counts against it, over whole areas instead of sampled points.
#[derive(Debug, Clone)]
pub struct Region {
    views: Vec<RegionView>,
    backend: Backend,
}

impl Region {
    /// Makes the score of its images.
    #[must_use]
    pub fn new(views: Vec<RegionView>) -> Self {
        Self::with_backend(views, Backend::used())
    }

    /// Makes the score of its images, with given vector instructions.
    #[must_use]
    pub fn with_backend(views: Vec<RegionView>, backend: Backend) -> Self {
        Self { views, backend }
    }

    /// Returns the images.
    #[must_use]
    pub fn views(&self) -> &[RegionView] {
        &self.views
    }

    /// Sums one image's map over the union of the outlines.
    #[must_use]
    pub fn sums(&self, view: &RegionView, hypothesis: &[Quadric]) -> Sums {
        self.sums_by(view, &view.projection, hypothesis)
    }

    /// Sums one image's map over the union of the outlines in another projection.
    pub(super) fn sums_by(
        &self,
        view: &RegionView,
        projection: &Projection,
        hypothesis: &[Quadric],
    ) -> Sums {
        view.map.sums(self.backend, projection, hypothesis)
    }

    /// Sums one image in a projection, and adds the gradient of `chain(sums)`, where the chain
    /// returns its derivatives by Σ ℓ and by the area.
    pub(super) fn add_gradient(
        &self,
        (map, projection): (&ScoreMap, &Projection),
        hypothesis: &[Quadric],
        chain: impl Fn(Sums) -> (f64, f64),
        gradient: &mut [QuadricGradient],
    ) -> Sums {
        SCRATCH.with_borrow_mut(|Scratch { seen, moved }| {
            let mut outlines = RowOutlines::new();
            seen.clear();
            for (index, quadric) in hypothesis.iter().enumerate().take(Body::MAX_ELLIPSOIDS) {
                let Some(outline) = projection.outline(quadric) else { continue };
                if let Some(rows) = RowOutline::new(&outline, map) {
                    outlines.push(rows);
                    seen.push((index, outline));
                }
            }
            moved.resize(seen.len(), OutlineGradients::default());
            let sums = gradients_of(self.backend, map, &outlines, moved);
            let (by_score, by_area) = chain(sums);
            for ((index, outline), moved) in seen.iter().zip(&*moved) {
                let by_outline: [f64; 5] =
                    std::array::from_fn(|i| by_score * moved.score[i] + by_area * moved.area[i]);
                let part = projection.pull_back(&hypothesis[*index], outline, &by_outline);
                gradient[*index].center += part.center;
                gradient[*index].factor += part.factor;
            }
            sums
        })
    }
}

impl ScoreMap {
    /// Sums the map over the union of the ellipsoids' outlines in a camera.
    #[must_use]
    pub fn sums(&self, backend: Backend, projection: &Projection, quadrics: &[Quadric]) -> Sums {
        let mut outlines = RowOutlines::new();
        for quadric in quadrics.iter().take(Body::MAX_ELLIPSOIDS) {
            let outline = projection.outline(quadric);
            if let Some(rows) = outline.and_then(|outline| RowOutline::new(&outline, self)) {
                outlines.push(rows);
            }
        }
        sums_of(backend, self, &outlines)
    }
}

/// Memory for the outlines of one hypothesis in one view, reused from call to call.
#[derive(Default)]
struct Scratch {
    seen: Vec<(usize, Outline)>,
    moved: Vec<OutlineGradients>,
}

thread_local! {
    static SCRATCH: std::cell::RefCell<Scratch> = std::cell::RefCell::default();
}

impl Fitness for Region {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        self.views.iter().map(|view| view.weight * self.sums(view, hypothesis).score).sum()
    }
}

impl Differentiable for Region {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        gradient.fill(QuadricGradient::default());
        let of_view = |view: &RegionView| {
            let chain = |_| (view.weight, 0.0);
            let seen = (&view.map, &view.projection);
            view.weight * self.add_gradient(seen, hypothesis, chain, gradient).score
        };
        self.views.iter().map(of_view).sum()
    }
}
