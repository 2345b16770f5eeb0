//! The sides from which the object was seen, and what is usual there: an object may have other
//! colours and fewer surface points on one side than on another.

use nalgebra::{UnitQuaternion, Vector3};

use super::colors::Colors;
use super::reference::Reference;
use super::shares::Shares;
use crate::camera::Channels;
use crate::pose::{Pose, Twist};
use crate::track::pose::verify::Quality;

/// A side from which the object was seen while its position was confirmed.
#[derive(Debug, Clone)]
pub(crate) struct KnownView {
    /// Orientation of the first camera in the object's frame.
    pub(crate) object_from_camera: UnitQuaternion<f64>,
    /// Direction to that camera, in the object's frame.
    pub(crate) toward: Vector3<f64>,
    pub(crate) usual: Usual,
    /// The object's colours there, in grey images and in others.
    pub(crate) colors: [Shares; 2],
}

/// The quality of a pose from one side.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Usual {
    /// Log-likelihood ratio inside the outline, as a share of that of the object's colours alone:
    /// the body only approximates the object.
    pub(crate) inside: f64,
    pub(crate) outline: f64,
    pub(crate) support: f64,
    pub(crate) recognised: f64,
    pub(crate) textured: f64,
}

/// The sides from which the object was seen, in the order in which they were first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Views {
    pub(crate) all: Vec<KnownView>,
    /// The mean log-likelihood ratio inside the outline that is expected from each, until the
    /// object is found; empty if it is not sought by views.
    ratios: Vec<f64>,
}

/// Most views that are kept.
pub(crate) const MOST_VIEWS: usize = 64;
/// Least angle between two of them, in radians.
const VIEWS_APART: f64 = 0.15;
/// Least angle between sides that are compared, in radians.
const SIDES_APART: f64 = 0.3;
/// Surface points that are usual from any direction, unless fewer are elsewhere: a pose from a side
/// that shows next to nothing proves nothing.
const LEAST_USUAL: f64 = 24.0;
/// Largest angle between a direction and that of a view that tells what is usual there, in radians.
const NEAR_VIEW: f64 = 0.4;

impl Views {
    /// Makes a set of previously known views.
    pub(crate) fn of(views: impl Iterator<Item = KnownView>) -> Self {
        Self { all: views.take(MOST_VIEWS).collect(), ratios: Vec::new() }
    }

    /// Returns the view by a camera, by its pose in the object's frame: the nearest one, or else a
    /// new one, of which nothing is known yet.
    pub(crate) fn around(&mut self, object_from_camera: &Pose) -> &mut KnownView {
        let rotation = object_from_camera.rotation();
        let apart = |one: &KnownView| one.object_from_camera.angle_to(&rotation);
        let nearest = (0..self.all.len())
            .min_by(|&a, &b| apart(&self.all[a]).total_cmp(&apart(&self.all[b])))
            .filter(|&at| apart(&self.all[at]) < VIEWS_APART);
        let at = nearest.unwrap_or_else(|| {
            if self.all.len() >= MOST_VIEWS {
                self.drop_one();
            }
            self.all.push(KnownView {
                object_from_camera: rotation,
                toward: object_from_camera.translation().normalize(),
                usual: Usual::default(),
                colors: [Shares::with_room(), Shares::with_room()],
            });
            self.all.len() - 1
        });
        &mut self.all[at]
    }

    /// Drops the later of the two views that are most alike.
    fn drop_one(&mut self) {
        let mut least = (f64::INFINITY, self.all.len() - 1);
        for (at, one) in self.all.iter().enumerate() {
            for other in &self.all[..at] {
                let apart = one.object_from_camera.angle_to(&other.object_from_camera);
                if apart < least.0 {
                    least = (apart, at);
                }
            }
        }
        self.all.remove(least.1);
    }

