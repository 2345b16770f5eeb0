use std::time::Instant;

use nalgebra::Matrix6;

use super::TrackError;
use super::colors::Colors;
use super::estimate::{Estimate, Notice, Status, Timing};
use super::judge::{Verdict, judge};
use super::learn::learn;
use super::motion::Motion;
use super::points::{Known, Points};
use super::polish::{Desk, Normal, Sight, linearize, polish};
use super::recover::Recovery;
use super::regain::ROUNDS;
use super::search::{Judged, Probes, Reach, Search};
use super::settings::TrackSettings;
use super::solid::Solid;
use super::window::Window;
use crate::evolve;
use crate::observe::{Camera, ImageView, Mask, Observation, Pyramid};
use crate::pose::Pose;
use crate::shape::Body;

/// Follows a body in six degrees of freedom from observation to observation.
#[derive(Debug, Clone)]
pub struct Tracker {
    pub(super) settings: TrackSettings,
    pub(super) cameras: Vec<Camera>,
    body: Body,
    pub(super) solid: Solid,
    pub(super) points: Points,
    pub(super) colors: Colors,
    search: Search,
    pub(super) recovery: Recovery,
    motion: Motion,
    pub(super) windows: Vec<Window>,
    desk: Desk,
    fresh: Vec<Known>,
    /// How far predictions were off, in metres and radians.
    surprise: Reach,
    /// Mean log-likelihood ratio inside the outline while the object was tracked.
    usual: f64,
    /// Support of the pose while the object was tracked.
    pub(super) usual_support: f64,
    /// Pixels that the outlines hold at a distance of one metre.
    pub(super) usual_area: f64,
    status: Status,
    unseen: usize,
    cell: usize,
}

/// Images without the object after which it counts as lost.
const LOST_AFTER: usize = 15;
/// Cells of each window in which new points are sought while tracking.
const CELLS: usize = 40;
/// Share of the newest image in what is known of colours.
const COLOR_RATE: f32 = 0.08;
/// Share of the object's size by which windows are larger than it, while tracking and at the start.
const MARGIN: f64 = 0.3;
const START_MARGIN: f64 = 0.5;

