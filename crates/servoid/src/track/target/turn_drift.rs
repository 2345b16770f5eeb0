//! Drift of the orientation, by the points that are recognised.

use nalgebra::Vector3;

use super::points::{Feature, LEAST_KNOWN, Match, Points};

/// Slip per radian of rotation, as a standard deviation in radians, below which points are proved
/// not to slip.
const PROVES: f64 = 0.15;
/// Angle between the directions to two cameras, in radians, that is not a rotation.
const EYES_APART: f64 = 0.2;

impl Points {
    /// Returns the drift of the orientation by the points that agree with images, as a variance
    /// that at least half of them do not exceed; none if they are too few. Those that slide do not
    /// count. `toward` is the direction to the camera, and `slip` the variance by which points slip
    /// per radian of rotation.
    pub(crate) fn drift_seen(
        &mut self,
        matches: &[Match],
        toward: &Vector3<f64>,
        slip: f64,
    ) -> Option<f64> {
        self.drifts.clear();
        self.seen.clear();
        for one in matches.iter().filter(|one| one.is_recognised()) {
            let feature = &mut self.features[one.view.point];
            self.seen.push(feature.id);
            if feature.slides {
                continue;
            }
            let turned = turned(feature, toward);
            if slip < PROVES * PROVES {
                feature.proved = feature.proved.max(turned);
            }
            self.drifts
                .push(feature.drift_variance + 0.5 * slip * (turned - feature.proved).max(0.0));
        }
        median(&mut self.drifts)
    }

    /// Returns the variance of the orientation that at least half of the points that agree with
    /// images do not exceed; none if they are too few.
    pub(crate) fn median_drift(&mut self, matches: &[Match]) -> Option<f64> {
        self.drifts.clear();
        let seen = matches.iter().filter(|one| one.is_recognised());
        self.drifts.extend(seen.map(|one| self.features[one.view.point].drift_variance));
        median(&mut self.drifts)
    }

    /// Takes the points that agree with images as such that do so however the object turns.
    pub(crate) fn note_sliding(&mut self, matches: &[Match]) {
        for one in matches.iter().filter(|one| one.agrees()) {
            let feature = &mut self.features[one.view.point];
            feature.slides |= !(one.turns || feature.shows_turns());
        }
    }

    /// Returns the variance of the orientation since the first image.
    pub(crate) fn turn_variance(&self) -> f64 {
        self.drift_variance + self.noise_variance + self.relief_variance + self.held_back_variance
    }
}

/// Returns by how much the object has rotated since a point was learned, in radians, at least.
fn turned(feature: &Feature, toward: &Vector3<f64>) -> f64 {
    (feature.point.toward.angle(toward) - EYES_APART).max(0.0)
}

/// Returns the median of values, none if they are too few.
fn median(values: &mut [f64]) -> Option<f64> {
    let half = values.len() / 2;
    let enough = values.len() >= LEAST_KNOWN;
    enough.then(|| *values.select_nth_unstable_by(half, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix2x3, Vector2};

    use super::super::feature::tests::feature;
    use super::super::points::InView;
    use super::*;
    use crate::fitness::Agreement;

    const DRIFT: f64 = 0.01;

    fn recognised(point: usize, turns: bool) -> Match {
        let agreement = Agreement {
            pixel: Vector2::zeros(),
            slope: Matrix2x3::zeros(),
            correlation: 1.0,
            tensor: Matrix2::identity(),
            pull: Vector2::zeros(),
            contrast: 20.0,
            brightness: 100.0,
        };
        let view = InView { point, camera: 0, template: 0 };
        let (agreement, pixel) = (Some(agreement), None);
        let is_edgel = false;
        Match { view, agreement, level: 0, pixel, at: point, moved: 0.0, turns, is_edgel }
    }

    #[test]
    fn what_is_recognised_while_nothing_shows_the_orientation_never_tells_its_drift() {
        let mut points = Points::default();
        points.add(&mut vec![feature(); 3 * LEAST_KNOWN]);
        for feature in &mut points.features {
            feature.drift_variance = DRIFT;
        }
        let all: Vec<_> = (0..3 * LEAST_KNOWN).map(|at| recognised(at, at % 3 == 0)).collect();
        let toward = points.features[0].point.toward;
        assert_eq!(points.drift_seen(&all, &toward, 0.0), Some(DRIFT));
        points.note_sliding(&all);
        assert_eq!(points.features.iter().filter(|one| one.slides).count(), 2 * LEAST_KNOWN);
        assert_eq!(points.drift_seen(&all, &toward, 0.0), Some(DRIFT), "a third showed it");
        assert_eq!(points.drift_seen(&all[..30], &toward, 0.0), None, "too few did");
        points.features[0].slides = false;
        points.note_sliding(&[Match { is_edgel: true, turns: false, ..all[0] }]);
        assert!(std::mem::take(&mut points.features[0].slides), "an edgel slides as well");
        let drifts: Vec<_> = points.features.iter().map(|one| (one.id, 0.0)).collect();
        points.know_drift(drifts.into_iter());
        let known = |one: &Feature| one.drift_variance < DRIFT;
        assert!(points.features.iter().all(|one| known(one) != one.slides));
    }
}
