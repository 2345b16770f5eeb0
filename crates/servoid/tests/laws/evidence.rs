//! Laws of the kinds of evidence that bodies are fitted to: solids, measured points, and both
//! together.

use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use servoid::fitness::{
    Differentiable, Evidence, Extent, Fitness, RangeSample, RangeSamples, Total, Volume,
};
use servoid::shape::{Ellipsoid, Grid, Mesh, Quadric, QuadricGradient, Section};

fn quadrics() -> impl Strategy<Value = Quadric> {
    let number = -1.0..1.0_f64;
    (prop::array::uniform3(-0.5..0.5_f64), prop::array::uniform9(number)).prop_map(|(c, f)| {
        let factor = Matrix3::from_row_slice(&f) * 0.25 + Matrix3::identity() * 0.35;
        Quadric { center: c.into(), factor }
    })
}

fn bodies() -> impl Strategy<Value = Vec<Quadric>> {
    prop::collection::vec(quadrics(), 1..4)
}

fn inside(body: &[Quadric], point: &Vector3<f64>) -> bool {
    body.iter().any(|q| {
        let inverse = q.factor.try_inverse().unwrap_or_default();
        (inverse * (point - q.center)).norm_squared() < 1.0
    })
}

fn sphere_grid() -> Grid {
    let (size, pitch) = ([40; 3], 0.06);
    let origin = Vector3::repeat(-19.5 * pitch);
    let share = |i: usize| {
        let at = Vector3::new((i % 40) as f64, (i / 40 % 40) as f64, (i / 1600) as f64);
        ((0.6 - (origin + at * pitch).norm()) / pitch + 0.5).clamp(0.0, 1.0)
    };
    Grid { origin, pitch, size, filled: (0..64_000).map(share).collect() }
}

/// Points of a ball of radius 0.6, seen from far along -z.
fn sphere_samples() -> RangeSamples {
    let place = |i: usize| {
        let (u, v) = (f64::from((i % 21) as u32) - 10.0, f64::from((i / 21) as u32) - 10.0);
        let (x, y) = (u * 0.055, v * 0.055);
        let z = -(0.36 - x * x - y * y).max(0.0).sqrt();
        RangeSample { point: Vector3::new(x, y, z), direction: Vector3::z(), eye: 0.0 }
    };
    let seen = (0..441).map(place).filter(|s| s.point.z < -0.05).collect();
    RangeSamples::new(seen, 0.5, 0.2)
}

fn ball(center: [f64; 3], radius: f64) -> Quadric {
    Quadric { center: center.into(), factor: Matrix3::identity() * radius }
}

fn both() -> Total {
    let mut total = Total::default();
    total.push(2.0, Volume::new(sphere_grid()));
    total.push(1.0, sphere_samples());
    total
}

/// Compares one slope with finite differences, unless the score is not differentiable nearby. At
/// such a point itself, differences with any step agree, as where a pole touches a slice; those
/// ahead and behind do not.
fn slope_holds(
    evidence: &dyn Differentiable,
    body: &[Quadric],
    which: usize,
) -> Result<(), TestCaseError> {
    let moved = |by: f64| {
        let mut body = body.to_vec();
        let q = &mut body[0];
        if which < 3 {
            q.center[which] += by
        } else {
            q.factor[which - 3] += by
        }
        evidence.score(&body)
    };
    let difference = |step: f64| (moved(step) - moved(-step)) / (2.0 * step);
    let (fine, coarse) = (difference(1e-4), difference(3e-4));
    prop_assume!((fine - coarse).abs() < 2e-3);
    let (ahead, behind) = (moved(1e-4) - moved(0.0), moved(0.0) - moved(-1e-4));
    prop_assume!((ahead - behind).abs() < 0.05 * 1e-4);
    let mut slopes = vec![QuadricGradient::default(); body.len()];
    let score = evidence.score_and_gradient(body, &mut slopes);
    prop_assert!((score - evidence.score(body)).abs() < 1e-6);
    let given = if which < 3 { slopes[0].center[which] } else { slopes[0].factor[which - 3] };
    prop_assert!((given - fine).abs() < 0.03 + 0.1 * fine.abs(), "{given} instead of {fine}");
    Ok(())
}

