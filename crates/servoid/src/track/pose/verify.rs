use super::refine::{Evaluated, Workspace};
use super::weakest_turn::{WeakestTurn, gradient_noise};
use crate::fitness::Agreement;
use crate::track::inputs::Inputs;
use crate::track::target::points::Match;

/// How far the images confirm a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quality {
    /// Share of what should be visible that is seen, 0 to 1.
    pub(crate) visible: f64,
    /// The same, but the more is seen elsewhere, the less a hidden part counts.
    pub(crate) share: f64,
    /// What is seen less what is missed, in surface points: distinguishes a pose with much evidence
    /// from one at which little is expected.
    pub(crate) support: f64,
    /// Surface points that are seen.
    pub(crate) recognised: f64,
    /// Those of them with a contrast that only a pattern has.
    pub(crate) textured: f64,
    /// Those of them that have it now, or had it in most images in which they were recognised.
    pub(crate) printed: f64,
    /// Those of the recognised points around which the image is as finely patterned, for the size
    /// of the object, as shading never is.
    pub(crate) fine: f64,
    /// Those of the recognised points that show the rotation that the outline shows least by more
    /// than shading, now or in most images in which they were recognised.
    pub(crate) turning: f64,
    /// Mean log-likelihood ratio of the pixels inside the outline.
    pub(crate) ratio: f64,
    /// Mean agreement of the outline with the boundary in the images.
    pub(crate) outline: f64,
}

impl Quality {
    /// Returns the share of the recognised surface points that are printed.
    pub(crate) fn printed_share(&self) -> f64 {
        self.printed / self.recognised.max(1.0)
    }

    /// Returns the share of the recognised surface points that are finely patterned.
    pub(crate) fn fine_share(&self) -> f64 {
        self.fine / self.recognised.max(1.0)
    }

    /// Returns the share of the recognised surface points that show that rotation.
    pub(crate) fn turning_share(&self) -> f64 {
        self.turning / self.recognised.max(1.0)
    }
}

/// Correlations from which on a point counts as seen at all, and as fully seen.
const SEEN: (f64, f64) = (0.4, 0.8);
/// Squared gradient of a normalised patch per pixel and radius of the object from which on it is
/// finely patterned: shading varies over the whole object. Half of the points of smooth toys have at
/// most 16, of an object with a coarse pattern 20, with print 38 and more, in images of 320 x 240
/// and of 640 x 480 pixels.
const FINE: f64 = 16.0;
/// Part of the noise's variance that is taken off that gradient, before the patch is normalised: noise
/// is as fine as print.
const OF_NOISE: f64 = 0.2;
/// Surface points that weigh as much as an outline whose colours separate the object well.
const REGION_POINTS: f64 = 30.0;

/// Surface points seen in unhidden parts from which on what is hidden elsewhere does not count.
const ENOUGH: f64 = 20.0;

/// Compares what should be visible at a pose with the images, and notes which points show the
/// rotation that the outline shows least. What should be visible is the surface points in view, and
/// the colours inside the outline and the boundary around it, the latter two relative to the
/// reference. Hidden parts are excused as far as enough is recognised elsewhere: a wrong pose must not
/// excuse itself.
pub(crate) fn verify(inputs: &Inputs<'_>, found: &Evaluated, workspace: &mut Workspace) -> Quality {
    let reference = inputs.reference;
    let points = Points::count(inputs, found, workspace);
    let believed = (points.shown / ENOUGH).min(1.0);
    let excused = points.hidden * believed;
    let (ratio, area) = region(inputs, found);
    // What less than one line measures is taken from the reference.
    let (agreed, lines) = found.outline;
    let open = (1.0 - lines).max(0.0);
    let outline = (agreed + open * reference.outline) / (lines + open);
    // Occluders have other colours, so colours count only where the object shows.
    let (shows, left) =
        workspace.occlusion.clear().filter(|(_, left)| *left < 1.0).unwrap_or((ratio, 1.0));
    let clear_ratio = ratio + believed * (shows - ratio);
    let (mut seen, mut expected) = (points.recognised, points.expected);
    if inputs.colors.is_some() && reference.ratio > 0.0 && area > 0.0 {
        let weight = REGION_POINTS * reference.ratio.min(1.0) * (1.0 + believed * (left - 1.0));
        expected += weight;
        let inside = (clear_ratio / reference.ratio).clamp(0.0, 1.0);
        let around =
            if reference.outline > 0.0 { (outline / reference.outline).min(1.0) } else { 1.0 };
        seen += weight * inside.min(around);
    }
    let part = |all: f64| if all > 0.0 { (seen / all).min(1.0) } else { 0.0 };
    let Points { recognised, textured, printed, fine, turning, .. } = points;
    Quality {
        visible: part(expected),
        share: part(expected - excused),
        support: 2.0 * seen - (expected - excused),
        recognised,
        textured,
        printed,
        fine,
        turning,
        ratio,
        outline,
    }
}