    /// Returns the mean colours of views; none where none of them has any.
    fn mean<'a>(views: impl Iterator<Item = &'a KnownView>, kind: usize) -> Option<Shares> {
        let known = views.map(|view| &view.colors[kind]).filter(|one| !one.is_empty());
        Shares::mean(known)
    }

    /// Gives the object the colours of all views, and of those near a direction in particular.
    pub(crate) fn color(&self, toward: Option<&Vector3<f64>>, colors: &mut Colors) {
        let [grey, rgb] = [0, 1].map(|kind| {
            let all = Self::mean(self.all.iter(), kind);
            let near = toward.and_then(|toward| {
                let near = self.all.iter().filter(|view| view.toward.angle(toward) < NEAR_VIEW);
                Self::mean(near, kind)
            });
            Shares::mean([near.as_ref(), all.as_ref()].into_iter().flatten()).unwrap_or_default()
        });
        colors.recall([&grey, &rgb]);
        colors.tabulate();
    }

    /// Computes what is expected from each view by the colours of the object and of the images'
    /// background.
    pub(crate) fn foresee(&mut self, colors: &Colors, kinds: &[Channels]) {
        let ratio = |view: &KnownView| {
            view.usual.inside * colors.expected(kinds.iter().copied(), &view.colors)
        };
        self.ratios = self.all.iter().map(ratio).collect();
    }

    /// Returns the orientation in the world at which an object at a place shows a camera a view; the
    /// view is rolled about the line of sight.
    pub(crate) fn orientation(
        view: &KnownView,
        (world_from_camera, place): (&Pose, &Vector3<f64>),
        roll: f64,
    ) -> UnitQuaternion<f64> {
        let camera_from_object = view.object_from_camera.inverse();
        let learned = camera_from_object * -view.toward;
        let sight = world_from_camera.inverse().transform(place).normalize();
        let (axis, cosine) = (learned.cross(&sight), learned.dot(&sight));
        let sine = axis.norm();
        // They are opposite only if the camera looks away from the object.
        let lean = if sine > 0.0 { axis * (libm::atan2(sine, cosine) / sine) } else { axis };
        let turn = |by: Vector3<f64>| Pose::exp(&Twist::new(0.0, 0.0, 0.0, by.x, by.y, by.z));
        let camera_from_view = turn(sight * roll).rotation() * turn(lean).rotation();
        world_from_camera.rotation() * camera_from_view * camera_from_object
    }

    /// Returns the poses at which the object, where it is, would show a camera its other sides, each
    /// rolled as it is.
    pub(crate) fn sides_of(&self, pose: &Pose, world_from_camera: &Pose) -> Vec<Pose> {
        let (place, toward) = (
            pose.translation(),
            pose.inverse().transform(&world_from_camera.translation()).normalize(),
        );
        let angle = |one: &&KnownView| one.toward.angle(&toward);
        let nearest = self.all.iter().min_by(|a, b| angle(a).total_cmp(&angle(b)));
        let Some(nearest) = nearest else { return Vec::new() };
        let seen = (world_from_camera, &place);
        let upright = Self::orientation(nearest, seen, 0.0);
        let sight = (place - world_from_camera.translation()).normalize();
        // The part of a rotation about the line of sight.
        let by = (pose.rotation() * upright.inverse()).into_inner();
        let roll = 2.0 * libm::atan2(by.imag().dot(&sight), by.w);
        let mut sides: Vec<&KnownView> = Vec::new();
        for view in &self.all {
            if sides.iter().all(|one| one.toward.angle(&view.toward) > SIDES_APART) {
                sides.push(view);
            }
        }
        let turned = |view: &KnownView| Self::orientation(view, seen, roll);
        sides.into_iter().map(|view| Pose::from_rotation(turned(view), place)).collect()
    }

    /// Returns whether the object is sought by views.
    pub(crate) fn are_sought(&self) -> bool {
        !self.ratios.is_empty()
    }

    /// Ends the search by views.
    pub(crate) fn settle(&mut self) {
        self.ratios.clear();
    }

    /// Returns what is usual from a direction while the object is sought by views: of the nearest
    /// one, unless it is far from all of them.
    pub(crate) fn usual(&self, toward: &Vector3<f64>, reference: &Reference) -> Reference {
        if !self.are_sought() {
            return *reference;
        }
        let near = self.near(toward).and_then(|at| Some((&self.all[at], self.ratios.get(at)?)));
        let Some((view, ratio)) = near else { return *reference };
        let Usual { outline, support, recognised, textured, .. } = view.usual;
        let recognised = recognised.max(reference.recognised.min(LEAST_USUAL));
        Reference { ratio: *ratio, outline, support, recognised, textured, ..*reference }
    }

    /// Returns the index of the view nearest to a direction, if it is not far from all of them.
    fn near(&self, toward: &Vector3<f64>) -> Option<usize> {
        let angles = self.all.iter().map(|view| view.toward.angle(toward)).enumerate();
        let near = angles.filter(|(_, angle)| *angle < NEAR_VIEW);
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(at, _)| at)
    }
}

impl Usual {
    /// Returns the quality of an image from one side, where a ratio is `expected` of the object's
    /// colours.
    pub(crate) fn of(quality: &Quality, expected: f64) -> Self {
        let Quality { ratio, outline, support, recognised, textured, .. } = *quality;
        let inside = if expected > 0.0 { (ratio / expected).clamp(0.0, 1.0) } else { 1.0 };
        Self { inside, outline, support, recognised, textured }
    }
}