proptest! {
    #[test]
    fn a_section_is_where_points_are_inside(
        q in quadrics(), z in -0.8..0.8_f64, x in -1.0..1.0_f64, y in -1.0..1.0_f64,
    ) {
        prop_assume!(q.bulk() > 1e-3);
        let cut = Section::new(&q).and_then(|section| section.at(z));
        let span = cut.and_then(|cut| cut.interval(y));
        let held = span.is_some_and(|(begin, end)| begin < x && x < end);
        let near = |by: f64| inside(&[q], &Vector3::new(x + by, y, z));
        prop_assume!(near(-1e-6) == near(1e-6));
        prop_assert_eq!(held, near(0.0));
    }

    #[test]
    fn the_agreement_with_a_solid_is_the_share_of_its_points(body in bodies()) {
        let (grid, volume) = (sphere_grid(), Volume::new(sphere_grid()));
        let (mut both, mut either) = (0.0_f64, 0.0_f64);
        for i in 0..64_000_usize {
            let at = Vector3::new((i % 40) as f64, (i / 40 % 40) as f64, (i / 1600) as f64);
            let held = f64::from(u8::from(inside(&body, &(grid.origin + at * grid.pitch))));
            both += held.min(grid.filled[i]);
            either += held.max(grid.filled[i]);
        }
        prop_assume!(body.iter().all(|q| q.bulk() > 0.01));
        let found = volume.score(&body);
        prop_assert!((found - both / either).abs() < 0.04, "{found}, not {}", both / either);
    }

    #[test]
    fn the_agreement_with_seen_points_is_what_steps_along_the_lines_find(body in bodies()) {
        prop_assume!(body.iter().all(|q| q.bulk() > 0.01));
        let (mut both, mut either) = (0, 0);
        for i in 0..441_usize {
            let (x, y) = ((i % 21) as f64 * 0.055 - 0.55, (i / 21) as f64 * 0.055 - 0.55);
            let z = -(0.36 - x * x - y * y).max(0.0).sqrt();
            if z >= -0.05 { continue }
            for step in -500..200 {
                let along = (f64::from(step) + 0.5) * 1e-3;
                let held = inside(&body, &Vector3::new(x, y, z + along));
                let known = step >= 0;
                both += i32::from(held && known);
                either += i32::from(held || known);
            }
        }
        let expected = f64::from(both) / f64::from(either);
        let found = sphere_samples().score(&body);
        prop_assert!((found - expected).abs() < 5e-3, "{found}, not {expected}");
    }

    #[test]
    fn the_gradient_of_a_solid_equals_finite_differences(body in bodies(), which in 0_usize..12) {
        slope_holds(&Volume::new(sphere_grid()), &body, which)?;
    }

    #[test]
    fn the_gradient_of_the_total_is_the_weighted_mean_of_its_parts(body in bodies()) {
        let parts: [(f64, &dyn Differentiable); 2] =
            [(2.0, &Volume::new(sphere_grid())), (1.0, &sphere_samples())];
        let mut expected = vec![QuadricGradient::default(); body.len()];
        let mut slopes = expected.clone();
        let total = both().score_and_gradient(&body, &mut slopes);
        for (weight, part) in parts {
            let mut of_part = vec![QuadricGradient::default(); body.len()];
            let score = part.score_and_gradient(&body, &mut of_part);
            prop_assume!(score > 1e-3);
            for (sum, one) in expected.iter_mut().zip(&of_part) {
                sum.center += one.center * (total / 3.0 * weight / score);
                sum.factor += one.factor * (total / 3.0 * weight / score);
            }
        }
        for (given, expected) in slopes.iter().zip(&expected) {
            let scale = 1e-9 * (1.0 + expected.center.norm() + expected.factor.norm());
            prop_assert!((given.center - expected.center).norm() < scale);
            prop_assert!((given.factor - expected.factor).norm() < scale);
        }
    }

    #[test]
    fn the_total_lies_between_its_parts(body in bodies()) {
        let parts = [Volume::new(sphere_grid()).score(&body), sphere_samples().score(&body)];
        let total = both().score(&body);
        let (low, high) = (parts[0].min(parts[1]).max(1e-4), parts[0].max(parts[1]).max(1e-4));
        prop_assert!(low - 1e-12 <= total && total <= high + 1e-12);
    }

    #[test]
    fn one_more_ellipsoid_gains_what_it_adds_beside_those_that_stand(
        standing in quadrics(), more in quadrics(),
    ) {
        prop_assume!(standing.bulk() > 0.01 && more.bulk() > 0.01);
        let samples = sphere_samples();
        let open = samples.open(&[standing]).score(&[more]);
        let (mut gain, mut lines) = (0.0, 0.0);
        for i in 0..441_usize {
            let (x, y) = ((i % 21) as f64 * 0.055 - 0.55, (i / 21) as f64 * 0.055 - 0.55);
            let z = -(0.36 - x * x - y * y).max(0.0).sqrt();
            if z >= -0.05 { continue }
            lines += 200.0;
            for step in -500..200 {
                let point = Vector3::new(x, y, z + (f64::from(step) + 0.5) * 1e-3);
                if inside(&[more], &point) && !inside(&[standing], &point) {
                    gain += if step < 0 { -1.0 } else { 1.0 };
                }
            }
        }
        prop_assert!((open - gain / lines).abs() < 0.01, "{open}, not {}", gain / lines);
    }
}

