//! Orientations at which an object was seen: one that comes back rather shows a side that is known.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::RngExt;

use crate::camera::Observation;
use crate::evolve::Rng;
use crate::pose::{Pose, Twist};
use crate::track::tracker::Tracker;

/// Largest deviation from a known orientation that is tried, in radians about each axis.
const AROUND: f64 = 0.25;

/// An orientation at which the object was seen, in the world's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KnownTurn {
    turn: UnitQuaternion<f64>,
    /// The direction from the camera to the object, with which it turns where the camera sees the
    /// same side of it elsewhere in the image. None for one that turns with nothing.
    way: Option<Vector3<f64>>,
}

impl KnownTurn {
    /// Returns the orientation at which a camera sees the same side along another way.
    fn seen_along(&self, way: &Vector3<f64>) -> UnitQuaternion<f64> {
        let Some(from) = self.way else { return self.turn };
        let to = way.normalize();
        let shortest = Quaternion::from_parts(1.0 + from.dot(&to), from.cross(&to));
        UnitQuaternion::try_new(shortest, 1e-6).map_or(self.turn, |by| by * self.turn)
    }

    /// Draws an orientation near the one at which the object is seen along a way.
    pub(crate) fn near(&self, way: &Vector3<f64>, rng: &mut Rng) -> UnitQuaternion<f64> {
        let mut off = || rng.random_range(-AROUND..AROUND);
        self.seen_along(way) * Pose::exp(&Twist::new(0.0, 0.0, 0.0, off(), off(), off())).rotation()
    }
}

impl Tracker {
    /// Returns the orientations of all keyframes, as the first camera sees the same sides now, and
    /// the last one.
    pub(super) fn known_turns(&self, observation: &Observation<'_>) -> Vec<KnownTurn> {
        let world_from_camera = observation.world_from_camera[0].rotation();
        let keyframes = self.target.keyframes.all.iter().filter_map(|one| {
            let eye = one.cameras.first()?.as_ref()?.moved(&one.world_from_object).eye()?;
            let turn = world_from_camera * one.object_from_camera.inverse();
            Some(KnownTurn { turn, way: Some(turn * -eye.normalize()) })
        });
        let last = KnownTurn { turn: self.motion.last().rotation(), way: None };
        keyframes.chain(self.trust.is_started().then_some(last)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolve;
    use crate::pose::even_turn;

    #[test]
    fn a_camera_sees_the_same_side_wherever_the_object_appears() {
        let mut rng = evolve::rng(0, 0);
        for _ in 0..100 {
            let turn = even_turn(rng.random(), rng.random(), rng.random());
            let mut way = || {
                let mut any = || rng.random_range(-1.0..1.0);
                Vector3::new(any(), any(), 1.0)
            };
            let (from, to) = (way().normalize(), way());
            let seen = KnownTurn { turn, way: Some(from) }.seen_along(&to);
            let side = |turn: UnitQuaternion<f64>, way: Vector3<f64>| turn.inverse() * way;
            assert!((side(turn, from) - side(seen, to.normalize())).norm() < 1e-12);
            let shortest = from.angle(&to);
            assert!(
                (seen.angle_to(&turn) - shortest).abs() < 1e-6,
                "it does not turn about its way"
            );
            assert_eq!(KnownTurn { turn, way: None }.seen_along(&to), turn);
        }
        let one = KnownTurn { turn: UnitQuaternion::identity(), way: Some(Vector3::z()) };
        assert_eq!(one.seen_along(&-Vector3::z()), one.turn, "no shortest way leads to the back");
    }

    #[test]
    fn orientations_near_a_known_one_differ_and_stay_near_it() {
        let mut rng = evolve::rng(0, 0);
        let one = KnownTurn { turn: UnitQuaternion::identity(), way: None };
        let off: Vec<_> = (0..100).map(|_| one.near(&Vector3::z(), &mut rng).angle()).collect();
        assert!(off.iter().all(|&angle| angle <= AROUND * 3.0_f64.sqrt()));
        assert!(off.iter().any(|&angle| angle > 0.8 * AROUND));
    }
}
