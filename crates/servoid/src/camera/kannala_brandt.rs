//! Kannala and Brandt's model: the distance from the centre at which a lens images an angle off its
//! axis.
//!
//! Source: Kannala and Brandt, *A generic camera model and calibration method for conventional,
//! wide-angle, and fish-eye lenses*, PAMI 28 (2006), with the coefficients of OpenCV's `fisheye`.

use std::f64::consts::PI;

use super::roots::{first_zero, reach};

/// The widest angle off the axis that a lens may see.
pub(super) const MAX_ANGLE: f64 = 2.0 * PI / 3.0;

/// Returns the distance from the centre, in focal lengths, at which an angle off the axis is
/// imaged, and its derivative: (S27).
pub(super) fn distance(k: &[f64; 4], angle: f64) -> (f64, f64) {
    let s = angle * angle;
    let sum = |a: [f64; 4]| 1.0 + s * (a[0] + s * (a[1] + s * (a[2] + s * a[3])));
    let [k1, k2, k3, k4] = *k;
    (angle * sum(*k), sum([3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4]))
}

/// Returns the angle up to which the distance increases, at most [`MAX_ANGLE`].
pub(super) fn limit(k: &[f64; 4]) -> f64 {
    let [k1, k2, k3, k4] = *k;
    let slope = [1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4];
    first_zero(&slope, MAX_ANGLE * MAX_ANGLE).map_or(MAX_ANGLE, f64::sqrt)
}

/// Returns the angle off the axis that is imaged at a distance, if it lies within `limit`.
pub(super) fn angle(k: &[f64; 4], limit: f64, far: f64) -> Option<f64> {
    let angle = reach(|angle| distance(k, angle), far, limit);
    let miss = (distance(k, angle).0 - far).abs();
    (angle < limit && miss <= 1e-11 * (1.0 + far)).then_some(angle)
}
