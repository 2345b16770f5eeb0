//! Updates the target by an image in which it is tracked.

pub(super) mod detect;
#[cfg(test)]
mod edgel_laws;
pub(super) mod growth;
pub(super) mod templates;

use nalgebra::Vector2;

use self::detect::{DetectionPlan, detect};
use self::templates::{TEMPLATES_APART, templates};
use super::adjust::outlined::shows_outline;
use super::estimate::Notice;
use super::inputs::Inputs;
use super::pose::hypothesis::Hypothesis;
use super::pose::uncertainty::uncertainty;
use super::tracker::Tracker;
use crate::camera::{Mask, Observation};
use crate::pose::Pose;

/// Cells per window in which new points are sought while tracking.
const CELLS: usize = 40;
/// Candidate positions per window that are examined closely.
const TRIES: usize = 6;
/// Points in view per camera below which more are sought, and edgels where there are no corners.
const FEW_IN_VIEW: usize = 40;
/// Weight of the newest image in the colour statistics.
const COLOR_RATE: f32 = 0.15;
/// Images between two updates of the colours.
const COLOR_EVERY: usize = 2;
/// Pixels about the outline that are left out of the colours, since the ellipsoids only approximate
/// the object.
const BORDER_PX: f64 = 4.0;

/// What may be updated by an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Updates {
    pub(super) colors: bool,
    /// Surface points, where nothing hides the object.
    pub(super) surface: bool,
    /// The reference, and the stored views.
    pub(super) whole: bool,
}

impl Tracker {
    /// Updates the target by an observation in which it is tracked.
    pub(super) fn update(&mut self, observation: &Observation<'_>, hypothesis: &Hypothesis) {
        self.doubt_relief(&hypothesis.quality);
        let may = self.allowed_updates(&hypothesis.quality);
        if self.settings.region && may.colors {
            self.color_updates += 1;
            if self.color_updates.is_multiple_of(COLOR_EVERY) {
                self.update_colors(observation, &hypothesis.pose, COLOR_RATE);
            }
        }
        if may.whole {
            let eye = observation.world_from_camera[0].translation();
            self.target
                .reference
                .follow(&hypothesis.quality, (hypothesis.pose.translation() - eye).norm());
            self.keep_views(observation, &hypothesis.pose);
            if self.is_patterned(&hypothesis.quality) {
                let pose = self
                    .covariance(&uncertainty(&hypothesis.normal, self.target.solid.radius), false);
                self.target.offsets.learn(&self.workspace.edges, &pose);
            }
        }
        if self.settings.surface && may.surface {
            self.keep_keyframe(observation, hypothesis);
            self.target.points.refine(&self.workspace.matches, self.target.solid.radius);
            let few = self.corners_in_view() < FEW_IN_VIEW * self.frame.open();
            let (cells, tries) = if few { (2 * CELLS, 2 * TRIES) } else { (CELLS, TRIES) };
            let edgels = few && self.may_have_edgels(observation);
            let plan = DetectionPlan { from: self.cell, cells, tries, edgels, masks: &[] };
            self.cell = self.cell.wrapping_add(cells);
            self.detect_points(observation, &hypothesis.pose, &plan);
            self.add_templates(observation, &hypothesis.pose);
            let clear = (&*self.frame.windows, &self.workspace.occlusion);
            self.target.points.count_hits(&self.workspace.matches, clear);
        }
        let by_outline = self.is_outlined() && shows_outline(&hypothesis.quality);
        if !may.surface && by_outline && self.is_located(&hypothesis.quality) {
            self.keep_keyframe(observation, hypothesis);
        }
        if may.surface {
            self.update_ranges(observation, &hypothesis.pose, &[]);
        }
    }

    /// Returns how many points in view are not edgels.
    fn corners_in_view(&self) -> usize {
        let features = &self.target.points.features;
        self.workspace.in_view.iter().filter(|view| !features[view.point].is_edgel).count()
    }

