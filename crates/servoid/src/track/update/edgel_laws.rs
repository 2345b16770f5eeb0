//! Laws of edgels.

use std::array;

use crate::camera::{Camera, Channels, DepthView, ImageView, Observation};
use crate::pose::{Pose, Twist};
use crate::shape::{Body, Ellipsoid};
use crate::track::inputs::Inputs;
use crate::track::pose::refine::{Workspace, refine};
use crate::track::pose::verify::verify;
use crate::track::target::points::Feature;
use crate::track::{TrackSettings, Tracker};

const SIZE: [usize; 2] = [320, 240];
const FOCAL_PX: f64 = 400.0;
const MIDDLE_PX: [f64; 2] = [159.5, 119.5];
const BASELINE_M: f64 = 0.06;
const DISTANCE_M: f64 = 0.5;
/// A disc that faces the cameras.
const RADII_M: [f64; 3] = [0.1, 0.08, 0.005];
/// Metres between the stripes of its pattern, on average.
const STRIPE_M: f64 = 0.004;
/// Up to where there are corners, too, in metres to the right of the middle.
const CORNERS_M: f64 = -0.07;

fn place(right: f64, down: f64) -> Pose {
    Pose::exp(&Twist::new(right, down, DISTANCE_M, 0.0, 0.0, 0.0))
}

/// Returns the brightness of the disc: stripes that are straight, upright and all different, and
/// have corners on the left only.
fn stripes(x: f64, y: f64) -> f64 {
    let wave = |at: f64, times: f64| libm::sin(at / STRIPE_M * times + times);
    let crossing = if x < CORNERS_M { 2.0 * wave(y, 1.1) } else { 0.0 };
    135.0 + 20.0 * (wave(x, 1.0) + wave(x, 1.618) + wave(x, 0.577) + crossing)
}

