//! The paper's own tracker: a genetic algorithm that breeds one generation per image.

mod colors;
mod life;
mod population;
mod settings;

pub use settings::{Genes, Objective, OneStepError, OneStepSettings};

use std::time::Instant;

use colors::Colors;
use life::{Life, Maps};
use nalgebra::{Matrix6, UnitQuaternion, Vector3};
use population::{PopulationMoments, SearchRange};

use super::start_masks::masks_at;
use super::{Estimate, Notice, Status, Timing};
use crate::camera::{Camera, ImageView, Mask, Observation, RigError};
use crate::fitness::Points;
use crate::pose::Pose;
use crate::shape::Body;

/// Tracks a body as the paper does (Sec. 3.2, "1-step GA"): the population persists across images,
/// breeds one generation per image, and its best individual is the estimate.
///
/// The elites survive, but are scored again in each image, where their scores may differ. The
/// search is centred on the last estimate; motion is not predicted. While the images do not show
/// the object where it is sought, the estimate stays, and the population is redrawn around it for
/// each image.
pub struct OneStep {
    cameras: Vec<Camera>,
    body: Body,
    settings: OneStepSettings,
    range: SearchRange,
    started: Option<Started>,
}

/// The state after a start.
struct Started {
    colors: Colors,
    life: Life,
    moments: PopulationMoments,
    time_s: f64,
    missed: usize,
}

/// One usable image.
struct UsableImage<'a> {
    index: usize,
    camera: Camera,
    world_from_camera: Pose,
    image: ImageView<'a>,
}

/// A generation: its best pose, the covariance of the others about it, evaluations and timing.
struct Generation {
    best: Pose,
    covariance: Matrix6<f64>,
    evaluations: usize,
    timing: Timing,
}

impl OneStep {
    /// Makes a tracker of the cameras, the body and the settings.
    ///
    /// # Errors
    /// If there is no camera or a setting is out of its range.
    pub fn new(
        cameras: &[Camera],
        body: &Body,
        settings: OneStepSettings,
    ) -> Result<Self, OneStepError> {
        let settings = settings.checked()?;
        if cameras.is_empty() {
            return Err(RigError::NoCamera.into());
        }
        if let Objective::Points { count, alpha } = settings.objective {
            Points::check(count, alpha)?;
        }
        let size = size(body);
        let turn = if settings.genes == Genes::Pose { settings.turn } else { 0.0 };
        let range = SearchRange { place: settings.reach * size, turn, size };
        // Reports invalid settings of the search now.
        Life::new(Pose::identity(), UnitQuaternion::identity(), &settings, &range)?;
        let (cameras, body) = (cameras.to_vec(), body.clone());
        Ok(Self { cameras, body, settings, range, started: None })
    }

    /// Starts with the object at a known pose: learns its colours from the masks, one per camera or
    /// none at all, or from the body's outline where no mask lies on it. The first generation is
    /// scored in these images; the estimate is the given pose.
    ///
    /// # Errors
    /// If the observation or the masks do not belong to the cameras, or no image shows the object.
    pub fn start(
        &mut self,
        observation: &Observation<'_>,
        world_from_object: Pose,
        masks: &[Option<Mask<'_>>],
    ) -> Result<Estimate, OneStepError> {
        let (usable, mut notices) = self.usable(observation)?;
        if !(masks.is_empty() || masks.len() == self.cameras.len()) {
            let (cameras, given) = (self.cameras.len(), masks.len());
            return Err(RigError::Count { what: "masks", cameras, given }.into());
        }
        let begun = Instant::now();
        let body = self.body.at(world_from_object);
        let (masks, elsewhere) = masks_at(&body, &self.cameras, observation, masks);
        notices.extend(elsewhere);
        let colors = Colors::learn(&usable, &body, &masks)?;
        let update = begun.elapsed();
        let axes = observation.world_from_camera[0].rotation();
        let life = Life::new(world_from_object, axes, &self.settings, &self.range)?;
        let time_s = observation.time_s;
        let moments = PopulationMoments::new(self.range);
        let mut started = Started { colors, life, moments, time_s, missed: 0 };
        let mut generation = self.generation(&mut started, &usable)?;
        generation.best = world_from_object;
        generation.timing.update = update;
        let verified = self.verify(&mut started, &usable, generation, notices);
        self.started = Some(started);
        verified
    }

    /// Tracks the object in the next observation.
    ///
    /// # Errors
    /// If the tracker was not started or the observation does not belong to the cameras. Problems
    /// of single images are reported as notices.
    pub fn step(&mut self, observation: &Observation<'_>) -> Result<Estimate, OneStepError> {
        let mut started = self.started.take().ok_or(OneStepError::NotStarted)?;
        let estimate = self.followed(&mut started, observation);
        self.started = Some(started);
        estimate
    }

    /// Returns the score of the best individual in the newest image; `None` before the start.
    #[must_use]
    pub fn best_score(&self) -> Option<f64> {
        self.started.as_ref().map(|started| started.life.best_score())
    }

    /// Sets the orientation of the object in the world, as the paper does where it is known; all
    /// individuals rotate along.
    ///
    /// # Errors
    /// If the tracker was not started.
    pub fn set_orientation(
        &mut self,
        world_from_object: UnitQuaternion<f64>,
    ) -> Result<(), OneStepError> {
        let started = self.started.as_mut().ok_or(OneStepError::NotStarted)?;
        started.life.turn_to(world_from_object);
        Ok(())
    }

    fn followed(
        &self,
        started: &mut Started,
        observation: &Observation<'_>,
    ) -> Result<Estimate, OneStepError> {
        let (usable, mut notices) = self.usable(observation)?;
        let (before, now) = (started.time_s, observation.time_s);
        if now <= before {
            notices.push(Notice::Time { before, now });
        }
        started.time_s = now;
        let generation = if usable.is_empty() {
            let (best, covariance) = (started.life.anchor, started.moments.anywhere());
            Generation { best, covariance, evaluations: 0, timing: Timing::default() }
        } else {
            self.generation(started, &usable)?
        };
        self.verify(started, &usable, generation, notices)
    }

    /// Selects the images that can be used.
    fn usable<'a>(
        &self,
        observation: &Observation<'a>,
    ) -> Result<(Vec<UsableImage<'a>>, Vec<Notice>), OneStepError> {
        let cameras = self.cameras.len();
        let (poses, images) = (&observation.world_from_camera, &observation.images);
        for (what, given) in [("poses", poses.len()), ("images", images.len())] {
            if given != cameras {
                return Err(RigError::Count { what, cameras, given }.into());
            }
        }
        if !observation.time_s.is_finite() {
            return Err(RigError::Time(observation.time_s).into());
        }
        let (mut usable, mut notices) = (vec![], vec![]);
        for (index, (&camera, (&world_from_camera, image))) in
            self.cameras.iter().zip(poses.iter().zip(images)).enumerate()
        {
            let expected = camera.size_px();
            match *image {
                Some(image) if image.size_px() == expected => {
                    usable.push(UsableImage { index, camera, world_from_camera, image });
                }
                Some(image) => {
                    let given = image.size_px();
                    notices.push(Notice::WrongSize { camera: index, expected, given });
                }
                None => notices.push(Notice::NoImage(index)),
            }
        }
        Ok((usable, notices))
    }

