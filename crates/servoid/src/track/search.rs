use super::points::InView;
use super::polish::Sight;
use crate::evolve::{Ga, GaError, GaSettings, Rng};
use crate::observe::Pyramid;
use crate::pose::{Pose, Twist};

/// A population of poses that lives from image to image: each individual is a small motion from
/// where the object is expected, in units of how far it may be.
#[derive(Debug, Clone)]
pub(super) struct Search {
    ga: Ga,
    scores: Vec<f64>,
}

/// The best pose of a search and how many were scored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub(super) pose: Pose,
    pub(super) score: f64,
    pub(super) evaluations: usize,
}

/// How far the object may be from where it is expected: (across in metres, turned in radians).
pub(super) type Reach = (f64, f64);

impl Search {
    pub(super) fn new(population: usize, rng: Rng) -> Result<Self, GaError> {
        let settings =
            GaSettings { population, elites: 2, mutation_width: 0.3, ..Default::default() };
        let ga = Ga::new(&[(-1.0, 1.0); 6], settings, rng)?;
        Ok(Self { ga, scores: Vec::with_capacity(population) })
    }

    /// Breeds `generations` about a pose.
    pub(super) fn run(
        &mut self,
        sight: &Sight<'_>,
        in_view: &[InView],
        (expected, also): (&Pose, &Pose),
        reach: Reach,
        generations: usize,
    ) -> Result<Found, GaError> {
        let other = genes(&(expected.inverse() * *also).log(), reach);
        // What is expected and what was are always among those that are scored.
        self.ga.move_each(|index, genes| match index {
            0 => genes.fill(0.0),
            1 => genes.copy_from_slice(&other),
            _ => {}
        });
        let mut found = Found { pose: *expected, score: f64::NEG_INFINITY, evaluations: 0 };
        for _ in 0..generations {
            self.scores.clear();
            for individual in self.ga.ask() {
                let pose = *expected * Pose::exp(&motion(&individual.genes, reach));
                self.scores.push(score(sight, in_view, &pose));
            }
            found.evaluations += self.scores.len();
            self.ga.tell(&self.scores)?;
        }
        let best = self.ga.best();
        found.pose = *expected * Pose::exp(&motion(&best.genes, reach));
        found.score = best.score;
        Ok(found)
    }

    /// Moves the population along with the object to a pose that was found.
    pub(super) fn follow(&mut self, expected: &Pose, found: &Pose, reach: Reach) {
        let offset = genes(&(expected.inverse() * *found).log(), reach);
        self.ga.move_each(|_, genes| genes.iter_mut().zip(&offset).for_each(|(x, by)| *x -= by));
    }
}

fn motion(genes: &[f64], (across, turned): Reach) -> Twist {
    Twist::from_fn(|i, _| genes[i] * if i < 3 { across } else { turned })
}

fn genes(motion: &Twist, (across, turned): Reach) -> [f64; 6] {
    std::array::from_fn(|i| (motion[i] / if i < 3 { across } else { turned }).clamp(-1.0, 1.0))
}

/// Points of each camera that are looked at for a score.
const POINTS: usize = 24;

/// Scores a pose from -1 to 1 for each kind of evidence: the mean log-likelihood ratio inside the
/// outline, and the mean correlation of the surface points at the coarsest resolution.
pub(super) fn score(sight: &Sight<'_>, in_view: &[InView], pose: &Pose) -> f64 {
    let (mut region, mut pixels) = (0.0, 0.0);
    let (mut surface, mut points) = (0.0, 0.0);
    let every = in_view.len().div_ceil(POINTS * sight.windows.len().max(1)).max(1);
    for (camera, window) in sight.windows.iter().enumerate() {
        let Some(projection) = window.projection(pose) else { continue };
        if sight.colors.is_some() {
            let (sum, area) = window.region(&projection, &sight.solid.quadrics);
            region += sum;
            pixels += area;
        }
        let seen = in_view.iter().step_by(every).filter(|view| view.camera == camera);
        for view in seen {
            let point = &sight.points.known[view.point].point;
            let level = coarsest(&point.looks);
            let found = point.correlation(&projection, &window.pyramid, level);
            surface += found.unwrap_or(0.0).max(0.0);
            points += 1.0;
        }
    }
    let region = if pixels > 0.0 { region / (pixels * RATIO) } else { -1.0 };
    region + surface / (points + FEW_POINTS)
}

/// Log-likelihood ratio of a pixel that counts as one.
const RATIO: f64 = 2.5;
/// Points at which the surface counts half.
const FEW_POINTS: f64 = 8.0;

fn coarsest<T>(looks: &[Option<T>; Pyramid::LEVELS]) -> usize {
    looks.iter().rposition(Option::is_some).unwrap_or(0)
}
