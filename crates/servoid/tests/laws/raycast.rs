//! Laws of the ray-caster: depth in closed form, and the same bits on any number of threads.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::camera::{Distortion, Lens};
use servoid::pose::Pose;
use servoid::render::{Details, Exposure, Lighting, Paint, Placement, RenderError, Scene};

const SIZE_PX: [usize; 2] = [61, 47];

fn lens() -> Lens {
    Lens::new(SIZE_PX, [60.0, 61.0], [29.5, 23.0], Distortion::None).unwrap()
}

fn posed(turn: [f64; 3], place: [f64; 3]) -> Pose {
    Pose::from_rotation(UnitQuaternion::from_scaled_axis(Vector3::from(turn)), place.into())
}

/// Returns the first hit of a ray with an ellipsoid, in closed form: the smaller root of a
/// quadratic.
fn root(pose: &Pose, radii: [f64; 3], ray: &Vector3<f64>) -> Option<f64> {
    let back = pose.inverse();
    let radii = Vector3::from(radii);
    let from = back.translation().component_div(&radii);
    let along = (back.rotation() * ray).component_div(&radii);
    let (a, b, c) = (along.norm_squared(), from.dot(&along), from.norm_squared() - 1.0);
    let room = b * b - a * c;
    (room > 0.0).then(|| (-b - room.sqrt()) / a)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn depth_of_an_ellipsoid_is_the_smaller_root(
        turn in prop::array::uniform3(-3.0..3.0), x in -0.2..0.2, y in -0.2..0.2, z in 0.4..2.0,
        radii in prop::array::uniform3(0.02..0.2),
    ) {
        let (lens, pose) = (lens(), posed(turn, [x, y, z]));
        let mut scene = Scene::new();
        scene.add_ellipsoid(radii, Paint::default()).unwrap();
        let found = scene.depth(&lens, &Pose::identity(), &[pose]).unwrap();
        for v in 0..SIZE_PX[1] {
            for u in 0..SIZE_PX[0] {
                let ray = lens.ray([u as f64, v as f64]).unwrap();
                let at = v * SIZE_PX[0] + u;
                match root(&pose, radii, &ray) {
                    Some(t) if found.visual[at] == 0 => {
                        prop_assert!((f64::from(found.depth[at]) - t * ray.z).abs() < 1e-5);
                    }
                    Some(_) => prop_assert!(false, "nothing at {u}, {v}"),
                    None => prop_assert_eq!(found.visual[at], -1),
                }
            }
        }
    }
}

#[test]
fn the_same_image_comes_from_any_number_of_threads() {
    let lens = lens();
    let mut scene = Scene::new();
    scene.add_box([0.1, 0.05, 0.07], Paint::default()).unwrap();
    scene.add_capsule(0.04, 0.1, Paint::default().with_gloss(0.6).unwrap()).unwrap();
    let poses =
        vec![posed([0.4, 0.3, 0.0], [0.0, 0.0, 0.6]), posed([1.0, 0.0, 0.2], [0.1, 0.0, 0.5])];
    let placement = Placement {
        lens: &lens,
        world_from_lens: &[Pose::identity()],
        world_from_visual: &[poses],
        lighting: &Lighting::default(),
    };
    let draw = |threads| {
        let exposure = Exposure::default().with(|it| {
            it.threads = threads;
            it.noise = 2.0;
        });
        scene.render(&placement, &exposure).unwrap()
    };
    let first = draw(1);
    for threads in [2, 3, 0] {
        assert_eq!(first, draw(threads));
    }
}

#[test]
fn a_mesh_hides_what_is_behind_each_of_its_triangles() {
    let lens = lens();
    let corners = [[-0.2, -0.2, 0.0], [0.2, -0.2, 0.0], [0.2, 0.2, 0.0], [-0.2, 0.2, 0.0]];
    let mut scene = Scene::new();
    let faces = [[0, 1, 2], [2, 3, 0]];
    scene.add_mesh(&corners, &faces, &Details::default(), Paint::default()).unwrap();
    scene.add_ellipsoid([0.1; 3], Paint::default()).unwrap();
    let near = posed([0.0; 3], [0.0, 0.0, 0.5]);
    let far = posed([0.0; 3], [0.0, 0.0, 0.8]);
    let numbers = |poses: [Pose; 2]| scene.depth(&lens, &Pose::identity(), &poses).unwrap().visual;
    assert!(!numbers([near, far]).contains(&1));
    assert!(numbers([far, near]).contains(&1));
    // No ray slips through the edge between the two triangles.
    assert!(numbers([near, far]).iter().filter(|&&n| n == 0).count() > 2000);
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let mut scene = Scene::new();
    let size = scene.add_ellipsoid([0.1, f64::NAN, 0.1], Paint::default());
    assert!(matches!(size, Err(RenderError::Size { what: "radii", .. })));
    let corners = [[0.0; 3], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]];
    let face = scene.add_mesh(&corners, &[[0, 1, 3]], &Details::default(), Paint::default());
    assert!(matches!(face, Err(RenderError::Face { index: 0, corners: 3, .. })));
    let poses = scene.depth(&lens(), &Pose::identity(), &[Pose::identity()]);
    assert!(matches!(poses, Err(RenderError::Poses { given: 1, visuals: 0, .. })));
    assert_eq!(scene.count(), 0);
}
