use crate::parallel::*;
use nalgebra::{UnitQuaternion, Vector2, Vector3};

use super::{Camera, CameraError, Distortion, brown_conrady, kannala_brandt};

/// Both coordinates that [`Lens::map_to`] writes where the lens sees nothing.
pub const NOWHERE_PX: f32 = -1e4;

/// A camera with a lens that may have distortion.
///
/// x points right, y down, z forward along the axis; pixel (0, 0) is the centre of the top-left
/// pixel. A lens sees directions up to [`Lens::limit`] off its axis, each at a different pixel.
/// Beyond that angle the distortion formulas are no longer one-to-one and would show things twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    camera: Camera,
    distortion: Distortion,
    // A tangent for Brown-Conrady, an angle for Kannala-Brandt.
    reach: f64,
}

impl Lens {
    /// Makes a lens of (width, height), (fx, fy) and (cx, cy), all in pixels, and its distortion.
    ///
    /// # Errors
    /// As for [`Camera::new`], or a coefficient of distortion is not finite or too large.
    pub fn new(
        size_px: [usize; 2],
        focal_px: [f64; 2],
        center_px: [f64; 2],
        distortion: Distortion,
    ) -> Result<Self, CameraError> {
        let camera = Camera::new(size_px, focal_px, center_px)?.in_pixels()?;
        distortion.check()?;
        let reach = match &distortion {
            Distortion::None => f64::INFINITY,
            Distortion::BrownConrady(k) => brown_conrady::limit(k),
            Distortion::KannalaBrandt(k) => kannala_brandt::limit(k),
        };
        Ok(Self { camera, distortion, reach })
    }

    /// Returns the pinhole camera of the same size, focal lengths and principal point.
    #[must_use]
    pub fn camera(&self) -> Camera {
        self.camera
    }

    /// Returns the distortion.
    #[must_use]
    pub fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// Returns the angle off the axis, in radians, up to which the lens sees.
    ///
    /// It is less than 90 degrees for Brown-Conrady and at most 120 degrees for Kannala-Brandt, and
    /// smaller where the distorted radius stops increasing before that.
    #[must_use]
    pub fn limit(&self) -> f64 {
        match self.distortion {
            Distortion::None | Distortion::BrownConrady(_) => libm::atan(self.reach),
            Distortion::KannalaBrandt(_) => self.reach,
        }
    }

    /// Projects a point in the lens's frame to pixels; `None` if it lies beyond the limit.
    #[must_use]
    pub fn project(&self, point_in_lens: &Vector3<f64>) -> Option<Vector2<f64>> {
        let p = point_in_lens;
        let place = match &self.distortion {
            Distortion::None if p.z > 0.0 => p.xy() / p.z,
            Distortion::None => return None,
            Distortion::BrownConrady(k) => {
                let flat = p.xy() / p.z;
                if p.z <= 0.0 || flat.norm() >= self.reach {
                    return None;
                }
                brown_conrady::distort(k, &flat)
            }
            Distortion::KannalaBrandt(k) => {
                let across = p.xy().norm();
                let angle = libm::atan2(across, p.z);
                if angle >= self.reach || (across == 0.0 && p.z <= 0.0) {
                    return None;
                }
                let far = kannala_brandt::distance(k, angle).0;
                if across > 0.0 { p.xy() * (far / across) } else { Vector2::zeros() }
            }
        };
        let ([fx, fy], [cx, cy]) = (self.camera.focal_px(), self.camera.center_px());
        let pixel = Vector2::new(fx * place.x + cx, fy * place.y + cy);
        pixel.iter().all(|x| x.is_finite()).then_some(pixel)
    }

    /// Returns the unit vector of the direction in which the lens sees a pixel; `None` if it sees
    /// nothing there.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Option<Vector3<f64>> {
        let flat = self.camera.ray(pixel);
        if !flat.iter().all(|x| x.is_finite()) {
            return None;
        }
        match &self.distortion {
            Distortion::None => Some(flat.normalize()),
            Distortion::BrownConrady(k) => {
                let straight = brown_conrady::undistort(k, self.reach, &flat.xy())?;
                Some(straight.push(1.0).normalize())
            }
            Distortion::KannalaBrandt(k) => {
                let far = flat.xy().norm();
                let angle = kannala_brandt::angle(k, self.reach, far)?;
                let across =
                    if far > 0.0 { flat.xy() * (libm::sin(angle) / far) } else { flat.xy() };
                Some(across.push(libm::cos(angle)))
            }
        }
    }

    /// Returns, for each pixel of an ideal camera at the same position, row by row, where the
    /// lens's image shows the same direction; [`NOWHERE_PX`], twice, where the image does not
    /// contain it.
    #[must_use]
    pub fn map_to(&self, camera: &Camera, lens_from_camera: &UnitQuaternion<f64>) -> Vec<[f32; 2]> {
        let [width, height] = camera.size_px();
        let turn = lens_from_camera.to_rotation_matrix();
        let mut map = vec![[NOWHERE_PX; 2]; width * height];
        map.par_chunks_exact_mut(width).enumerate().for_each(|(v, row)| {
            for (u, place) in row.iter_mut().enumerate() {
                let ray = turn * camera.ray([u as f64, v as f64]);
                if let Some(pixel) = self.project(&ray).filter(|pixel| self.holds(pixel)) {
                    *place = [pixel.x as f32, pixel.y as f32];
                }
            }
        });
        map
    }

    /// Returns whether a position lies in the image, or so close to it that interpolation still
    /// reads from the image.
    fn holds(&self, pixel: &Vector2<f64>) -> bool {
        let size = self.camera.size_px();
        (0..2).all(|i| pixel[i] > -1.0 && pixel[i] < size[i] as f64)
    }
}
