//! What an outline says of the orientation: nothing where its shape is that of a body of revolution,
//! and all of it where the object's shape is known and has no print.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen};

use super::print::MOSTLY;
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::refine::Normal;
use crate::track::pose::uncertainty::inverse;
use crate::track::pose::verify::Quality;
use crate::track::target::reference::Reference;
use crate::track::tracker::Tracker;

/// Motion of the outline per radian about the axis about which it moves least, compared with its
/// motion per radius of translation, from which on it shows that rotation; the same of a body that
/// several cameras saw from one side: a bottle's is never quite one of revolution, and reaches 0.042.
const LEVER: f64 = 0.03;
const LEVER_OF_ONE_LOOK: f64 = 0.06;
/// Share of the points compared that are recognised, times that of those with the contrast of a
/// pattern, usual and at most so far, from which on they show a rotation that the outline does not,
/// unless most are printed: a plain bottle or skittle has up to 0.27, soft rings and highlights, which
/// stay where they are while it turns; print gives 0.39 and more, but sharp rings give 0.6.
const FILLED: f64 = 0.33;
/// Agreement of the outline with the boundary, and share of what should be visible that is seen, from
/// which on an outline alone shows the orientation.
const FITS: f64 = 0.7;
const WHOLE: f64 = 0.85;
/// Standard deviation of the orientation by the outline, in radians about its least certain axis and
/// without its bias, up to which that is so; and the least number of cameras: a single one often fits
/// the outline as well when it is mirrored in depth.
const CERTAIN_RAD: f64 = 0.15;
const CAMERAS: usize = 2;
/// Share of all information that is added to that of the translation, so that it has an inverse.
const OPEN: f64 = 1e-6;

impl Tracker {
    /// Returns whether print or the outline can show all of a rotation.
    pub(in crate::track) fn is_turn_visible(&self, hypothesis: &Hypothesis) -> bool {
        let quality = &hypothesis.quality;
        let Reference { printed_share, most_printed, most_filled, .. } = self.target.reference;
        let (part, filled) = printed_share.map_or_else(
            || (quality.printed_share(), quality.textured * quality.recognised),
            |_| (most_printed, most_filled),
        );
        let cameras = self.frame.cameras.len();
        let is_one_look = cameras > 1 && !self.settings.known_shape;
        let least = if is_one_look { LEVER_OF_ONE_LOOK } else { LEVER };
        let all = (self.settings.points * cameras) as f64;
        let is_printed = part >= MOSTLY || filled >= FILLED * all * all;
        let moves = || lever(hypothesis, self.target.solid.radius) >= least;
        !self.settings.region || is_printed || moves()
    }

    /// Returns whether the outline alone shows the orientation of an object without print, whose
    /// shape is known and that was followed ever since its pose was given.
    pub(in crate::track) fn is_turn_outlined(&self, hypothesis: &Hypothesis) -> bool {
        let radius = self.target.solid.radius;
        let Quality { visible, outline, .. } = hypothesis.quality;
        self.settings.known_shape
            && self.is_plain()
            && self.trust.is_continuous()
            && self.frame.open() >= CAMERAS
            && visible >= WHOLE
            && outline >= FITS
            && lever(hypothesis, radius) >= LEVER
            && is_certain(&hypothesis.normal.outline.0, radius)
    }
}

/// Returns how far the outline moves per radian about the axis about which it moves least, compared
/// with how far it moves per radius of translation, both rms; translation that undoes the rotation
/// is left out. Nothing moves an outline that is not seen.
fn lever(hypothesis: &Hypothesis, radius: f64) -> f64 {
    let information = &hypothesis.normal.outline.0;
    let block = |row, column| information.fixed_view::<3, 3>(row, column).into_owned();
    let (across, mixed, turned) = (block(0, 0), block(0, 3), block(3, 3));
    let all = across.trace();
    let Some(inverse) = (across + Matrix3::identity() * (OPEN * all)).try_inverse() else {
        return 0.0;
    };
    let left = turned - mixed.transpose() * inverse * mixed;
    let least = SymmetricEigen::new(left).eigenvalues.min().max(0.0);
    if all > 0.0 { (least / all).sqrt() / radius } else { 0.0 }
}

