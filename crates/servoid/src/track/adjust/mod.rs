//! Adjusts keyframes and landmarks together, beside the tracker. The orientation drifts while an
//! object shows new sides; later observations, ideally of a side known before, reveal by how much.

mod bundle;
mod keeping;
pub(super) mod outlined;
mod schur;
mod worker;

use nalgebra::{Matrix6, Vector6};

use self::bundle::{Anchor, Bundle, KeyframePrior, Landmark, Sighting, Solution, Station};
pub(super) use self::worker::Job;
use super::estimate::Notice;
use super::target::Target;
use super::target::keyframes::Keyframe;
use super::target::points::Feature;
use super::tracker::Tracker;
use crate::pose::Pose;

/// Observations after which a solution is applied: a fixed delay gives the same bits.
const DELAY: usize = 3;
/// Least number of keyframes for an adjustment.
const LEAST_KEYFRAMES: usize = 3;
/// Standard deviation, in radians, of the rotation between keyframes as tracked, of the same while
/// distances are guesses, and of an object that was lost in between; the error of the position is
/// this part of the radius per radian.
const STEP_RAD: f64 = 0.03;
const GUESS_RAD: f64 = 0.15;
const LOST_RAD: f64 = 0.3;
const PLACE: f64 = 0.25;
/// Factor of the orientation's standard deviation due to noise: errors of neighbours are
/// correlated.
pub(super) const TOGETHER: f64 = 6.0;
/// The same for what motion alone says, of which the difference to what guesses say counts as well.
const BY_MOTION: f64 = 3.0;
/// Standard deviation of a landmark across its ray, in pixels.
const ANCHOR_PX: f64 = 0.15;
/// Largest motion of a keyframe, in radii and radians, that is accepted.
const TORN: f64 = 0.5;
/// Rotation from which on a correction is reported, in radians.
const REPORTED_RAD: f64 = 0.01;

/// An adjustment that is being computed.
#[derive(Debug, Clone)]
pub(super) struct Pending {
    pub(super) job: Job<Option<Solution>>,
    /// Numbers of its keyframes, and of its landmarks.
    keyframes: Vec<usize>,
    landmarks: Vec<usize>,
}

impl Tracker {
    /// Starts an adjustment of all keyframes, due later; a plain object has no landmarks for it.
    fn begin_adjusting(&mut self, delay: usize) {
        let enough = self.target.keyframes.all.len() >= LEAST_KEYFRAMES
            && !self.is_plain()
            && !self.is_outlined();
        if !self.settings.adjust || !enough || self.pending.is_some() {
            return;
        }
        let (bundle, landmarks) = self.target.bundle();
        let keyframes = self.target.keyframes.all.iter().map(|one| one.number).collect();
        let job = Job::new(delay, self.evolving.clone(), move || bundle.adjusted());
        self.pending = Some(Pending { job, keyframes, landmarks });
    }

    /// Applies a finished adjustment, once it is due.
    pub(super) fn take_adjusted(&mut self) {
        let due = self.pending.take_if(|pending| pending.job.is_due());
        let Some(pending) = due else { return };
        let Some(Some(solution)) = pending.job.result() else { return };
        if self.target.is_torn(&solution, &pending.keyframes) {
            return;
        }
        self.target.relief.measure(solution.bundle.misfit());
        self.target.relief.sighting_cost = solution.sighting_cost;
        let before = self.target.points.seen();
        let newest = self.target.correct(&solution, (&pending.keyframes, &pending.landmarks));
        // The current pose was found by the points that are seen now, so it moves along with them.
        let off = self.target.points.moved_since(&before).unwrap_or_else(|| newest.log());
        self.correct_motion(&off);
        let turned = off.fixed_rows::<3>(3).norm();
        if turned > REPORTED_RAD {
            self.jitter.pause();
            self.frame.notices.push(Notice::Adjusted { degrees: turned.to_degrees() });
        }
    }
}

