//! Laws of surface points, on a plane with a smooth pattern.

use nalgebra::{Matrix2x3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;
use servoid::camera::{Camera, Channels, ImageView, Pyramid};
use servoid::fitness::SurfacePoint;
use servoid::pose::{Pose, Twist};
use servoid::shape::{Outline, Projection};

const SIZE: [usize; 2] = [160, 120];

fn camera() -> Camera {
    Camera::new(SIZE, [200.0; 2], [79.5, 59.5]).unwrap()
}

fn projection() -> Projection {
    Projection::new(&camera(), &Pose::identity())
}

/// Brightness of the plane z = 1, 0 to 100: waves of 11 to 40 pixels in all directions.
fn pattern(x: f64, y: f64) -> f64 {
    let waves = [(0.5, 0.1, 0.0), (-0.2, 0.45, 1.0), (0.3, -0.35, 2.0), (0.1, 0.13, 0.5)];
    let sum: f64 = waves.iter().map(|(a, b, c)| (200.0 * (a * x + b * y) + c).sin()).sum();
    50.0 + 12.0 * sum
}

/// The camera's image of the plane, shifted by a number of pixels.
fn picture([right, down]: [f64; 2], light: impl Fn(f64) -> f64) -> Vec<u8> {
    let mut pixels = Vec::with_capacity(SIZE[0] * SIZE[1]);
    for v in 0..SIZE[1] {
        for u in 0..SIZE[0] {
            let ray = camera().ray([u as f64 - right, v as f64 - down]);
            pixels.push(light(pattern(ray.x, ray.y).round()) as u8);
        }
    }
    pixels
}

fn pyramid(pixels: &[u8]) -> Pyramid {
    let mut pyramid = Pyramid::default();
    pyramid.read(&ImageView::new(pixels, SIZE, Channels::Grey).unwrap(), [0, 0], SIZE);
    pyramid
}

fn learned(pixel: [f64; 2], reach_px: f64) -> Option<SurfacePoint> {
    let place = camera().ray(pixel);
    let back = -Vector3::z();
    let seen = pyramid(&picture([0.0, 0.0], |x| x));
    SurfacePoint::extract(&projection(), &seen, [place, back, -place.normalize()], (1.0, reach_px))
}

fn places() -> impl Strategy<Value = [f64; 2]> {
    (40.0..120.0, 40.0..80.0).prop_map(|(u, v)| [u, v])
}

/// Returns the distance in pixels at which four steps end from a shift of the image; `None` where
/// the pattern has no corner, so that a shift along its bands changes nothing.
fn left_after_steps(place: [f64; 2], shift: Vector2<f64>, level: usize) -> Option<f64> {
    let point = learned(place, 100.0)?;
    let moved = pyramid(&picture([shift.x, shift.y], |x| 2.0 * x + 13.0));
    let tensor = point.agreement(&projection(), &moved, level)?.tensor;
    if tensor.symmetric_eigenvalues().min() < 0.02 {
        return None;
    }
    let mut found = Vector2::<f64>::zeros();
    for _ in 0..4 {
        let here = projection().shifted([-found.x, -found.y]);
        let agreement = point.agreement(&here, &moved, level)?;
        found += agreement.tensor.try_inverse()? * agreement.pull;
    }
    Some((found - shift).norm())
}

#[test]
fn steps_of_gauss_and_newton_find_a_small_shift() {
    let shifts = [(0.35, 0.1), (-0.3, 0.25), (0.05, -0.4), (-0.2, -0.2)];
    for level in 0..2 {
        let mut left: Vec<f64> = (0..40)
            .flat_map(|at| shifts.map(|shift| (at, shift)))
            .filter_map(|(at, (right, down))| {
                let place = [44.0 + 9.3 * f64::from(at % 8), 42.0 + 7.1 * f64::from(at / 8)];
                left_after_steps(place, Vector2::new(right, down), level)
            })
            .collect();
        assert!(left.len() > 40, "{}", left.len());
        left.sort_by(f64::total_cmp);
        let (middle, most) = (left[left.len() / 2], left[left.len() - 1]);
        assert!(middle < 0.03 && most < 0.15, "level {level}: {middle}, at most {most}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(40) })]

    #[test]
    fn a_point_agrees_wholly_with_the_image_it_was_learned_in(place in places()) {
        let point = learned(place, 100.0).unwrap();
        let seen = pyramid(&picture([0.0, 0.0], |x| x));
        for level in 0..Pyramid::LEVELS {
            let one = point.correlation(&projection(), &seen, level).unwrap();
            prop_assert!((one - 1.0).abs() < 1e-5, "{level}: {one}");
            let agreement = point.agreement(&projection(), &seen, level).unwrap();
            prop_assert!((agreement.correlation - 1.0).abs() < 1e-5);
            prop_assert!((agreement.pixel - Vector2::from(place)).norm() < 1e-9);
            prop_assert!(agreement.pull.norm() < 1e-5, "{:?}", agreement.pull);
        }
    }

    #[test]
    fn brightness_and_contrast_change_nothing(place in places()) {
        let point = learned(place, 100.0).unwrap();
        let brighter = pyramid(&picture([0.0, 0.0], |x| 2.0 * x + 13.0));
        for level in 0..Pyramid::LEVELS {
            let one = point.correlation(&projection(), &brighter, level).unwrap();
            prop_assert!((one - 1.0).abs() < 1e-5, "{level}: {one}");
        }
        let negative = pyramid(&picture([0.0, 0.0], |x| 200.0 - x));
        let minus = point.correlation(&projection(), &negative, 0).unwrap();
        prop_assert!((minus + 1.0).abs() < 1e-5, "{minus}");
    }

    #[test]
    fn the_pixel_and_its_slope_are_those_of_the_projection(
        place in places(), twist in prop::array::uniform6(-0.05..0.05_f64),
    ) {
        let point = learned(place, 100.0).unwrap();
        let seen = pyramid(&picture([0.0, 0.0], |x| x));
        let moved = projection().moved(&Pose::exp(&Twist::from(twist)));
        if let Some(found) = point.agreement(&moved, &seen, 0) {
            let (pixel, slope) = moved.pixel(&point.position).unwrap();
            prop_assert_eq!(found.pixel, pixel);
            prop_assert_eq!(found.slope, slope);
        }
    }

    #[test]
    fn the_tensor_is_never_negative(pixels in prop::collection::vec(any::<u8>(), 160 * 120)) {
        let point = learned([80.0, 60.0], 100.0).unwrap();
        let seen = pyramid(&pixels);
        for level in 0..Pyramid::LEVELS {
            let found = point.agreement(&projection(), &seen, level).unwrap();
            let t = found.tensor;
            prop_assert_eq!(t[(0, 1)], t[(1, 0)]);
            prop_assert!(t[(0, 0)] >= 0.0 && t[(1, 1)] >= 0.0);
            prop_assert!(t.determinant() >= -1e-9 * t.trace() * t.trace());
            prop_assert!(found.correlation.abs() < 1.0 + 1e-5);
        }
    }

    #[test]
    fn a_patch_that_is_not_wholly_inside_gives_no_agreement(
        u in -50.0..210.0_f64, v in -50.0..170.0_f64,
    ) {
        let mut point = learned([80.0, 60.0], 100.0).unwrap();
        point.position = camera().ray([u, v]);
        let seen = pyramid(&picture([0.0, 0.0], |x| x));
        // Samples of the finest patch lie up to three pixels from its centre.
        let inside = (3.0..156.0).contains(&u) && (3.0..116.0).contains(&v);
        prop_assert_eq!(point.correlation(&projection(), &seen, 0).is_some(), inside);
        prop_assert_eq!(point.agreement(&projection(), &seen, 0).is_some(), inside);
    }

    #[test]
    fn the_slope_of_a_pixel_is_its_finite_difference(
        twist in prop::array::uniform6(-1.0..1.0_f64), p in prop::array::uniform3(-0.5..0.5_f64),
    ) {
        let moved = projection().moved(&Pose::exp(&Twist::from(twist)));
        let point = Vector3::from(p);
        prop_assume!(moved.apply(&point).z > 0.2);
        let (_, slope) = moved.pixel(&point).unwrap();
        let step = 1e-6;
        let column = |axis: usize| {
            let by = Vector3::ith(axis, step);
            (moved.pixel(&(point + by)).unwrap().0 - moved.pixel(&(point - by)).unwrap().0)
                / (2.0 * step)
        };
        let expected = Matrix2x3::from_columns(&[column(0), column(1), column(2)]);
        prop_assert!((slope - expected).amax() < 1e-4 * (1.0 + slope.amax()));
    }

    #[test]
    fn to_see_a_moved_object_is_to_see_its_moved_points(
        eye in prop::array::uniform6(-1.0..1.0_f64), object in prop::array::uniform6(-1.0..1.0_f64),
        p in prop::array::uniform3(-0.5..0.5_f64), first in prop::array::uniform2(0.0..90.0_f64),
    ) {
        let (eye, object) = (Pose::exp(&Twist::from(eye)), Pose::exp(&Twist::from(object)));
        let (seen, point) = (Projection::new(&camera(), &eye), Vector3::from(p));
        let there = seen.apply(&object.transform(&point));
        prop_assert!((seen.moved(&object).apply(&point) - there).norm() < 1e-9);
        // Two successive motions are their product; moving the camera is moving the world by the
        // inverse.
        let twice = seen.moved(&object).moved(&eye).apply(&point);
        prop_assert!((seen.moved(&(object * eye)).apply(&point) - twice).norm() < 1e-9);
        let turned = Projection::new(&camera(), &(object.inverse() * eye)).apply(&point);
        prop_assert!((seen.moved(&object).apply(&point) - turned).norm() < 1e-9);
        if let Some((pixel, slope)) = seen.pixel(&point) {
            let (shifted, same) = seen.shifted(first).pixel(&point).unwrap();
            prop_assert!((shifted + Vector2::from(first) - pixel).norm() < 1e-6 * pixel.norm());
            prop_assert!((same - slope).amax() < 1e-6 * (1.0 + slope.amax()));
        }
    }

    #[test]
    fn an_outline_contains_what_its_rows_hold_and_grows_by_pixels(
        size in prop::array::uniform2(2.0..30.0_f64), slope in -1.0..1.0_f64,
        u in -40.0..40.0_f64, v in -40.0..40.0_f64, by in 0.5..5.0_f64,
    ) {
        let outline = Outline {
            center_u: 3.0, center_v: -2.0, slope, half_width: size[0], half_height: size[1],
        };
        let held = outline.interval(v).is_some_and(|(a, b)| a < u && u < b);
        let pixel = Vector2::new(u, v);
        prop_assert_eq!(outline.contains(&pixel), held);
        let away = pixel - outline.center_px();
        let inverse = outline.covariance_px().try_inverse().unwrap();
        prop_assert_eq!(away.dot(&(inverse * away)) < 1.0, held);
        let (larger, smaller) = (outline.grown(by), outline.grown(-by));
        prop_assert!(!held || larger.contains(&pixel));
        prop_assert!(held || !smaller.contains(&pixel));
        prop_assert!((larger.half_height - outline.half_height - by).abs() < 1e-12);
        prop_assert!(smaller.half_width > 0.0 && smaller.half_height > 0.0);
    }
}

#[test]
fn a_point_follows_a_plane_that_turns_and_comes_nearer() {
    // The camera moves and sees the same plane: the patch is read where the plane is now.
    let turn = UnitQuaternion::from_euler_angles(0.15, -0.2, 0.4);
    let world_from_camera = Pose::from_rotation(turn, Vector3::new(0.1, 0.1, 0.25));
    let mut pixels = Vec::new();
    for v in 0..SIZE[1] {
        for u in 0..SIZE[0] {
            let ray = turn * camera().ray([u as f64, v as f64]);
            let eye = world_from_camera.translation();
            let place = eye + ray * ((1.0 - eye.z) / ray.z);
            pixels.push(pattern(place.x, place.y) as u8);
        }
    }
    let seen = pyramid(&pixels);
    let there = Projection::new(&camera(), &world_from_camera);
    let mut compared = 0;
    for at in 0..40 {
        let place = [45.0 + f64::from(at % 8) * 9.0, 42.0 + f64::from(at / 8) * 9.0];
        let point = learned(place, 100.0).unwrap();
        if let Some(found) = point.agreement(&there, &seen, 0) {
            compared += 1;
            assert!(found.correlation > 0.98, "{place:?}: {}", found.correlation);
        }
    }
    assert!(compared > 10, "{compared}");
}

#[test]
fn no_point_is_learned_from_a_plain_surface_or_one_seen_edge_on() {
    let (place, back) = (camera().ray([80.0, 60.0]), -Vector3::z());
    let plain = pyramid(&vec![90; SIZE[0] * SIZE[1]]);
    let found = SurfacePoint::extract(&projection(), &plain, [place, back, back], (1.0, 100.0));
    assert_eq!(found, None);
    let seen = pyramid(&picture([0.0, 0.0], |x| x));
    let edge = place.cross(&Vector3::x()).normalize();
    let found = SurfacePoint::extract(&projection(), &seen, [place, edge, back], (1.0, 100.0));
    assert_eq!(found, None);
}

#[test]
fn a_point_near_the_rim_is_learned_only_at_the_resolutions_that_fit() {
    let levels =
        |reach| learned([80.0, 60.0], reach).map(|p| p.templates.map(|look| look.is_some()));
    assert_eq!(levels(100.0), Some([true, true, true]));
    assert_eq!(levels(10.0), Some([true, true, false]));
    assert_eq!(levels(5.0), Some([true, false, false]));
    assert_eq!(levels(3.0), None);
}
