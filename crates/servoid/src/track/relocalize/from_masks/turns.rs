use nalgebra::UnitQuaternion;
use rand::RngExt;

use super::MaskFit;
use crate::camera::View;
use crate::evolve;
use crate::pose::{Pose, even_turn};
use crate::shape::{Outline, Projection};
use crate::track::target::solid::Solid;

/// Powers of the number with x⁴ = x + 1, whose multiples fill the unit cube evenly.
///
/// Source: Roberts, *The unreasonable effectiveness of quasirandom sequences* (2018).
const EVEN_STEPS: [f64; 3] =
    [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_4];

/// Returns orientations spread evenly over all rotations; the seed shifts all of them.
pub(super) fn spread(count: usize, seed: u64) -> Vec<UnitQuaternion<f64>> {
    let mut rng = evolve::rng(seed, u64::MAX);
    let first: [f64; 3] = std::array::from_fn(|_| rng.random());
    let share = |index: usize, way: usize| (first[way] + index as f64 * EVEN_STEPS[way]).fract();
    (0..count).map(|i| even_turn(share(i, 0), share(i, 1), share(i, 2))).collect()
}

/// Iterations that align a rotated body with its mask.
const STEPS: usize = 3;

/// Returns the pose with a given orientation, in a camera's frame, at which the outlines have the
/// centre and the size of the mask.
pub(super) fn centred(solid: &Solid, turn: UnitQuaternion<f64>, view: &View<'_>) -> Pose {
    let (first, last) = view.mask().bounds_px();
    let wanted = Bounds {
        first: first.map(|first| first as f64 - 0.5),
        last: last.map(|last| last as f64 + 0.5),
    };
    let camera = view.camera();
    let focal_px = 0.5 * (camera.focal_px()[0] + camera.focal_px()[1]);
    let projection = Projection::new(camera, &Pose::identity());
    let mut at_px = wanted.middle();
    let mut distance = 2.0 * solid.radius * focal_px / wanted.size();
    for _ in 0..STEPS {
        let pose = Pose::from_rotation(turn, camera.ray(at_px) * distance);
        let seen = projection.moved(&pose);
        let outlines = solid.outlines(&seen).map(|outline| Bounds::of(&outline));
        let Some(bounds) = outlines.reduce(Bounds::with) else {
            distance *= 2.0;
            continue;
        };
        let (middle, wanted_px) = (bounds.middle(), wanted.middle());
        // An offset from the outlines' middle scales with the size of the outlines.
        let nearer = (bounds.size() / wanted.size()).clamp(0.5, 2.0);
        at_px = [0, 1].map(|i| wanted_px[i] + (at_px[i] - middle[i]) / nearer);
        distance *= nearer;
    }
    view.world_from_camera() * Pose::from_rotation(turn, camera.ray(at_px) * distance)
}

/// A box of columns and rows.
#[derive(Debug, Clone, Copy)]
struct Bounds {
    first: [f64; 2],
    last: [f64; 2],
}

impl Bounds {
    fn of(outline: &Outline) -> Self {
        let half = [outline.covariance_px()[(0, 0)].sqrt(), outline.half_height];
        let center = [outline.center_u, outline.center_v];
        Self {
            first: [0, 1].map(|i| center[i] - half[i]),
            last: [0, 1].map(|i| center[i] + half[i]),
        }
    }

    fn with(self, other: Self) -> Self {
        Self {
            first: [0, 1].map(|i| self.first[i].min(other.first[i])),
            last: [0, 1].map(|i| self.last[i].max(other.last[i])),
        }
    }

    fn middle(&self) -> [f64; 2] {
        [0, 1].map(|i| 0.5 * (self.first[i] + self.last[i]))
    }

    fn size(&self) -> f64 {
        libm::hypot(self.last[0] - self.first[0], self.last[1] - self.first[1])
    }
}

/// Keeps those of the greatest worth, each with an orientation that differs enough from the better
/// ones.
pub(super) fn best_apart(mut tried: Vec<(f64, MaskFit)>, most: usize, apart: f64) -> Vec<MaskFit> {
    tried.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut kept: Vec<MaskFit> = Vec::with_capacity(most);
    for (_, one) in tried {
        let turn = one.world_from_object.rotation();
        let differs = |other: &MaskFit| other.world_from_object.rotation().angle_to(&turn) > apart;
        if kept.len() < most && kept.iter().all(differs) {
            kept.push(one);
        }
    }
    kept
}
