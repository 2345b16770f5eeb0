//! Bias of the outline: the body only approximates the object, so the pose that fits its outline
//! best is off, by about the same amount from image to image, but by another amount from another
//! side. Surface points and motion, which determine the pose as well, reveal the bias.

use nalgebra::{Matrix6, SMatrix, SVector, Vector3, Vector6};

use crate::pose::Twist;

/// Small motion of the object, in its own frame, by which the pose that fits its outline best
/// differs from the true one; in radii and radians, so that it is the same in any unit of length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bias {
    mean: Vector6<f64>,
    covariance: Matrix6<f64>,
    /// Direction from which it was observed, in the object's frame.
    toward: Option<Vector3<f64>>,
    radius: f64,
}

/// A measurement of a motion: its information, and that times the motion.
pub(crate) type Information = (Matrix6<f64>, Vector6<f64>);

/// Standard deviation, in radii and radians, for an unknown side, and its increase per radian of
/// rotation.
const UNKNOWN: (f64, f64) = (0.1, 0.15);
const CHANGES: (f64, f64) = (0.1, 0.15);

impl Bias {
    pub(crate) fn unknown(radius: f64) -> Self {
        Self { mean: Vector6::zeros(), covariance: variances(UNKNOWN), toward: None, radius }
    }

    /// Returns the outline's information about the pose after marginalising the bias; the outline
    /// is seen from a direction in the object's frame.
    pub(crate) fn freed(&self, toward: &Vector3<f64>, outline: Information) -> Information {
        let now = self.seen_from(toward);
        let (information, slope) = self.in_radii(outline);
        let open = Matrix6::identity() + information * now.covariance;
        let Some(inverse) = open.try_inverse() else { return outline };
        let left = inverse * information;
        self.in_metres((left, inverse * slope - left * now.mean))
    }

    /// Updates the bias by an image in which other evidence constrains the pose as well.
    pub(crate) fn update(
        &mut self,
        toward: &Vector3<f64>,
        outline: Information,
        rest: Information,
    ) {
        let now = self.seen_from(toward);
        let (outline, rest) = (self.in_radii(outline), self.in_radii(rest));
        let Some(before) = now.covariance.try_inverse() else { return };
        // The pose, and the outline's deviation from it, that fit best together.
        let slope = outline.1 - outline.0 * now.mean;
        let mut information = SMatrix::<f64, 12, 12>::zeros();
        information.fixed_view_mut::<6, 6>(0, 0).copy_from(&(rest.0 + outline.0));
        information.fixed_view_mut::<6, 6>(0, 6).copy_from(&outline.0);
        information.fixed_view_mut::<6, 6>(6, 0).copy_from(&outline.0);
        information.fixed_view_mut::<6, 6>(6, 6).copy_from(&(before + outline.0));
        let mut slopes = SVector::<f64, 12>::zeros();
        slopes.fixed_rows_mut::<6>(0).copy_from(&(rest.1 + slope));
        slopes.fixed_rows_mut::<6>(6).copy_from(&slope);
        let Some(inverse) = information.try_inverse() else { return };
        let off = (inverse * slopes).fixed_rows::<6>(6).into_owned();
        let covariance = inverse.fixed_view::<6, 6>(6, 6).into_owned();
        *self = Self { mean: now.mean + off, covariance, ..now };
    }

    /// Updates the bias by an image whose pose is given.
    pub(crate) fn update_at(&mut self, toward: &Vector3<f64>, outline: Information) {
        let now = self.seen_from(toward);
        let (information, slope) = self.in_radii(outline);
        let Some(before) = now.covariance.try_inverse() else { return };
        let Some(covariance) = (before + information).try_inverse() else { return };
        let mean = now.mean + covariance * (slope - information * now.mean);
        *self = Self { mean, covariance, ..now };
    }

    /// Corrects the bias if all poses were off by a motion of the object, in its own frame: the
    /// outline does not move.
    pub(crate) fn correct(&mut self, off: &Twist) {
        self.mean -= self.unit(1.0 / self.radius) * off;
    }

    /// Returns the bias as seen from a direction; its uncertainty never exceeds that of an unseen
    /// side.
    fn seen_from(&self, toward: &Vector3<f64>) -> Self {
        let turned = self.toward.map_or(0.0, |last| last.angle(toward));
        let covariance = self.covariance + variances(CHANGES) * turned;
        let most = variances(UNKNOWN);
        let left = Vector6::from_fn(|i, _| (most[(i, i)] / covariance[(i, i)]).min(1.0).sqrt());
        let left = Matrix6::from_diagonal(&left);
        Self {
            mean: left * self.mean,
            covariance: left * covariance * left,
            toward: Some(*toward),
            radius: self.radius,
        }
    }

