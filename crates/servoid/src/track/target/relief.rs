//! Whether distances that come from the body alone are trusted: a single camera constrains a point
//! to its ray, and the body gives its distance, as far as it has the object's shape.

use nalgebra::{UnitQuaternion, Vector3};

use super::keyframes::Keyframes;
use super::points::{Match, Points};

/// Standard deviation of the guess, as a share of the body's radius: where the body is trusted, and
/// where motion is to determine distances.
pub(crate) const GUESS: (f64, f64) = (0.1, 0.25);
/// Error of the orientation per radian by which the line of sight turned in the object's frame, as a
/// standard deviation in radians, where the body is trusted but motion does not tell: of a body of one
/// look, and of others.
const TURNS_OFF: (f64, f64) = (0.35, 0.15);
/// Systematic errors of a pose by a guessed body, which no residual shows, as all points share them:
/// standard deviations of the orientation per radian of rotation and at most, and of the position in
/// radii per radian.
const SYSTEMATIC_TURN: (f64, f64) = (0.35, 0.15);
const SYSTEMATIC_SHIFT: f64 = 0.1;
/// Part of the usual share below which an object is about to be lost, and its body is no longer
/// trusted.
const DENIED: f64 = 0.6;
/// Deviation of points from the body's surface, rms in standard deviations over those that
/// keyframes saw together, up to which these confirm the body.
const CONFIRMED: f64 = 0.5;
/// Ratio of the standard deviation of the orientation by the noise of an image to the usual one,
/// from which on it adds to the drift of the orientation.
const NOISY: f64 = 3.0;
/// That standard deviation, in radians, from which on it may then be the body that decides the
/// orientation.
const UNCLEAR: f64 = 0.014;
/// Images in a row in which that must be so, where keyframes confirm the body.
const LASTS: usize = 15;
/// Weight of the newest image in the usual noise, and the ratio of its standard deviation to that up
/// to which it counts.
const RATE: f64 = 0.05;
const ALIKE: f64 = 1.5;

/// Whether points are still assumed to lie on the body's surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Relief {
    /// Whether distances come from motion alone, since the body is not trusted.
    pub(crate) is_open: bool,
    /// Mean cost of a sighting in the last adjustment: of points that contradict each other it is high.
    pub(crate) sighting_cost: f64,
    /// Whether the body is of one look, and so a guess in depth.
    pub(crate) is_of_one_look: bool,
    /// Variances of the systematic errors of position, in radii, and orientation.
    pub(crate) systematic: (f64, f64),
    /// Deviation of points from the body by the first keyframes, rms in standard deviations.
    misfit: Option<f64>,
    /// Orientation of the first camera, in the object's frame, at the given pose.
    given: Option<UnitQuaternion<f64>>,
    /// Usual variance of the orientation by the noise of an image, and whether the last image's was
    /// larger.
    usual_noise: UsualNoise,
    is_noisy: bool,
    /// Images in a row that were so much larger that it may be the body that decides the orientation.
    unclear: usize,
}

/// Usual variance of the orientation by the noise of an image: a mean over images that are alike.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct UsualNoise(Option<f64>);

impl UsualNoise {
    /// Adds that of an image; returns the usual one before.
    pub(crate) fn follow(&mut self, turn_variance: f64) -> f64 {
        let usual = *self.0.get_or_insert(turn_variance);
        if turn_variance < ALIKE * ALIKE * usual {
            self.0 = Some(usual + RATE * (turn_variance - usual));
        }
        usual
    }
}

impl Relief {
    pub(crate) fn new(is_open: bool, is_of_one_look: bool) -> Self {
        Self {
            is_open,
            sighting_cost: 0.0,
            is_of_one_look,
            systematic: (0.0, 0.0),
            misfit: None,
            given: None,
            usual_noise: UsualNoise::default(),
            is_noisy: false,
            unclear: 0,
        }
    }

    /// Stores the orientation of the first camera, in the object's frame, at the given pose.
    pub(crate) fn begin(&mut self, object_from_camera: UnitQuaternion<f64>) {
        self.given = Some(object_from_camera);
    }

