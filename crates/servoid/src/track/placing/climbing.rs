use nalgebra::{UnitQuaternion, Vector3};

use super::Placement;
use crate::evolve::{self, ClimbSettings, Ga, GaError, GaSettings, Rng};
use crate::fitness::Overlap;
use crate::model::{ModelError, shrunk_overlap};
use crate::observe::View;
use crate::pose::{Pose, Twist, left_jacobian};
use crate::shape::Quadric;
use crate::track::solid::Solid;

/// How well a body fits masks that were made smaller.
pub(super) struct Fit<'a> {
    overlap: Overlap,
    quadrics: &'a [Quadric],
    /// Half the size of the body, in metres: the unit of motions.
    radius: f64,
}

/// How poses breed, and how far they may be from the first, in radii and radians.
const POPULATION: usize = 24;
const GENERATIONS: usize = 10;
const REACH: f64 = 0.35;
/// Climbs after breeding, and at the end.
const FIRST: ClimbSettings = ClimbSettings { steps: 20, first_step: 0.05, least_gain: 1e-4 };
const LAST: ClimbSettings = ClimbSettings { steps: 60, first_step: 0.01, least_gain: 1e-6 };

impl<'a> Fit<'a> {
    /// Shrinks masks until the object spans about `extent_px` in each.
    pub(super) fn new(
        solid: &'a Solid,
        views: &[View<'_>],
        extent_px: usize,
    ) -> Result<Self, ModelError> {
        let overlap = shrunk_overlap(views, extent_px)?;
        Ok(Self { overlap, quadrics: &solid.quadrics, radius: solid.radius })
    }

    pub(super) fn scored(&self, world_from_object: Pose) -> Placement {
        let iou = self.overlap.score_at(&world_from_object, self.quadrics);
        Placement { world_from_object, iou }
    }

    /// Makes a placement better: poses breed about it, and the best one climbs.
    pub(super) fn bred(&self, start: &Placement, rng: Rng) -> Result<Placement, GaError> {
        let expected = start.world_from_object;
        let settings = GaSettings {
            population: POPULATION,
            elites: 2,
            mutation_width: 0.3,
            ..Default::default()
        };
        let mut ga = Ga::new(&[(-REACH, REACH); 6], settings, rng)?;
        ga.move_each(|index, genes| {
            if index == 0 {
                genes.fill(0.0);
            }
        });
        for _ in 0..GENERATIONS {
            let pose = |genes: &[f64]| self.scored(expected * self.motion(genes)).iou;
            let scores: Vec<_> = ga.ask().iter().map(|one| pose(&one.genes)).collect();
            ga.tell(&scores)?;
        }
        let best = self.scored(expected * self.motion(&ga.best().genes));
        Ok(self.climb(&best, &FIRST))
    }

    /// Climbs to the best placement nearby.
    pub(super) fn climbed(&self, start: &Placement) -> Placement {
        self.climb(start, &LAST)
    }

    fn climb(&self, start: &Placement, settings: &ClimbSettings) -> Placement {
        let expected = start.world_from_object;
        let climb = evolve::climb(&[0.0; 6], settings, |at, uphill| {
            let motion = self.motion(at);
            let (score, slope) = self.overlap.slope_at(&(expected * motion), self.quadrics);
            uphill.copy_from_slice(self.pull_back(at, &motion, &slope).as_slice());
            score
        });
        Placement { world_from_object: expected * self.motion(&climb.at), iou: climb.score }
    }

    /// Makes a motion of six numbers: a way in radii, and an axis that is as long as the angle.
    fn motion(&self, numbers: &[f64]) -> Pose {
        let part = |first: usize| Vector3::from_fn(|i, _| numbers[first + i]);
        Pose::from_rotation(UnitQuaternion::from_scaled_axis(part(3)), part(0) * self.radius)
    }

    /// Carries a slope by small motions of the object back to those numbers.
    fn pull_back(&self, numbers: &[f64], motion: &Pose, slope: &Twist) -> Twist {
        let half = |first: usize| slope.fixed_rows::<3>(first).into_owned();
        let linear = motion.rotation() * half(0) * self.radius;
        // The angle's own slope is by the right Jacobian, transposed: the left one.
        let angular = left_jacobian(&Vector3::from_fn(|i, _| numbers[3 + i])) * half(3);
        Twist::from_fn(|i, _| if i < 3 { linear[i] } else { angular[i - 3] })
    }
}
