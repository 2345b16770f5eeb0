//! Orientations at which an object was seen: one that comes back is likely to show a known side.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::RngExt;

use crate::camera::Observation;
use crate::evolve::Rng;
use crate::pose::{Pose, Twist, even_turn};
use crate::track::tracker::Tracker;

/// Largest deviation from a known orientation that is tried, in radians about each axis.
const AROUND: f64 = 0.25;

/// The orientations at which an object was seen.
#[derive(Debug, Clone)]
pub(crate) struct KnownTurns {
    /// Where the first camera is now, in the world's frame.
    eye: Vector3<f64>,
    all: Vec<KnownTurn>,
}

/// An orientation at which an object was seen, in the world's frame.
#[derive(Debug, Clone, Copy)]
struct KnownTurn {
    turn: UnitQuaternion<f64>,
    /// The direction from the first camera to the object, with which it turns where that camera
    /// sees the same side of it elsewhere in the image. None for one that turns with nothing.
    way: Option<Vector3<f64>>,
}

impl KnownTurn {
    /// Returns the orientation at which the camera sees the same side along another way.
    fn seen_along(&self, way: &Vector3<f64>) -> UnitQuaternion<f64> {
        let Some(from) = self.way else { return self.turn };
        let to = way.normalize();
        let shortest = Quaternion::from_parts(1.0 + from.dot(&to), from.cross(&to));
        UnitQuaternion::try_new(shortest, 1e-6).map_or(self.turn, |by| by * self.turn)
    }
}

impl KnownTurns {
    /// Returns the orientation of an object at a position where the first camera sees it as in a
    /// known view, by its place among them.
    pub(super) fn turn_at(&self, view: usize, position: &Vector3<f64>) -> UnitQuaternion<f64> {
        self.all[view].seen_along(&(position - self.eye))
    }

    /// Draws an orientation of an object at a position: near a known one or, if none is known, any.
    pub(super) fn draw_at(&self, position: &Vector3<f64>, rng: &mut Rng) -> UnitQuaternion<f64> {
        if self.all.is_empty() {
            return draw_any(rng);
        }
        let one = self.all[rng.random_range(0..self.all.len())];
        let mut off = || rng.random_range(-AROUND..AROUND);
        let off = Pose::exp(&Twist::new(0.0, 0.0, 0.0, off(), off(), off())).rotation();
        one.seen_along(&(position - self.eye)) * off
    }
}

/// Draws an orientation, each as likely as any other.
pub(super) fn draw_any(rng: &mut Rng) -> UnitQuaternion<f64> {
    even_turn(rng.random(), rng.random(), rng.random())
}

impl Tracker {
    /// Returns the orientations of all known views, as the first camera sees the same sides now, and
    /// the last one.
    pub(super) fn known_turns(&self, observation: &Observation<'_>) -> KnownTurns {
        let world_from_camera = observation.world_from_camera[0];
        let views = self.target.eyes().map(|(object_from_camera, eye)| {
            let turn = world_from_camera.rotation() * object_from_camera.inverse();
            KnownTurn { turn, way: eye.map(|eye| turn * -eye.normalize()) }
        });
        let last = KnownTurn { turn: self.motion.last().rotation(), way: None };
        let all = views.chain(self.trust.is_started().then_some(last)).collect();
        KnownTurns { eye: world_from_camera.translation(), all }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::evolve;
    use crate::shape::Projection;
    use crate::track::Status;
    use crate::track::target::keyframes::Keyframes;
    use crate::track::target::keyframes::tests::keep;
    use crate::track::trust::tests::tracker;

    #[test]
    fn a_camera_sees_the_same_side_wherever_the_object_appears() {
        let mut rng = evolve::rng(0, 0);
        for _ in 0..100 {
            let turn = draw_any(&mut rng);
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
    fn what_is_drawn_lies_around_each_known_orientation_and_anywhere_if_none_is_known() {
        let mut rng = evolve::rng(0, 0);
        let known = [0.0, 2.0].map(|angle| KnownTurn {
            turn: UnitQuaternion::from_euler_angles(0.0, angle, 0.0),
            way: None,
        });
        let near = KnownTurns { eye: Vector3::zeros(), all: known.to_vec() };
        let none = KnownTurns { all: Vec::new(), ..near.clone() };
        let reach = AROUND * 3.0_f64.sqrt();
        let off = |turn: UnitQuaternion<f64>| known.map(|one| one.turn.angle_to(&turn));
        let mut draw = |from: &KnownTurns| off(from.draw_at(&Vector3::z(), &mut rng));
        let drawn: Vec<_> = (0..200).map(|_| draw(&near)).collect();
        assert!(drawn.iter().all(|off| off[0] <= reach || off[1] <= reach));
        for at in 0..2 {
            assert!(drawn.iter().any(|off| off[at] < 0.5 * AROUND));
            assert!(drawn.iter().any(|off| AROUND < off[at] && off[at] <= reach));
        }
        assert!((0..200).any(|_| draw(&none).iter().all(|off| *off > 1.0)));
    }

    #[test]
    fn a_keyframe_is_known_as_its_camera_saw_it_wherever_the_camera_is_now() {
        let mut tracker = tracker(Status::Tracking, 0.0);
        let camera = Camera::new([640, 480], [600.0; 2], [320.0, 240.0]).unwrap();
        let from_world = |pose: &Pose| Projection::new(&camera, pose);
        let then = Pose::exp(&Twist::new(0.1, 0.0, 0.0, 0.0, 0.3, 0.1));
        let object = Pose::exp(&Twist::new(0.2, -0.1, 0.6, 0.4, -0.8, 0.2));
        let side = (object.inverse() * then).translation().normalize();
        for camera_seen in [true, false] {
            tracker.target.keyframes = Keyframes::default();
            keep(&mut tracker.target.keyframes, 0.0);
            let one = &mut tracker.target.keyframes.all[0];
            one.world_from_object = object;
            one.object_from_camera = (object.inverse() * then).rotation();
            one.cameras = vec![camera_seen.then(|| from_world(&then))];
            let now = Pose::exp(&Twist::new(-0.2, 0.3, 0.1, 0.5, 1.0, -0.4));
            let (world_from_camera, images) = (vec![now], vec![None]);
            let observation =
                Observation { time_s: 0.0, world_from_camera, images, depths: Vec::new() };
            let known = tracker.known_turns(&observation);
            assert_eq!(known.eye, now.translation());
            assert_eq!(known.all.len(), 1 + usize::from(tracker.trust.is_started()));
            assert_eq!(known.all[0].way.is_some(), camera_seen);
            if let Some(way) = known.all[0].way {
                assert!((known.all[0].turn.inverse() * -way - side).norm() < 1e-9);
            }
        }
    }
}
