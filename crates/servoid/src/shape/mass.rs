use std::f64::consts::PI;
use std::iter::Sum;
use std::ops::Add;

use crate::parallel::*;
use nalgebra::{Matrix3, Vector3};

use super::{Body, Ellipsoid};

/// Volume, centroid and inertia of a solid of unit density.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassProperties {
    /// Volume in cubic metres.
    pub volume: f64,
    /// Centroid in metres.
    pub centroid: Vector3<f64>,
    /// Inertia about the centroid, in m⁵; times a density in kg/m³ it is in kg m².
    pub inertia: Matrix3<f64>,
}

/// Rings of lines through one ellipsoid.
const RINGS: usize = 192;
/// Lines per ring.
const LINES: usize = 384;

impl Body {
    /// Returns the mass properties of the union of the ellipsoids, in the object's frame.
    ///
    /// A part inside several ellipsoids counts once. The relative error is below about 1e-4, and
    /// below 1e-8 where ellipsoids do not intersect.
    #[must_use]
    pub fn mass_properties(&self) -> MassProperties {
        union_moments(self.ellipsoids(), RINGS, LINES)
    }
}

/// Sums, over all ellipsoids, the part of each that is in none of the larger ones.
fn union_moments(ellipsoids: &[Ellipsoid], rings: usize, lines: usize) -> MassProperties {
    let mut order: Vec<&Ellipsoid> = ellipsoids.iter().collect();
    order.sort_by(|a, b| b.volume().total_cmp(&a.volume()));
    let parts: Vec<Part> = (0..order.len()).map(|i| Part::new(order[i], &order[..i])).collect();
    let count = parts.len() * rings;
    // Collected before they are added: the order of the sum, and so its last bit, is fixed.
    let sums: Vec<Moments> = (0..count)
        .into_par_iter()
        .map(|job| parts[job / rings].ring(job % rings, rings, lines))
        .collect();
    // About a point within the body, so that a far origin does not cost precision.
    let middle = order.iter().map(|e| e.center()).sum::<Vector3<f64>>() / order.len() as f64;
    let total: Moments = sums
        .chunks(rings)
        .zip(&parts)
        .map(|(sums, part)| part.place(&sums.iter().copied().sum(), &middle))
        .sum();
    let offset = total.first / total.volume;
    let spread = total.second - offset * offset.transpose() * total.volume;
    MassProperties {
        volume: total.volume,
        centroid: middle + offset,
        inertia: Matrix3::identity() * spread.trace() - spread,
    }
}

/// The integrals of 1, x and x xᵀ over a solid.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    volume: f64,
    first: Vector3<f64>,
    second: Matrix3<f64>,
}

impl Add for Moments {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            volume: self.volume + other.volume,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }
}

impl Sum for Moments {
    fn sum<I: Iterator<Item = Self>>(sums: I) -> Self {
        sums.fold(Self::default(), Add::add)
    }
}

/// An ellipsoid as the unit ball, and the larger ellipsoids that intersect it.
struct Part {
    center: Vector3<f64>,
    factor: Matrix3<f64>,
    carvers: Vec<Carver>,
}

