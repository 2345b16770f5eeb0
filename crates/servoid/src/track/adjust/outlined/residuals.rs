//! Distances between the object's boundary in an image and the outline of the body, both ways, and
//! their derivatives.

use nalgebra::{Matrix2, SVector, Vector2, Vector3, Vector6};

use super::shape::{Change, Part};
use crate::fitness::{on_outline, rim_at};
use crate::pose::Pose;
use crate::shape::{Outline, Projection, Quadric};
use crate::track::target::look::Look;

/// What a camera saw of the object at a keyframe.
#[derive(Debug, Clone)]
pub(crate) struct View {
    pub(crate) keyframe: usize,
    /// Projection of the world.
    pub(crate) world: Projection,
    pub(crate) look: Look,
}

/// A distance in pixels, and its derivatives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub(super) off_px: f64,
    pub(super) weight: f64,
    pub(super) part: usize,
    /// By the ellipsoid, then by a small motion of the object in its own frame.
    pub(super) slope: SVector<f64, 15>,
}

/// The distances of one view.
#[derive(Debug, Clone, Default)]
pub(super) struct Distances {
    /// Of the points of the boundary outside of the outline.
    pub(super) boundary: Vec<Row>,
    /// Of points of the outline outside of the boundary.
    pub(super) outline: Vec<Row>,
}

/// The weight of all points of a boundary together, and of all of an outline.
const POINTS: f64 = 56.0;
/// Points around the outline of an ellipsoid, and the least number of them that shares the weight.
const AROUND: usize = 16;
const FEWEST: f64 = 8.0;

/// The outline of an ellipsoid, prepared for distances.
struct Ring {
    outline: Outline,
    inverse: Matrix2<f64>,
}

impl Ring {
    fn new(projection: &Projection, quadric: &Quadric) -> Option<Self> {
        let outline = projection.outline(quadric)?;
        Some(Self { outline, inverse: outline.covariance_px().try_inverse()? })
    }

    /// Returns the distance of a pixel outside, the point of the outline in its direction, and the
    /// normal there.
    fn away(&self, pixel: &Vector2<f64>) -> (f64, Vector2<f64>, Vector2<f64>) {
        let away = pixel - self.outline.center_px();
        let across = self.inverse * away;
        let (times, length) = (away.dot(&across).sqrt().max(1e-6), across.norm().max(1e-12));
        let place = self.outline.center_px() + away / times;
        ((times - 1.0) * times / length, place, across / length)
    }
}

impl View {
    /// Returns the length of a radius of the object at a pose, in pixels.
    pub(super) fn radius_px(&self, pose: &Pose, radius: f64) -> Option<f64> {
        let (_, slope) = self.world.moved(pose).pixel(&Vector3::zeros())?;
        Some(radius * slope.row(0).norm())
    }

    /// Returns the distances of a body at a pose, and their derivatives if they are `sloped`; none if
    /// part of it is not in front of the camera.
    pub(super) fn distances(&self, parts: &[Part], pose: &Pose, sloped: bool) -> Option<Distances> {
        let projection = self.world.moved(pose);
        let quadrics: Vec<_> = parts.iter().map(Part::quadric).collect();
        let rings: Option<Vec<_>> =
            quadrics.iter().map(|one| Ring::new(&projection, one)).collect();
        let rings = rings?;
        let row = |part: usize, pixel: &Vector2<f64>, normal: &Vector2<f64>, by: Vector2<f64>| {
            if !sloped {
                return Some(SVector::zeros());
            }
            let (rim, _) = rim_at(&projection, &quadrics[part], pixel, normal);
            let (_, slope) = projection.pixel(&rim)?;
            Some(derivative(&parts[part], &rim, &slope.tr_mul(&by)))
        };
        let mut found = Distances::default();
        let weight = POINTS / self.look.points.len() as f64;
        for (pixel, _) in &self.look.points {
            let near = rings.iter().enumerate().map(|(part, ring)| (part, ring.away(pixel)));
            let (part, (off_px, place, normal)) = near.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
            let slope = row(part, &place, &normal, -normal)?;
            found.boundary.push(Row { off_px, weight, part, slope });
        }
        let mut exposed = 0.0;
        for (part, ring) in rings.iter().enumerate() {
            for step in 0..AROUND {
                let angle = std::f64::consts::TAU * step as f64 / AROUND as f64;
                let (pixel, normal) = on_outline(&ring.outline, angle);
                let others = rings.iter().enumerate().filter(|(other, _)| *other != part);
                let outside = others.map(|(_, ring)| ring.away(&pixel).0);
                let weight = (outside.fold(f64::INFINITY, f64::min) + 0.5).clamp(0.0, 1.0);
                if weight == 0.0 {
                    continue;
                }
                exposed += weight;
                let (off_px, by) = self.look.outside(&pixel)?;
                let slope = row(part, &pixel, &normal, by)?;
                found.outline.push(Row { off_px, weight: weight * weight, part, slope });
            }
        }
        let share = POINTS / exposed.max(FEWEST);
        found.outline.iter_mut().for_each(|row| row.weight *= share);
        Some(found)
    }
}

