//! Where lines of sight meet ellipsoids: eight lines at once, with the instructions of a backend.

use nalgebra::{Matrix3, Vector3};

use super::RangeSample;
use crate::shape::{Body, Quadric};
use crate::simd::{Backend, RowKernel, RowLanes};

/// Number of lines that are intersected together.
const TOGETHER: usize = 8;
/// Share of the squares of lengths by which their rounding errors are smaller.
const ROUNDING: f64 = 1e-9;

/// One number of each line of a group.
type Eight = [f64; TOGETHER];
/// One vector of each line of a group, coordinate by coordinate.
type Vectors = [Eight; 3];
/// One truth value of each line of a group, 0 or 1: as wide as numbers, so that registers of both
/// have the same lanes.
type Truths = [u64; TOGETHER];

/// An interval along a line of sight, relative to the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Interval {
    pub begin: f64,
    pub end: f64,
    pub index: usize,
}

/// An ellipsoid prepared for intersection with lines.
pub(super) struct Ball {
    pub index: usize,
    pub center: Vector3<f64>,
    inverse: Matrix3<f64>,
    /// At least the square of its longest radius.
    square: f64,
}

impl Ball {
    /// Prepares the ellipsoids of a hypothesis; those without volume meet nothing.
    pub fn all(hypothesis: &[Quadric]) -> Vec<Self> {
        let ball = |(index, quadric): (usize, &Quadric)| {
            let inverse = quadric.factor.try_inverse()?;
            let shape = quadric.shape_matrix();
            // Both are bounds of the largest eigenvalue.
            let square =
                (0..3).map(|i| shape.row(i).abs().sum()).fold(0.0, f64::max).min(shape.trace());
            Some(Self { index, center: quadric.center, inverse, square })
        };
        hypothesis.iter().take(Body::MAX_ELLIPSOIDS).enumerate().filter_map(ball).collect()
    }

    /// Returns a vector in the frame in which the ellipsoid is the unit ball. Written out, as the
    /// general product of matrices takes several times as long.
    #[inline(always)]
    pub fn unit(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        let of = |i| {
            let to = |j| self.inverse[(i, j)];
            to(0) * vector.x + to(1) * vector.y + to(2) * vector.z
        };
        Vector3::new(of(0), of(1), of(2))
    }

    /// Returns a gradient by such a vector as one by a vector in metres.
    #[inline(always)]
    pub fn pull_back(&self, unit: &Vector3<f64>) -> Vector3<f64> {
        let of = |j| {
            let to = |i| self.inverse[(i, j)];
            to(0) * unit.x + to(1) * unit.y + to(2) * unit.z
        };
        Vector3::new(of(0), of(1), of(2))
    }

    /// Does `unit` for the vectors of a group.
    #[inline(always)]
    fn units(&self, vectors: &Vectors) -> Vectors {
        let mut out = [[0.0; TOGETHER]; 3];
        for (i, out) in out.iter_mut().enumerate() {
            // Not by `map`, which is compiled as a function of its own, without these instructions.
            let of = |j| self.inverse[(i, j)];
            let (x, y, z) = (of(0), of(1), of(2));
            for (at, out) in out.iter_mut().enumerate() {
                *out = x * vectors[0][at] + y * vectors[1][at] + z * vectors[2][at];
            }
        }
        out
    }
}

/// Eight lines of sight; those that are missing at the end are never visited.
#[derive(Debug, Clone)]
struct Group {
    point: Vectors,
    direction: Vectors,
    /// Squares of the lengths of the directions.
    length: Eight,
}

impl Group {
    fn new(samples: &[RangeSample]) -> Self {
        let mut new = Self {
            point: [[0.0; TOGETHER]; 3],
            direction: [[0.0; TOGETHER]; 3],
            length: [0.0; TOGETHER],
        };
        for (at, sample) in samples.iter().enumerate() {
            for axis in 0..3 {
                new.point[axis][at] = sample.point[axis];
                new.direction[axis][at] = sample.direction[axis];
            }
            new.length[at] = sample.direction.norm_squared();
        }
        new
    }

    /// Returns how far the points of the lines are from the centre of a ball.
    #[inline(always)]
    fn from(&self, ball: &Ball) -> Vectors {
        let mut out = self.point;
        for (axis, out) in out.iter_mut().enumerate() {
            out.iter_mut().for_each(|x| *x -= ball.center[axis]);
        }
        out
    }

