use std::ops::AddAssign;

use super::{Backend, Differentiable, Evidence, Fitness, Region, RegionView, ScoreMap, Sums};
use crate::pose::{Pose, Twist};
use crate::shape::{Outline, Projection, Quadric, QuadricGradient};

/// One image of the overlap: the share of each pixel that the object fills, and the projection of
/// the world.
#[derive(Debug, Clone)]
pub struct OverlapView {
    /// Share of each pixel that the object fills, row by row, 0 to 1.
    pub filled: Vec<f64>,
    /// (width, height) in pixels.
    pub size_px: [usize; 2],
    /// Projection from the world to these pixels.
    pub projection: Projection,
}

/// The mean silhouette overlap, intersection over union, between the body and the masks.
///
/// It follows from the region score S = Σ ℓ with ℓ = 2 filled - 1 and the area A of the union of
/// the outlines: the intersection is (S + A) / 2. It lies between 0 and 1, and 1 is a perfect fit.
#[derive(Debug, Clone)]
pub struct Overlap {
    views: Vec<OverlapView>,
    region: Region,
    filled_px: Vec<f64>,
}

impl Overlap {
    /// Makes the term of its images.
    #[must_use]
    pub fn new(views: Vec<OverlapView>) -> Self {
        let region_view = |view: &OverlapView| {
            let map = ScoreMap::from_scores(&balance(&view.filled), view.size_px, 1);
            RegionView { map, projection: view.projection, weight: 1.0 }
        };
        let region_views = views.iter().map(region_view).collect();
        let filled_px = views.iter().map(|view| view.filled.iter().sum()).collect();
        let region = Region::with_backend(region_views, Backend::used());
        Self { views, region, filled_px }
    }

    /// Returns the overlap in each image.
    #[must_use]
    pub fn by_view(&self, hypothesis: &[Quadric]) -> Vec<f64> {
        let views = self.region.views().iter().zip(&self.filled_px);
        views.map(|(view, &px)| agreement(self.region.sums(view, hypothesis), px).0).collect()
    }

    /// Returns the overlap of a body at a pose; its ellipsoids are in its own frame.
    #[must_use]
    pub fn score_at(&self, world_from_object: &Pose, body: &[Quadric]) -> f64 {
        let views = self.region.views().iter().zip(&self.filled_px);
        let of_view = |(view, &px): (&RegionView, &f64)| {
            let projection = view.projection.moved(world_from_object);
            agreement(self.region.sums_by(view, &projection, body), px).0
        };
        self.mean(views.map(of_view).sum())
    }

    /// Returns the overlap of a body at a pose, and its gradient by a small motion in the object's
    /// frame.
    #[must_use]
    pub fn slope_at(&self, world_from_object: &Pose, body: &[Quadric]) -> (f64, Twist) {
        let mut gradient = vec![QuadricGradient::default(); body.len()];
        let score = self.add_views(Some(world_from_object), body, &mut gradient);
        let mut slope = Twist::zeros();
        for (quadric, part) in body.iter().zip(&gradient) {
            let mut turned = quadric.center.cross(&part.center);
            for (axis, by) in quadric.factor.column_iter().zip(part.factor.column_iter()) {
                turned += axis.cross(&by);
            }
            slope.fixed_rows_mut::<3>(0).add_assign(&part.center);
            slope.fixed_rows_mut::<3>(3).add_assign(&turned);
        }
        (score, slope)
    }

    /// Scores ellipsoids in the world or in the object's frame at a pose, and adds the gradient.
    fn add_views(
        &self,
        at: Option<&Pose>,
        hypothesis: &[Quadric],
        gradient: &mut [QuadricGradient],
    ) -> f64 {
        let mut total = 0.0;
        for (view, &px) in self.region.views().iter().zip(&self.filled_px) {
            let chain = |sums| {
                let (_, by_score, by_area) = agreement(sums, px);
                (self.mean(by_score), self.mean(by_area))
            };
            let projection = at.map_or(view.projection, |pose| view.projection.moved(pose));
            let seen = (&view.map, &projection);
            total += agreement(self.region.add_gradient(seen, hypothesis, chain, gradient), px).0;
        }
        self.mean(total)
    }

    fn mean(&self, sum: f64) -> f64 {
        sum / self.filled_px.len().max(1) as f64
    }
}

/// Returns ℓ = 2 filled - 1 of each cell: 1 where the object is, -1 where it is not.
pub(super) fn balance(filled: &[f64]) -> Vec<f64> {
    filled.iter().map(|filled| 2.0 * filled - 1.0).collect()
}

/// Returns intersection over union, and its slopes by Σ ℓ and by the area.
pub(super) fn agreement(sums: Sums, filled_px: f64) -> (f64, f64, f64) {
    let both = 0.5 * (sums.score + sums.area);
    // An empty mask and an empty body have no overlap.
    let union = (filled_px + sums.area - both).max(f64::MIN_POSITIVE.sqrt());
    let half = 0.5 / (union * union);
    (both / union, half * (union + both), half * (union - both))
}

impl Fitness for Overlap {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        let views = self.region.views().iter().zip(&self.filled_px);
        let total: f64 =
            views.map(|(view, &px)| agreement(self.region.sums(view, hypothesis), px).0).sum();
        self.mean(total)
    }
}

impl Differentiable for Overlap {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        gradient.fill(QuadricGradient::default());
        self.add_views(None, hypothesis, gradient)
    }
}

impl Evidence for Overlap {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        let share = 1.0 / self.views.len().max(1) as f64;
        let open = |(view, filled_px): (&OverlapView, &f64)| {
            let map = open_map(balance(&view.filled), view.size_px, &view.projection, current);
            RegionView { map, projection: view.projection, weight: share / filled_px.max(1.0) }
        };
        Box::new(Region::new(self.views.iter().zip(&self.filled_px).map(open).collect()))
    }
}

/// Makes the map of scores that are zero where existing ellipsoids are seen.
pub(super) fn open_map(
    mut scores: Vec<f64>,
    size_px: [usize; 2],
    projection: &Projection,
    current: &[Quadric],
) -> ScoreMap {
    for outline in current.iter().filter_map(|quadric| projection.outline(quadric)) {
        clear(&mut scores, size_px[0], &outline);
    }
    ScoreMap::from_scores(&scores, size_px, 1)
}

/// Sets the scores inside an outline to zero.
pub(super) fn clear(scores: &mut [f64], width: usize, outline: &Outline) {
    for (v, row) in scores.chunks_exact_mut(width).enumerate() {
        if let Some((begin, end)) = outline.interval(v as f64) {
            let begin = begin.round().clamp(0.0, width as f64) as usize;
            let end = (end.round() + 1.0).clamp(begin as f64, width as f64) as usize;
            row[begin..end].fill(0.0);
        }
    }
}
