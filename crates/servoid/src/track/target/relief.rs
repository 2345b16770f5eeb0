//! Whether distances that come from the body alone are trusted: a single camera constrains a point
//! to its ray, and the body gives its distance, as far as it has the object's shape.

use nalgebra::UnitQuaternion;

use super::points::{Match, Points};

/// Standard deviation of the guess, as a share of the body's radius: where the body is trusted, and
/// where motion is to determine distances.
pub(crate) const GUESS: (f64, f64) = (0.1, 0.25);
/// Error of the orientation per radian of rotation, as a standard deviation in radians, where the
/// body is trusted but nothing confirms it.
const TURNS_OFF: f64 = 0.15;
/// Part of the usual share below which an object is about to be lost, and its body is no longer
/// trusted.
const DENIED: f64 = 0.6;
/// Deviation of points from the body's surface, rms in standard deviations over those that
/// keyframes saw together, up to which these confirm the body.
const CONFIRMED: f64 = 0.5;

/// Whether points are still assumed to lie on the body's surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Relief {
    /// Whether distances come from motion alone, since the body is not trusted.
    pub(crate) is_open: bool,
    /// Deviation of points from the body by the first keyframes, rms in standard deviations.
    misfit: Option<f64>,
    /// Orientation of the first camera, in the object's frame, at the given pose.
    given: Option<UnitQuaternion<f64>>,
}

impl Relief {
    pub(crate) fn new(is_open: bool) -> Self {
        Self { is_open, misfit: None, given: None }
    }

    /// Stores the orientation of the first camera, in the object's frame, at the given pose.
    pub(crate) fn begin(&mut self, object_from_camera: UnitQuaternion<f64>) {
        self.given = Some(object_from_camera);
    }

    /// Returns that orientation.
    pub(crate) fn given(&self) -> Option<UnitQuaternion<f64>> {
        self.given
    }

    /// Returns the variance of the orientation that a relief leaves which nothing confirms: one
    /// that is too flat or too deep turns too far or too little. It grows with the rotation of the
    /// first camera, in the object's frame, since the pose was given.
    pub(crate) fn turn_variance(&self, object_from_camera: &UnitQuaternion<f64>) -> f64 {
        let turned = self.given.map_or(0.0, |given| given.angle_to(object_from_camera));
        if self.is_open || self.is_confirmed() { 0.0 } else { (TURNS_OFF * turned).powi(2) }
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

impl Points {
    /// Returns whether the distances of most recognised points came from the body alone when they
    /// were detected.
    pub(crate) fn are_from_body(&self, matches: &[Match]) -> bool {
        let seen = matches.iter().filter(|one| one.is_recognised());
        let from_body = |one: &&Match| self.features[one.view.point].is_from_body;
        2 * seen.clone().filter(from_body).count() > seen.count()
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

    #[test]
    fn a_body_that_keyframes_confirm_is_not_denied_however_little_is_seen() {
        let mut relief = Relief::new(false);
        assert!(relief.is_denied(0.5, 0.95) && !relief.is_denied(0.7, 0.95));
        relief.measure(None);
        relief.measure(Some(0.5 * CONFIRMED));
        assert!(relief.is_confirmed() && !relief.is_denied(0.0, 0.95));
        relief.measure(Some(2.0 * CONFIRMED));
        assert!(relief.is_confirmed(), "the first word counts");
        let mut other = Relief::new(false);
        other.measure(Some(2.0 * CONFIRMED));
        assert!(other.is_denied(0.5, 0.95));
    }

    #[test]
    fn the_farther_an_object_turned_the_less_its_turn_is_known_unless_keyframes_confirm_the_body() {
        let turned = |angle: f64| UnitQuaternion::from_euler_angles(angle, 0.0, 0.0);
        let mut guess = Relief::new(false);
        assert!(guess.turn_variance(&turned(1.0)) == 0.0, "no pose was given");
        guess.begin(turned(0.1));
        let mut before = 0.0;
        for step in 1..20 {
            let variance = guess.turn_variance(&turned(0.1 + 0.1 * f64::from(step)));
            assert!(variance > before, "{step}");
            before = variance;
        }
        assert!(guess.turn_variance(&turned(0.1)) < 1e-12, "the given side is seen again");
        guess.measure(Some(0.9 * CONFIRMED));
        assert!(guess.turn_variance(&turned(1.0)) == 0.0);
    }

    #[test]
    fn one_that_is_open_stays_so_and_nothing_confirms_it() {
        let mut relief = Relief::new(true);
        relief.measure(Some(0.0));
        assert!(relief.is_open && !relief.is_confirmed() && !relief.is_denied(0.0, 1.0));
    }
}
