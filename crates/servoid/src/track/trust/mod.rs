//! Decides what is reported of a pose that is followed and what may be learned from it, by the
//! thresholds here. The shares from which on a pose is followed are settings.

mod found_turn;
mod outline;
mod parting;
mod print;
mod report;
mod spin;
mod state;

pub(super) use self::parting::Parting;
pub(super) use self::print::is_plain;
pub(super) use self::state::Trust;
use super::estimate::Status;
use super::pose::confidence::Evidence;
use super::pose::hypothesis::Hypothesis;
use super::pose::verify::Quality;
use super::settings::TrackSettings;
use super::target::Target;
use super::target::relief::Relief;
use super::tracker::Tracker;
use super::update::Updates;
use crate::pose::Pose;

/// Share of what should be visible of an object below which part of it counts as hidden.
pub(super) const CLEAR: f64 = 0.8;
/// Share from which on an object that is followed is reported as located. Between `held` and this
/// about half of the poses are wrong.
const LOCATED: f64 = 0.68;
/// The same for an object that was seen all the time and whose orientation is known.
const LOCATED_IF_HELD: f64 = 0.5;
/// Share from which on the orientation is reported.
const ORIENTED: f64 = 0.64;
/// Probability of being right from which on a pose that is followed is reported as tracked.
const LIKELY: f64 = 0.8;
/// Least number of surface points per camera for the orientation to be reported, and least number
/// of them with the contrast of a pattern, unless at least as many as the last number usually have
/// it.
const FEW_RECOGNISED: f64 = 8.0;
const SOME: f64 = 18.0;
const RICH: f64 = 22.0;
/// Share of what should be visible from which on the orientation is reported by points that only
/// one camera sees, where keyframes do not confirm the body by which their distances were guessed.
const GUESSED: f64 = 0.88;
/// Mean cost of a sighting in an adjustment up to which distances by motion alone are consistent: of
/// maps of right poses it is at most 0.6, of wrong ones it grows to 1.6 and 3.5, in small images to 1.
const CONSISTENT: f64 = 1.2;
/// Penalty: a pose with a contradiction keeps at most this part of the trusted share, so that it is
/// not trusted however well the rest fits.
const PENALTY: f64 = 0.9;
/// Part of the reference share below which a pose is refined again, from other starts and
/// resolutions, and compared with a rival now and then.
const RETRY: f64 = 0.9;
/// Share and part of the reference support from which on no other candidate is considered.
const SURE: (f64, f64) = (0.7, 0.6);
/// Surface points usually seen of an object with a pattern: its orientation is not trusted without
/// some of them.
const PATTERN: f64 = 12.0;
/// Number of surface points that suffices, however many the reference has.
const MANY: f64 = 24.0;
/// Share of the reference surface points below which a pose from a search is not accepted: the
/// outline alone fits too many poses.
pub(super) const LEAST_RECOGNISED: f64 = 0.25;
/// Least deviation from the expected pose that counts as a jump, in radii and radians, and the
/// share of the reference surface points that must be seen after one.
const JUMP: f64 = 0.1;
const LANDED: f64 = 0.6;
/// Share from which on a jump is accepted at once.
const SAFE: f64 = 0.85;
/// Standard deviation of the orientation, in radians, below which an unknown side is learned.
const HELD_RAD: f64 = 0.15;
/// Standard deviation of the orientation's drift, in radians, above which the orientation is not
/// reported, whatever is recognised, and a pose is sought that shows sides that are known better.
pub(super) const ADRIFT_RAD: f64 = 0.09;
/// Share of a pose's covariance that is reported where the outline alone shows it: the bias with
/// which outlines measure poses is that of a guessed body's.
pub(super) const OF_KNOWN_SHAPE: f64 = 0.05;

/// Returns whether the images show the orientation of an object whose position they confirm, by some
/// surface points. They must have the contrast of a pattern unless the object usually has many such
/// points, since highlights, rims and shading move with the camera. `printed` is the number of
/// points per camera that have it now or mostly had it: far away or blurred, a print has less.
pub(super) fn shows_turn(evidence: &Evidence, printed: f64) -> bool {
    let is_patterned = printed >= SOME || evidence.reference_textured >= RICH;
    is_patterned && evidence.recognised >= FEW_RECOGNISED && evidence.share >= ORIENTED
}

/// Returns whether an orientation that the images show is likely, and drifted little.
pub(super) fn is_turn_reliable(evidence: &Evidence, most_rad: f64) -> bool {
    evidence.drifts_little(most_rad) && evidence.probability() >= LIKELY
}

