//! Notices that what was marked as the object is more than one thing: some of its points move
//! otherwise than the rest. Which of the two is the object, no image tells.

use nalgebra::Vector2;

use crate::camera::Observation;
use crate::pose::Pose;
use crate::track::estimate::Notice;
use crate::track::inputs::Inputs;
use crate::track::pose::align::align;
use crate::track::pose::hypothesis::{COARSEST, Hypothesis};
use crate::track::pose::refine::{Workspace, refine};
use crate::track::target::points::{InView, Match};
use crate::track::tracker::Tracker;

/// Least number of marked points, of all cameras, that are missed where they should be, and their
/// least share of those that are recognised.
const LEAST_MISSED: (usize, f64) = (8, 0.1);
/// Share of them that must be recognised at one pose elsewhere to count as found, and from which on
/// the next search starts there. What hides an object hides its points, which are found nowhere.
const TOGETHER: f64 = 0.45;
const WORTH_FOLLOWING: f64 = 0.3;
/// Pixels, in the mean, between where they should be and where they are found.
const LEAST_APART_PX: f64 = 1.5;
/// Images in which they are found until it is certain; each search in vain takes one away.
const CERTAIN: usize = 4;
/// Images from one search to the next while they are not found.
const EVERY: usize = 2;

/// Whether points that were marked as the object move otherwise than the rest.
#[derive(Debug, Clone, Default)]
pub(in crate::track) struct Parting {
    /// Points of lower numbers were detected in what was marked.
    marked: usize,
    /// The last pose of the object, and that of points which may move otherwise.
    last: Option<Pose>,
    other: Option<Pose>,
    images: usize,
    found: usize,
    workspace: Workspace,
}

/// A pose at which some of the points that are missed are recognised together.
#[derive(Debug, Clone, Copy)]
struct Elsewhere {
    pose: Pose,
    /// Whether they are enough, and far enough from where they are missed.
    is_apart: bool,
}

impl Parting {
    /// Begins with what was marked, at its pose: the points of numbers below this one.
    pub(in crate::track) fn begin(&mut self, marked: usize, pose: &Pose) {
        (self.marked, self.last) = (marked, Some(*pose));
    }

    /// Returns whether what was marked is certainly more than one thing.
    pub(in crate::track) fn is_certain(&self) -> bool {
        self.found >= CERTAIN
    }

    /// Counts a search. What is certain stays so: no later image tells which part was meant.
    fn count(&mut self, elsewhere: Option<Elsewhere>) {
        self.other = elsewhere.map(|one| one.pose);
        if !self.is_certain() {
            let is_apart = elsewhere.is_some_and(|one| one.is_apart);
            self.found = if is_apart { self.found + 1 } else { self.found.saturating_sub(1) };
        }
    }

    /// Moves on to the next pose of the object; returns where a search starts, if there is one now.
    fn start_of_search(&mut self, followed: &Pose) -> Option<Pose> {
        self.images += 1;
        let last = self.last.replace(*followed);
        let is_due = self.other.is_some() || self.images.is_multiple_of(EVERY);
        self.other.or(last).filter(|_| is_due && !self.is_certain())
    }
}

impl Tracker {
    /// Searches for marked points that are missed at a pose which is followed: those that are
    /// recognised together elsewhere move otherwise than the object. Once it was missed or has
    /// jumped, the pose itself may be the wrong one, so that nothing is sought any more.
    pub(in crate::track) fn seek_parted(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) {
        let start = self.parting.start_of_search(&hypothesis.pose);
        if let Some(start) = start.filter(|_| self.trust.is_continuous()) {
            self.missed_in_view();
            let matches = self.workspace.matches.iter();
            let recognised = matches.filter(|one| one.is_recognised()).count() as f64;
            let workspace = &mut self.parting.workspace;
            let (least, share) = LEAST_MISSED;
            let is_many = workspace.in_view.len() as f64 >= (share * recognised).max(least as f64);
            let inputs = Inputs::new(&self.frame, observation, &self.target, &self.settings);
            let place = (&start, &hypothesis.pose);
            let found = if is_many { elsewhere(inputs, place, workspace) } else { None };
            self.parting.count(found);
        }
        if self.parting.is_certain() {
            self.frame.notices.push(Notice::Parted);
        }
    }