fn is_certain(outline: &Matrix6<f64>, radius: f64) -> bool {
    let Some(covariance) = inverse(&(outline + Normal::new(radius).prior)) else { return false };
    let turn = covariance.fixed_view::<3, 3>(3, 3).into_owned();
    SymmetricEigen::new(turn).eigenvalues.max() <= CERTAIN_RAD.powi(2)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2x3, Vector2, Vector3};
    use proptest::prelude::*;

    use super::*;
    use crate::pose::Pose;
    use crate::track::Status;
    use crate::track::target::points::by_motion;
    use crate::track::trust::tests::{quality, tracker};

    const RADIUS: f64 = 0.05;
    /// Points of an outline that move when it turns, in radii, and their normals.
    const HANDLE: [(Vector3<f64>, Vector2<f64>); 2] = [
        (Vector3::new(0.5, 0.1, 0.8), Vector2::new(1.0, 0.0)),
        (Vector3::new(-0.5, 0.3, -0.6), Vector2::new(0.0, 1.0)),
    ];

    /// Makes a hypothesis with an outline: points in the object's frame and their normals, as seen
    /// along z by a camera far away.
    fn outlined(rim: &[(Vector3<f64>, Vector2<f64>)], scale: f64) -> Hypothesis {
        let slope = Matrix2x3::new(300.0, 0.0, 0.0, 0.0, 300.0, 0.0);
        let mut hypothesis = Hypothesis::nothing(Pose::identity(), scale * RADIUS);
        for (point, normal) in rim {
            let line = by_motion(&(slope / scale), &(point * scale)).tr_mul(normal);
            hypothesis.normal.outline.0 += line * line.transpose();
        }
        hypothesis
    }

    /// Returns the outline of a body of revolution about y, of a height and with a waist, turned out
    /// of the image plane.
    fn vase(height: f64, waist: f64) -> Vec<(Vector3<f64>, Vector2<f64>)> {
        let mut rim = Vec::new();
        for step in -20..=20 {
            let along = 0.05 * f64::from(step);
            let around = 0.4 * RADIUS * (1.0 - waist * (1.0 - along * along));
            let tilt = libm::atan2(0.8 * RADIUS * waist * along, height);
            for side in [-1.0, 1.0] {
                let point = Vector3::new(side * around, height * along, 0.0);
                rim.push((point, Vector2::new(side * libm::cos(tilt), -libm::sin(tilt))));
            }
        }
        rim
    }

    proptest! {
        #[test]
        fn no_outline_of_a_body_of_revolution_shows_its_turn_about_the_axis(
            height in 0.3..2.0_f64,
            waist in 0.0..0.8_f64,
        ) {
            prop_assert!(lever(&outlined(&vase(height * RADIUS, waist), 1.0), RADIUS) < 1e-3);
        }

        #[test]
        fn the_lever_of_an_outline_is_the_same_in_any_unit_of_length(scale in 0.01..100.0_f64) {
            let mut rim = vase(RADIUS, 0.3);
            rim.extend(HANDLE.map(|(point, normal)| (point * RADIUS, normal)));
            let (one, other) = (lever(&outlined(&rim, 1.0), RADIUS), lever(&outlined(&rim, scale), scale * RADIUS));
            prop_assert!(one > LEVER && (one - other).abs() < 1e-9 * one);
        }
    }

    #[test]
    fn an_outline_that_is_not_seen_shows_nothing() {
        assert_eq!(lever(&Hypothesis::nothing(Pose::identity(), RADIUS), RADIUS), 0.0);
    }

    #[test]
    fn a_turn_that_moves_no_outline_is_visible_only_by_print() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let all = tracker.settings.points as f64;
        let mut rim = vase(RADIUS, 0.3);
        let plain = outlined(&rim, 1.0);
        let round = |quality: Quality| Hypothesis { quality, ..plain };
        rim.extend(HANDLE.map(|(point, normal)| (point * RADIUS, normal)));
        let handled = outlined(&rim, 1.0);
        let shown = |recognised: f64, textured: f64| {
            let (recognised, textured) = (recognised * all, textured * all);
            Quality { textured, printed: 0.0, ..quality(1.0, recognised) }
        };
        for (recognised, textured) in (0..=10).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let (recognised, textured) = (0.1 * f64::from(recognised), 0.1 * f64::from(textured));
            let seen = shown(recognised, textured);
            assert!(tracker.is_turn_visible(&Hypothesis { quality: seen, ..handled }));
            let is_printed = recognised * textured >= FILLED;
            assert_eq!(tracker.is_turn_visible(&round(seen)), is_printed);
        }
        let mostly = Quality { printed: MOSTLY * 20.0, textured: 17.0, ..quality(1.0, 20.0) };
        assert!(tracker.is_turn_visible(&round(mostly)), "a small ball with print all over");
        tracker.target.reference.begin(&shown(1.0, FILLED));
        assert!(tracker.is_turn_visible(&round(shown(0.0, 0.0))), "a label that turned away");
    }
}
