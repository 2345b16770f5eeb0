//! How unlike its mirror image the boundary of an object is: that of a body of revolution is its own
//! mirror image from wherever it is seen, so that no outline tells its spin, however a guess of the body
//! fits.

use std::f64::consts::PI;

use nalgebra::Vector2;

use crate::track::target::look::Look;

/// Angles of the axis that are tried, and places on either side of the middle, as shares of the radius.
const ANGLES: usize = 26;
const PLACES: (i32, f64) = (2, 0.06);
/// Points that are mirrored, at most.
const MIRRORED: usize = 40;
/// Rounds in which the best axis is refined, from the first steps, as shares of those above.
const ROUNDS: usize = 6;
const FINER: f64 = 0.6;

/// A boundary, and some of its points.
struct Boundary {
    all: Vec<Vector2<f64>>,
    some: Vec<Vector2<f64>>,
}

/// An axis: its angle, and how far it is from the origin.
#[derive(Clone, Copy)]
struct Axis {
    angle: f64,
    off_px: f64,
}

/// Returns the direction across an axis of an angle.
fn across(angle: f64) -> Vector2<f64> {
    let (sin, cos) = libm::sincos(angle);
    Vector2::new(-sin, cos)
}

impl Boundary {
    /// Returns the squared distance of mirrored points from the boundary, summed.
    fn unlike(&self, axis: &Axis) -> f64 {
        let normal = across(axis.angle);
        let away = |point: &Vector2<f64>| {
            let mirrored = point - normal * (2.0 * (normal.dot(point) - axis.off_px));
            let each = self.all.iter().map(|one| (one - mirrored).norm_squared());
            each.fold(f64::INFINITY, f64::min)
        };
        self.some.iter().map(away).sum()
    }

    /// Returns where the middle of the boundary is across an axis of an angle.
    fn middle(&self, angle: f64) -> f64 {
        let normal = across(angle);
        let places = self.all.iter().map(|point| normal.dot(point));
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (least, most) = places.fold(ends, |(a, b), at| (a.min(at), b.max(at)));
        0.5 * (least + most)
    }
}

/// Returns how far a boundary is from its mirror image about the axis that suits it best, rms, in radii
/// of the object.
pub(super) fn unlike_mirrored(look: &Look, radius_px: f64) -> f64 {
    let all: Vec<_> = look.points.iter().map(|(point, _)| *point).collect();
    let some: Vec<_> = all.iter().step_by(all.len().div_ceil(MIRRORED)).copied().collect();
    let boundary = Boundary { all, some };
    let angle_step = PI / ANGLES as f64;
    let place_step = PLACES.1 * radius_px;
    let tried = (0..ANGLES).flat_map(|step| {
        let angle = angle_step * step as f64;
        let middle = boundary.middle(angle);
        (-PLACES.0..=PLACES.0)
            .map(move |place| Axis { angle, off_px: middle + place_step * f64::from(place) })
    });
    let tried = tried.map(|axis| (boundary.unlike(&axis), axis));
    let Some((mut least, mut best)) = tried.min_by(|a, b| a.0.total_cmp(&b.0)) else {
        return 0.0;
    };
    let (mut turn, mut shift) = (0.5 * angle_step, 0.5 * place_step);
    for _ in 0..ROUNDS {
        for (angle, off_px) in [(turn, 0.0), (-turn, 0.0), (0.0, shift), (0.0, -shift)] {
            let axis = Axis { angle: best.angle + angle, off_px: best.off_px + off_px };
            let unlike = boundary.unlike(&axis);
            if unlike < least {
                (least, best) = (unlike, axis);
            }
        }
        (turn, shift) = (FINER * turn, FINER * shift);
    }
    (least / boundary.some.len() as f64).sqrt() / radius_px
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const RADIUS_PX: f64 = 60.0;

    /// Returns a boundary by its distance from the middle, in radii, at each angle.
    fn look(away: impl Fn(f64) -> f64, (angle, place): (f64, Vector2<f64>)) -> Look {
        let point = |step: u32| {
            let around = f64::from(step) * (2.0 * PI / 110.0);
            let (sin, cos) = libm::sincos(around + angle);
            let out = Vector2::new(cos, sin);
            (place + out * (RADIUS_PX * away(around)), out)
        };
        Look { points: (0..110).map(point).collect() }
    }

    proptest! {
        #[test]
        fn the_boundary_of_a_body_of_revolution_is_its_own_mirror_image_wherever_it_is_seen(
            (long, belly, neck) in (0.7..1.0_f64, -0.15..0.15_f64, -0.1..0.1_f64),
            place in ((-3.2..3.2_f64), (-90.0..90.0_f64), (-90.0..90.0_f64)),
        ) {
            let away = |angle: f64| {
                let (sin, cos) = libm::sincos(angle);
                long / (long * long * cos * cos + sin * sin).sqrt()
                    * (1.0 + belly * cos + neck * libm::cos(3.0 * angle))
            };
            let at = (place.0, Vector2::new(place.1, place.2));
            let unlike = unlike_mirrored(&look(away, at), RADIUS_PX);
            // The points are 0.06 radii apart.
            prop_assert!(unlike < 0.04, "{unlike}");
        }

        #[test]
        fn a_boundary_with_a_handle_on_one_side_is_unlike_its_mirror_image(
            place in ((-3.2..3.2_f64), (-90.0..90.0_f64), (-90.0..90.0_f64)),
            at in 0.6..1.0_f64,
        ) {
            // On a long body, neither at its end nor at its middle.
            let away = |angle: f64| {
                let (sin, cos) = libm::sincos(angle);
                let handle = 0.45 * libm::exp(-((angle - at) / 0.25).powi(2));
                0.6 / (0.36 * cos * cos + sin * sin).sqrt() + handle
            };
            let seen = (place.0, Vector2::new(place.1, place.2));
            let unlike = unlike_mirrored(&look(away, seen), RADIUS_PX);
            prop_assert!(unlike > 0.06, "{unlike}");
        }
    }
}