impl Target {
    /// Returns the adjustment problem of keyframes and landmarks, and the numbers of the landmarks.
    fn bundle(&self) -> (Bundle, Vec<usize>) {
        let all = &self.keyframes.all;
        let radius = self.solid.radius;
        let stations = all.iter().enumerate().map(|(at, one)| station(all, at, one, radius));
        let (keyframes, is_guess) = (stations.collect(), self.relief.is_guess());
        let mut bundle = Bundle { keyframes, is_guess, ..Bundle::default() };
        let mut seen: Vec<_> = all
            .iter()
            .enumerate()
            .flat_map(|(keyframe, one)| one.sightings.iter().map(move |seen| (keyframe, seen)))
            .collect();
        seen.sort_by_key(|(_, seen)| seen.id);
        let mut ids = Vec::new();
        for group in seen.chunk_by(|a, b| a.1.id == b.1.id) {
            let Some(known) = self.points.with_id(group[0].1.id) else { continue };
            if group.len() < 2 || known.slides {
                continue;
            }
            let landmark = bundle.landmarks.len();
            bundle.landmarks.push(Landmark::of(known, self.anchor(known)));
            ids.push(known.id);
            bundle.sightings.extend(group.iter().filter_map(|(keyframe, seen)| {
                let world = all[*keyframe].cameras[seen.camera]?;
                let (keyframe, pixel, information) = (*keyframe, seen.pixel, seen.information);
                Some(Sighting { landmark, keyframe, world, pixel, information })
            }));
        }
        (bundle, ids)
    }

    fn anchor(&self, known: &Feature) -> Option<Anchor> {
        let keyframe = self.keyframes.place(known.origin.keyframe?)?;
        let px = known.point.steps[0].norm();
        Some(Anchor {
            keyframe,
            position_in_world: known.origin.position,
            toward_in_world: known.origin.toward,
            along: known.origin.variance.sqrt(),
            across: ANCHOR_PX * px,
        })
    }

    /// Returns whether a keyframe would be moved farther than anything drifts: contradictory
    /// observations tear the keyframes apart.
    fn is_torn(&self, solution: &Solution, numbers: &[usize]) -> bool {
        let far = |(number, station): (&usize, &Station)| {
            let all = &self.keyframes.all;
            let Ok(at) = all.binary_search_by_key(number, |one| one.number) else { return false };
            let off = (all[at].world_from_object.inverse() * station.world_from_object).log();
            let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
            across > TORN * self.solid.radius || turned > TORN
        };
        numbers.iter().zip(&solution.bundle.keyframes).any(far)
    }

    /// Applies a solution to everything; returns the motion of the newest keyframe, in the object's
    /// frame.
    fn correct(&mut self, solution: &Solution, (numbers, ids): (&[usize], &[usize])) -> Pose {
        let moves = self.keyframe_moves(solution, numbers);
        let last = moves.last().map_or_else(Pose::identity, |(_, by)| *by);
        // Keyframes added since move with those to which they are connected.
        let newer = self.keyframes.newer_than(numbers.last().copied().unwrap_or_default());
        let by = |mut number: usize| {
            while let Some((_, from)) = newer.iter().find(|(one, _)| *one == number) {
                number = *from;
            }
            let at = moves.partition_point(|(one, _)| *one <= number);
            moves[..at].last().map_or_else(Pose::identity, |(_, by)| *by)
        };
        self.keyframes.move_by(by);
        self.sides.move_by(by);
        self.ranges.move_by(by);
        let landmarks = solution.bundle.landmarks.iter().zip(&solution.distance_variances);
        let mut found = ids.iter().zip(landmarks).peekable();
        for known in &mut self.points.features {
            if let Some(keyframe) = known.origin.keyframe {
                known.move_by(&by(keyframe).inverse());
            }
            while found.next_if(|(id, _)| **id < known.id).is_some() {}
            if let Some((_, (landmark, variance))) = found.next_if(|(id, _)| **id == known.id) {
                known.place_at(landmark.position);
                if let Some(variance) = variance {
                    known.variance = known.origin.variance.min(TOGETHER * TOGETHER * variance);
                }
            }
        }
        self.points.know_drift(self.keyframes.drifts_of_points());
        self.keyframes.renew_former();
        self.ranges.know_drift(&self.keyframes);
        last
    }

