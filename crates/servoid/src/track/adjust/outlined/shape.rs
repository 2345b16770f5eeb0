//! The numbers of an ellipsoid that are adjusted: centre, logarithms of its radii, and orientation.

use nalgebra::{Matrix3, SVector, UnitQuaternion, Vector3};

use crate::pose::{Pose, Twist};
use crate::shape::{Ellipsoid, Quadric};

/// A small change of an ellipsoid: of its centre, of the logarithms of its radii, and a rotation
/// about its own axes.
pub(super) type Change = SVector<f64, 9>;

/// An ellipsoid of the body, in the object's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Part {
    pub(super) center: Vector3<f64>,
    pub(super) log_radii: Vector3<f64>,
    pub(super) rotation: UnitQuaternion<f64>,
}

/// Share of the radius of an ellipsoid by which the middles of its halves lie off its own, and that
/// they have of it.
const HALF_AT: f64 = 0.45;
const HALF_LONG: f64 = 0.6;

impl Part {
    pub(crate) fn of(ellipsoid: &Ellipsoid) -> Self {
        Self {
            center: ellipsoid.center(),
            log_radii: ellipsoid.radii().map(libm::log),
            rotation: ellipsoid.rotation(),
        }
    }

    pub(super) fn ball(center: Vector3<f64>, radius: f64) -> Self {
        let log_radii = Vector3::repeat(libm::log(radius));
        Self { center, log_radii, rotation: UnitQuaternion::identity() }
    }

    /// Returns the ellipsoid; none if its numbers went out of range.
    pub(crate) fn ellipsoid(&self, index: usize) -> Option<Ellipsoid> {
        let radii = self.radii().into();
        let made = Ellipsoid::new(index, self.center.into(), radii, [1.0, 0.0, 0.0, 0.0]).ok()?;
        Some(made.turned_to(self.rotation))
    }

    pub(super) fn radii(&self) -> Vector3<f64> {
        self.log_radii.map(libm::exp)
    }

    pub(super) fn quadric(&self) -> Quadric {
        Quadric { center: self.center, factor: self.axes() * Matrix3::from_diagonal(&self.radii()) }
    }

    pub(super) fn axes(&self) -> Matrix3<f64> {
        self.rotation.to_rotation_matrix().into_inner()
    }

    pub(super) fn moved(&self, by: &Change) -> Self {
        let turn = Pose::exp(&Twist::new(0.0, 0.0, 0.0, by[6], by[7], by[8]));
        let mut rotation = self.rotation * turn.rotation();
        rotation.renormalize();
        Self {
            center: self.center + by.fixed_rows::<3>(0),
            log_radii: self.log_radii + by.fixed_rows::<3>(3),
            rotation,
        }
    }

    /// Returns the change that leads here from another ellipsoid.
    pub(super) fn change_from(&self, other: &Self) -> Change {
        let turn = Pose::from_rotation(other.rotation.inverse() * self.rotation, Vector3::zeros());
        let mut change = Change::zeros();
        change.fixed_rows_mut::<3>(0).copy_from(&(self.center - other.center));
        change.fixed_rows_mut::<3>(3).copy_from(&(self.log_radii - other.log_radii));
        change.fixed_rows_mut::<3>(6).copy_from(&turn.log().fixed_rows::<3>(3));
        change
    }

    /// Returns two ellipsoids that fill its halves, across its longest axis.
    pub(super) fn halves(&self) -> [Self; 2] {
        let axis = self.log_radii.imax();
        let way = self.axes().column(axis) * (HALF_AT * self.radii()[axis]);
        let mut log_radii = self.log_radii;
        log_radii[axis] += libm::log(HALF_LONG);
        [-1.0, 1.0].map(|side| Self { center: self.center + way * side, log_radii, ..*self })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn part() -> Part {
        let turn = Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.3, -0.5, 0.2)).rotation();
        Part {
            center: Vector3::new(0.01, -0.02, 0.03),
            log_radii: Vector3::new(0.05, 0.03, 0.02).map(libm::log),
            rotation: turn,
        }
    }

    proptest! {
        #[test]
        fn a_change_leads_from_an_ellipsoid_to_another_one(
            by in prop::array::uniform9(-0.4..0.4_f64),
        ) {
            let by = Change::from(by);
            let back = part().moved(&by).change_from(&part());
            prop_assert!((back - by).amax() < 1e-9, "{back}");
        }
    }

    #[test]
    fn a_part_is_its_ellipsoid() {
        let ellipsoid = part().ellipsoid(0).unwrap();
        assert!(Part::of(&ellipsoid).change_from(&part()).amax() < 1e-12);
        assert!((ellipsoid.factor() - part().quadric().factor).amax() < 1e-12);
    }
}
