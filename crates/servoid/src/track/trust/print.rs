//! Whether an object is printed, or shows nothing but shading and highlights.

use super::{RICH, SOME};
use crate::track::pose::verify::Quality;
use crate::track::settings::TrackSettings;
use crate::track::target::reference::Reference;
use crate::track::tracker::Tracker;

/// Mean share of the recognised surface points with the contrast of a pattern, from which on the
/// object counts as patterned. Shading alone gives most points of a glossy toy that contrast.
const MOSTLY: f64 = 0.85;
/// Mean share of the recognised surface points that must be finely patterned for the orientation to
/// be reported: the shading of a smooth toy has the contrast of a pattern, but varies slowly; the same
/// where a single camera sees it, and fewer points.
const FINELY: f64 = 0.5;
const FINELY_ALONE: f64 = 0.7;

/// Largest share of the recognised points that are finely patterned, from which on a pattern is not
/// shading, or the least number of points per camera with the contrast of a pattern, or the least of
/// its product with the shares of printed and of finely patterned points, all at their largest: of plain
/// objects they are 0.86, 24 and 13 at most, of a faintly printed mug in noise 0.95, 26 and 12.
const LIKELY: (f64, f64, f64) = (0.9, 28.0, 14.0);
/// Largest share of the recognised points that are finely patterned, from which on an object with many
/// points is surely printed, or the least of that product: 35 are shading at times.
const SURELY: (f64, f64) = (0.92, 36.0);

/// Returns whether an object showed so little of a pattern, in so many cameras, that its surface
/// points are shading and highlights: these slide along the surface while it turns, all together,
/// and would take its pose along. So they do not measure it, unless there is nothing else. Where the
/// object's shape is known, all that is not finely patterned counts as shading.
pub(in crate::track) fn is_plain(
    settings: &TrackSettings,
    reference: &Reference,
    cameras: usize,
    is_adjusted: bool,
) -> bool {
    let Reference { printed_share, most_printed, most_textured, .. } = *reference;
    let shows_little = most_printed < MOSTLY && most_textured < RICH * cameras as f64;
    let is_smooth = (settings.known_shape || is_adjusted) && is_smooth(reference, cameras);
    settings.region && printed_share.is_some() && (shows_little || is_smooth)
}

/// Returns whether an object never showed a pattern that is finer than shading, nor many points of one
/// that is hardly finer.
fn is_smooth(reference: &Reference, cameras: usize) -> bool {
    let (fine, textured) = (reference.most_fine, reference.most_textured / cameras as f64);
    let is_likely = fine >= LIKELY.0 || textured >= LIKELY.1;
    fine < finely(cameras) || !is_likely && print(reference, cameras) < LIKELY.2
}

fn finely(cameras: usize) -> f64 {
    if cameras > 1 { FINELY } else { FINELY_ALONE }
}

/// Returns the number of points per camera with the contrast of a pattern, times the shares of printed and
/// of finely patterned ones, all at their largest.
fn print(reference: &Reference, cameras: usize) -> f64 {
    let Reference { most_textured, most_printed, most_fine, .. } = *reference;
    most_textured / cameras as f64 * most_printed * most_fine
}

impl Tracker {
    pub(in crate::track) fn is_plain(&self) -> bool {
        let is_adjusted = self.target.outlined.is_adjusted();
        is_plain(&self.settings, &self.target.reference, self.frame.cameras.len(), is_adjusted)
    }

    pub(in crate::track) fn is_smooth(&self) -> bool {
        is_smooth(&self.target.reference, self.frame.cameras.len())
    }

    /// Returns whether the object showed a pattern that is finer than shading, on any side.
    pub(in crate::track) fn is_finely_patterned(&self, quality: &Quality) -> bool {
        if self.target.reference.fine_share.is_some() {
            return !self.is_smooth();
        }
        // The first image is all that is known.
        quality.fine_share() >= finely(self.frame.cameras.len())
    }

    /// Returns whether an object showed so much of a fine pattern that its points cannot be shading.
    pub(in crate::track) fn is_surely_printed(&self) -> bool {
        let (reference, cameras) = (&self.target.reference, self.frame.cameras.len());
        let each = reference.most_textured / cameras as f64;
        reference.most_fine >= SURELY.0 && each >= RICH || print(reference, cameras) >= SURELY.1
    }

