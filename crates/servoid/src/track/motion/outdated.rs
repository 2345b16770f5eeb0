//! Detects repeated images of an object that must have moved on by now.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector3};

use crate::camera::Observation;
use crate::pose::{Pose, Twist};
use crate::track::estimate::Status;
use crate::track::frame::input_checks::FARTHEST_S;
use crate::track::motion::Motion;
use crate::track::tracker::Tracker;

/// State when the images were last new: the object's motion, and the poses of the cameras.
#[derive(Debug, Clone)]
pub(crate) struct Newest {
    time_s: f64,
    motion: Motion,
    world_from_camera: Vec<Pose>,
    way: Way,
}

/// Distance by which the content of repeated images may have moved, in radii of the object: half of
/// what makes a pose wrong.
const MOVED: f64 = 0.1;
/// Least and greatest time span of the newest poses from which a velocity is estimated; the
/// greatest applies where there are more.
const SPAN_S: [f64; 2] = [0.1, 0.3];
/// Time over which a motion must have been steady to be extrapolated for longer than `FARTHEST_S`,
/// in seconds.
const STEADY_S: f64 = 1.0;
/// Number of parts of that time, whose velocities are compared.
const PARTS: usize = 4;
/// Approximate number of poses stored for that time.
const PLACES: usize = 48;
/// Standard deviations by which the parts may differ.
const SURE: f64 = 2.0;
/// Slowest motion that is distinguished from lasting errors, in radii per second.
const SLOWEST: f64 = 0.04;
/// Speed from which an object counts as moving when last seen, in radii per second: one that starts
/// is still slow.
const MOVING: f64 = 0.02;
/// Largest rotation that is predicted, in radians: a larger one would come around again.
const FARTHEST_TURN: f64 = 1.0;

impl Tracker {
    /// Stores the state at an observation whose images are new.
    pub(crate) fn note_newest(&mut self, observation: &Observation<'_>) {
        if self.frame.is_stale() || !self.frame.can_see() {
            return;
        }
        let before = self.newest.take();
        let (mut way, mut world_from_camera) = before.map_or_else(
            || (Way::new(), Vec::new()),
            |before| (before.way, before.world_from_camera),
        );
        world_from_camera.clone_from(&observation.world_from_camera);
        if self.status == Status::Tracking {
            way.go_on(observation.time_s, self.motion.last());
        }
        self.newest = Some(Newest {
            time_s: observation.time_s,
            motion: self.motion,
            world_from_camera,
            way,
        });
    }

    /// Returns whether all images are repeated although the object, by its motion, or the cameras
    /// must have moved since the images were new: then they do not show where it is now. A camera
    /// that moves along with the predicted object is no evidence that the object is there. What
    /// moves, however slowly, may be starting: after `FARTHEST_S` it can be anywhere.
    pub(crate) fn is_outdated(&self, observation: &Observation<'_>) -> bool {
        let Some(newest) = self.newest.as_ref().filter(|_| self.frame.is_stale()) else {
            return false;
        };
        let (seen, radius) = (newest.motion.last(), self.target.solid.radius);
        let cameras = observation.world_from_camera.iter().zip(&newest.world_from_camera);
        let shown = cameras.zip(&observation.images).filter(|(_, image)| image.is_some());
        // Where its image would put the object, for each camera present both now and then.
        let mut shown = shown.map(|((here, there), _)| (here, *here * there.inverse() * seen));
        let (first, before) = shown.clone().next().unwrap_or((&seen, seen));
        // The velocity is not extrapolated further than this; an object that went so far does not
        // come back.
        let until_s = observation.time_s.min(newest.time_s + 0.99 * FARTHEST_S);
        let soon = newest.motion.predict(until_s);
        let recent = newest.way.soon(until_s - newest.time_s);
        let later = newest.way.later(observation.time_s - newest.time_s, radius);
        let foreseen = [Some(soon), recent, later].into_iter().flatten();
        let has_moved = |from: &Pose, to: &Pose| {
            let turned = from.rotation().angle_to(&to.rotation());
            from.apart(to) + turned * radius > MOVED * radius
        };
        let has_gone = |from: &Pose| foreseen.clone().any(|now| has_moved(from, &now));
        // If the cameras rotated by different amounts, triangulation of the repeated images gives
        // another distance.
        let away = first.apart(&before);
        let parts = |(here, place): &(&Pose, Pose)| {
            before.apart(place) * away > MOVED * radius * first.apart(here)
        };
        let is_long = observation.time_s - newest.time_s > FARTHEST_S;
        (is_long && newest.way.was_moving(radius))
            || has_gone(&seen)
            || shown.any(|one| has_gone(&one.1) || parts(&one))
    }
}

