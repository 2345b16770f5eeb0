use nalgebra::Vector3;

use crate::shape::Quadric;

/// A ball about what was seen of an object: it tells how far an ellipsoid strays from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Middle of the seen points.
    pub middle: Vector3<f64>,
    /// How far they reach from it.
    pub radius: f64,
}

/// Share of the seen points that the ball holds; the others may be wrong.
const HELD: f64 = 0.95;

impl Extent {
    /// Returns the ball of seen points; `None` if there are none or all are one.
    #[must_use]
    pub fn of(points: &[Vector3<f64>]) -> Option<Self> {
        let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        let mut away: Vec<f64> = points.iter().map(|point| (point - middle).norm()).collect();
        away.sort_by(f64::total_cmp);
        let radius = *away.get((HELD * points.len() as f64) as usize)?;
        (radius > 0.0).then_some(Self { middle, radius })
    }

    /// Returns how far a centre is outside of the ball, in radii and squared, and how that changes
    /// with the centre. It is 0 inside.
    #[must_use]
    pub fn beyond(&self, quadric: &Quadric) -> (f64, Vector3<f64>) {
        let offset = quadric.center - self.middle;
        let away = offset.norm();
        let excess = (away / self.radius - 1.0).max(0.0);
        let slope = offset * (2.0 * excess / (self.radius * away.max(self.radius)));
        (excess * excess, slope)
    }
}