    /// Returns the motion of each keyframe, and stores the variance of its orientation.
    fn keyframe_moves(&mut self, solution: &Solution, numbers: &[usize]) -> Vec<(usize, Pose)> {
        let mut moves = Vec::with_capacity(numbers.len());
        let found = solution.bundle.keyframes.iter().zip(&solution.turn_variances);
        let found = found.zip(&solution.by_motion);
        for (number, ((station, variance), by_motion)) in numbers.iter().zip(found) {
            let Ok(at) = self.keyframes.all.binary_search_by_key(number, |one| one.number) else {
                continue;
            };
            let keyframe = &mut self.keyframes.all[at];
            keyframe.drift_variance = TOGETHER * TOGETHER * variance + keyframe.unseen_drift();
            keyframe.relief_variance = by_motion.map(|one| one.doubt(BY_MOTION));
            moves.push((*number, keyframe.world_from_object.inverse() * station.world_from_object));
        }
        moves
    }

    /// Attaches the points of a dropped keyframe to the one before it.
    fn adopt(&mut self, dropped: &Keyframe) {
        let Some(at) = self.keyframes.place(dropped.number) else { return };
        let heir = &self.keyframes.all[at];
        let moved = heir.world_from_object * dropped.world_from_object.inverse();
        for known in &mut self.points.features {
            known.origin.adopt(dropped.number, (heir.number, &moved));
        }
    }
}

