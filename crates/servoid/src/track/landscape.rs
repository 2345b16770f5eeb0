use crate::parallel::*;

use super::TrackError;
use super::inputs::Inputs;
use super::pose::search::{Probes, ScoreTerms, Scorer};
use super::tracker::Tracker;
use crate::camera::{Observation, Pyramid};
use crate::model::workers;
use crate::pose::Pose;

/// Poses that one thread scores in a batch.
const PIECE: usize = 256;

impl Tracker {
    /// Scores poses in an observation by all that was learned so far, with the weights of a global
    /// search. Nothing is learned from the observation.
    ///
    /// `resolution` is that of the surface points: 0 is the image's own, at which poses are
    /// refined; each further one is half as fine, up to the coarsest, at which poses are searched.
    /// The bits are the same on any number of `threads`; 0 uses as many as the machine has.
    ///
    /// # Errors
    /// If there is not one entry per camera, the time stamp is not finite, there is no such
    /// resolution, or the object's appearance was never learned.
    pub fn score_terms(
        &self,
        observation: &Observation<'_>,
        poses: &[Pose],
        resolution: usize,
        threads: usize,
    ) -> Result<Vec<ScoreTerms>, TrackError> {
        if resolution >= Pyramid::LEVELS {
            return Err(TrackError::Setting {
                name: "resolution",
                allowed: "0 (the image's own) to 2 (a quarter of it)",
                given: resolution.to_string(),
            });
        }
        if !self.target.colors.are_known() && self.target.points.features.is_empty() {
            return Err(TrackError::NothingKnown);
        }
        let mut looking = self.clone();
        looking.frame.check(observation)?;
        looking.open_all_over(observation);
        let area = looking.area(&looking.motion.last());
        let known: Vec<usize> = looking.target.points.all_but_edgels().collect();
        let most = known.len().min(looking.settings.points);
        // Evenly spaced, so that no side of the object is left out.
        let probes: Vec<usize> = (0..most).map(|at| known[at * known.len() / most]).collect();
        let scorer = Scorer {
            inputs: Inputs::new(&looking.frame, observation, &looking.target, &looking.settings),
            probes: Probes::Facing(&probes),
            area,
        };
        let of_piece = |piece: &[Pose]| -> Vec<ScoreTerms> {
            piece.iter().map(|pose| scorer.terms(pose, resolution)).collect()
        };
        let pieces: Vec<_> =
            workers(threads)?.install(|| poses.par_chunks(PIECE).map(of_piece).collect());
        Ok(pieces.concat())
    }
}