#[test]
fn the_right_ball_agrees_best_with_its_solid_and_its_seen_points() {
    let truth = ball([0.0; 3], 0.6);
    let total = both();
    assert!(total.score(&[truth]) > 0.9, "{}", total.score(&[truth]));
    for off in [ball([0.05, 0.0, 0.0], 0.6), ball([0.0, 0.0, 0.05], 0.6), ball([0.0; 3], 0.56)] {
        assert!(total.score(&[off]) < total.score(&[truth]));
    }
}

#[test]
fn doubling_all_weights_changes_nothing_and_a_weight_of_zero_leaves_a_kind_out() {
    let body = [ball([0.1, 0.0, 0.0], 0.5)];
    let mut double = Total::default();
    double.push(4.0, Volume::new(sphere_grid()));
    double.push(2.0, sphere_samples());
    assert!((double.score(&body) - both().score(&body)).abs() < 1e-12);
    let mut alone = Total::default();
    alone.push(3.0, Volume::new(sphere_grid()));
    alone.push(0.0, sphere_samples());
    assert_eq!(alone.score(&body), Volume::new(sphere_grid()).score(&body));
}

fn cube(side: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let corners = (0..8)
        .map(|i| [i >> 2, i >> 1 & 1, i & 1].map(|on| side * f64::from(u8::from(on == 1))))
        .collect();
    let faces = [
        [0, 1, 3],
        [0, 3, 2],
        [4, 6, 7],
        [4, 7, 5],
        [0, 4, 5],
        [0, 5, 1],
        [2, 3, 7],
        [2, 7, 6],
        [0, 2, 6],
        [0, 6, 4],
        [1, 5, 7],
        [1, 7, 3],
    ];
    (corners, faces.to_vec())
}

#[test]
fn a_filled_grid_holds_the_meshs_volume_however_it_is_turned() {
    let (corners, faces) = cube(0.3);
    for angle in [0.0, 0.3, 1.1] {
        let turn = nalgebra::Rotation3::from_euler_angles(angle, 0.7 * angle, -angle);
        let turned = corners.iter().map(|c| (turn * Vector3::from(*c)).into()).collect();
        let mesh = Mesh::new(turned, faces.clone()).unwrap();
        let grid = mesh.fill(40, 2);
        let held = grid.filled.iter().sum::<f64>() * grid.pitch.powi(3);
        assert!((mesh.volume() - 0.027).abs() < 1e-9);
        assert!((held / 0.027 - 1.0).abs() < 0.01, "{angle}: {held}");
    }
}

