use super::TrackError;
use super::attempt::Attempt;
use super::clock::Clock;
use super::colors::Colors;
use super::estimate::{Estimate, Status};
use super::keyframes::Keyframes;
use super::motion::Motion;
use super::points::Points;
use super::regain::ROUNDS;
use super::tracker::Tracker;
use crate::observe::{Mask, Observation};
use crate::pose::Pose;

/// Share of the object's size by which windows are larger than it at the start.
const START_MARGIN: f64 = 0.5;

impl Tracker {
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
        let mut clock = Clock::start();
        self.check(observation)?;
        self.motion = Motion::at_rest(observation.time_s, world_from_object);
        self.colors = Colors::new(self.settings.local_colors);
        self.points = Points::default();
        if !self.look(observation, &world_from_object, START_MARGIN) {
            return Err(TrackError::NotInView);
        }
        if masks.iter().any(Option::is_some) {
            self.learn_masks(observation, masks);
        } else {
            self.learn_colors(observation, &world_from_object, 1.0);
        }
        self.notices.clear();
        self.look(observation, &world_from_object, START_MARGIN);
        self.keyframes = Keyframes::default();
        for (camera, mask) in masks.iter().enumerate().take(self.windows.len()) {
            let window = &self.windows[camera];
            let image = observation.images[camera].filter(|_| window.is_open());
            if let (Some(image), Some(mask)) = (image, mask) {
                let seen = (window, &image, &self.cameras[camera]);
                let poses = (&observation.world_from_camera[camera], &world_from_object);
                self.keyframes.offer(seen, poses, Some(&mask.image()));
            }
        }
        self.points_in_view(&world_from_object);
        if self.settings.surface {
            self.learn_points(observation, &world_from_object, usize::MAX);
            self.points_in_view(&world_from_object);
        }
        let eye = observation.world_from_camera[0].translation();
        let distance = (world_from_object.translation() - eye).norm();
        self.usual.area = self.area(&world_from_object) * distance * distance;
        self.usual.ratio = self.weigh(observation, &world_from_object).verdict.ratio;
        let attempt = self.weigh(observation, &world_from_object);
        self.usual.support = attempt.verdict.support;
        self.usual.confidence = attempt.verdict.confidence;
        (self.status, self.unseen) = (Status::Tracking, 0);
        let mut estimate = self.estimate(observation, &attempt);
        clock.lap(|timing| &mut timing.learn);
        estimate.timing = clock.timing();
        Ok(estimate)
    }

    /// Seeks the object near a pose, or anywhere, with all that is known of it, and goes on from
    /// there.
    ///
    /// # Errors
    /// If there is not one entry a camera, or nothing is known of the object's look.
    pub fn find(
        &mut self,
        observation: &Observation<'_>,
        near: Option<Pose>,
    ) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        self.check(observation)?;
        if !self.colors.are_known() && self.points.known.is_empty() {
            return Err(TrackError::NothingKnown);
        }
        let expected = near.unwrap_or_else(|| self.motion.last());
        let mut attempt = Attempt::nothing(expected, self.solid.radius);
        let evaluations = match near {
            Some(_) => self.seek_near(observation, &expected, &mut attempt)?,
            None => self.seek_anywhere(observation, ROUNDS, &mut attempt)?,
        };
        clock.lap(|timing| &mut timing.search);
        self.motion = Motion::at_rest(observation.time_s, attempt.pose);
        let found = attempt.pose;
        self.settle(observation.time_s, &found, &attempt);
        let estimate = self.estimate(observation, &attempt);
        Ok(Estimate { evaluations, timing: clock.timing(), ..estimate })
    }

    fn learn_masks(&mut self, observation: &Observation<'_>, masks: &[Option<Mask<'_>>]) {
        let masks = masks.iter().chain(std::iter::repeat(&None));
        let images = observation.images.iter().zip(masks);
        for (window, (image, mask)) in self.windows.iter().zip(images) {
            if let (true, Some(image), Some(mask)) = (window.is_open(), image, mask) {
                window.teach_mask(image, &mask.image(), &mut self.colors);
            }
        }
        self.colors.take(1.0);
    }
}