/// Returns whether distances that the body alone or motion gives are believed: unless keyframes
/// confirm the body, most of the points must be where they should be. Where motion gives them, the
/// keyframes must agree with each other, as nothing else tells whether it gave the right ones of an
/// object that was looked at once.
fn is_relief_believed(relief: &Relief, share: f64) -> bool {
    if relief.is_open {
        return !relief.is_of_one_look || relief.sighting_cost <= CONSISTENT;
    }
    relief.is_confirmed() || share >= GUESSED
}

impl Tracker {
    /// Returns the share of what should be visible from which on a pose is accepted.
    pub(super) fn least_share(&self) -> f64 {
        let TrackSettings { trusted, held, .. } = self.settings;
        if self.status == Status::Tracking { held } else { trusted }
    }

    /// Returns whether the images confirm the position of an object that is followed.
    pub(super) fn is_located(&self, quality: &Quality) -> bool {
        let reference = self.target.reference.recognised;
        let least = (LEAST_RECOGNISED * reference).min(MANY);
        let held = self.is_held();
        let threshold = if held { LOCATED_IF_HELD } else { LOCATED };
        let by_outline = self.is_known_by_outline(quality);
        let known = reference < PATTERN || quality.recognised >= least || held || by_outline;
        let is_seen = quality.share >= threshold.max(self.settings.held) && known;
        self.trust.proved && !self.parting.is_certain() && is_seen
    }

    /// Returns whether the object was seen all the time and its orientation is known, so that a
    /// side that turns into view belongs to it.
    fn is_held(&self) -> bool {
        self.trust.is_unbroken() && self.trust.proved && self.motion.turn_sd() < HELD_RAD
    }

    /// Returns the share below which less is seen than usual.
    pub(super) fn usual_share(&self) -> f64 {
        RETRY * self.target.reference.share
    }

    /// Returns the share below which a recognised pattern proves no pose. Where distances are
    /// estimated from motion, more than usual is missed at right poses as well.
    pub(super) fn least_share_of_print(&self) -> f64 {
        if self.target.relief.is_open { 0.0 } else { self.usual_share() }
    }

    /// Returns whether the orientation can be trusted though its points lie where the body alone
    /// puts them.
    pub(super) fn believes_relief(&self, quality: &Quality) -> bool {
        let Target { relief, points, .. } = &self.target;
        is_relief_believed(relief, quality.share) || !points.are_from_body(&self.workspace.matches)
    }

    /// From now on estimates distances from motion alone, if a single camera is about to lose the
    /// object by the body's shape, or if that decides the orientation.
    pub(super) fn doubt_relief(&mut self, quality: &Quality) {
        let Target { relief, points, reference, solid, .. } = &mut self.target;
        let is_denied = relief.is_denied(quality.share, reference.share);
        let decides = relief.decides_turn(quality.visible >= CLEAR);
        if (is_denied || decides) && points.are_from_body(&self.workspace.matches) {
            relief.is_open = true;
            points.open(solid.radius);
        }
    }

    /// Returns whether it is worth refining a pose once more.
    pub(super) fn needs_retry(&self, quality: &Quality) -> bool {
        quality.share < self.settings.trusted.max(self.usual_share())
    }

    pub(super) fn is_sure(&self, hypothesis: &Hypothesis) -> bool {
        let quality = hypothesis.quality;
        quality.share > SURE.0 && quality.support > SURE.1 * self.target.reference.support
    }

    /// Makes a pose untrusted that jumped or, of an object that was not followed, at which too little
    /// is recognised.
    pub(super) fn penalize_doubtful(&self, expected: &Pose, hypothesis: &mut Hypothesis) {
        if self.status == Status::Tracking {
            self.penalize_jump(expected, hypothesis);
        } else {
            self.penalize_unrecognised(hypothesis);
        }
    }

    /// Makes a pose untrusted at which too little of the surface is recognised, where the object
    /// was not tracked just before.
    pub(super) fn penalize_unrecognised(&self, hypothesis: &mut Hypothesis) {
        if self.status != Status::Tracking {
            // Only where the object was a moment ago may it be assumed to be hidden.
            hypothesis.quality.share = hypothesis.quality.visible;
        }
        if hypothesis.quality.recognised < LEAST_RECOGNISED * self.target.reference.recognised {
            self.penalize(hypothesis);
        }
    }

    /// Makes a pose untrusted that is farther from the expected pose than the motion explains,
    /// unless much of the surface is recognised there.
    pub(super) fn penalize_jump(&self, expected: &Pose, hypothesis: &mut Hypothesis) {
        let landed = hypothesis.quality.recognised >= LANDED * self.target.reference.recognised;
        if self.has_jumped(expected, &hypothesis.pose) && !landed {
            self.penalize(hypothesis);
        }
    }

