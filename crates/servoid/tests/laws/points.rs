//! Laws of the paper's points term and of its method.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::camera::{Camera, Channels, ImageError, ImageView, Mask, RigError, View};
use servoid::fitness::{Fitness, Margin, Points, PointsError, PointsView};
use servoid::model::{ModelError, PaperSettings, Step, paper, paper_scores};
use servoid::pose::{Pose, even_turn};
use servoid::shape::{Body, Ellipsoid, silhouette};

const SIZE: [usize; 2] = [320, 240];
const COUNT: usize = 400;
const ALPHA: f64 = 0.3;

fn camera() -> Camera {
    Camera::new(SIZE, [300.0, 290.0], [158.2, 121.7]).unwrap()
}

/// A stereo pair that looks along z, as the cameras on the hand do.
fn eyes() -> [Pose; 2] {
    [-0.08, 0.08].map(|x| Pose::from_parts([x, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).unwrap())
}

fn solid(center: [f64; 3], radii: [f64; 3], turn: [f64; 4]) -> Ellipsoid {
    let [w, x, y, z] = turn;
    let unit = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Ellipsoid::new(0, center, radii, Pose::from_rotation(unit, Vector3::zeros()).quaternion())
        .unwrap()
}

fn target() -> Ellipsoid {
    solid([0.01, -0.02, 0.5], [0.06, 0.035, 0.03], [0.9, 0.1, 0.2, 0.3])
}

/// Images of where the hue matches.
fn drawn(ellipsoids: &[Ellipsoid]) -> [Vec<u8>; 2] {
    let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
    eyes().map(|eye| silhouette(&body, &camera(), &eye))
}

fn points(images: &[Vec<u8>; 2]) -> Points<'_> {
    with_margin(images, Margin::Share(ALPHA))
}

fn with_margin(images: &[Vec<u8>; 2], alpha: Margin) -> Points<'_> {
    let mut views = vec![];
    for (image, eye) in images.iter().zip(eyes()) {
        let matches = ImageView::new(image, SIZE, Channels::Grey).unwrap();
        views.push(PointsView::new(camera(), &eye, matches).unwrap());
    }
    Points::new(views, COUNT, alpha).unwrap()
}

/// Distance of a point outside the unit ball after an ellipsoid of these radii is mapped to that
/// ball.
fn excess(point: &Vector3<f64>, ellipsoid: &Ellipsoid, radii: &Vector3<f64>) -> f64 {
    let [w, x, y, z] = ellipsoid.quaternion();
    let turn = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    let local = turn.inverse_transform_vector(&(point - ellipsoid.center()));
    local.component_div(radii).norm() - 1.0
}

/// The paper's fitness, reimplemented pixel by pixel: rotation by the quaternion's matrix written
/// out, projection by hand, the pixel whose square contains the point.
fn by_hand(images: &[Vec<u8>; 2], ellipsoids: &[Ellipsoid]) -> f64 {
    let seen = |image: &[u8], eye: &Pose, point: [f64; 3]| -> f64 {
        let depth = point[2] - eye.translation().z;
        let u = 300.0 * (point[0] - eye.translation().x) / depth + 158.2;
        let v = 290.0 * (point[1] - eye.translation().y) / depth + 121.7;
        let mut found = 0.0;
        for row in 0..SIZE[1] {
            let in_row = v >= row as f64 - 0.5 && v < row as f64 + 0.5;
            for column in (0..SIZE[0]).filter(|_| in_row && depth > 0.0) {
                let hit = u >= column as f64 - 0.5 && u < column as f64 + 0.5;
                found += f64::from(u8::from(hit && image[row * SIZE[0] + column] != 0));
            }
        }
        found
    };
    let mut total = 0.0;
    for ellipsoid in ellipsoids {
        let [w, x, y, z] = ellipsoid.quaternion();
        let matrix = Matrix3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        );
        for index in 0..COUNT {
            let theta = ((2 * index + 1) as f64 / COUNT as f64 - 1.0).asin();
            let phi = index as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
            for (sign, margin) in [(1.0, 0.0), (-1.0, ALPHA)] {
                let margin = margin * ellipsoid.radii().min();
                let radii = ellipsoid.radii().map(|r| r + margin);
                let local = Vector3::new(
                    radii.x * theta.sin(),
                    radii.y * theta.cos() * phi.sin(),
                    radii.z * theta.cos() * phi.cos(),
                );
                let point = matrix * local + ellipsoid.center();
                let both = images.iter().zip(eyes()).map(|(i, eye)| seen(i, &eye, point.into()));
                total += sign * both.sum::<f64>() / 2.0;
            }
        }
    }
    total / COUNT as f64
}

