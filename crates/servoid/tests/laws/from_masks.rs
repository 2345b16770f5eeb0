//! Laws of estimating a body's pose from masks, on drawn silhouettes.

use crate::scenes::holds_for;
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use servoid::camera::{Camera, Channels, ImageView, Mask, RigError, View};
use servoid::fitness::{Fitness, Overlap, OverlapView};
use servoid::pose::{Pose, even_turn};
use servoid::shape::{Body, Ellipsoid, Projection, silhouette};
use servoid::track::{MaskFit, TrackError, pose_from_masks};

const SIZE: [usize; 2] = [320, 240];
const COLORS: [[u8; 3]; 3] = [[200, 60, 40], [40, 160, 60], [50, 70, 200]];

fn camera() -> Camera {
    Camera::new(SIZE, [400.0, 400.0], [159.5, 119.5]).unwrap()
}

/// Two cameras, 120 mm apart, in oblique orientations.
fn eyes() -> [Pose; 2] {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.3, 0.2));
    [0.0, 0.12].map(|x| Pose::from_rotation(turn, turn * Vector3::new(x, 0.0, 0.0)))
}

pub fn body(parts: &[([f64; 3], [f64; 3])]) -> Body {
    let solid = |(index, &(center, radii)): (usize, &([f64; 3], [f64; 3]))| {
        Ellipsoid::new(index, center, radii, [1.0, 0.0, 0.0, 0.0]).unwrap()
    };
    Body::new(Pose::identity(), parts.iter().enumerate().map(solid).collect()).unwrap()
}

/// A hand with a thumb: no two orientations look alike from all sides.
pub fn hand() -> Body {
    body(&[
        ([0.0, 0.0, 0.0], [0.06, 0.03, 0.02]),
        ([0.06, 0.03, 0.0], [0.02, 0.045, 0.015]),
        ([-0.05, 0.02, 0.03], [0.02, 0.02, 0.03]),
    ])
}

/// A bar with a different colour at each end: its outline is the same after half a rotation.
pub fn bar() -> Body {
    body(&[
        ([0.0, 0.0, 0.0], [0.07, 0.02, 0.01]),
        ([0.05, 0.0, 0.0], [0.03, 0.03, 0.03]),
        ([-0.05, 0.0, 0.0], [0.03, 0.03, 0.03]),
    ])
}

/// A different pose for each step; its position is one of six.
pub fn somewhere(step: usize) -> Pose {
    let share = |by: f64| (by * (step + 1) as f64).fract();
    let (x, z) = (0.05 - 0.02 * (step % 6) as f64, 0.55 + 0.03 * (step % 6) as f64);
    let place = Vector3::new(x, -0.03, z);
    eyes()[0] * Pose::from_rotation(even_turn(share(0.82), share(0.67), share(0.55)), place)
}

/// Draws the masks of a body, and its ellipsoids in their colours, each over the previous ones.
pub fn drawn(body: &Body) -> Vec<(Vec<u8>, Vec<u8>)> {
    eyes().map(|eye| (silhouette(body, &camera(), &eye), painted(body, &eye))).to_vec()
}

fn painted(body: &Body, eye: &Pose) -> Vec<u8> {
    let mut image = vec![110; SIZE[0] * SIZE[1] * 3];
    for (ellipsoid, color) in body.ellipsoids().iter().zip(COLORS) {
        let part = Body::new(body.world_from_object(), vec![*ellipsoid]).unwrap();
        let seen = silhouette(&part, &camera(), eye);
        for (pixel, _) in image.chunks_exact_mut(3).zip(&seen).filter(|(_, seen)| **seen != 0) {
            pixel.copy_from_slice(&color.map(|c| c / 2 + 60));
        }
    }
    image
}

