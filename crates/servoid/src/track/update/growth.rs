use nalgebra::Vector3;

use crate::camera::Observation;
use crate::fitness::RangeSample;
use crate::model::{self, ModelError, ModelInput, SyntheticView};
use crate::parallel::pool;
use crate::pose::Pose;
use crate::shape::{Body, Ellipsoid};
use crate::track::TrackError;
use crate::track::adjust::Job;
use crate::track::settings::TrackSettings;
use crate::track::target::Target;
use crate::track::target::colors::Colors;
use crate::track::target::sides::{Marks, Sides};
use crate::track::target::solid::Solid;
use crate::track::tracker::Tracker;

/// Surface points whose distance is known at least this well, as a share of the body's radius, say
/// where the surface is.
const WELL_KNOWN: f64 = 0.03;
/// A body may reach as far from the middle as this, in radii of the body before: beyond, it fits
/// what is none of it.
const FARTHEST: f64 = 1.4;
/// Observations after which a body that evolved in the worker is taken over: the same bits, however
/// long it takes.
const DELAY: usize = 5;

/// A body that evolves beside the tracker.
pub(crate) type Evolving = Job<Result<Evolved, ModelError>>;

/// What a body evolves by, as far as it was known when that began.
#[derive(Debug, Clone)]
struct Growth {
    body: Body,
    solid: Solid,
    sides: Sides,
    colors: Colors,
    samples: Vec<RangeSample>,
    settings: model::Settings,
}

/// A body that evolved, and the masks of the sides by which it did.
#[derive(Debug, Clone)]
pub(crate) struct Evolved {
    ellipsoids: Option<Vec<Ellipsoid>>,
    marks: Marks,
}

impl Tracker {
    /// Lets the body evolve by the sides that were seen and the surface points that were learned,
    /// within a budget of its own; says whether it changed. The object's frame does not move, so
    /// poses before and after mean the same. The same observations give the same bits.
    ///
    /// # Errors
    /// If the views do not make a scene.
    pub fn evolve(&mut self) -> Result<bool, TrackError> {
        if self.evolving.take().is_some() {
            // What it was to evolve by is still new.
            self.target.sides.fresh = self.target.sides.fresh.max(1);
        }
        let Some(growth) = self.target.growth(&self.settings) else { return Ok(false) };
        Ok(self.target.grow(growth.evolved()?))
    }

    /// Begins to let the body evolve as `evolve` does, in a thread of its own; says whether there
    /// is anything new to evolve by. An estimate says when the body has `evolved`: exactly a few
    /// observations later, so that the same observations give the same bits.
    pub fn begin_evolving(&mut self) -> bool {
        if self.evolving.is_some() {
            return false;
        }
        let Some(growth) = self.target.growth(&self.settings) else { return false };
        let adjusting = self.pending.as_ref().map(|pending| pending.job.clone());
        self.evolving = Some(Job::new(DELAY, adjusting, move || {
            pool(1).map_err(|_| ModelError::Threads(1))?.install(|| growth.clone().evolved())
        }));
        true
    }

    /// Takes over the body that evolved in the worker, once it is time; says whether it changed.
    pub(crate) fn take_evolved(&mut self) -> Result<bool, TrackError> {
        let due = self.evolving.take_if(Job::is_due);
        let evolved = due.and_then(|evolving| evolving.result());
        Ok(evolved.transpose()?.is_some_and(|evolved| self.target.grow(evolved)))
    }

    /// Keeps what the cameras show of a side that was not seen before.
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
    /// Returns what the body can evolve by; nothing where no side is new.
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
            settings: settings.growth,
        })
    }

    /// Takes over a body that evolved; says whether it changed.
    fn grow(&mut self, evolved: Evolved) -> bool {
        self.sides.take_over(evolved.marks);
        let world_from_object = self.body.world_from_object();
        let body = evolved.ellipsoids.and_then(|all| Body::new(world_from_object, all).ok());
        let Some(body) = body else { return false };
        let solid = Solid::new(&body);
        let grows = solid.radius <= FARTHEST * self.solid.radius;
        if grows {
            (self.body, self.solid) = (body, solid);
        }
        grows
    }
}

impl Growth {
    /// Returns the body as it evolves; nothing where too few views tell of it.
    fn evolved(mut self) -> Result<Evolved, ModelError> {
        let marks = self.sides.mark(&self.solid, &self.colors);
        // Of the sides that were not seen, what is believed so far stays.
        let believed = SyntheticView::of_body(&self.body, self.sides.unseen())?;
        let mut views = self.sides.views();
        for synthetic in &believed {
            views.push(synthetic.view()?);
        }
        if views.len() < 2 {
            return Ok(Evolved { ellipsoids: None, marks });
        }
        let given = ModelInput { views: &views, samples: &self.samples, ..ModelInput::default() };
        let ellipsoids = model::evolved(&given, self.body.ellipsoids(), &self.settings)?;
        Ok(Evolved { ellipsoids: Some(ellipsoids), marks })
    }
}