fn solids() -> impl Strategy<Value = Ellipsoid> {
    let centers = (-0.25..0.25_f64, -0.2..0.2_f64, -0.1..0.9_f64);
    (centers, prop::array::uniform3(0.004..0.12_f64), prop::array::uniform3(0.0..1.0_f64)).prop_map(
        |((x, y, z), radii, turn)| {
            let turn = even_turn(turn[0], turn[1], turn[2]);
            let turn = Pose::from_rotation(turn, Vector3::zeros()).quaternion();
            Ellipsoid::new(0, [x, y, z], radii, turn).unwrap()
        },
    )
}

proptest! {
    #[test]
    fn points_lie_on_the_surface_and_on_the_envelope(ellipsoid in solids()) {
        let images = drawn(&[target()]);
        let radii = ellipsoid.radii();
        let mut sum = Vector3::zeros();
        for [on, out] in points(&images).pairs_in_world(&ellipsoid) {
            prop_assert!(excess(&on, &ellipsoid, &radii).abs() < 1e-9);
            prop_assert!(excess(&out, &ellipsoid, &radii.add_scalar(ALPHA * radii.min())).abs() < 1e-9);
            sum += on - ellipsoid.center();
        }
        // They are spread over the whole surface.
        prop_assert!(sum.norm() / COUNT as f64 <= 0.01 * radii.max());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]
    #[test]
    fn the_fitness_is_that_of_equation_seven_by_hand(body in prop::collection::vec(solids(), 1..4)) {
        let images = drawn(&[target()]);
        let body = [body, vec![target()]].concat();
        let (fast, slow) = (points(&images).fitness(&body), by_hand(&images, &body));
        prop_assert!((fast - slow).abs() < 1e-9, "{fast} {slow}");
    }
}

#[test]
fn a_sum_over_ellipsoids_is_the_sum_of_each() {
    let images = drawn(&[target()]);
    let points = points(&images);
    let other = solid([0.0, 0.0, 0.52], [0.03, 0.04, 0.03], [1.0, 0.2, 0.0, 0.5]);
    let alone = points.fitness(&[target()]);
    let apart = alone + points.fitness(&[other]);
    assert!((points.fitness(&[target(), other]) - apart).abs() < 1e-12);
    assert!((points.fitness(&[target(), target()]) - 2.0 * alone).abs() < 1e-12);
    assert_eq!(points.fitness(&[]), 0.0);
}

#[test]
fn what_no_camera_sees_matches_nothing() {
    let images = [vec![255; SIZE[0] * SIZE[1]], vec![255; SIZE[0] * SIZE[1]]];
    let points = points(&images);
    for center in [[0.0, 0.0, -0.5], [4.0, 0.0, 0.5], [0.0, -4.0, 0.5], [0.0, 1e50, 1e-50]] {
        assert_eq!(points.fitness(&[solid(center, [0.05; 3], [1.0, 0.0, 0.0, 0.0])]), 0.0);
    }
}

#[test]
fn the_fitness_is_greatest_at_the_target_among_those_moved_along_the_image_or_resized() {
    let truth = solid([0.01, -0.02, 0.5], [0.06, 0.035, 0.03], [1.0, 0.0, 0.0, 0.0]);
    let images = drawn(&[truth]);
    let points = points(&images);
    let best = points.fitness(&[truth]);
    assert!(best > 0.2, "{best}");
    let by = |shift: [f64; 3], stretch: [f64; 3]| {
        let center = truth.center() + Vector3::from(shift);
        let radii = truth.radii().component_mul(&Vector3::from(stretch));
        points.fitness(&[solid(center.into(), radii.into(), truth.quaternion())])
    };
    let (still, same) = ([0.0; 3], [1.0; 3]);
    for axis in [0, 1] {
        for (shift, stretch) in [(-0.006, 0.85), (0.006, 1.15), (-0.02, 0.7), (0.02, 1.3)] {
            let (mut moved, mut resized) = (still, same);
            moved[axis] = shift;
            resized[axis] = stretch;
            assert!(by(moved, same) < best, "{axis} {shift}");
            assert!(by(still, resized) < best, "{axis} {stretch}");
        }
    }
}

