use super::TrackError;
use super::clock::Clock;
use super::estimate::{Estimate, Notice, Status};
use super::motion::Motion;
use super::pose::confidence::unseen;
use super::pose::hypothesis::Hypothesis;
use super::relocalize::ROUNDS;
use super::start_masks::masks_at;
use super::target::colors::Colors;
use super::target::keyframes::{Keyframes, object_from_camera};
use super::tracker::Tracker;
use super::trust::Trust;
use super::update::detect::DetectionPlan;
use crate::camera::{Channels, Mask, Observation, check_image_size};
use crate::pose::Pose;

/// Margin of a window around the object at the start, as a share of its size.
const START_MARGIN: f64 = 0.5;

impl Tracker {
    /// Learns colours and surface points from an observation in which the object's pose is known.
    /// Masks, one per camera or none, mark the object's pixels; without them its outline does. If
    /// the images contradict the pose, or all masks do, which are then not used, the object is
    /// sought from the next observation on.
    ///
    /// # Errors
    /// If there is not one entry per camera, the time stamp is not finite, a mask does not have its
    /// camera's size, or the object is in none of the images.
    pub fn start(
        &mut self,
        observation: &Observation<'_>,
        world_from_object: Pose,
        masks: &[Option<Mask<'_>>],
    ) -> Result<Estimate, TrackError> {
        self.check_masks(masks)?;
        // Nothing of the previous state remains, and a start that fails changes nothing.
        let mut fresh = Self::new(&self.frame.cameras, &self.target.body, self.settings)?;
        fresh.target.keyframes = Keyframes::after(&self.target.keyframes);
        fresh.look_alikes.avoid_as(&self.look_alikes);
        let estimate = fresh.initialize(observation, world_from_object, masks)?;
        *self = fresh;
        Ok(estimate)
    }

    /// Learns the object's appearance from the first observation.
    fn initialize(
        &mut self,
        observation: &Observation<'_>,
        world_from_object: Pose,
        masks: &[Option<Mask<'_>>],
    ) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        self.frame.check(observation)?;
        let body = self.target.body.at(world_from_object);
        let (masks, elsewhere) = masks_at(&body, &self.frame.cameras, observation, masks);
        let (masks, agrees) =
            (&masks[..], elsewhere.is_empty() || masks.iter().any(Option::is_some));
        self.motion = Motion::at_rest(observation.time_s, world_from_object);
        if !self.open_windows(observation, &world_from_object, START_MARGIN) {
            return Err(self.unseen_at_first());
        }
        if masks.iter().any(Option::is_some) {
            self.count_masks(observation, masks);
        } else {
            self.update_colors(observation, &world_from_object, 1.0);
        }
        self.open_windows(observation, &world_from_object, START_MARGIN);
        self.keep_masked(observation, &world_from_object, masks);
        self.compare_depths(observation, &world_from_object);
        self.points_in_view(&world_from_object);
        if self.settings.surface {
            let (cells, tries) = (usize::MAX, usize::MAX);
            let all = DetectionPlan { from: 0, cells, tries, edgels: false, masks };
            self.detect_points(observation, &world_from_object, &all);
            self.points_in_view(&world_from_object);
            self.parting.begin(self.target.points.next, &world_from_object);
        }
        self.update_ranges(observation, &world_from_object, masks);
        let hypothesis = self.set_reference(observation, &world_from_object);
        // The pose is given, so the residual of the outline at it is its bias.
        self.target.bias.update_at(&hypothesis.toward, hypothesis.normal.outline);
        self.target.relief.begin(object_from_camera(observation, &hypothesis.pose));
        if self.is_patterned(&hypothesis.quality) || self.is_plain() {
            self.target.offsets.learn_at(&self.workspace.edges);
        }
        self.keep_keyframe(observation, &hypothesis);
        let is_confirmed = agrees && hypothesis.quality.share >= self.settings.held;
        self.status = if is_confirmed { Status::Tracking } else { Status::Searching };
        self.trust = Trust::given(is_confirmed);
        let mut estimate = self.estimate(observation, &hypothesis);
        // A given pose is known, even if the images hardly constrain its orientation.
        (estimate.status, estimate.located) = (self.status, is_confirmed);
        self.trust.is_oriented = is_confirmed;
        estimate.confidence = if is_confirmed { 1.0 } else { unseen(self.status) };
        estimate.notices.retain(|notice| *notice != Notice::TurnOpen);
        estimate.notices.extend(elsewhere);
        if is_confirmed {
            self.keep_surely_seen(observation, &hypothesis);
        }
        clock.lap(|timing| &mut timing.update);
        estimate.timing = clock.timing();
        Ok(estimate)
    }

    /// Returns why the first observation does not show the object.
    fn unseen_at_first(&mut self) -> TrackError {
        let mut notices = std::mem::take(&mut self.frame.notices);
        notices.retain(|notice| notice.is_of_image());
        if notices.is_empty() { TrackError::NotInView } else { TrackError::NoUse(notices) }
    }

    /// Searches for the object near a pose, or everywhere, with all that is known of it, and
    /// continues tracking from there. What stood elsewhere while the object was seen is found only
    /// near a given pose.
    ///
    /// # Errors
    /// If there is not one entry per camera, the time stamp is not finite, or the object's
    /// appearance is unknown.
    pub fn find(
        &mut self,
        observation: &Observation<'_>,
        near: Option<Pose>,
    ) -> Result<Estimate, TrackError> {
        let mut clock = Clock::start();
        self.frame.check(observation)?;
        self.frame.is_blurred = false;
        if near.is_some() {
            self.look_alikes.forget();
        }
        if !self.target.colors.are_known() {
            self.count_surroundings(observation, near)?;
        }
        let expected = near.unwrap_or_else(|| self.motion.last());
        let mut hypothesis = Hypothesis::nothing(expected, self.target.solid.radius);
        let evaluations = match near {
            Some(_) => {
                self.relocalize_locally(observation, (&expected, ROUNDS.0), &mut hypothesis)?
            }
            None => self.relocalize_globally(observation, ROUNDS.1, &mut hypothesis)?,
        };
        clock.lap(|timing| &mut timing.search);
        let found = hypothesis.pose;
        // The last pose says nothing about the current motion.
        self.status = Status::Searching;
        self.accept_or_miss(observation.time_s, &found, &hypothesis, self.settings.trusted);
        self.note_dropped(self.status == Status::Tracking);
        let estimate = self.estimate(observation, &hypothesis);
        // Even if it is not trusted, the best guess is better than the last pose.
        let timing = clock.timing();
        Ok(Estimate { evaluations, timing, world_from_object: found, ..estimate })
    }

    /// Stores the views of the cameras, with their masks.
    fn keep_masked(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        masks: &[Option<Mask<'_>>],
    ) {
        for (camera, (window, mask)) in self.frame.windows.iter().zip(masks).enumerate() {
            let image = observation.images[camera].filter(|_| window.is_open());
            if let (Some(image), Some(mask)) = (image, mask) {
                let seen = (window, &image, &self.frame.cameras[camera]);
                let poses = (&observation.world_from_camera[camera], pose);
                let keyframe = self.target.keyframes.upcoming();
                self.target.sides.offer(seen, poses, (keyframe, Some(&mask.image())));
            }
        }
    }

    /// Takes what is observed at a pose as the reference.
    fn set_reference(&mut self, observation: &Observation<'_>, pose: &Pose) -> Hypothesis {
        let eye = observation.world_from_camera[0].translation();
        self.target.reference.distance = (pose.translation() - eye).norm();
        self.target.reference.area =
            self.area(pose) * self.target.reference.distance * self.target.reference.distance;
        // Colours count only once there is a reference for them.
        let colors = self.evaluate(observation, pose, None).quality;
        (self.target.reference.ratio, self.target.reference.outline) =
            (colors.ratio, colors.outline);
        let hypothesis = self.evaluate(observation, pose, None);
        self.target.reference.support = hypothesis.quality.support;
        self.target.reference.recognised = hypothesis.quality.recognised;
        self.target.reference.begin(&hypothesis.quality);
        self.target.reference.share = hypothesis.quality.share;
        hypothesis
    }

    fn check_masks(&self, masks: &[Option<Mask<'_>>]) -> Result<(), TrackError> {
        for (index, (camera, mask)) in self.frame.cameras.iter().zip(masks).enumerate() {
            if let Some(mask) = mask {
                check_image_size(index, camera.size_px(), mask.image())?;
            }
        }
        Ok(())
    }

    fn count_masks(&mut self, observation: &Observation<'_>, masks: &[Option<Mask<'_>>]) {
        let masks = masks.iter().chain(std::iter::repeat(&None));
        let images = observation.images.iter().zip(masks);
        for (window, (image, mask)) in self.frame.windows.iter().zip(images) {
            if let (true, Some(image), Some(mask)) = (window.is_open(), image, mask) {
                window.count_mask(image, &mask.image(), &mut self.target.colors);
            }
        }
        self.target.colors.take(1.0);
    }

    /// Counts all that the images show as background, where only the object's colours are known:
    /// the object is small in comparison. Colours learned in colour images say nothing about grey
    /// ones, and vice versa; in images of the other kind only the surface points are left, which
    /// suffice only near a pose.
    fn count_surroundings(
        &mut self,
        observation: &Observation<'_>,
        near: Option<Pose>,
    ) -> Result<(), TrackError> {
        let images: Vec<_> = self.frame.images(observation).collect();
        let known = images.is_empty()
            || images.iter().any(|i| self.target.colors.know_object(i.channels()));
        if !known && (near.is_none() || self.target.points.features.is_empty()) {
            let kinds = [Channels::Rgb, Channels::Grey];
            let learned = kinds.into_iter().find(|kind| self.target.colors.know_object(*kind));
            return Err(learned.map_or(TrackError::NothingKnown, TrackError::LearnedIn));
        }
        if !known {
            self.target.colors = Colors::new(self.settings.local_colors);
            (self.target.reference.ratio, self.target.reference.outline) = (0.0, 0.0);
            return Ok(());
        }
        self.open_all_over(observation);
        for (window, image) in self.frame.windows.iter().zip(&observation.images) {
            if let Some(image) = image.as_ref().filter(|_| window.is_open()) {
                window.count_colors(image, &[], 0.0, &mut self.target.colors);
            }
        }
        self.target.colors.take(0.0);
        Ok(())
    }
}
