use nalgebra::{Matrix3, Vector3};

use super::overlap::agreement;
use super::sums::rows::Sums;
use super::{Differentiable, Evidence, Fitness};
use crate::shape::{Body, Quadric, QuadricGradient};
use crate::words::were;

/// A measured point of a surface, and the direction in which it was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeSample {
    /// Position of the surface point.
    pub point: Vector3<f64>,
    /// Unit vector from the eye to the surface and on into the object.
    pub direction: Vector3<f64>,
    /// Distance of the eye from the point; 0 if only the direction is known.
    pub eye: f64,
}

/// Why numbers do not make range samples.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RangeSampleError {
    /// There is not one direction per point.
    #[error("{points} points need as many directions, but {directions} {} given", were(*directions))]
    Count {
        /// Points given.
        points: usize,
        /// Directions given.
        directions: usize,
    },
    /// A number is not finite, or a direction has no length.
    #[error(
        "point {index}: position and direction must be finite numbers and the direction must \
         have a length, but they are {point:?} and {direction:?}"
    )]
    Numbers {
        /// Which one.
        index: usize,
        /// The point.
        point: [f64; 3],
        /// Its direction.
        direction: [f64; 3],
    },
}

impl RangeSample {
    /// Combines points, in metres, and the directions in which they were seen; the length of a
    /// direction is the distance of the eye, or short if only the direction is known.
    ///
    /// # Errors
    /// If their numbers differ, a number is not finite or a direction has no length.
    pub fn join(
        points: &[[f64; 3]],
        directions: &[[f64; 3]],
    ) -> Result<Vec<Self>, RangeSampleError> {
        let (count, given) = (points.len(), directions.len());
        if count != given {
            return Err(RangeSampleError::Count { points: count, directions: given });
        }
        let sample = |(index, (&point, &direction)): (usize, (&[f64; 3], &[f64; 3]))| {
            let finite = point.iter().chain(&direction).all(|x| x.is_finite());
            // Scaled first: the square of a large length is infinite.
            let most = Vector3::from(direction).amax();
            if !finite || most == 0.0 {
                return Err(RangeSampleError::Numbers { index, point, direction });
            }
            let scaled = Vector3::from(direction) / most;
            let length = scaled.norm();
            Ok(Self { point: point.into(), direction: scaled / length, eye: most * length })
        };
        points.iter().zip(directions).enumerate().map(sample).collect()
    }
}

/// The depth term: there is nothing in front of a measured surface, and just behind it is the
/// object.
///
/// Each line of sight is treated like the row of an image: an ellipsoid covers one interval of it,
/// and the agreement is the share filled by both of what body or object fill there, between the eye
/// and `behind` the surface. What lies deeper was not seen and is not scored; if the eye is not
/// known, nor is what lies farther than `before` the surface.
#[derive(Debug, Clone)]
pub struct RangeSamples {
    samples: Vec<RangeSample>,
    before: f64,
    behind: f64,
}

/// Lower bound of the slope of an end along a line of sight: where a line only grazes an ellipsoid,
/// its end moves without bound.
const GRAZING: f64 = 0.05;

/// An interval along a line of sight, relative to the surface.
#[derive(Debug, Clone, Copy)]
struct Interval {
    begin: f64,
    end: f64,
    index: usize,
}

/// An ellipsoid prepared for intersection with lines.
struct Ball {
    index: usize,
    center: Vector3<f64>,
    inverse: Matrix3<f64>,
    /// At least the square of its longest radius.
    square: f64,
}

/// Share of the squares of lengths by which their rounding errors are smaller.
const ROUNDING: f64 = 1e-9;

impl Ball {
    /// Returns whether a line of sight passes the ball that encloses the ellipsoid: most do, and
    /// that is known sooner than where they meet the ellipsoid.
    fn is_passed(&self, sample: &RangeSample, length: f64) -> bool {
        let toward = self.center - sample.point;
        let (far, along) = (toward.norm_squared(), toward.dot(&sample.direction));
        let beside = far * length - along * along;
        beside > (self.square + ROUNDING * (self.square + far)) * length
    }

    /// Returns a vector in the frame in which the ellipsoid is the unit ball. Written out, as the
    /// general product of matrices takes several times as long.
    fn unit(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let of = |i| {
            let to = |j| self.inverse[(i, j)];
            to(0) * vector.x + to(1) * vector.y + to(2) * vector.z
        };
        Vector3::new(of(0), of(1), of(2))
    }

    /// Returns a gradient by such a vector as one by a vector in metres.
    fn pull_back(&self, unit: &Vector3<f64>) -> Vector3<f64> {
        let of = |j| {
            let to = |i| self.inverse[(i, j)];
            to(0) * unit.x + to(1) * unit.y + to(2) * unit.z
        };
        Vector3::new(of(0), of(1), of(2))
    }
}