    /// Returns whether most of what is usually recognised is a pattern, and enough of it is seen, at
    /// measured distances, to hold the pose: only then does the tracker learn where the object's
    /// boundary is.
    pub(in crate::track) fn is_patterned(&self, quality: &Quality) -> bool {
        let is_from_body = self.target.points.are_from_body(&self.workspace.matches);
        let is_printed = self.target.reference.printed_share.is_some_and(|part| part >= MOSTLY);
        !is_from_body && is_printed && self.printed(quality) >= SOME
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{quality, tracker};
    use super::*;
    use crate::track::Status;

    #[test]
    fn what_varies_as_slowly_as_shading_is_no_fine_pattern_unless_one_was_seen_before() {
        let mut toy = tracker(Status::Tracking, 60.0);
        let smooth = Quality { fine: 20.0, ..quality(1.0, 60.0) };
        assert!(!toy.is_finely_patterned(&smooth));
        assert!(
            toy.is_finely_patterned(&quality(1.0, 60.0)),
            "the first image is all that is known"
        );
        toy.target.reference.begin(&smooth);
        assert!(!toy.is_finely_patterned(&quality(1.0, 60.0)), "a single image");
        for _ in 0..40 {
            toy.target.reference.follow(&quality(1.0, 60.0), 0.5);
        }
        assert!(toy.is_finely_patterned(&smooth), "one that turned its label away");
    }

    #[test]
    fn a_pattern_that_is_hardly_finer_than_shading_is_one_only_of_many_points() {
        let patterned = |points: f64, printed: f64, fine: f64| {
            let mut object = tracker(Status::Tracking, 0.0);
            let cameras = object.frame.cameras.len() as f64;
            let all = cameras * points / printed;
            let textured = cameras * points;
            let seen =
                Quality { textured, printed: textured, fine: fine * all, ..quality(1.0, all) };
            object.target.reference = Reference::default();
            object.target.reference.begin(&seen);
            object.is_finely_patterned(&seen)
        };
        assert!(!patterned(23.5, 0.51, 0.77), "shading of two plain ellipsoids");
        assert!(!patterned(22.0, 0.57, 0.86), "shading of a plain mug");
        assert!(patterned(25.5, 0.48, 0.95), "a faint print in noise");
        assert!(patterned(31.5, 0.39, 0.75), "a coarse pattern all over");
        assert!(patterned(27.0, 0.8, 0.75), "one that lasts");
    }

    #[test]
    fn an_object_is_surely_printed_only_by_many_points_and_stays_so_when_it_turns_its_print_away() {
        let begun = |points: f64, printed: f64, fine: f64| {
            let mut object = tracker(Status::Tracking, 0.0);
            let (textured, all) = (printed * points, points);
            let seen =
                Quality { textured, printed: textured, fine: fine * all, ..quality(1.0, all) };
            object.target.reference = Reference::default();
            object.target.reference.begin(&seen);
            object
        };
        for fine in [0.3, 0.9, 1.0] {
            assert!(!begun(0.9 * RICH, 1.0, fine).is_surely_printed());
        }
        assert!(!begun(60.0, 0.7, 0.8).is_surely_printed(), "a smooth toy");
        assert!(begun(60.0, 1.0, 0.7).is_surely_printed(), "a coarse pattern");
        let mut labelled = begun(60.0, 0.7, 0.98);
        for _ in 0..100 {
            assert!(labelled.is_surely_printed());
            labelled.target.reference.follow(&quality(1.0, 3.0), 0.5);
        }
    }

    #[test]
    fn an_object_is_plain_only_once_little_of_it_proved_to_be_printed() {
        for cameras in 1..4 {
            let settings = TrackSettings::default();
            let is_plain = |reference: &Reference| is_plain(&settings, reference, cameras, false);
            let seen = |share: f64, textured: f64| {
                let (few, many) = (textured * cameras as f64, 100.0);
                let quality = quality(1.0, many);
                Quality { textured: few, printed: share * many, ..quality }
            };
            let begun = |share: f64, textured: f64| {
                let mut reference = Reference::default();
                reference.begin(&seen(share, textured));
                reference
            };
            assert!(!is_plain(&Reference::default()), "one never seen");
            assert!(is_plain(&begun(0.0, 0.0)) && is_plain(&begun(0.5, 0.9 * RICH)));
            assert!(!is_plain(&begun(MOSTLY, 0.2 * RICH)), "one far away, with print");
            let mut labelled = begun(0.5, 1.1 * RICH);
            for _ in 0..500 {
                assert!(!is_plain(&labelled), "one that turned its label away");
                labelled.follow(&seen(0.1, 2.0), 0.5);
            }
        }
    }

    #[test]
    fn what_is_not_finely_patterned_is_plain_however_much_contrast_it_has_if_its_shape_is_known() {
        let begun = |fine: f64| {
            let mut reference = Reference::default();
            reference.begin(&Quality { fine: 100.0 * fine, ..quality(1.0, 100.0) });
            reference
        };
        let guess = TrackSettings::default();
        let known = TrackSettings { known_shape: true, ..guess };
        for step in 0..=10 {
            let fine = 0.1 * f64::from(step);
            assert!(!is_plain(&guess, &begun(fine), 2, false), "{fine}");
            for cameras in 1..4 {
                let is_smooth = is_plain(&known, &begun(fine), cameras, false);
                assert_eq!(is_smooth, fine < finely(cameras), "{fine} {cameras}");
            }
        }
        assert!(!is_plain(&known, &Reference::default(), 2, false), "one never seen");
        let colorless = TrackSettings { region: false, ..known };
        assert!(!is_plain(&colorless, &begun(0.0), 2, false), "there is nothing else");
    }
}
