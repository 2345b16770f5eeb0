//! Laws of the lines along which a boundary is located.

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use proptest::prelude::*;
use servoid::camera::Camera;
use servoid::fitness::{ContourPoint, boundary, contour};
use servoid::pose::{Pose, Twist};
use servoid::shape::{Outline, Projection, Quadric};

fn projection() -> Projection {
    let camera = Camera::new([320, 240], [300.0, 290.0], [158.0, 121.0]).unwrap();
    Projection::new(&camera, &Pose::identity())
}

/// Completely in front of the camera and not flat.
fn solids() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.15..0.15), prop::array::uniform9(-0.03..0.03), 0.8..1.2).prop_map(
        |(c, f, z)| Quadric {
            center: Vector3::new(c[0], c[1], z),
            factor: Matrix3::from_column_slice(&f) + Matrix3::identity() * 0.08,
        },
    )
}

fn points_of(quadrics: &[Quadric], spacing_px: f64) -> Vec<ContourPoint> {
    let (mut outlines, mut points) = (vec![], vec![]);
    contour(&projection(), quadrics, spacing_px, &mut outlines, &mut points);
    points
}

/// Returns the reach of an outline along a direction.
fn reach(outline: &Outline, normal: &Vector2<f64>) -> f64 {
    let spread = normal.dot(&(outline.covariance_px() * normal));
    normal.dot(&outline.center_px()) + spread.sqrt()
}

fn moved(quadric: &Quadric, motion: &Pose) -> Quadric {
    let turn = motion.rotation_matrix();
    Quadric { center: motion.transform(&quadric.center), factor: turn * quadric.factor }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(60) })]

    #[test]
    fn lines_stand_on_the_outline_of_the_union(
        body in prop::collection::vec(solids(), 1..5),
    ) {
        let outlines: Vec<_> = body.iter().filter_map(|q| projection().outline(q)).collect();
        prop_assert_eq!(outlines.len(), body.len());
        let points = points_of(&body, 8.0);
        for point in &points {
            prop_assert!((point.normal.norm() - 1.0).abs() < 1e-9);
            let (inside, outside) =
                (point.pixel - point.normal * 1e-3, point.pixel + point.normal * 1e-3);
            prop_assert!(outlines.iter().any(|o| o.contains(&inside)));
            prop_assert!(!outlines.iter().any(|o| o.grown(-0.01).contains(&outside)), "{point:?}");
            // The normal is perpendicular to the tangent: nothing of its ellipse reaches further.
            let far = outlines.iter().map(|o| (reach(o, &point.normal) - point.normal.dot(&point.pixel)).abs());
            prop_assert!(far.fold(f64::INFINITY, f64::min) < 1e-6);
        }
    }

    #[test]
    fn lines_lie_all_around_one_ellipsoid_about_as_dense_as_asked(
        solid in solids(), spacing in 3.0..12.0_f64,
    ) {
        let points = points_of(&[solid], spacing);
        let next = points.iter().cycle().skip(1);
        let gaps: Vec<f64> =
            points.iter().zip(next).map(|(a, b)| (a.pixel - b.pixel).norm()).collect();
        let around: f64 = gaps.iter().sum();
        let outline = projection().outline(&solid).unwrap();
        let least = 4.0 * (outline.half_width * outline.half_height).sqrt();
        prop_assert!(around > least, "{around} {least}");
        let most = spacing.max(around / 48.0) * 3.0;
        prop_assert!(gaps.iter().all(|gap| *gap < most), "{gaps:?}");
    }

    #[test]
    fn a_rim_is_a_point_of_the_ellipsoid_that_its_pixel_sees_edge_on(solid in solids()) {
        let inverse = solid.factor.try_inverse().unwrap();
        for point in points_of(&[solid], 8.0) {
            let unit = inverse * (point.rim - solid.center);
            prop_assert!((unit.norm() - 1.0).abs() < 1e-9);
            let (pixel, slope) = projection().pixel(&point.rim).unwrap();
            prop_assert!((pixel - point.pixel).norm() < 1e-6);
            prop_assert_eq!(slope, point.slope);
            // The line of sight, from the origin, lies in the surface's tangent plane.
            let out = inverse.tr_mul(&unit).normalize();
            prop_assert!(out.dot(&point.rim.normalize()).abs() < 1e-9);
        }
    }

    #[test]
    fn the_outline_moves_along_its_normals_as_the_rim_moves(
        solid in solids(), twist in prop::array::uniform6(-1.0..1.0_f64),
    ) {
        let twist = Twist::from(twist);
        let step = 1e-6;
        let at = |by: f64| {
            projection().outline(&moved(&solid, &Pose::exp(&(twist * by)))).unwrap()
        };
        let (before, after) = (at(-step), at(step));
        for point in points_of(&[solid], 8.0) {
            let difference =
                (reach(&after, &point.normal) - reach(&before, &point.normal)) / (2.0 * step);
            let (linear, angular) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
            let way = linear + angular.cross(&point.rim);
            let expected = point.normal.dot(&(point.slope * way));
            prop_assert!((difference - expected).abs() < 1e-3 * (1.0 + expected.abs()));
        }
    }

    #[test]
    fn a_sharp_boundary_is_found_within_half_a_step(
        angle in 0.0..6.3_f64, share in -0.6..0.6_f64, level in 0..3_usize,
    ) {
        let (reach, step) = [(6, 1.0), (8, 1.5), (10, 2.5)][level];
        let normal = Vector2::new(angle.cos(), angle.sin());
        let point = line(normal);
        let at = share * reach as f64 * step;
        let score = |u: f64, v: f64| {
            let out = normal.dot(&(Vector2::new(u, v) - point.pixel));
            Some(if out < at { 2.5 } else { -2.5 })
        };
        let found = boundary(&point, (reach, step), score).unwrap();
        prop_assert!((found.mean_px - at).abs() < 0.51 * step, "{found:?} for {at}");
        prop_assert!(found.variance_px < step * step);
    }

    #[test]
    fn no_likelihood_gives_a_place_beyond_the_line(
        scores in prop::collection::vec(-2.5..2.5_f64, 41), reach in 1..20_usize,
    ) {
        let point = line(Vector2::x());
        let score = |u: f64, _| Some(scores[(u - point.pixel.x).round() as i64 as usize % 41]);
        let found = boundary(&point, (reach, 1.0), score).unwrap();
        let most = reach.min(16) as f64 + 0.5;
        prop_assert!(found.mean_px.abs() <= most);
        prop_assert!((0.0..=most * most).contains(&found.variance_px));
    }
}

