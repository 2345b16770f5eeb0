use nalgebra::Vector2;

use super::polish::{Desk, Sight};
use super::usual::Usual;
use crate::pose::Pose;

/// How far images confirm a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Verdict {
    /// Share of what should be seen that is, 0 to 1.
    pub(super) visible: f64,
    /// The same, but what something hides counts the less, the more is seen elsewhere.
    pub(super) confidence: f64,
    /// What is seen less what is missed, in surface points: tells a pose that much confirms from one
    /// at which little is expected.
    pub(super) support: f64,
    /// Surface points that are seen.
    pub(super) recognised: f64,
    /// Mean log-likelihood ratio of the pixels inside the outline.
    pub(super) ratio: f64,
    /// Mean agreement of the outline with the boundary in the images.
    pub(super) outline: f64,
}

/// Correlations from which on a point counts as seen at all, and as wholly seen.
const SEEN: (f64, f64) = (0.4, 0.8);
/// Surface points that weigh as much as an outline whose colours tell the object well.
const REGION_POINTS: f64 = 30.0;

/// Surface points in places that are clear from which on what is hidden elsewhere does not count.
const ENOUGH: f64 = 20.0;
/// Pixels from a place to those around it whose colours are asked.
const AROUND_PX: f64 = 3.0;
/// Share of the object's usual log-likelihood ratio below which colours are strange.
const STRANGE: f64 = 0.25;

/// Says whether the colours around a pixel are not the object's; `usual` is what these are worth.
fn is_strange(sight: &Sight<'_>, camera: usize, pixel: &Vector2<f64>, usual: f64) -> bool {
    let (Some(colors), Some(image)) = (sight.colors, &sight.images[camera]) else {
        return true;
    };
    let around = [(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)];
    let ratios = around.iter().filter_map(|(u, v)| {
        let at = pixel + Vector2::new(*u, *v) * AROUND_PX;
        sight.windows[camera].ratio(image, colors, at.x, at.y)
    });
    ratios.sum::<f64>() < STRANGE * usual * around.len() as f64
}

/// Compares what should be seen at a pose with what is: the surface points in view, and the colours
/// inside the outline and the boundary around it, both compared with what is usual.
pub(super) fn judge(sight: &Sight<'_>, pose: &Pose, usual: &Usual, desk: &Desk) -> Verdict {
    let (mut seen, mut expected, mut shown, mut hidden) = (0.0, 0.0, 0.0, 0.0);
    for ((view, agreement), (camera, pixel)) in desk.matches.iter().zip(desk.cover.places()) {
        let quality = f64::from(sight.points.known[view.point].quality());
        let correlation = agreement.map_or(0.0, |a| a.correlation);
        expected += quality;
        seen += quality * ((correlation - SEEN.0) / (SEEN.1 - SEEN.0)).clamp(0.0, 1.0);
        if desk.cover.was_there {
            match desk.cover.look(camera, pixel) {
                Some(true) => shown += quality,
                // What has the object's colours hides nothing of it: there the pose is wrong.
                Some(false) if is_strange(sight, camera, pixel, usual.ratio) => hidden += quality,
                _ => {}
            }
        }
    }
    let recognised = seen;
    let excused = hidden * (shown / ENOUGH).min(1.0);
    let left = if expected > 0.0 { 1.0 - excused / expected } else { 1.0 };
    let (mut sum, mut area) = (0.0, 0.0);
    for window in sight.windows {
        if let Some(projection) = window.projection(pose) {
            let (score, pixels) = window.region(&projection, sight.solid);
            sum += score;
            area += pixels;
        }
    }
    let ratio = if area > 0.0 { sum / area } else { 0.0 };
    let outline = desk.outline.0 / desk.outline.1.max(1.0);
    if sight.colors.is_some() && usual.ratio > 0.0 {
        let weight = REGION_POINTS * usual.ratio.min(1.0) * left;
        expected += weight;
        let inside = (ratio / usual.ratio).clamp(0.0, 1.0);
        let around = if usual.outline > 0.0 { (outline / usual.outline).min(1.0) } else { 1.0 };
        seen += weight * inside.min(around);
    }
    let share = |of: f64| if of > 0.0 { (seen / of).min(1.0) } else { 0.0 };
    let (visible, confidence) = (share(expected), share(expected - excused));
    let support = 2.0 * seen - expected;
    Verdict { visible, confidence, support, recognised, ratio, outline }
}
