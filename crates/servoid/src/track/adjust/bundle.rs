//! Bundle adjustment: finds the poses of keyframes and the positions of landmarks that best explain
//! the observed pixels. All motions are those of the object in its own frame.

use nalgebra::{DVector, Matrix2, Matrix3, Matrix6, Vector2, Vector3};

use super::schur::Reduced;
use crate::pose::{Pose, Twist};
use crate::shape::Projection;
use crate::track::target::points::Feature;

/// A bundle adjustment problem.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bundle {
    pub(crate) keyframes: Vec<Station>,
    pub(crate) landmarks: Vec<Landmark>,
    /// Ordered by their landmarks.
    pub(crate) sightings: Vec<Sighting>,
    /// Whether guessed distances decide, though nothing confirms them.
    pub(crate) is_guess: bool,
}

/// The pose of the object at a keyframe, and its prior.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Station {
    pub(crate) world_from_object: Pose,
    /// `None` fixes the pose.
    pub(crate) prior: Option<KeyframePrior>,
}

/// The prior of a keyframe: a motion that leads to it, from an earlier one or from the world's
/// frame, and its information about a small motion in the object's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct KeyframePrior {
    pub(crate) from: Option<usize>,
    pub(crate) motion: Pose,
    pub(crate) information: Matrix6<f64>,
}

/// A point of the object's surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Landmark {
    /// In the object's frame.
    pub(crate) position: Vector3<f64>,
    /// `None` fixes the position.
    pub(crate) anchor: Option<Anchor>,
    /// Whether its distance comes from motion alone, so that its variance is computed.
    pub(crate) is_from_motion: bool,
    /// Whether its distance is a guess.
    pub(crate) is_guess: bool,
}

impl Landmark {
    pub(crate) fn of(known: &Feature, anchor: Option<Anchor>) -> Self {
        let (is_from_motion, is_guess) = (known.is_from_motion, known.is_from_body);
        Self { position: known.point.position, anchor, is_from_motion, is_guess }
    }
}

/// The position at which a landmark was learned, at a keyframe, in the world's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Anchor {
    pub(crate) keyframe: usize,
    pub(crate) position_in_world: Vector3<f64>,
    /// The direction to the camera by which it was learned.
    pub(crate) toward_in_world: Vector3<f64>,
    /// Standard deviations along that direction and across, in metres.
    pub(crate) along: f64,
    pub(crate) across: f64,
}

/// An observation of a landmark by a camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting {
    pub(crate) landmark: usize,
    pub(crate) keyframe: usize,
    /// Projection of the world into the camera.
    pub(crate) world: Projection,
    pub(crate) pixel: Vector2<f64>,
    /// Information of the pixel, in inverse square pixels.
    pub(crate) information: Matrix2<f64>,
}

/// The solution of a bundle adjustment.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    pub(crate) bundle: Bundle,
    /// Mean cost of an observation.
    pub(crate) sighting_cost: f64,
    /// Variance of each keyframe's orientation, in square radians, due to noise of the
    /// observations.
    pub(crate) turn_variances: Vec<f64>,
    /// The same for the distance of each landmark that comes from motion alone, in square metres.
    pub(crate) distance_variances: Vec<Option<f64>>,
    /// What motion alone says of each keyframe's orientation, where distances are guesses.
    pub(crate) by_motion: Vec<Option<ByMotion>>,
}

/// What motion alone says of a keyframe's orientation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ByMotion {
    /// By how much it differs, in radians.
    pub(crate) off: f64,
    /// Its own variance, in square radians, due to noise of the observations.
    pub(crate) variance: f64,
}

impl ByMotion {
    /// Returns by how much the orientation may be off, as a variance; errors that are correlated
    /// are a `factor` larger than the noise alone.
    pub(crate) fn doubt(&self, factor: f64) -> f64 {
        self.off * self.off + factor * factor * self.variance
    }
}

