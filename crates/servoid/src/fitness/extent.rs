use nalgebra::Vector3;

use crate::shape::Quadric;

/// A ball around the measured points of an object, to measure how far an ellipsoid strays from
/// them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Middle of the measured points.
    pub middle: Vector3<f64>,
    /// Their reach from it.
    pub radius: f64,
}

/// Share of the measured points inside the ball; the others may be wrong.
const HELD: f64 = 0.95;

impl Extent {
    /// Returns the ball of measured points; `None` if there are none or all coincide.
    #[must_use]
    pub fn of(points: &[Vector3<f64>]) -> Option<Self> {
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let mut away: Vec<f64> = points.iter().map(|point| (point - middle).norm()).collect();
        away.sort_by(f64::total_cmp);
        let radius = *away.get((HELD * points.len() as f64) as usize)?;
        (radius > 0.0).then_some(Self { middle, radius })
    }

    /// Returns the squared distance of a centre beyond the ball, in radii, and its gradient by the
    /// centre. It is 0 inside.
    #[must_use]
    pub fn beyond(&self, quadric: &Quadric) -> (f64, Vector3<f64>) {
        let offset = quadric.center - self.middle;
        let away = offset.norm();
        let excess = (away / self.radius - 1.0).max(0.0);
        let slope = offset * (2.0 * excess / (self.radius * away.max(self.radius)));
        (excess * excess, slope)
    }
}
