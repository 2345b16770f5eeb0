//! Laws of modelling, on silhouettes drawn by the tests.

use crate::scenes::holds;
use nalgebra::{Rotation3, UnitQuaternion, Vector3, Vector6};
use servoid::camera::{Camera, Channels, ImageView, Mask, View};
use servoid::fitness::RangeSample;
use servoid::model::{
    ModelError, ModelInput, Settings, Step, UnmaskedImage, Weights, ellipsoid_colors, initial_body,
    progressive, silhouette_ious,
};
use servoid::pose::{Pose, even_direction};
use servoid::shape::{Body, Ellipsoid, Mesh, silhouette};

const SIZE: [usize; 2] = [160, 120];

fn given<'a>(views: &'a [View<'a>]) -> ModelInput<'a> {
    ModelInput::default().with(|it| it.views = views)
}

pub fn solid(center: [f64; 3], radii: [f64; 3]) -> Ellipsoid {
    Ellipsoid::new(0, center, radii, [0.9, 0.1, 0.3, 0.3]).unwrap()
}

pub fn pair() -> Vec<Ellipsoid> {
    vec![solid([0.0; 3], [0.09, 0.05, 0.04]), solid([0.03, 0.09, 0.02], [0.03, 0.05, 0.03])]
}

/// Cameras on two rings around the origin, looking at it.
fn poses() -> Vec<Pose> {
    let place = |i: usize| {
        let angle = i as f64 * std::f64::consts::TAU / 7.0;
        let height = if i.is_multiple_of(2) { 0.15 } else { 0.35 };
        let eye = Vector3::new(0.6 * angle.cos(), 0.6 * angle.sin(), height);
        let look = Rotation3::face_towards(&-eye, &-Vector3::z());
        Pose::from_rotation(UnitQuaternion::from_rotation_matrix(&look), eye)
    };
    (0..7).map(place).collect()
}

/// Masks of ellipsoids, seen from cameras that were moved with them.
pub struct Scene {
    camera: Camera,
    poses: Vec<Pose>,
    masks: Vec<Vec<u8>>,
}

impl Scene {
    pub fn new(ellipsoids: &[Ellipsoid]) -> Self {
        let camera = Camera::new(SIZE, [260.0; 2], [79.5, 59.5]).unwrap();
        let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
        let masks = poses().iter().map(|pose| silhouette(&body, &camera, pose)).collect();
        Self { camera, poses: poses(), masks }
    }

    fn moved(mut self, motion: &Pose, scale: f64) -> Self {
        for pose in &mut self.poses {
            *pose = *motion * Pose::from_rotation(pose.rotation(), pose.translation() * scale);
        }
        self
    }

    pub fn views(&self) -> Vec<View<'_>> {
        let mut views = vec![];
        for (pose, mask) in self.poses.iter().zip(&self.masks) {
            let image = ImageView::new(mask, SIZE, Channels::Grey).unwrap();
            views.push(View::new(self.camera, *pose, Mask::new(image).unwrap()).unwrap());
        }
        views
    }

    pub fn model(&self, settings: Settings) -> Vec<Step> {
        progressive(&given(&self.views()), &settings, &mut |_, _, _| true).unwrap()
    }
}

pub fn exactly(count: usize) -> Settings {
    Settings::default().with(|it| {
        it.max_ellipsoids = count;
        it.delta = 0.0;
    })
}

#[test]
fn one_ellipsoid_is_found_within_a_millimetre() {
    holds("modelling one ellipsoid");
}

#[test]
fn the_overlap_never_falls_and_the_count_is_exactly_as_asked() {
    holds("modelling with a count");
}

#[test]
fn modelling_stops_when_another_ellipsoid_gains_less_than_delta() {
    holds("modelling that stops");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_thread_count() {
    let scene = Scene::new(&pair());
    let on = |threads| scene.model(exactly(3).with(|it| it.threads = threads));
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(3));
    assert_ne!(one, scene.model(exactly(3).with(|it| it.seed = 1)));
}

