//! Predicts the pose of the object, and its uncertainty.

pub(super) mod drift;
pub(super) mod held_back;
pub(super) mod jitter;
pub(super) mod outdated;

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};

use super::frame::input_checks::FARTHEST_S;
use super::pose::search::Deviation;
use super::pose::uncertainty::inverse;
use super::tracker::Tracker;
use crate::pose::{Pose, Twist};

/// Last observed pose and motion of the object: its middle moves at constant velocity through the
/// world, and it rotates at constant angular velocity about it. While it is not seen, the
/// prediction slows down. A Kalman filter whose velocity may jump from image to image estimates the
/// uncertainty.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    seen: At,
    foreseen: At,
    /// Velocity in metres per second and angular velocity in radians per second, in the world.
    speed: Vector6<f64>,
    /// Covariance of the predicted pose, of the velocity, and of both together, in the world.
    place: Matrix6<f64>,
    pace: Matrix6<f64>,
    both: Matrix6<f64>,
}

#[derive(Debug, Clone, Copy)]
struct At {
    time_s: f64,
    world_from_object: Pose,
}

/// The prior of a pose before the image is evaluated: the predicted pose, and the information of a
/// small motion from it, in the object's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Prior {
    pub(super) pose: Pose,
    pub(super) information: Matrix6<f64>,
}

impl Prior {
    /// Returns the information and its pull at a pose, for small motions from that pose.
    pub(super) fn at(&self, pose: &Pose) -> (Matrix6<f64>, Vector6<f64>) {
        let off: Twist = (pose.inverse() * self.pose).log();
        (self.information, self.information * off)
    }
}

/// Factor of the standard deviation of the prediction: velocities do not change at random.
const WIDE: f64 = 1.5;
/// Factor of the variance after an image, beyond which the image adds nothing to the prediction:
/// errors of points are correlated.
const LASTING: f64 = 9.0;
/// Time constant with which the velocity decays while the object is not seen.
const FADES_S: f64 = 0.1;

impl Motion {
    pub(super) fn at_rest(time_s: f64, world_from_object: Pose) -> Self {
        let at = At { time_s, world_from_object };
        let (speed, zero) = (Vector6::zeros(), Matrix6::zeros());
        Self { seen: at, foreseen: at, speed, place: zero, pace: zero, both: zero }
    }

    /// Returns the pose at which the object was last seen.
    pub(super) fn last(&self) -> Pose {
        self.seen.world_from_object
    }

    /// Returns the standard deviation of the last observed orientation, in radians.
    pub(super) fn turn_sd(&self) -> f64 {
        self.place.fixed_view::<3, 3>(3, 3).trace().sqrt()
    }

    /// Predicts the pose at a time at constant velocity. If time does not advance, or jumps, the
    /// pose stays.
    pub(super) fn predict(&self, time_s: f64) -> Pose {
        let At { time_s: last_s, world_from_object: here } = self.foreseen;
        let Some(dt) = passed(last_s, time_s) else { return here };
        let turn = UnitQuaternion::from_scaled_axis(self.turning() * dt);
        Pose::from_rotation(turn * here.rotation(), here.translation() + self.velocity() * dt)
    }

    /// Returns the prior of the pose at a time, if the velocity changes by about `process_noise`
    /// until then.
    pub(super) fn prior(&self, time_s: f64, process_noise: Deviation) -> Prior {
        let mut later = *self;
        later.pass(time_s, process_noise);
        let pose = later.foreseen.world_from_object;
        let local = turned(&later.place, &pose.rotation().inverse());
        let information = inverse(&(local * (WIDE * WIDE))).unwrap_or_else(Matrix6::zeros);
        Prior { pose, information }
    }

    /// Returns the variance of the orientation at a time, in square radians.
    pub(super) fn turn_variance_at(&self, time_s: f64, process_noise: Deviation) -> f64 {
        let mut later = *self;
        later.pass(time_s, process_noise);
        later.turn_sd().powi(2)
    }

    /// Corrects all poses by a motion in the object's frame.
    pub(super) fn correct(&mut self, off: &Twist) {
        for at in [&mut self.seen, &mut self.foreseen] {
            at.world_from_object = (at.world_from_object * Pose::exp(off)).renormalized();
        }
    }