/// An ellipsoid in the coordinates u of another one's unit ball: |turn u + shift| <= 1.
struct Carver {
    turn: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Part {
    fn new(ellipsoid: &Ellipsoid, larger: &[&Ellipsoid]) -> Self {
        let (center, factor) = (ellipsoid.center(), ellipsoid.factor());
        let may_overlap = |other: &&&Ellipsoid| {
            (other.center() - center).norm() < other.radii().max() + ellipsoid.radii().max()
        };
        let carver = |other: &&Ellipsoid| {
            let squared = other.radii().component_mul(&other.radii());
            let inverse = Matrix3::from_diagonal(&squared.map(f64::recip));
            let to_ball = inverse * other.factor().transpose();
            Carver { turn: to_ball * factor, shift: to_ball * (center - other.center()) }
        };
        Self { center, factor, carvers: larger.iter().filter(may_overlap).map(carver).collect() }
    }

    /// Sums over the lines of one ring, in the coordinates of the unit ball.
    ///
    /// Lines run along z. Rings are spaced evenly in the half length s of the lines instead of in
    /// their distance from the axis: ρ dρ = s ds, and sums over a whole ball are exact polynomials
    /// in s.
    fn ring(&self, ring: usize, rings: usize, lines: usize) -> Moments {
        // Two Gauss nodes per cell; each ring is rotated, so that no boundary coincides with the
        // lines of all rings.
        let cell = (ring / 2) as f64 + 0.5;
        let node = if ring.is_multiple_of(2) { -0.5 } else { 0.5 } / 3.0_f64.sqrt();
        let half = (cell + node) * 2.0 / rings as f64;
        let distance = (1.0 - half * half).sqrt();
        let turn = (ring as f64 * 0.618_033_988_749_895).fract();
        let weight = half / rings as f64 * 2.0 * PI / lines as f64;
        let mut spans = Vec::with_capacity(self.carvers.len());
        let mut sums = Moments::default();
        for line in 0..lines {
            let angle = 2.0 * PI * (line as f64 + turn) / lines as f64;
            let foot = Vector3::new(distance * libm::cos(angle), distance * libm::sin(angle), 0.0);
            let [length, first, second] = self.rest(&foot, half, &mut spans);
            let along = Vector3::z();
            let mixed = foot * along.transpose() * first;
            sums.volume += weight * length;
            sums.first += (foot * length + along * first) * weight;
            sums.second += (foot * foot.transpose() * length
                + mixed
                + mixed.transpose()
                + along * along.transpose() * second)
                * weight;
        }
        sums
    }

    /// Integrates 1, z and z² over the part of the line |z| < half above `foot` that is in no
    /// larger ellipsoid.
    fn rest(&self, foot: &Vector3<f64>, half: f64, spans: &mut Vec<(f64, f64)>) -> [f64; 3] {
        spans.clear();
        spans.extend(self.carvers.iter().filter_map(|carver| carver.span(foot)));
        spans.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut sums = [0.0; 3];
        let mut reached = -half;
        for &(begin, end) in spans.iter().chain(&[(half, half)]) {
            let begin = begin.min(half);
            if begin > reached {
                sums[0] += begin - reached;
                sums[1] += (begin.powi(2) - reached.powi(2)) / 2.0;
                sums[2] += (begin.powi(3) - reached.powi(3)) / 3.0;
            }
            reached = reached.max(end);
        }
        sums
    }

    /// Transforms sums from the unit ball to the ellipsoid, about `origin`.
    fn place(&self, sums: &Moments, origin: &Vector3<f64>) -> Moments {
        let center = self.center - origin;
        let bulk = self.factor.determinant().abs();
        let first = self.factor * sums.first;
        let mixed = center * first.transpose();
        let spread = self.factor * sums.second * self.factor.transpose();
        Moments {
            volume: bulk * sums.volume,
            first: (center * sums.volume + first) * bulk,
            second: (center * center.transpose() * sums.volume
                + mixed
                + mixed.transpose()
                + spread)
                * bulk,
        }
    }
}

impl Carver {
    /// Returns the interval of the line along z above `foot` that is inside the ellipsoid.
    fn span(&self, foot: &Vector3<f64>) -> Option<(f64, f64)> {
        let start = self.turn * foot + self.shift;
        let along = self.turn.column(2);
        let (a, b, c) = (along.norm_squared(), along.dot(&start), start.norm_squared() - 1.0);
        let root = b * b - a * c;
        (root > 0.0).then(|| ((-b - root.sqrt()) / a, (-b + root.sqrt()) / a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ellipsoid(center: [f64; 3], radii: [f64; 3], turn: f64) -> Ellipsoid {
        let (sin, cos) = libm::sincos(turn / 2.0);
        Ellipsoid::new(0, center, radii, [cos, 0.6 * sin, 0.0, 0.8 * sin]).unwrap()
    }

    #[test]
    fn a_finer_grid_of_lines_changes_less_than_the_stated_error() {
        let chain: Vec<_> = (0..7)
            .map(|i| {
                let x = 0.03 * f64::from(i);
                ellipsoid([x, 0.01 * libm::sin(x), 0.0], [0.04, 0.02, 0.01 + x / 9.0], x * 40.0)
            })
            .collect();
        let usual = union_moments(&chain, RINGS, LINES);
        let fine = union_moments(&chain, 5 * RINGS, 5 * LINES);
        let size = fine.inertia.norm();
        assert!((usual.volume / fine.volume - 1.0).abs() < 1e-4, "{usual:?} {fine:?}");
        assert!((usual.centroid - fine.centroid).norm() < 1e-5, "{usual:?} {fine:?}");
        assert!((usual.inertia - fine.inertia).norm() < 1e-4 * size, "{usual:?} {fine:?}");
        let coarse = union_moments(&chain, RINGS / 8, LINES / 8);
        let error = |m: &MassProperties| (m.volume / fine.volume - 1.0).abs();
        assert!(error(&usual) < error(&coarse));
    }
}
