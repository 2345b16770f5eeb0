//! Closes loops of keyframes: the object has turned back to a side that is known well.

use super::keyframes::{Keyframe, Keyframes};
use super::points::bridged;
use crate::pose::{Pose, Twist};

/// Number of keyframes that connect the ends of a loop.
const TIES: usize = 3;
/// Standard deviation by which the orientation may still be off in the middle of a loop, as a share
/// of the rotation that closed it.
const STILL_OFF: f64 = 0.25;

impl Keyframes {
    /// Stores the predicted pose of the object, so that the next keyframe connects the ends of a
    /// loop.
    pub(crate) fn tie(&mut self, expected: &Pose) {
        let last = self.all.last().filter(|_| self.followed);
        self.tie = last.map(|last| (last.number, last.world_from_object.inverse() * *expected));
    }

    /// Returns whether a loop is waiting to be connected.
    pub(crate) fn is_open(&self) -> bool {
        self.tie.is_some()
    }

    /// Returns the number of the last keyframe whose orientation variance does not exceed a bound:
    /// the drift occurred after it.
    pub(crate) fn last_known(&self, variance: f64) -> Option<usize> {
        self.all.iter().rev().find(|one| one.drift_variance <= variance).map(|one| one.number)
    }

    /// Turns back the keyframes since one of them, each by its share of a motion that closes a
    /// loop; `drifts` are the variances of the orientation before and after that. Where on the way
    /// the orientation was lost is not known, so those in the middle may still be off.
    pub(crate) fn turn_back(&mut self, off: &Twist, drifts: (f64, f64), since: Option<usize>) {
        let still_off = (2.0 * STILL_OFF * off.fixed_rows::<3>(3).norm()).powi(2);
        let is_of_loop = |one: &Keyframe| {
            Some(one.number) > since && bridged(one.drift_variance, drifts).0 > 0.0
        };
        let count = self.all.iter().filter(|one| is_of_loop(one)).count() as f64;
        for (at, one) in self.all.iter_mut().filter(|one| is_of_loop(one)).enumerate() {
            let share = bridged(one.drift_variance, drifts).0;
            let part = (at + 1) as f64 / (count + 1.0);
            let middle = (share * (1.0 - share)).max(part * (1.0 - part));
            one.held_back *= 1.0 - share;
            // If the end of this loop drifted less, it accounts for that part of the variance only.
            let told = share * (drifts.0 / one.drift_variance).min(1.0);
            one.still_off = one.still_off * (1.0 - told) + still_off * middle;
        }
        let former = self.former.iter_mut();
        let former =
            former.map(|one| (one.number, &mut one.world_from_object, &mut one.drift_variance));
        let all = self.all.iter_mut();
        let all = all.map(|one| (one.number, &mut one.world_from_object, &mut one.drift_variance));
        for (_, pose, drift) in former.chain(all).filter(|(number, ..)| Some(*number) > since) {
            let (share, left) = bridged(*drift, drifts);
            *drift = left;
            if share > 0.0 {
                *pose = (*pose * Pose::exp(&(off * share))).renormalized();
            }
        }
        for one in self.all.iter_mut().filter(|one| Some(one.number) > since) {
            one.drift_variance = one.drift_variance.max(one.still_off);
        }
        self.closing = TIES;
    }

