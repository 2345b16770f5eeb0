//! Sequences of the paper's own tracker.

use nalgebra::{UnitQuaternion, Vector3};
use servoid::pose::{Pose, Twist};
use servoid::shape::Body;
use servoid::track::{Genes, Objective, OneStepSettings, Status};

use super::Sense::{AtLeast, AtMost};
use super::{Figures, Measure, NOT_TRACKING, OFF, Scene, TURNED, apart};
use crate::one_step::{at, drawn_of, duck, egg, eyes, followed, observed, started, swing};

const PLACED: &[Measure] = &[NOT_TRACKING, ("across", "mm", AtMost), ("along", "mm", AtMost)];

pub const SCENES: &[Scene] = &[
    Scene { name: "one step egg by points", measures: PLACED, run: egg_by_points },
    Scene { name: "one step egg by region", measures: PLACED, run: egg_by_region },
    Scene { name: "one step duck by points", measures: &[OFF, TURNED], run: duck_by_points },
    Scene { name: "one step duck by region", measures: &[OFF, TURNED], run: duck_by_region },
    Scene {
        name: "one step gone",
        measures: &[("unlike", "images", AtMost), NOT_TRACKING, OFF],
        run: gone,
    },
    Scene {
        name: "one step spin",
        measures: &[
            ("spin of egg open", "courses", AtLeast),
            ("any of duck open", "courses", AtMost),
        ],
        run: spin,
    },
];

fn settings(seed: u64, genes: Genes, objective: Objective) -> OneStepSettings {
    OneStepSettings::default().with(|it| {
        it.seed = seed;
        it.genes = genes;
        it.objective = objective;
    })
}

fn points() -> Objective {
    OneStepSettings::default().objective
}

/// Tracks the egg on the paper's motion; returns the mean errors.
fn egg_of(seed: u64, objective: Objective) -> Figures {
    let poses: Vec<_> = (0..150).map(swing).collect();
    let estimates = followed(&egg(), &poses, settings(seed, Genes::Place, objective));
    let (mut lost, mut across, mut along) = (0.0, 0.0, 0.0);
    for (estimate, truth) in estimates.iter().zip(&poses[1..]) {
        lost += f64::from(u8::from(estimate.status != Status::Tracking));
        let error = estimate.world_from_object.translation() - truth.translation();
        let error = eyes()[0].rotation().inverse() * error * 1e3;
        across += error.xy().norm() / estimates.len() as f64;
        along += error.z.abs() / estimates.len() as f64;
    }
    vec![("not tracking", lost), ("across", across), ("along", along)]
}

fn egg_by_points(seed: u64) -> Figures {
    egg_of(seed, points())
}

fn egg_by_region(seed: u64) -> Figures {
    egg_of(seed, Objective::Region)
}

/// Tracks the duck while it rotates by 57 degrees; returns the mean errors of the last 39 images.
fn duck_of(seed: u64, objective: Objective) -> Figures {
    let turning = |index: usize| {
        let angle = 0.01 * index as f64;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, 0.0, 1.0) * angle);
        at(0.0005 * index as f64, 0.0, 0.0) * Pose::from_rotation(turn, Vector3::zeros())
    };
    let poses: Vec<_> = (0..100).map(turning).collect();
    let estimates = followed(&duck(), &poses, settings(seed, Genes::Pose, objective));
    let last: Vec<_> = estimates.iter().zip(&poses[1..]).skip(60).collect();
    let errors = last.iter().map(|(found, truth)| apart(truth, &found.world_from_object));
    let sum = errors.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1));
    vec![("off", sum.0 / last.len() as f64), ("turned", sum.1 / last.len() as f64)]
}

fn duck_by_points(seed: u64) -> Figures {
    duck_of(seed, points())
}

fn duck_by_region(seed: u64) -> Figures {
    duck_of(seed, Objective::Region)
}

/// The egg disappears, is sought, is lost, and returns nearby.
fn gone(seed: u64) -> Figures {
    let here = at(0.0, 0.0, 0.0);
    let settings = settings(seed, Genes::Place, points()).with(|it| it.lost_after = 5);
    let mut tracker = started(&egg(), here, settings);
    let draw = |pose: Option<Pose>, index: u32| drawn_of(seed, &egg(), pose, index);
    let known = tracker.step(&observed(&draw(Some(here), 1), 0.1)).unwrap();
    let (away, mut unlike) = (draw(None, 7), 0.0);
    for index in 1..=8 {
        let estimate = tracker.step(&observed(&away, 0.1 + f64::from(index))).unwrap();
        let expected = if index < 5 { Status::Searching } else { Status::Lost };
        let alike = estimate.status == expected && estimate.confidence < 0.25;
        unlike += f64::from(u8::from(!alike));
        assert_eq!(estimate.world_from_object, known.world_from_object);
        assert!(estimate.covariance.trace() > known.covariance.trace());
    }
    let back = at(0.01, 0.0, 0.0);
    let images = draw(Some(back), 9);
    for time in 10..19 {
        tracker.step(&observed(&images, f64::from(time))).unwrap();
    }
    let last = tracker.step(&observed(&images, 19.0)).unwrap();
    let lost = f64::from(u8::from(last.status != Status::Tracking));
    let (off, _) = apart(&back, &last.world_from_object);
    vec![("unlike", unlike), ("not tracking", lost), ("off", off)]
}

/// Sequences whose shares are averaged: in a single one any motion may be unobservable by chance.
const COURSES: u64 = 20;
const IMAGES: usize = 27;

/// Returns the share of sequences with an object at rest in which the unobservable motions fulfil a
/// condition.
fn share_open(seed: u64, body: &Body, asked: fn(&[Twist]) -> bool) -> f64 {
    let still = vec![at(0.0, 0.0, 0.0); IMAGES];
    let as_asked = |course: &u64| {
        let settings = settings(COURSES * seed + course, Genes::Pose, points());
        let last = followed(body, &still, settings).pop().unwrap();
        assert!(last.unobservable.iter().all(|axis| (axis.norm() - 1.0).abs() < 1e-9));
        asked(&last.unobservable)
    };
    (0..COURSES).filter(as_asked).count() as f64 / COURSES as f64
}

fn spin(seed: u64) -> Figures {
    let spin_alone = |open: &[Twist]| open.len() == 1 && open[0][3].abs() > 0.9;
    vec![
        ("spin of egg open", share_open(seed, &egg(), spin_alone)),
        ("any of duck open", share_open(seed, &duck(), |open| !open.is_empty())),
    ]
}