    /// Scores the population in the images and breeds the next one.
    fn generation(
        &self,
        started: &mut Started,
        usable: &[UsableImage<'_>],
    ) -> Result<Generation, OneStepError> {
        let begun = Instant::now();
        let maps = Maps::new(usable, &started.colors, self.settings.objective);
        let prepare = begun.elapsed();
        let poses = started.life.poses();
        let scores = maps.scores(&self.body, &poses, self.settings.objective)?;
        started.life.breed(&scores)?;
        let mut order: Vec<_> = (0..poses.len()).collect();
        order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
        let ranked: Vec<_> = order.into_iter().map(|index| poses[index]).collect();
        let covariance = started.moments.update(&ranked);
        let timing = Timing { prepare, search: begun.elapsed() - prepare, ..Timing::default() };
        Ok(Generation { best: ranked[0], covariance, evaluations: poses.len(), timing })
    }

    /// Checks whether the images confirm the best pose, and centres the search on it if so.
    fn verify(
        &self,
        started: &mut Started,
        usable: &[UsableImage<'_>],
        generation: Generation,
        mut notices: Vec<Notice>,
    ) -> Result<Estimate, OneStepError> {
        let begun = Instant::now();
        let Generation { best, mut covariance, evaluations, timing } = generation;
        let OneStepSettings { tracking_from, missing_below, lost_after, .. } = self.settings;
        let (confidence, outside) = started.colors.confidence(usable, &self.body.at(best));
        notices.extend(outside.into_iter().map(Notice::OutOfImage));
        let shown = confidence >= missing_below && !usable.is_empty();
        started.missed = if shown { 0 } else { started.missed + 1 };
        if shown {
            started.life.anchor_at(best);
        } else {
            covariance = started.moments.anywhere();
        }
        // Missing images are no evidence against the population.
        if !shown && !usable.is_empty() {
            started.life.scatter(&self.settings, &self.range)?;
        }
        let status = match shown {
            false if started.missed >= lost_after => Status::Lost,
            true if confidence >= tracking_from => Status::Tracking,
            _ => Status::Searching,
        };
        Ok(Estimate {
            time_s: started.time_s,
            world_from_object: started.life.anchor,
            covariance,
            unobservable: started.moments.unobservable(),
            confidence,
            evidence: None,
            status,
            located: status == Status::Tracking,
            keyframes: [None; 2],
            evolved: false,
            notices,
            evaluations,
            timing: Timing { verify: begun.elapsed(), ..timing },
        })
    }
}

/// Returns an object's size in metres: its reach from the mean of its ellipsoids' centres.
fn size(body: &Body) -> f64 {
    let ellipsoids = body.ellipsoids();
    let sum: Vector3<f64> = ellipsoids.iter().map(|e| e.center()).sum();
    let middle = sum / ellipsoids.len() as f64;
    let reach = ellipsoids.iter().map(|e| (e.center() - middle).norm() + e.radii().max());
    reach.fold(0.0, f64::max)
}
