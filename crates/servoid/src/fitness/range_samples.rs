use nalgebra::{Matrix3, Vector3};

use super::overlap::agreement;
use super::sight_lines::{Ball, Interval, LineVisitor, SightLines};
use super::sums::rows::Sums;
use super::{Backend, Differentiable, Evidence, Fitness};
use crate::shape::{Quadric, QuadricGradient};
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
    lines: SightLines,
    before: f64,
    behind: f64,
}

/// Lower bound of the slope of an end along a line of sight: where a line only grazes an ellipsoid,
/// its end moves without bound.
const GRAZING: f64 = 0.05;

impl RangeSamples {
    /// Makes the term of lines of sight and of the distances before (at least) and behind the
    /// surface that are scored.
    #[must_use]
    pub fn new(samples: Vec<RangeSample>, before: f64, behind: f64) -> Self {
        Self { lines: SightLines::new(&samples), samples, before, behind }
    }

    /// Returns the start of a line's window.
    #[inline(always)]
    fn from(&self, sample: &RangeSample) -> f64 {
        -self.before.max(sample.eye)
    }

    /// Returns the total length that the object is known to fill.
    fn filled(&self) -> f64 {
        self.behind * self.samples.len() as f64
    }

    /// Visits each line's intervals, clipped to its window and sorted by their start.
    fn visit(&self, balls: &[Ball], visitor: impl LineVisitor) {
        let window = |at: usize| [self.from(&self.samples[at]), self.behind];
        self.lines.visit(Backend::used(), balls, window, visitor);
    }

    /// Returns whether an end lies inside its line's window, and whether it is in front of (-1) or
    /// behind (1) the surface.
    #[inline(always)]
    fn weight_at(&self, sample: &RangeSample, at: f64) -> Option<f64> {
        (at > self.from(sample) && at < self.behind).then(|| if at < 0.0 { -1.0 } else { 1.0 })
    }
}

/// The union of sorted intervals: the first and the last interval of each part.
struct Union<'a> {
    rest: std::slice::Iter<'a, Interval>,
    next: Option<&'a Interval>,
}

impl<'a> Union<'a> {
    #[inline(always)]
    fn of(sorted: &'a [Interval]) -> Self {
        let mut rest = sorted.iter();
        Self { next: rest.next(), rest }
    }
}

impl<'a> Iterator for Union<'a> {
    type Item = (&'a Interval, &'a Interval);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        let first = self.next?;
        let mut last = first;
        for interval in self.rest.by_ref() {
            if interval.begin > last.end {
                self.next = Some(interval);
                return Some((first, last));
            }
            if interval.end > last.end {
                last = interval;
            }
        }
        self.next = None;
        Some((first, last))
    }
}

/// Adds the part of a line between two positions: against the body in front of the surface, for it
/// behind.
#[inline(always)]
fn add(sums: &mut Sums, begin: f64, end: f64) {
    if begin < end {
        sums.score += end.abs() - begin.abs();
        sums.area += end - begin;
    }
}

/// The numbers of a [`QuadricGradient`]: those by the centre, then those by the factor, column by
/// column.
type Numbers = [f64; 12];

/// Returns the derivatives of one end of an interval.
#[inline(always)]
fn end_slopes(sample: &RangeSample, ball: &Ball, at: f64) -> Numbers {
    let unit = ball.unit(&(sample.point + sample.direction * at - ball.center));
    let normal = ball.pull_back(&unit);
    let steep = normal.dot(&sample.direction);
    // `norm` takes its root with a legacy instruction, and processors stall where sets are mixed.
    let least = GRAZING * normal.norm_squared().sqrt();
    let steep = if steep < 0.0 { steep.min(-least) } else { steep.max(least) };
    let mut slopes = [0.0; 12];
    for i in 0..3 {
        slopes[i] = normal[i] / steep;
    }
    for j in 0..3 {
        for i in 0..3 {
            slopes[3 + 3 * j + i] = normal[i] * unit[j] / steep;
        }
    }
    slopes
}

