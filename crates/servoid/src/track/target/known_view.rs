//! What is remembered of the sides of an object: the views of its keyframes, and those that were
//! recalled with its appearance.

use nalgebra::{UnitQuaternion, Vector3};

use super::Target;
use super::keyframes::{KEYFRAMES_APART, Keyframe, MOST_KEYFRAMES};
use super::thumbnail::Thumbnail;

/// A view of the object from one side, in the object's frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct KnownView {
    /// The orientation of the first camera, and its position if it saw the object.
    pub(crate) object_from_camera: UnitQuaternion<f64>,
    pub(crate) eye: Option<Vector3<f64>>,
    /// What that camera saw, if it shows a pattern.
    pub(crate) thumbnail: Option<Thumbnail>,
}

impl KnownView {
    fn of(keyframe: &Keyframe) -> Self {
        let Keyframe { object_from_camera, thumbnail, .. } = keyframe;
        let (object_from_camera, thumbnail) = (*object_from_camera, thumbnail.clone());
        Self { object_from_camera, eye: eye(keyframe), thumbnail }
    }
}

/// Returns the position of a keyframe's first camera in the object's frame.
fn eye(keyframe: &Keyframe) -> Option<Vector3<f64>> {
    let seen = keyframe.cameras.first().and_then(|camera| *camera);
    seen.and_then(|world| world.moved(&keyframe.world_from_object).eye())
}

impl Target {
    /// Returns the orientations of the first camera in all known views, with its position: those of
    /// keyframes first.
    pub(in crate::track) fn eyes(
        &self,
    ) -> impl Iterator<Item = (UnitQuaternion<f64>, Option<Vector3<f64>>)> {
        let keyframes = self.keyframes.all.iter().map(|one| (one.object_from_camera, eye(one)));
        keyframes.chain(self.recalled.iter().map(|one| (one.object_from_camera, one.eye)))
    }

    /// Returns the number of known views.
    pub(in crate::track) fn known_views(&self) -> usize {
        self.keyframes.all.len() + self.recalled.len()
    }

    /// Returns the thumbnails of the views in the same order.
    pub(in crate::track) fn thumbnails(&self) -> impl Iterator<Item = Option<&Thumbnail>> {
        let keyframes = self.keyframes.all.iter().map(|one| one.thumbnail.as_ref());
        keyframes.chain(self.recalled.iter().map(|one| one.thumbnail.as_ref()))
    }

    /// Returns what is remembered of the object's sides: its keyframes, and recalled views of other
    /// sides.
    pub(in crate::track) fn remembered_views(&self) -> Vec<KnownView> {
        let keyframes = &self.keyframes.all;
        let is_other = |view: &&KnownView| {
            let away = |one: &Keyframe| one.object_from_camera.angle_to(&view.object_from_camera);
            keyframes.iter().all(|one| away(one) >= KEYFRAMES_APART)
        };
        let others = self.recalled.iter().filter(is_other).cloned();
        keyframes.iter().map(KnownView::of).chain(others).take(MOST_KEYFRAMES).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::Status;
    use crate::track::target::keyframes::tests::keep;
    use crate::track::trust::tests::tracker;

    fn view(turned: f64) -> KnownView {
        let object_from_camera = UnitQuaternion::from_euler_angles(0.0, -turned, 0.0);
        KnownView { object_from_camera, eye: Some(Vector3::z()), thumbnail: None }
    }

    #[test]
    fn recalled_views_are_known_beside_keyframes_and_remembered_where_none_of_these_is_near() {
        let mut target = tracker(Status::Tracking, 0.0).target;
        keep(&mut target.keyframes, 0.0);
        keep(&mut target.keyframes, 0.5);
        let apart = [0.5 + 0.9 * KEYFRAMES_APART, 0.5 + 1.1 * KEYFRAMES_APART, 2.0];
        target.recalled = apart.map(view).to_vec();
        let views = [target.known_views(), target.eyes().count(), target.thumbnails().count()];
        assert_eq!(views, [5; 3]);
        let remembered = target.remembered_views();
        assert_eq!(remembered.len(), 4);
        assert_eq!(remembered[2..], target.recalled[1..]);
        target.recalled = (0..2 * MOST_KEYFRAMES).map(|_| view(2.0)).collect();
        assert_eq!(target.remembered_views().len(), MOST_KEYFRAMES);
    }
}