    /// Selects the points that were marked, are known to be printed, and are missed.
    fn missed_in_view(&mut self) {
        let features = &self.target.points.features;
        let marked = self.parting.marked;
        let is_missed = |one: &&Match| {
            let feature = &features[one.view.point];
            let counts = feature.id < marked && feature.is_printed() && !feature.is_edgel;
            counts && !one.agrees()
        };
        let missed = self.workspace.matches.iter().filter(is_missed).map(|one| one.view);
        self.parting.workspace.in_view.clear();
        self.parting.workspace.in_view.extend(missed);
    }
}

/// Refines a pose by the points in view alone, which are missed at the one that is followed; returns
/// it if it is worth following.
fn elsewhere(
    inputs: Inputs<'_>,
    (start, followed): (&Pose, &Pose),
    workspace: &mut Workspace,
) -> Option<Elsewhere> {
    // The outline and the colours are those of all that was marked.
    let inputs = &inputs.without_colors();
    let start = align(inputs, start, &workspace.in_view).unwrap_or(*start);
    let pose = refine(inputs, (start, COARSEST), None, workspace).pose;
    let recognised = workspace.matches.iter().filter(|one| one.is_recognised());
    let there: Vec<InView> = recognised.map(|one| one.view).collect();
    let (all, some) = (workspace.in_view.len() as f64, there.len() as f64);
    let is_apart = some >= (TOGETHER * all).max(LEAST_MISSED.0 as f64)
        && mean_distance_px(inputs, (&pose, followed), &there) >= LEAST_APART_PX;
    (some >= WORTH_FOLLOWING * all).then_some(Elsewhere { pose, is_apart })
}

/// Returns the mean distance between the pixels of points at two poses; 0 without any.
fn mean_distance_px(inputs: &Inputs<'_>, (one, other): (&Pose, &Pose), all: &[InView]) -> f64 {
    let pixel = |pose: &Pose, view: &InView| -> Option<Vector2<f64>> {
        let projection = inputs.windows[view.camera].projection(pose)?;
        Some(projection.pixel(&inputs.points.features[view.point].point.position)?.0)
    };
    let apart =
        all.iter().filter_map(|view| Some((pixel(one, view)? - pixel(other, view)?).norm()));
    let (sum, count) = apart.fold((0.0, 0.0), |(sum, count), px| (sum + px, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(parting: &mut Parting, is_apart: bool) {
        parting.count(Some(Elsewhere { pose: Pose::identity(), is_apart }));
    }

    #[test]
    fn points_found_apart_now_and_then_are_no_other_thing_and_what_is_certain_stays_so() {
        let mut parting = Parting::default();
        for image in 0..100 {
            search(&mut parting, image % 2 == 0);
            assert!(!parting.is_certain());
        }
        (0..CERTAIN).for_each(|_| search(&mut parting, true));
        assert!(parting.is_certain());
        for _ in 0..100 {
            parting.count(None);
            assert!(parting.is_certain());
        }
    }

    #[test]
    fn what_was_found_is_sought_there_in_each_image_and_else_where_the_object_was_now_and_then() {
        let at = |x: f64| Pose::from_rotation(Default::default(), nalgebra::Vector3::x() * x);
        let mut parting = Parting::default();
        parting.begin(10, &at(0.0));
        let starts: Vec<_> = (1..=4).map(|n| parting.start_of_search(&at(f64::from(n)))).collect();
        let place = |one: &Option<Pose>| one.map(|pose| pose.translation().x);
        let places: Vec<_> = starts.iter().map(place).collect();
        assert_eq!(places, [None, Some(1.0), None, Some(3.0)]);
        search(&mut parting, false);
        for _ in 0..4 {
            assert_eq!(place(&parting.start_of_search(&at(9.0))), Some(0.0));
        }
        (0..CERTAIN).for_each(|_| search(&mut parting, true));
        assert!(parting.start_of_search(&at(9.0)).is_none(), "nothing is left to be found out");
    }
}
