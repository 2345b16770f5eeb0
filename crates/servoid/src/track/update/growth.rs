use nalgebra::Vector3;

use crate::camera::Observation;
use crate::fitness::RangeSample;
use crate::model::{self, Attempt, ModelError, ModelInput, SyntheticView, evolved_after};
use crate::parallel::pool;
use crate::pose::Pose;
use crate::shape::{Body, Ellipsoid};
use crate::track::TrackError;
use crate::track::adjust::Job;
use crate::track::settings::TrackSettings;
use crate::track::target::Target;
use crate::track::target::colors::Colors;
use crate::track::target::contour_offsets::ContourOffsets;
use crate::track::target::sides::{Marks, Sides};
use crate::track::target::solid::Solid;
use crate::track::tracker::Tracker;

/// Largest standard deviation of the distance of a surface point, as a share of the body's radius,
/// for the point to be used as a sample of the surface.
const WELL_KNOWN: f64 = 0.03;
/// Largest reach of a body from its middle, in radii of the previous body: a larger one fits
/// something that is not part of the object.
const FARTHEST: f64 = 1.4;
/// Observations after which a body that evolved in the worker replaces the old one: a fixed delay
/// gives the same bits, however long the work takes.
const DELAY: usize = 5;

/// A body that evolves beside the tracker.
pub(crate) type Evolving = Job<Result<Evolved, ModelError>>;

/// The data by which a body evolves, as known when that began.
#[derive(Debug, Clone)]
struct Growth {
    body: Body,
    solid: Solid,
    sides: Sides,
    colors: Colors,
    samples: Vec<RangeSample>,
    vain: Option<Attempt>,
    settings: model::Settings,
}

/// A body that evolved, and the masks by which it did.
#[derive(Debug, Clone)]
pub(crate) struct Evolved {
    ellipsoids: Option<Vec<Ellipsoid>>,
    vain: Option<Attempt>,
    marks: Marks,
}

impl Tracker {
    /// Evolves the body by the views and surface points learned so far, within its own budget;
    /// returns whether it changed. The object's frame does not move, so poses before and after mean
    /// the same. The same observations give the same bits.
    ///
    /// # Errors
    /// If the views do not make a scene.
    pub fn evolve(&mut self) -> Result<bool, TrackError> {
        if self.evolving.take().is_some() {
            // The data of the cancelled job has not been used yet.
            self.target.sides.fresh = self.target.sides.fresh.max(1);
        }
        let Some(growth) = self.target.growth(&self.settings) else { return Ok(false) };
        Ok(self.target.grow(growth.evolved()?))
    }

    /// Starts to evolve the body as `evolve` does, in a separate thread; returns whether there is
    /// anything new to evolve by. The estimate a fixed number of observations later reports that
    /// the body has `evolved`, so the same observations give the same bits.
    pub fn begin_evolving(&mut self) -> bool {
        if self.evolving.is_some() || self.is_outlined() {
            return false;
        }
        let Some(growth) = self.target.growth(&self.settings) else { return false };
        let adjusting = self.pending.as_ref().map(|pending| pending.job.clone());
        self.evolving = Some(Job::new(DELAY, adjusting, move || {
            pool(1).map_err(|_| ModelError::Threads(1))?.install(|| growth.clone().evolved())
        }));
        true
    }

    /// Takes over the body that evolved in the worker, once it is due; returns whether the body
    /// changed.
    pub(crate) fn take_evolved(&mut self) -> Result<bool, TrackError> {
        let due = self.evolving.take_if(Job::is_due);
        let evolved = due.and_then(|evolving| evolving.result());
        Ok(evolved.transpose()?.is_some_and(|evolved| self.target.grow(evolved)))
    }

    /// Stores the cameras' views of a side that was not seen before.
    pub(crate) fn keep_views(&mut self, observation: &Observation<'_>, pose: &Pose) {
        let (keyframe, _) = self.keyframe_around(observation, pose);
        for (camera, window) in self.frame.windows.iter().enumerate() {
            if let (true, Some(image)) = (window.is_open(), &observation.images[camera]) {
                let poses = (&observation.world_from_camera[camera], pose);
                let seen = (window, image, &self.frame.cameras[camera]);
                self.target.sides.offer(seen, poses, (keyframe, None));
            }
        }
    }
}

impl Target {
    /// Returns the data by which the body can evolve; none where no side is new.
    fn growth(&mut self, settings: &TrackSettings) -> Option<Growth> {
        if std::mem::take(&mut self.sides.fresh) == 0 {
            return None;
        }
        let known = self.points.features.iter();
        let sure = known.filter(|k| k.variance.sqrt() < WELL_KNOWN * self.solid.radius);
        let sure = sure.map(|k| (k.point.position, k.point.toward));
        let measured = self.ranges.all.iter().map(|one| (one.position, one.toward));
        let samples = |(point, toward): (Vector3<f64>, Vector3<f64>)| RangeSample {
            point,
            direction: -toward,
            eye: 0.0,
        };
        Some(Growth {
            body: self.body.clone(),
            solid: self.solid.clone(),
            sides: self.sides.clone(),
            colors: self.colors.clone(),
            samples: sure.chain(measured).map(samples).collect(),
            vain: self.vain_growth,
            settings: settings.growth,
        })
    }

    /// Takes over an evolved body; returns whether the body changed.
    fn grow(&mut self, evolved: Evolved) -> bool {
        self.sides.take_over(evolved.marks);
        self.vain_growth = evolved.vain;
        let world_from_object = self.body.world_from_object();
        let body = evolved.ellipsoids.and_then(|all| Body::new(world_from_object, all).ok());
        let Some(body) = body else { return false };
        let solid = Solid::new(&body);
        let grows = solid.radius <= FARTHEST * self.solid.radius;
        if grows {
            self.offsets = ContourOffsets::unknown(body.ellipsoids().len());
            (self.body, self.solid) = (body, solid);
        }
        grows
    }
}

impl Growth {
    /// Evolves the body; returns no ellipsoids if there are too few views.
    fn evolved(mut self) -> Result<Evolved, ModelError> {
        let marks = self.sides.mark(&self.solid, &self.colors);
        // For unseen sides the current body is kept.
        let believed = SyntheticView::of_body(&self.body, self.sides.unseen())?;
        let mut views = self.sides.views();
        for synthetic in &believed {
            views.push(synthetic.view()?);
        }
        if views.len() < 2 {
            return Ok(Evolved { ellipsoids: None, vain: self.vain, marks });
        }
        let given = ModelInput { views: &views, samples: &self.samples, ..ModelInput::default() };
        let current = self.body.ellipsoids();
        let (ellipsoids, vain) = evolved_after(self.vain, &given, current, &self.settings)?;
        Ok(Evolved { ellipsoids: Some(ellipsoids), vain, marks })
    }
}
