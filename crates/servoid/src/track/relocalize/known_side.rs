//! Returns to a side that is known well, after the orientation drifted on the way. Points that were
//! learned meanwhile agree with the pose by which they were learned, and there are as many of them
//! as of those that are known: so here only the known ones are compared.

use nalgebra::{UnitQuaternion, Vector3};

use crate::camera::Observation;
use crate::pose::Pose;
use crate::track::TrackError;
use crate::track::estimate::Status;
use crate::track::inputs::Inputs;
use crate::track::motion::drift::CLOSED;
use crate::track::pose::hypothesis::{COARSEST, Hypothesis};
use crate::track::pose::refine::Workspace;
use crate::track::target::keyframes::object_from_camera;
use crate::track::target::points::{LEAST_KNOWN, thin};
use crate::track::tracker::{MARGIN, Tracker};
use crate::track::trust::CLEAR;

/// Images in which the orientation had drifted from which on a known side is sought: one that has
/// just turned away is no loop.
const ADRIFT_FOR: usize = 8;
/// Images from one search to the next, and the same after many images. Rivals are sought in even
/// images, known sides in odd ones.
const EVERY: usize = 2;
const SELDOM: (usize, usize) = (128, 8);
/// Standard deviation of the orientation, in radians, up to which a side is known.
const KNOWN_RAD: f64 = 0.04;
/// Standard deviations of the drift within which a known side is sought.
const WITHIN_SDS: f64 = 2.5;
/// Starts of searches on the way from the view that is followed to the nearest known one, ends
/// included; the searches take turns.
const STARTS: usize = 4;
/// Search range around a start, in radii and radians.
const RANGE: (f64, f64) = (0.25, 0.35);
/// Least share of the known points, the outline and the colours that must be seen.
const LEAST_SHARE: f64 = 0.85;

/// A pose at which a known side is seen.
struct KnownSide {
    pose: Pose,
    support: f64,
    /// Variance of the orientation, by the points that are recognised there.
    drift_variance: f64,
}

impl Tracker {
    /// While the orientation may have drifted, searches for a known side now and then. If it is
    /// seen, closes the loop, corrects the expected pose, and replaces the hypothesis. Returns the
    /// number of poses scored.
    pub(in crate::track) fn return_to_known_side(
        &mut self,
        observation: &Observation<'_>,
        expected: &mut Pose,
        hypothesis: &mut Hypothesis,
    ) -> Result<usize, TrackError> {
        let Some(start) = self.start_of_search(observation, &hypothesis.pose) else { return Ok(0) };
        // The matches of the hypothesis refer to these.
        let visible = self.workspace.visible.clone();
        let in_view = self.workspace.in_view.clone();
        self.known_in_view(&start);
        if self.workspace.in_view.len() < self.least_known() {
            (self.workspace.visible, self.workspace.in_view) = (visible, in_view);
            return Ok(0);
        }
        let mut known: Vec<usize> = self.workspace.in_view.iter().map(|view| view.point).collect();
        known.sort_unstable();
        known.dedup();
        let (found, scored) = self.known_side(observation, &hypothesis.pose, (&start, &known))?;
        let Some(found) = found else {
            *hypothesis = self.back_at(observation, expected, &hypothesis.pose);
            return Ok(scored);
        };
        let drifts = (self.target.points.drift_variance, self.most_known());
        let off = (expected.inverse() * found.pose).log();
        self.turn_back(expected, &off, drifts);
        self.target.points.drift_variance = found.drift_variance;
        *expected = self.motion.predict(observation.time_s);
        self.open_windows(observation, &found.pose, MARGIN);
        self.points_in_view(&found.pose);
        let prior = self.motion.prior(observation.time_s, self.process_noise());
        *hypothesis = self.hypothesis(observation, &found.pose, 0, Some(&prior));
        if hypothesis.quality.share >= CLEAR {
            self.trust.confirm_turn();
        }
        Ok(scored)
    }

    /// Returns where a search starts in this image, if a known side is sought in it.
    fn start_of_search(&self, observation: &Observation<'_>, followed: &Pose) -> Option<Pose> {
        let adrift = self.trust.adrift;
        let every = if adrift < SELDOM.0 { EVERY } else { SELDOM.1 };
        let is_due = adrift >= ADRIFT_FOR && adrift % every == 1;
        let can_see = self.status == Status::Tracking && !self.frame.is_stale();
        if !is_due || !can_see || self.is_plain() {
            return None;
        }
        self.toward_known_side(observation, followed, adrift / every)
    }

    /// Searches around a start, scored by known points, for a pose near the one that is followed at
    /// which such points are recognised; returns the best one, and the number of poses scored.
    fn known_side(
        &mut self,
        observation: &Observation<'_>,
        followed: &Pose,
        (start, known): (&Pose, &[usize]),
    ) -> Result<(Option<KnownSide>, usize), TrackError> {
        let within = WITHIN_SDS * self.target.points.drift_variance.sqrt();
        self.open_windows(observation, start, MARGIN);
        let range = (RANGE.0 * self.target.solid.radius, RANGE.1);
        let area = self.area(start);
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let place = (start, range, area);
        let found = self.relocalizer.by_points(inputs, place, known)?;
        let mut scored = found.evaluations;
        let mut best: Option<KnownSide> = None;
        for candidate in &[found.pose, *followed] {
            self.known_in_view(candidate);
            let pose = self.hypothesis(observation, candidate, COARSEST, None).pose;
            self.known_in_view(&pose);
            let quality = self.evaluate(observation, &pose, None).quality;
            scored += 1;
            let least = self.least_known() as f64;
            let is_seen = quality.share >= LEAST_SHARE
                && quality.textured >= least
                && (followed.rotation().inverse() * pose.rotation()).angle() < within;
            let drift = self.target.points.median_drift(&self.workspace.matches);
            let Some(drift_variance) = drift.filter(|_| is_seen) else { continue };
            if best.as_ref().is_none_or(|best| quality.support > best.support) {
                best = Some(KnownSide { pose, support: quality.support, drift_variance });
            }
        }
        Ok((best, scored))
    }