pub fn placed(body: &Body, drawn: &[(Vec<u8>, Vec<u8>)], seed: u64) -> Result<MaskFit, TrackError> {
    let views: Vec<_> = drawn.iter().zip(eyes()).map(|((mask, _), eye)| view(mask, eye)).collect();
    let images: Vec<_> = drawn
        .iter()
        .map(|(_, image)| ImageView::new(image, SIZE, Channels::Rgb).unwrap())
        .collect();
    pose_from_masks(body, &views, Some(&images), Some(&COLORS[..body.ellipsoids().len()]), seed)
}

fn view(mask: &[u8], eye: Pose) -> View<'_> {
    let mask = Mask::new(ImageView::new(mask, SIZE, Channels::Grey).unwrap()).unwrap();
    View::new(camera(), eye, mask).unwrap()
}

#[test]
fn a_body_is_placed_back_where_its_masks_were_drawn() {
    holds_for("placing in two masks", 0..6);
}

#[test]
fn one_mask_determines_the_orientation_too() {
    holds_for("placing in one mask", 0..3);
}

#[test]
fn colours_distinguish_orientations_with_similar_outlines() {
    holds_for("placing by colours", 0..4);
}

#[test]
fn the_pose_in_the_body_is_ignored_and_the_same_seed_gives_the_same_bits() {
    let masks = drawn(&hand().at(somewhere(2)));
    let first = placed(&hand(), &masks, 7).unwrap();
    let again = rayon_alone(|| placed(&hand().at(somewhere(4)), &masks, 7).unwrap());
    assert_eq!(first, again);
}

/// Runs on one thread.
fn rayon_alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(work)
}

#[test]
fn a_body_that_does_not_fit_is_refused() {
    holds_for("placing what does not fit", 0..20);
}

#[test]
fn what_does_not_belong_together_is_refused() {
    assert_eq!(pose_from_masks(&hand(), &[], None, None, 0), Err(TrackError::NoMask));
    let looks = drawn(&hand().at(somewhere(0)));
    let views = [view(&looks[0].0, eyes()[0])];
    assert_eq!(
        pose_from_masks(&hand(), &views, Some(&[]), None, 0),
        Err(RigError::Count { what: "images", cameras: 1, given: 0 }.into())
    );
    assert_eq!(
        pose_from_masks(&hand(), &views, None, Some(&COLORS[..2]), 0),
        Err(TrackError::Colors { ellipsoids: 3, given: 2 })
    );
}

#[test]
fn the_overlap_at_a_pose_is_that_of_the_moved_body_and_its_slope_is_right() {
    let truth = somewhere(1);
    let mask = silhouette(&hand().at(truth), &camera(), &eyes()[0]);
    let overlap = Overlap::new(vec![OverlapView {
        filled: mask.iter().map(|&m| f64::from(u8::from(m != 0))).collect(),
        size_px: SIZE,
        projection: Projection::new(&camera(), &eyes()[0]),
    }]);
    let pose = truth * Pose::exp(&Vector6::new(0.004, -0.003, 0.01, 0.1, -0.05, 0.08));
    let of = |body: &Body| body.in_world().iter().map(Ellipsoid::quadric).collect::<Vec<_>>();
    let (in_object, in_world) = (of(&hand()), of(&hand().at(pose)));
    let (score, slope) = overlap.slope_at(&pose, &in_object);
    // Sums along a row are in single precision.
    for same in [overlap.score_at(&pose, &in_object), overlap.score(&in_world)] {
        assert!((score - same).abs() < 1e-5, "{score} {same}");
    }
    for way in 0..6 {
        let step = if way < 3 { 2e-4 } else { 2e-3 };
        let moved = |by: f64| {
            let twist = Vector6::from_fn(|i, _| if i == way { by } else { 0.0 });
            overlap.score_at(&(pose * Pose::exp(&twist)), &in_object)
        };
        let expected = (moved(step) - moved(-step)) / (2.0 * step);
        let scale = slope.fixed_rows::<3>(way / 3 * 3).norm();
        assert!((slope[way] - expected).abs() < 0.1 * scale, "{way}: {} {expected}", slope[way]);
    }
}
