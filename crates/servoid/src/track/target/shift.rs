use nalgebra::{Matrix2, Vector2};

use super::points::{PLACE_PX, noise};
use crate::fitness::Agreement;

/// What a match says about the true position of its pixel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shift {
    /// In inverse square pixels.
    pub(crate) information: Matrix2<f64>,
    /// The information times the shift.
    pub(crate) pull: Vector2<f64>,
}

/// Squared gradient of a normalised patch, per square pixel, that carries no information: along
/// ridges and shading it is noise, which would impede a rotation.
const EVEN: f64 = 0.03;
/// Part of it that is enough for a shift to be computed.
const LEAST: f64 = 0.1;

impl Shift {
    /// Converts a match at a level of the pyramid; `beside` is the covariance of the predicted
    /// pixel.
    pub(crate) fn new(agreement: &Agreement, level: usize, beside: &Matrix2<f64>) -> Option<Self> {
        let even = Matrix2::identity() * (EVEN * f64::from(1 << level).powi(-2));
        let clear = (agreement.tensor + even).try_inverse()?;
        let clear = agreement.tensor * clear;
        let tensor = clear * agreement.tensor;
        // The information of a shift of variance noise·tensor⁻¹ + place.
        let place = Matrix2::identity() * (PLACE_PX * PLACE_PX) + beside;
        let spread = Matrix2::identity() * noise(agreement.correlation) + tensor * place;
        let inverse = spread.try_inverse()?;
        Some(Self { information: inverse * tensor, pull: inverse * (clear * agreement.pull) })
    }

    /// Returns the shift itself at the finest resolution, in pixels: almost none along a ridge.
    pub(crate) fn pixels(agreement: &Agreement) -> Option<Vector2<f64>> {
        let even = Matrix2::identity() * (LEAST * EVEN);
        Some((agreement.tensor + even).try_inverse()? * agreement.pull)
    }
}
