//! Laws of poses, cameras, outlines and bodies.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector6};
use proptest::prelude::*;
use servoid::camera::{Camera, Channels, ImageError, ImageView, Mask, Rig, RigError};
use servoid::pose::{Pose, PoseError};
use servoid::shape::{Body, Ellipsoid, Outline, Projection, Quadric, silhouette};

fn twists() -> impl Strategy<Value = Vector6<f64>> {
    (prop::array::uniform3(-2.0..2.0), prop::array::uniform3(-1.7..1.7))
        .prop_map(|(l, a)| Vector6::new(l[0], l[1], l[2], a[0], a[1], a[2]))
}

fn close(one: &Pose, two: &Pose) -> bool {
    (one.matrix() - two.matrix()).amax() < 1e-9
}

/// Makes a body of two balls beside each other, of one size.
fn dumbbell(pose: Pose, radius: f64) -> Body {
    let ball =
        |x: f64| Ellipsoid::new(0, [x, 0.0, 0.0], [radius; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
    Body::new(pose, vec![ball(-0.8 * radius), ball(0.8 * radius)]).unwrap()
}

proptest! {
    #[test]
    fn what_two_bodies_share_is_all_at_one_place_nothing_apart_and_the_same_seen_from_each(
        t in twists(),
        way in 0.0..2.5_f64,
        larger in 1.0..3.0_f64,
    ) {
        let pose = Pose::exp(&t);
        let own = dumbbell(pose, 0.05);
        prop_assert_eq!(own.overlap(&own), 1.0);
        let aside = Pose::exp(&Vector6::new(0.0, way * 0.05, 0.0, 0.0, 0.0, 0.0));
        let other = dumbbell(pose * aside, 0.05);
        let shared = own.overlap(&other);
        prop_assert_eq!(shared, other.overlap(&own));
        // Of a ball, a part of two caps; both pairs share the same.
        let cap = (1.0 - way / 2.0).max(0.0);
        let expected = cap * cap * (2.0 + way / 2.0) / 2.0;
        prop_assert!((shared - expected).abs() < 0.08, "{shared} for {expected}");
        // A small one inside a large one is not at its place.
        let around = dumbbell(pose, 0.05 * larger);
        let (shared, expected) = (own.overlap(&around), larger.powi(-3));
        prop_assert!((shared - expected).abs() < 0.12, "{shared} for {expected}");
    }

    #[test]
    fn poses_form_a_group(a in twists(), b in twists(), c in twists()) {
        let [a, b, c] = [a, b, c].map(|t| Pose::exp(&t));
        prop_assert!(close(&((a * b) * c), &(a * (b * c))));
        prop_assert!(close(&(a * a.inverse()), &Pose::identity()));
        prop_assert!(close(&(a * Pose::identity()), &a));
    }

    #[test]
    fn the_logarithm_undoes_the_exponential(t in twists(), size in -9.0..0.0_f64) {
        for t in [t, t * 10_f64.powf(size)] {
            prop_assert!((Pose::exp(&t).log() - t).amax() < 1e-9 * (1.0 + t.amax()));
        }
    }

    #[test]
    fn the_adjoint_carries_twists_along(a in twists(), t in twists()) {
        let pose = Pose::exp(&a);
        let carried = Pose::exp(&(pose.adjoint() * t));
        prop_assert!(close(&carried, &(pose * Pose::exp(&t) * pose.inverse())));
    }

    #[test]
    fn a_matrix_and_a_quaternion_give_the_pose_back(t in twists()) {
        let pose = Pose::exp(&t);
        prop_assert!(close(&Pose::from_matrix(&pose.matrix()).unwrap(), &pose));
        let parts = Pose::from_parts(pose.translation().into(), pose.quaternion()).unwrap();
        prop_assert!(close(&parts, &pose));
    }

    #[test]
    fn a_cropped_and_shrunk_camera_sees_the_centres_of_blocks(
        corner in prop::array::uniform2(0_usize..200), shrink in 1_usize..6,
        at in prop::array::uniform2(0_usize..40),
    ) {
        let camera = Camera::new([640, 480], [500.0, 510.0], [320.0, 239.0]).unwrap();
        let small = camera.crop(corner, [40, 40], shrink).unwrap();
        let middle = |i: usize| {
            (corner[i] + at[i] * shrink) as f64 + 0.5 * (shrink as f64 - 1.0)
        };
        let point = camera.ray([middle(0), middle(1)]) * 2.0;
        let seen = small.project(&point).unwrap();
        prop_assert!((seen.x - at[0] as f64).abs() < 1e-9 && (seen.y - at[1] as f64).abs() < 1e-9);
    }
}

#[test]
fn what_is_no_rigid_motion_is_refused() {
    let nan = Matrix4::identity().map_with_location(
        |r, c, x: f64| {
            if (r, c) == (0, 3) { f64::NAN } else { x }
        },
    );
    assert!(matches!(Pose::from_matrix(&nan), Err(PoseError::NotFinite(_))));
    let scaled = Matrix4::from_diagonal(&nalgebra::Vector4::new(2.0, 2.0, 2.0, 1.0));
    assert!(matches!(Pose::from_matrix(&scaled), Err(PoseError::NotRigid { .. })));
    let mirrored = Matrix4::from_diagonal(&nalgebra::Vector4::new(-1.0, 1.0, 1.0, 1.0));
    assert!(matches!(Pose::from_matrix(&mirrored), Err(PoseError::NotRigid { .. })));
    let mut projective = Matrix4::identity();
    projective[(3, 0)] = 0.1;
    assert!(matches!(Pose::from_matrix(&projective), Err(PoseError::LastRow(_))));
    assert!(matches!(Pose::from_parts([0.0; 3], [2.0, 0.0, 0.0, 0.0]), Err(PoseError::NotUnit(_))));
}

#[test]
fn cameras_that_cannot_exist_are_refused() {
    for focal in [0.0, -5.0, f64::NAN, f64::INFINITY] {
        assert!(Camera::new([640, 480], [focal, 500.0], [320.0, 240.0]).is_err());
    }
    assert!(Camera::new([0, 480], [500.0; 2], [320.0, 240.0]).is_err());
    assert!(Camera::new([640, 9000], [500.0; 2], [320.0, 240.0]).is_err());
    assert!(Camera::new([640, 480], [500.0; 2], [f64::NAN, 240.0]).is_err());
}

#[test]
fn masks_measure_their_object_and_are_refused_without_one_or_without_background() {
    let look = |bytes: &[u8]| {
        Mask::new(ImageView::new(bytes, [4, 3], Channels::Grey)?)
            .map(|m| (m.area_px(), m.bounds_px(), m.centroid_px()))
    };
    assert!(matches!(look(&[0; 12]), Err(ImageError::EmptyMask { .. })));
    assert!(matches!(look(&[7; 12]), Err(ImageError::FullMask { .. })));
    assert!(matches!(look(&[7; 11]), Err(ImageError::Length { .. })));
    let marked = [0, 0, 0, 0, 0, 9, 9, 0, 0, 0, 9, 9];
    let found = look(&marked).unwrap();
    assert_eq!(found, (4, ([1, 1], [3, 2]), [2.0, 1.5]));
}

#[test]
fn a_rig_whose_cameras_turn_gives_the_pose_of_each() {
    let camera = Camera::new([4, 3], [3.0; 2], [1.5, 1.0]).unwrap();
    let [left, right] = [-0.1, 0.1].map(|x| Pose::exp(&Vector6::new(x, 0.0, 0.0, 0.0, 0.0, 0.0)));
    let rig = Rig::new(vec![camera; 2], vec![left, right]).unwrap();
    let world_from_rig = Pose::exp(&Vector6::new(1.0, 2.0, 3.0, 0.3, 0.2, 0.1));
    let rest = rig.observation(0.0, world_from_rig, None, vec![None; 2]).unwrap();
    assert!(close(&rest.world_from_camera[1], &(world_from_rig * right)));
    let turned = Pose::exp(&Vector6::new(0.1, 0.0, 0.0, 0.0, 0.2, 0.0));
    let eyes = [left, turned];
    let verged = rig.observation(0.1, world_from_rig, Some(&eyes), vec![None; 2]).unwrap();
    assert!(close(&verged.world_from_camera[1], &(world_from_rig * turned)));
    let bytes = [0; 6];
    let wrong = ImageView::new(&bytes, [3, 2], Channels::Grey).unwrap();
    let refused = rig.observation(0.2, world_from_rig, None, vec![None, Some(wrong)]);
    assert!(matches!(refused, Err(RigError::ImageSize { camera: 1, .. })));
    assert!(rig.observation(f64::NAN, world_from_rig, None, vec![None; 2]).is_err());
    assert!(rig.observation(0.0, world_from_rig, None, vec![None]).is_err());
}

/// Ellipsoids in front of, beside, around and behind a camera at the origin.
fn quadrics() -> impl Strategy<Value = Quadric> {
    (prop::array::uniform3(-0.6..0.6), prop::array::uniform9(-0.3..0.3), -0.5..2.0).prop_map(
        |(c, f, z)| Quadric {
            center: Vector3::new(c[0], c[1], z),
            factor: Matrix3::from_column_slice(&f),
        },
    )
}

fn camera() -> (Camera, Projection) {
    let camera = Camera::new([160, 120], [150.0, 140.0], [80.3, 59.1]).unwrap();
    (camera, Projection::new(&camera, &Pose::identity()))
}

/// Returns how deep a ray lies inside the cone of rays that hit the ellipsoid: positive inside.
fn cone_depth(quadric: &Quadric, ray: &Vector3<f64>) -> f64 {
    let inverse = quadric.factor.try_inverse().unwrap();
    let (ray, center) = (inverse * ray, inverse * quadric.center);
    ray.dot(&center).powi(2) - ray.norm_squared() * (center.norm_squared() - 1.0)
}

fn solid(quadric: &Quadric) -> bool {
    quadric.bulk() > 1e-4
}

proptest! {
    #[test]
    fn an_outline_is_where_rays_graze_the_ellipsoid(quadric in quadrics(), share in -0.99..0.99) {
        prop_assume!(solid(&quadric));
        let (camera, projection) = camera();
        let reach = quadric.factor.row(2).norm();
        match projection.outline(&quadric) {
            None => prop_assert!(quadric.center.z - reach < 1e-9),
            Some(outline) => {
                prop_assert!(quadric.center.z - reach > 0.0);
                let v = outline.center_v + share * outline.half_height;
                let (begin, end) = outline.interval(v).unwrap();
                let at = |u: f64| cone_depth(&quadric, &camera.ray([u, v]));
                let scale = at(0.5 * (begin + end));
                prop_assert!(scale > 0.0);
                prop_assert!(at(begin).abs() < 1e-6 * scale && at(end).abs() < 1e-6 * scale);
            }
        }
    }

    #[test]
    fn a_silhouette_equals_rays_cast_through_each_pixel(body in prop::collection::vec(quadrics(), 1..5)) {
        prop_assume!(body.iter().all(solid));
        let (camera, projection) = camera();
        let seen: Vec<_> = body.iter().filter(|q| projection.outline(q).is_some()).collect();
        let solids: Vec<_> = body.iter().map(|q| Ellipsoid::from_quadric(q, 0.0)).collect();
        let drawn = silhouette(
            &Body::new(Pose::identity(), solids).unwrap(), &camera, &Pose::identity());
        let mut wrong = 0;
        for (index, &pixel) in drawn.iter().enumerate() {
            let ray = camera.ray([(index % 160) as f64, (index / 160) as f64]);
            wrong += usize::from((pixel > 0) != seen.iter().any(|q| cone_depth(q, &ray) > 0.0));
        }
        prop_assert!(wrong <= 1, "{wrong} pixels differ");
    }

    #[test]
    fn the_outline_s_slopes_equal_finite_differences(
        quadric in quadrics(), by in prop::array::uniform5(-1.0..1.0),
    ) {
        prop_assume!(quadric.bulk() > 1e-3 && quadric.center.z - quadric.factor.row(2).norm() > 0.2);
        let (_, projection) = camera();
        let value = |q: &Quadric| {
            let Outline { center_u, center_v, slope, half_width, half_height } =
                projection.outline(q).unwrap();
            let numbers = [center_u, center_v, slope, half_width, half_height];
            numbers.iter().zip(&by).map(|(x, w)| x * w).sum::<f64>()
        };
        let slopes = projection.pull_back(&quadric, &projection.outline(&quadric).unwrap(), &by);
        let given: Vec<f64> = slopes.center.iter().chain(slopes.factor.iter()).copied().collect();
        for (index, given) in given.into_iter().enumerate() {
            let step = 1e-6;
            let moved = |by: f64| {
                let mut q = quadric;
                if index < 3 { q.center[index] += by } else { q.factor[index - 3] += by }
                value(&q)
            };
            let found = (moved(step) - moved(-step)) / (2.0 * step);
            prop_assert!((found - given).abs() < 1e-4 * (10.0 + given.abs()), "{index}: {given} {found}");
        }
    }

    #[test]
    fn an_ellipsoid_survives_being_a_quadric(quadric in quadrics()) {
        prop_assume!(solid(&quadric));
        let back = Ellipsoid::from_quadric(&quadric, 0.0).quadric();
        prop_assert!((back.shape_matrix() - quadric.shape_matrix()).amax() < 1e-12);
        prop_assert!((back.center - quadric.center).amax() < 1e-12);
    }

    #[test]
    fn a_body_moves_and_scales_with_the_world(
        quadrics in prop::collection::vec(quadrics(), 1..4), t in twists(), scale in 0.1..10.0_f64,
    ) {
        prop_assume!(quadrics.iter().all(solid));
        let solids: Vec<_> = quadrics.iter().map(|q| Ellipsoid::from_quadric(q, 0.0)).collect();
        let pose = Pose::exp(&t);
        let body = Body::around(&solids).unwrap();
        let moved = body.transformed(&pose, scale);
        for (one, two) in moved.in_world().iter().zip(&solids) {
            let two = two.transformed(&pose, scale).quadric();
            prop_assert!((one.quadric().center - two.center).amax() < 1e-9 * scale.max(1.0));
            let apart = one.quadric().shape_matrix() - two.shape_matrix();
            prop_assert!(apart.amax() < 1e-9 * scale.powi(2).max(1.0));
        }
    }
}

#[test]
fn a_body_s_frame_lies_at_its_centroid_with_the_longest_axis_first() {
    let solid = |center, radii| Ellipsoid::new(0, center, radii, [1.0, 0.0, 0.0, 0.0]).unwrap();
    let one = Body::around(&[solid([1.0, 2.0, 3.0], [0.1, 0.3, 0.2])]).unwrap();
    let ellipsoid = &one.ellipsoids()[0];
    assert!(ellipsoid.center().norm() < 0.01, "{}", ellipsoid.center());
    assert!((ellipsoid.factor().row(0).norm() - 0.3).abs() < 0.01);
    let two = [solid([0.0; 3], [0.1; 3]), solid([0.0, 0.4, 0.0], [0.1; 3])];
    let origin = Body::around(&two).unwrap().world_from_object().translation();
    assert!((origin - Vector3::new(0.0, 0.2, 0.0)).norm() < 0.005, "{origin}");
}

#[test]
fn shapes_that_cannot_exist_are_refused() {
    let make = |c: f64, r: f64, w: f64| {
        Ellipsoid::new(3, [c, 0.0, 0.0], [r, 1.0, 1.0], [w, 0.0, 0.0, 0.0])
    };
    for (c, r, w) in [(f64::NAN, 1.0, 1.0), (0.0, 0.0, 1.0), (0.0, -1.0, 1.0), (0.0, 1.0, 0.5)] {
        let message = make(c, r, w).unwrap_err().to_string();
        assert!(message.starts_with("ellipsoid 3: "), "{message}");
    }
    assert!(Body::new(Pose::identity(), vec![]).is_err());
    assert!(Body::new(Pose::identity(), vec![make(0.0, 1.0, 1.0).unwrap(); 65]).is_err());
}
