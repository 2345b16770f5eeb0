use super::CameraError;

/// How the image of a lens departs from that of a pinhole.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Distortion {
    /// Straight lines stay straight.
    None,
    /// Brown and Conrady's model with k1, k2, p1, p2, k3, k4, k5, k6 in OpenCV's order: a rational
    /// radial part and decentring. Its field of view ends before 90 degrees off the axis.
    BrownConrady([f64; 8]),
    /// Kannala and Brandt's model with k1, k2, k3, k4, OpenCV's fisheye: the distance from the
    /// centre is a polynomial in the angle off the axis, which may exceed 90 degrees.
    KannalaBrandt([f64; 4]),
}

impl Distortion {
    /// The names of the models.
    pub const MODELS: [&str; 3] = ["pinhole", "brown_conrady", "kannala_brandt"];

    /// Largest absolute value of a coefficient: powers of larger ones overflow.
    pub const MAX_COEFFICIENT: f64 = 1e12;

    /// Reads a model's name and its coefficients: none for `pinhole`; 4, 5 or 8 for
    /// `brown_conrady`, where those left out are zero; 4 for `kannala_brandt`.
    ///
    /// # Errors
    /// If no model has the name, if it takes another number of coefficients, or if one of them is
    /// not finite or larger than [`Distortion::MAX_COEFFICIENT`].
    pub fn from_name(model: &str, coefficients: &[f64]) -> Result<Self, CameraError> {
        let distortion = match (model, coefficients.len()) {
            ("pinhole", 0) => Self::None,
            ("brown_conrady", 4 | 5 | 8) => {
                let given = |i: usize| coefficients.get(i).copied().unwrap_or(0.0);
                Self::BrownConrady(std::array::from_fn(given))
            }
            ("kannala_brandt", 4) => Self::KannalaBrandt(std::array::from_fn(|i| coefficients[i])),
            ("pinhole" | "brown_conrady" | "kannala_brandt", given) => {
                return Err(CameraError::Coefficients { model: model.into(), given });
            }
            _ => return Err(CameraError::Model(model.into())),
        };
        distortion.check()?;
        Ok(distortion)
    }

    /// Returns the model's name, one of [`Distortion::MODELS`].
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::None => "pinhole",
            Self::BrownConrady(_) => "brown_conrady",
            Self::KannalaBrandt(_) => "kannala_brandt",
        }
    }

    /// Returns the coefficients in the model's order.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::None => &[],
            Self::BrownConrady(k) => k,
            Self::KannalaBrandt(k) => k,
        }
    }

    pub(super) fn check(&self) -> Result<(), CameraError> {
        let max = Self::MAX_COEFFICIENT;
        let sane = |k: &f64| k.is_finite() && k.abs() <= max;
        match self.coefficients().iter().position(|k| !sane(k)) {
            Some(index) => {
                let value = self.coefficients()[index];
                Err(CameraError::Coefficient { index, value, max })
            }
            None => Ok(()),
        }
    }
}