/// Adds numbers, scaled.
#[inline(always)]
fn add_scaled(sums: &mut Numbers, numbers: &Numbers, scale: f64) {
    for (sum, number) in sums.iter_mut().zip(numbers) {
        *sum += number * scale;
    }
}

/// The sums over lines of sight, and their derivatives by each ellipsoid.
struct Slopes<'a> {
    term: &'a RangeSamples,
    balls: &'a [Ball],
    /// The place of each ellipsoid among the balls.
    places: Vec<usize>,
    sums: Sums,
    by_score: Vec<Numbers>,
    by_area: Vec<Numbers>,
}

impl LineVisitor for &mut Slopes<'_> {
    #[inline(always)]
    fn visit(&mut self, line: usize, sorted: &[Interval]) {
        let sample = &self.term.samples[line];
        for (first, last) in Union::of(sorted) {
            add(&mut self.sums, first.begin, last.end);
            for (index, at, way) in [(first.index, first.begin, -1.0), (last.index, last.end, 1.0)]
            {
                let Some(weight) = self.term.weight_at(sample, at) else { continue };
                let slopes = end_slopes(sample, &self.balls[self.places[index]], at);
                add_scaled(&mut self.by_score[index], &slopes, way * weight);
                add_scaled(&mut self.by_area[index], &slopes, way);
            }
        }
    }
}

impl Fitness for RangeSamples {
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        let balls = Ball::all(hypothesis);
        let mut sums = Sums::default();
        self.visit(&balls, |_: usize, sorted: &[Interval]| {
            for (first, last) in Union::of(sorted) {
                add(&mut sums, first.begin, last.end);
            }
        });
        agreement(sums, self.filled()).0
    }
}

impl Differentiable for RangeSamples {
    fn score_and_gradient(&self, hypothesis: &[Quadric], gradient: &mut [QuadricGradient]) -> f64 {
        let balls = Ball::all(hypothesis);
        let mut places = vec![0; gradient.len()];
        balls.iter().enumerate().for_each(|(at, ball)| places[ball.index] = at);
        let none = vec![[0.0; 12]; gradient.len()];
        let mut slopes = Slopes {
            term: self,
            balls: &balls,
            places,
            sums: Sums::default(),
            by_score: none.clone(),
            by_area: none,
        };
        self.visit(&balls, &mut slopes);
        let (score, of_score, of_area) = agreement(slopes.sums, self.filled());
        for ((out, by_score), by_area) in
            gradient.iter_mut().zip(&slopes.by_score).zip(&slopes.by_area)
        {
            let mut sums = [0.0; 12];
            add_scaled(&mut sums, by_score, of_score);
            add_scaled(&mut sums, by_area, of_area);
            out.center = Vector3::from_column_slice(&sums[..3]);
            out.factor = Matrix3::from_column_slice(&sums[3..]);
        }
        score
    }
}

impl Evidence for RangeSamples {
    fn open(&self, current: &[Quadric]) -> Box<dyn Fitness + Send> {
        let balls = Ball::all(current);
        let mut covered = Vec::with_capacity(self.samples.len());
        self.visit(&balls, |_: usize, sorted: &[Interval]| {
            covered.push(Union::of(sorted).map(|(first, last)| (first.begin, last.end)).collect());
        });
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
        let balls = Ball::all(hypothesis);
        let mut sums = Sums::default();
        self.samples.visit(&balls, |line: usize, sorted: &[Interval]| {
            for (first, last) in Union::of(sorted) {
                let mut begin = first.begin;
                for &(from, to) in self.covered[line].iter().filter(|(_, to)| *to > first.begin) {
                    if from > begin {
                        add(&mut sums, begin, from.min(last.end).max(begin));
                    }
                    begin = begin.max(to);
                }
                if begin < last.end {
                    add(&mut sums, begin, last.end);
                }
            }
        });
        sums.score / self.samples.filled().max(f64::MIN_POSITIVE)
    }
}