    /// Returns the variance of the orientation that a relief leaves which nothing confirms: one
    /// that is too flat or too deep turns too far or too little. It grows as the first camera's line
    /// of sight turns, in the object's frame, since the pose was given, at the latest now, or from the
    /// keyframes of which motion tells how far the guess is off. Points that lie near a body of
    /// one look do not confirm it: where motion tells nothing, they stay where they were guessed.
    pub(crate) fn turn_variance(
        &mut self,
        object_from_camera: UnitQuaternion<f64>,
        keyframes: &Keyframes,
    ) -> f64 {
        let given = *self.given.get_or_insert(object_from_camera);
        if !self.is_guess() {
            return 0.0;
        }
        let off = if self.is_of_one_look { TURNS_OFF.0 } else { TURNS_OFF.1 };
        let guessed = (off * tilted(&given, &object_from_camera)).powi(2);
        let told = keyframes.relief_variance(&object_from_camera, off);
        told.map_or(guessed, |told| told.min(guessed))
    }

    /// Updates the systematic errors: they grow with the rotation of the first camera, in the object's
    /// frame, since the pose was given, if its shape is `guessed`.
    pub(crate) fn follow_turn(&mut self, object_from_camera: &UnitQuaternion<f64>, guessed: bool) {
        let turned = if guessed { self.turned(object_from_camera) } else { 0.0 };
        let (per_radian, most) = SYSTEMATIC_TURN;
        let (turn, most) = ((per_radian * turned).powi(2), most * most);
        self.systematic = ((SYSTEMATIC_SHIFT * turned).powi(2), turn * most / (turn + most));
    }

    /// Returns the chord of the first camera's rotation since the pose was given, in the object's
    /// frame: what grows with the rotation is undone by a whole turn.
    pub(crate) fn turned(&self, object_from_camera: &UnitQuaternion<f64>) -> f64 {
        let angle = self.given.map_or(0.0, |given| given.angle_to(object_from_camera));
        2.0 * libm::sin(0.5 * angle)
    }

    /// Returns whether the body is trusted though nothing confirms it.
    pub(crate) fn is_guess(&self) -> bool {
        !self.is_open && (self.is_of_one_look || !self.is_confirmed())
    }

    /// Notes the variance of the orientation by the noise of an image.
    pub(crate) fn note_noise(&mut self, turn_variance: f64) {
        self.is_noisy = turn_variance > NOISY * NOISY * self.usual_noise.follow(turn_variance);
        let is_unclear = self.is_noisy && turn_variance > UNCLEAR * UNCLEAR;
        self.unclear = if is_unclear { self.unclear + 1 } else { 0 };
    }

    /// Returns whether the noise of the last image counts as drift: where distances come from motion,
    /// or the image determined the orientation worse than others.
    pub(crate) fn adds_noise(&self) -> bool {
        self.is_open || self.is_noisy
    }

    /// Returns whether the last images determined the orientation so badly that the body decides it:
    /// of a flat side that faces the camera, a little more relief is the same image as a tilt.
    /// `is_clear` states whether nothing hides the object, which has the same effect, whatever its
    /// relief: one that keyframes confirm is not doubted for that.
    pub(crate) fn decides_turn(&self, is_clear: bool) -> bool {
        let is_undecided =
            if self.is_confirmed() { is_clear && self.unclear >= LASTS } else { self.unclear > 0 };
        is_undecided && !self.is_open
    }

    /// Stores the deviation of points from the body by keyframes: only once, as it grows with what
    /// they see.
    pub(crate) fn measure(&mut self, misfit: Option<f64>) {
        if !self.is_open {
            self.misfit = self.misfit.or(misfit);
        }
    }

    /// Returns whether keyframes confirm the body.
    pub(crate) fn is_confirmed(&self) -> bool {
        self.misfit.is_some_and(|rms| rms <= CONFIRMED)
    }

    /// Returns whether a share of what should be visible, compared with the `usual` one, is
    /// evidence against the body that keyframes do not outweigh.
    pub(crate) fn is_denied(&self, share: f64, usual: f64) -> bool {
        !self.is_open && !self.is_confirmed() && share < DENIED * usual
    }
}

/// Returns the angle between the lines of sight of two orientations of a camera: a rotation about them
/// looks the same whatever the relief.
fn tilted(one: &UnitQuaternion<f64>, other: &UnitQuaternion<f64>) -> f64 {
    (one * Vector3::z()).angle(&(other * Vector3::z()))
}

