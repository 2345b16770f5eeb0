//! Laws of the mass properties of a union of ellipsoids.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3, Vector6};
use proptest::prelude::*;
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid, MassProperties};

fn ellipsoids() -> impl Strategy<Value = Ellipsoid> {
    let size = 0.01..0.08_f64;
    (
        prop::array::uniform3(-0.06..0.06_f64),
        prop::array::uniform3(size),
        prop::array::uniform3(-1.7..1.7_f64),
    )
        .prop_map(|(center, radii, turn)| {
            let turn = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, turn[0], turn[1], turn[2]));
            Ellipsoid::new(0, center, radii, turn.quaternion()).unwrap()
        })
}

fn mass(ellipsoids: &[Ellipsoid]) -> MassProperties {
    Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap().mass_properties()
}

/// Textbook inertia of a solid ellipsoid of unit density about its centre.
fn inertia(ellipsoid: &Ellipsoid) -> Matrix3<f64> {
    let spread = ellipsoid.shape_matrix() * (ellipsoid.volume() / 5.0);
    Matrix3::identity() * spread.trace() - spread
}

fn ball(x: f64, radius: f64) -> Ellipsoid {
    Ellipsoid::new(0, [x, 0.0, 0.0], [radius; 3], [1.0, 0.0, 0.0, 0.0]).unwrap()
}

fn agree(one: &MassProperties, two: &MassProperties, share: f64) -> bool {
    let reach = (two.inertia.trace() / two.volume).sqrt();
    (one.volume - two.volume).abs() < share * two.volume
        && (one.centroid - two.centroid).norm() < share * reach
        && (one.inertia - two.inertia).norm() < share * two.inertia.norm()
}

#[test]
fn overlapping_balls_have_the_volume_that_spherical_caps_give() {
    for apart in [0.3_f64, 1.0, 1.7, 1.99] {
        let cap = 1.0 - apart / 2.0;
        let lens = 2.0 * PI * cap * cap * (3.0 - cap) / 3.0;
        let union = 8.0 / 3.0 * PI - lens;
        let found = mass(&[ball(0.0, 1.0), ball(apart, 1.0)]);
        assert!((found.volume / union - 1.0).abs() < 6e-5, "{apart}: {found:?}");
        assert!((found.centroid - Vector3::x() * (apart / 2.0)).norm() < 1e-4, "{found:?}");
    }
}

#[test]
fn balls_that_are_far_apart_and_of_unlike_sizes_weigh_what_they_weigh_alone() {
    let parts = [ball(-500.0, 1e-3), ball(500.0, 1.0), ball(0.0, 0.1)];
    let found = mass(&parts);
    let volume: f64 = parts.iter().map(Ellipsoid::volume).sum();
    let middle = parts.iter().map(|e| e.center() * e.volume()).sum::<Vector3<f64>>() / volume;
    let mut expected = Matrix3::zeros();
    for part in &parts {
        let away = part.center() - middle;
        let swing = Matrix3::identity() * away.norm_squared() - away * away.transpose();
        expected += inertia(part) + swing * part.volume();
    }
    assert!(agree(&found, &MassProperties { volume, centroid: middle, inertia: expected }, 1e-8));
}

#[test]
fn the_sums_are_the_same_to_the_last_bit_on_any_number_of_threads() {
    let parts: Vec<_> = (0..6).map(|i| ball(0.02 * f64::from(i), 0.03)).collect();
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| mass(&parts))
    };
    assert_eq!(on(1), on(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn one_ellipsoid_has_the_closed_form(ellipsoid in ellipsoids(), far in -50.0..50.0_f64) {
        let moved = ellipsoid.transformed(&Pose::exp(&Vector6::new(far, 0.0, 1.0, 0.1, 0.2, 0.3)), 1.0);
        let expected = MassProperties {
            volume: moved.volume(), centroid: moved.center(), inertia: inertia(&moved),
        };
        prop_assert!(agree(&mass(&[moved]), &expected, 1e-8));
    }

    #[test]
    fn what_lies_inside_another_ellipsoid_weighs_nothing(
        ellipsoid in ellipsoids(), scale in 0.1..0.99_f64,
    ) {
        let kept = ellipsoid.center() * (1.0 - scale);
        let shift = Pose::from_parts(kept.into(), [1.0, 0.0, 0.0, 0.0]).unwrap();
        let inner = ellipsoid.transformed(&shift, scale);
        prop_assert!(agree(&mass(&[inner, ellipsoid]), &mass(&[ellipsoid]), 1e-8));
    }

    #[test]
    fn mass_moves_with_the_body(
        parts in prop::collection::vec(ellipsoids(), 1..6),
        twist in prop::array::uniform6(-1.5..1.5_f64),
        scale in 0.1..10.0_f64,
    ) {
        let pose = Pose::exp(&Vector6::from(twist));
        let moved: Vec<_> = parts.iter().map(|e| e.transformed(&pose, scale)).collect();
        let (here, there) = (mass(&parts), mass(&moved));
        let turn = pose.rotation_matrix();
        let carried = MassProperties {
            volume: here.volume * scale.powi(3),
            centroid: pose.transform(&(here.centroid * scale)),
            inertia: turn * here.inertia * turn.transpose() * scale.powi(5),
        };
        prop_assert!(agree(&there, &carried, 1e-8));
    }

    #[test]
    fn a_union_lies_between_its_largest_part_and_the_sum(
        parts in prop::collection::vec(ellipsoids(), 1..6),
    ) {
        let volume = mass(&parts).volume;
        let volumes = || parts.iter().map(Ellipsoid::volume);
        prop_assert!(volume <= volumes().sum::<f64>() * (1.0 + 1e-8));
        prop_assert!(volume >= volumes().fold(0.0, f64::max) * (1.0 - 1e-8));
    }

    #[test]
    fn random_points_find_the_same_volume(parts in prop::collection::vec(ellipsoids(), 2..5)) {
        // Additive recurrence over a box: an estimate that is independent of the lines.
        let count = 100_000;
        let root = 1.220_744_084_605_76_f64;
        let held = (1..=count)
            .filter(|&i| {
                let at = |k: i32| (f64::from(i) / root.powi(k)).fract() * 0.3 - 0.15;
                let point = Vector3::new(at(1), at(2), at(3));
                parts.iter().any(|e| e.contains(&point))
            })
            .count();
        let point = 0.3_f64.powi(3) / f64::from(count);
        let expected = point * held as f64;
        prop_assert!((mass(&parts).volume - expected).abs() < 0.02 * expected + 30.0 * point);
    }
}