impl RangeSamples {
    /// Makes the term of lines of sight and of the distances before (at least) and behind the
    /// surface that are scored.
    #[must_use]
    pub fn new(samples: Vec<RangeSample>, before: f64, behind: f64) -> Self {
        Self { samples, before, behind }
    }

    /// Returns the start of a line's window.
    fn from(&self, sample: &RangeSample) -> f64 {
        -self.before.max(sample.eye)
    }

    /// Returns the total length that the object is known to fill.
    fn filled(&self) -> f64 {
        self.behind * self.samples.len() as f64
    }

    /// Returns the intervals of one line, clipped to its window, sorted by their start.
    fn intervals(&self, sample: &RangeSample, balls: &[Ball], out: &mut Vec<Interval>) {
        out.clear();
        let (first, length) = (self.from(sample), sample.direction.norm_squared());
        for ball in balls {
            if ball.is_passed(sample, length) {
                continue;
            }
            let from = ball.unit(&(sample.point - ball.center));
            let along = ball.unit(&sample.direction);
            let (square, middle) = (along.norm_squared(), -from.dot(&along));
            let root = middle * middle - square * (from.norm_squared() - 1.0);
            if root > 0.0 {
                let (root, per) = (root.sqrt(), 1.0 / square);
                let (begin, end) = ((middle - root) * per, (middle + root) * per);
                let (begin, end) = (begin.max(first), end.min(self.behind));
                if begin < end {
                    out.push(Interval { begin, end, index: ball.index });
                }
            }
        }
        out.sort_by(|a, b| a.begin.total_cmp(&b.begin));
    }

    /// Visits the union of sorted intervals, with the intervals that contribute its ends.
    fn union(sorted: &[Interval], mut visit: impl FnMut(&Interval, &Interval)) {
        let mut rest = sorted.iter();
        let Some(mut first) = rest.next() else { return };
        let mut last = first;
        for interval in rest {
            if interval.begin > last.end {
                visit(first, last);
                (first, last) = (interval, interval);
            } else if interval.end > last.end {
                last = interval;
            }
        }
        visit(first, last);
    }

    /// Returns whether an end lies inside its line's window, and whether it is in front of (-1) or
    /// behind (1) the surface.
    fn weight_at(&self, sample: &RangeSample, at: f64) -> Option<f64> {
        (at > self.from(sample) && at < self.behind).then(|| if at < 0.0 { -1.0 } else { 1.0 })
    }
}

/// Adds the part of a line between two positions: against the body in front of the surface, for it
/// behind.
fn add(sums: &mut Sums, begin: f64, end: f64) {
    if begin < end {
        sums.score += end.abs() - begin.abs();
        sums.area += end - begin;
    }
}

fn balls(hypothesis: &[Quadric]) -> Vec<Ball> {
    let ball = |(index, quadric): (usize, &Quadric)| {
        let inverse = quadric.factor.try_inverse()?;
        let shape = quadric.shape_matrix();
        // Both are bounds of the largest eigenvalue.
        let square =
            (0..3).map(|i| shape.row(i).abs().sum()).fold(0.0, f64::max).min(shape.trace());
        Some(Ball { index, center: quadric.center, inverse, square })
    };
    hypothesis.iter().take(Body::MAX_ELLIPSOIDS).enumerate().filter_map(ball).collect()
}

/// Returns the derivatives of one end of an interval by the centre and by the factor.
fn end_slopes(sample: &RangeSample, ball: &Ball, at: f64) -> QuadricGradient {
    let unit = ball.unit(&(sample.point + sample.direction * at - ball.center));
    let normal = ball.pull_back(&unit);
    let steep = normal.dot(&sample.direction);
    let least = GRAZING * normal.norm();
    let steep = if steep < 0.0 { steep.min(-least) } else { steep.max(least) };
    let mut factor = Matrix3::zeros();
    for j in 0..3 {
        for i in 0..3 {
            factor[(i, j)] = normal[i] * unit[j] / steep;
        }
    }
    QuadricGradient { center: normal / steep, factor }
}

impl Fitness for RangeSamples {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        let balls = balls(hypothesis);
        let (mut sums, mut sorted) = (Sums::default(), Vec::new());
        for sample in &self.samples {
            self.intervals(sample, &balls, &mut sorted);
            Self::union(&sorted, |first, last| add(&mut sums, first.begin, last.end));
        }
        agreement(sums, self.filled()).0
    }
}

