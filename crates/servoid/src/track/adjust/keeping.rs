//! Keeps keyframes, from whichever side the object shows.

use nalgebra::Vector2;

use super::DELAY;
use crate::camera::Observation;
use crate::pose::Pose;
use crate::track::frame::window::Window;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::target::Target;
use crate::track::target::keyframes::{KeyframePose, object_from_camera};
use crate::track::target::points::{LEAST_KNOWN, Match};
use crate::track::target::thumbnail::Thumbnail;
use crate::track::tracker::Tracker;

/// Standard deviation of the orientation above which known views are kept, too, in radians.
const KEEP_KNOWN_RAD: f64 = 0.012;

impl Tracker {
    /// Returns the number and the pose of the keyframe to which a pose belongs; before the first
    /// keyframe, those that it will have.
    pub(in crate::track) fn keyframe_around(
        &self,
        observation: &Observation<'_>,
        pose: &Pose,
    ) -> (usize, Pose) {
        let keyframe = self.target.keyframes.around(&object_from_camera(observation, pose));
        let upcoming = (self.target.keyframes.upcoming(), *pose);
        keyframe.map_or(upcoming, |one| (one.number, one.world_from_object))
    }

    /// Returns the keyframe to which a pose belongs, and that of the previous pose if it was
    /// another one, each as its number and pose.
    pub(in crate::track) fn keyframes_around(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
    ) -> [Option<(usize, Pose)>; 2] {
        if self.target.keyframes.all.is_empty() {
            return [None; 2];
        }
        let own = self.keyframe_around(observation, pose);
        let last = self.keyframe.replace(own.0).filter(|last| *last != own.0);
        [Some(own), last.and_then(|last| Some((last, self.target.keyframes.pose(last)?)))]
    }

    /// Adds a keyframe at a trusted pose where the object shows another side, and starts an
    /// adjustment.
    pub(in crate::track) fn keep_keyframe(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) {
        let object_from_camera = object_from_camera(observation, &hypothesis.pose);
        let adrift = self.target.points.drift_variance > KEEP_KNOWN_RAD * KEEP_KNOWN_RAD;
        let is_given = self.target.keyframes.all.is_empty() && !self.trust.is_started();
        let guesses = self.guesses();
        if !self.target.keyframes.is_new(&object_from_camera, (adrift, guesses)) {
            return;
        }
        let world = |window: &Window| window.projection(&Pose::identity());
        let keyframe_pose = KeyframePose {
            world_from_object: hypothesis.pose,
            object_from_camera,
            cameras: self.frame.windows.iter().map(world).collect(),
            looks: self.looks(observation, hypothesis),
            thumbnail: self.thumbnail(&hypothesis.pose),
        };
        let seen = (&self.target.points, &*self.workspace.matches);
        let clear = (&*self.frame.windows, &self.workspace.occlusion);
        let drift = (self.drift_of_new_points(), self.held_back_at(&object_from_camera));
        if let Some(dropped) =
            self.target.keyframes.keep(keyframe_pose, seen, clear, (drift, is_given, guesses))
        {
            self.target.adopt(&dropped);
        }
        self.begin_adjusting(if guesses { 1 } else { DELAY });
        self.begin_outlining();
    }

    /// Takes a thumbnail of what the first camera sees of the object.
    fn thumbnail(&self, pose: &Pose) -> Option<Thumbnail> {
        let is_hidden = |pixel: &Vector2<f64>| self.workspace.occlusion.hides(0, pixel) > 0.0;
        Thumbnail::take(self.frame.windows.first()?, (&self.target.solid, pose), is_hidden)
    }

    /// Returns whether the distances of most recognised points are still guesses.
    fn guesses(&self) -> bool {
        if !self.target.relief.is_open {
            return false;
        }
        let Target { points, solid, .. } = &self.target;
        let seen = self.workspace.matches.iter().filter(|one| one.is_recognised());
        let guess = |one: &&Match| points.features[one.view.point].has_free_distance(solid.radius);
        let known = seen.clone().filter(|one| !guess(one)).count();
        known < LEAST_KNOWN && seen.count() > known
    }
}
