use super::TrackError;
use super::target::solid::Solid;
use super::tracker::Tracker;
use crate::fitness::Sight;
use crate::model::{self, Given, Portrait};
use crate::observe::Observation;
use crate::pose::Pose;
use crate::shape::Body;

/// Surface points whose distance is known at least this well, as a share of the body's radius, say
/// where the surface is.
const WELL_KNOWN: f64 = 0.03;
/// A body may reach as far from the middle as this, in radii of the body before: beyond, it fits what
/// is none of it.
const FARTHEST: f64 = 1.4;

impl Tracker {
    /// Lets the body evolve by the sides that were seen and the surface points that were learned,
    /// within a budget of its own; says whether it changed. The object's frame does not move, so
    /// poses before and after mean the same. The same observations give the same bits.
    ///
    /// # Errors
    /// If the views do not make a scene.
    pub fn evolve(&mut self) -> Result<bool, TrackError> {
        if self.target.sides.fresh == 0 {
            return Ok(false);
        }
        self.target.sides.fresh = 0;
        self.target.sides.mark(&self.target.solid, &self.target.colors);
        let known = self.target.points.known.iter();
        let sure = known.filter(|k| k.variance.sqrt() < WELL_KNOWN * self.target.solid.radius);
        let sure = sure.map(|k| (k.point.position, k.point.toward));
        let measured = self.target.ranges.all.iter().map(|one| (one.position, one.toward));
        let sights: Vec<_> = sure
            .chain(measured)
            .map(|(point, toward)| Sight { point, direction: -toward, eye: 0.0 })
            .collect();
        // Of the sides that were not seen, what is believed so far stays.
        let believed = Portrait::of_body(&self.target.body, self.target.sides.unseen())?;
        let mut views = self.target.sides.views();
        for portrait in &believed {
            views.push(portrait.view()?);
        }
        if views.len() < 2 {
            return Ok(false);
        }
        let given = Given { views: &views, sights: &sights, ..Given::default() };
        let grown = model::evolved(&given, self.target.body.ellipsoids(), &self.settings.growth)?;
        let body = Body::new(self.target.body.world_from_object(), grown)?;
        let solid = Solid::new(&body);
        if solid.radius > FARTHEST * self.target.solid.radius {
            return Ok(false);
        }
        (self.target.body, self.target.solid) = (body, solid);
        Ok(true)
    }

    /// Keeps what the cameras show of a side that was not seen before.
    pub(super) fn keep_views(&mut self, observation: &Observation<'_>, pose: &Pose) {
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
