use nalgebra::UnitQuaternion;

use super::look::Look;
use super::points::{Match, Points};
use super::sighting::Sighting;
use super::thumbnail::Thumbnail;
use crate::camera::Observation;
use crate::pose::Pose;
use crate::shape::Projection;
use crate::track::frame::occlusion::Occlusion;
use crate::track::frame::window::Window;

/// The pose of the object seen from one side, and the pixels at which cameras saw landmarks of its
/// surface.
#[derive(Debug, Clone)]
pub(crate) struct Keyframe {
    pub(crate) number: usize,
    pub(crate) world_from_object: Pose,
    /// The previous keyframe, and the motion from there, if the object was followed all the way.
    pub(crate) step: Option<(usize, Pose)>,
    /// Whether its pose was given.
    pub(crate) is_given: bool,
    /// Whether most of what was seen lay at guessed distances.
    pub(crate) guesses: bool,
    /// Variance of the object's orientation since the first image, in square radians.
    pub(crate) drift_variance: f64,
    /// The parts of it that no sighting shows: by which the orientation may have been held back, and
    /// may still be off since a loop was closed.
    pub(crate) held_back: f64,
    pub(crate) still_off: f64,
    /// The same by what motion alone tells, where distances are guesses that nothing confirms.
    pub(crate) relief_variance: Option<f64>,
    /// Projection of the world into each camera.
    pub(crate) cameras: Vec<Option<Projection>>,
    pub(crate) sightings: Vec<Sighting>,
    /// Where each camera saw the object's boundary, if all of it was seen.
    pub(crate) looks: Vec<Option<Look>>,
    /// What the first camera saw, if that shows a pattern.
    pub(crate) thumbnail: Option<Thumbnail>,
    pub(crate) object_from_camera: UnitQuaternion<f64>,
}

impl Keyframe {
    /// Returns the part of the variance of the orientation that no sighting shows.
    pub(crate) fn unseen_drift(&self) -> f64 {
        self.held_back + self.still_off
    }
}

/// The data of a keyframe: the pose, the orientation of the first camera, and the projection of the
/// world into each.
pub(crate) struct KeyframePose {
    pub(crate) world_from_object: Pose,
    pub(crate) object_from_camera: UnitQuaternion<f64>,
    pub(crate) cameras: Vec<Option<Projection>>,
    pub(crate) looks: Vec<Option<Look>>,
    pub(crate) thumbnail: Option<Thumbnail>,
}

/// A keyframe that was dropped: it moves with the last one before it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Former {
    pub(super) number: usize,
    /// The keyframe from which the object came.
    from: Option<usize>,
    pub(super) world_from_object: Pose,
    pub(super) drift_variance: f64,
}

/// The keyframes, in order of time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Keyframes {
    pub(crate) all: Vec<Keyframe>,
    /// Keyframes dropped to make room, of which only the pose is kept.
    pub(super) former: Vec<Former>,
    next: usize,
    /// Whether the object was followed since the last one.
    pub(crate) followed: bool,
    /// Pose of the object predicted by the keyframes since it left a known side and returned to it:
    /// the next keyframe connects the ends of that loop.
    pub(super) tie: Option<(usize, Pose)>,
    /// Number of further keyframes to be kept whatever they show, after a loop was closed.
    pub(super) closing: usize,
}

/// Angle between keyframes, in radians.
pub(crate) const KEYFRAMES_APART: f64 = 0.10;
/// The same while distances are guesses.
const GUESSING: f64 = 0.04;
/// Angle between keyframes that connect the ends of a loop, in radians.
const CLOSE: f64 = 0.05;
/// Angle within which a view belongs to the newest keyframe.
const NEAR: f64 = 0.25;
/// Most keyframes, and most dropped ones, that are kept.
pub(crate) const MOST_KEYFRAMES: usize = 64;
const MOST_FORMER: usize = 4096;

/// Returns the orientation of the first camera in the object's frame.
pub(crate) fn object_from_camera(
    observation: &Observation<'_>,
    world_from_object: &Pose,
) -> UnitQuaternion<f64> {
    (world_from_object.inverse() * observation.world_from_camera[0]).rotation()
}

