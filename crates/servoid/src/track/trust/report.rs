//! Reports what is found of the object: its pose, how well the images determine it, and whether
//! the orientation can be relied on.

use nalgebra::Matrix6;

use super::{CLEAR, OF_KNOWN_SHAPE, is_turn_reliable, shows_turn};
use crate::camera::Observation;
use crate::track::estimate::{Estimate, Notice, Status};
use crate::track::pose::confidence::{Evidence, UNMEASURED, unseen};
use crate::track::pose::hypothesis::Hypothesis;
use crate::track::pose::refine::Normal;
use crate::track::pose::uncertainty::{Uncertainty, uncertainty};
use crate::track::pose::verify::Quality;
use crate::track::tracker::Tracker;

impl Tracker {
    /// Collects the evidence for a pose; `noise` is its covariance due to image noise, and
    /// `by_outline` states whether the outline alone shows its orientation.
    pub(in crate::track) fn evidence(
        &self,
        quality: &Quality,
        noise: &Matrix6<f64>,
        by_outline: bool,
    ) -> Evidence {
        let turn = |covariance: &Matrix6<f64>| covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        let open = self.frame.open().max(1) as f64;
        let (recognised, textured) = (quality.recognised / open, quality.textured / open);
        let reference = self.target.reference.textured / self.frame.cameras.len() as f64;
        Evidence {
            share: quality.share,
            recognised,
            textured,
            // Before anything was learned, this image is the reference.
            reference_textured: if reference > 0.0 { reference } else { textured },
            proved: self.trust.is_proved(),
            turn_rad: turn(noise),
            drift_rad: if by_outline { 0.0 } else { self.target.points.turn_variance().sqrt() },
            jitter_rad: if self.jitter.is_measured() {
                turn(&self.jitter.covariance())
            } else {
                UNMEASURED
            },
            by_outline,
        }
    }

    /// Returns the number of surface points per camera that are recognised and known to be part of
    /// a pattern.
    pub(in crate::track) fn printed(&self, quality: &Quality) -> f64 {
        quality.printed / self.frame.open().max(1) as f64
    }

    /// Returns the covariance of a pose: by the images, by how poses differ without motion, and by
    /// the drift since the first image, unless the outline alone shows the orientation.
    pub(in crate::track) fn covariance(
        &self,
        by_images: &Uncertainty,
        by_outline: bool,
    ) -> Matrix6<f64> {
        if by_outline {
            return by_images.covariance * OF_KNOWN_SHAPE + self.jitter.covariance();
        }
        by_images.covariance + self.jitter.covariance() + self.drift_covariance()
    }

    /// Makes an estimate from a hypothesis.
    pub(in crate::track) fn estimate(
        &mut self,
        observation: &Observation<'_>,
        hypothesis: &Hypothesis,
    ) -> Estimate {
        let followed = self.status == Status::Tracking;
        let radius = self.target.solid.radius;
        // The best of all wrong poses may fit sharply, but says nothing of the object's.
        let measured = if followed { hypothesis.normal } else { Normal::new(radius) };
        let known = uncertainty(&measured, radius);
        if followed {
            self.doubt_turn(observation, &hypothesis.pose);
            self.trust.follow_outline(hypothesis.quality.outline);
        }
        let is_printed = self.is_surely_printed();
        let located = followed && self.is_located(&hypothesis.quality);
        let adjusted = self.outlined_covariance(observation, hypothesis).filter(|_| located);
        let by_outline = located && (adjusted.is_some() || self.is_turn_outlined(hypothesis));
        let evidence = self.evidence(&hypothesis.quality, &known.covariance, by_outline);
        // The matches are those of a pose that is followed, or of points that are forgotten.
        let shows_print = !by_outline
            && located
            && shows_turn(&evidence, self.printed(&hypothesis.quality))
            && self.is_finely_patterned(&hypothesis.quality)
            && (is_printed || !self.trust.outline_fell)
            && self.is_turn_visible(hypothesis)
            && self.believes_relief(&hypothesis.quality);
        let shows = by_outline || shows_print && !self.is_spin_open(observation, hypothesis);
        let most_drift = self.trust.most_drift(self.target.relief.is_open);
        let is_reliable = shows && is_turn_reliable(&evidence, most_drift);
        let visible = hypothesis.quality.visible;
        self.trust.orient(is_reliable, located && visible >= CLEAR, by_outline || is_printed);
        let is_reliable = self.trust.is_oriented;
        if located && !is_reliable {
            let adrift = shows && !evidence.drifts_little(most_drift);
            let degrees = evidence.drift_rad.to_degrees();
            let notice = if adrift { Notice::Drifted { degrees } } else { Notice::TurnOpen };
            self.frame.notices.push(notice);
        }
        if followed && visible < CLEAR {
            self.frame.notices.push(Notice::Hidden { hidden: 100.0 * (1.0 - visible) });
        }
        let mut covariance = self.covariance(&known, by_outline);
        if let Some(adjusted) = adjusted {
            covariance += adjusted;
        } else if followed && !by_outline {
            covariance += self.shading_covariance(observation, hypothesis);
        }
        Estimate {
            time_s: observation.time_s,
            world_from_object: if followed { hypothesis.pose } else { self.motion.last() },
            covariance,
            unobservable: known.unobservable,
            confidence: if followed && !self.parting.is_certain() {
                evidence.probability()
            } else {
                unseen(self.status)
            },
            evidence: followed.then_some(evidence),
            status: if followed && !is_reliable { Status::Searching } else { self.status },
            located,
            keyframes: if followed {
                self.keyframes_around(observation, &hypothesis.pose)
            } else {
                self.keyframe = None;
                [None; 2]
            },
            evolved: std::mem::take(&mut self.has_evolved),
            notices: std::mem::take(&mut self.frame.notices),
            evaluations: 0,
            timing: Default::default(),
        }
    }
}
