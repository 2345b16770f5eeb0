//! Laws of the paper's own tracker, on drawn images of a body that moves.

use crate::scenes::holds;
use nalgebra::{UnitQuaternion, Vector3};
use servoid::camera::{Camera, Channels, ImageView, Mask, Observation};
use servoid::fitness::Margin;
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid, silhouette};
use servoid::track::{
    Estimate, Genes, Notice, Objective, OneStep, OneStepError, OneStepSettings, Status,
};

const SIZE: [usize; 2] = [320, 240];
const GREEN: [u8; 3] = [40, 160, 70];
const RED: [u8; 3] = [180, 60, 50];

fn camera() -> Camera {
    Camera::new(SIZE, [300.0, 300.0], [160.0, 120.0]).unwrap()
}

/// Two cameras, 160 mm apart, rotated so that the gene axes are not those of the world.
pub fn eyes() -> Vec<Pose> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.3, 0.2));
    let eye = |x: f64| Pose::from_rotation(turn, turn * Vector3::new(x, 0.0, 0.0));
    vec![eye(-0.08), eye(0.08)]
}

pub fn at(x: f64, y: f64, z: f64) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.5, -0.2));
    eyes()[0] * Pose::from_rotation(turn, Vector3::new(0.08 + x, y, 0.5 + z))
}

fn solid(center: [f64; 3], radii: [f64; 3]) -> Ellipsoid {
    Ellipsoid::new(0, center, radii, [1.0, 0.0, 0.0, 0.0]).unwrap()
}

/// The paper's target: one ellipsoid with axes of 90 and 45 mm.
pub fn egg() -> Body {
    Body::new(Pose::identity(), vec![solid([0.0; 3], [0.045, 0.0225, 0.0225])]).unwrap()
}

/// A body whose rotations are visible.
pub fn duck() -> Body {
    let (trunk, head) = ([0.05, 0.03, 0.02], [0.02, 0.02, 0.02]);
    let parts = vec![solid([0.0; 3], trunk), solid([0.045, 0.03, 0.0], head)];
    Body::new(Pose::identity(), parts).unwrap()
}

fn drawn(body: &Body, pose: Option<Pose>, noise: u32) -> Vec<Vec<u8>> {
    drawn_of(0, body, pose, noise)
}

/// One image per camera: the body in green in front of grey noise.
pub fn drawn_of(seed: u64, body: &Body, pose: Option<Pose>, noise: u32) -> Vec<Vec<u8>> {
    let noise = noise.wrapping_add(1000 * seed as u32);
    let mut state = noise.wrapping_mul(747_796_405).wrapping_add(1);
    let mut draw = |eye: &Pose| {
        let mask = pose.map(|pose| silhouette(&body.at(pose), &camera(), eye));
        let color = |pixel: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let shade = (state >> 27) as u8;
            let on = mask.as_ref().is_some_and(|mask| mask[pixel] != 0);
            (if on { GREEN } else { [120; 3] }).map(|channel| channel + shade)
        };
        (0..SIZE[0] * SIZE[1]).flat_map(color).collect()
    };
    eyes().iter().map(&mut draw).collect()
}

fn view(bytes: &[u8]) -> ImageView<'_> {
    ImageView::new(bytes, SIZE, Channels::Rgb).unwrap()
}

pub fn observed(images: &[Vec<u8>], time_s: f64) -> Observation<'_> {
    let images = images.iter().map(|image| Some(view(image))).collect();
    Observation { time_s, world_from_camera: eyes(), images, depths: Vec::new() }
}

pub fn started(body: &Body, pose: Pose, settings: OneStepSettings) -> OneStep {
    let mut tracker = OneStep::new(&[camera(), camera()], body, settings).unwrap();
    let images = drawn_of(settings.seed, body, Some(pose), 0);
    tracker.start(&observed(&images, 0.0), pose, &[]).unwrap();
    tracker
}

/// Tracks the poses after the first, one image each.
pub fn followed(body: &Body, poses: &[Pose], settings: OneStepSettings) -> Vec<Estimate> {
    let mut tracker = started(body, poses[0], settings);
    let step = |(index, pose): (usize, &Pose)| {
        let images = drawn_of(settings.seed, body, Some(*pose), index as u32);
        tracker.step(&observed(&images, 0.03 * index as f64)).unwrap()
    };
    poses.iter().enumerate().skip(1).map(step).collect()
}

fn place() -> OneStepSettings {
    OneStepSettings::default().with(|it| it.genes = Genes::Place)
}

fn pose() -> OneStepSettings {
    OneStepSettings::default()
}

/// The paper's motion along x, in images 1/30 s apart; its fastest is 2.1 mm per image.
pub fn swing(index: usize) -> Pose {
    at(0.04 - 0.1 * (0.628 * index as f64 / 30.0).cos() + 0.06, -0.01, 0.0)
}