/// Draws what a camera sees that stands some metres to the right.
fn picture(right: f64, pose: &Pose) -> Vec<u8> {
    let pixel = |i: usize| {
        let px = [i % SIZE[0], i / SIZE[0]].map(|n| n as f64);
        let at: [f64; 2] = array::from_fn(|i| (px[i] - MIDDLE_PX[i]) * DISTANCE_M / FOCAL_PX);
        let at = [at[0] + right - pose.translation().x, at[1] - pose.translation().y];
        let inside = (0..2).map(|i| (at[i] / RADII_M[i]).powi(2)).sum::<f64>() < 1.0;
        if inside { stripes(at[0], at[1]) as u8 } else { 20 }
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

/// Tracks the disc for some images before cameras at rest; the first pose is given.
struct Scene {
    tracker: Tracker,
    rights: Vec<f64>,
    measures_depth: bool,
    /// Whether another side is printed all over.
    is_printed: bool,
    images: u32,
}

impl Scene {
    fn of(rights: &[f64]) -> Self {
        let disc = Ellipsoid::new(0, [0.0; 3], RADII_M, [1.0, 0.0, 0.0, 0.0]).unwrap();
        let body = Body::new(Pose::identity(), vec![disc]).unwrap();
        let camera = Camera::new(SIZE, [FOCAL_PX; 2], MIDDLE_PX).unwrap();
        let cameras = vec![camera; rights.len()];
        let tracker = Tracker::new(&cameras, &body, TrackSettings::default()).unwrap();
        Self {
            tracker,
            rights: rights.to_vec(),
            measures_depth: false,
            is_printed: true,
            images: 0,
        }
    }

    /// Passes what the cameras see of the disc at a pose.
    fn show<T>(&mut self, pose: &Pose, to: impl FnOnce(&mut Tracker, &Observation<'_>) -> T) -> T {
        let pictures: Vec<_> = self.rights.iter().map(|right| picture(*right, pose)).collect();
        let view = |pixels| ImageView::new(pixels, SIZE, Channels::Grey).unwrap();
        let depths = vec![DISTANCE_M as f32; SIZE[0] * SIZE[1]];
        let depth = || Some(DepthView::new(&depths, SIZE).unwrap());
        let stand = |right: &f64| Pose::exp(&Twist::new(*right, 0.0, 0.0, 0.0, 0.0, 0.0));
        let observation = Observation {
            time_s: f64::from(self.images) / 30.0,
            world_from_camera: self.rights.iter().map(stand).collect(),
            images: pictures.iter().map(|pixels| Some(view(pixels))).collect(),
            depths: if self.measures_depth { vec![depth(); pictures.len()] } else { vec![] },
        };
        self.images += 1;
        to(&mut self.tracker, &observation)
    }

    /// Returns what is known of the disc after cameras saw it.
    fn learned(rights: &[f64]) -> Self {
        Self::of(rights).learn()
    }

    /// Shows the disc, which sways about its first place, until it is learned.
    fn learn(mut self) -> Self {
        self.show(&place(0.0, 0.0), |tracker, seen| tracker.start(seen, place(0.0, 0.0), &[]))
            .unwrap();
        if self.is_printed {
            let reference = &mut self.tracker.target.reference;
            (reference.most_textured, reference.most_fine) = (100.0, 1.0);
        }
        assert_eq!(self.tracker.is_surely_printed(), self.is_printed);
        for image in 1..=10 {
            let pose = place(0.001 * f64::from(image % 2), 0.0);
            let found = self.show(&pose, Tracker::step).unwrap();
            assert!(found.located);
        }
        self
    }

    fn edgels(&self) -> impl Iterator<Item = &Feature> {
        self.tracker.target.points.features.iter().filter(|one| one.is_edgel)
    }
}

#[test]
fn two_cameras_learn_edges_where_an_object_has_few_corners_and_one_camera_does_not() {
    let two = Scene::learned(&[0.0, BASELINE_M]);
    assert!(two.edgels().count() > 20, "{}", two.edgels().count());
    for edgel in two.edgels() {
        assert!(edgel.point.position.z.abs() < 0.01, "{}", edgel.point.position);
    }
    let kept = two.tracker.appearance().points();
    assert_eq!(kept + two.edgels().count(), two.tracker.surface().count(), "edgels are not kept");
    assert_eq!(Scene::learned(&[0.0]).edgels().count(), 0);
}

#[test]
fn edges_of_what_may_be_shading_are_not_learned() {
    let scene = Scene { is_printed: false, ..Scene::of(&[0.0, BASELINE_M]) };
    assert_eq!(scene.learn().edgels().count(), 0);
}

#[test]
fn a_depth_camera_alone_learns_edges() {
    let scene = Scene { measures_depth: true, ..Scene::of(&[0.0]) };
    assert!(scene.learn().edgels().count() > 20);
}

#[test]
fn a_cell_has_no_edgel_beside_a_point_and_edgels_leave_the_room_to_corners() {
    let mut scene = Scene::learned(&[0.0, BASELINE_M]);
    let features = &scene.tracker.target.points.features;
    let corners = features.iter().filter(|one| !one.is_edgel).count();
    for edgel in scene.edgels() {
        let near = |other: &Feature| {
            !other.is_edgel && (other.point.position - edgel.point.position).norm() < 0.005
        };
        assert!(!features.iter().any(near), "{}", edgel.point.position);
    }
    scene.tracker.settings.points = corners / 2;
    scene.tracker.points_in_view(&place(0.0, 0.0));
    let Workspace { in_view, .. } = &scene.tracker.workspace;
    let features = &scene.tracker.target.points.features;
    assert!(!in_view.is_empty() && in_view.iter().all(|view| !features[view.point].is_edgel));
}

#[test]
fn edges_alone_show_a_motion_across_them_and_none_along_them_and_are_never_recognised() {
    let mut scene = Scene::learned(&[0.0, BASELINE_M]);
    let (place, information) = scene.show(&place(0.002, 0.002), |tracker, seen| {
        tracker.settings.region = false;
        tracker.frame.check(seen).unwrap();
        assert!(tracker.open_windows(seen, &place(0.0, 0.0), 0.5));
        tracker.points_in_view(&place(0.0, 0.0));
        let features = &tracker.target.points.features;
        let is_striped = |feature: &Feature| feature.point.position.x > CORNERS_M + 0.01;
        let counts = |feature: &Feature| feature.is_edgel && is_striped(feature);
        tracker.workspace.in_view.retain(|view| counts(&features[view.point]));
        assert!(tracker.workspace.in_view.len() > 20);
        let inputs = Inputs::new(&tracker.frame, seen, &tracker.target, &tracker.settings);
        let found = refine(&inputs, (place(0.0, 0.0), 1), None, &mut tracker.workspace);
        let quality = verify(&inputs, &found, &mut tracker.workspace);
        assert_eq!((quality.recognised, quality.textured), (0.0, 0.0));
        let of_edges = found.normal.curvature - found.normal.prior;
        (found.pose.translation(), of_edges.diagonal())
    });
    assert!((place.x - 0.002).abs() < 1e-4, "{place}");
    assert!(information.y.abs() < 1e-4 * information.x, "{information}");
}