/// Returns the prior of a keyframe: the motion from the one before or, without one, the pose at
/// which it was found.
fn station(all: &[Keyframe], at: usize, one: &Keyframe, radius: f64) -> Station {
    let from = one.step.and_then(|(from, motion)| {
        let place = all[..at].binary_search_by_key(&from, |other| other.number).ok()?;
        Some((place, motion))
    });
    let (from, motion, turn) = match from {
        Some((from, motion)) if one.guesses => (Some(from), motion, GUESS_RAD),
        Some((from, motion)) => (Some(from), motion, STEP_RAD),
        None => (None, one.world_from_object, LOST_RAD),
    };
    let (place, turn) = ((PLACE * radius * turn).powi(-2), turn.powi(-2));
    let diagonal = Vector6::new(place, place, place, turn, turn, turn);
    let prior = KeyframePrior { from, motion, information: Matrix6::from_diagonal(&diagonal) };
    Station { world_from_object: one.world_from_object, prior: (!one.is_given).then_some(prior) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::pose::Twist;
    use crate::shape::{Body, Ellipsoid};
    use crate::track::target::feature::tests::feature;
    use crate::track::target::keyframes::KeyframePose;
    use crate::track::trust::tests::tracker;
    use crate::track::{Status, TrackSettings};

    fn keyframe_pose(turned: f64) -> KeyframePose {
        let world_from_object = Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, turned, 0.0));
        let object_from_camera = world_from_object.inverse().rotation();
        let (cameras, looks, thumbnail) = (vec![None], vec![None], None);
        KeyframePose { world_from_object, object_from_camera, cameras, looks, thumbnail }
    }

    #[test]
    fn keyframes_are_adjusted_only_where_the_landmarks_are_no_shading() {
        for share in [0.1, 1.0] {
            let mut tracker = tracker(Status::Tracking, 0.0);
            tracker.target = target();
            tracker.target.reference.printed_share = Some(share);
            tracker.target.reference.most_printed = share;
            tracker.begin_adjusting(1);
            assert_eq!(tracker.pending.is_some(), share == 1.0);
        }
    }

    /// Makes an object that was seen from three sides, with a point learned from each.
    fn target() -> Target {
        let ball = Ellipsoid::new(0, [0.0; 3], [0.05; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        let body = Body::new(Pose::identity(), vec![ball]).unwrap();
        let mut target = Target::new(&body, &TrackSettings::default());
        for number in 0..3 {
            let keyframe_pose = keyframe_pose(0.2 * number as f64);
            let pose = keyframe_pose.world_from_object;
            let none = (&target.points, &[][..]);
            let clear = (&[][..], &Default::default());
            target.keyframes.keep(keyframe_pose, none, clear, ((0.0, 0.0), number == 0, false));
            let mut known = feature();
            known.place_at(Vector3::new(0.01 * number as f64, 0.02, -0.04));
            known.set_origin((number, &pose), 0.0);
            target.points.add(&mut vec![known]);
        }
        target
    }

    fn solution(target: &Target, motions: [Twist; 3]) -> Solution {
        let (mut bundle, _) = target.bundle();
        for (station, motion) in bundle.keyframes.iter_mut().zip(&motions) {
            station.world_from_object = station.world_from_object * Pose::exp(motion);
        }
        let distance_variances = vec![None; bundle.landmarks.len()];
        let (turn_variances, by_motion) = (vec![1e-4; 3], vec![None; 3]);
        Solution { bundle, sighting_cost: 0.0, turn_variances, distance_variances, by_motion }
    }

    #[test]
    fn what_moves_with_a_keyframe_stays_where_it_was_seen() {
        let mut target = target();
        let before = target.clone();
        let motion = |size: f64| Twist::new(size, 0.0, -size, 0.0, 10.0 * size, size);
        let solution = solution(&target, [0.0, 0.002, 0.005].map(motion));
        target.correct(&solution, (&[0, 1, 2], &[]));
        for (number, known) in target.points.features.iter().enumerate() {
            let pose = |target: &Target| target.keyframes.all[number].world_from_object;
            let place = |target: &Target| target.points.features[number].point.position;
            let seen = |target: &Target| pose(target).transform(&place(target));
            assert!((seen(&target) - seen(&before)).norm() < 1e-12);
            assert!((known.point.position - known.origin.position).norm() > 0.0);
        }
        let learned = |target: &Target| target.points.features[2].origin.position;
        assert_eq!(learned(&target), learned(&before), "where it was learned stays");
    }

    #[test]
    fn what_no_sighting_shows_stays_in_doubt_whatever_is_adjusted() {
        let mut target = target();
        target.keyframes.all[2].held_back = 0.03;
        let solution = solution(&target, [Twist::zeros(); 3]);
        target.correct(&solution, (&[0, 1, 2], &[]));
        let adjusted = TOGETHER * TOGETHER * 1e-4;
        let drifts = target.keyframes.all.iter().map(|one| one.drift_variance);
        assert!(drifts.eq([adjusted, adjusted, adjusted + 0.03]));
    }

    #[test]
    fn what_contradicts_itself_is_not_taken_over() {
        let target = target();
        let turn = |size: f64| Twist::new(0.0, 0.0, 0.0, 0.0, size, 0.0);
        for (size, torn) in [(0.9 * TORN, false), (1.1 * TORN, true)] {
            let solution = solution(&target, [0.0, 0.0, size].map(turn));
            assert_eq!(target.is_torn(&solution, &[0, 1, 2]), torn);
        }
    }

    #[test]
    fn a_keyframe_that_makes_room_leaves_its_points_where_they_were_seen() {
        let mut target = target();
        let seen = target.points.features[1].origin.position;
        let (pose, heir) =
            (target.keyframes.all[1].world_from_object, target.keyframes.all[0].world_from_object);
        let dropped = target.keyframes.all.remove(1);
        target.adopt(&dropped);
        let learned = target.points.features[1].origin;
        assert_eq!(learned.keyframe, Some(0));
        let of = |pose: Pose, place| pose.inverse().transform(&place);
        assert!((of(heir, learned.position) - of(pose, seen)).norm() < 1e-12);
    }
}