impl Keyframes {
    /// Returns the least variance of the orientation that guessed distances leave, by the keyframes
    /// of which motion tells it; it grows by `off` per radian away from each.
    pub(crate) fn relief_variance(
        &self,
        object_from_camera: &UnitQuaternion<f64>,
        off: f64,
    ) -> Option<f64> {
        let told = self.all.iter().filter_map(|one| {
            let away = tilted(&one.object_from_camera, object_from_camera);
            Some(one.relief_variance? + (off * away).powi(2))
        });
        told.min_by(f64::total_cmp)
    }
}

impl Points {
    /// Returns whether the distances of most recognised points came from the body alone when they
    /// were detected.
    pub(crate) fn are_from_body(&self, matches: &[Match]) -> bool {
        let seen = matches.iter().filter(|one| one.is_recognised());
        let from_body = |one: &&Match| self.features[one.view.point].is_from_body;
        2 * seen.clone().filter(from_body).count() > seen.count()
    }

    /// Returns whether the distances of most points came from the body alone.
    pub(crate) fn are_guessed(&self) -> bool {
        let guessed = self.features.iter().filter(|one| one.is_from_body).count();
        2 * guessed > self.features.len()
    }

    /// From now on estimates the guessed distances from motion alone.
    pub(crate) fn open(&mut self, radius: f64) {
        let variance = (GUESS.1 * radius).powi(2);
        for one in self.features.iter_mut().filter(|one| one.is_from_body) {
            one.is_from_motion = true;
            one.variance = one.variance.max(variance);
            one.origin.variance = one.origin.variance.max(variance);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::target::keyframes::tests::{keep, told};

    #[test]
    fn a_body_that_keyframes_confirm_is_not_denied_however_little_is_seen() {
        let mut relief = Relief::new(false, true);
        assert!(relief.is_denied(0.5, 0.95) && !relief.is_denied(0.7, 0.95));
        relief.measure(None);
        relief.measure(Some(0.5 * CONFIRMED));
        assert!(relief.is_confirmed() && !relief.is_denied(0.0, 0.95));
        relief.measure(Some(2.0 * CONFIRMED));
        assert!(relief.is_confirmed(), "the first word counts");
        let mut other = Relief::new(false, true);
        other.measure(Some(2.0 * CONFIRMED));
        assert!(other.is_denied(0.5, 0.95));
    }

    #[test]
    fn the_farther_an_object_turned_the_less_its_turn_is_known_unless_motion_tells_it() {
        let turned = |angle: f64| UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
        let (mut guess, none) = (Relief::new(false, true), &Keyframes::default());
        assert!(guess.turn_variance(turned(1.0), none) == 0.0, "no pose was given");
        guess.begin(turned(0.1));
        let mut before = 0.0;
        for step in 1..20 {
            let variance = guess.turn_variance(turned(0.1 + 0.1 * f64::from(step)), none);
            assert!(variance > before, "{step}");
            before = variance;
        }
        assert!(guess.turn_variance(turned(0.1), none) < 1e-12, "the given side is seen again");
        let told = &told(1e-4, turned(0.5));
        assert!(guess.turn_variance(turned(0.5), told) <= 1e-4, "motion tells it");
        assert!(guess.turn_variance(turned(1.0), told) < guess.turn_variance(turned(1.0), none));
        assert!(guess.turn_variance(turned(0.1), told) < 1e-12, "the given side is better known");
        guess.measure(Some(0.9 * CONFIRMED));
        assert!(
            guess.turn_variance(turned(1.0), none) > 0.0,
            "points stay where they were guessed"
        );
    }

    #[test]
    fn of_a_body_of_several_looks_less_is_doubted_and_nothing_once_keyframes_confirm_it() {
        let turned = |angle: f64| UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
        let [mut guess, mut known] = [true, false].map(|one_look| Relief::new(false, one_look));
        let none = &Keyframes::default();
        let doubt = |relief: &mut Relief, angle| relief.turn_variance(turned(angle), none);
        assert!(doubt(&mut guess, 0.0) == 0.0 && doubt(&mut known, 0.0) == 0.0);
        assert!(0.0 < doubt(&mut known, 0.5) && doubt(&mut known, 0.5) < doubt(&mut guess, 0.5));
        known.measure(Some(0.9 * CONFIRMED));
        assert!(doubt(&mut known, 0.5) == 0.0);
    }

    #[test]
    fn a_rotation_about_the_line_of_sight_is_not_doubted() {
        let mut guess = Relief::new(false, true);
        guess.begin(UnitQuaternion::identity());
        for step in 1..30 {
            let rolled = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.1 * f64::from(step));
            assert!(guess.turn_variance(rolled, &Keyframes::default()) < 1e-12);
        }
    }

    #[test]
    fn systematic_errors_grow_with_the_turn_are_bounded_and_none_of_a_known_shape() {
        let turned = |angle: f64| UnitQuaternion::from_euler_angles(0.0, angle, 0.0);
        let mut relief = Relief::new(false, true);
        relief.follow_turn(&turned(1.0), true);
        assert_eq!(relief.systematic, (0.0, 0.0), "no pose was given");
        relief.begin(turned(0.1));
        let mut before = (0.0, 0.0);
        for step in 1..30 {
            relief.follow_turn(&turned(0.1 + 0.1 * f64::from(step)), true);
            let (shift, turn) = relief.systematic;
            assert!(
                shift > before.0 && turn > before.1 && turn < SYSTEMATIC_TURN.1.powi(2),
                "{step}"
            );
            before = relief.systematic;
        }
        relief.follow_turn(&turned(1.0), false);
        assert_eq!(relief.systematic, (0.0, 0.0), "its shape is known");
    }

    #[test]
    fn an_image_that_determines_the_turn_much_worse_than_others_leaves_it_to_the_body() {
        let mut relief = Relief::new(false, true);
        for _ in 0..100 {
            relief.note_noise((0.2 * UNCLEAR).powi(2));
            assert!(!relief.decides_turn(true) && !relief.adds_noise());
        }
        relief.note_noise((0.9 * UNCLEAR).powi(2));
        assert!(!relief.decides_turn(true) && relief.adds_noise(), "it is noise, but little");
        for _ in 0..100 {
            relief.note_noise((1.1 * UNCLEAR).powi(2));
            assert!(relief.decides_turn(true), "a while of it does not make it usual");
            assert!(relief.decides_turn(false) && relief.adds_noise());
        }
        let mut always = Relief::new(false, true);
        for _ in 0..100 {
            always.note_noise((0.5 * NOISY * UNCLEAR).powi(2));
            assert!(!always.decides_turn(true), "an object that is always seen like that");
        }
    }

    #[test]
    fn a_body_that_keyframes_confirm_is_doubted_only_if_it_stays_so_and_nothing_hides_the_object() {
        let mut relief = Relief::new(false, true);
        relief.measure(Some(0.5 * CONFIRMED));
        relief.note_noise(1e-8);
        for image in 1..=2 * LASTS {
            relief.note_noise(1.0);
            assert_eq!(relief.decides_turn(true), image >= LASTS);
            assert!(!relief.decides_turn(false));
        }
        relief.note_noise(1e-8);
        assert!(!relief.decides_turn(true));
    }

    #[test]
    fn one_that_is_open_stays_so_and_nothing_confirms_it() {
        let mut relief = Relief::new(true, true);
        relief.measure(Some(0.0));
        assert!(relief.is_open && !relief.is_confirmed() && !relief.is_denied(0.0, 1.0));
    }

    #[test]
    fn what_guesses_leave_open_grows_away_from_the_keyframes_of_which_motion_tells_it() {
        let mut keyframes = Keyframes::default();
        for count in 0..4 {
            keep(&mut keyframes, 0.2 * f64::from(count));
        }
        let camera = |turned: f64| UnitQuaternion::from_euler_angles(0.0, -turned, 0.0);
        assert!(keyframes.relief_variance(&camera(0.0), 0.1).is_none());
        keyframes.all[1].relief_variance = Some(1e-4);
        keyframes.all[3].relief_variance = Some(4e-4);
        for (turned, least) in [(0.2, 1e-4), (0.3, 2e-4), (0.1, 2e-4), (0.6, 4e-4), (0.9, 13e-4)] {
            let found = keyframes.relief_variance(&camera(turned), 0.1).unwrap();
            assert!((found - least).abs() < 1e-12, "{turned} {found}");
        }
    }

    #[test]
    fn an_image_with_much_more_noise_than_usual_is_not_usual() {
        let mut usual = UsualNoise::default();
        for _ in 0..40 {
            assert_eq!(usual.follow(1.0), 1.0);
            assert_eq!(usual.follow(1.1 * ALIKE * ALIKE), 1.0);
        }
        for _ in 0..200 {
            usual.follow(1.5);
        }
        assert!((usual.follow(1.5) - 1.5).abs() < 1e-3);
    }
}
