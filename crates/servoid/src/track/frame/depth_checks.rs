use nalgebra::Vector2;

use super::rangefinder::Rangefinder;
use crate::camera::depth_noise;
use crate::track::target::solid::Solid;

/// How far the depth images of a camera agree with the body, at poses at which it is followed.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct DepthRecord {
    /// Share of the pixels on the body that agree: a running mean.
    share: Option<f64>,
}

/// Distance along a ray, in radii of the body, within which a measurement lies on its surface.
const NEAR_SURFACE: f64 = 0.25;
/// Pixels along each side of the window at which depth is compared, and the least number of them on
/// the body.
const SIDE: usize = 30;
const LEAST_PIXELS: usize = 30;
/// Share of these pixels that must agree for the depth images of a camera to be used: the body of a
/// first observation has the shape of the object on about all of them.
const LEAST_AGREEING: f64 = 0.6;
/// Weight of the newest image.
const NEWEST: f64 = 0.2;

impl DepthRecord {
    /// Returns whether the depth images agree well enough to be used.
    pub(crate) fn is_believed(&self) -> bool {
        self.share.is_none_or(|share| share >= LEAST_AGREEING)
    }

    /// Compares a depth image with the body. What lies in front of the body may hide it, and says
    /// nothing.
    pub(crate) fn compare(
        &mut self,
        seen: &Rangefinder<'_>,
        (first_px, size_px): ([usize; 2], [usize; 2]),
        solid: &Solid,
    ) {
        let (mut agreeing, mut counted) = (0, 0);
        for at in 0..SIDE * SIDE {
            let place = [at % SIDE, at / SIDE];
            let pixel =
                |i: usize| (first_px[i] + (2 * place[i] + 1) * size_px[i] / (2 * SIDE)) as f64;
            let pixel = Vector2::new(pixel(0), pixel(1));
            let Some((behind, metres)) = seen.behind(solid, &pixel) else { continue };
            let near = NEAR_SURFACE * solid.radius + 3.0 * depth_noise(metres);
            if behind >= -near {
                counted += 1;
                agreeing += usize::from(behind <= near);
            }
        }
        if counted < LEAST_PIXELS {
            return;
        }
        let found = agreeing as f64 / counted as f64;
        self.share = Some(self.share.map_or(found, |share| share + NEWEST * (found - share)));
    }
}
