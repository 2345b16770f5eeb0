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
use super::search::{Reach, Search};
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
    settings: TrackSettings,
    cameras: Vec<Camera>,
    body: Body,
    solid: Solid,
    points: Points,
    colors: Colors,
    search: Search,
    motion: Motion,
    windows: Vec<Window>,
    desk: Desk,
    fresh: Vec<Known>,
    /// How far predictions were off, in metres and radians.
    surprise: Reach,
    /// Mean log-likelihood ratio inside the outline while the object was tracked.
    usual: f64,
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
/// Generations that are bred when the images do not confirm a pose.
const RETRY: usize = 6;

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
            motion: Motion::at_rest(0.0, body.world_from_object()),
            windows: vec![Window::default(); cameras.len()],
            desk: Desk::default(),
            fresh: Vec::new(),
            usual: 0.0,
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
        let images = usable(&self.cameras, observation);
        self.motion = Motion::at_rest(observation.time_s, world_from_object);
        self.colors = Colors::new(self.settings.local_colors);
        self.points = Points::default();
        if !self.look(observation, &images, &world_from_object, 0.5) {
            return Err(TrackError::NotInView);
        }
        for (camera, (window, image)) in self.windows.iter().zip(&images).enumerate() {
            let Some(image) = image.filter(|_| window.is_open()) else { continue };
            if let Some(mask) = masks.get(camera).and_then(Option::as_ref) {
                window.teach_mask(&image, &mask.image(), &mut self.colors);
            } else if let Some(projection) = window.projection(&world_from_object) {
                let outlines: Vec<_> =
                    self.solid.quadrics.iter().filter_map(|q| projection.outline(q)).collect();
                window.teach(&image, &outlines, 2.0, &mut self.colors);
            }
        }
        self.colors.take(1.0);
        self.look(observation, &images, &world_from_object, 0.5);
        self.status = Status::Tracking;
        self.unseen = 0;
        self.learn_points(&images, &world_from_object, usize::MAX);
        self.points_in_view(&world_from_object);
        let normal = self.linearize(&images, &world_from_object);
        let verdict = self.judge(&images, &world_from_object);
        self.usual = verdict.ratio;
        let verdict = self.judge(&images, &world_from_object);
        Ok(self.estimate(observation.time_s, world_from_object, verdict, normal, notices))
    }

    /// Says where the object is in the next observation.
    ///
    /// # Errors
    /// If there is not one entry a camera.
    pub fn step(&mut self, observation: &Observation<'_>) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        let mut timing = Timing::default();
        let notices = self.check(observation)?;
        let images = usable(&self.cameras, observation);
        let expected = self.motion.predict(observation.time_s);
        if !self.look(observation, &images, &expected, 0.3) {
            return Ok(self.blind(observation.time_s, notices));
        }
        timing.look = clock.lap();
        self.points_in_view(&expected);
        let (mut pose, mut evaluations) =
            self.seek(&images, &expected, self.settings.generations, 1.0)?;
        timing.search = clock.lap();
        let mut normal = self.polish(&images, &mut pose);
        timing.polish = clock.lap();
        let mut verdict = self.judge(&images, &pose);
        if verdict.confidence < self.settings.trusted {
            let (mut other, more) = self.seek(&images, &expected, RETRY, 3.0)?;
            evaluations += more;
            let again = self.polish(&images, &mut other);
            let second = self.judge(&images, &other);
            if second.confidence > verdict.confidence {
                (pose, normal, verdict) = (other, again, second);
            } else {
                normal = self.linearize(&images, &pose);
            }
        }
        self.search.follow(&expected, &pose, self.reach(1.0));
        timing.judge = clock.lap();
        self.settle(observation.time_s, &expected, &pose, verdict);
        if self.status == Status::Tracking {
            self.learn(&images, &pose, verdict);
        }
        timing.learn = clock.lap();
        let mut estimate = self.estimate(observation.time_s, pose, verdict, normal, notices);
        estimate.evaluations = evaluations;
        estimate.timing = timing;
        Ok(estimate)
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

    fn look(
        &mut self,
        observation: &Observation<'_>,
        images: &[Option<ImageView<'_>>],
        pose: &Pose,
        margin: f64,
    ) -> bool {
        let colors = self.settings.region.then_some(&self.colors);
        let mut any = false;
        for (camera, window) in self.windows.iter_mut().enumerate() {
            window.close();
            if let Some(image) = &images[camera] {
                let place = (pose, self.solid.quadrics.as_slice(), margin);
                let eye = &observation.world_from_camera[camera];
                any |= window.look(&self.cameras[camera], eye, image, place, colors);
            }
        }
        any
    }

    fn reach(&self, wider: f64) -> Reach {
        let radius = self.solid.radius;
        let across = (3.0 * self.surprise.0).clamp(0.02 * radius, 0.5 * radius);
        let turned = (3.0 * self.surprise.1).clamp(0.02, 0.5);
        (wider * across, wider * turned)
    }

    fn points_in_view(&mut self, pose: &Pose) {
        let most = if self.settings.surface { self.settings.points } else { 0 };
        self.points.in_view(&self.windows, pose, &self.solid, most, &mut self.desk.in_view);
    }

    fn seek(
        &mut self,
        images: &[Option<ImageView<'_>>],
        expected: &Pose,
        generations: usize,
        wider: f64,
    ) -> Result<(Pose, usize), TrackError> {
        let reach = self.reach(wider);
        let last = self.motion.last();
        let Self { windows, solid, points, colors, desk, search, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        let sight = Sight { windows, images, solid, points, colors };
        let found = search.run(&sight, &desk.in_view, (expected, &last), reach, generations)?;
        Ok((found.pose, found.evaluations))
    }

    fn polish(&mut self, images: &[Option<ImageView<'_>>], pose: &mut Pose) -> Normal {
        let Self { windows, solid, points, colors, desk, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        let sight = Sight { windows, images, solid, points, colors };
        let (found, normal) = polish(&sight, *pose, Pyramid::LEVELS - 1, desk);
        *pose = found;
        normal
    }

    fn linearize(&mut self, images: &[Option<ImageView<'_>>], pose: &Pose) -> Normal {
        let Self { windows, solid, points, colors, desk, settings, .. } = self;
        let colors = settings.region.then_some(&*colors);
        linearize(&Sight { windows, images, solid, points, colors }, pose, 0, desk)
    }

    fn judge(&self, images: &[Option<ImageView<'_>>], pose: &Pose) -> Verdict {
        let Self { windows, solid, points, colors, settings, .. } = self;
        let colors = settings.region.then_some(colors);
        judge(&Sight { windows, images, solid, points, colors }, pose, self.usual, &self.desk)
    }

    fn settle(&mut self, time_s: f64, expected: &Pose, pose: &Pose, verdict: Verdict) {
        if verdict.confidence < self.settings.trusted {
            self.unseen += 1;
            self.status = if self.unseen > LOST_AFTER { Status::Lost } else { Status::Searching };
            self.motion.wait(time_s);
            return;
        }
        self.status = Status::Tracking;
        self.unseen = 0;
        self.motion.follow(time_s, *pose);
        let off = (expected.inverse() * *pose).log();
        let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        self.surprise.0 += 0.3 * (across - self.surprise.0);
        self.surprise.1 += 0.3 * (turned - self.surprise.1);
    }

    fn learn(&mut self, images: &[Option<ImageView<'_>>], pose: &Pose, verdict: Verdict) {
        self.usual += 0.05 * (verdict.ratio - self.usual);
        if self.settings.region {
            for (window, image) in self.windows.iter().zip(images) {
                let (Some(projection), Some(image)) = (window.projection(pose), image) else {
                    continue;
                };
                let outlines: Vec<_> =
                    self.solid.quadrics.iter().filter_map(|q| projection.outline(q)).collect();
                window.teach(image, &outlines, 4.0, &mut self.colors);
            }
            self.colors.take(COLOR_RATE);
        }
        if self.settings.surface {
            self.points.refine(&self.desk.matches);
            self.learn_points(images, pose, CELLS);
            self.points.judge(&self.desk.matches);
        }
    }

    fn learn_points(&mut self, images: &[Option<ImageView<'_>>], pose: &Pose, cells: usize) {
        if !self.settings.surface {
            return;
        }
        let Self { windows, solid, points, colors, desk, fresh, .. } = self;
        let sight = Sight { windows, images, solid, points, colors: Some(colors) };
        fresh.clear();
        learn(&sight, pose, &desk.in_view, (self.cell, cells), fresh);
        self.cell = self.cell.wrapping_add(cells);
        self.points.known.append(fresh);
    }

    fn blind(&mut self, time_s: f64, notices: Vec<Notice>) -> Estimate {
        self.unseen += 1;
        self.status = if self.unseen > LOST_AFTER { Status::Lost } else { Status::Searching };
        self.motion.wait(time_s);
        Estimate {
            time_s,
            world_from_object: self.motion.last(),
            covariance: Matrix6::identity(),
            unobservable: Vec::new(),
            confidence: 0.0,
            status: self.status,
            notices,
            evaluations: 0,
            timing: Timing::default(),
        }
    }

    fn estimate(
        &self,
        time_s: f64,
        world_from_object: Pose,
        verdict: Verdict,
        normal: Normal,
        notices: Vec<Notice>,
    ) -> Estimate {
        Estimate {
            time_s,
            world_from_object,
            covariance: normal.curvature.try_inverse().unwrap_or_else(Matrix6::identity),
            unobservable: Vec::new(),
            confidence: verdict.confidence,
            status: self.status,
            notices,
            evaluations: 0,
            timing: Timing::default(),
        }
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
struct Clock(Instant);

impl Clock {
    fn start() -> Self {
        Self(Instant::now())
    }

    fn lap(&mut self) -> std::time::Duration {
        let now = Instant::now();
        now - std::mem::replace(&mut self.0, now)
    }
}
