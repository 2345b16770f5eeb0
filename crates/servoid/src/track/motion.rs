use nalgebra::{UnitQuaternion, Vector3};

use super::frame::senses::FARTHEST_S;
use crate::pose::Pose;

/// Where the object was and how it moved: its middle evenly through the world, and turning evenly
/// about it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    time_s: f64,
    world_from_object: Pose,
    velocity: Vector3<f64>,
    /// Turn a second, in the world.
    turning: Vector3<f64>,
}

/// Share of the newest motion in what is predicted.
const NEWEST: f64 = 0.8;

impl Motion {
    pub(super) fn at_rest(time_s: f64, world_from_object: Pose) -> Self {
        let zero = Vector3::zeros();
        Self { time_s, world_from_object, velocity: zero, turning: zero }
    }

    pub(super) fn last(&self) -> Pose {
        self.world_from_object
    }

    /// Says where the object is at a time if it goes on as before. Where time does not go on, or
    /// jumps, it is where it was.
    pub(super) fn predict(&self, time_s: f64) -> Pose {
        let dt = time_s - self.time_s;
        if !(dt > 0.0 && dt < FARTHEST_S) {
            return self.world_from_object;
        }
        let here = self.world_from_object;
        let turn = UnitQuaternion::from_scaled_axis(self.turning * dt);
        Pose::from_rotation(turn * here.rotation(), here.translation() + self.velocity * dt)
    }

    /// Goes on to a pose that was found.
    pub(super) fn follow(&mut self, time_s: f64, world_from_object: Pose) {
        let dt = time_s - self.time_s;
        if dt > 0.0 && dt < FARTHEST_S {
            let before = self.world_from_object;
            let velocity = (world_from_object.translation() - before.translation()) / dt;
            let turn = world_from_object.rotation() * before.rotation().inverse();
            self.velocity += NEWEST * (velocity - self.velocity);
            self.turning += NEWEST * (turn.scaled_axis() / dt - self.turning);
        } else {
            self.stop();
        }
        self.time_s = time_s;
        self.world_from_object = world_from_object;
    }

    /// Time goes on while nothing is seen: the object is supposed to stay.
    pub(super) fn wait(&mut self, time_s: f64) {
        self.stop();
        self.time_s = time_s;
    }

    fn stop(&mut self) {
        self.velocity = Vector3::zeros();
        self.turning = Vector3::zeros();
    }
}
