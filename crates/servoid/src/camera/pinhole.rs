use nalgebra::{Matrix3, Vector2, Vector3};

use super::Distortion;
use crate::words::were;

/// Why numbers do not make a camera.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// An angle of view is not between 0 and 180 degrees.
    #[error(
        "an angle of view must be more than 0 and less than 180 degrees, but it is {0}; it is the \
         angle from the left to the right border of the image"
    )]
    Fov(f64),
    /// An angle of view is one of hardly any lens, as if it were in radians.
    #[error(
        "an angle of view of {fov_deg} degrees is that of hardly any lens{}; if it is right, give \
         the focal length in pixels",
        in_radians(*fov_deg)
    )]
    Narrow {
        /// Angle given.
        fov_deg: f64,
    },
    /// An angle of view is that of a fisheye.
    #[error(
        "an angle of view of {0} degrees from left to right is that of a fisheye, whose lens an \
         angle does not describe; calibrate it, and give its lens"
    )]
    Wide(f64),
    /// A focal length is in another unit than pixels.
    #[error(
        "a focal length must be in pixels, but with focal_px {focal_px:?} an image of {size_px:?} \
         pixels covers {:.0} degrees; one in millimetres is multiplied by the pixels of the image \
         per millimetre of the sensor",
        widest(*size_px, *focal_px)
    )]
    Unit {
        /// (fx, fy) given.
        focal_px: [f64; 2],
        /// Width and height.
        size_px: [usize; 2],
    },
    /// A focal length is not a positive number.
    #[error("a focal length must be a positive number of pixels, but focal_px is {0:?}")]
    Focal([f64; 2]),
    /// The principal point is not finite.
    #[error("the principal point must be two finite numbers of pixels, but center_px is {0:?}")]
    Center([f64; 2]),
    /// The image has no pixels or too many.
    #[error("an image must be 1 to {max} pixels wide and high, but size_px is {given:?}")]
    Size {
        /// Width and height given.
        given: [usize; 2],
        /// Most pixels along a side.
        max: usize,
    },
    /// No lens model has this name.
    #[error("unknown model '{0}'; known models: {known}", known = Distortion::MODELS.join(", "))]
    Model(String),
    /// A lens model takes another number of coefficients.
    #[error("{} but {given} {} given", coefficients_of(model), were(*given))]
    Coefficients {
        /// Name of the model.
        model: String,
        /// How many numbers were given.
        given: usize,
    },
    /// A coefficient of distortion is not finite or absurdly large.
    #[error(
        "a distortion coefficient must be a finite number of magnitude {max:e} at most, but the \
         one at index {index} is {value}"
    )]
    Coefficient {
        /// Which one, from 0.
        index: usize,
        /// The number given.
        value: f64,
        /// Largest size.
        max: f64,
    },
}

/// Returns the larger angle of view, of those across and along an image, in degrees.
#[allow(clippy::cast_precision_loss, reason = "what is too large is refused")]
fn widest(size_px: [usize; 2], focal_px: [f64; 2]) -> f64 {
    let angle =
        |(side, focal): (usize, f64)| 2.0 * libm::atan(0.5 * side as f64 / focal).to_degrees();
    size_px.into_iter().zip(focal_px).map(angle).fold(0.0, f64::max)
}

fn in_radians(fov_deg: f64) -> String {
    let meant = fov_deg.to_degrees();
    let is_likely = (Camera::NARROWEST_DEG..=Camera::WIDEST_DEG).contains(&meant);
    if is_likely { format!(" (in radians it would be {meant:.1} degrees)") } else { String::new() }
}

fn coefficients_of(model: &str) -> &'static str {
    match model {
        "pinhole" => "a 'pinhole' has no distortion,",
        "kannala_brandt" => "'kannala_brandt' takes 4 distortion coefficients (k1 k2 k3 k4),",
        _ => "'brown_conrady' takes 4, 5 or 8 distortion coefficients (k1 k2 p1 p2 k3 k4 k5 k6),",
    }
}

/// A pinhole camera with its image size.
///
/// x points right, y down, z forward; pixel (0, 0) is the centre of the top-left pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    size_px: [usize; 2],
    focal_px: [f64; 2],
    center_px: [f64; 2],
}

impl Camera {
    /// Most pixels along a side: prefix sums along a row stay exact in single precision.
    pub const MAX_SIDE_PX: usize = 8192;
    /// Less degrees from the left to the right border are probably an angle in radians.
    const NARROWEST_DEG: f64 = 3.0;
    /// More degrees from border to border are those of a fisheye.
    const WIDEST_DEG: f64 = 160.0;