/// Returns the derivatives of a value by an ellipsoid and by a motion of the object, from that by
/// a point of the ellipsoid's rim.
fn derivative(part: &Part, rim: &Vector3<f64>, by_rim: &Vector3<f64>) -> SVector<f64, 15> {
    let axes = part.axes();
    let (own, by_own) = (axes.tr_mul(&(rim - part.center)), axes.tr_mul(by_rim));
    let mut by_part = Change::zeros();
    by_part.fixed_rows_mut::<3>(0).copy_from(by_rim);
    by_part.fixed_rows_mut::<3>(3).copy_from(&own.component_mul(&by_own));
    by_part.fixed_rows_mut::<3>(6).copy_from(&own.cross(&by_own));
    let mut by_motion = Vector6::zeros();
    by_motion.fixed_rows_mut::<3>(0).copy_from(by_rim);
    by_motion.fixed_rows_mut::<3>(3).copy_from(&rim.cross(by_rim));
    let mut all = SVector::<f64, 15>::zeros();
    all.fixed_rows_mut::<9>(0).copy_from(&by_part);
    all.fixed_rows_mut::<6>(9).copy_from(&by_motion);
    all
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::fitness::contour;
    use crate::pose::Twist;

    pub(in super::super) const RADIUS: f64 = 0.07;

    /// A body with arms to several sides.
    pub(in super::super) fn toy() -> Vec<Part> {
        let part = |center: [f64; 3], radii: [f64; 3], turn: f64| {
            let turn = Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.2, turn, 0.4)).rotation();
            let log_radii = Vector3::from(radii).map(libm::log);
            Part { center: center.into(), log_radii, rotation: turn }
        };
        vec![
            part([0.0, 0.0, 0.0], [0.03, 0.05, 0.025], 0.0),
            part([0.03, -0.02, -0.02], [0.035, 0.012, 0.012], 0.5),
            part([-0.02, 0.02, -0.03], [0.012, 0.014, 0.03], -0.3),
        ]
    }

    /// Returns what two cameras see of a body at a keyframe.
    pub(in super::super) fn seen(parts: &[Part], keyframe: usize, pose: &Pose) -> Vec<View> {
        let camera = Camera::new([640, 480], [690.0; 2], [319.5, 239.5]).unwrap();
        let quadrics: Vec<_> = parts.iter().map(Part::quadric).collect();
        let eye = |right: f64| {
            let eye = Pose::exp(&Twist::new(right, 0.0, 0.0, 0.0, -1.8 * right, 0.0));
            let world = Projection::new(&camera, &eye);
            let (mut outlines, mut places) = (Vec::new(), Vec::new());
            contour(&world.moved(pose), &quadrics, 5.0, &mut outlines, &mut places);
            let points = places.iter().map(|place| (place.pixel, place.normal)).collect();
            View { keyframe, world, look: Look { points } }
        };
        vec![eye(0.0), eye(0.1)]
    }

    fn pose() -> Pose {
        Pose::exp(&Twist::new(0.01, -0.01, 0.5, 0.1, 0.2, -0.1))
    }

    #[test]
    fn a_body_has_no_distance_from_its_own_boundary() {
        for view in seen(&toy(), 0, &pose()) {
            let found = view.distances(&toy(), &pose(), false).unwrap();
            let off = |row: &Row| row.off_px.abs();
            assert!(found.boundary.iter().map(off).fold(0.0, f64::max) < 1e-6);
            // In a corner between two ellipsoids the nearest point may be the other's.
            let weights = found.outline.iter().map(|row| row.weight).sum::<f64>();
            let sum = found.outline.iter().map(|row| row.weight * off(row)).sum::<f64>();
            assert!(sum < 0.3 * weights, "{} px", sum / weights);
        }
    }

    #[test]
    fn distances_change_with_body_and_pose_as_their_derivatives_say() {
        let view = &seen(&toy(), 0, &pose())[1];
        for at in 0..15 {
            let near = |by: f64| {
                let mut parts = toy();
                let mut change = SVector::<f64, 15>::zeros();
                change[at] = by;
                parts[1] = parts[1].moved(&change.fixed_rows::<9>(0).into_owned());
                let pose = pose() * Pose::exp(&change.fixed_rows::<6>(9).into_owned());
                view.distances(&parts, &pose, true).unwrap().boundary
            };
            let (less, here, more) = (near(-1e-5), near(0.0), near(1e-5));
            for ((less, here), more) in less.iter().zip(&here).zip(&more) {
                let is_same = less.part == here.part && more.part == here.part;
                if is_same && (here.part == 1 || at > 8) {
                    let slope = (more.off_px - less.off_px) / 2e-5;
                    let (expected, size) = (here.slope[at], here.slope.amax());
                    assert!((slope - expected).abs() < 1e-3 * size, "{at}: {slope} {expected}");
                }
            }
        }
    }
}
