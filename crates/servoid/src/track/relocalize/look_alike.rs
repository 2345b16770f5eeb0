//! Tells the object from another one that looks like it. While the object was surely seen at one
//! place, the images also showed what was elsewhere: what stood there already is another one. And
//! where another tracked object is, this one is not.

use nalgebra::Vector2;

use crate::camera::{Camera, ImageBuffer, Observation};
use crate::pose::Pose;
use crate::shape::{Body, Outline};
use crate::track::estimate::Notice;
use crate::track::frame::Frame;
use crate::track::frame::window::{Window, bounds};
use crate::track::inputs::Inputs;
use crate::track::pose::hypothesis::{COARSEST, Hypothesis};
use crate::track::pose::refine::{Workspace, refine};
use crate::track::pose::verify::verify;
use crate::track::tracker::{MARGIN, Tracker};
use crate::track::trust::{CLEAR, LEAST_RECOGNISED};

/// Images from one that is stored to the next.
const EVERY: usize = 8;
/// Share of the object's image at one pose inside its image at another from which on an earlier
/// image does not tell what else was there.
const BESIDE: f64 = 0.3;
/// Radii within which an object that rests is found in an earlier image, and the share of its image
/// there inside the one at the pose that is compared.
const AT_REST: f64 = 0.3;
const SAME_IMAGE: f64 = 0.6;
/// Cells along one side of a grid over the object's image.
const CELLS: usize = 16;

/// What the cameras saw at an instant at which the object was surely where it was followed.
#[derive(Debug, Clone)]
struct Instant {
    world_from_object: Pose,
    world_from_camera: Vec<Pose>,
    images: Vec<Option<ImageBuffer>>,
}

/// The images of such an instant, and what was found in them. Memory is reused.
#[derive(Debug, Clone)]
pub(in crate::track) struct LookAlikes {
    instant: Option<Instant>,
    /// Images until the next one is stored.
    left: usize,
    /// Poses of what looks like the object and is another one.
    known: Vec<Pose>,
    /// Why poses of the present observation were dropped.
    dropped: Vec<Notice>,
    /// Other tracked objects, where they are now.
    others: Vec<Body>,
    frame: Frame,
    workspace: Workspace,
}

impl Instant {
    fn observation(&self) -> Observation<'_> {
        Observation {
            time_s: 0.0,
            world_from_camera: self.world_from_camera.clone(),
            images: self.images.iter().map(|one| one.as_ref().map(ImageBuffer::view)).collect(),
            depths: Vec::new(),
        }
    }
}

impl LookAlikes {
    pub(in crate::track) fn new(cameras: &[Camera]) -> Self {
        Self {
            instant: None,
            left: 0,
            known: Vec::new(),
            dropped: Vec::new(),
            others: Vec::new(),
            frame: Frame::new(cameras),
            workspace: Workspace::default(),
        }
    }

    /// Avoids the same other objects.
    pub(in crate::track) fn avoid_as(&mut self, other: &Self) {
        self.others.clone_from(&other.others);
    }

    /// Forgets all images.
    pub(in crate::track) fn forget(&mut self) {
        (self.instant, self.left) = (None, 0);
        self.known.clear();
    }

    /// Stores the images of an observation, and which of them can be used, in which the object is surely at a pose, unless
    /// some were stored just before.
    fn keep(&mut self, observation: &Observation<'_>, pose: &Pose, frame: &Frame) {
        if self.left > 0 {
            self.left -= 1;
            return;
        }
        self.left = EVERY - 1;
        self.known.clear();
        let instant = self.instant.get_or_insert_with(|| Instant {
            world_from_object: *pose,
            world_from_camera: Vec::new(),
            images: vec![None; observation.images.len()],
        });
        instant.world_from_object = *pose;
        instant.world_from_camera.clone_from(&observation.world_from_camera);
        for (kept, image) in instant.images.iter_mut().zip(&observation.images) {
            match image {
                Some(image) => kept.get_or_insert_default().copy(image),
                None => *kept = None,
            }
        }
        self.frame.take_checks(frame);
    }
}

impl Tracker {
    /// Sets where other tracked objects are now: a search does not find this one there.
    pub fn avoid(&mut self, others: Vec<Body>) {
        self.look_alikes.others = others;
    }

    /// Stores the images in which the object is located, now and then.
    pub(in crate::track) fn keep_surely_seen(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) {
        if hypothesis.quality.visible >= CLEAR && !self.frame.is_stale() {
            self.look_alikes.keep(observation, &hypothesis.pose, &self.frame);
        }
    }

