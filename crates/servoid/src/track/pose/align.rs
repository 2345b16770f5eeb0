//! Coarse alignment: estimates how far the object's image is from its predicted position by a vote
//! of its surface points. Each point is correlated by itself, so hidden ones simply do not vote.

use nalgebra::{Matrix3, Vector2, Vector3};

use crate::pose::{Pose, Twist};
use crate::track::inputs::Inputs;
use crate::track::target::points::InView;

/// The pyramid level at which points vote.
const LEVEL: usize = 1;
/// Search radius, as a share of the object's radius, and its limits in pixels of that level.
const REACH: f64 = 0.5;
const REACH_PX: (f64, f64) = (4.0, 16.0);
/// Most points per camera that vote.
const VOTERS: usize = 32;
/// Correlation above which a position receives a vote.
const VOTE: f32 = 0.6;
/// Least sum of votes for a position: four points with full agreement, each worth 1 - `VOTE`.
const LEAST: f32 = 1.6;
/// Standard deviation of a vote, in pixels of the image, and of the predicted position, in radii.
const VOTE_PX: f64 = 1.5;
const FORESEEN: f64 = 0.3;

/// Translates a pose to where most of the surface points in view are found, without a rotation;
/// returns none if they agree in no camera.
pub(crate) fn align(inputs: &Inputs<'_>, pose: &Pose, in_view: &[InView]) -> Option<Pose> {
    let mut curvature = Matrix3::identity() * (FORESEEN * inputs.solid.radius).powi(-2);
    let mut slope = Vector3::zeros();
    let (mut votes, mut agreed) = (Vec::new(), false);
    for (camera, window) in inputs.windows.iter().enumerate() {
        let Some(projection) = window.projection(pose) else { continue };
        let Some((_, by_place)) = projection.pixel(&Vector3::zeros()) else { continue };
        let pixel = f64::from(1_u32 << LEVEL);
        let radius_px = inputs.solid.radius * by_place.row(0).norm() / pixel;
        let reach = (REACH * radius_px).clamp(REACH_PX.0, REACH_PX.1) as usize;
        let side = 2 * reach + 1;
        votes.clear();
        votes.resize(side * side, 0.0);
        let counts =
            |view: &&InView| view.camera == camera && !inputs.points.features[view.point].is_edgel;
        let own = || in_view.iter().filter(counts);
        for view in own().step_by(own().count().div_ceil(VOTERS).max(1)) {
            let point = inputs.points.features[view.point].template(view.template);
            point.correlations(&projection, &window.pyramid, (LEVEL, reach), |at, found| {
                votes[at] += (found - VOTE).max(0.0);
            });
        }
        let most = votes.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        let Some((at, _)) = most.filter(|(_, votes)| **votes >= LEAST) else { continue };
        let off = Vector2::new((at % side) as f64, (at / side) as f64);
        let off_px = (off - Vector2::repeat(reach as f64)) * pixel;
        let weight = VOTE_PX.powi(-2);
        curvature += by_place.transpose() * by_place * weight;
        slope += by_place.transpose() * off_px * weight;
        agreed = true;
    }
    let off = curvature.cholesky().filter(|_| agreed)?.solve(&slope);
    Some(*pose * Pose::exp(&Twist::new(off.x, off.y, off.z, 0.0, 0.0, 0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Channels, ImageView, Observation};
    use crate::shape::{Body, Ellipsoid};
    use crate::track::{TrackSettings, Tracker};

    const SIZE: [usize; 2] = [320, 240];
    const FOCAL_PX: f64 = 300.0;
    const DISTANCE: f64 = 0.4;
    const RADIUS: f64 = 0.08;

    fn at(right: f64, down: f64) -> Pose {
        Pose::exp(&Twist::new(right, down, DISTANCE, 0.0, 0.0, 0.0))
    }

    /// Pixels between blots of the pattern.
    const BLOT_PX: f64 = 6.0;

    /// Brightness of a blot, a repeatable pseudo-random number of 0 to 255.
    fn blot(column: f64, row: f64, kind: u64) -> f64 {
        let mixed = (column as i64 as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
            ^ (row as i64 as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
            ^ kind.wrapping_mul(0x1656_67b1_9e37_79f9);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 56) as f64
    }

    /// Brightness everywhere, so that each position has a unique pattern; different for each kind.
    fn pattern(u: f64, v: f64, kind: u64) -> f64 {
        let (x, y) = (u / BLOT_PX, v / BLOT_PX);
        let (column, row) = (x.floor(), y.floor());
        let along = |y: f64| {
            let (left, right) = (blot(column, y, kind), blot(column + 1.0, y, kind));
            left + (x - column) * (right - left)
        };
        along(row) + (y - row) * (along(row + 1.0) - along(row))
    }

    /// Image after the pattern moved some pixels right and down; `is_hidden` shows another kind.
    fn picture(off: [f64; 2], is_hidden: impl Fn(usize, usize) -> bool) -> Vec<u8> {
        let pixel = |i: usize| {
            let (u, v) = (i % SIZE[0], i / SIZE[0]);
            let kind = u64::from(is_hidden(u, v));
            pattern(u as f64 - off[0], v as f64 - off[1], kind) as u8
        };
        (0..SIZE[0] * SIZE[1]).map(pixel).collect()
    }

    fn observation(pixels: &[u8], time_s: f64) -> Observation<'_> {
        let image = ImageView::new(pixels, SIZE, Channels::Grey).unwrap();
        Observation {
            time_s,
            world_from_camera: vec![Pose::identity()],
            images: vec![Some(image)],
            depths: Vec::new(),
        }
    }

    /// Aligns a ball that was seen in the middle with a later image.
    fn aligned(pixels: &[u8]) -> Option<Pose> {
        let camera = Camera::new(SIZE, [FOCAL_PX; 2], [159.5, 119.5]).unwrap();
        let ball = Ellipsoid::new(0, [0.0; 3], [RADIUS; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        let body = Body::new(at(0.0, 0.0), vec![ball]).unwrap();
        let mut tracker = Tracker::new(&[camera], &body, TrackSettings::default()).unwrap();
        let first = picture([0.0; 2], |_, _| false);
        tracker.start(&observation(&first, 0.0), at(0.0, 0.0), &[]).unwrap();
        let now = observation(pixels, 0.033);
        tracker.frame.check(&now).unwrap();
        assert!(tracker.open_windows(&now, &at(0.0, 0.0), 0.5));
        tracker.points_in_view(&at(0.0, 0.0));
        assert!(tracker.workspace.in_view.len() > 20);
        let inputs = Inputs::new(&tracker.frame, &now, &tracker.target, &tracker.settings);
        align(&inputs, &at(0.0, 0.0), &tracker.workspace.in_view)
    }

    /// Returns by how many pixels a pose is off from that of the ball in the middle.
    fn off_px(pose: &Pose) -> [f64; 2] {
        let place = pose.translation() * (FOCAL_PX / DISTANCE);
        assert_eq!(pose.rotation(), Pose::identity().rotation());
        [place.x, place.y]
    }

    #[test]
    fn points_vote_for_where_a_leap_went_however_much_of_the_object_something_hides() {
        for off in [[0.0, 0.0], [14.0, 0.0], [-9.0, 12.0], [6.0, -18.0]] {
            for hidden in [0, 140, 160] {
                let pixels = picture(off, |u, _| u < hidden);
                let found = off_px(&aligned(&pixels).unwrap());
                for i in 0..2 {
                    assert!((found[i] - off[i]).abs() < 2.0, "{found:?} for {off:?}, {hidden}");
                }
            }
        }
    }

    #[test]
    fn where_nothing_of_the_object_shows_no_place_is_voted_for() {
        let other = picture([0.0; 2], |_, _| true);
        assert_eq!(aligned(&other), None);
    }
}
