//! Laws of closed meshes and of filling them.

use crate::shapes::{ball, cube, inside_out, joined, mesh, mesh_of, placed, stretched};
use nalgebra::{Matrix3, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;
use servoid::camera::Camera;
use servoid::pose::{Pose, even_turn};
use servoid::shape::{Body, Ellipsoid, Grid, Mesh, Projection, Quadric, ShapeError, silhouette};

fn filled_volume(grid: &Grid) -> f64 {
    grid.filled.iter().sum::<f64>() * grid.pitch.powi(3)
}

fn turns() -> impl Strategy<Value = UnitQuaternion<f64>> {
    (0.0..1.0, 0.0..1.0, 0.0..1.0).prop_map(|(a, b, c)| even_turn(a, b, c))
}

fn places() -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-2.0..2.0).prop_map(Into::into)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn filling_keeps_the_volume(
        kind in 0..4, turn in turns(), center in places(), radii in prop::array::uniform3(0.3..1.0),
    ) {
        let surface = match kind {
            0 => ball(3),
            1 => cube(),
            // Separate, and with a cavity.
            2 => joined(&[cube(), stretched(ball(2), [0.9; 3], [2.5, 0.3, 0.1])]),
            _ => joined(&[cube(), inside_out(stretched(ball(2), [0.7; 3], [0.1, 0.0, -0.1]))]),
        };
        let factor = turn.to_rotation_matrix().into_inner() * Matrix3::from_diagonal(&radii.into());
        let mesh = mesh(placed(surface, &factor, center));
        let grid = mesh.fill(64, 5);
        let (found, truth) = (filled_volume(&grid), mesh.volume());
        prop_assert!((found / truth - 1.0).abs() < 0.01, "{found} instead of {truth}");
        prop_assert!(grid.filled.iter().all(|share| (0.0..=1.0).contains(share)));
    }

    #[test]
    fn where_parts_overlap_or_lie_in_each_other_the_union_is_filled(
        turn in turns(), center in places(), off in prop::array::uniform3(-1.5..1.5),
        inner in 0.2..0.9,
    ) {
        let overlap: f64 = off.iter().map(|x: &f64| 2.0 - x.abs()).product();
        let pair = joined(&[cube(), stretched(cube(), [1.0; 3], off)]);
        let nested = joined(&[cube(), stretched(ball(2), [inner; 3], [0.0; 3])]);
        let turn = turn.to_rotation_matrix().into_inner();
        for (surface, truth) in [(pair, 16.0 - overlap), (nested, 8.0)] {
            let mesh = mesh(placed(surface, &turn, center));
            let found = filled_volume(&mesh.fill(64, 3));
            prop_assert!((found / truth - 1.0).abs() < 0.01, "{found} instead of {truth}");
            // The sum over the parts by themselves is larger.
            prop_assert!(mesh.volume() > found);
        }
    }

    #[test]
    fn voxels_are_filled_where_the_solid_is(turn in turns(), center in places()) {
        let factor = turn.to_rotation_matrix() * Matrix3::from_diagonal(&[1.0, 0.6, 0.4].into());
        let quadric = Quadric { center, factor };
        let grid = mesh_of(&quadric, 4).fill(40, 4);
        let inverse = factor.try_inverse().unwrap();
        let [width, height, depth] = grid.size;
        prop_assert_eq!(grid.filled.len(), width * height * depth);
        for (index, &share) in grid.filled.iter().enumerate() {
            let place = [index % width, index / width % height, index / (width * height)];
            let point = grid.origin + Vector3::from(place.map(|i| i as f64)) * grid.pitch;
            // Distance of a voxel's corner from its centre, in the unit ball of the thinnest axis.
            let (distance, reach) = ((inverse * (point - center)).norm(), grid.pitch / 0.4);
            if distance < 1.0 - reach {
                prop_assert!(share > 1.0 - 1e-9, "{share} inside at {distance}");
            } else if distance > 1.0 + reach {
                prop_assert_eq!(share, 0.0);
            }
        }
    }

    #[test]
    fn the_principal_frame_goes_with_the_mesh(
        turn in turns(), center in places(), scale in 0.01..50.0,
    ) {
        let still = mesh(joined(&[
            stretched(ball(2), [1.0, 0.5, 0.4], [0.3, 0.0, 0.0]),
            stretched(cube(), [0.2, 0.1, 0.15], [-0.7, 0.5, 0.1]),
        ]));
        let pose = Pose::from_rotation(turn, center);
        let moved = still.moved(&pose, scale);
        let (one, two) = (still.principal_frame(), moved.principal_frame());
        let there = pose * one;
        prop_assert!((there.translation() * scale - two.translation()).norm() < 1e-9 * scale);
        prop_assert!(there.rotation().angle_to(&two.rotation()) < 1e-6);
        prop_assert!((moved.extent() / still.extent() - scale).abs() < 1e-9 * scale);
        prop_assert!((moved.volume() / still.volume() / scale.powi(3) - 1.0).abs() < 1e-9);
        let again: Vec<[f64; 3]> = moved.vertices().iter().map(|v| (*v).into()).collect();
        prop_assert!(again.iter().flatten().all(|x| x.is_finite()));
    }

    #[test]
    fn the_silhouette_of_a_fine_mesh_is_that_of_its_ellipsoid(
        turn in turns(), center in prop::array::uniform3(-0.1..0.1),
    ) {
        let (w, x, y, z) = (turn.w, turn.i, turn.j, turn.k);
        let center = [center[0], center[1], 1.0 + center[2]];
        let solid = Ellipsoid::new(0, center, [0.2, 0.12, 0.08], [w, x, y, z]).unwrap();
        let camera = Camera::new([160, 120], [180.0; 2], [79.3, 59.8]).unwrap();
        let body = Body::new(Pose::identity(), vec![solid]).unwrap();
        let expected = silhouette(&body, &camera, &Pose::identity());
        let projection = Projection::new(&camera, &Pose::identity());
        let drawn = mesh_of(&solid.quadric(), 4).silhouette(&projection, [160, 120]);
        let count = |with: fn(bool, bool) -> bool| {
            expected.iter().zip(&drawn).filter(|(a, b)| with(**a > 0, **b > 0)).count() as f64
        };
        prop_assert!(count(|a, b| a && b) / count(|a, b| a || b) > 0.985);
    }
}