impl Differentiable for RangeSamples {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        let balls = balls(hypothesis);
        let mut by_score = vec![QuadricGradient::default(); gradient.len()];
        let mut by_area = by_score.clone();
        let mut place = vec![0; gradient.len()];
        balls.iter().enumerate().for_each(|(at, ball)| place[ball.index] = at);
        let (mut sums, mut sorted) = (Sums::default(), Vec::new());
        for sample in &self.samples {
            self.intervals(sample, &balls, &mut sorted);
            Self::union(&sorted, |first, last| {
                add(&mut sums, first.begin, last.end);
                for (index, at, way) in
                    [(first.index, first.begin, -1.0), (last.index, last.end, 1.0)]
                {
                    let Some(weight) = self.weight_at(sample, at) else { continue };
                    let slopes = end_slopes(sample, &balls[place[index]], at);
                    by_score[index].add_scaled(&slopes, way * weight);
                    by_area[index].add_scaled(&slopes, way);
                }
            });
        }
        let (score, of_score, of_area) = agreement(sums, self.filled());
        for ((out, by_score), by_area) in gradient.iter_mut().zip(&by_score).zip(&by_area) {
            *out = QuadricGradient::default();
            out.add_scaled(by_score, of_score);
            out.add_scaled(by_area, of_area);
        }
        score
    }
}

impl Evidence for RangeSamples {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        let balls = balls(current);
        let mut sorted = Vec::new();
        let covered = |sample: &RangeSample| {
            self.intervals(sample, &balls, &mut sorted);
            let mut covered = Vec::new();
            Self::union(&sorted, |first, last| covered.push((first.begin, last.end)));
            covered
        };
        let covered = self.samples.iter().map(covered).collect();
        Box::new(OpenRangeSamples { samples: self.clone(), covered })
    }
}

/// Lines of sight with parts that no longer count.
struct OpenRangeSamples {
    samples: RangeSamples,
    covered: Vec<Vec<(f64, f64)>>,
}

impl Fitness for OpenRangeSamples {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        let balls = balls(hypothesis);
        let (mut sums, mut sorted) = (Sums::default(), Vec::new());
        for (sample, covered) in self.samples.samples.iter().zip(&self.covered) {
            self.samples.intervals(sample, &balls, &mut sorted);
            RangeSamples::union(&sorted, |first, last| {
                let mut begin = first.begin;
                for &(from, to) in covered.iter().filter(|(_, to)| *to > first.begin) {
                    if from > begin {
                        add(&mut sums, begin, from.min(last.end).max(begin));
                    }
                    begin = begin.max(to);
                }
                if begin < last.end {
                    add(&mut sums, begin, last.end);
                }
            });
        }
        sums.score / self.samples.filled().max(f64::MIN_POSITIVE)
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::evolve::rng;

    #[test]
    fn a_line_that_meets_an_ellipsoid_never_counts_as_one_that_passes_it() {
        let mut rng = rng(0, 0);
        let mut draw = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
        let (mut met, mut passed) = (0, 0);
        for _ in 0..20_000 {
            let factor = Matrix3::from_columns(&[draw(0.5), draw(0.1), draw(0.02)]);
            let all = balls(&[Quadric { center: draw(1.0), factor }]);
            let Some(ball) = all.first() else { continue };
            // Points on the ellipsoid and beside it, seen from anywhere: many lines graze it.
            let unit = draw(1.0).normalize() * (0.9 + 0.2 * draw(1.0).x);
            let point = ball.center + factor * unit + draw(0.4);
            let sample = RangeSample { point, direction: draw(1.0).normalize(), eye: 0.0 };
            let (from, along) = (ball.unit(&(point - ball.center)), ball.unit(&sample.direction));
            let nearest = from - along * (from.dot(&along) / along.norm_squared());
            if nearest.norm() < 1.0 {
                met += 1;
                assert!(!ball.is_passed(&sample, sample.direction.norm_squared()));
            } else {
                passed += usize::from(ball.is_passed(&sample, sample.direction.norm_squared()));
            }
        }
        assert!(met > 1_000 && passed > 1_000, "{met} met, {passed} passed");
    }

    #[test]
    fn what_is_written_out_is_the_product_of_matrices_to_the_bit() {
        let mut rng = rng(0, 1);
        for _ in 0..1_000 {
            let mut draw = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let factor = Matrix3::from_columns(&[draw(), draw(), draw()]);
            let [ball] = &balls(&[Quadric { center: draw(), factor }])[..] else { continue };
            let vector = draw();
            assert_eq!(ball.unit(&vector), ball.inverse * vector);
            assert_eq!(ball.pull_back(&vector), ball.inverse.transpose() * vector);
        }
    }
}
