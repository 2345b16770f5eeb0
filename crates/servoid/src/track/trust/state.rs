use super::found_turn::FoundTurn;
use super::spin::Spin;
use super::{ADRIFT_RAD, CLEAR};
use crate::track::estimate::Status;
use crate::track::pose::verify::Quality;
use crate::track::target::reference::Reference;
use crate::track::update::Updates;

/// Share of the reference surface points that must be seen for new points to be detected, during a
/// cooldown and after it: a side that turns into view shows its points one by one.
const WELL_RECOGNISED: (f64, f64) = (0.6, 0.3);
/// Images in which an object may be missed and is still predicted.
const MISSED: usize = 3;
/// Clear images after an unclear one until points are detected as before.
const COOLDOWN: usize = 8;
/// Share from which on colours are learned.
const COLOR_SHARE: f64 = 0.65;
/// Share and part of the reference surface points that prove that an object found again is the lost
/// one at its true pose, and not a look-alike: what is learned from a wrong one stays wrong.
const PROVING_SHARES: (f64, f64) = (0.92, 0.5);
/// Share, part of the reference points with the contrast of a pattern, and the least number of
/// those, that prove the same.
const RECOGNISABLE: (f64, f64, f64) = (0.75, 0.8, 40.0);
/// Share that proves an object seen for the first time, by an appearance learned elsewhere.
const FOUND: f64 = 0.85;
/// Part of the drift up to which the orientation is reported, up to which it is again after more
/// drift, where distances come from motion alone: a mirrored tilt often appears to drift just less
/// than that.
const REGAINED: f64 = 0.8;
/// Clear images in a row in which the orientation is not reliable, after which it is not reported again
/// of an object that may be without print: what is recognised there again slid along meanwhile.
const UNRELIABLE: usize = 5;
/// Reliable images in a row after which it is reported again: what is recognised there may agree with
/// a wrong one for a moment.
const REPORTED_AGAIN: usize = 4;
/// Weight of the newest image in a mean over a few.
const LATELY: f64 = 0.3;
/// Mean agreement of the outline with the boundary lately, compared with its best so far, below which
/// points that may be no print have slid: drawn jugs and ducks reach 0.3 to 0.8, a soft pattern that is
/// recognised all over 1.
const FALLEN: f64 = 0.85;
/// Images without the object after which it counts as lost.
const LOST_AFTER: usize = 15;
/// Images in which the object is sought near its predicted pose, before every other one is searched
/// as a whole.
const NEARBY: usize = 4;

/// How far an object that is followed is trusted to be there, by the images so far.
#[derive(Debug, Clone, Default)]
pub(in crate::track) struct Trust {
    /// Images since it was last seen.
    unseen: usize,
    /// Whether the object was ever tracked, so that its last pose is meaningful.
    started: bool,
    /// Clear images left until points are detected as before.
    cooldown: usize,
    /// Whether the object found again last was proved to be the lost one.
    pub(super) proved: bool,
    /// Whether it was ever proved: only then may it have turned, while unseen, to a side that looks
    /// like a known one.
    pub(super) confirmed: bool,
    /// Whether it was followed in all images since its pose was given.
    is_continuous: bool,
    /// Share of the recognised points that show the rotation which the outline shows least, lately.
    turning: f64,
    /// Images since which nothing shows that rotation, of an object with print on another side; not
    /// saved with what is known of it.
    pub(in crate::track) turn_unseen: usize,
    /// Whether the orientation was reported last.
    pub(in crate::track) is_oriented: bool,
    /// Clear images in a row in which the orientation was not reliable.
    unreliable: usize,
    /// Images in a row in which the orientation was reliable.
    reliable: usize,
    /// Images in a row in which it was sought, as it was missed or not proved to be the lost one.
    sought: usize,
    /// Mean agreement of the outline with the boundary lately, its best so far, and whether it ever
    /// fell far below that.
    outline: Option<f64>,
    best_outline: f64,
    pub(super) outline_fell: bool,
    /// Images in which the orientation had drifted, since it was last known well.
    pub(in crate::track) adrift: usize,
    /// Images since as much of it as usual was seen.
    pub(in crate::track) doubtful: usize,
    pub(in crate::track) found_turn: FoundTurn,
    pub(super) spin: Spin,
}

impl Trust {
    /// Starts with an object that was never seen.
    pub(in crate::track) fn unstarted() -> Self {
        Self { proved: true, turning: 1.0, ..Self::default() }
    }

    /// Starts with an object whose pose was given; `confirmed` states whether the images confirm
    /// it.
    pub(in crate::track) fn given(confirmed: bool) -> Self {
        let (unseen, is_continuous) = (usize::from(!confirmed), confirmed);
        Self { unseen, started: true, confirmed, is_continuous, ..Self::unstarted() }
    }

    /// Averages the share of the recognised points that show the rotation which the outline shows
    /// least, and returns its mean lately.
    pub(in crate::track) fn follow_turning(&mut self, share: f64) -> f64 {
        self.turning += LATELY * (share - self.turning);
        self.turning
    }