#[test]
fn on_a_still_image_the_best_score_never_falls() {
    for settings in [place(), pose(), pose().with(|it| it.objective = Objective::Region)] {
        let mut tracker = started(&duck(), at(0.0, 0.0, 0.0), settings);
        let images = drawn(&duck(), Some(at(0.006, -0.004, 0.01)), 1);
        let mut before = f64::NEG_INFINITY;
        for index in 1..60 {
            tracker.step(&observed(&images, 0.1 * f64::from(index))).unwrap();
            let now = tracker.best_score().unwrap();
            assert!(now >= before, "image {index}: {now} after {before}");
            before = now;
        }
    }
}

#[test]
fn an_image_is_one_generation() {
    let search = place().search.with(|it| it.population = 37);
    let settings = place().with(|it| it.search = search);
    let poses: Vec<_> = (0..5).map(swing).collect();
    let counts: Vec<_> =
        followed(&egg(), &poses, settings).iter().map(|estimate| estimate.evaluations).collect();
    assert_eq!(counts, [37; 4]);
}

#[test]
fn genes_of_place_never_turn_the_object() {
    let turned = at(0.0, 0.0, 0.0).rotation();
    let turning = |index: usize| {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.0, 0.0, 0.02 * index as f64));
        Pose::from_rotation(turned * turn, swing(index).translation())
    };
    let poses: Vec<_> = (0..30).map(turning).collect();
    for estimate in followed(&duck(), &poses, place()) {
        assert_eq!(estimate.world_from_object.rotation(), turned);
        assert_eq!(estimate.covariance.fixed_view::<3, 3>(3, 3).norm(), 0.0);
    }
}

#[test]
fn a_given_orientation_is_held_from_then_on() {
    let mut tracker = started(&egg(), swing(0), place());
    let given = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 0.5, -0.2));
    tracker.set_orientation(given).unwrap();
    let truth = Pose::from_rotation(given, swing(1).translation());
    let images = drawn(&egg(), Some(truth), 1);
    let estimate = tracker.step(&observed(&images, 0.1)).unwrap();
    assert_eq!(estimate.world_from_object.rotation(), given);
}

#[test]
fn a_moving_ellipsoid_is_followed_within_millimetres_across_the_line_of_sight() {
    holds("one step egg by points");
    holds("one step egg by region");
}

#[test]
fn six_genes_follow_an_object_that_turns() {
    holds("one step duck by points");
    holds("one step duck by region");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_any_thread_count() {
    let poses: Vec<_> = (0..12).map(swing).collect();
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = pose().with(|it| it.seed = seed);
        let estimates = pool.install(|| followed(&duck(), &poses, settings));
        let numbers = |e: &Estimate| (e.world_from_object, e.covariance, e.confidence);
        estimates.iter().map(numbers).collect::<Vec<_>>()
    };
    let one = with(1, 5);
    assert_eq!(one, with(4, 5));
    assert_ne!(one, with(1, 6));
}

#[test]
fn an_object_that_is_gone_is_sought_then_lost_then_found_where_it_was() {
    holds("one step gone");
}

#[test]
fn an_object_of_unknown_colour_is_not_taken_for_the_object() {
    let here = at(0.0, 0.0, 0.0);
    let mut tracker = started(&egg(), here, place());
    let mut images = drawn(&egg(), Some(here), 1);
    for image in &mut images {
        for pixel in image.chunks_exact_mut(3).filter(|pixel| pixel[0] < 100) {
            pixel.copy_from_slice(&RED);
        }
    }
    assert_eq!(tracker.step(&observed(&images, 0.1)).unwrap().status, Status::Searching);
}

#[test]
fn a_missing_or_wrong_image_is_a_notice_and_the_others_go_on() {
    let here = at(0.0, 0.0, 0.0);
    let mut tracker = started(&egg(), here, place());
    let images = drawn(&egg(), Some(here), 1);
    let small = [0; 12];
    let wrong = ImageView::new(&small, [2, 2], Channels::Rgb).unwrap();
    let notices = [
        (None, Notice::NoImage(1)),
        (Some(wrong), Notice::WrongSize { camera: 1, expected: SIZE, given: [2, 2] }),
    ];
    for (index, (image, notice)) in notices.into_iter().enumerate() {
        let mut observation = observed(&images, 1.0 + index as f64);
        observation.images[1] = image;
        let estimate = tracker.step(&observation).unwrap();
        assert_eq!(estimate.notices, [notice]);
        assert_eq!(estimate.status, Status::Tracking);
    }
}

#[test]
fn an_object_beside_one_image_is_followed_in_the_other() {
    let aside = at(-0.27, 0.0, 0.0);
    let mut tracker = started(&egg(), aside, place());
    let images = drawn(&egg(), Some(aside), 1);
    let estimate = tracker.step(&observed(&images, 0.1)).unwrap();
    assert_eq!(estimate.notices, [Notice::OutOfImage(1)]);
    assert_eq!(estimate.status, Status::Tracking);
}

