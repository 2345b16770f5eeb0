//! How well the points that are recognised tell how the object is turned.

use nalgebra::Vector3;

use super::points::{LEAST_KNOWN, Match, Points, RECOGNISED};

/// Standard deviation of what slips while the object turns by a radian, in radians, below which it is
/// proved that points do not.
const PROVES: f64 = 0.15;
/// Part of the object's radius across which distances that are guesses err together.
const TILT: f64 = 0.5;
/// Turn since they were learned, in radians, from which on that turns the object as much.
const TILTED: f64 = 0.3;
/// Angle between the ways to two cameras, in radians, that is no turn.
const EYES_APART: f64 = 0.2;

impl Points {
    /// Gives how far the turn may have drifted by the points that agree with images, as a variance: half of
    /// them know it at least so well. Nothing if they are too few. `toward` is the direction to the camera,
    /// and `slip` the variance by which points slip along while the object turns by a radian.
    pub(crate) fn drift_seen(
        &mut self,
        matches: &[Match],
        toward: &Vector3<f64>,
        slip: f64,
    ) -> Option<f64> {
        self.drifts.clear();
        self.seen.clear();
        for Match { view, agreement, .. } in matches {
            if agreement.is_none_or(|agreement| agreement.correlation < RECOGNISED) {
                continue;
            }
            let known = &mut self.known[view.point];
            self.seen.push(known.id);
            let turned = (known.point.toward.angle(toward) - EYES_APART).max(0.0);
            if slip < PROVES * PROVES {
                known.proved = known.proved.max(turned);
            }
            self.drifts.push(known.drift + 0.5 * slip * (turned - known.proved).max(0.0));
        }
        let half = self.drifts.len() / 2;
        let enough = self.drifts.len() >= LEAST_KNOWN;
        enough.then(|| *self.drifts.select_nth_unstable_by(half, f64::total_cmp).1)
    }

    /// Gives the variance of the turn by distances that are guesses: the errors of neighbours are alike, and turn
    /// the object as it turns. It is as before where too few points tell.
    pub(crate) fn tilt_seen(
        &mut self,
        matches: &[Match],
        toward: &Vector3<f64>,
        radius: f64,
    ) -> f64 {
        self.drifts.clear();
        for Match { view, agreement, .. } in matches {
            if agreement.is_none_or(|agreement| agreement.correlation < RECOGNISED) {
                continue;
            }
            let known = &self.known[view.point];
            let turned = (known.point.toward.angle(toward) - EYES_APART).max(0.0);
            let part = (turned / TILTED).min(1.0);
            let own = known.shared_variance() * (part / (TILT * radius)).powi(2);
            self.drifts.push(known.tilt + own);
        }
        let half = self.drifts.len() / 2;
        if self.drifts.len() < LEAST_KNOWN {
            return self.tilt;
        }
        *self.drifts.select_nth_unstable_by(half, f64::total_cmp).1
    }

    /// Gives the variance of the turn since the first image that is told.
    pub(crate) fn told(&self) -> f64 {
        self.drift + self.tilt
    }
}