    /// Notes how well the outline agrees with the boundary where the object is followed.
    pub(super) fn follow_outline(&mut self, agreement: f64) {
        let before = self.outline.unwrap_or(agreement);
        let lately = before + LATELY * (agreement - before);
        self.outline = Some(lately);
        self.best_outline = self.best_outline.max(lately);
        self.outline_fell |= lately < FALLEN * self.best_outline;
    }

    pub(in crate::track) fn is_started(&self) -> bool {
        self.started
    }

    /// Returns whether the object was ever confirmed to be the one that is known.
    pub(in crate::track) fn is_confirmed(&self) -> bool {
        self.confirmed
    }

    pub(in crate::track) fn is_proved(&self) -> bool {
        self.proved
    }

    pub(in crate::track) fn is_continuous(&self) -> bool {
        self.is_continuous
    }

    /// Returns whether the object was tracked and never missed since.
    pub(in crate::track) fn is_unbroken(&self) -> bool {
        self.started && self.unseen == 0
    }

    /// Returns whether the object was missed in a few images at most, so that it moved on as
    /// predicted.
    pub(in crate::track) fn was_followed(&self) -> bool {
        self.started && self.unseen <= MISSED
    }

    pub(in crate::track) fn was_seen_lately(&self) -> bool {
        self.unseen <= LOST_AFTER
    }

    /// Returns the status of an object that was missed once more.
    pub(in crate::track) fn without(&self) -> Status {
        if self.was_seen_lately() { Status::Searching } else { Status::Lost }
    }

    pub(in crate::track) fn miss(&mut self) {
        self.unseen += 1;
        self.turn_unseen += usize::from(self.turn_unseen > 0);
        self.is_continuous = false;
    }

    /// Counts an accepted pose as proved if enough is seen at it, or if the last pose was proved
    /// and this one `goes_on` from it; at a share below the `usual` one a pattern proves nothing.
    pub(in crate::track) fn accept(
        &mut self,
        quality: &Quality,
        reference: &Reference,
        goes_on: bool,
        usual: f64,
    ) {
        (self.unseen, self.started) = (0, true);
        let (again, part) = PROVING_SHARES;
        let least = if self.confirmed { again } else { FOUND };
        self.proved &= goes_on;
        self.is_continuous &= goes_on;
        self.proved |= quality.share >= least && quality.recognised >= part * reference.recognised;
        // No look-alike shows so many points of a pattern, and no alias of the pose as much as
        // usual.
        let (share, part, many) = RECOGNISABLE;
        let share = share.max(usual);
        let textured = (part * reference.textured).max(many);
        self.proved |= quality.share >= share && quality.textured >= textured;
        self.confirmed |= self.proved;
        if self.proved {
            self.sought = 0;
        }
    }

    /// Counts an image in which the object is sought; returns whether it is sought near its
    /// predicted pose: if it was seen lately, but only in every other image once that was in vain.
    /// Where most distances are `guessed` that is no reason to look elsewhere: with them other poses
    /// fit as well as the right one.
    pub(in crate::track) fn seek_nearby(&mut self, guessed: bool) -> bool {
        self.sought += 1;
        let is_vain = self.sought > NEARBY && !self.sought.is_multiple_of(2) && !guessed;
        self.started && self.was_seen_lately() && !is_vain
    }

    /// Returns the standard deviation of the orientation's drift up to which it is reported, in
    /// radians; `is_open` states whether distances come from motion alone.
    pub(in crate::track) fn most_drift(&self, is_open: bool) -> f64 {
        if is_open && !self.is_oriented { REGAINED * ADRIFT_RAD } else { ADRIFT_RAD }
    }

    /// Decides whether an orientation is reported that is reliable by itself; an image may be clear, and
    /// the object surely printed.
    pub(in crate::track) fn orient(&mut self, is_reliable: bool, is_clear: bool, is_printed: bool) {
        self.reliable = if is_reliable { self.reliable + 1 } else { 0 };
        let was_long = self.unreliable > UNRELIABLE;
        let is_again = is_printed && self.reliable >= REPORTED_AGAIN;
        let is_believed = !self.found_turn.is_doubtful();
        self.is_oriented = is_reliable && is_believed && (!was_long || is_again);
        if self.is_oriented {
            self.unreliable = 0;
        } else if is_clear && !is_reliable {
            self.unreliable += 1;
        }
    }

    /// Notes that a known side was recognised, which shows the orientation without further images.
    pub(in crate::track) fn confirm_turn(&mut self) {
        self.reliable = REPORTED_AGAIN;
    }

    /// Begins a cooldown, which ends after some clear images.
    pub(in crate::track) fn cool_down(&mut self) {
        self.cooldown = COOLDOWN;
    }