/// Most steps; the same where distances come from motion alone; and the relative decrease of the
/// cost below which the steps end.
const STEPS: (usize, usize) = (5, 12);
const CONVERGED: f64 = 3e-3;
/// Standard deviations from which on the cost of an observation is linear instead of quadratic.
const HUBER: f64 = 2.0;
/// Least number of landmarks whose misfit is meaningful.
const LEAST_LANDMARKS: i32 = 20;
/// Initial damping, and its factors after a step that lowers the cost and after one that does not.
const DAMPING: (f64, f64, f64) = (1e-4, 0.2, 10.0);
/// Factors of the standard deviations of guessed distances and of the tracked motions between
/// keyframes, by which nothing but the sightings decides.
const UNSURE: (f64, f64) = (10.0, 5.0);

impl Bundle {
    /// Adjusts keyframes and landmarks; returns none if the keyframes are not connected.
    pub(crate) fn adjusted(&self) -> Option<Solution> {
        let mut found = self.fitted(self.landmarks.iter().any(|one| one.is_from_motion))?;
        let guesses = self.landmarks.iter().filter(|one| one.is_guess).count();
        let decides = self.is_guess && 2 * guesses > self.landmarks.len();
        if let Some(by_motion) = decides.then(|| found.bundle.by_motion()).flatten() {
            found.by_motion = by_motion.into_iter().map(Some).collect();
        }
        Some(found)
    }

    /// Returns what motion alone says of each keyframe's orientation: what is found from here where
    /// guesses hardly count.
    fn by_motion(&self) -> Option<Vec<ByMotion>> {
        let mut free = self.clone();
        let guessed = free.landmarks.iter_mut().filter(|one| one.is_guess);
        guessed.filter_map(|one| one.anchor.as_mut()).for_each(|one| one.along *= UNSURE.0);
        let tracked = free.keyframes.iter_mut().filter_map(|one| one.prior.as_mut());
        tracked.for_each(|prior| prior.information /= UNSURE.1 * UNSURE.1);
        let found = free.fitted(true)?;
        let stations = self.keyframes.iter().zip(&found.bundle.keyframes);
        let by_motion = |((one, other), &variance): ((&Station, &Station), &f64)| {
            let off = (one.world_from_object.inverse() * other.world_from_object).log();
            ByMotion { off: off.fixed_rows::<3>(3).norm(), variance }
        };
        Some(stations.zip(&found.turn_variances).map(by_motion).collect())
    }

    /// Adjusts by the Levenberg-Marquardt method, in more steps where distances are `open`.
    fn fitted(&self, open: bool) -> Option<Solution> {
        let (mut bundle, mut moved) = (self.clone(), self.clone());
        let (mut damping, mut cost) = (DAMPING.0, self.cost());
        for _ in 0..if open { STEPS.1 } else { STEPS.0 } {
            let reduced = Reduced::new(&bundle);
            let lower = loop {
                let (motions, shifts) = reduced.step(damping)?;
                bundle.move_into(&mut moved, &motions, &shifts);
                let new = moved.cost();
                if new <= cost {
                    damping *= DAMPING.1;
                    break Some(new);
                }
                damping *= DAMPING.2;
                if damping > 1e6 {
                    break None;
                }
            };
            let Some(lower) = lower else { break };
            std::mem::swap(&mut bundle, &mut moved);
            let gain = cost - lower;
            cost = lower;
            if gain <= CONVERGED * cost {
                break;
            }
        }
        let (turn_variances, distance_variances) = Reduced::new(&bundle).variances(&bundle)?;
        let by_motion = vec![None; bundle.keyframes.len()];
        let sighting_cost = bundle.cost_of_sightings() / bundle.sightings.len().max(1) as f64;
        Some(Solution { bundle, sighting_cost, turn_variances, distance_variances, by_motion })
    }

    /// Returns the rms distance of landmarks from where they were learned, in standard deviations;
    /// none if they are too few.
    pub(crate) fn misfit(&self) -> Option<f64> {
        let off =
            self.landmarks.iter().filter_map(|one| Some(self.anchored(one)?.0.norm_squared()));
        let (count, sum) = off.fold((0, 0.0), |(count, sum), off| (count + 1, sum + off));
        (count >= LEAST_LANDMARKS).then(|| (sum / f64::from(count)).sqrt())
    }

    fn cost_of_sightings(&self) -> f64 {
        let sightings = self.sightings.iter().map(|one| match self.seen(one) {
            Some((off, _)) => robust(off.dot(&(one.information * off))).0,
            None => HUBER * HUBER,
        });
        sightings.sum()
    }