#[test]
fn without_any_image_the_pose_is_kept_and_the_object_sought() {
    let mut tracker = started(&egg(), swing(0), place());
    let images = drawn(&egg(), Some(swing(1)), 1);
    let before = tracker.step(&observed(&images, 0.1)).unwrap();
    let mut observation = observed(&images, 0.2);
    observation.images = vec![None, None];
    let estimate = tracker.step(&observation).unwrap();
    assert_eq!(estimate.notices, [Notice::NoImage(0), Notice::NoImage(1)]);
    assert_eq!(estimate.status, Status::Searching);
    assert_eq!((estimate.evaluations, estimate.confidence), (0, 0.0));
    assert_eq!(estimate.world_from_object, before.world_from_object);
}

#[test]
fn time_that_does_not_go_on_is_a_notice() {
    let mut tracker = started(&egg(), swing(0), place());
    let images = drawn(&egg(), Some(swing(0)), 1);
    let estimate = tracker.step(&observed(&images, -1.0)).unwrap();
    assert_eq!(estimate.notices, [Notice::Time { before: 0.0, now: -1.0 }]);
}

#[test]
fn the_start_gives_the_pose_that_was_given_and_learns_from_masks_as_from_the_outline() {
    let here = at(0.0, 0.0, 0.0);
    let images = drawn(&egg(), Some(here), 0);
    let outlines: Vec<_> =
        eyes().iter().map(|eye| silhouette(&egg().at(here), &camera(), eye)).collect();
    let mask =
        |bytes| Some(Mask::new(ImageView::new(bytes, SIZE, Channels::Grey).unwrap()).unwrap());
    let masks: Vec<_> = outlines.iter().map(|bytes| mask(bytes)).collect();
    let start = |masks: &[Option<Mask<'_>>]| {
        let mut tracker = OneStep::new(&[camera(), camera()], &egg(), pose()).unwrap();
        let estimate = tracker.start(&observed(&images, 0.0), here, masks).unwrap();
        assert_eq!((estimate.world_from_object, estimate.status), (here, Status::Tracking));
        assert!(estimate.confidence > 0.99, "{}", estimate.confidence);
        let estimate = tracker.step(&observed(&images, 0.1)).unwrap();
        (estimate.world_from_object, estimate.covariance)
    };
    assert_eq!(start(&[]), start(&masks));
}

#[test]
fn a_mask_beside_the_egg_at_the_given_pose_is_reported() {
    let (here, aside) = (at(0.0, 0.0, 0.0), at(0.15, 0.0, 0.0));
    let images = drawn(&egg(), Some(here), 0);
    let bytes = silhouette(&egg().at(aside), &camera(), &eyes()[1]);
    let mask = Mask::new(ImageView::new(&bytes, SIZE, Channels::Grey).unwrap()).unwrap();
    let mut tracker = OneStep::new(&[camera(), camera()], &egg(), pose()).unwrap();
    let estimate = tracker.start(&observed(&images, 0.0), here, &[None, Some(mask)]).unwrap();
    assert_eq!(estimate.notices, [Notice::MaskElsewhere { camera: 1, inside: 0.0 }]);
}

#[test]
fn the_spin_of_a_body_of_revolution_is_left_open_and_that_of_a_duck_is_not() {
    holds("one step spin");
}

#[test]
fn what_cannot_be_tracked_is_an_error() {
    let cameras = [camera(), camera()];
    let new = |settings| OneStep::new(&cameras, &egg(), settings).err();
    let points = |count, alpha| Objective::Points { count, alpha: Margin::Share(alpha) };
    for settings in [
        pose().with(|it| it.reach = 0.0),
        pose().with(|it| it.turn = f64::NAN),
        pose().with(|it| it.tracking_from = 1.5),
        pose().with(|it| it.missing_below = 0.6),
        pose().with(|it| it.lost_after = 0),
        pose().with(|it| it.objective = points(0, 0.3)),
        pose().with(|it| it.objective = points(100, -1.0)),
        pose().with(|it| it.search = pose().search.with(|it| it.population = 1)),
    ] {
        assert!(new(settings).is_some(), "{settings:?}");
    }
    assert!(OneStep::new(&[], &egg(), pose()).is_err());
    let mut tracker = OneStep::new(&cameras, &egg(), pose()).unwrap();
    let images = drawn(&egg(), Some(swing(0)), 0);
    let step = tracker.step(&observed(&images, 0.0));
    assert_eq!(step, Err(OneStepError::NotStarted));
    let behind = at(0.0, 0.0, -2.0);
    let start = tracker.start(&observed(&images, 0.0), behind, &[]);
    assert_eq!(start, Err(OneStepError::Unseen { images: 2 }));
    let start = tracker.start(&observed(&images, 0.0), swing(0), &[None]);
    assert!(matches!(start, Err(OneStepError::Observation(_))));
    let short = Observation { world_from_camera: vec![], ..observed(&images, 0.0) };
    assert!(matches!(tracker.start(&short, swing(0), &[]), Err(OneStepError::Observation(_))));
}