    /// Returns the variance of the orientation up to which a side is known, compared with the one
    /// that is followed.
    fn most_known(&self) -> f64 {
        (CLOSED.1 * self.target.points.drift_variance).min(KNOWN_RAD * KNOWN_RAD)
    }

    /// Returns the least number of known points, of all cameras, by which a side is recognised.
    fn least_known(&self) -> usize {
        LEAST_KNOWN * self.frame.open().max(1)
    }

    /// Selects the known points that should be visible at a pose.
    fn known_in_view(&mut self, pose: &Pose) {
        self.points_in_view(pose);
        let most = self.most_known();
        let features = &self.target.points.features;
        let Workspace { visible, in_view, .. } = &mut self.workspace;
        visible.retain(|view| {
            let feature = &features[view.point];
            feature.drift_variance <= most && !feature.slides && !feature.is_edgel
        });
        in_view.clear();
        for of_camera in visible.chunk_by(|one, other| one.camera == other.camera) {
            thin(of_camera, self.settings.points, in_view);
        }
    }

    /// Returns a pose that is turned some way from another to where the first camera sees the
    /// nearest known side, as far as the orientation may have drifted; none if no side is known.
    fn toward_known_side(
        &self,
        observation: &Observation<'_>,
        pose: &Pose,
        attempt: usize,
    ) -> Option<Pose> {
        let most = self.most_known();
        let within = WITHIN_SDS * self.target.points.drift_variance.sqrt();
        let now = object_from_camera(observation, pose);
        let known = self.target.keyframes.all.iter().filter(|one| one.drift_variance <= most);
        let known = known.map(|one| one.object_from_camera);
        let nearest = known.min_by(|a, b| now.angle_to(a).total_cmp(&now.angle_to(b)))?;
        let turn = now * nearest.inverse();
        let Some((axis, angle)) = turn.axis_angle() else { return Some(*pose) };
        let part = (attempt % STARTS) as f64 / (STARTS - 1) as f64;
        let turn = UnitQuaternion::from_axis_angle(&axis, part * angle.min(within));
        Some(*pose * Pose::from_rotation(turn, Vector3::zeros()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Twist;
    use crate::track::target::keyframes::tests::keep;
    use crate::track::trust::tests::tracker;

    /// Returns a tracker that knows a side, and the pose and the observation at which it is seen.
    fn knowing(turned: f64) -> (Tracker, Pose, Observation<'static>) {
        let mut tracker = tracker(Status::Tracking, 60.0);
        keep(&mut tracker.target.keyframes, turned);
        tracker.target.keyframes.all[0].drift_variance = 0.0;
        let (time_s, world_from_camera) = (0.0, vec![Pose::identity()]);
        let (images, depths) = (vec![None], Vec::new());
        let observation = Observation { time_s, world_from_camera, images, depths };
        (tracker, at(turned), observation)
    }

    fn at(turned: f64) -> Pose {
        Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, turned, 0.0))
    }

    #[test]
    fn searches_start_from_the_followed_view_to_the_known_one_as_far_as_the_orientation_drifted() {
        for drift in [0.05, 0.2, 0.6] {
            let (mut tracker, known, observation) = knowing(0.3);
            tracker.target.points.drift_variance = drift * drift;
            let followed = at(0.9);
            let angle =
                |one: &Pose, other: &Pose| (one.rotation().inverse() * other.rotation()).angle();
            let starts: Vec<Pose> = (0..STARTS)
                .map(|attempt| tracker.toward_known_side(&observation, &followed, attempt).unwrap())
                .collect();
            assert!(angle(&starts[0], &followed) < 1e-9);
            let way = 0.6_f64.min(WITHIN_SDS * drift);
            for (at, start) in starts.iter().enumerate() {
                let part = way * at as f64 / (STARTS - 1) as f64;
                assert!((angle(start, &followed) - part).abs() < 1e-9, "{drift}");
                assert!((angle(start, &known) - (0.6 - part)).abs() < 1e-9, "{drift}");
                assert!((start.translation() - followed.translation()).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn what_is_known_no_better_than_what_is_followed_is_no_known_side() {
        let (mut tracker, _, observation) = knowing(0.3);
        let followed = at(0.9);
        let mut is_sought = |drift: f64, known: f64| {
            tracker.target.points.drift_variance = drift * drift;
            tracker.target.keyframes.all[0].drift_variance = known * known;
            tracker.toward_known_side(&observation, &followed, STARTS - 1).is_some()
        };
        assert!(is_sought(0.2, 0.0) && is_sought(0.2, 0.9 * KNOWN_RAD));
        assert!(!is_sought(0.2, 1.1 * KNOWN_RAD) && !is_sought(1.2 * KNOWN_RAD, 0.9 * KNOWN_RAD));
    }
}
