//! Coarse alignment: how far the object's image went from where it was foreseen, by the vote of its
//! surface points. Each is asked by itself, so that those that something hides only do not vote.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::sight::Sight;
use super::target::points::InView;
use crate::pose::{Pose, Twist};

/// The resolution at which points vote.
const LEVEL: usize = 1;
/// How far they look, as a share of the object's radius, and in pixels of the resolution.
const REACH: f64 = 0.5;
const REACH_PX: (f64, f64) = (4.0, 16.0);
/// Most points of a camera that vote.
const VOTERS: usize = 32;
/// Correlation above which a place has a vote.
const VOTE: f32 = 0.6;
/// What the votes for a place must come to: three points that agree wholly, each worth 1 - `VOTE`.
const LEAST: f32 = 1.2;
/// Standard deviation of a vote, in pixels of the image, and of where the object is foreseen, in radii.
const VOTE_PX: f64 = 1.5;
const FORESEEN: f64 = 0.3;

/// Moves a pose to where most of the surface points in view are found, without a turn; nothing if they
/// do not agree in any camera.
pub(super) fn align(sight: &Sight<'_>, pose: &Pose, in_view: &[InView]) -> Option<Pose> {
    let mut curvature = Matrix3::identity() * (FORESEEN * sight.solid.radius).powi(-2);
    let mut slope = Vector3::zeros();
    let (mut votes, mut agreed) = (Vec::new(), false);
    for (camera, window) in sight.windows.iter().enumerate() {
        let Some(projection) = window.projection(pose) else { continue };
        let Some((_, by_place)) = projection.pixel(&Vector3::zeros()) else { continue };
        let pixel = f64::from(1_u32 << LEVEL);
        let radius_px = sight.solid.radius * by_place.row(0).norm() / pixel;
        let reach = (REACH * radius_px).clamp(REACH_PX.0, REACH_PX.1) as usize;
        let side = 2 * reach + 1;
        votes.clear();
        votes.resize(side * side, 0.0);
        let own = || in_view.iter().filter(|view| view.camera == camera);
        for view in own().step_by(own().count().div_ceil(VOTERS).max(1)) {
            let point = &sight.points.known[view.point].point;
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