#[test]
fn a_mesh_that_encloses_nothing_or_is_open_is_refused_with_the_reason() {
    let (corners, faces) = cube(0.3);
    let refusal = |corners: &[[f64; 3]], faces: &[[usize; 3]]| {
        Mesh::new(corners.to_vec(), faces.to_vec()).unwrap_err().to_string()
    };
    assert!(refusal(&corners, &faces[1..]).contains("not closed: 3"));
    let inside_out: Vec<[usize; 3]> = faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    assert!(refusal(&corners, &inside_out).contains("must be positive"));
    let mut broken = corners.clone();
    broken[3][1] = f64::NAN;
    assert!(refusal(&broken, &faces).contains("vertex 3"));
    assert!(refusal(&corners[..7], &faces).contains("has 7 vertices"));
    assert!(refusal(&corners, &[]).contains("volume"));
}

#[test]
fn seen_points_that_are_no_numbers_are_refused_by_index() {
    let points = [[0.0; 3], [f64::NAN, 0.0, 0.0]];
    let error = RangeSample::join(&points, &[[0.0, 0.0, 1.0]; 2]).unwrap_err().to_string();
    assert!(error.contains("point 1"), "{error}");
    assert!(
        RangeSample::join(&points[..1], &[[0.0; 3]]).unwrap_err().to_string().contains("length")
    );
    assert!(RangeSample::join(&points[..1], &[]).unwrap_err().to_string().contains("directions"));
}

#[test]
fn a_line_meets_an_ellipsoid_that_stands_between_its_ends_only() {
    let one = Ellipsoid::new(0, [0.0; 3], [0.2, 0.1, 0.1], [1.0, 0.0, 0.0, 0.0]).unwrap();
    let at = |x: f64, y: f64| Vector3::new(x, y, 0.0);
    assert!(one.intersects(&at(-1.0, 0.05), &at(1.0, 0.05)));
    assert!(!one.intersects(&at(-1.0, 0.15), &at(1.0, 0.15)));
    assert!(!one.intersects(&at(0.5, 0.0), &at(1.0, 0.0)));
}

#[test]
fn an_ellipsoid_among_the_seen_points_costs_nothing_and_one_beyond_them_is_drawn_back() {
    let grid = |i: u32| f64::from(i % 7) - 3.0;
    let points: Vec<Vector3<f64>> =
        (0..343).map(|i| Vector3::new(grid(i), grid(i / 7), 0.1 * grid(i / 49))).collect();
    let extent = Extent::of(&points).unwrap();
    assert!(extent.middle.norm() < 1e-12 && (3.0..4.5).contains(&extent.radius), "{extent:?}");
    for place in [[2.0, -1.0, 0.2], [0.0, 0.0, 2.5]] {
        assert_eq!(extent.beyond(&ball(place, 0.3)), (0.0, Vector3::zeros()));
    }
    for place in [Vector3::new(0.5, 2.0, 9.0), Vector3::new(-7.0, 0.0, 1.0)] {
        let (cost, slope) = extent.beyond(&ball(place.into(), 0.3));
        assert!(cost > 0.3 && slope.normalize().dot(&place.normalize()) > 1.0 - 1e-12);
        for (axis, step) in [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate() {
            let at = |by: f64| extent.beyond(&ball((place + step * by).into(), 0.3)).0;
            assert!((slope[axis] - (at(1e-5) - at(-1e-5)) / 2e-5).abs() < 1e-8);
        }
    }
    assert_eq!(Extent::of(&[]), None);
    assert_eq!(Extent::of(&[Vector3::x(); 9]), None);
}