#[test]
fn moving_turning_and_scaling_the_world_does_the_same_to_the_body_and_changes_nothing_else() {
    let still = Scene::new(&pair()).model(exactly(3));
    let motions = [
        (Vector6::new(3.0, -1.0, 0.5, 0.0, 0.0, 0.0), 1.0),
        (Vector6::new(0.0, 0.0, 0.0, 1.0, -0.7, 2.0), 1.0),
        (Vector6::new(-0.3, 0.2, 7.0, -0.4, 0.9, 0.1), 25.0),
    ];
    for (twist, scale) in motions {
        let motion = Pose::exp(&twist);
        let moved = Scene::new(&pair()).moved(&motion, scale).model(exactly(3));
        for (one, two) in still.iter().zip(&moved) {
            assert_eq!(one.fitness.to_bits(), two.fitness.to_bits());
            let expected = one.body.transformed(&motion, scale).in_world();
            for (a, b) in expected.iter().zip(two.body.in_world()) {
                let (a, b) = (a.quadric(), b.quadric());
                assert!((a.center - b.center).norm() < 1e-9 * scale * 10.0);
                assert!((a.shape_matrix() - b.shape_matrix()).amax() < 1e-9 * scale * scale);
            }
        }
    }
}

#[test]
fn views_that_cannot_be_modelled_are_refused() {
    let scene = Scene::new(&pair());
    let views = scene.views();
    let refused = |views: &[View<'_>]| {
        progressive(&given(views), &exactly(1), &mut |_, _, _| true).unwrap_err()
    };
    assert!(matches!(refused(&[]), ModelError::TooFewViews(0)));
    assert!(matches!(refused(&views[..1]), ModelError::TooFewViews(1)));
    assert!(matches!(refused(&[views[0], views[0]]), ModelError::NoBaseline));
    let mut apart = Scene::new(&pair());
    apart.poses[3] = Pose::exp(&Vector6::new(5.0, 0.0, 0.0, 0.0, 0.0, 0.0)) * apart.poses[3];
    assert!(matches!(refused(&apart.views()), ModelError::NoCommonPoint { .. }));
    let mut behind = Scene::new(&pair());
    let around = Pose::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, std::f64::consts::PI, 0.0));
    behind.poses[2] = behind.poses[2] * around;
    assert!(matches!(refused(&behind.views()), ModelError::NoCommonPoint { .. }));
}

#[test]
fn views_from_one_place_are_refused_whatever_their_masks_are() {
    let scene = Scene::new(&pair());
    let refused = |views: &[View<'_>]| {
        progressive(&given(views), &exactly(1), &mut |_, _, _| true).unwrap_err()
    };
    for turned in [0.0, 0.02] {
        let mut held = Scene::new(&pair());
        for (index, pose) in held.poses.iter_mut().enumerate() {
            let turn = Vector6::new(0.0, 0.0, 0.0, 0.0, turned * index as f64, 0.0);
            *pose = scene.poses[0] * Pose::exp(&turn);
        }
        // Each mask shows the object as if it were elsewhere.
        assert!(matches!(refused(&held.views()), ModelError::NoBaseline), "{turned}");
    }
}

#[test]
fn settings_out_of_range_are_refused_by_name() {
    let scene = Scene::new(&pair());
    let refused = |settings| {
        let error =
            progressive(&given(&scene.views()), &settings, &mut |_, _, _| true).unwrap_err();
        error.to_string()
    };
    assert!(refused(exactly(0)).starts_with("max_ellipsoids must be 1 to 64"));
    assert!(refused(exactly(65)).contains("but it is 65"));
    for delta in [-0.1, 1.0, f64::NAN] {
        assert!(refused(exactly(2).with(|it| it.delta = delta)).starts_with("delta must be"));
    }
}

#[test]
fn weights_out_of_range_are_refused_by_name() {
    let scene = Scene::new(&pair());
    let views = scene.views();
    for bad in [-1.0, f64::NAN, f64::INFINITY] {
        let wrong = [
            ("silhouette_weight", Weights::default().with(|it| it.silhouettes = bad)),
            ("volume_weight", Weights::default().with(|it| it.volume = bad)),
            ("depth_weight", Weights::default().with(|it| it.depth = bad)),
        ];
        for (expected, weights) in wrong {
            let given = ModelInput::default().with(|it| {
                it.views = &views;
                it.weights = weights;
            });
            let refused = progressive(&given, &exactly(1), &mut |_, _, _| true).unwrap_err();
            assert!(matches!(refused, ModelError::Setting { name, .. } if name == expected));
        }
    }
}

