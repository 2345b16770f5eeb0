//! The volume's agreement against sums taken slice by slice and voxel by voxel.

use crate::shapes::mesh_of;
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;
use servoid::fitness::{Differentiable, Evidence, Fitness, Volume};
use servoid::pose::even_turn;
use servoid::shape::{Grid, Quadric, QuadricGradient, Section};

fn quadrics() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.5..0.5), prop::array::uniform9(-0.15..0.15)).prop_map(|(c, f)| {
        let factor = Matrix3::from_column_slice(&f) + Matrix3::identity() * 0.45;
        Quadric { center: c.into(), factor }
    })
}

/// An arbitrary smooth filling.
fn grids() -> impl Strategy<Value = Grid> {
    (prop::array::uniform4(-3.0..3.0), 9_usize..14, 8_usize..12).prop_map(|(wave, width, depth)| {
        let size = [width, 11, depth];
        let share = |i: usize| {
            let [x, y, z] = [i % width, i / width % 11, i / (width * 11)].map(|i| i as f64 * 0.2);
            let phase: f64 = wave[0] * x + wave[1] * y + wave[2] * z + wave[3];
            0.5 + 0.5 * phase.sin()
        };
        let filled = (0..width * 11 * depth).map(share).collect();
        let origin = Vector3::new(-0.1 * width as f64, -1.1, -0.1 * depth as f64);
        Grid { origin, pitch: 0.2, size, filled }
    })
}

/// The agreement, from intervals in double precision.
fn by_slices(body: &[Quadric], grid: &Grid) -> f64 {
    let [width, height, depth] = grid.size;
    let sections: Vec<_> = body.iter().map(|q| Section::new(&grid.to_voxels(q)).unwrap()).collect();
    let (mut both, mut area) = (0.0, 0.0);
    for z in 0..depth {
        let cuts: Vec<_> = sections.iter().filter_map(|section| section.at(z as f64)).collect();
        for y in 0..height {
            let mut spans: Vec<_> =
                cuts.iter().filter_map(|cut| cut.mean_interval(y as f64, 1.0)).collect();
            spans.sort_by(|a, b| a.0.total_cmp(&b.0));
            let mut reached = f64::NEG_INFINITY;
            for (begin, end) in spans {
                let begin = begin.max(reached);
                reached = reached.max(end);
                for x in 0..width {
                    let left = begin.max(x as f64 - 0.5);
                    let length = (end.min(x as f64 + 0.5) - left).max(0.0);
                    // Shares are stored in steps of 1/512.
                    let share = grid.filled[(z * height + y) * width + x];
                    let share = 0.5 + 0.5 * ((2.0 * share - 1.0) * 256.0).round() / 256.0;
                    both += length * share;
                    area += length;
                }
            }
        }
    }
    both / (grid.filled.iter().sum::<f64>() + area - both)
}

