//! How unlike its mirror image the boundary of an object is: the rays through that of a body of
//! revolution are their own mirror image about the plane through the camera and its axis, from wherever
//! it is seen, so that no outline tells its spin, however a guess of the body fits.

use std::f64::consts::PI;

use nalgebra::{Rotation3, Vector2, Vector3};

use super::residuals::View;

/// Angles of the axis that are tried, and places on either side of the middle, in radii.
const ANGLES: usize = 24;
const PLACES: (i32, f64) = (2, 0.06);
/// Points that are mirrored first and in the end, at most, and the number of axes that are refined.
const MIRRORED: (usize, usize) = (24, 60);
const REFINED: usize = 2;
/// Rounds in which an axis is refined, from half of the steps above, and the factor of the steps of the
/// next one.
const ROUNDS: usize = 9;
const FINER: f64 = 0.6;
/// Share of the points whose distances count: where the surroundings have the object's colours, a bite
/// is missing.
const COUNTED: f64 = 0.8;
/// Distance of neighbours along the boundary, compared with the usual distance of the nearest.
const NEIGHBOURS: f64 = 2.2;

/// A boundary as rays show it, on the plane that faces its middle, in radii of the object.
struct Boundary {
    points: Vec<Vector2<f64>>,
    /// Of each point, those beside it.
    neighbours: Vec<Vec<usize>>,
}

/// An axis: its angle, and how far it is from the middle.
#[derive(Clone, Copy)]
struct Axis {
    angle: f64,
    off: f64,
}

/// Returns the direction across an axis of an angle.
fn across(angle: f64) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(angle);
    Vector2::new(-sin, cos)
}

fn mean(points: &[Vector2<f64>]) -> Vector2<f64> {
    points.iter().sum::<Vector2<f64>>() / points.len().max(1) as f64
}

/// Returns how far points are from their middle, on average.
fn spread(points: &[Vector2<f64>]) -> f64 {
    let middle = mean(points);
    points.iter().map(|one| (one - middle).norm()).sum::<f64>() / points.len().max(1) as f64
}

impl Boundary {
    /// Returns the boundary of a view in which a radius of the object has a length in pixels; none if
    /// it has no extent.
    fn new(view: &View, radius_px: f64) -> Option<Self> {
        let back = view.world.linear.try_inverse()?;
        let pixels: Vec<_> = view.look.points.iter().map(|(pixel, _)| *pixel).collect();
        let rays = pixels.iter().map(|at| (back * Vector3::new(at.x, at.y, 1.0)).normalize());
        let rays: Vec<_> = rays.collect();
        let ahead = rays.iter().sum::<Vector3<f64>>();
        let facing = Rotation3::rotation_between(&ahead, &Vector3::z())?;
        let onto = |ray: &Vector3<f64>| {
            let ray = facing * ray;
            (ray.z > 0.0).then(|| ray.xy() / ray.z)
        };
        let points: Vec<_> = rays.iter().map(onto).collect::<Option<_>>()?;
        let scale = spread(&pixels) / (spread(&points) * radius_px);
        Self::of(points.iter().map(|point| point * scale).collect())
    }

    fn of(points: Vec<Vector2<f64>>) -> Option<Self> {
        let away = |one: usize, other: usize| (points[one] - points[other]).norm();
        let others = |one: usize| (0..points.len()).filter(move |other| *other != one);
        let nearest =
            |one: usize| others(one).map(|other| away(one, other)).fold(f64::INFINITY, f64::min);
        let mut steps: Vec<_> = (0..points.len()).map(nearest).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let step = *steps.get(steps.len() / 2)?;
        let beside = |one: usize| {
            others(one).filter(|other| away(one, *other) < NEIGHBOURS * step).collect()
        };
        let neighbours = (0..points.len()).map(beside).collect();
        step.is_finite().then_some(Self { points, neighbours })
    }

    /// Returns the squared distance of a point from the boundary.
    fn away(&self, point: &Vector2<f64>) -> f64 {
        let squares = self.points.iter().map(|one| (point - one).norm_squared()).enumerate();
        let Some((at, nearest)) = squares.min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return f64::INFINITY;
        };
        let from = self.points[at];
        let beside = self.neighbours[at].iter().map(|&next| {
            let way = self.points[next] - from;
            let part = ((point - from).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            (point - from - way * part).norm_squared()
        });
        beside.fold(nearest, f64::min)
    }