    /// Returns the cost of all residuals.
    pub(crate) fn cost(&self) -> f64 {
        let anchors = self.landmarks.iter().filter_map(|one| {
            let (off, _) = self.anchored(one)?;
            Some(robust(off.norm_squared()).0)
        });
        let beliefs = self.keyframes.iter().filter_map(|one| {
            let (prior, off) = (one.prior?, self.off(one)?);
            Some(robust(off.dot(&(prior.information * off))).0)
        });
        self.cost_of_sightings() + anchors.sum::<f64>() + beliefs.sum::<f64>()
    }

    /// Returns the residual of an observation in pixels, and the projection of the object's frame.
    pub(super) fn seen(&self, sighting: &Sighting) -> Option<(Vector2<f64>, Projection)> {
        let pose = &self.keyframes[sighting.keyframe].world_from_object;
        let projection = sighting.world.moved(pose);
        let (pixel, _) = projection.pixel(&self.landmarks[sighting.landmark].position)?;
        Some((sighting.pixel - pixel, projection))
    }

    /// Returns the deviation of a landmark from where it was learned, in standard deviations, and
    /// its derivative by the position in the object's frame.
    pub(super) fn anchored(&self, landmark: &Landmark) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let anchor = landmark.anchor.as_ref()?;
        let object = self.keyframes[anchor.keyframe].world_from_object.inverse();
        let way = object.rotation() * anchor.toward_in_world;
        let deviations = Matrix3::identity() / anchor.across
            + way * way.transpose() * (1.0 / anchor.along - 1.0 / anchor.across);
        let position = object.transform(&anchor.position_in_world);
        Some((deviations * (position - landmark.position), deviations))
    }

    /// Returns the motion, in the object's frame, by which a keyframe deviates from its prior.
    pub(super) fn off(&self, station: &Station) -> Option<Twist> {
        let prior = station.prior?;
        let from = prior.from.map_or_else(Pose::identity, |i| self.keyframes[i].world_from_object);
        Some((station.world_from_object.inverse() * from * prior.motion).log())
    }

    /// Writes the bundle after these motions into a copy, which has the same observations.
    pub(super) fn move_into(
        &self,
        out: &mut Self,
        motions: &DVector<f64>,
        shifts: &[Vector3<f64>],
    ) {
        out.keyframes.clone_from(&self.keyframes);
        out.landmarks.clone_from(&self.landmarks);
        let free = out.keyframes.iter_mut().filter(|one| one.prior.is_some());
        for (place, station) in free.enumerate() {
            let motion: Twist = motions.fixed_rows::<6>(6 * place).into();
            let moved = station.world_from_object * Pose::exp(&motion);
            station.world_from_object = moved.renormalized();
        }
        for (landmark, shift) in out.landmarks.iter_mut().zip(shifts) {
            landmark.position += shift;
        }
    }
}

/// Returns the robust cost of a squared distance in standard deviations, and its weight.
pub(super) fn robust(square: f64) -> (f64, f64) {
    if square <= HUBER * HUBER {
        return (square, 1.0);
    }
    let off = square.sqrt();
    (HUBER * (2.0 * off - HUBER), HUBER / off)
}

