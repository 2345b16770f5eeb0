//! Laws of a body that evolves in its own frame, and of synthetic views of the current body.

use crate::scenes::holds;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use servoid::camera::{Camera, Channels, ImageView, Mask, View};
use servoid::model::{
    ModelError, ModelInput, Settings, SyntheticView, evolved, half_ball_direction, silhouette_ious,
};
use servoid::pose::{Pose, Twist};
use servoid::shape::{Body, Ellipsoid, silhouette};

const SIZE: [usize; 2] = [160, 120];

pub fn solid(center: [f64; 3], radii: [f64; 3]) -> Ellipsoid {
    Ellipsoid::new(0, center, radii, [0.9, 0.1, 0.3, 0.3]).unwrap()
}

/// Two ellipsoids whose centroid is not the origin of their frame.
pub fn pair() -> Vec<Ellipsoid> {
    vec![
        solid([0.04, 0.0, 0.01], [0.09, 0.05, 0.04]),
        solid([0.07, 0.09, 0.03], [0.03, 0.05, 0.03]),
    ]
}

/// Views of ellipsoids from cameras all around.
pub struct Seen {
    camera: Camera,
    poses: Vec<Pose>,
    masks: Vec<Vec<u8>>,
}

impl Seen {
    /// Places cameras around; a seed rotates all of them about the origin.
    pub fn new(ellipsoids: &[Ellipsoid], seed: u64) -> Self {
        let camera = Camera::new(SIZE, [240.0; 2], [79.5, 59.5]).unwrap();
        let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.7, 2.4) * seed as f64);
        let place = |i: usize| {
            let eye = turn * half_ball_direction(i, 7) * 0.6;
            let look = Rotation3::face_towards(&-eye, &Vector3::x());
            Pose::from_rotation(UnitQuaternion::from_rotation_matrix(&look), eye)
        };
        let poses: Vec<_> = (0..7).map(place).collect();
        let masks = poses.iter().map(|pose| silhouette(&body, &camera, pose)).collect();
        Self { camera, poses, masks }
    }

    fn views(&self) -> Vec<View<'_>> {
        let pairs = self.poses.iter().zip(&self.masks);
        pairs
            .map(|(pose, mask)| {
                let image = ImageView::new(mask, SIZE, Channels::Grey).unwrap();
                View::new(self.camera, *pose, Mask::new(image).unwrap()).unwrap()
            })
            .collect()
    }

    /// Evolves ellipsoids, and returns the mean overlap before and after.
    pub fn evolve(&self, from: &[Ellipsoid], settings: Settings) -> (Vec<Ellipsoid>, f64, f64) {
        let views = self.views();
        let given = ModelInput::default().with(|it| it.views = &views);
        let grown = evolved(&given, from, &settings).unwrap();
        let overlap = |ellipsoids: &[Ellipsoid]| {
            let body = Body::new(Pose::identity(), ellipsoids.to_vec()).unwrap();
            let ious = silhouette_ious(&body, &views);
            ious.iter().sum::<f64>() / ious.len() as f64
        };
        (grown.clone(), overlap(from), overlap(&grown))
    }
}

/// Moves every ellipsoid by a different small amount.
pub fn disturbed(ellipsoids: &[Ellipsoid], by: f64) -> Vec<Ellipsoid> {
    let motion = |i: usize| {
        let sign = if i.is_multiple_of(2) { 1.0 } else { -1.0 };
        Pose::exp(&(Twist::new(0.01, -0.008, 0.006, 0.1, 0.15, -0.1) * (sign * by)))
    };
    ellipsoids.iter().enumerate().map(|(i, e)| e.transformed(&motion(i), 1.0 - 0.1 * by)).collect()
}

pub fn at_most(count: usize) -> Settings {
    Settings::default().with(|it| it.max_ellipsoids = count)
}

#[test]
fn a_body_comes_to_fit_what_was_seen_where_it_was_seen() {
    holds("evolving to what was seen");
}

#[test]
fn a_body_that_fits_stays() {
    holds("evolving what fits");
}

#[test]
fn an_ellipsoid_without_evidence_is_removed() {
    holds("evolving one inside");
    holds("evolving one that floats");
}

#[test]
fn an_ellipsoid_that_earns_its_place_is_added_and_no_more_than_are_allowed() {
    holds("evolving one more");
}

#[test]
fn the_same_views_give_the_same_bits_on_any_number_of_threads() {
    let seen = Seen::new(&pair(), 0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| seen.evolve(&disturbed(&pair()[..1], 1.0), at_most(3)).0)
    };
    let bits = |ellipsoids: Vec<Ellipsoid>| -> Vec<u64> {
        let numbers = |e: &Ellipsoid| [e.center(), e.radii()].map(|v| v.map(f64::to_bits));
        ellipsoids.iter().flat_map(numbers).flat_map(|v| [v.x, v.y, v.z]).collect()
    };
    let alone = bits(on(1));
    assert_eq!(alone, bits(on(2)));
    assert_eq!(alone, bits(on(3)));
}

#[test]
fn nothing_seen_lets_nothing_evolve() {
    let refused = evolved(&ModelInput::default(), &pair(), &at_most(2));
    assert_eq!(refused, Err(ModelError::Nothing));
}

#[test]
fn portraits_show_the_whole_body_in_its_own_frame_from_where_they_are_asked_for() {
    let body = Body::new(Pose::exp(&Twist::new(5.0, 1.0, 2.0, 0.5, 0.2, 0.1)), pair()).unwrap();
    let directions: Vec<_> = (0..5).map(|i| half_ball_direction(i, 5)).collect();
    let synthetic_views = SyntheticView::of_body(&body, directions.iter().copied()).unwrap();
    let views: Vec<_> = synthetic_views.iter().map(|synthetic| synthetic.view().unwrap()).collect();
    for (view, direction) in views.iter().zip(&directions) {
        let away = view.world_from_camera().translation();
        assert!(away.angle(direction) < 1e-9);
        let ([left, top], [right, bottom]) = view.mask().bounds_px();
        let [width, height] = view.camera().size_px();
        assert!(left > 0 && top > 0 && right + 1 < width && bottom + 1 < height);
    }
    let here = body.at(Pose::identity());
    for iou in silhouette_ious(&here, &views) {
        assert!(iou > 0.98, "{iou}");
    }
    // The body's pose in the world does not affect its silhouette.
    let same = SyntheticView::of_body(&here, directions.into_iter()).unwrap();
    for (one, other) in same.iter().zip(&views) {
        assert_eq!(one.view().unwrap().mask().image().bytes(), other.mask().image().bytes());
    }
}