    /// Returns whether what is found at a pose is another object: one that is tracked itself, or one
    /// that looks alike and was there while this one was surely seen elsewhere.
    pub(in crate::track) fn is_other(&mut self, pose: &Pose) -> bool {
        let why = if self.is_taken(pose) {
            Notice::Taken
        } else if self.is_known_look_alike(pose) || self.stood_there(pose) {
            Notice::LookAlike
        } else {
            return false;
        };
        let dropped = &mut self.look_alikes.dropped;
        if !dropped.contains(&why) {
            dropped.push(why);
        }
        true
    }

    /// Adds to the notices why poses were dropped, unless another one was found instead.
    pub(in crate::track) fn note_dropped(&mut self, is_found: bool) {
        let dropped = self.look_alikes.dropped.drain(..);
        self.frame.notices.extend(dropped.filter(|_| !is_found));
    }

    fn is_taken(&self, pose: &Pose) -> bool {
        let others = &self.look_alikes.others;
        if others.is_empty() {
            return false;
        }
        let own = self.target.body.at(*pose);
        others.iter().any(|other| own.shares_place(other))
    }

    fn is_known_look_alike(&self, pose: &Pose) -> bool {
        let near = AT_REST * self.target.solid.radius;
        self.look_alikes.known.iter().any(|one| distance(one, pose) <= near)
    }

    /// Returns whether the object would also be found at a pose in the stored images, in which it is
    /// elsewhere.
    fn stood_there(&mut self, pose: &Pose) -> bool {
        let LookAlikes { instant, frame, workspace, known, .. } = &mut self.look_alikes;
        let Some(instant) = instant else { return false };
        let (target, settings) = (&self.target, &self.settings);
        let solid = &target.solid;
        let observation = instant.observation();
        let colors = settings.region.then_some(&target.colors);
        if !frame.open_windows(&observation, (pose, solid, MARGIN), colors) {
            return false;
        }
        let share = |window: &Window, (pose, other): (&Pose, &Pose)| -> Option<f64> {
            let outlines = |pose: &Pose| -> Option<Vec<Outline>> {
                Some(solid.outlines(&window.projection(pose)?).collect())
            };
            Some(share_inside(&outlines(pose)?, &outlines(other)?))
        };
        let own = instant.world_from_object;
        for window in &mut frame.windows {
            if share(window, (pose, &own)).is_some_and(|share| share > BESIDE) {
                window.close();
            }
        }
        if frame.open() == 0 {
            return false;
        }
        let Workspace { rims, visible, in_view, .. } = workspace;
        let most = if settings.surface { settings.points } else { 0 };
        target.points.in_view(&frame.windows, pose, solid, most, (rims, visible, in_view));
        let inputs = Inputs::new(frame, &observation, target, settings);
        let found = refine(&inputs, (*pose, COARSEST), None, workspace);
        let quality = verify(&inputs, &found, workspace);
        // From a pose beside the object, the refinement may find the object itself.
        let is_there = frame.windows.iter().all(|window| {
            let inside = |other: &Pose| share(window, (&found.pose, other));
            inside(&own).is_none_or(|share| share <= BESIDE)
                && inside(pose).is_none_or(|share| share >= SAME_IMAGE)
        });
        let is_other = is_there
            && distance(&found.pose, pose) <= AT_REST * solid.radius
            && quality.visible >= settings.trusted
            && quality.recognised >= LEAST_RECOGNISED * target.reference.recognised;
        if is_other {
            known.push(found.pose);
        }
        is_other
    }
}

fn distance(one: &Pose, other: &Pose) -> f64 {
    (one.translation() - other.translation()).norm()
}

