//! Where an object may be by the pictures of its keyframes.

use rand::RngExt;

use super::known_turns::KnownTurns;
use super::relocalizer::keep;
use crate::pose::Pose;
use crate::track::pose::search::Found;
use crate::track::target::thumbnail::{Spot, Sums};
use crate::track::tracker::Tracker;

/// Keyframes whose pictures are sought in one image.
const PICTURES: usize = 6;
/// Places of each picture that are compared with those of the others.
const PLACES: usize = 24;
/// Places that are kept, and the least distance between them, in radii.
const KEPT: usize = 4;
const APART: f64 = 0.5;

impl Tracker {
    /// Finds places in the first camera's image, which must be open all over, where the object looks
    /// as in keyframes, at distances from near to far; returns the poses most like them. Which
    /// keyframes are compared changes from image to image.
    pub(super) fn spotted(&mut self, known: &KnownTurns, (near, far): (f64, f64)) -> Vec<Found> {
        let mut rng = self.relocalizer.next_rng();
        let open = self.frame.windows.first().filter(|window| window.is_open());
        let Some(window) = open else { return Vec::new() };
        let all = self.target.keyframes.all.iter().enumerate();
        let pictures: Vec<_> =
            all.filter_map(|(at, one)| Some((at, one.thumbnail.as_ref()?))).collect();
        if pictures.is_empty() {
            return Vec::new();
        }
        let first = rng.random_range(0..pictures.len());
        let count = pictures.len().min(PICTURES);
        let sums = Sums::of(window);
        let (mut spots, mut found) = (Vec::new(), Vec::new());
        for step in 0..count {
            let (keyframe, picture) =
                pictures[(first + step * pictures.len() / count) % pictures.len()];
            spots.clear();
            picture.seek(&sums, (near, far), &mut spots);
            spots.sort_by(|a: &Spot, b| b.likeness.total_cmp(&a.likeness));
            found.extend(spots.iter().take(PLACES).filter_map(|spot| {
                let position = window.point(&spot.origin_px, spot.distance)?;
                let pose = Pose::from_rotation(known.turn_at(keyframe, &position), position);
                Some(Found { pose, score: f64::from(spot.likeness), evaluations: 1 })
            }));
        }
        let radius = self.target.solid.radius;
        keep(&mut found, KEPT, |one, other| one.apart(other) > APART * radius);
        found
    }
}