    /// Updates the filter by a pose whose error has a covariance in the object's frame; returns the
    /// parts of the uncertainty of position and orientation that it removed.
    pub(super) fn follow(
        &mut self,
        time_s: f64,
        world_from_object: Pose,
        covariance: &Matrix6<f64>,
        process_noise: Deviation,
    ) -> (f64, f64) {
        let goes_on = passed(self.foreseen.time_s, time_s).is_some();
        self.pass(time_s, process_noise);
        let found = turned(covariance, &world_from_object.rotation());
        let foreseen = self.foreseen.world_from_object;
        let turn = world_from_object.rotation() * foreseen.rotation().inverse();
        let across = world_from_object.translation() - foreseen.translation();
        let mut off = Vector6::zeros();
        off.fixed_rows_mut::<3>(0).copy_from(&across);
        off.fixed_rows_mut::<3>(3).copy_from(&turn.scaled_axis());
        let gains = (gain(&self.place, &found, 0), gain(&self.place, &found, 3));
        if let Some(inverse) = inverse(&self.place).filter(|_| goes_on) {
            let gain = self.both * inverse;
            self.speed += gain * off;
            self.pace -= gain * (self.place - found) * gain.transpose();
            self.both = gain * found;
        } else {
            self.stop();
        }
        self.place = found;
        self.seen = At { time_s, world_from_object };
        self.foreseen = self.seen;
        gains
    }

    /// Advances to a time at which the object was not seen.
    pub(super) fn wait(&mut self, time_s: f64, process_noise: Deviation) {
        let dt = passed(self.foreseen.time_s, time_s);
        self.pass(time_s, process_noise);
        if let Some(dt) = dt {
            let left = libm::exp(-dt / FADES_S);
            self.speed *= left;
            self.both *= left;
            self.pace *= left * left;
        }
    }

    /// Predicts the state at a time.
    fn pass(&mut self, time_s: f64, (across, slight): Deviation) {
        let last_s = self.foreseen.time_s;
        self.foreseen = At { time_s, world_from_object: self.predict(time_s) };
        let jump = |dt: f64| {
            let (across, slight) = ((across / dt).powi(2), (slight / dt).powi(2));
            Matrix6::from_diagonal(&Vector6::new(across, across, across, slight, slight, slight))
        };
        let Some(dt) = passed(last_s, time_s) else {
            self.stop();
            self.place += jump(1.0);
            return;
        };
        self.pace += jump(dt);
        self.place += (self.both + self.both.transpose()) * dt + self.pace * (dt * dt);
        self.both += self.pace * dt;
    }

    fn velocity(&self) -> Vector3<f64> {
        self.speed.fixed_rows::<3>(0).into()
    }

    fn turning(&self) -> Vector3<f64> {
        self.speed.fixed_rows::<3>(3).into()
    }

    fn stop(&mut self) {
        self.speed = Vector6::zeros();
        (self.pace, self.both) = (Matrix6::zeros(), Matrix6::zeros());
    }
}

/// Rotates the axes of a covariance of position and orientation.
fn turned(covariance: &Matrix6<f64>, by: &UnitQuaternion<f64>) -> Matrix6<f64> {
    let by = by.to_rotation_matrix().into_inner();
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&by);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&by);
    both * covariance * both.transpose()
}

/// Returns the part of the variance removed, for three directions starting at `from`.
fn gain(before: &Matrix6<f64>, after: &Matrix6<f64>, from: usize) -> f64 {
    let sum = |all: &Matrix6<f64>| all.fixed_view::<3, 3>(from, from).trace();
    let (before, after) = (sum(before), sum(after));
    if before > 0.0 { (1.0 - LASTING * after / before).clamp(0.0, 1.0) } else { 0.0 }
}

/// Returns the seconds from one time to a later one, unless they are too many.
fn passed(from_s: f64, to_s: f64) -> Option<f64> {
    let dt = to_s - from_s;
    (dt > 0.0 && dt < FARTHEST_S).then_some(dt)
}

impl Tracker {
    /// Corrects where the object is, and was lately, by a motion in its frame by which all that is known
    /// of it moved: the object itself did not move.
    pub(super) fn correct_motion(&mut self, off: &Twist) {
        self.motion.correct(off);
        self.target.bias.correct(off);
        if let Some(newest) = &mut self.newest {
            newest.correct(off);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 30.0;
    const SPEED: f64 = 0.6;
    const PROCESS_NOISE: Deviation = (0.001, 0.01);

    /// Pose of an object that moves at constant velocity along x and rotates about z.
    fn place(time_s: f64) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * time_s);
        Pose::from_rotation(turn, Vector3::x() * (SPEED * time_s))
    }

