use super::ImageError;

/// A borrowed depth image, row by row without gaps: metres along z for each pixel of its camera. A
/// value that is not positive and finite is unknown.
#[derive(Debug, Clone, Copy)]
pub struct DepthView<'a> {
    data: &'a [f32],
    size_px: [usize; 2],
}

/// Standard deviation of a depth camera's measurement at 0.4 m, in metres, and its increase per
/// square metre of the squared distance beyond that (Nguyen, Izadi and Lovell, 2012, for structured
/// light).
const NOISE: (f64, f64) = (1.2e-3, 1.9e-3);
const NEAREST_M: f64 = 0.4;

impl<'a> DepthView<'a> {
    /// Interprets `data` as a depth image of (width, height).
    ///
    /// # Errors
    /// If the number of values does not fit.
    pub fn new(data: &'a [f32], size_px: [usize; 2]) -> Result<Self, ImageError> {
        let [width, height] = size_px;
        if width.checked_mul(height) != Some(data.len()) {
            return Err(ImageError::DepthLength { width, height, given: data.len() });
        }
        Ok(Self { data, size_px })
    }

    /// Returns (width, height).
    #[must_use]
    pub fn size_px(&self) -> [usize; 2] {
        self.size_px
    }

    /// Returns the depth at the pixel nearest to a position, in metres, if it is known.
    #[must_use]
    pub fn at(&self, u: f64, v: f64) -> Option<f64> {
        let (u, v) = (libm::round(u), libm::round(v));
        let [width, height] = self.size_px.map(|n| n as f64);
        if !((0.0..width).contains(&u) && (0.0..height).contains(&v)) {
            return None;
        }
        let depth = f64::from(self.data[v as usize * self.size_px[0] + u as usize]);
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }
}

/// Returns the standard deviation of a measured depth, in metres.
#[must_use]
pub fn depth_noise(depth_m: f64) -> f64 {
    NOISE.0 + NOISE.1 * (depth_m - NEAREST_M).max(0.0).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_measured_is_not_known() {
        let data = [0.5, 0.0, f32::NAN, -1.0, f32::INFINITY, 2.0];
        let depth = DepthView::new(&data, [3, 2]).unwrap();
        assert_eq!((depth.at(0.3, 0.4), depth.at(2.4, 0.6)), (Some(0.5), Some(2.0)));
        for (u, v) in [(1.0, 0.0), (2.0, 0.0), (0.0, 1.0), (1.0, 1.0), (3.0, 0.0), (-0.6, 0.0)] {
            assert_eq!(depth.at(u, v), None);
        }
        assert!(DepthView::new(&data, [2, 2]).is_err());
        assert!(DepthView::new(&data, [usize::MAX, 2]).is_err());
    }
}