    /// Returns what may be updated by a pose that is followed; `located` states whether the images
    /// confirm its position.
    pub(super) fn allowed_updates(
        &mut self,
        quality: &Quality,
        reference: &Reference,
        (located, held): (bool, bool),
    ) -> Updates {
        let &Quality { visible, recognised, .. } = quality;
        let is_clear = visible >= CLEAR;
        self.cooldown = if is_clear { self.cooldown.saturating_sub(1) } else { COOLDOWN };
        if !located || self.turn_unseen > 0 || self.found_turn.is_doubtful() {
            return Updates { colors: false, surface: false, whole: false };
        }
        // What hides the object must not become part of it, and a pose that is slightly off must
        // not determine where points lie.
        let (cooling, sure) = WELL_RECOGNISED;
        let least = if self.cooldown > 0 { cooling } else { sure };
        let whole = is_clear && (held || recognised >= least * reference.recognised);
        Updates { colors: visible >= COLOR_SHARE, surface: whole || held, whole }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use crate::track::pose::hypothesis::Hypothesis;

    #[test]
    fn an_object_is_followed_continuously_only_since_its_pose_was_given_and_up_to_a_jump_or_a_miss()
    {
        assert!(!Trust::unstarted().is_continuous() && !Trust::given(false).is_continuous());
        let (quality, reference) =
            (Hypothesis::nothing(Pose::identity(), 0.05).quality, Reference::default());
        let mut trust = Trust::given(true);
        trust.accept(&quality, &reference, true, 0.0);
        assert!(trust.is_continuous());
        let mut jumped = trust.clone();
        jumped.accept(&quality, &reference, false, 0.0);
        trust.miss();
        for mut later in [jumped, trust] {
            later.accept(&quality, &reference, true, 0.0);
            assert!(!later.is_continuous());
        }
    }

    #[test]
    fn an_object_that_is_sought_nearby_in_vain_is_sought_anywhere_until_it_is_proved() {
        let mut trust = Trust::given(true);
        let nearby = |trust: &mut Trust| [(); 9].map(|()| trust.seek_nearby(false));
        let alternating = [true, true, true, true, false, true, false, true, false];
        assert_eq!(nearby(&mut trust), alternating);
        let found = Hypothesis::nothing(Pose::identity(), 0.05).quality;
        trust.proved = false;
        trust.accept(&found, &Reference { recognised: 1.0, ..Reference::default() }, false, 0.0);
        let goes_on = [true, false, true, false, true, false, true, false, true];
        assert_eq!(nearby(&mut trust), goes_on, "it may not be the lost one");
        assert!((0..9).all(|_| trust.seek_nearby(true)), "by guesses other poses fit as well");
        trust.proved = true;
        trust.accept(&found, &Reference::default(), true, 0.0);
        assert_eq!(nearby(&mut trust), alternating);
        for _ in 0..=LOST_AFTER {
            trust.miss();
        }
        assert!(!nearby(&mut trust).contains(&true), "lost");
        assert!(!nearby(&mut Trust::unstarted()).contains(&true), "never seen");
    }

    #[test]
    fn an_orientation_that_was_long_unreliable_is_reported_again_only_of_what_is_surely_printed() {
        for images in 0..3 * UNRELIABLE {
            for is_printed in [false, true] {
                let mut trust = Trust::given(true);
                for _ in 0..100 {
                    trust.orient(false, false, is_printed);
                }
                trust.orient(true, true, is_printed);
                assert!(trust.is_oriented, "what was hidden is no worse for it");
                for _ in 0..images {
                    trust.orient(false, true, is_printed);
                    assert!(!trust.is_oriented);
                }
                for image in 1..100 {
                    trust.orient(true, true, is_printed);
                    let is_again = is_printed && image >= REPORTED_AGAIN;
                    assert_eq!(trust.is_oriented, is_again || images <= UNRELIABLE);
                }
                trust.orient(true, true, true);
                assert!(trust.is_oriented, "one that shows print at last");
            }
        }
    }

    #[test]
    fn an_outline_that_fell_once_is_noted_for_good_and_one_bad_image_is_no_fall() {
        let mut trust = Trust::given(true);
        for image in 0..50 {
            trust.follow_outline(if image == 20 { 0.5 } else { 0.8 });
            assert!(!trust.outline_fell, "{image}");
        }
        for _ in 0..10 {
            trust.follow_outline(0.4);
        }
        assert!(trust.outline_fell);
        trust.follow_outline(0.8);
        assert!(trust.outline_fell);
    }

    #[test]
    fn what_is_reliable_now_and_then_is_not_reported_again_unless_a_known_side_is_recognised() {
        let mut trust = Trust::given(true);
        for image in 0..100 {
            let is_reliable = image > UNRELIABLE && image % REPORTED_AGAIN > 0;
            trust.orient(is_reliable, true, true);
            assert!(!trust.is_oriented, "{image}");
        }
        trust.orient(false, true, true);
        trust.confirm_turn();
        trust.orient(true, true, true);
        assert!(trust.is_oriented);
    }

    #[test]
    fn where_motion_gives_the_distances_a_lost_orientation_is_reported_again_only_with_a_margin() {
        let lost = Trust::unstarted();
        let known = Trust { is_oriented: true, ..Trust::unstarted() };
        assert!(lost.most_drift(true) < known.most_drift(true));
        assert_eq!(lost.most_drift(false), known.most_drift(true));
        assert_eq!(known.most_drift(false), known.most_drift(true));
    }
}