impl Newest {
    /// Corrects all poses by a motion in the object's frame.
    pub(super) fn correct(&mut self, off: &Twist) {
        self.motion.correct(off);
        let places = self.way.places.iter_mut().chain(self.way.before.as_mut());
        places.for_each(|(_, place)| *place = (*place * Pose::exp(off)).renormalized());
    }
}

/// Poses of the object in the last second of new images, the newest last, and the last pose before
/// that if the object was unseen for long in between.
#[derive(Debug, Clone)]
struct Way {
    places: VecDeque<(f64, Pose)>,
    before: Option<(f64, Pose)>,
}

impl Way {
    /// Starts empty, with memory for all poses it will ever hold.
    fn new() -> Self {
        Self { places: VecDeque::with_capacity(PLACES + PARTS), before: None }
    }

    /// Adds a pose; if time does not advance, or jumps, all earlier poses but the last are
    /// forgotten.
    fn go_on(&mut self, time_s: f64, world_from_object: Pose) {
        let goes_on = |last_s: f64| time_s > last_s && time_s - last_s < FARTHEST_S;
        if let Some(&last) = self.places.back().filter(|(last_s, _)| !goes_on(*last_s)) {
            self.before = Some(last).filter(|(last_s, _)| time_s > *last_s);
            self.places.clear();
        }
        // Of fast cameras not every image is stored.
        let before = self.places.len().checked_sub(2).map(|at| self.places[at].0);
        if before.is_some_and(|before_s| time_s - before_s < STEADY_S / PLACES as f64) {
            self.places.pop_back();
        }
        self.places.push_back((time_s, world_from_object));
        while self.places.len() > PARTS + 1 && time_s - self.places[1].0 >= STEADY_S {
            self.places.pop_front();
        }
    }

    /// Predicts the pose some seconds after the object was last seen, at the velocity between the
    /// newest poses. The filter's velocity decays while nothing new is seen; a single new image
    /// does not restore it, but shows how far the object moved meanwhile.
    fn soon(&self, seconds: f64) -> Option<Pose> {
        let (_, last) = self.places.back().filter(|_| seconds > 0.0)?;
        let (across, turning) = self.velocity(SPAN_S[1])?;
        let turn = (turning * seconds).cap_magnitude(FARTHEST_TURN);
        let turn = UnitQuaternion::from_scaled_axis(turn);
        Some(Pose::from_rotation(turn * last.rotation(), last.translation() + across * seconds))
    }

    /// Returns whether the object was moving when its images were last new, rather than coming to
    /// rest.
    fn was_moving(&self, radius: f64) -> bool {
        let is_fast = |span_s: f64| {
            let velocity = self.velocity(span_s);
            velocity.is_some_and(|(across, turning)| {
                across.norm() + turning.norm() * radius > MOVING * radius
            })
        };
        SPAN_S.into_iter().all(is_fast)
    }

