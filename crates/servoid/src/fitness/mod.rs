//! Scores hypotheses: bodies in, scores out.

mod anisotropy;
mod color;
mod contour;
mod evidence;
mod extent;
mod likelihood;
mod overlap;
mod points;
mod range_samples;
mod region;
mod sight_lines;
mod sums;
mod surface;
mod volume;

pub use crate::simd::{Backend, BackendError};
pub use anisotropy::{anisotropy, anisotropy_gradient};
pub use color::ColorModel;
pub use contour::{ContourPoint, Offset, boundary, contour};
pub(crate) use contour::{on_outline, rim_at};
pub use evidence::{Evidence, Total};
pub use extent::Extent;
pub use likelihood::{Likelihood, LikelihoodView};
pub use overlap::{Overlap, OverlapView};
pub use points::{Margin, Points, PointsError, PointsView};
pub use range_samples::{RangeSample, RangeSampleError, RangeSamples};
pub use region::{Region, RegionView};
pub use sums::map::ScoreMap;
pub use sums::rows::Sums;
pub(crate) use surface::SAMPLES;
pub use surface::{Agreement, Patch, SurfacePoint};
pub use volume::Volume;

use crate::parallel::*;

use crate::shape::{Quadric, QuadricGradient};

/// Scores hypotheses; higher is better.
///
/// A hypothesis is a set of ellipsoids in the world, each given as a [`Quadric`]; those beyond
/// [`crate::shape::Body::MAX_ELLIPSOIDS`] are ignored.
pub trait Fitness: Sync {
    /// Scores one hypothesis.
    fn score(&self, hypothesis: &[Quadric]) -> f64;

    /// Scores hypotheses of `count` ellipsoids each, in parallel. Each score depends on its
    /// hypothesis alone, so the bits are the same on any number of threads.
    fn scores(&self, hypotheses: &[Quadric], count: usize) -> Vec<f64> {
        hypotheses.par_chunks(count.max(1)).with_min_len(16).map(|one| self.score(one)).collect()
    }
}

/// Scores hypotheses and computes the gradient of the score.
pub trait Differentiable: Fitness {
    /// Scores one hypothesis and writes the gradient, one entry per ellipsoid.
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64;
}
