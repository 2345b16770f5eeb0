//! Where an object may be by the thumbnails of its keyframes.

use rand::RngExt;

use super::known_turns::KnownTurns;
use crate::pose::Pose;
use crate::track::pose::search::Found;
use crate::track::target::thumbnail::{Detection, IntegralImage};
use crate::track::tracker::Tracker;

/// Keyframes whose thumbnails are sought in one image.
const THUMBNAILS: usize = 6;
/// Places of each that are compared with those of the others, and places that are kept.
const EACH: usize = 6;
const ALL: usize = 4;
/// Least distance between places, in lengths of the object's image.
const APART: f64 = 0.35;

impl Tracker {
    /// Finds places in the first camera's open window where the object looks as in some of the
    /// keyframes, drawn anew for each image, at distances from near to far; returns the poses most
    /// like them. Sides are found as they were seen, not turned in the image.
    pub(super) fn detect(&mut self, known: &KnownTurns, (near, far): (f64, f64)) -> Vec<Found> {
        let mut rng = self.relocalizer.next_rng();
        let open = self.frame.windows.first().filter(|window| window.is_open());
        let Some(window) = open else { return Vec::new() };
        let all = self.target.thumbnails().enumerate();
        let thumbnails: Vec<_> = all.filter_map(|(at, one)| Some((at, one?))).collect();
        if thumbnails.is_empty() {
            return Vec::new();
        }
        let first = rng.random_range(0..thumbnails.len());
        let count = thumbnails.len().min(THUMBNAILS);
        let image = IntegralImage::of(window);
        let mut detected: Vec<(Detection, usize)> = Vec::new();
        for step in 0..count {
            let chosen = (first + step * thumbnails.len() / count) % thumbnails.len();
            let (view, thumbnail) = thumbnails[chosen];
            let found = best(thumbnail.search(&image, near, far), EACH, |one| one);
            detected.extend(found.into_iter().map(|one| (one, view)));
        }
        let pose_of = |(one, view): (Detection, usize)| {
            let position = window.point(&one.origin_px, one.depth)?;
            let pose = Pose::from_rotation(known.turn_at(view, &position), position);
            Some(Found { pose, score: f64::from(one.correlation), evaluations: 0 })
        };
        best(detected, ALL, |one| &one.0).into_iter().filter_map(pose_of).collect()
    }
}

/// Returns the best detections, each at another place than the better ones.
fn best<T>(mut all: Vec<T>, most: usize, detection: impl Fn(&T) -> &Detection) -> Vec<T> {
    all.sort_by(|a, b| detection(b).correlation.total_cmp(&detection(a).correlation));
    let mut kept: Vec<T> = Vec::new();
    for one in all {
        let place = detection(&one).origin_px;
        let is_other = |better: &T| {
            let better = detection(better);
            (place - better.origin_px).norm() > APART * better.length_px
        };
        if kept.len() < most && kept.iter().all(is_other) {
            kept.push(one);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn what_is_kept_is_the_best_at_each_place_whatever_its_depth() {
        let at = |u: f64, depth: f64, correlation: f32| Detection {
            correlation,
            origin_px: Vector2::new(u, 50.0),
            depth,
            length_px: 100.0,
        };
        let all = vec![at(100.0, 0.5, 0.7), at(110.0, 0.6, 0.9), at(100.0, 0.4, 0.8)];
        let all: Vec<_> =
            all.into_iter().chain([at(300.0, 0.5, 0.6), at(500.0, 0.5, 0.55)]).collect();
        let kept = best(all.clone(), 4, |one| one);
        assert_eq!(kept, [at(110.0, 0.6, 0.9), at(300.0, 0.5, 0.6), at(500.0, 0.5, 0.55)]);
        assert_eq!(best(all, 2, |one| one), kept[..2]);
    }
}