fn line(normal: Vector2<f64>) -> ContourPoint {
    let pixel = Vector2::new(100.0, 80.0);
    ContourPoint {
        pixel,
        normal,
        rim: Vector3::z(),
        ellipsoid: 0,
        on_ball: Vector3::z(),
        slope: Matrix2x3::zeros(),
    }
}

#[test]
fn a_likelihood_that_is_the_same_on_both_sides_leaves_the_boundary_where_it_was() {
    let point = line(Vector2::x());
    let score = |u: f64, _: f64| Some(-0.3 * (u - 100.0) + 0.01 * (u - 100.0).powi(3));
    let found = boundary(&point, (6, 1.0), score).unwrap();
    assert!(found.mean_px.abs() < 1e-9, "{found:?}");
    assert!(found.variance_px > 0.0);
}

#[test]
fn where_nothing_is_known_every_place_is_as_likely() {
    let point = line(Vector2::y());
    for (reach, step) in [(6, 1.0), (8, 1.5), (10, 2.5)] {
        let found = boundary(&point, (reach, step), |_, _| Some(0.0)).unwrap();
        let count = 2.0 * reach as f64 + 2.0;
        let even = step * step * (count * count - 1.0) / 12.0;
        assert!(found.mean_px.abs() < 1e-9);
        assert!((found.variance_px - even).abs() < 1e-9, "{found:?} {even}");
    }
}

#[test]
fn a_line_that_leaves_the_image_gives_no_boundary() {
    let point = line(Vector2::x());
    let score = |u: f64, _: f64| (u < 104.5).then_some(1.0);
    assert_eq!(boundary(&point, (6, 1.0), score), None);
    assert!(boundary(&point, (4, 1.0), score).is_some());
}

#[test]
fn an_ellipsoid_that_another_covers_has_no_line() {
    let ball = |z: f64, radius: f64| Quadric {
        center: Vector3::new(0.0, 0.0, z),
        factor: Matrix3::identity() * radius,
    };
    let (both, large) = (points_of(&[ball(1.0, 0.1), ball(1.5, 0.05)], 8.0), ball(1.0, 0.1));
    assert_eq!(both, points_of(&[large], 8.0));
    assert!(points_of(&[ball(-1.0, 0.1)], 8.0).is_empty());
}