    /// Returns whether a pose that is followed needs no proof: it did not jump, or all fits there.
    pub(super) fn is_landed(&self, expected: &Pose, hypothesis: &Hypothesis) -> bool {
        hypothesis.quality.share >= SAFE || !self.has_jumped(expected, &hypothesis.pose)
    }

    /// Returns whether a pose is farther from the expected pose than the motion explains.
    pub(super) fn has_jumped(&self, expected: &Pose, pose: &Pose) -> bool {
        let off = (expected.inverse() * *pose).log();
        let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        let (near, slight) = self.search_range();
        across > near.max(JUMP * self.target.solid.radius) || turned > slight.max(JUMP)
    }

    /// Makes a pose untrusted.
    pub(super) fn penalize(&self, hypothesis: &mut Hypothesis) {
        hypothesis.quality.share *= PENALTY * self.settings.trusted;
    }

    /// Returns what may be updated by a pose that is followed.
    pub(super) fn allowed_updates(&mut self, quality: &Quality) -> Updates {
        let located = self.is_located(quality);
        self.trust.allowed_updates(quality, &self.target.reference, (located, self.is_held()))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::Matrix6;

    use super::*;
    use crate::camera::Camera;
    use crate::shape::{Body, Ellipsoid};
    use crate::track::target::reference::Reference;

    /// Makes a tracker that has seen an object with some surface points.
    pub(crate) fn tracker(status: Status, recognised: f64) -> Tracker {
        let camera = Camera::new([640, 480], [600.0; 2], [320.0, 240.0]).unwrap();
        let ball = Ellipsoid::new(0, [0.0; 3], [0.05; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        let body = Body::new(Pose::identity(), vec![ball]).unwrap();
        let mut tracker = Tracker::new(&[camera], &body, TrackSettings::default()).unwrap();
        let (textured, support, share) = (recognised, recognised, 0.9);
        let reference = Reference { recognised, textured, support, share, ..Reference::default() };
        (tracker.status, tracker.target.reference, tracker.trust.confirmed) =
            (status, reference, true);
        tracker
    }

    pub(crate) fn quality(share: f64, recognised: f64) -> Quality {
        let (visible, ratio, outline) = (share, 1.0, 1.0);
        let (support, textured, printed) = (recognised, recognised, recognised);
        let (fine, turning) = (recognised, recognised);
        Quality {
            visible,
            share,
            support,
            recognised,
            textured,
            printed,
            fine,
            turning,
            ratio,
            outline,
        }
    }

    fn hypothesis(quality: Quality) -> Hypothesis {
        Hypothesis { quality, ..Hypothesis::nothing(Pose::identity(), 0.05) }
    }

    #[test]
    fn a_pose_that_is_penalized_is_never_trusted() {
        for step in 1..=20 {
            let mut tracker = tracker(Status::Searching, 60.0);
            tracker.settings.trusted = 0.05 * f64::from(step);
            let mut found = hypothesis(quality(1.0, 10.0));
            tracker.penalize_unrecognised(&mut found);
            assert!(found.quality.share < tracker.settings.trusted);
            let mut jumped = hypothesis(quality(1.0, 30.0));
            let far = Pose::exp(&crate::pose::Twist::new(0.2, 0.0, 0.0, 0.0, 0.0, 0.0));
            tracker.penalize_jump(&far, &mut jumped);
            assert!(jumped.quality.share < tracker.settings.trusted);
        }
    }

    #[test]
    fn a_pose_is_reported_only_with_some_of_the_points_of_an_object_that_has_them() {
        let patterned = tracker(Status::Tracking, 60.0);
        assert!(!patterned.is_located(&quality(1.0, 0.0)));
        assert!(!patterned.is_located(&quality(1.0, 14.0)));
        assert!(patterned.is_located(&quality(0.7, 20.0)));
        assert!(tracker(Status::Tracking, 3.0).is_located(&quality(0.7, 0.0)));
    }

    /// Returns whether an orientation is reported with a standard deviation per direction in
    /// radians.
    fn reliable(tracker: &Tracker, quality: &Quality, turn_rad: f64) -> bool {
        let now = Matrix6::identity() * (turn_rad * turn_rad);
        let evidence = tracker.evidence(quality, &now, false);
        shows_turn(&evidence, tracker.printed(quality)) && is_turn_reliable(&evidence, ADRIFT_RAD)
    }

    #[test]
    fn colours_and_outline_alone_never_make_the_orientation_reliable() {
        for reference in 0..100 {
            let tracker = tracker(Status::Tracking, f64::from(reference));
            assert!(!reliable(&tracker, &quality(1.0, 0.0), 1e-3));
        }
        let thin = tracker(Status::Tracking, 20.0);
        assert!(reliable(&thin, &quality(1.0, 20.0), 1e-3));
        assert!(!reliable(&thin, &quality(1.0, 20.0), 0.1), "one that scatters");
        assert!(!reliable(&thin, &quality(0.3, 20.0), 0.01), "one of which little is seen");
    }

    #[test]
    fn shading_never_makes_the_orientation_reliable_where_no_pattern_was_seen() {
        let mut plain = tracker(Status::Tracking, 60.0);
        plain.target.reference.textured = 17.0;
        for recognised in 0..80 {
            let shaded =
                Quality { textured: 17.0, printed: 17.0, ..quality(1.0, f64::from(recognised)) };
            assert!(!reliable(&plain, &shaded, 1e-3), "{recognised}");
        }
        plain.target.reference.textured = 60.0;
        let half_hidden = Quality { textured: 10.0, printed: 10.0, ..quality(1.0, 20.0) };
        assert!(reliable(&plain, &half_hidden, 1e-3), "one that is textured all over");
        assert!(!reliable(&plain, &quality(1.0, 7.0), 1e-3), "with next to nothing of it");
    }

    #[test]
    fn print_keeps_the_orientation_reliable_while_it_shows_little_contrast() {
        let mut pale = tracker(Status::Tracking, 60.0);
        pale.target.reference.textured = 17.0;
        let printed = Quality { textured: 5.0, ..quality(1.0, 60.0) };
        assert!(reliable(&pale, &printed, 1e-3));
        assert!(!reliable(&pale, &Quality { printed: 17.0, ..printed }, 1e-3));
    }

    #[test]
    fn distances_by_motion_show_no_turn_while_their_keyframes_contradict_each_other() {
        let mut relief = Relief::new(true, true);
        assert!(is_relief_believed(&relief, 0.0), "nothing was adjusted yet");
        relief.sighting_cost = 0.9 * CONSISTENT;
        assert!(is_relief_believed(&relief, 0.0));
        relief.sighting_cost = 1.1 * CONSISTENT;
        assert!(!is_relief_believed(&relief, 1.0));
        relief.is_of_one_look = false;
        assert!(is_relief_believed(&relief, 0.0), "several looks made the body");
        (relief.is_open, relief.is_of_one_look) = (false, true);
        assert!(is_relief_believed(&relief, GUESSED), "the body gives them");
        assert!(!is_relief_believed(&relief, 0.9 * GUESSED));
    }

    #[test]
    fn a_pose_may_be_followed_without_being_reported() {
        let tracker = tracker(Status::Tracking, 60.0);
        let doubtful = quality(0.5 * (tracker.least_share() + LOCATED), 50.0);
        assert!(doubtful.share > tracker.least_share());
        assert!(!tracker.is_located(&doubtful));
    }

    #[test]
    fn nothing_is_learned_from_a_pose_that_is_not_reported() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let nothing = Updates { colors: false, surface: false, whole: false };
        assert_eq!(tracker.allowed_updates(&quality(0.9, 10.0)), nothing);
        assert_eq!(tracker.allowed_updates(&quality(0.5, 60.0)), nothing);
        let all = Updates { colors: true, surface: true, whole: true };
        assert_eq!(tracker.allowed_updates(&quality(0.9, 60.0)), all);
    }

    #[test]
    fn an_object_found_again_is_reported_and_learned_from_only_once_its_old_points_prove_it() {
        let mut tracker = tracker(Status::Searching, 60.0);
        let like = hypothesis(quality(0.8, 50.0)); // most of the print, and less than usual
        for time in 0..100 {
            tracker.accept_or_miss(f64::from(time), &Pose::identity(), &like, 0.5);
            assert_eq!(tracker.status, Status::Tracking);
            assert!(!tracker.is_located(&like.quality));
            let taught = tracker.allowed_updates(&like.quality);
            assert_eq!(taught, Updates { colors: false, surface: false, whole: false });
        }
        let itself = hypothesis(quality(0.95, 55.0));
        tracker.accept_or_miss(100.0, &Pose::identity(), &itself, 0.5);
        assert!(tracker.is_located(&itself.quality));
        assert!(tracker.is_located(&like.quality), "what was proved stays so");
    }
}