impl Keyframes {
    /// Starts empty, with numbers that were not used before.
    pub(crate) fn after(before: &Self) -> Self {
        Self { next: before.next, ..Self::default() }
    }

    /// Returns the number that the next one will have.
    pub(crate) fn upcoming(&self) -> usize {
        self.next
    }

    /// Returns the keyframe of a view, by the orientation of a camera in the object's frame: the
    /// newest, unless the object has turned away from it to a side that another one covers.
    pub(crate) fn around(&self, object_from_camera: &UnitQuaternion<f64>) -> Option<&Keyframe> {
        let away = |one: &Keyframe| one.object_from_camera.angle_to(object_from_camera);
        let newest = self.all.last().filter(|one| away(one) < NEAR);
        newest.or_else(|| self.nearest(object_from_camera))
    }

    /// Returns the keyframe most similar to a view.
    pub(crate) fn nearest(&self, object_from_camera: &UnitQuaternion<f64>) -> Option<&Keyframe> {
        let away = |one: &Keyframe| one.object_from_camera.angle_to(object_from_camera);
        self.all.iter().min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// Returns whether a view is within an angle of that of the given pose, or of a keyframe before
    /// one with a number whose drift that no sighting shows is a variance at most.
    pub(crate) fn is_known(
        &self,
        object_from_camera: &UnitQuaternion<f64>,
        most_unseen: f64,
        (before, angle): (usize, f64),
    ) -> bool {
        let is_earlier = |one: &Keyframe| one.number < before && one.unseen_drift() <= most_unseen;
        let mut known = self.all.iter().filter(|one| one.is_given || is_earlier(one));
        known.any(|one| one.object_from_camera.angle_to(object_from_camera) < angle)
    }

    /// Returns whether a view is within an angle of that of a keyframe that may still be off by more
    /// than a variance since a loop was closed.
    pub(crate) fn may_be_off(
        &self,
        object_from_camera: &UnitQuaternion<f64>,
        most: f64,
        angle: f64,
    ) -> bool {
        let mut off = self.all.iter().filter(|one| one.still_off > most);
        off.any(|one| one.object_from_camera.angle_to(object_from_camera) < angle)
    }

    /// Returns whether a view differs enough from the last keyframe and, unless `all_over` is set,
    /// from all others.
    pub(crate) fn is_new(
        &self,
        object_from_camera: &UnitQuaternion<f64>,
        (all_over, guesses): (bool, bool),
    ) -> bool {
        let apart = if guesses { GUESSING } else { KEYFRAMES_APART };
        let differs = |one: &Keyframe| one.object_from_camera.angle_to(object_from_camera) >= apart;
        let Some(last) = self.all.last() else { return true };
        if self.tie.is_some() {
            return true;
        }
        if self.closing > 0 {
            return last.object_from_camera.angle_to(object_from_camera) >= CLOSE;
        }
        if all_over { differs(last) } else { self.all.iter().all(differs) }
    }

    /// Adds a keyframe of a pose with the points that are recognised; returns the one that is
    /// dropped to make room. `drift` is the variance of the orientation, and `held_back` its part
    /// that no sighting shows.
    pub(crate) fn keep(
        &mut self,
        keyframe_pose: KeyframePose,
        (points, matches): (&Points, &[Match]),
        (windows, occlusion): (&[Window], &Occlusion),
        ((drift, held_back), is_given, guesses): ((f64, f64), bool, bool),
    ) -> Option<Keyframe> {
        let KeyframePose { world_from_object, object_from_camera, cameras, looks, thumbnail } =
            keyframe_pose;
        let last = self.around(&object_from_camera).filter(|_| self.followed);
        let step =
            last.map(|last| (last.number, last.world_from_object.inverse() * world_from_object));
        let step = self.tie.take().or(step);
        let sightings = matches
            .iter()
            .filter_map(|one| Sighting::of(one, points, (windows, occlusion)))
            .collect();
        let number = self.next;
        self.all.push(Keyframe {
            number,
            world_from_object,
            step,
            is_given,
            guesses,
            drift_variance: drift,
            held_back,
            still_off: 0.0,
            relief_variance: None,
            cameras,
            sightings,
            looks,
            thumbnail,
            object_from_camera,
        });
        self.next += 1;
        self.followed = true;
        self.closing = self.closing.saturating_sub(1);
        (self.all.len() > MOST_KEYFRAMES).then(|| self.drop_one())
    }

    /// Drops the keyframe most similar to another one, but neither the first nor the last.
    fn drop_one(&mut self) -> Keyframe {
        let nearest = |at: usize| {
            let others = self.all.iter().enumerate().filter(|(other, _)| *other != at);
            let angle =
                |one: &Keyframe| one.object_from_camera.angle_to(&self.all[at].object_from_camera);
            others.map(|(_, one)| angle(one)).fold(f64::INFINITY, f64::min)
        };
        let inner = 1..self.all.len() - 1;
        let least = inner.min_by(|&a, &b| nearest(a).total_cmp(&nearest(b))).unwrap_or(1);
        let dropped = self.all.remove(least);
        let Keyframe { number, world_from_object, drift_variance, .. } = dropped;
        let place = self.former.partition_point(|one| one.number < number);
        let from = dropped.step.map(|(from, _)| from);
        self.former.insert(place, Former { number, from, world_from_object, drift_variance });
        if self.former.len() > MOST_FORMER {
            self.former.remove(0);
        }
        for one in &mut self.all[least..] {
            if let Some((_, motion)) = one.step.filter(|(from, _)| *from == dropped.number) {
                one.step = dropped.step.map(|(before, first)| (before, first * motion));
            }
        }
        dropped
    }

    /// Returns the keyframes after one, dropped ones included, each with the one to which it is
    /// connected.
    pub(crate) fn newer_than(&self, number: usize) -> Vec<(usize, usize)> {
        let former = self.former.iter().map(|one| (one.number, one.from));
        let all = self.all.iter().map(|one| (one.number, one.step.map(|(from, _)| from)));
        let newer = former.chain(all).filter(|(one, _)| *one > number);
        newer.filter_map(|(one, from)| Some((one, from?))).collect()
    }

    /// Gives dropped keyframes the orientation variance of the keyframes with which they move.
    pub(crate) fn renew_former(&mut self) {
        for at in 0..self.former.len() {
            if let Some(place) = self.place(self.former[at].number) {
                self.former[at].drift_variance = self.all[place].drift_variance;
            }
        }
    }

    /// Moves all keyframes, dropped ones included, in the object's frame by the motion of their
    /// numbers.
    pub(crate) fn move_by(&mut self, by: impl Fn(usize) -> Pose) {
        for one in &mut self.former {
            one.world_from_object = (one.world_from_object * by(one.number)).renormalized();
        }
        for one in &mut self.all {
            one.world_from_object = (one.world_from_object * by(one.number)).renormalized();
        }
    }

    /// Returns the pose of the object at a keyframe, which may have been dropped, as currently
    /// estimated.
    pub(crate) fn pose(&self, number: usize) -> Option<Pose> {
        if let Ok(at) = self.all.binary_search_by_key(&number, |one| one.number) {
            return Some(self.all[at].world_from_object);
        }
        let at = self.former.binary_search_by_key(&number, |one| one.number).ok()?;
        Some(self.former[at].world_from_object)
    }

    /// Returns the index of the keyframe with a number, or else of the last one before it.
    pub(crate) fn place(&self, number: usize) -> Option<usize> {
        self.all.partition_point(|one| one.number <= number).checked_sub(1)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::pose::Twist;

    /// Returns a keyframe of which motion tells the variance that guesses leave.
    pub(crate) fn told(variance: f64, object_from_camera: UnitQuaternion<f64>) -> Keyframes {
        let mut keyframes = Keyframes::default();
        keep(&mut keyframes, 0.0);
        keyframes.all[0].relief_variance = Some(variance);
        keyframes.all[0].object_from_camera = object_from_camera;
        keyframes
    }

    pub(crate) fn keep(keyframes: &mut Keyframes, turned: f64) -> Option<Keyframe> {
        let world_from_object = Pose::exp(&Twist::new(0.0, 0.0, 0.5, 0.0, turned, 0.0));
        let object_from_camera = world_from_object.inverse().rotation();
        let (cameras, looks, thumbnail) = (Vec::new(), Vec::new(), None);
        let keyframe_pose =
            KeyframePose { world_from_object, object_from_camera, cameras, looks, thumbnail };
        let nothing = (&Points::default(), &[][..]);
        keyframes.keep(
            keyframe_pose,
            nothing,
            (&[], &Occlusion::default()),
            ((0.01, 0.004), false, false),
        )
    }

    #[test]
    fn where_there_are_too_many_one_makes_room_that_is_neither_first_nor_last_and_most_like_another()
     {
        let mut keyframes = Keyframes::default();
        for count in 0..MOST_KEYFRAMES {
            assert!(keep(&mut keyframes, 0.09 * count as f64).is_none());
        }
        let last = 0.09 * (MOST_KEYFRAMES - 1) as f64;
        let dropped = keep(&mut keyframes, last + 0.01).unwrap();
        assert_eq!(dropped.number, MOST_KEYFRAMES - 1);
        assert_eq!(keyframes.all.len(), MOST_KEYFRAMES);
        let heir = keyframes.all.last().unwrap();
        let (from, motion) = heir.step.unwrap();
        assert_eq!(from, MOST_KEYFRAMES - 2, "what followed it follows the one before it");
        let before = keyframes.pose(from).unwrap();
        let off = (before * motion).inverse() * heir.world_from_object;
        assert!(off.log().norm() < 1e-9);
    }

    #[test]
    fn a_view_is_known_where_an_earlier_keyframe_is_near() {
        let mut keyframes = Keyframes::default();
        for count in 0..6 {
            keep(&mut keyframes, 0.2 * f64::from(count));
        }
        let camera = |turned: f64| UnitQuaternion::from_euler_angles(0.0, -turned, 0.0);
        for (turned, number) in [(0.05, 0), (0.25, 1), (0.95, 5), (2.0, 5)] {
            assert_eq!(keyframes.nearest(&camera(turned)).unwrap().number, number);
        }
        let known = |turned: f64, most| keyframes.is_known(&camera(turned), most, (3, 0.15));
        assert!(known(0.0, 0.01) && known(0.5, 0.01) && !known(0.6, 0.01) && !known(1.0, 0.01));
        assert!(!known(0.2, 0.003), "it may have been held back by more");
    }

    #[test]
    fn one_that_made_room_is_still_corrected() {
        let mut keyframes = Keyframes::default();
        for count in 0..=MOST_KEYFRAMES {
            keep(&mut keyframes, 0.09 * count as f64);
        }
        let kept = |number: &usize| keyframes.all.iter().any(|one| one.number == *number);
        let former = (0..=MOST_KEYFRAMES).find(|number| !kept(number)).unwrap();
        let by =
            |number: usize| Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.01 * number as f64, 0.0, 0.0));
        let before = keyframes.pose(former).unwrap();
        keyframes.move_by(by);
        let off = (before * by(former)).inverse() * keyframes.pose(former).unwrap();
        assert!(off.log().norm() < 1e-9);
        assert!(keyframes.all.iter().all(|one| one.held_back > 0.0));
        keyframes.turn_back(&Twist::new(0.0, 0.0, 0.0, 0.0, 0.1, 0.0), (0.01, 0.0), None);
        assert!(keyframes.all.iter().all(|one| one.held_back == 0.0), "the loop is closed");
        let turned = (before * by(former)).inverse() * keyframes.pose(former).unwrap();
        assert!((turned.rotation().angle() - 0.1).abs() < 1e-9);
        assert!(keyframes.pose(MOST_KEYFRAMES + 1).is_none());
    }
}
