//! Trackers with any settings, any images and any times.

use nalgebra::Vector3;
use servoid::camera::{Camera, Channels, ImageView, Observation};
use servoid::model::Settings;
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid};
use servoid::track::{Estimate, TrackSettings, Tracker};

use super::draw::Draw;

const SIZE: [usize; 2] = [33, 24];

pub fn any(draw: &mut Draw) -> Result<(), String> {
    let camera = Camera::new(SIZE, [40.0; 2], [16.0, 11.5]).map_err(|e| e.to_string())?;
    let cameras = vec![camera; draw.pick(&[0, 1, 1, 2])];
    let settings = settings(draw);
    let Ok(body) = body(draw) else { return Ok(()) };
    let Ok(mut tracker) = Tracker::new(&cameras, &body, settings) else { return Ok(()) };
    let ahead = draw.pick(&[0.5, 0.5, 0.5, -0.5, 1e-9, 1e9]);
    let shift = Vector3::new(0.05 * draw.within(-1.0, 1.0), 0.0, ahead);
    let start = Pose::from_rotation(draw.pose().rotation(), shift);
    let mut time_s = draw.number();
    let pictures = pictures(draw, cameras.len());
    let poses = vec![Pose::identity(); cameras.len()];
    let first = observation(time_s, &poses, &pictures, draw);
    if let Ok(estimate) = tracker.start(&first, start, &[]) {
        sane(&estimate)?;
    }
    for _ in 0..draw.pick(&[1, 3, 6]) {
        time_s += draw.pick(&[0.033, 0.033, 0.033, 0.0, -1.0, 1e9, f64::NAN, f64::INFINITY]);
        let poses: Vec<Pose> = cameras.iter().map(|_| draw.pose()).collect();
        let new = self::pictures(draw, cameras.len());
        let seen =
            observation(time_s, &poses, if draw.chance(0.2) { &pictures } else { &new }, draw);
        if let Ok(estimate) = tracker.step(&seen) {
            sane(&estimate)?;
        }
    }
    let _ = tracker.body();
    Ok(())
}

/// Settings, one of which is sometimes out of its range.
fn settings(draw: &mut Draw) -> TrackSettings {
    let share = draw.number();
    let fair = TrackSettings::default().with(|it| {
        it.population = draw.pick(&[8, 8, 16, 7, 4097]);
        it.generations = draw.pick(&[1, 1, 2, 0]);
        it.budget_s = draw.pick(&[None, None, Some(1e-3), Some(share), Some(f64::NAN)]);
        it.points = draw.pick(&[1, 20, 80, 0]);
        it.surface = draw.chance(0.8);
        it.region = draw.chance(0.8);
        it.local_colors = draw.chance(0.5);
        it.adjust = draw.chance(0.2);
        it.adjust_outlines = draw.chance(0.3);
        it.depth_from_motion = draw.chance(0.3);
    });
    if draw.chance(0.8) {
        return fair;
    }
    let growth = Settings::default().with(|it| {
        it.delta = draw.number();
        it.lines = draw.below(3);
    });
    fair.with(|it| {
        it.trusted = draw.number();
        it.held = draw.number();
        it.growth = growth;
    })
}

fn body(draw: &mut Draw) -> Result<Body, servoid::shape::ShapeError> {
    let size = draw.pick(&[0.1, 0.1, 0.1, 1e-9, 1e6]);
    let parts = (0..draw.pick(&[1, 2, 5]))
        .map(|index| {
            let center = [(); 3].map(|()| size * draw.within(-0.5, 0.5));
            let radii = [(); 3].map(|()| size * draw.within(0.2, 1.0));
            Ellipsoid::new(index, center, radii, [1.0, 0.0, 0.0, 0.0])
        })
        .collect::<Result<_, _>>()?;
    Body::new(draw.pose(), parts)
}

fn pictures(draw: &mut Draw, count: usize) -> Vec<Vec<u8>> {
    (0..count).map(|_| draw.bytes(SIZE[0] * SIZE[1] * 3)).collect()
}

fn observation<'a>(
    time_s: f64,
    poses: &[Pose],
    pictures: &'a [Vec<u8>],
    draw: &mut Draw,
) -> Observation<'a> {
    let images = pictures.iter().map(|picture| {
        let rows = if draw.chance(0.05) { SIZE[1] / 2 } else { SIZE[1] };
        let image = ImageView::new(&picture[..SIZE[0] * rows * 3], [SIZE[0], rows], Channels::Rgb);
        image.ok().filter(|_| !draw.chance(0.1))
    });
    let images: Vec<_> = images.collect();
    // Sometimes there are not as many poses as images.
    let world_from_camera =
        poses[..poses.len() - usize::from(poses.len() > 1 && draw.chance(0.03))].to_vec();
    Observation { time_s, world_from_camera, images, depths: Vec::new() }
}

fn sane(estimate: &Estimate) -> Result<(), String> {
    let place = estimate.world_from_object.translation();
    let turn = estimate.world_from_object.rotation().into_inner().norm();
    if !(place.iter().all(|x| x.is_finite()) && (turn - 1.0).abs() < 1e-9) {
        return Err(format!("the pose is {:?}", estimate.world_from_object));
    }
    if !(0.0..=1.0).contains(&estimate.confidence) {
        return Err(format!("the confidence is {}", estimate.confidence));
    }
    if estimate.covariance.iter().any(|x| x.is_nan()) {
        return Err(format!("the covariance is {}", estimate.covariance));
    }
    Ok(())
}
