use nalgebra::{UnitQuaternion, Vector3};

use super::{Pose, PoseError};

/// Below this sine the first and the last axis coincide (gimbal lock), and only the sum of their
/// angles is determined.
const LOCKED: f64 = 1e-7;

/// Axes of successive rotations: `xyz` in lower case for fixed axes (extrinsic), `XYZ` in upper
/// case for axes that rotate with the object (intrinsic).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct EulerSequence {
    /// In the order in which the rotations are multiplied, from left to right.
    axes: Vec<usize>,
    moving: bool,
}

impl EulerSequence {
    /// Reads a sequence of one to three axes.
    ///
    /// # Errors
    /// If there is none or more than three, a letter is not an axis, cases are mixed, or an axis
    /// follows itself.
    pub fn from_name(name: &str) -> Result<Self, PoseError> {
        let wrong = || PoseError::Euler(name.chars().take(8).collect());
        let moving = name.chars().all(|letter| letter.is_ascii_uppercase());
        if !moving && !name.chars().all(|letter| letter.is_ascii_lowercase()) {
            return Err(wrong());
        }
        let place = |letter: char| "xyz".find(letter.to_ascii_lowercase()).ok_or_else(wrong);
        let mut axes = name.chars().map(place).collect::<Result<Vec<_>, _>>()?;
        if axes.is_empty() || axes.len() > 3 || axes.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(wrong());
        }
        if !moving {
            axes.reverse();
        }
        Ok(Self { axes, moving })
    }

    /// Returns the number of angles of the sequence.
    #[must_use]
    pub fn count(&self) -> usize {
        self.axes.len()
    }

    /// Returns the rotation by angles in radians, in the sequence's order.
    #[must_use]
    pub fn rotation(&self, angles: &[f64]) -> UnitQuaternion<f64> {
        let mut ordered = angles.to_vec();
        if !self.moving {
            ordered.reverse();
        }
        let turns = self.axes.iter().zip(ordered).map(|(&axis, angle)| about(axis, angle));
        turns.fold(UnitQuaternion::identity(), |sum, turn| sum * turn)
    }

    /// Returns the three angles in radians of a pose's rotation, in the sequence's order: the
    /// second in -π/2 to π/2, or in 0 to π if the first and the last axis are the same; the others
    /// in -π to π. If the second angle makes the first and the last axis coincide, only the sum of
    /// their angles is determined, and the last one is 0.
    ///
    /// # Errors
    /// If the sequence does not have three axes.
    pub fn angles(&self, pose: &Pose) -> Result<[f64; 3], PoseError> {
        let &[a, b, c] = self.axes.as_slice() else {
            return Err(PoseError::EulerCount(self.axes.len()));
        };
        let rotation = pose.rotation();
        let proper = a == c;
        let rest = 3 - a - b; // the remaining axis
        let sign = if (b + 3 - a) % 3 == 1 { 1.0 } else { -1.0 };
        // Where the first two rotations move the last axis; the third leaves it there.
        let last = rotation * unit(c);
        let (second, across, along) = if proper {
            let across = libm::hypot(last[b], last[rest]);
            (libm::atan2(across, last[a]), last[b], -sign * last[rest])
        } else {
            let level = libm::hypot(last[b], last[rest]);
            (libm::atan2(sign * last[a], level), -sign * last[b], last[rest])
        };
        let locked = libm::hypot(across, along) < LOCKED;
        let mut first = if locked { 0.0 } else { libm::atan2(across, along) };
        let mut third = left_about(c, &(about(b, -second) * about(a, -first) * rotation));
        if locked && self.moving {
            (first, third) = (left_about(a, &(rotation * about(b, -second))), 0.0);
        }
        let angles = [first, second, third];
        Ok(if self.moving { angles } else { [third, second, first] })
    }
}

fn unit(axis: usize) -> Vector3<f64> {
    Vector3::from_fn(|row, _| f64::from(u8::from(row == axis)))
}

fn about(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(unit(axis) * angle)
}

/// Returns the angle, -π to π, of a rotation about one axis.
fn left_about(axis: usize, rotation: &UnitQuaternion<f64>) -> f64 {
    let turn = rotation.scaled_axis();
    turn[axis]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NAMES: [&str; 8] = ["xyz", "XYZ", "zyx", "ZYX", "zxz", "ZXZ", "yxy", "XZX"];

    proptest! {
        #[test]
        fn a_rotation_is_that_of_its_angles(
            name in proptest::sample::select(&NAMES), angles in [-3.0..3.0_f64, -3.0..3.0, -3.0..3.0],
        ) {
            let sequence = EulerSequence::from_name(name).unwrap();
            let rotation = sequence.rotation(&angles);
            let pose = Pose::from_rotation(rotation, Vector3::zeros());
            let again = sequence.rotation(&sequence.angles(&pose).unwrap());
            prop_assert!(rotation.angle_to(&again) < 1e-7);
        }
    }

    #[test]
    fn axes_that_stay_are_axes_that_turn_along_in_the_other_order() {
        let moving = EulerSequence::from_name("XYZ").unwrap().rotation(&[0.1, 0.2, 0.3]);
        let fixed = EulerSequence::from_name("zyx").unwrap().rotation(&[0.3, 0.2, 0.1]);
        assert!(moving.angle_to(&fixed) < 1e-12);
    }

    #[test]
    fn names_of_no_axes_and_too_few_axes_are_refused() {
        for name in ["", "xx", "xyzx", "xY", "abc"] {
            assert_eq!(EulerSequence::from_name(name), Err(PoseError::Euler(name.into())));
        }
        let two = EulerSequence::from_name("xy").unwrap();
        assert_eq!(two.angles(&Pose::identity()), Err(PoseError::EulerCount(2)));
    }
}