#[test]
fn whoever_watches_can_stop_the_work() {
    let scene = Scene::new(&pair());
    let mut calls = 0;
    let stopped = progressive(&given(&scene.views()), &exactly(4), &mut |_, _, _| {
        calls += 1;
        false
    });
    assert_eq!(stopped, Err(ModelError::Stopped));
    assert!(calls >= 1);
}

#[test]
fn each_ellipsoid_takes_the_colour_of_the_pixels_in_which_it_is_foremost() {
    let scene = Scene::new(&pair());
    let body = Body::new(Pose::identity(), pair()).unwrap();
    let one = |index: usize, pose: &Pose| {
        let alone = Body::new(Pose::identity(), vec![pair()[index]]).unwrap();
        silhouette(&alone, &scene.camera, pose)
    };
    let paint = |pose: &Pose| -> Vec<u8> {
        // Where both are seen the pixel is grey, which does not affect a median.
        let both = one(0, pose).into_iter().zip(one(1, pose));
        both.flat_map(|pixel| match pixel {
            (255, 0) => [220, 20, 10],
            (0, 255) => [10, 30, 230],
            _ => [128; 3],
        })
        .collect()
    };
    let bytes: Vec<Vec<u8>> = scene.poses.iter().map(paint).collect();
    let images: Vec<_> =
        bytes.iter().map(|b| ImageView::new(b, SIZE, Channels::Rgb).unwrap()).collect();
    let colors = ellipsoid_colors(&body, &scene.views(), &images).unwrap();
    assert_eq!(colors, [[220, 20, 10], [10, 30, 230]]);
    assert!(ellipsoid_colors(&body, &scene.views(), &images[..2]).is_err());
}

/// A dumbbell as a closed mesh: two balls of different sizes, side by side.
pub fn dumbbell() -> Mesh {
    let (rings, around) = (16_usize, 24_usize);
    let (mut corners, mut faces) = (vec![], vec![]);
    for (center, radius) in [(-0.06, 0.05), (0.06, 0.03)] {
        let first = corners.len();
        for ring in 0..=rings {
            let polar = std::f64::consts::PI * ring as f64 / rings as f64;
            for step in 0..around {
                let turn = std::f64::consts::TAU * step as f64 / around as f64;
                let out = radius * polar.sin();
                corners.push([center + out * turn.cos(), out * turn.sin(), radius * polar.cos()]);
            }
        }
        let at = |ring: usize, step: usize| first + ring * around + step % around;
        for ring in 0..rings {
            for step in 0..around {
                faces.push([at(ring, step), at(ring + 1, step), at(ring + 1, step + 1)]);
                faces.push([at(ring, step), at(ring + 1, step + 1), at(ring, step + 1)]);
            }
        }
        // At the poles a ring is a single position: its vertices are one.
        for ring in [0, rings] {
            let pole = at(ring, 0);
            let ends = at(ring, 0)..=at(ring, around - 1);
            for face in &mut faces {
                face.iter_mut().filter(|i| ends.contains(*i)).for_each(|i| *i = pole);
            }
        }
    }
    faces.retain(|[a, b, c]| a != b && b != c && c != a);
    Mesh::new(corners, faces).unwrap()
}

pub fn model_mesh(mesh: &Mesh, settings: &Settings) -> Vec<Step> {
    let given = ModelInput::default().with(|it| it.mesh = Some(mesh));
    progressive(&given, settings, &mut |_, _, _| true).unwrap()
}

#[test]
fn a_mesh_of_two_balls_is_two_ellipsoids() {
    holds("modelling a mesh");
}

#[test]
fn a_mesh_is_fitted_better_by_each_ellipsoid_with_the_same_bits_on_any_thread_count() {
    let on = |threads| model_mesh(&dumbbell(), &exactly(3).with(|it| it.threads = threads));
    let steps = on(1);
    assert_eq!(steps.iter().map(|s| s.body.ellipsoids().len()).collect::<Vec<_>>(), [1, 2, 3]);
    assert!(steps.windows(2).all(|pair| pair[1].fitness >= pair[0].fitness));
    assert_eq!(on(2), steps);
}