/// Returns the share of an image of the object that is inside another one.
fn share_inside(image: &[Outline], other: &[Outline]) -> f64 {
    let Some((low, high)) = bounds(image.iter().copied()) else { return 0.0 };
    let (mut all, mut inside) = (0_u32, 0_u32);
    for at in 0..CELLS * CELLS {
        let shares = Vector2::new((at % CELLS) as f64 + 0.5, (at / CELLS) as f64 + 0.5);
        let pixel = low + (high - low).component_mul(&shares) / CELLS as f64;
        let holds = |outlines: &[Outline]| outlines.iter().any(|one| one.contains(&pixel));
        if holds(image) {
            all += 1;
            inside += u32::from(holds(other));
        }
    }
    f64::from(inside) / f64::from(all.max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Channels, ImageView};
    use crate::pose::Twist;
    use crate::track::Status;
    use crate::track::trust::tests::tracker;

    fn at(x: f64) -> Pose {
        Pose::exp(&Twist::new(x, 0.0, 0.6, 0.0, 0.0, 0.0))
    }

    #[test]
    fn images_are_stored_now_and_then_and_the_last_ones_count() {
        let pixels = |number: usize| vec![number as u8; 640 * 480];
        let mut tracker = tracker(Status::Tracking, 60.0);
        for number in 0..=2 * EVERY {
            let now = pixels(number);
            let image = ImageView::new(&now, [640, 480], Channels::Grey).unwrap();
            let (time_s, x) = (number as f64, 1e-3 * number as f64);
            let world_from_camera = vec![at(x)];
            let (images, depths) = (vec![Some(image)], Vec::new());
            let observation = Observation { time_s, world_from_camera, images, depths };
            tracker.frame.check(&observation).unwrap();
            tracker.look_alikes.keep(&observation, &at(x), &tracker.frame);
            let kept = tracker.look_alikes.instant.as_ref().unwrap();
            let stored = number - number % EVERY;
            let last = 1e-3 * stored as f64;
            assert_eq!(kept.world_from_object, at(last));
            assert_eq!(kept.observation().world_from_camera, [at(last)]);
            assert_eq!(kept.observation().images[0].unwrap().bytes(), &pixels(stored)[..]);
        }
        tracker.look_alikes.forget();
        assert!(tracker.look_alikes.instant.is_none());
    }

    #[test]
    fn nothing_is_another_object_where_nothing_was_stored_and_no_other_is_tracked() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        assert!(!tracker.is_other(&at(0.0)) && tracker.frame.notices.is_empty());
    }

    #[test]
    fn what_is_found_where_another_tracked_object_is_is_that_one() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        tracker.avoid(vec![tracker.target.body.at(at(0.3))]);
        for (x, is_other) in [(0.3, true), (0.31, true), (0.4, false), (0.0, false)] {
            for is_found in [true, false] {
                assert_eq!(tracker.is_other(&at(x)), is_other, "{x}");
                tracker.frame.notices.clear();
                tracker.note_dropped(is_found);
                let is_said = tracker.frame.notices.contains(&Notice::Taken);
                assert_eq!(is_said, is_other && !is_found);
            }
        }
    }

    #[test]
    fn a_start_keeps_the_others_that_are_avoided() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        tracker.avoid(vec![tracker.target.body.at(at(0.3))]);
        let pixels: Vec<_> = (0..640 * 480_u64).map(|at| (at * at % 251) as u8).collect();
        let images = vec![ImageView::new(&pixels, [640, 480], Channels::Grey).ok()];
        let world_from_camera = vec![Pose::identity()];
        let observation =
            Observation { time_s: 0.0, world_from_camera, images, depths: Vec::new() };
        tracker.start(&observation, at(0.0), &[]).unwrap();
        assert!(tracker.is_other(&at(0.3)));
    }

    #[test]
    fn what_is_near_a_known_look_alike_is_that_one() {
        let mut tracker = tracker(Status::Tracking, 60.0);
        let radius = tracker.target.solid.radius;
        tracker.look_alikes.known.push(at(0.3));
        assert!(tracker.is_other(&at(0.3 + 0.9 * AT_REST * radius)));
        assert!(!tracker.is_other(&at(0.3 + 1.1 * AT_REST * radius)));
        tracker.look_alikes.forget();
        assert!(!tracker.is_other(&at(0.3)));
    }

    #[test]
    fn an_image_is_inside_itself_and_not_inside_one_beside_it() {
        let tracker = tracker(Status::Tracking, 60.0);
        let from_world =
            crate::shape::Projection::new(&tracker.frame.cameras[0], &Pose::identity());
        let outlines = |x: f64| -> Vec<Outline> {
            tracker.target.solid.outlines(&from_world.moved(&at(x))).collect()
        };
        assert!((share_inside(&outlines(0.0), &outlines(0.0)) - 1.0).abs() < 1e-12);
        assert!(share_inside(&outlines(0.0), &outlines(0.2)) == 0.0);
        let half = share_inside(&outlines(0.0), &outlines(0.05));
        assert!(0.2 < half && half < 0.6, "{half}");
        assert!(share_inside(&[], &outlines(0.0)) == 0.0);
        assert!((distance(&at(0.0), &at(0.3)) - 0.3).abs() < 1e-12);
    }
}