    fn in_radii(&self, (information, slope): Information) -> Information {
        let unit = self.unit(self.radius);
        (unit * information * unit, unit * slope)
    }

    fn in_metres(&self, (information, slope): Information) -> Information {
        let unit = self.unit(1.0 / self.radius);
        (unit * information * unit, unit * slope)
    }

    fn unit(&self, length: f64) -> Matrix6<f64> {
        Matrix6::from_diagonal(&Vector6::new(length, length, length, 1.0, 1.0, 1.0))
    }
}

fn variances((across, turned): (f64, f64)) -> Matrix6<f64> {
    let (across, turned) = (across * across, turned * turned);
    Matrix6::from_diagonal(&Vector6::new(across, across, across, turned, turned, turned))
}

#[cfg(test)]
mod tests {
    use super::*;

    const RADIUS: f64 = 0.05;

    /// Information of an outline that fits best at a motion from the pose, in radii and radians.
    fn outline(off: f64) -> Information {
        let information =
            Bias::unknown(RADIUS).in_metres((Matrix6::identity() * 1e4, Vector6::zeros())).0;
        let units = Vector6::new(RADIUS, RADIUS, RADIUS, 1.0, 1.0, 1.0);
        (information, information * (units * off))
    }

    fn nothing() -> Information {
        (Matrix6::identity() * 1e-9, Vector6::zeros())
    }

    /// Computes the measured motion.
    fn motion_of((information, slope): Information) -> Vector6<f64> {
        information.try_inverse().unwrap() * slope
    }

    #[test]
    fn an_outline_that_is_off_where_the_pose_is_known_pulls_no_more_from_there_but_as_much_when_it_moves()
     {
        let toward = Vector3::z();
        let mut bias = Bias::unknown(RADIUS);
        assert!(motion_of(bias.freed(&toward, outline(0.02))).amax() > 0.015);
        bias.update_at(&toward, outline(0.02));
        assert!(motion_of(bias.freed(&toward, outline(0.02))).amax() < 0.001);
        let moved = motion_of(bias.freed(&toward, outline(0.03)));
        assert!((moved[5] - 0.01).abs() < 0.001, "{moved}");
    }

    #[test]
    fn the_bias_is_learned_where_points_determine_the_pose_and_kept_where_there_are_none() {
        let toward = Vector3::z();
        let mut bias = Bias::unknown(RADIUS);
        let sure = (outline(0.0).0 * 100.0, Vector6::zeros());
        for _ in 0..5 {
            bias.update(&toward, outline(0.02), sure);
        }
        assert!(motion_of(bias.freed(&toward, outline(0.02))).amax() < 0.002);
        for _ in 0..5 {
            bias.update(&toward, outline(0.05), nothing());
        }
        let moved = motion_of(bias.freed(&toward, outline(0.05)));
        assert!((moved[5] - 0.03).abs() < 0.004, "{moved}");
    }

    #[test]
    fn the_farther_the_object_turned_the_less_information_its_outline_has_until_a_side_is_new() {
        let mut bias = Bias::unknown(RADIUS);
        bias.update_at(&Vector3::z(), outline(0.0));
        let mut before = f64::INFINITY;
        for step in 0..9 {
            let angle = 0.1 * f64::from(step);
            let toward = Vector3::new(libm::sin(angle), 0.0, libm::cos(angle));
            let information = bias.freed(&toward, outline(0.0)).0.trace();
            assert!(information < before, "{step}");
            before = information;
        }
        let away = bias.freed(&-Vector3::z(), outline(0.0)).0.trace();
        let unknown = Bias::unknown(RADIUS).freed(&Vector3::z(), outline(0.0)).0.trace();
        assert!((away / unknown - 1.0).abs() < 0.05, "{away} {unknown}");
    }

    #[test]
    fn in_other_units_of_length_it_is_the_same() {
        let learned = |scale: f64| {
            let units = Vector6::new(scale, scale, scale, 1.0, 1.0, 1.0).map(|x| 1.0 / x);
            let unit = Matrix6::from_diagonal(&units);
            let scaled =
                |(information, slope): Information| (unit * information * unit, unit * slope);
            let mut bias = Bias::unknown(scale * RADIUS);
            bias.update_at(&Vector3::z(), scaled(outline(0.01)));
            bias.update(&Vector3::x(), scaled(outline(0.03)), scaled(outline(-0.02)));
            bias.mean
        };
        assert_eq!(learned(1.0), learned(0.25));
    }
}