    /// Returns whether edges may be learned: where their distances are measured, colours tell them
    /// from the object's outline, and the object is surely printed. Those of another are rims,
    /// creases and shadows, which may slide over it.
    fn may_have_edgels(&self, observation: &Observation<'_>) -> bool {
        let measures = self.frame.open() > 1 || observation.depths.iter().any(Option::is_some);
        let tells = self.settings.region && self.target.colors.are_known();
        measures && tells && self.is_surely_printed()
    }

    /// Adds templates of points that are recognised from a side for which they have none.
    fn add_templates(&mut self, observation: &Observation<'_>, pose: &Pose) {
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let mut rims = std::mem::take(&mut self.workspace.rims);
        let found = templates(&inputs, pose, &self.workspace, &mut rims);
        self.workspace.rims = rims;
        for (point, template) in found {
            let feature = &mut self.target.points.features[point];
            // Another camera may just have learned the same template.
            if feature.has_room() && feature.nearest_template(&template.toward).1 <= TEMPLATES_APART
            {
                feature.add_template(template);
            }
        }
    }

    /// Compares the depth images with the body at a pose; those that do not show it are not used.
    pub(super) fn compare_depths(&mut self, observation: &Observation<'_>, pose: &Pose) {
        let mut records = std::mem::take(&mut self.frame.depth_records);
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        let mut strange = Vec::new();
        for (camera, record) in records.iter_mut().enumerate() {
            let Some(seen) = inputs.any_rangefinder(camera, pose) else { continue };
            record.compare(&seen, inputs.windows[camera].place_px(), inputs.solid);
            if !record.is_believed() {
                strange.push(Notice::StrangeDepth(camera));
            }
        }
        self.frame.depth_records = records;
        self.frame.notices.extend(strange);
    }

    /// Adds surface positions measured by depth images, inside the masks if there are any.
    pub(super) fn update_ranges(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        masks: &[Option<Mask<'_>>],
    ) {
        let (drift, (keyframe, _)) =
            (self.drift_of_new_points(), self.keyframe_around(observation, pose));
        let mut ranges = std::mem::take(&mut self.target.ranges);
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        for camera in 0..inputs.windows.len() {
            let Some(seen) = inputs.rangefinder(camera, pose) else { continue };
            let mask = masks.get(camera).and_then(Option::as_ref);
            let is_clear = |pixel: &Vector2<f64>| {
                self.workspace.occlusion.hides(camera, pixel) == 0.0
                    && mask.is_none_or(|mask| mask.holds(pixel.x, pixel.y))
            };
            ranges.count_hits(&seen, inputs.solid, is_clear);
            let body = (inputs.solid, &mut self.workspace.rims);
            ranges.add(&seen, body, (keyframe, drift), is_clear);
        }
        self.target.ranges = ranges;
    }

    pub(super) fn update_colors(&mut self, observation: &Observation<'_>, pose: &Pose, rate: f32) {
        for (window, image) in self.frame.windows.iter().zip(&observation.images) {
            let (Some(projection), Some(image)) = (window.projection(pose), image) else {
                continue;
            };
            let outlines = &mut self.workspace.exposed_outlines;
            outlines.clear();
            outlines.extend(self.target.solid.outlines(&projection));
            window.count_colors(image, outlines, BORDER_PX, &mut self.target.colors);
        }
        self.target.colors.take(rate);
    }

    pub(super) fn detect_points(
        &mut self,
        observation: &Observation<'_>,
        pose: &Pose,
        plan: &DetectionPlan<'_>,
    ) {
        let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
        self.fresh.clear();
        let known = (&*self.workspace.visible, &self.workspace.occlusion);
        let (rims, cells) = (&mut self.workspace.rims, &mut self.cells);
        detect(&inputs, pose, known, plan, (rims, cells, &mut self.fresh));
        let (drift, keyframe) =
            (self.drift_of_new_points(), self.keyframe_around(observation, pose));
        for feature in &mut self.fresh {
            feature.set_origin((keyframe.0, &keyframe.1), drift);
        }
        self.target.points.add(&mut self.fresh);
    }
}