/// Draws a rotating object in front of two cameras; the poses of all keyframes but the first are
/// off by about this many radians.
#[cfg(test)]
pub(super) fn scene(seed: u64, off: f64) -> Bundle {
    use rand::RngExt;

    use crate::camera::Camera;

    let mut rng = crate::evolve::rng(seed, 0);
    let mut any = || rng.random_range(-1.0..1.0);
    let camera = Camera::new([640, 480], [600.0; 2], [320.0, 240.0]).unwrap();
    let eye = |x: f64| Pose::exp(&Twist::new(x, 0.0, -0.5, 0.0, 0.0, 0.0));
    let cameras = [0.0, 0.1].map(|x| Projection::new(&camera, &eye(x)));
    let turned = |at: usize| Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.0, 0.15 * at as f64, 0.0));
    let truth: Vec<_> = (0..6).map(turned).collect();
    let mut bundle = Bundle::default();
    for landmark in 0..30 {
        let position = Vector3::new(any(), any(), -1.0 + 0.3 * any()) * 0.05;
        for (keyframe, pose) in truth.iter().enumerate() {
            for world in cameras {
                let (pixel, _) = world.moved(pose).pixel(&position).unwrap();
                let information = Matrix2::new(4.0, 1.0, 1.0, 3.0);
                bundle.sightings.push(Sighting { landmark, keyframe, world, pixel, information });
            }
        }
        let anchor = Anchor {
            keyframe: landmark % truth.len(),
            position_in_world: truth[landmark % truth.len()].transform(&position),
            toward_in_world: Vector3::new(0.1, 0.0, -1.0).normalize(),
            along: 1e-3,
            across: 1e-4,
        };
        let anchor = (landmark % 5 != 0).then_some(anchor);
        let shift = if anchor.is_some() { 0.05 * off } else { 0.0 };
        let position = position + Vector3::new(any(), any(), any()) * shift;
        let (is_from_motion, is_guess) = (landmark % 5 == 1, true);
        bundle.landmarks.push(Landmark { position, anchor, is_from_motion, is_guess });
    }
    for (at, pose) in truth.iter().enumerate() {
        let noise = Twist::from_fn(|i, _| any() * off * if i < 3 { 0.05 } else { 1.0 });
        let from = (at % 3 != 1).then(|| at.saturating_sub(1));
        let start = from.map_or_else(Pose::identity, |from| truth[from]);
        let motion = start.inverse() * *pose * Pose::exp(&(noise * 0.1));
        let information = Matrix6::identity() * 100.0;
        let prior = (at > 0).then_some(KeyframePrior { from, motion, information });
        let moved = *pose * Pose::exp(&if at > 0 { noise } else { Twist::zeros() });
        bundle.keyframes.push(Station { world_from_object: moved, prior });
    }
    bundle
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a scene before one camera, whose guessed distances are all too small or too large by
    /// a factor; the other half of the object is known.
    fn guessed(seed: u64, relief: f64) -> Bundle {
        let mut bundle = scene(seed, 0.0);
        let first = bundle.sightings[0].world;
        bundle.sightings.retain(|one| one.world.offset == first.offset);
        bundle.is_guess = true;
        for station in bundle.keyframes.iter_mut().filter(|one| one.prior.is_some()) {
            station.prior.as_mut().unwrap().information *= 0.1;
        }
        for landmark in &mut bundle.landmarks {
            landmark.is_from_motion = false;
            let toward = Vector3::new(0.0, 0.0, -1.0);
            let depth = landmark.position.dot(&toward) - 0.05;
            let position_in_world = landmark.position + toward * (depth * (relief - 1.0));
            landmark.anchor = Some(Anchor {
                keyframe: 0,
                position_in_world,
                toward_in_world: toward,
                along: 5e-3,
                across: 1e-4,
            });
        }
        bundle
    }

    #[test]
    fn motion_alone_tells_how_far_a_turn_is_off_that_guessed_distances_decide() {
        for seed in 0..8 {
            for relief in [0.2, 0.5, 1.0, 1.5, 2.0] {
                let truth = guessed(seed, 1.0);
                let found = guessed(seed, relief).adjusted().unwrap();
                let poses = found.bundle.keyframes.iter().zip(&truth.keyframes).skip(1);
                for ((one, other), told) in poses.zip(found.by_motion.iter().flatten().skip(1)) {
                    let off = (one.world_from_object.inverse() * other.world_from_object).log();
                    let off = off.fixed_rows::<3>(3).norm();
                    assert_eq!(off > 1e-4, relief != 1.0, "{off}");
                    assert!((told.off - off).abs() < 0.05 * off + 1e-6, "{} {off}", told.off);
                }
            }
        }
    }

    #[test]
    fn sightings_without_noise_determine_all_keyframe_poses() {
        for seed in 0..8 {
            let truth = scene(seed, 0.0);
            let found = scene(seed, 0.1).adjusted().unwrap().bundle;
            assert!(found.cost() < 0.3, "{}", found.cost());
            for (one, other) in found.keyframes.iter().zip(&truth.keyframes) {
                let off = (one.world_from_object.inverse() * other.world_from_object).log();
                assert!(off.norm() < 3e-3, "{off}");
            }
        }
    }
}
