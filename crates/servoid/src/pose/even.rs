use nalgebra::{Quaternion, UnitQuaternion};

/// Turns three even shares, 0 to 1 each, into an evenly distributed rotation.
///
/// Source: Shoemake, *Uniform random rotations* (Graphics Gems III, 1992).
#[must_use]
pub fn even_turn(first: f64, second: f64, third: f64) -> UnitQuaternion<f64> {
    let (low, high) = ((1.0 - first).sqrt(), first.sqrt());
    let (a, b) = (std::f64::consts::TAU * second, std::f64::consts::TAU * third);
    let q = Quaternion::new(high * b.cos(), low * a.sin(), low * a.cos(), high * b.sin());
    UnitQuaternion::new_normalize(q)
}
