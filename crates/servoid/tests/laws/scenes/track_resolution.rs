//! Sequences of the tracker with the same images at several sizes.

use servoid::track::{Estimate, TrackSettings};

use super::Sense::AtMost;
use super::{Figures, Measure, NOT_TRACKING, OFF, Scene, TURNED, Worst};
use crate::shapes::drawn::{SIZE, Shot, Stage, eyes};
use crate::track::{moving, started};

/// Largest difference between the confidences for images of two sizes.
const APART: Measure = ("confidence apart", "1", AtMost);
const IMAGES: usize = 10;

pub const SCENES: &[Scene] = &[
    Scene {
        name: "track at half the size",
        measures: &[NOT_TRACKING, OFF, TURNED, APART],
        run: |seed| at_size(seed, 2),
    },
    Scene {
        name: "track at twice the size",
        measures: &[NOT_TRACKING, OFF, TURNED, APART],
        run: |seed| at_size(seed, 0),
    },
];

/// A stage with cameras of twice the resolution.
fn sharp(seed: u64) -> Stage {
    let usual = Stage::textured();
    let (focal, middle) = (usual.camera.focal_px(), usual.camera.center_px());
    let twice = |x: f64| 2.0 * x + 0.5;
    let camera = servoid::camera::Camera::new(
        SIZE.map(|n| 2 * n),
        focal.map(|f| 2.0 * f),
        middle.map(twice),
    );
    Stage { seed, camera: camera.unwrap(), ..usual }
}

/// Halves the size of images: each pixel is the mean of four.
fn halved(shot: &Shot) -> Shot {
    let [width, height] = shot.size.map(|n| n / 2);
    let bytes = shot.channels.count();
    let mean = |picture: &Vec<u8>| {
        let at = |u: usize, v: usize, k: usize| u16::from(picture[(v * 2 * width + u) * bytes + k]);
        let pixel = |i: usize| {
            let (k, u, v) = (i % bytes, 2 * (i / bytes % width), 2 * (i / bytes / width));
            let sum = at(u, v, k) + at(u + 1, v, k) + at(u, v + 1, k) + at(u + 1, v + 1, k);
            ((sum + 2) / 4) as u8
        };
        (0..width * height * bytes).map(pixel).collect()
    };
    let pictures = shot.pictures.iter().map(mean).collect();
    Shot { pictures, eyes: shot.eyes.clone(), size: [width, height], ..*shot }
}

/// Tracks the moving object in images whose size is halved a number of times.
fn followed(shots: &[Shot], seed: u64) -> Vec<Estimate> {
    let stage = sharp(seed);
    let shrink = stage.camera.size_px()[0] / shots[0].size[0];
    let camera = stage.camera.crop([0; 2], shots[0].size, shrink).unwrap();
    let settings = TrackSettings::default().with(|it| it.seed = seed);
    let stage = Stage { camera, ..stage };
    let mut tracker = started(&stage, settings, &shots[0], moving(0));
    shots[1..].iter().map(|shot| tracker.step(&shot.observation()).unwrap()).collect()
}

/// Tracks the object in images of the usual size and of another; returns the worst of the other,
/// and the largest difference between their confidences.
fn at_size(seed: u64, halvings: usize) -> Figures {
    let stage = sharp(seed);
    let mut shots: Vec<_> =
        (0..IMAGES).map(|index| stage.shot(index, &eyes(), Some(&moving(index)))).collect();
    let mut estimates = vec![];
    for _ in 0..3 {
        estimates.push(followed(&shots, seed));
        shots = shots.iter().map(halved).collect();
    }
    let (mut worst, mut apart) = (Worst::default(), 0.0_f64);
    for (index, (one, two)) in estimates[1].iter().zip(&estimates[halvings]).enumerate() {
        worst.add(two, &moving(index + 1));
        apart = apart.max((one.confidence - two.confidence).abs());
    }
    [worst.figures(), vec![("confidence apart", apart)]].concat()
}