#[test]
fn a_hypothesis_of_quadrics_scores_as_its_ellipsoids_do() {
    let images = drawn(&[target()]);
    let points = points(&images);
    // With decreasing radii these are the principal axes in their order.
    let (one, two) = (points.score(&[target().quadric()]), points.fitness(&[target()]));
    assert!((one - two).abs() < 0.02, "{one} {two}");
    assert_eq!(points.scores(&[target().quadric(); 3], 1), vec![one; 3]);
}

#[test]
fn what_makes_no_points_term_is_refused() {
    let image = vec![1; SIZE[0] * SIZE[1]];
    let grey = ImageView::new(&image, SIZE, Channels::Grey).unwrap();
    let view = PointsView::new(camera(), &Pose::identity(), grey).unwrap();
    let none = Points::new(vec![], 10, Margin::Share(0.1)).map(|_| ());
    assert_eq!(none, Err(PointsError::Rig(RigError::NoCamera)));
    let made = |count, alpha| Points::new(vec![view], count, alpha).map(|_| ());
    for count in [0, Points::MAX_COUNT + 1] {
        assert!(
            matches!(made(count, Margin::Share(0.1)), Err(PointsError::Count { given, .. }) if given == count)
        );
    }
    for alpha in [0.0, -0.1, f64::NAN, f64::INFINITY] {
        for margin in [Margin::Share(alpha), Margin::Metres(alpha)] {
            assert!(matches!(made(10, margin), Err(PointsError::Alpha(_))), "{alpha}");
        }
    }
    let small = ImageView::new(&image[..12], [4, 3], Channels::Grey).unwrap();
    let rgb = ImageView::new(&image[..12], [2, 2], Channels::Rgb).unwrap();
    let made = |image| PointsView::new(camera(), &Pose::identity(), image).map(|_| ());
    assert!(matches!(made(small), Err(PointsError::Rig(RigError::ImageSize { .. }))));
    assert_eq!(made(rgb), Err(PointsError::Image(ImageError::MaskChannels)));
}

fn views(images: &[Vec<u8>; 2]) -> Vec<View<'_>> {
    let mut views = vec![];
    for (image, eye) in images.iter().zip(eyes()) {
        let image = ImageView::new(image, SIZE, Channels::Grey).unwrap();
        views.push(View::new(camera(), eye, Mask::new(image).unwrap()).unwrap());
    }
    views
}

fn model(images: &[Vec<u8>; 2], settings: PaperSettings) -> Result<Vec<Step>, ModelError> {
    paper(&views(images), &settings, &mut |_, _, _| true)
}

