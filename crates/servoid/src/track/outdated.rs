//! Images that are those before, when what they show must be elsewhere by now.

use super::frame::input_checks::FARTHEST_S;
use super::motion::Motion;
use super::tracker::Tracker;
use crate::camera::Observation;
use crate::pose::Pose;

/// What was known when images were new: how the object moved, and where the first camera was.
#[derive(Debug, Clone, Copy)]
pub(super) struct Newest {
    time_s: f64,
    motion: Motion,
    world_from_camera: Pose,
}

/// How far what images show may have moved since, in radii of the object: half of what makes a pose wrong.
const MOVED: f64 = 0.1;

impl Tracker {
    /// Remembers what is known of an observation whose images are new.
    pub(super) fn note_newest(&mut self, observation: &Observation<'_>) {
        if !self.frame.is_stale() {
            self.newest = Some(Newest {
                time_s: observation.time_s,
                motion: self.motion,
                world_from_camera: observation.world_from_camera[0],
            });
        }
    }

    /// Says whether all images are those before although the object, as it moved, or the first camera
    /// must have moved on since they were new: they do not tell where it is now.
    pub(super) fn is_outdated(&self, observation: &Observation<'_>) -> bool {
        let Some(newest) = self.newest.filter(|_| self.frame.is_stale()) else { return false };
        // Motion is foreseen no farther than that, and an object that went so far does not come back.
        let until_s = observation.time_s.min(newest.time_s + 0.99 * FARTHEST_S);
        let before = newest.world_from_camera.inverse() * newest.motion.last();
        let now = observation.world_from_camera[0].inverse() * newest.motion.predict(until_s);
        let radius = self.target.solid.radius;
        let across = (now.translation() - before.translation()).norm();
        let turned = before.rotation().angle_to(&now.rotation());
        across + turned * radius > MOVED * radius
    }
}