    /// Tracks that object for some images; also returns the time of the last one.
    fn followed(images: usize) -> (Motion, f64) {
        let mut motion = Motion::at_rest(0.0, place(0.0));
        for index in 1..=images {
            let known = Matrix6::identity() * 1e-12;
            motion.follow(index as f64 * DT, place(index as f64 * DT), &known, PROCESS_NOISE);
        }
        (motion, images as f64 * DT)
    }

    fn apart(one: &Pose, other: &Pose) -> (f64, f64) {
        let turn = one.rotation().inverse() * other.rotation();
        ((one.translation() - other.translation()).norm(), turn.angle())
    }

    #[test]
    fn an_even_motion_is_predicted_also_where_images_are_missing() {
        let (motion, last_s) = followed(20);
        for missing in 1..10 {
            let later_s = last_s + missing as f64 * DT;
            let (off, turned) = apart(&motion.predict(later_s), &place(later_s));
            assert!(off < 1e-9 && turned < 1e-9, "{missing}: {off} {turned}");
        }
    }

    #[test]
    fn what_is_not_seen_goes_on_ever_more_slowly_and_not_far() {
        let (mut motion, last_s) = followed(20);
        let (mut before, mut step) = (motion.last(), f64::INFINITY);
        for index in 1..60 {
            let now_s = last_s + index as f64 * DT;
            let foreseen = motion.predict(now_s);
            let (went, _) = apart(&before, &foreseen);
            assert!(went > 0.0 && went < step, "{index}: {went} after {step}");
            motion.wait(now_s, PROCESS_NOISE);
            (before, step) = (foreseen, went);
        }
        let (all, turned) = apart(&motion.last(), &before);
        let most = DT / (1.0 - libm::exp(-DT / FADES_S));
        assert!((0.9..1.0).contains(&(all / (SPEED * most))), "{all}");
        assert!(turned < most);
        assert_eq!(motion.last().translation(), place(last_s).translation());
    }

    #[test]
    fn where_time_stands_still_goes_back_or_jumps_nothing_moves() {
        let (motion, last_s) = followed(20);
        for later_s in [0.0, -1.0, 1.1 * FARTHEST_S, 1e9] {
            let (off, turned) = apart(&motion.predict(last_s + later_s), &place(last_s));
            assert!(off < 1e-12 && turned < 1e-9);
        }
    }

    #[test]
    fn without_information_from_images_the_motion_goes_on_as_predicted_and_its_variance_grows() {
        let (mut motion, last_s) = followed(20);
        let mut before = f64::INFINITY;
        for index in 1..12 {
            let now_s = last_s + index as f64 * DT;
            let prior = motion.prior(now_s, PROCESS_NOISE);
            let (off, turned) = apart(&prior.pose, &place(now_s));
            assert!(off < 1e-9 && turned < 1e-9, "{index}: {off} {turned}");
            let sure = prior.information.symmetric_eigenvalues().min();
            assert!(sure < before, "{index}");
            before = sure;
            // What was predicted is measured, with the same uncertainty as before.
            let known = prior.information.try_inverse().unwrap() / (WIDE * WIDE);
            let gains = motion.follow(now_s, prior.pose, &known, PROCESS_NOISE);
            assert_eq!(gains, (0.0, 0.0));
        }
    }

    #[test]
    fn the_pull_of_a_prior_is_its_information_times_the_way_back_to_its_pose() {
        let prior = followed(5).0.prior(6.0 * DT, PROCESS_NOISE);
        let (information, pull) = prior.at(&prior.pose);
        assert!(pull.amax() < 1e-9 * information.amax());
        let way = Twist::new(1e-3, -2e-3, 5e-4, 0.01, 0.02, -0.01);
        let (_, pull) = prior.at(&(prior.pose * Pose::exp(&-way)));
        assert!((information.try_inverse().unwrap() * pull - way).amax() < 1e-9);
    }

    #[test]
    fn a_correction_is_no_motion() {
        let (mut motion, last_s) = followed(20);
        let off = Twist::new(0.01, 0.0, 0.0, 0.0, 0.2, 0.0);
        let before = motion;
        motion.correct(&off);
        assert_eq!(motion.speed, before.speed);
        let (across, turned) = apart(&(before.last() * Pose::exp(&off)), &motion.last());
        assert!(across < 1e-12 && turned < 1e-7);
        let (went, _) = apart(&motion.last(), &motion.predict(last_s + DT));
        let (goes, _) = apart(&before.last(), &before.predict(last_s + DT));
        assert!((went - goes).abs() < 1e-12);
    }
}