    /// Returns which lines pass the ball that encloses an ellipsoid: most do, and that is known
    /// sooner than where they meet the ellipsoid.
    #[inline(always)]
    fn pass(&self, from: &Vectors, ball: &Ball) -> Truths {
        let (far, along) = (dots(from, from), dots(from, &self.direction));
        let mut pass = [0; TOGETHER];
        for at in 0..TOGETHER {
            let beside = far[at] * self.length[at] - along[at] * along[at];
            let most = (ball.square + ROUNDING * (ball.square + far[at])) * self.length[at];
            pass[at] = u64::from(beside > most);
        }
        pass
    }

    /// Returns where the lines enter and leave an ellipsoid, and which do.
    #[inline(always)]
    fn meet(&self, from: &Vectors, ball: &Ball) -> (Eight, Eight, Truths) {
        let (from, along) = (ball.units(from), ball.units(&self.direction));
        let (square, toward, far) = (dots(&along, &along), dots(&from, &along), dots(&from, &from));
        let (mut begin, mut end, mut meets) = ([0.0; TOGETHER], [0.0; TOGETHER], [0; TOGETHER]);
        for at in 0..TOGETHER {
            let middle = -toward[at];
            let root = middle * middle - square[at] * (far[at] - 1.0);
            meets[at] = u64::from(root > 0.0);
            let (root, per) = (root.sqrt(), 1.0 / square[at]);
            (begin[at], end[at]) = ((middle - root) * per, (middle + root) * per);
        }
        (begin, end, meets)
    }
}

#[inline(always)]
fn dots(some: &Vectors, others: &Vectors) -> Eight {
    let mut out = [0.0; TOGETHER];
    for (at, out) in out.iter_mut().enumerate() {
        let of = |axis: usize| some[axis][at] * others[axis][at];
        *out = of(0) + of(1) + of(2);
    }
    out
}

/// What is done with lines of sight; `visit` must always be inlined, so that it is compiled with the
/// instructions of a backend. A closure is not always inlined.
pub(super) trait LineVisitor {
    fn visit(&mut self, line: usize, sorted: &[Interval]);
}

impl<Visit: FnMut(usize, &[Interval])> LineVisitor for Visit {
    #[inline(always)]
    fn visit(&mut self, line: usize, sorted: &[Interval]) {
        self(line, sorted);
    }
}

/// Lines of sight, prepared for intersection with ellipsoids.
#[derive(Debug, Clone)]
pub(super) struct SightLines {
    groups: Vec<Group>,
    count: usize,
}

impl SightLines {
    pub fn new(samples: &[RangeSample]) -> Self {
        Self { groups: samples.chunks(TOGETHER).map(Group::new).collect(), count: samples.len() }
    }

    /// Visits each line with the intervals in which ellipsoids cover it, clipped to its `window`
    /// and sorted by their start.
    pub fn visit(
        &self,
        backend: Backend,
        balls: &[Ball],
        window: impl Fn(usize) -> [f64; 2],
        visitor: impl LineVisitor,
    ) {
        backend.run_rows(Visit { lines: self, balls, window, visitor });
    }
}

struct Visit<'a, Window, Visitor> {
    lines: &'a SightLines,
    balls: &'a [Ball],
    window: Window,
    visitor: Visitor,
}