    /// Makes a camera of (width, height), (fx, fy) and (cx, cy), all in pixels.
    ///
    /// # Errors
    /// If the size is zero or above [`Camera::MAX_SIDE_PX`], a focal length is not positive, or a
    /// number is not finite.
    pub fn new(
        size_px: [usize; 2],
        focal_px: [f64; 2],
        center_px: [f64; 2],
    ) -> Result<Self, CameraError> {
        let max = Self::MAX_SIDE_PX;
        if size_px.iter().any(|&n| n == 0 || n > max) {
            return Err(CameraError::Size { given: size_px, max });
        }
        if !focal_px.iter().all(|&f| f.is_finite() && f > 0.0) {
            return Err(CameraError::Focal(focal_px));
        }
        if !center_px.iter().all(|c| c.is_finite()) {
            return Err(CameraError::Center(center_px));
        }
        Ok(Self { size_px, focal_px, center_px })
    }

    /// Returns the camera, unless its focal lengths are probably in millimetres, or in widths of the
    /// image, as its angle of view is that of a fisheye.
    ///
    /// # Errors
    /// If they are.
    pub fn in_pixels(self) -> Result<Self, CameraError> {
        let Self { size_px, focal_px, .. } = self;
        if widest(size_px, focal_px) > Self::WIDEST_DEG {
            return Err(CameraError::Unit { focal_px, size_px });
        }
        Ok(self)
    }

    /// Makes a camera of (width, height) in pixels and the angle of view from the left to the right
    /// border of the image in degrees. Its pixels are square and its principal point is the centre
    /// of the image.
    ///
    /// # Errors
    /// If the angle is not between 0 and 180 degrees, is below 3 as an angle in radians is, is above
    /// 160, where images of a pinhole end, or as for [`Camera::new`].
    pub fn from_fov(size_px: [usize; 2], fov_deg: f64) -> Result<Self, CameraError> {
        if !(fov_deg > 0.0 && fov_deg < 180.0) {
            return Err(CameraError::Fov(fov_deg));
        }
        if fov_deg < Self::NARROWEST_DEG {
            return Err(CameraError::Narrow { fov_deg });
        }
        if fov_deg > Self::WIDEST_DEG {
            return Err(CameraError::Wide(fov_deg));
        }
        #[allow(clippy::cast_precision_loss, reason = "what is too large is refused")]
        let [width, height] = size_px.map(|side| side as f64);
        let focal = 0.5 * width / libm::tan(0.5 * fov_deg.to_radians());
        Self::new(size_px, [focal; 2], [0.5 * (width - 1.0), 0.5 * (height - 1.0)])
    }

    /// Returns (width, height) in pixels.
    #[must_use]
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// Returns (fx, fy) in pixels.
    #[must_use]
    pub fn focal_px(&self) -> [f64; 2] {
        self.focal_px
    }

    /// Returns the principal point (cx, cy) in pixels.
    #[must_use]
    pub fn center_px(&self) -> [f64; 2] {
        self.center_px
    }

    /// Returns the 3x3 calibration matrix K.
    #[must_use]
    pub fn matrix(&self) -> Matrix3<f64> {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.center_px);
        Matrix3::new(fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0)
    }

    /// Projects a point in the camera's frame to pixels; `None` if it is not in front.
    #[must_use]
    pub fn project(&self, point_in_camera: &Vector3<f64>) -> Option<Vector2<f64>> {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.center_px);
        let p = point_in_camera;
        (p.z > 0.0).then(|| Vector2::new(fx * p.x / p.z + cx, fy * p.y / p.z + cy))
    }

    /// Returns the direction, with z = 1, in which the camera sees a pixel.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Vector3<f64> {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.center_px);
        Vector3::new((pixel[0] - cx) / fx, (pixel[1] - cy) / fy, 1.0)
    }

    /// Returns the camera of the part of the image that starts at pixel `corner`, shrunk so that
    /// `shrink` pixels along each side become one.
    ///
    /// # Errors
    /// As for [`Camera::new`].
    pub fn crop(
        &self,
        corner: [usize; 2],
        size_px: [usize; 2],
        shrink: usize,
    ) -> Result<Self, CameraError> {
        let scale = 1.0 / shrink as f64;
        // The centre of a shrunk pixel lies (shrink - 1) / 2 pixels from the centre of the first
        // pixel in it.
        let shift = 0.5 * (shrink as f64 - 1.0);
        let center = |i: usize| (self.center_px[i] - corner[i] as f64 - shift) * scale;
        Self::new(size_px, self.focal_px.map(|f| f * scale), [center(0), center(1)])
    }
}