fn slot(quadric: &mut Quadric, which: usize) -> &mut f64 {
    if which < 3 { &mut quadric.center[which] } else { &mut quadric.factor[which - 3] }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_section_holds_what_the_ellipsoid_holds_in_its_plane(
        quadric in quadrics(), at in prop::array::uniform3(-1.2..1.2),
    ) {
        let section = Section::new(&quadric).unwrap();
        let point = Vector3::from(at);
        let distance = (quadric.factor.try_inverse().unwrap() * (point - quadric.center)).norm();
        prop_assume!((distance - 1.0).abs() > 1e-9);
        let row = section.at(point.z).and_then(|cut| cut.interval(point.y));
        let holds = row.is_some_and(|(begin, end)| begin < point.x && point.x < end);
        prop_assert_eq!(holds, distance < 1.0);
        // The planes beyond which there is no cut are tangent to it.
        let (first, last) = section.extent();
        let reach = quadric.shape_matrix()[(2, 2)].sqrt();
        prop_assert!((last - first - 2.0 * reach).abs() < 1e-12);
        prop_assert!(section.at(first - 1e-9).is_none() && section.at(last + 1e-9).is_none());
        prop_assert!(section.at(first + 1e-6).is_some() && section.at(last - 1e-6).is_some());
    }

    #[test]
    fn the_agreement_equals_the_sum_over_slices(
        body in prop::collection::vec(quadrics(), 1..5), grid in grids(),
    ) {
        let expected = by_slices(&body, &grid);
        let volume = Volume::new(grid);
        let mut slopes = vec![QuadricGradient::default(); body.len()];
        for found in [volume.score(&body), volume.score_and_gradient(&body, &mut slopes)] {
            prop_assert!((found - expected).abs() < 1e-4, "{found} instead of {expected}");
        }
    }

    #[test]
    fn the_gradient_equals_finite_differences_of_the_sum_over_slices(
        body in prop::collection::vec(quadrics(), 1..4), grid in grids(), which in 0_usize..12,
        index in 0_usize..4,
    ) {
        let index = index % body.len();
        let moved = |by: f64| {
            let mut body = body.clone();
            *slot(&mut body[index], which) += by;
            by_slices(&body, &grid)
        };
        // Where an end crosses a voxel's edge or a slice opens, the sum is not differentiable; such
        // cases are skipped.
        let difference = |step: f64| (moved(step) - moved(-step)) / (2.0 * step);
        let (found, coarse) = (difference(1e-6), difference(4e-6));
        prop_assume!((found - coarse).abs() < 1e-4);
        let mut slopes = vec![QuadricGradient::default(); body.len()];
        Volume::new(grid.clone()).score_and_gradient(&body, &mut slopes);
        let QuadricGradient { center, factor } = slopes[index];
        let given = *slot(&mut Quadric { center, factor }, which);
        prop_assert!((given - found).abs() < 3e-3 * (1.0 + found.abs()), "{given} instead of {found}");
    }

    #[test]
    fn what_is_open_is_what_the_standing_leave(
        standing in prop::collection::vec(quadrics(), 0..3), next in quadrics(), grid in grids(),
    ) {
        // Voxel by voxel, each completely inside or outside.
        let [width, height, _] = grid.size;
        let holds = |quadric: &Quadric, point: &Vector3<f64>| {
            (quadric.factor.try_inverse().unwrap() * (point - quadric.center)).norm() < 1.0
        };
        let (mut gain, mut surface) = (0.0, 0);
        for (i, share) in grid.filled.iter().enumerate() {
            let place = [i % width, i / width % height, i / (width * height)];
            let point = grid.origin + Vector3::from(place.map(|i| i as f64)) * grid.pitch;
            let inside = holds(&next, &point);
            if inside && !standing.iter().any(|one| holds(one, &point)) {
                gain += 2.0 * share - 1.0;
            }
            surface += usize::from(inside);
        }
        let filled: f64 = grid.filled.iter().sum();
        let open = Volume::new(grid).open(&standing);
        let found = open.score(&[next]);
        // Border voxels are counted partly by one and not by the other.
        let border = 1.5 * (surface as f64).powf(2.0 / 3.0) / filled;
        prop_assert!((found - gain / filled).abs() < 0.02 + border, "{found} {}", gain / filled);
        if standing.is_empty() {
            prop_assert!(open.score(&[]).abs() < 1e-12);
        }
    }

    #[test]
    fn an_ellipsoid_agrees_best_with_its_own_filled_mesh(
        turn in prop::array::uniform3(0.0..1.0), radii in prop::array::uniform3(0.5..1.0),
        off in prop::array::uniform12(-1.0..1.0),
    ) {
        let turn: [f64; 3] = turn;
        let turn = even_turn(turn[0], turn[1], turn[2]).to_rotation_matrix().into_inner();
        let factor = turn * Matrix3::from_diagonal(&Vector3::from(radii));
        let truth = Quadric { center: Vector3::new(1.0, -2.0, 0.5), factor };
        let volume = Volume::new(mesh_of(&truth, 4).fill(72, 14));
        let best = volume.score(&[truth]);
        prop_assert!(best > 0.95 && best <= 1.0 + 1e-9, "{best}");
        let off: [f64; 12] = off;
        let mut beside = truth;
        (0..12).for_each(|which| *slot(&mut beside, which) += 0.1 * off[which]);
        // A rotation of the unit ball changes the factor but not the ellipsoid.
        let change = (beside.shape_matrix() - truth.shape_matrix()).norm()
            + (beside.center - truth.center).norm();
        prop_assume!(change > 0.03);
        prop_assert!(volume.score(&[beside]) < best);
        // One more ellipsoid inside it changes nothing, and a body elsewhere agrees with nothing.
        let inner = Quadric { factor: truth.factor * 0.5, ..truth };
        prop_assert!((volume.score(&[truth, inner]) - best).abs() < 1e-6);
        let away = Quadric { center: truth.center + Vector3::x() * 30.0, ..truth };
        prop_assert_eq!(volume.score(&[away]), 0.0);
    }
}

#[test]
fn a_flat_ellipsoid_has_no_section_and_a_body_of_none_agrees_with_nothing() {
    let flat = Quadric {
        center: Vector3::zeros(),
        factor: Matrix3::from_diagonal(&Vector3::new(1.0, 0.0, 1.0)),
    };
    assert!(Section::new(&flat).is_none());
    let solid = Quadric { center: Vector3::zeros(), factor: Matrix3::identity() };
    let volume = Volume::new(mesh_of(&solid, 2).fill(16, 2));
    let mut slopes = [QuadricGradient::default(); 2];
    assert_eq!(volume.score(&[]), 0.0);
    assert_eq!(volume.score(&[flat]), 0.0);
    let both = volume.score_and_gradient(&[flat, solid], &mut slopes);
    assert!((both - volume.score(&[solid])).abs() < 1e-6);
    assert_eq!(slopes[0], QuadricGradient::default());
}