    /// Returns the distance of some mirrored points from the boundary, rms.
    fn unlike(&self, axis: &Axis, points: usize) -> f64 {
        let normal = across(axis.angle);
        let mirrored =
            |point: &Vector2<f64>| point - normal * (2.0 * (normal.dot(point) - axis.off));
        let some = self.points.iter().step_by(self.points.len().div_ceil(points));
        let mut squares: Vec<_> = some.map(|point| self.away(&mirrored(point))).collect();
        squares.sort_unstable_by(f64::total_cmp);
        squares.truncate((COUNTED * squares.len() as f64) as usize);
        (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
    }

    /// Returns where the middle of the boundary is across an axis of an angle.
    fn middle(&self, angle: f64) -> f64 {
        let normal = across(angle);
        let places = self.points.iter().map(|point| normal.dot(point));
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (least, most) = places.fold(ends, |(a, b), at| (a.min(at), b.max(at)));
        0.5 * (least + most)
    }

    /// Refines an axis; returns how unlike its mirror image the boundary is about it.
    fn refined(&self, mut axis: Axis) -> f64 {
        let mut least = self.unlike(&axis, MIRRORED.1);
        let (mut turn, mut shift) = (0.5 * PI / ANGLES as f64, 0.5 * PLACES.1);
        for _ in 0..ROUNDS {
            for (angle, off) in [(turn, 0.0), (-turn, 0.0), (0.0, shift), (0.0, -shift)] {
                let tried = Axis { angle: axis.angle + angle, off: axis.off + off };
                let unlike = self.unlike(&tried, MIRRORED.1);
                if unlike < least {
                    (least, axis) = (unlike, tried);
                }
            }
            (turn, shift) = (FINER * turn, FINER * shift);
        }
        least
    }
}

/// Returns how far the boundary of a view is from its mirror image about the axis that suits it best,
/// rms without the farthest points, in radii of the object, of which one has a length in pixels.
pub(super) fn unlike_mirrored(view: &View, radius_px: f64) -> Option<f64> {
    let boundary = Boundary::new(view, radius_px)?;
    let tried = (0..ANGLES).flat_map(|step| {
        let angle = PI * step as f64 / ANGLES as f64;
        let middle = boundary.middle(angle);
        (-PLACES.0..=PLACES.0)
            .map(move |place| Axis { angle, off: middle + PLACES.1 * f64::from(place) })
    });
    let mut tried: Vec<_> = tried.map(|axis| (boundary.unlike(&axis, MIRRORED.0), axis)).collect();
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let best = tried.iter().take(REFINED).map(|(_, axis)| boundary.refined(*axis));
    best.min_by(f64::total_cmp)
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;
    use proptest::prelude::*;

    use super::super::residuals::tests::{RADIUS, seen, toy};
    use super::super::shape::Part;
    use super::*;
    use crate::pose::{Pose, Twist};

    /// Returns balls and spheroids about the axis y: a body of revolution.
    fn revolved(sizes: &[(f64, f64, f64)]) -> Vec<Part> {
        let part = |&(at, across, along): &(f64, f64, f64)| Part {
            center: Vector3::new(0.0, at, 0.0) * RADIUS,
            log_radii: (Vector3::new(across, along, across) * RADIUS).map(libm::log),
            rotation: UnitQuaternion::identity(),
        };
        sizes.iter().map(part).collect()
    }

    fn least(parts: &[Part], pose: &Pose) -> f64 {
        let unlike = |view: &View| {
            let radius_px = view.radius_px(pose, RADIUS).unwrap();
            unlike_mirrored(view, radius_px).unwrap()
        };
        seen(parts, 0, pose).iter().map(unlike).fold(f64::INFINITY, f64::min)
    }

    fn poses() -> impl Strategy<Value = Pose> {
        let place = (-0.12..0.12_f64, -0.09..0.09_f64, 0.4..0.8_f64);
        (place, prop::array::uniform3(-1.8..1.8_f64)).prop_map(|((x, y, z), [a, b, c])| {
            let turn = Pose::exp(&Twist::new(0.0, 0.0, 0.0, a, b, c));
            Pose::from_rotation(turn.rotation(), Vector3::new(x, y, z))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn the_boundary_of_a_body_of_revolution_is_its_own_mirror_image_wherever_it_is_seen(
            pose in poses(),
            (belly, neck, up) in (0.3..0.7_f64, 0.15..0.3_f64, 0.3..0.6_f64),
        ) {
            let body = revolved(&[(-0.2, belly, 0.5), (up, neck, 0.4)]);
            let unlike = least(&body, &pose);
            prop_assert!(unlike < 0.006, "{unlike}");
        }
    }

    #[test]
    fn the_boundary_of_a_body_with_arms_on_several_sides_is_unlike_its_mirror_image() {
        for turn in [0.0, 0.6, 1.2, 1.8, 2.4] {
            let pose = Pose::exp(&Twist::new(0.02, -0.01, 0.5, 0.0, 0.0, 0.0))
                * Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.1, turn, 0.2));
            let unlike = least(&toy(), &pose);
            assert!(unlike > 0.02, "{turn}: {unlike}");
        }
    }

    #[test]
    fn a_bite_out_of_a_boundary_is_no_difference_from_its_mirror_image() {
        let pose = Pose::exp(&Twist::new(0.02, -0.01, 0.5, 0.1, 0.0, 0.4));
        let body = revolved(&[(-0.2, 0.5, 0.6), (0.5, 0.2, 0.4)]);
        for mut view in seen(&body, 0, &pose) {
            let radius_px = view.radius_px(&pose, RADIUS).unwrap();
            let count = view.look.points.len();
            let middle = mean(&view.look.points.iter().map(|one| one.0).collect::<Vec<_>>());
            for (pixel, _) in &mut view.look.points[..count / 12] {
                *pixel += (middle - *pixel) * 0.3;
            }
            let unlike = unlike_mirrored(&view, radius_px).unwrap();
            assert!(unlike < 0.008, "{unlike}");
        }
    }
}
