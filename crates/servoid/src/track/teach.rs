use super::attempt::{Attempt, sight};
use super::judge::Verdict;
use super::learn::{Lesson, learn};
use super::polish::Sight;
use super::tracker::{CLEAR, Tracker};
use crate::observe::Observation;
use crate::pose::Pose;

/// Cells of each window in which new points are sought while tracking.
const CELLS: usize = 40;
/// Places of each window that are looked at closely for one.
const TRIES: usize = 6;
/// Share of the newest image in what is known of colours.
const COLOR_RATE: f32 = 0.15;
/// Images from one that teaches colours to the next.
const COLOR_LESSONS: usize = 2;
/// Share of the usual surface points that must be seen for what is learned to be true, after a doubt
/// and when the last images were clear: a side that turns into view brings its points one by one.
const WELL_RECOGNISED: (f64, f64) = (0.6, 0.3);
/// Clear images after which a doubt is over.
pub(super) const DOUBT: usize = 8;
/// Confidence from which on colours are learned.
const COLOR_CONFIDENCE: f64 = 0.65;
/// Pixels about the outline that teach no colours, since bodies are not made of ellipsoids.
const DOUBT_PX: f64 = 4.0;

impl Tracker {
    /// Learns from an observation in which the object is tracked.
    pub(super) fn learn(&mut self, observation: &Observation<'_>, attempt: &Attempt) {
        let Verdict { visible, recognised, .. } = attempt.verdict;
        let is_clear = visible >= CLEAR;
        self.doubt = if is_clear { self.doubt.saturating_sub(1) } else { DOUBT };
        if self.settings.region && visible >= COLOR_CONFIDENCE {
            self.lessons += 1;
            if self.lessons.is_multiple_of(COLOR_LESSONS) {
                self.learn_colors(observation, &attempt.pose, COLOR_RATE);
            }
        }
        // What hides the object must not become part of it.
        if !is_clear {
            return;
        }
        let eye = observation.world_from_camera[0].translation();
        let usual = self.usual.recognised;
        self.usual.follow(&attempt.verdict, (attempt.pose.translation() - eye).norm());
        // Nor must a pose that is a little off teach where its points are.
        let (doubted, sure) = WELL_RECOGNISED;
        let least = if self.doubt > 0 { doubted } else { sure };
        if recognised < least * usual {
            return;
        }
        self.keep_views(observation, &attempt.pose);
        if self.settings.surface {
            self.points.refine(&self.desk.matches);
            let lesson = Lesson { from: self.cell, cells: CELLS, tries: TRIES, masks: &[] };
            self.cell = self.cell.wrapping_add(CELLS);
            self.learn_points(observation, &attempt.pose, &lesson);
            self.points.judge(&self.desk.matches);
        }
    }

    pub(super) fn learn_colors(&mut self, observation: &Observation<'_>, pose: &Pose, rate: f32) {
        for (window, image) in self.windows.iter().zip(&observation.images) {
            let (Some(projection), Some(image)) = (window.projection(pose), image) else {
                continue;
            };
            let outlines = &mut self.desk.teaching;
            outlines.clear();
            outlines.extend(self.solid.outlines(&projection));
            window.teach(image, outlines, DOUBT_PX, &mut self.colors);
        }
        self.colors.take(rate);
    }

    pub(super) fn learn_points(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        lesson: &Lesson<'_>,
    ) {
        let sight = sight!(self, observation);
        self.fresh.clear();
        learn(&sight, pose, &self.desk.in_view, lesson, &mut self.fresh);
        self.points.add(&mut self.fresh);
    }
}
