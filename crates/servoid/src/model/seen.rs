use nalgebra::Vector3;
use rayon::prelude::*;

use crate::fitness::Sight;
use crate::observe::View;
use crate::shape::{Body, Ellipsoid};

/// How much of a body's surface was seen.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Share of each ellipsoid's exposed surface; 1 for one that other ellipsoids hide wholly.
    pub by_ellipsoid: Vec<f64>,
    /// Share of the whole surface.
    pub share: f64,
    /// Unit vector, in the object's frame, to the side that was not seen; `None` if all of it was.
    pub unseen_toward: Option<[f64; 3]>,
}

/// Places on each ellipsoid at which it is asked what was seen.
const PLACES: usize = 240;
/// A surface counts as seen if a point was seen within this share of the body's size.
const NEAR: f64 = 0.12;

/// A place on the body's surface.
struct Place {
    point: Vector3<f64>,
    normal: Vector3<f64>,
    area: f64,
}

/// Says how much of a body's surface a camera or a line of sight has seen.
///
/// A place is seen by a camera in front of it if its projection lies in the image and no other part
/// of the body is in between.
#[must_use]
pub fn seen(body: &Body, views: &[View<'_>], sights: &[Sight]) -> Seen {
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
                let near = |sight: &Sight| {
                    (sight.point - place.point).norm() < NEAR * size
                        && sight.direction.dot(&place.normal) < 0.0
                };
                let seen = by_view || sights.iter().any(near);
                (place, seen)
            })
            .collect()
    };
    let parts: Vec<Vec<(Place, bool)>> =
        (0..ellipsoids.len()).into_par_iter().map(of_one).collect();
    let share = |places: &mut dyn Iterator<Item = &(Place, bool)>| {
        let (mut seen, mut all) = (0.0, 0.0);
        for (place, is_seen) in places {
            all += place.area;
            seen += if *is_seen { place.area } else { 0.0 };
        }
        if all > 0.0 { seen / all } else { 1.0 }
    };
    let hidden = parts.iter().flatten().filter(|(_, is_seen)| !is_seen);
    let toward: Vector3<f64> = hidden.map(|(place, _)| place.normal * place.area).sum();
    let object_from_world = body.world_from_object().inverse();
    let toward = toward.try_normalize(f64::MIN_POSITIVE);
    Seen {
        by_ellipsoid: parts.iter().map(|part| share(&mut part.iter())).collect(),
        share: share(&mut parts.iter().flatten()),
        unseen_toward: toward.map(|v| (object_from_world.rotation() * v).into()),
    }
}

/// Spreads places over an ellipsoid, each with the area it stands for.
fn places(ellipsoid: &Ellipsoid) -> Vec<Place> {
    let factor = ellipsoid.factor();
    // Radii are positive, so that the factor has an inverse.
    let turned = factor.try_inverse().unwrap_or_default().transpose();
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let place = |i: usize| {
        let height = 1.0 - 2.0 * (i as f64 + 0.5) / PLACES as f64;
        let (ring, angle) = ((1.0 - height * height).sqrt(), golden * i as f64);
        let unit = Vector3::new(ring * angle.cos(), ring * angle.sin(), height);
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
        && !others.iter().any(|other| other.meets(&place.point, &eye))
}