#[test]
fn the_frame_of_a_box_lies_along_its_sides_the_longest_first() {
    let turn = Pose::exp(&Vector6::new(0.3, -0.2, 0.1, 0.4, -0.5, 0.6));
    let mesh = mesh(stretched(cube(), [0.1, 0.3, 0.2], [1.0, 2.0, 3.0])).moved(&turn, 1.0);
    let frame = turn.inverse() * mesh.principal_frame();
    assert!((frame.translation() - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-9);
    let axes = frame.rotation_matrix().map(f64::abs);
    let expected = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    assert!((axes - expected).amax() < 1e-9, "{axes}");
    // A ball with the same mean squared distance from its centre: 3/5 r² = (a² + b² + c²) / 3.
    let spread: f64 = (0.1_f64.powi(2) + 0.3_f64.powi(2) + 0.2_f64.powi(2)) / 3.0;
    assert!((mesh.extent() - (spread * 5.0 / 3.0).sqrt()).abs() < 1e-9);
    assert!((mesh.volume() - 8.0 * 0.006).abs() < 1e-12);
}

#[test]
fn a_ball_is_as_slender_as_its_side_goes_into_two_thirds_of_its_radius() {
    // 2 V / A = 2 r / 3, the side is 2 r.
    assert!((mesh(ball(4)).slenderness() - 3.0).abs() < 0.02);
    assert!(mesh(stretched(cube(), [1.0, 1.0, 0.01], [0.0; 3])).slenderness() > 50.0);
}

/// A double pyramid whose tips lie on lines of the grid, for any order of its vertices.
#[test]
fn a_line_through_a_corner_goes_in_once_and_comes_out_once() {
    let tip = |x: f64| [x, 0.0625, 0.1875];
    let ring = [[0.0, -1.0, -1.0], [0.0, 1.0, -1.0], [0.0, 1.0, 1.0], [0.0, -1.0, 1.0]];
    let corners: Vec<[f64; 3]> = [tip(1.0), tip(-1.0)].into_iter().chain(ring).collect();
    let faces: Vec<[usize; 3]> = (0..4)
        .flat_map(|i| {
            let (here, next) = (2 + i, 2 + (i + 1) % 4);
            [[0, here, next], [1, next, here]]
        })
        .collect();
    for seed in 0..720_usize {
        // The permutation with this rank.
        let (mut rest, mut left, mut order) = ((0..6).collect::<Vec<usize>>(), seed, vec![]);
        for size in (1..=6).rev() {
            order.push(rest.remove(left % size));
            left /= size;
        }
        let mut renamed = vec![[0.0; 3]; 6];
        (0..6).for_each(|i| renamed[order[i]] = corners[i]);
        let mesh =
            Mesh::new(renamed, faces.iter().map(|face| face.map(|i| order[i])).collect()).unwrap();
        let grid = mesh.fill(8, 1);
        let found = filled_volume(&grid);
        assert!((found / mesh.volume() - 1.0).abs() < 0.02, "{found} with corners as {order:?}");
    }
}

#[test]
fn what_is_no_closed_surface_is_refused() {
    let refused = |(corners, faces): crate::shapes::Surface| Mesh::new(corners, faces).unwrap_err();
    let mut holed = ball(1);
    holed.1.pop();
    assert_eq!(refused(holed), ShapeError::Open { edges: 3 });
    let mut turned = ball(1);
    turned.1[4].swap(0, 1);
    assert_eq!(refused(turned), ShapeError::Open { edges: 3 });
    assert!(matches!(refused(inside_out(cube())), ShapeError::Volume(v) if v < 0.0));
    assert!(matches!(refused((vec![], vec![])), ShapeError::Volume(_)));
    for bad in [f64::NAN, f64::INFINITY] {
        let mut broken = cube();
        broken.0[5][1] = bad;
        assert!(matches!(refused(broken), ShapeError::Corner { index: 5, .. }));
    }
    let mut beyond = cube();
    beyond.1[7][2] = 8;
    let error = refused(beyond);
    assert!(matches!(error, ShapeError::Face { corners: 8, .. }), "{error}");
    assert!(error.to_string().contains("counted from 0"));
    let flat = stretched(cube(), [1.0, 1.0, 0.0], [0.0; 3]);
    assert!(matches!(refused(flat), ShapeError::Volume(v) if v == 0.0));
}

#[test]
fn a_mesh_that_is_not_wholly_in_front_of_the_camera_is_not_drawn() {
    let camera = Camera::new([64, 48], [50.0; 2], [31.5, 23.5]).unwrap();
    let projection = Projection::new(&camera, &Pose::identity());
    for depth in [0.5, -3.0] {
        let mesh = mesh(stretched(ball(2), [1.0; 3], [0.0, 0.0, depth]));
        assert!(mesh.silhouette(&projection, [64, 48]).iter().all(|&p| p == 0));
    }
}
