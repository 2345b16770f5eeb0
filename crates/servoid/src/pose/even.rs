use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Maps three uniform numbers, 0 to 1 each, to a uniformly distributed rotation.
///
/// Source: Shoemake, *Uniform random rotations* (Graphics Gems III, 1992).
#[must_use]
pub fn even_turn(first: f64, second: f64, third: f64) -> UnitQuaternion<f64> {
    let (low, high) = ((1.0 - first).sqrt(), first.sqrt());
    let (a, b) = (std::f64::consts::TAU * second, std::f64::consts::TAU * third);
    let q = Quaternion::new(
        high * libm::cos(b),
        low * libm::sin(a),
        low * libm::cos(a),
        high * libm::sin(b),
    );
    UnitQuaternion::new_normalize(q)
}

/// Returns the unit vector at a height, -1 to 1 along z, on a spiral that advances by the golden
/// angle from each index to the next. For evenly spaced heights the directions are evenly
/// distributed.
///
/// Source: Swinbank, Purser, *Fibonacci grids: a novel approach to global modelling* (2006).
#[must_use]
pub fn even_direction(index: usize, height: f64) -> Vector3<f64> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let (ring, angle) = ((1.0 - height * height).sqrt(), golden * index as f64);
    Vector3::new(ring * libm::cos(angle), ring * libm::sin(angle), height)
}