fn settings() -> PaperSettings {
    PaperSettings::default().with(|it| {
        it.generations = 30;
        it.points = 100;
    })
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_thread_count() {
    let images = drawn(&[target()]);
    let on = |threads| model(&images, settings().with(|it| it.threads = threads)).unwrap();
    assert_eq!(on(1), on(3));
    assert_ne!(on(1), model(&images, settings().with(|it| it.seed = 1)).unwrap());
}

#[test]
fn later_centres_lie_on_the_first_surface_and_each_gain_reaches_delta() {
    let images = drawn(&[target()]);
    let delta = 0.02;
    let count = settings().with(|it| {
        it.max_ellipsoids = 4;
        it.delta = delta;
    });
    let steps = model(&images, count).unwrap();
    assert!((1..=4).contains(&steps.len()));
    let last = steps.last().unwrap().body.in_world();
    let (first, later) = last.split_first().unwrap();
    for ellipsoid in later {
        assert!(excess(&ellipsoid.center(), first, &first.radii()).abs() < 1e-9);
    }
    for pair in steps.windows(2) {
        assert!(pair[1].fitness - pair[0].fitness >= delta);
        // Existing ellipsoids are not moved again.
        for (one, two) in pair[0].body.in_world().iter().zip(pair[1].body.in_world()) {
            assert!((one.center() - two.center()).norm() < 1e-9);
            assert!((one.radii() - two.radii()).norm() < 1e-9);
        }
    }
}

#[test]
fn progress_rises_to_one_and_can_stop_the_work() {
    let images = drawn(&[target()]);
    let views = views(&images);
    let mut shares = vec![];
    let mut listen = |_: usize, _: f64, share: f64| {
        shares.push(share);
        true
    };
    paper(&views, &settings(), &mut listen).unwrap();
    assert!(shares.windows(2).all(|pair| pair[0] <= pair[1]) && shares.last() == Some(&1.0));
    let stopped = paper(&views, &settings(), &mut |_, _, share| share < 0.2);
    assert_eq!(stopped, Err(ModelError::Stopped));
    let one = paper(&views[..1], &settings(), &mut |_, _, _| true);
    assert_eq!(one, Err(ModelError::TooFewViews(1)));
}

#[test]
fn settings_out_of_their_ranges_are_refused() {
    let images = drawn(&[target()]);
    let fine = settings();
    for settings in [
        fine.with(|it| it.max_ellipsoids = 0),
        fine.with(|it| it.max_ellipsoids = Body::MAX_ELLIPSOIDS + 1),
        fine.with(|it| it.delta = f64::NAN),
        fine.with(|it| it.delta = -0.1),
        fine.with(|it| it.generations = 0),
    ] {
        let refused = model(&images, settings);
        assert!(matches!(refused, Err(ModelError::Setting { .. })), "{settings:?}");
    }
    let thin = model(&images, fine.with(|it| it.alpha = Margin::Metres(0.0)));
    assert_eq!(thin, Err(ModelError::Points(PointsError::Alpha(0.0))));
    let none = model(&images, fine.with(|it| it.points = 0));
    assert!(matches!(none, Err(ModelError::Points(PointsError::Count { .. }))));
}

#[test]
fn with_a_margin_in_metres_a_splinter_wins_and_with_a_share_what_fills_the_target() {
    let images = drawn(&[target()]);
    for seed in 0..3 {
        let longest = |alpha| {
            let base = settings().with(|it| {
                it.max_ellipsoids = 1;
                it.generations = 100;
            });
            let steps = model(
                &images,
                base.with(|it| {
                    it.alpha = alpha;
                    it.seed = seed;
                }),
            )
            .unwrap();
            steps[0].body.ellipsoids()[0].radii().max() / target().radii().max()
        };
        let (share, metres) = (longest(Margin::Share(0.3)), longest(Margin::Metres(0.003)));
        assert!(share > 0.7 && metres < 0.6, "{seed}: {share} {metres}");
    }
}

#[test]
fn many_poses_score_what_each_scores_on_any_number_of_threads() {
    let images = drawn(&[target()]);
    let body = Body::around(&[target()]).unwrap();
    let masks = images
        .each_ref()
        .map(|image| Mask::new(ImageView::new(image, SIZE, Channels::Grey).unwrap()).unwrap());
    let views: Vec<_> = masks
        .into_iter()
        .zip(eyes())
        .map(|(mask, eye)| View::new(camera(), eye, mask).unwrap())
        .collect();
    let poses: Vec<_> = (0..600)
        .map(|index| {
            let off = Vector3::new(1e-4 * f64::from(index) - 0.03, 0.0, 0.0);
            let pose = body.world_from_object();
            Pose::from_rotation(pose.rotation(), pose.translation() + off)
        })
        .collect();
    let settings = PaperSettings::default().with(|it| {
        it.points = COUNT;
        it.alpha = Margin::Share(ALPHA);
    });
    let scores = |threads| {
        paper_scores(&views, &body, &poses, &settings.with(|it| it.threads = threads)).unwrap()
    };
    let one_by_one: Vec<_> =
        poses.iter().map(|pose| points(&images).fitness(&body.at(*pose).in_world())).collect();
    assert_eq!(scores(1), one_by_one);
    assert_eq!(scores(3), one_by_one);
}