impl Tracker {
    /// Makes a tracker for cameras and a body.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn new(
        cameras: &[Camera],
        body: &Body,
        settings: TrackSettings,
    ) -> Result<Self, TrackError> {
        let settings = settings.checked()?;
        let solid = Solid::new(body);
        Ok(Self {
            settings,
            cameras: cameras.to_vec(),
            surprise: (0.1 * solid.radius, 0.1),
            solid,
            points: Points::default(),
            colors: Colors::new(settings.local_colors),
            search: Search::new(settings.population, evolve::rng(settings.seed, 0))?,
            recovery: Recovery::new(settings.seed),
            motion: Motion::at_rest(0.0, body.world_from_object()),
            windows: vec![Window::default(); cameras.len()],
            desk: Desk::default(),
            fresh: Vec::new(),
            usual: 0.0,
            usual_area: 0.0,
            usual_support: 0.0,
            status: Status::Searching,
            unseen: 0,
            cell: 0,
            body: body.clone(),
        })
    }

    /// Gives the body, at its newest pose.
    #[must_use]
    pub fn body(&self) -> Body {
        let ellipsoids = self.body.ellipsoids().to_vec();
        Body::new(self.motion.last(), ellipsoids).unwrap_or_else(|_| self.body.clone())
    }

    /// Gives the surface points: where they are and their normals, in the object's frame, and their
    /// colours.
    pub fn surface(&self) -> impl Iterator<Item = &crate::fitness::SurfacePoint> {
        self.points.known.iter().map(|known| &known.point)
    }

    /// Learns colours and surface points from an observation in which the object's pose is known.
    /// Masks, one a camera where there is one, tell its pixels; without, its outline does.
    ///
    /// # Errors
    /// If there is not one entry a camera, or the object is in none of the images.
    pub fn start(
        &mut self,
        observation: &Observation<'_>,
        world_from_object: Pose,
        masks: &[Option<Mask<'_>>],
    ) -> Result<Estimate, TrackError> {
        let notices = self.check(observation)?;
        let seen = Seen { observation, images: usable(&self.cameras, observation) };
        self.motion = Motion::at_rest(observation.time_s, world_from_object);
        self.colors = Colors::new(self.settings.local_colors);
        self.points = Points::default();
        if !self.look(&seen, &world_from_object, START_MARGIN) {
            return Err(TrackError::NotInView);
        }
        if masks.iter().any(Option::is_some) {
            let masks = masks.iter().chain(std::iter::repeat(&None));
            for (window, (image, mask)) in self.windows.iter().zip(seen.images.iter().zip(masks)) {
                if let (true, Some(image), Some(mask)) = (window.is_open(), image, mask) {
                    window.teach_mask(image, &mask.image(), &mut self.colors);
                }
            }
            self.colors.take(1.0);
        } else {
            self.learn_colors(&seen, &world_from_object, 2.0, 1.0);
        }
        self.look(&seen, &world_from_object, START_MARGIN);
        self.status = Status::Tracking;
        self.unseen = 0;
        self.points_in_view(&world_from_object);
        if self.settings.surface {
            self.learn_points(&seen, &world_from_object, usize::MAX);
            self.points_in_view(&world_from_object);
        }
        let distance = (world_from_object.translation()
            - observation.world_from_camera[0].translation())
        .norm();
        self.usual_area = self.area(&world_from_object) * distance * distance;
        self.usual = self.weigh(&seen, &world_from_object).verdict.ratio;
        let attempt = self.weigh(&seen, &world_from_object);
        self.usual_support = attempt.verdict.support;
        Ok(self.estimate(&seen, &attempt, notices))
    }

    /// Says where the object is in the next observation.
    ///
    /// # Errors
    /// If there is not one entry a camera.
    pub fn step(&mut self, observation: &Observation<'_>) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        let notices = self.check(observation)?;
        let seen = Seen { observation, images: usable(&self.cameras, observation) };
        let expected = self.motion.predict(observation.time_s);
        if !self.look(&seen, &expected, MARGIN) {
            return Ok(self.blind(observation.time_s, notices));
        }
        clock.lap(|timing| &mut timing.look);
        self.points_in_view(&expected);
        let (guess, mut evaluations) = self.seek(&seen, &expected)?;
        clock.lap(|timing| &mut timing.search);
        let mut attempt = self.attempt(&seen, &guess);
        clock.lap(|timing| &mut timing.polish);
        if attempt.verdict.confidence < self.settings.trusted {
            evaluations += self.regain(&seen, &expected, &mut attempt)?;
            clock.lap(|timing| &mut timing.search);
        }
        self.settle(observation.time_s, &expected, &attempt);
        clock.lap(|timing| &mut timing.judge);
        if self.status == Status::Tracking {
            self.learn(&seen, &attempt);
        }
        clock.lap(|timing| &mut timing.learn);
        Ok(Estimate {
            evaluations,
            timing: clock.timing,
            ..self.estimate(&seen, &attempt, notices)
        })
    }

    /// Seeks the object near a pose, or anywhere, with all that is known of it, and goes on from
    /// there.
    ///
    /// # Errors
    /// If there is not one entry a camera.
    pub fn find(
        &mut self,
        observation: &Observation<'_>,
        near: Option<Pose>,
    ) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        let notices = self.check(observation)?;
        let seen = Seen { observation, images: usable(&self.cameras, observation) };
        let expected = near.unwrap_or_else(|| self.motion.last());
        let mut attempt = Attempt::nothing(expected, self.solid.radius);
        let evaluations = match near {
            Some(_) => self.seek_near(&seen, &expected, &mut attempt)?,
            None => self.seek_anywhere(&seen, ROUNDS, &mut attempt)?,
        };
        clock.lap(|timing| &mut timing.search);
        self.motion = Motion::at_rest(observation.time_s, attempt.pose);
        self.settle(observation.time_s, &attempt.pose.clone(), &attempt);
        Ok(Estimate {
            evaluations,
            timing: clock.timing,
            ..self.estimate(&seen, &attempt, notices)
        })
    }

    fn check(&self, observation: &Observation<'_>) -> Result<Vec<Notice>, TrackError> {
        let cameras = self.cameras.len();
        for (what, given) in
            [("poses", observation.world_from_camera.len()), ("images", observation.images.len())]
        {
            if given != cameras {
                return Err(TrackError::Count { what, cameras, given });
            }
        }
        let mut notices = Vec::new();
        for (index, (camera, image)) in self.cameras.iter().zip(&observation.images).enumerate() {
            match image {
                None => notices.push(Notice::NoImage(index)),
                Some(image) if image.size_px() != camera.size_px() => {
                    let (expected, given) = (camera.size_px(), image.size_px());
                    notices.push(Notice::WrongSize { camera: index, expected, given });
                }
                Some(_) => {}
            }
        }
        Ok(notices)
    }

    pub(super) fn look(&mut self, seen: &Seen<'_>, pose: &Pose, margin: f64) -> bool {
        let colors = self.settings.region.then_some(&self.colors);
        let mut any = false;
        for (camera, window) in self.windows.iter_mut().enumerate() {
            window.close();
            if let Some(image) = &seen.images[camera] {
                let place = (pose, self.solid.quadrics.as_slice(), margin);
                let eye = &seen.observation.world_from_camera[camera];
                any |= window.look(&self.cameras[camera], eye, image, place, colors);
            }
        }
        any
    }

    pub(super) fn reach(&self) -> Reach {
        let radius = self.solid.radius;
        let across = (3.0 * self.surprise.0).clamp(0.02 * radius, 0.5 * radius);
        (across, (3.0 * self.surprise.1).clamp(0.02, 0.5))
    }

    pub(super) fn points_in_view(&mut self, pose: &Pose) {
        let most = if self.settings.surface { self.settings.points } else { 0 };
        self.points.in_view(&self.windows, pose, &self.solid, most, &mut self.desk.in_view);
    }

    fn seek(&mut self, seen: &Seen<'_>, expected: &Pose) -> Result<(Pose, usize), TrackError> {
        let (reach, last, area) = (self.reach(), self.motion.last(), self.area(expected));
        let Self { windows, solid, points, colors, desk, search, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        let sight = Sight { windows, images: &seen.images, solid, points, colors };
        let judged = Judged { sight, probes: Probes::InView(&desk.in_view), area };
        let found = search.run(&judged, (expected, &last), reach, settings.generations)?;
        Ok((found.pose, found.evaluations))
    }

    pub(super) fn look_all_over(&mut self, seen: &Seen<'_>) {
        let colors = self.settings.region.then_some(&self.colors);
        for (camera, window) in self.windows.iter_mut().enumerate() {
            window.close();
            if let Some(image) = &seen.images[camera] {
                let eye = &seen.observation.world_from_camera[camera];
                window.look_all_over(&self.cameras[camera], eye, image, colors);
            }
        }
    }

    pub(super) fn was_seen_lately(&self) -> bool {
        self.unseen <= LOST_AFTER
    }

    /// Gives how far from the first camera the object was last, if it was ever seen.
    pub(super) fn last_distance(&self, seen: &Seen<'_>) -> Option<f64> {
        let eye = seen.observation.world_from_camera.first()?.translation();
        (self.usual_area > 0.0).then(|| (self.motion.last().translation() - eye).norm())
    }

    /// Gives the pixels that the body's outlines hold at a pose.
    pub(super) fn area(&self, pose: &Pose) -> f64 {
        let held = self.windows.iter().filter_map(|window| {
            Some(window.region(&window.projection(pose)?, &self.solid.quadrics).1)
        });
        held.sum()
    }

    /// Makes a pose precise and judges it.
    pub(super) fn attempt(&mut self, seen: &Seen<'_>, start: &Pose) -> Attempt {
        let usual = self.usual;
        let Self { windows, solid, points, colors, desk, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        let sight = Sight { windows, images: &seen.images, solid, points, colors };
        let (pose, normal) = polish(&sight, *start, Pyramid::LEVELS - 1, desk);
        Attempt { pose, normal, verdict: judge(&sight, &pose, usual, desk) }
    }

    /// Judges a pose as it is.
    fn weigh(&mut self, seen: &Seen<'_>, pose: &Pose) -> Attempt {
        let usual = self.usual;
        let Self { windows, solid, points, colors, desk, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        let sight = Sight { windows, images: &seen.images, solid, points, colors };
        let normal = linearize(&sight, pose, 0, desk);
        Attempt { pose: *pose, normal, verdict: judge(&sight, pose, usual, desk) }
    }

    fn settle(&mut self, time_s: f64, expected: &Pose, attempt: &Attempt) {
        if attempt.verdict.confidence < self.settings.trusted {
            self.miss(time_s);
            return;
        }
        let pose = &attempt.pose;
        self.search.follow(expected, pose, self.reach());
        self.status = Status::Tracking;
        self.unseen = 0;
        self.motion.follow(time_s, *pose);
        let off = (expected.inverse() * *pose).log();
        let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        self.surprise.0 += 0.3 * (across - self.surprise.0);
        self.surprise.1 += 0.3 * (turned - self.surprise.1);
    }

    fn miss(&mut self, time_s: f64) {
        self.unseen += 1;
        self.status = if self.unseen > LOST_AFTER { Status::Lost } else { Status::Searching };
        self.motion.wait(time_s);
    }

    fn learn(&mut self, seen: &Seen<'_>, attempt: &Attempt) {
        self.usual += 0.05 * (attempt.verdict.ratio - self.usual);
        self.usual_support += 0.1 * (attempt.verdict.support - self.usual_support);
        if self.settings.region {
            self.learn_colors(seen, &attempt.pose, 4.0, COLOR_RATE);
        }
        if self.settings.surface {
            self.points.refine(&self.desk.matches);
            self.learn_points(seen, &attempt.pose, CELLS);
            self.points.judge(&self.desk.matches);
        }
    }

    fn learn_colors(&mut self, seen: &Seen<'_>, pose: &Pose, doubt_px: f64, rate: f32) {
        for (window, image) in self.windows.iter().zip(&seen.images) {
            let (Some(projection), Some(image)) = (window.projection(pose), image) else {
                continue;
            };
            let outlines: Vec<_> =
                self.solid.quadrics.iter().filter_map(|q| projection.outline(q)).collect();
            window.teach(image, &outlines, doubt_px, &mut self.colors);
        }
        self.colors.take(rate);
    }

    fn learn_points(&mut self, seen: &Seen<'_>, pose: &Pose, cells: usize) {
        let Self { windows, solid, points, colors, desk, fresh, .. } = self;
        let sight = Sight { windows, images: &seen.images, solid, points, colors: Some(colors) };
        fresh.clear();
        learn(&sight, pose, &desk.in_view, (self.cell, cells), fresh);
        self.cell = self.cell.wrapping_add(cells);
        self.points.known.append(fresh);
    }

    fn blind(&mut self, time_s: f64, notices: Vec<Notice>) -> Estimate {
        self.miss(time_s);
        let attempt = Attempt::nothing(self.motion.last(), self.solid.radius);
        self.answer(time_s, &attempt, notices)
    }

    fn estimate(&self, seen: &Seen<'_>, attempt: &Attempt, notices: Vec<Notice>) -> Estimate {
        self.answer(seen.observation.time_s, attempt, notices)
    }

    fn answer(&self, time_s: f64, attempt: &Attempt, notices: Vec<Notice>) -> Estimate {
        Estimate {
            time_s,
            world_from_object: attempt.pose,
            covariance: attempt.normal.curvature.try_inverse().unwrap_or_else(Matrix6::identity),
            unobservable: Vec::new(),
            confidence: attempt.verdict.confidence,
            status: self.status,
            notices,
            evaluations: 0,
            timing: Timing::default(),
        }
    }
}

/// One observation with the images that fit their cameras.
pub(super) struct Seen<'a> {
    pub(super) observation: &'a Observation<'a>,
    pub(super) images: Vec<Option<ImageView<'a>>>,
}

/// A pose that was made precise, and what it is worth.
#[derive(Debug, Clone, Copy)]
pub(super) struct Attempt {
    pub(super) pose: Pose,
    pub(super) normal: Normal,
    pub(super) verdict: Verdict,
}

impl Attempt {
    pub(super) fn nothing(pose: Pose, radius: f64) -> Self {
        let verdict = Verdict { confidence: 0.0, support: f64::NEG_INFINITY, ratio: 0.0 };
        Self { pose, normal: Normal::new(radius), verdict }
    }
}

/// Gives the images that fit their cameras.
fn usable<'a>(cameras: &[Camera], observation: &Observation<'a>) -> Vec<Option<ImageView<'a>>> {
    let fits = |(camera, image): (&Camera, &Option<ImageView<'a>>)| {
        image.filter(|image| image.size_px() == camera.size_px())
    };
    cameras.iter().zip(&observation.images).map(fits).collect()
}

/// Measures laps.
struct Clock {
    last: Instant,
    timing: Timing,
}

impl Clock {
    fn start() -> Self {
        Self { last: Instant::now(), timing: Timing::default() }
    }

    /// Adds the time since the last lap to a stage.
    fn lap(&mut self, stage: impl Fn(&mut Timing) -> &mut std::time::Duration) {
        let now = Instant::now();
        *stage(&mut self.timing) += now - self.last;
        self.last = now;
    }
}