#[test]
fn evidence_that_is_held_out_finds_the_count_that_the_views_bear() {
    holds("modelling held out");
}

/// Lines of sight to a ball about the origin from all around, from the top down.
pub fn samples(radius: f64) -> Vec<RangeSample> {
    let sample = |i: usize| {
        let unit = even_direction(i, 1.0 - (2 * i + 1) as f64 / 400.0);
        RangeSample { point: unit * radius, direction: -unit, eye: 0.0 }
    };
    (0..400).map(sample).collect()
}

#[test]
fn what_few_views_show_is_modelled_though_no_point_of_it_was_measured() {
    let scene =
        Scene::new(&[solid([0.0; 3], [0.05; 3]), solid([0.07, 0.0, 0.0], [0.05, 0.02, 0.02])]);
    let (views, samples) = (scene.views(), samples(0.05));
    let views = &views[..2];
    let given = ModelInput::default().with(|it| (it.views, it.samples) = (views, &samples));
    let settings = Settings::default().with(|it| it.held_out = true).quick();
    let steps = progressive(&given, &settings, &mut |_, _, _| true).unwrap();
    let overlaps = silhouette_ious(&steps.last().unwrap().body, views);
    assert!(overlaps.iter().all(|overlap| *overlap > 0.95), "{overlaps:?}");
}

#[test]
fn what_has_no_weight_is_not_held_out_to_choose_by() {
    let scene = Scene::new(&[solid([0.0; 3], [0.05; 3])]);
    let (all_views, all_samples) = (scene.views(), samples(0.05));
    let fit = |views: usize, samples: usize, silhouettes: f64, depth: f64, held_out: bool| {
        let weights = Weights::default().with(|it| {
            it.silhouettes = silhouettes;
            it.depth = depth;
        });
        let (views, samples) = (&all_views[..views], &all_samples[..samples]);
        let given = ModelInput::default().with(|it| {
            it.views = views;
            it.samples = samples;
            it.weights = weights;
        });
        let settings = Settings::default()
            .with(|it| {
                it.held_out = held_out;
                it.max_ellipsoids = 2;
            })
            .quick();
        progressive(&given, &settings, &mut |_, _, _| true)
    };
    let all = all_views.len();
    // Enough evidence without weight, too little with weight: all of it is used to model from.
    for (views, samples, silhouettes, depth) in [(3, 400, 1.0, 0.0), (all, 100, 0.0, 1.0)] {
        let chosen = fit(views, samples, silhouettes, depth, true).unwrap();
        assert_eq!(chosen, fit(views, samples, silhouettes, depth, false).unwrap());
    }
    for held_out in [true, false] {
        assert_eq!(fit(all, 400, 0.0, 0.0, held_out).unwrap_err(), ModelError::Nothing);
    }
}

/// Models an object that is marked in one image and painted in all; returns the overlaps.
pub fn painted_initial(settings: &Settings) -> Vec<f64> {
    let truth = solid([0.0, 0.0, 0.0], [0.05, 0.04, 0.03]);
    let scene = Scene::new(&[truth]);
    let views = scene.views();
    let paint = |view: &View<'_>| -> Vec<u8> {
        let drawn =
            silhouette(&Body::around(&[truth]).unwrap(), view.camera(), &view.world_from_camera());
        let color = |&m: &u8| if m == 0 { [60, 90, 70] } else { [200, 60, 40] };
        drawn.iter().flat_map(color).collect()
    };
    let pictures: Vec<Vec<u8>> = views.iter().map(paint).collect();
    let image = |i: usize| {
        ImageView::new(&pictures[i], views[i].camera().size_px(), Channels::Rgb).unwrap()
    };
    let unmasked: Vec<UnmaskedImage<'_>> = (1..views.len())
        .map(|i| UnmaskedImage {
            camera: *views[i].camera(),
            world_from_camera: views[i].world_from_camera(),
            image: image(i),
        })
        .collect();
    let body = initial_body(&[(views[0], image(0))], &unmasked, &[], settings).unwrap();
    silhouette_ious(&body, &views)
}

#[test]
fn an_object_marked_in_one_picture_is_found_in_the_others_by_its_colour() {
    holds("modelling unmarked pictures");
}
