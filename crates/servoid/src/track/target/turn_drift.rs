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
    /// that at least half of them do not exceed; none if they are too few. `toward` is the
    /// direction to the camera, and `slip` the variance by which points slip per radian of
    /// rotation.
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
            let turned = turned(feature, toward);
            if slip < PROVES * PROVES {
                feature.proved = feature.proved.max(turned);
            }
            self.drifts
                .push(feature.drift_variance + 0.5 * slip * (turned - feature.proved).max(0.0));
        }
        median(&mut self.drifts)
    }

    /// Returns the variance of the orientation since the first image.
    pub(crate) fn turn_variance(&self) -> f64 {
        self.drift_variance + self.noise_variance + self.relief_variance
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