    /// Returns the linear and the angular velocity between the newest poses, over at most a span.
    fn velocity(&self, span_s: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let (last_s, last) = self.places.back()?;
        let mut older = self.places.iter().rev().skip_while(|(at_s, _)| last_s - at_s < SPAN_S[0]);
        let nearest = older.clone().next().or(self.before.as_ref())?;
        let spans = older.by_ref().take_while(|(at_s, _)| last_s - at_s <= span_s);
        let (first_s, first) = spans.last().unwrap_or(nearest);
        let turn = (last.rotation() * first.rotation().inverse()).scaled_axis();
        let across = last.translation() - first.translation();
        Some((across / (last_s - first_s), turn / (last_s - first_s)))
    }

    /// Predicts the pose some seconds after the object was last seen, if it moved so steadily
    /// before that it certainly continues; `None` if it was at rest or moved back and forth.
    fn later(&self, seconds: f64, radius: f64) -> Option<Pose> {
        let (Some((first_s, _)), Some((last_s, last))) = (self.places.front(), self.places.back())
        else {
            return None;
        };
        if seconds <= 0.0 || last_s - first_s < 0.5 * STEADY_S || self.places.len() <= PARTS {
            return None;
        }
        let places = (0..=PARTS).map(|part| self.places[part * (self.places.len() - 1) / PARTS]);
        let places: Vec<(f64, Pose)> = places.collect();
        let speeds = |change: fn(&Pose, &Pose) -> Vector3<f64>| -> Vec<Vector3<f64>> {
            let pairs = places.windows(2);
            pairs.map(|two| change(&two[0].1, &two[1].1) / (two[1].0 - two[0].0)).collect()
        };
        let velocity = steady(&speeds(|from, to| to.translation() - from.translation()));
        let turning =
            steady(&speeds(|from, to| (to.rotation() * from.rotation().inverse()).scaled_axis()));
        let speed = velocity.norm() + turning.norm() * radius;
        (speed > SLOWEST * radius).then(|| {
            let turn = (turning * seconds).cap_magnitude(FARTHEST_TURN);
            let turn = UnitQuaternion::from_scaled_axis(turn);
            Pose::from_rotation(turn * last.rotation(), last.translation() + velocity * seconds)
        })
    }
}

/// Returns the certain part of velocities: their mean, reduced by what chance can contribute, and
/// no more than the last one.
fn steady(speeds: &[Vector3<f64>]) -> Vector3<f64> {
    let mean = speeds.iter().sum::<Vector3<f64>>() / speeds.len() as f64;
    let Some(along) = mean.try_normalize(0.0) else { return mean };
    let off = speeds.iter().map(|speed| (speed - mean).norm_squared()).sum::<f64>();
    let sd = (off / (speeds.len() - 1) as f64).sqrt();
    let last = speeds.last().map_or(0.0, |speed| speed.dot(&along));
    along * (mean.norm() - SURE * sd).min(last).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::trust::tests::tracker;

    #[test]
    fn a_correction_of_what_is_known_of_an_object_is_no_motion_of_it() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let rest = Pose::exp(&Twist::new(0.1, 0.0, 0.5, 0.0, 0.3, 0.0));
        let off = Twist::new(0.01, 0.0, -0.02, 0.0, 0.6, 0.1);
        let (motion, world_from_camera) = (Motion::at_rest(0.0, rest), vec![Pose::identity()]);
        let way = Way::new();
        (tracker.motion, tracker.newest) =
            (motion, Some(Newest { time_s: 0.0, motion, world_from_camera, way }));
        let mut place = rest;
        for image in 0..40 {
            if image == 20 {
                tracker.correct_motion(&off);
                place = rest * Pose::exp(&off);
            }
            let newest = tracker.newest.as_mut().unwrap();
            newest.way.go_on(f64::from(image) / 30.0, place);
            assert!(!newest.way.was_moving(0.05), "{image}");
        }
        let newest = tracker.newest.unwrap();
        assert!(newest.motion.last().apart(&place) < 1e-12);
        assert!(tracker.motion.last().apart(&place) < 1e-12);
        assert!(newest.way.later(1.0, 0.05).is_none());
    }
}
