use super::{Differentiable, Fitness};
use crate::shape::{Quadric, QuadricGradient};

/// A term of the fitness: how well a body agrees with one kind of evidence, between 0 and 1.
///
/// An agreement is a Jaccard index: of everything that body or object fill, the share that both
/// fill. Its logarithm is the log-likelihood that a point drawn from the union of the two lies in
/// both.
///
/// A custom term returns how well ellipsoids agree with its evidence, and the gradient of that:
///
/// ```
/// use nalgebra::{Matrix3, Vector3};
/// use servoid::fitness::{Differentiable, Evidence, Fitness, Total};
/// use servoid::shape::{Quadric, QuadricGradient};
///
/// /// A position near which the object is known to lie.
/// #[derive(Clone)]
/// struct Near(Vector3<f64>);
///
/// impl Fitness for Near {
///     fn score(&self, hypothesis: &[Quadric]) -> f64 {
///         let far: f64 = hypothesis.iter().map(|one| (one.center - self.0).norm_squared()).sum();
///         (-far).exp()
///     }
/// }
///
/// impl Differentiable for Near {
///     fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
///         let score = self.score(hypothesis);
///         for (slope, one) in gradient.iter_mut().zip(hypothesis) {
///             *slope = QuadricGradient::default();
///             slope.center = (self.0 - one.center) * (2.0 * score);
///         }
///         score
///     }
/// }
///
/// impl Evidence for Near {
///     fn open(&self, _current: &[Quadric]) -> Box<dyn Fitness + Send> {
///         Box::new(self.clone())
///     }
/// }
///
/// let mut total = Total::default();
/// total.push(1.0, Near(Vector3::z()));
/// let ball = |z: f64| Quadric { center: Vector3::z() * z, factor: Matrix3::identity() };
/// let mut slope = [QuadricGradient::default()];
/// let score = total.score_and_gradient(&[ball(0.7)], &mut slope);
/// let step = 1e-6;
/// let rise = (total.score(&[ball(0.7 + step)]) - score) / step;
/// assert!((rise - slope[0].center.z).abs() < 1e-5, "the gradient is that of the score");
/// ```
pub trait Evidence: Differentiable + Send {
    /// Returns the fitness of one more ellipsoid beside the existing ones: parts of the object that
    /// they leave open count for it, parts beside the object against it.
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send>;
}

/// Several kinds of evidence as one: F = exp(Σ w ln J / Σ w), the weighted mean of the
/// log-likelihoods, converted back to a share. // (S35)
///
/// With weight 2 a kind of evidence counts as if it had been observed twice.
#[derive(Default)]
pub struct Total(Vec<Weighted>);

struct Weighted {
    weight: f64,
    evidence: Box<dyn Evidence>,
}

/// Lower bound of the agreement in the logarithm.
const LEAST: f64 = 1e-4;

impl Total {
    /// Adds a kind of evidence; one of weight 0 is left out.
    pub fn push(&mut self, weight: f64, evidence: impl Evidence + 'static) {
        if weight > 0.0 {
            self.0.push(Weighted { weight, evidence: Box::new(evidence) });
        }
    }

    /// Returns whether there is no evidence at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the kind with the largest weight, if there is any.
    #[must_use]
    pub fn lead(&self) -> Option<&dyn Evidence> {
        let heavier = |a: &&Weighted, b: &&Weighted| a.weight.total_cmp(&b.weight);
        self.0.iter().rev().max_by(heavier).map(|part| part.evidence.as_ref())
    }

    fn weights(&self) -> f64 {
        self.0.iter().map(|part| part.weight).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    fn joined(&self, log_sum: f64) -> f64 {
        libm::exp(log_sum / self.weights())
    }
}

impl Fitness for Total {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        if let [only] = self.0.as_slice() {
            return only.evidence.score(hypothesis);
        }
        let log =
            |part: &Weighted| part.weight * libm::log(part.evidence.score(hypothesis).max(LEAST));
        self.joined(self.0.iter().map(log).sum())
    }
}

impl Differentiable for Total {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        if let [only] = self.0.as_slice() {
            return only.evidence.score_and_gradient(hypothesis, gradient);
        }
        gradient.fill(QuadricGradient::default());
        let mut part_gradient = vec![QuadricGradient::default(); gradient.len()];
        let mut log_sum = 0.0;
        for part in &self.0 {
            let score = part.evidence.score_and_gradient(hypothesis, &mut part_gradient);
            log_sum += part.weight * libm::log(score.max(LEAST));
            let scale = if score > LEAST { part.weight / score } else { 0.0 };
            for (sum, one) in gradient.iter_mut().zip(&part_gradient) {
                sum.add_scaled(one, scale);
            }
        }
        let joined = self.joined(log_sum);
        let scale = joined / self.weights();
        for sum in gradient {
            sum.center *= scale;
            sum.factor *= scale;
        }
        joined
    }
}

impl Evidence for Total {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        let parts = self.0.iter().map(|part| (part.weight, part.evidence.open(current)));
        Box::new(Open(parts.collect()))
    }
}

/// The open parts of several kinds of evidence, by their weights.
struct Open(Vec<(f64, Box<dyn Fitness + Send>)>);

impl Fitness for Open {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        self.0.iter().map(|(weight, part)| weight * part.score(hypothesis)).sum()
    }
}