    /// Returns the numbers of the points that keyframes saw, each with the variance of the
    /// orientation there.
    pub(crate) fn drifts_of_points(&self) -> impl Iterator<Item = (usize, f64)> {
        self.all
            .iter()
            .flat_map(|one| one.sightings.iter().map(|seen| (seen.id, one.drift_variance)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::keyframes::tests::keep;
    use super::*;

    /// Closes a loop of keyframes by a rotation; all but the first drifted, by these variances.
    fn closed(turned: f64, drifts: impl Fn(usize) -> f64) -> Keyframes {
        let mut keyframes = Keyframes::default();
        for number in 0..=LAST {
            keep(&mut keyframes, 0.1 * number as f64);
            keyframes.all[number].drift_variance = drifts(number);
        }
        close(&mut keyframes, turned);
        keyframes
    }

    fn close(keyframes: &mut Keyframes, turned: f64) {
        let off = Twist::new(0.0, 0.0, 0.0, 0.0, turned, 0.0);
        keyframes.turn_back(&off, (DRIFT, KNOWN), None);
    }

    const LAST: usize = 10;
    const DRIFT: f64 = 0.1;
    const KNOWN: f64 = 0.001;

    fn even(number: usize) -> f64 {
        DRIFT * number as f64 / LAST as f64
    }

    #[test]
    fn the_middle_of_a_loop_may_still_be_off_the_more_the_farther_it_was_turned_back() {
        let still_off =
            |turned: f64, number: usize| closed(turned, even).all[number].still_off.sqrt();
        for turned in [0.0, 0.1, 0.5] {
            assert_eq!(still_off(turned, 0), 0.0, "it was known before");
            assert!((still_off(turned, 5) - STILL_OFF * turned).abs() < 0.01 * turned + 1e-12);
            for number in 1..5 {
                assert!(still_off(turned, number) <= still_off(turned, number + 1));
                assert!(still_off(turned, 11 - number) <= still_off(turned, 10 - number));
            }
        }
        assert!(still_off(0.5, 3) > still_off(0.1, 3));
    }

    #[test]
    fn wherever_on_the_way_the_drift_is_claimed_to_have_occurred_the_middle_may_be_off() {
        for lost_at in 1..LAST {
            let at_once = |number: usize| if number < lost_at { 2.0 * KNOWN } else { DRIFT };
            let middle = closed(0.5, at_once).all[LAST / 2].still_off.sqrt();
            assert!(middle > 0.9 * STILL_OFF * 0.5, "{lost_at}: {middle}");
        }
        let known = closed(0.5, |number| if number < 5 { 0.9 * KNOWN } else { DRIFT });
        assert!(known.all[..5].iter().all(|one| one.still_off == 0.0), "known sides stay");
        assert!(known.all[5..].iter().all(|one| one.still_off > 0.0));
    }

    #[test]
    fn another_loop_over_the_same_sides_that_hardly_turns_them_takes_most_of_that_away() {
        let mut keyframes = closed(0.5, even);
        let before = keyframes.all[8].still_off;
        for one in &mut keyframes.all[1..] {
            one.drift_variance = 0.9 * DRIFT;
        }
        close(&mut keyframes, 0.0);
        assert!(keyframes.all[8].still_off < 0.2 * before);
    }

    #[test]
    fn the_end_of_a_loop_that_is_seen_once_more_tells_little_of_its_middle() {
        for again in [2.0 * KNOWN, 5.0 * KNOWN] {
            let mut keyframes = closed(0.5, even);
            let before = keyframes.all[5].still_off;
            let off = Twist::new(0.0, 0.0, 0.0, 0.0, 0.02, 0.0);
            keyframes.turn_back(&off, (again, 0.0), None);
            assert!(keyframes.all[5].still_off > 0.6 * before, "{again}");
            assert!(keyframes.all[5].drift_variance > 0.6 * before);
        }
    }

    #[test]
    fn a_view_may_be_off_where_a_loop_was_turned_back_far_and_nowhere_else() {
        let camera = |turned: f64| nalgebra::UnitQuaternion::from_euler_angles(0.0, -turned, 0.0);
        let may_be_off =
            |by: f64, view: f64| closed(by, even).may_be_off(&camera(view), 0.03 * 0.03, 0.12);
        assert!(may_be_off(0.5, 0.5) && !may_be_off(0.05, 0.5));
        assert!(!may_be_off(0.5, 0.5 + 1.0) && !may_be_off(0.5, -0.05));
    }
}