/// The surface points in view at a pose, each by how often it was recognised when in view.
#[derive(Default)]
struct Points {
    expected: f64,
    /// Those that are seen, and of these the numbers that `Quality` has.
    recognised: f64,
    textured: f64,
    printed: f64,
    fine: f64,
    turning: f64,
    /// Those that are seen where nothing hides them, and those missed where something does.
    shown: f64,
    hidden: f64,
}

impl Points {
    /// Counts the matches of a pose, and notes which show the rotation that the outline shows least.
    fn count(inputs: &Inputs<'_>, found: &Evaluated, workspace: &mut Workspace) -> Self {
        let mut out = Self::default();
        let weakest = WeakestTurn::of(&found.normal.outline.0, inputs.solid.radius);
        let brightness = brightness(&workspace.matches);
        for one in workspace.matches.iter_mut().filter(|one| !one.is_edgel) {
            let feature = &inputs.points.features[one.view.point];
            let window = &inputs.windows[one.view.camera];
            let agreement = one.agreement;
            let hit_rate = f64::from(feature.hit_rate());
            let correlation = agreement.map_or(0.0, |a| a.correlation);
            let worth = hit_rate * ((correlation - SEEN.0) / (SEEN.1 - SEEN.0)).clamp(0.0, 1.0);
            let is_textured = agreement.is_some_and(|found| window.shows_texture(&found));
            let noise = gradient_noise(window.noise, one.level);
            let is_fine = |found: Agreement| is_fine(&found, inputs.solid.radius, noise);
            let light = window.light.max(brightness);
            one.turns = agreement.is_some_and(|found| match weakest {
                Some(turn) => {
                    let at = &feature.point.position;
                    turn.is_shown_by((&found, one.level), at, (window.noise, light))
                }
                // Without an outline all rotations are shown by print alone.
                None => is_textured,
            });
            let worth_if = |holds: bool| if holds { worth } else { 0.0 };
            out.expected += hit_rate;
            out.recognised += worth;
            out.textured += worth_if(is_textured);
            out.printed += worth_if(is_textured || feature.is_printed());
            out.fine += worth_if(agreement.is_some_and(is_fine));
            out.turning += worth_if(one.turns || feature.shows_turns());
            if let Some(pixel) = &one.pixel {
                let hides = workspace.occlusion.hides(one.view.camera, pixel);
                out.shown += worth * (1.0 - hides);
                out.hidden += (hit_rate - worth) * hides;
            }
        }
        out
    }
}

/// Returns whether a patch on an object of a radius is finely patterned, beyond what the noise of its
/// image, as a variance, makes of it.
fn is_fine(found: &Agreement, radius: f64, noise: f64) -> bool {
    let radius_px = found.slope.row(0).norm() * radius;
    let detail = found.tensor.trace() - OF_NOISE * noise / found.contrast.powi(2);
    detail * radius_px >= FINE
}

/// Returns the mean log-likelihood ratio of the pixels inside the outline, and their number.
fn region(inputs: &Inputs<'_>, found: &Evaluated) -> (f64, f64) {
    let (mut sum, mut area) = (0.0, 0.0);
    for window in inputs.windows {
        if let Some(projection) = window.projection(&found.pose) {
            let (score, pixels) = window.region(&projection, inputs.solid);
            sum += score;
            area += pixels;
        }
    }
    (if area > 0.0 { sum / area } else { 0.0 }, area)
}

/// Returns the mean brightness of the points that are recognised, in grey levels.
fn brightness(matches: &[Match]) -> f64 {
    let recognised = || matches.iter().filter(|one| one.is_recognised());
    let all: f64 = recognised().filter_map(|one| one.agreement).map(|found| found.brightness).sum();
    all / (recognised().count() as f64).max(1.0)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix2x3, Vector2};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn more_noise_never_makes_a_fine_pattern_of_a_patch_and_without_any_its_contrast_is_no_matter(
            gradient in 0.01..2.0_f64,
            contrast in 1.0..80.0_f64,
            noise in 0.0..900.0_f64,
            more in 1.0..4.0_f64,
        ) {
            let patch = |contrast: f64| Agreement {
                pixel: Vector2::zeros(),
                slope: Matrix2x3::new(1000.0, 0.0, 0.0, 0.0, 1000.0, 0.0),
                correlation: 1.0,
                tensor: Matrix2::identity() * (0.5 * gradient),
                pull: Vector2::zeros(),
                contrast,
                brightness: 100.0,
            };
            prop_assert_eq!(is_fine(&patch(contrast), 0.05, 0.0), gradient * 50.0 >= FINE);
            let now = is_fine(&patch(contrast), 0.05, noise);
            prop_assert!(now || !is_fine(&patch(contrast), 0.05, more * noise));
            prop_assert!(!now || is_fine(&patch(more * contrast), 0.05, noise));
        }
    }
}
