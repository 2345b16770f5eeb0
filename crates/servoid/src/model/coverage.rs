use crate::parallel::*;
use nalgebra::Vector3;

use crate::camera::View;
use crate::fitness::RangeSample;
use crate::pose::even_direction;
use crate::shape::{Body, Ellipsoid};

/// The share of a body's surface that was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Coverage {
    /// Share of each ellipsoid's exposed surface; 1 for an ellipsoid that others hide completely.
    pub by_ellipsoid: Vec<f64>,
    /// Share of the whole surface.
    pub share: f64,
    /// Unit vector, in the object's frame, towards the unseen side; `None` if everything was seen,
    /// or if the unseen parts lie all around.
    pub unseen_toward: Option<[f64; 3]>,
}

/// Sample positions on each ellipsoid.
const PLACES: usize = 240;
/// A position counts as seen if a point was measured within this share of the body's size.
const NEAR: f64 = 0.12;
/// Length of the mean normal of the unseen surface, 0 to 1, below which it lies on no particular
/// side. It is 0.5 for half a ball, and 0 for opposite sides.
const LEAST_LEAN: f64 = 0.2;

/// A position on the body's surface.
struct Place {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    area: f64,
}

/// Computes how much of a body's surface a camera or a line of sight has seen.
///
/// A position in front of a camera is seen if it projects into the image and no other part of the
/// body is in between.
#[must_use]
pub fn coverage(body: &Body, views: &[View<'_>], samples: &[RangeSample]) -> Coverage {
    let ellipsoids = body.in_world();
    let radius = |e: &Ellipsoid| (e.center() - body.world_from_object().translation()).norm();
    let size = ellipsoids.iter().map(|e| radius(e) + e.radii().max()).fold(0.0, f64::max);
    let of_one = |index: usize| -> Vec<(Place, bool)> {
        let others: Vec<&Ellipsoid> =
            ellipsoids.iter().enumerate().filter(|(i, _)| *i != index).map(|(_, e)| e).collect();
        let places = places(&ellipsoids[index]);
        let exposed = places.into_iter().filter(|p| !others.iter().any(|e| e.contains(&p.point)));
        exposed
            .map(|place| {
                let by_view = views.iter().any(|view| is_seen(&place, view, &others));
                let near = |sample: &RangeSample| {
                    (sample.point - place.point).norm() < NEAR * size
                        && sample.direction.dot(&place.normal) < 0.0
                };
                let seen = by_view || samples.iter().any(near);
                (place, seen)
            })
            .collect()
    };
    let parts: Vec<Vec<(Place, bool)>> =
        (0..ellipsoids.len()).into_par_iter().map(of_one).collect();
    let hidden = parts.iter().flatten().filter(|(_, is_seen)| !is_seen).map(|(place, _)| place);
    let object_from_world = body.world_from_object().inverse();
    Coverage {
        by_ellipsoid: parts.iter().map(share).collect(),
        share: share(parts.iter().flatten()),
        unseen_toward: side_of(hidden).map(|v| (object_from_world.rotation() * v).into()),
    }
}

/// Returns the share of the positions' area that was seen; 1 if there is none.
fn share<'a>(places: impl IntoIterator<Item = &'a (Place, bool)>) -> f64 {
    let (mut seen, mut all) = (0.0, 0.0);
    for (place, is_seen) in places {
        all += place.area;
        seen += if *is_seen { place.area } else { 0.0 };
    }
    if all > 0.0 { seen / all } else { 1.0 }
}

/// Returns the direction of the side on which positions lie, if they lie on one.
fn side_of<'a>(places: impl Iterator<Item = &'a Place>) -> Option<Vector3<f64>> {
    let (mut toward, mut area) = (Vector3::zeros(), 0.0);
    for place in places {
        toward += place.normal * place.area;
        area += place.area;
    }
    toward.try_normalize((LEAST_LEAN * area).max(f64::MIN_POSITIVE))
}

/// Spreads positions over an ellipsoid, each with the area it represents.
fn places(ellipsoid: &Ellipsoid) -> Vec<Place> {
    let factor = ellipsoid.factor();
    // Radii are positive, so the factor has an inverse.
    let turned = factor.try_inverse().unwrap_or_default().transpose();
    let place = |i: usize| {
        let unit = even_direction(i, 1.0 - 2.0 * (i as f64 + 0.5) / PLACES as f64);
        let normal = turned * unit;
        let area = normal.norm() * factor.determinant().abs();
        Place { point: ellipsoid.center() + factor * unit, normal: normal.normalize(), area }
    };
    (0..PLACES).map(place).collect()
}

fn is_seen(place: &Place, view: &View<'_>, others: &[&Ellipsoid]) -> bool {
    let pose = view.world_from_camera();
    let eye = pose.translation();
    let in_image = |pixel: nalgebra::Vector2<f64>| {
        let [width, height] = view.camera().size_px().map(|n| n as f64 - 0.5);
        (-0.5..width).contains(&pixel.x) && (-0.5..height).contains(&pixel.y)
    };
    (eye - place.point).dot(&place.normal) > 0.0
        && view.camera().project(&pose.inverse().transform(&place.point)).is_some_and(in_image)
        && !others.iter().any(|other| other.intersects(&place.point, &eye))
}