impl<Window, Visitor> RowKernel for Visit<'_, Window, Visitor>
where
    Window: Fn(usize) -> [f64; 2],
    Visitor: LineVisitor,
{
    type Output = ();

    #[inline(always)]
    unsafe fn run<L: RowLanes>(mut self) {
        let mut sorted: [Vec<Interval>; TOGETHER] = Default::default();
        for (place, group) in self.lines.groups.iter().enumerate() {
            let first = place * TOGETHER;
            let lines = &mut sorted[..TOGETHER.min(self.lines.count - first)];
            lines.iter_mut().for_each(Vec::clear);
            for ball in self.balls {
                let from = group.from(ball);
                let pass = group.pass(&from, ball);
                if pass.iter().fold(1, |all, one| all & one) == 1 {
                    continue;
                }
                let (begin, end, meets) = group.meet(&from, ball);
                for (at, line) in lines.iter_mut().enumerate() {
                    if meets[at] > pass[at] {
                        let [start, stop] = (self.window)(first + at);
                        let (begin, end) = (begin[at].max(start), end[at].min(stop));
                        if begin < end {
                            line.push(Interval { begin, end, index: ball.index });
                        }
                    }
                }
            }
            for (at, line) in lines.iter_mut().enumerate() {
                line.sort_by(|a, b| a.begin.total_cmp(&b.begin));
                self.visitor.visit(first + at, line);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::evolve::rng;

    const OPEN: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// Returns where a line meets an ellipsoid, with the general products of matrices.
    fn met(sample: &RangeSample, ball: &Ball) -> Option<[f64; 2]> {
        let from = ball.inverse * (sample.point - ball.center);
        let along = ball.inverse * sample.direction;
        let (square, middle) = (along.norm_squared(), -from.dot(&along));
        let root = middle * middle - square * (from.norm_squared() - 1.0);
        let (root, per) = ((root > 0.0).then(|| root.sqrt())?, 1.0 / square);
        Some([(middle - root) * per, (middle + root) * per])
    }

    #[test]
    fn lines_that_are_intersected_together_have_the_bits_of_each_alone_with_all_instructions() {
        let mut rng = rng(0, 0);
        let mut draw = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
        let (mut meetings, mut misses) = (0, 0);
        for count in 0..400 {
            let factor = Matrix3::from_columns(&[draw(0.5), draw(0.1), draw(0.02)]);
            let other = Matrix3::from_columns(&[draw(0.2), draw(0.2), draw(0.2)]);
            let quadrics = [factor, other].map(|factor| Quadric { center: draw(1.0), factor });
            let balls = Ball::all(&quadrics);
            // Points on the first ellipsoid and beside it, seen from anywhere: many lines graze it.
            let mut line = || {
                let unit = draw(1.0).normalize() * (0.9 + 0.2 * draw(1.0).x);
                let point = quadrics[0].center + factor * unit + draw(0.4);
                RangeSample { point, direction: draw(1.0).normalize(), eye: 0.0 }
            };
            let samples: Vec<_> = (0..count % 50).map(|_| line()).collect();
            for backend in Backend::available() {
                let mut visited = 0;
                SightLines::new(&samples).visit(
                    backend,
                    &balls,
                    |_| OPEN,
                    |at: usize, sorted: &[Interval]| {
                        assert_eq!(at, visited);
                        visited += 1;
                        let alone = |ball: &Ball| {
                            let [begin, end] = met(&samples[at], ball)?;
                            Some(Interval { begin, end, index: ball.index })
                        };
                        let mut expected: Vec<_> = balls.iter().filter_map(alone).collect();
                        expected.sort_by(|a, b| a.begin.total_cmp(&b.begin));
                        assert_eq!(sorted, expected);
                        meetings += expected.len();
                        misses += balls.len() - expected.len();
                    },
                );
                assert_eq!(visited, samples.len());
            }
        }
        assert!(meetings > 1_000 && misses > 1_000, "{meetings} meet, {misses} miss");
    }

    #[test]
    fn most_lines_that_miss_an_ellipsoid_pass_the_ball_around_it() {
        let mut rng = rng(0, 1);
        let mut draw = |size: f64| Vector3::from_fn(|_, _| rng.random_range(-size..size));
        let mut passed = 0;
        for _ in 0..1_000 {
            let factor = Matrix3::from_columns(&[draw(0.5), draw(0.1), draw(0.02)]);
            let balls = Ball::all(&[Quadric { center: draw(1.0), factor }]);
            let Some(ball) = balls.first() else { continue };
            let sample =
                RangeSample { point: draw(1.0), direction: draw(1.0).normalize(), eye: 0.0 };
            let group = Group::new(&[sample]);
            let passes = group.pass(&group.from(ball), ball)[0] == 1;
            passed += usize::from(passes);
            assert!(!passes || met(&sample, ball).is_none());
        }
        assert!(passed > 500, "{passed}");
    }

    #[test]
    fn what_is_written_out_is_the_product_of_matrices_to_the_bit() {
        let mut rng = rng(0, 2);
        for _ in 0..1_000 {
            let mut draw = || Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0));
            let factor = Matrix3::from_columns(&[draw(), draw(), draw()]);
            let [ball] = &Ball::all(&[Quadric { center: draw(), factor }])[..] else { continue };
            let vector = draw();
            assert_eq!(ball.unit(&vector), ball.inverse * vector);
            assert_eq!(ball.pull_back(&vector), ball.inverse.transpose() * vector);
        }
    }
}
