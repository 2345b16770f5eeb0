//! Brown and Conrady's model, in coordinates on the plane z = 1 before the lens.
//!
//! Source: Duane Brown, *Decentering distortion of lenses* (1966), with the rational radial part
//! and the order of coefficients of OpenCV's `projectPoints`.

use nalgebra::{Matrix2, Vector2};

use super::roots::{first_zero, reach};

/// The tangent that stands for 90 degrees off the axis, which no lens of this model sees.
const MAX_TANGENT: f64 = 1e3;

/// Returns the numerator and the denominator of the radial part as polynomials in r².
fn quotient(k: &[f64; 8]) -> ([f64; 4], [f64; 4]) {
    ([1.0, k[0], k[1], k[4]], [1.0, k[5], k[6], k[7]])
}

fn cubic(a: &[f64; 4], x: f64) -> f64 {
    a[0] + x * (a[1] + x * (a[2] + x * a[3]))
}

fn cubic_slope(a: &[f64; 4], x: f64) -> f64 {
    a[1] + x * (2.0 * a[2] + x * 3.0 * a[3])
}

/// Returns the radial factor ρ and its derivative with respect to r².
fn radial(k: &[f64; 8], r2: f64) -> (f64, f64) {
    let (over, under) = quotient(k);
    let (n, d) = (cubic(&over, r2), cubic(&under, r2));
    (n / d, (cubic_slope(&over, r2) - n / d * cubic_slope(&under, r2)) / d)
}

/// Returns where the lens images a point of the plane: (S24).
pub(super) fn distort(k: &[f64; 8], point: &Vector2<f64>) -> Vector2<f64> {
    let decentring = Vector2::new(k[3], k[2]);
    let r2 = point.norm_squared();
    point * (radial(k, r2).0 + 2.0 * point.dot(&decentring)) + decentring * r2
}

/// Returns the derivative of [`distort`], a symmetric matrix: (S25).
fn slope(k: &[f64; 8], point: &Vector2<f64>) -> Matrix2<f64> {
    let decentring = Vector2::new(k[3], k[2]);
    let (factor, change) = radial(k, point.norm_squared());
    let mixed = decentring * point.transpose();
    Matrix2::identity() * (factor + 2.0 * point.dot(&decentring))
        + point * point.transpose() * (2.0 * change)
        + (mixed + mixed.transpose()) * 2.0
}

/// Returns the tangent of the angle off the axis up to which the model is one-to-one: (S26).
pub(super) fn limit(k: &[f64; 8]) -> f64 {
    let (over, under) = quotient(k);
    let pull = 6.0 * libm::hypot(k[2], k[3]);
    let rising = [1.0, 3.0 * over[1], 5.0 * over[2], 7.0 * over[3]];
    let turning = [0.0, 2.0 * under[1], 4.0 * under[2], 6.0 * under[3]];
    let (gain, loss) = (product(&rising, &under), product(&over, &turning));
    let along: [f64; 7] = std::array::from_fn(|i| gain[i] - loss[i]);
    let conditions = [
        less(&along, pull, &product(&under, &under)),
        less(&over, pull, &under),
        less(&under, 0.0, &[]),
    ];
    let zeros = conditions.iter().filter_map(|condition| first_zero(condition, MAX_TANGENT));
    zeros.fold(MAX_TANGENT, f64::min)
}

fn product(a: &[f64; 4], b: &[f64; 4]) -> [f64; 7] {
    let mut out = [0.0; 7];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

/// Returns a(r²) - pull r b(r²) as a polynomial in r.
fn less(a: &[f64], pull: f64, b: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; 2 * a.len().max(b.len())];
    for (i, x) in a.iter().enumerate() {
        out[2 * i] += x;
    }
    for (i, y) in b.iter().enumerate() {
        out[2 * i + 1] -= pull * y;
    }
    out
}

/// Returns the point of the plane that the lens images at `target`, if it lies within `limit`.
///
/// Newton's method, started from the solution without decentring; a step is halved until it reduces
/// the residual.
pub(super) fn undistort(k: &[f64; 8], limit: f64, target: &Vector2<f64>) -> Option<Vector2<f64>> {
    let far = target.norm();
    let along = |r: f64| {
        let (factor, change) = radial(k, r * r);
        (r * factor, factor + 2.0 * r * r * change)
    };
    let start = reach(along, far, limit).min(limit * (1.0 - 1e-9));
    let mut at = if far > 0.0 { target * (start / far) } else { Vector2::zeros() };
    let mut miss = target - distort(k, &at);
    for _ in 0..50 {
        if miss.norm() <= 1e-14 * (1.0 + far) {
            break;
        }
        let Some((next, next_miss)) = step(k, limit, target, (&at, &miss)) else { break };
        (at, miss) = (next, next_miss);
    }
    (miss.norm() <= 1e-11 * (1.0 + far) && at.norm() < limit).then_some(at)
}

type Pair = (Vector2<f64>, Vector2<f64>);

/// Returns a point with a smaller residual, and that residual.
fn step(
    k: &[f64; 8],
    limit: f64,
    target: &Vector2<f64>,
    (at, miss): (&Vector2<f64>, &Vector2<f64>),
) -> Option<Pair> {
    let whole = slope(k, at).try_inverse()? * miss;
    (0..30).find_map(|halvings| {
        let next = at + whole * 0.5_f64.powi(halvings);
        let next_miss = target - distort(k, &next);
        (next.norm() < limit && next_miss.norm() < miss.norm()).then_some((next, next_miss))
    })
}
