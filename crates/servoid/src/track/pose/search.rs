use crate::camera::Pyramid;
use crate::evolve::{Ga, GaError, GaSettings, Rng};
use crate::fitness::SurfacePoint;
use crate::pose::{Pose, Twist};
use crate::track::inputs::Inputs;
use crate::track::target::points::InView;

/// A population of poses that persists from image to image: each individual is a small motion from
/// the predicted pose, in units of the search range.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    ga: Ga,
    scores: Vec<f64>,
}

/// The best pose of a search and the number of poses scored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    pub(crate) pose: Pose,
    pub(crate) score: f64,
    pub(crate) evaluations: usize,
}

/// Deviation of a pose, or a bound of it: (translation in metres, rotation in radians).
pub(crate) type Deviation = (f64, f64);

impl Search {
    pub(crate) fn new(population: usize, rng: Rng) -> Result<Self, GaError> {
        let settings =
            GaSettings { population, elites: 2, mutation_width: 0.3, ..Default::default() };
        let ga = Ga::new(&[(-1.0, 1.0); 6], settings, rng)?;
        Ok(Self { ga, scores: Vec::with_capacity(population) })
    }

    /// Breeds generations about a pose, at least one, as long as `go_on` returns true for their
    /// number.
    pub(crate) fn run(
        &mut self,
        scorer: &Scorer<'_>,
        (expected, also): (&Pose, &Pose),
        search_range: Deviation,
        go_on: impl Fn(usize) -> bool,
    ) -> Result<Found, GaError> {
        let other = genes(&(expected.inverse() * *also).log(), search_range);
        // The predicted pose and the other one are always among those that are scored.
        self.ga.move_each(|index, genes| match index {
            0 => genes.fill(0.0),
            1 => genes.copy_from_slice(&other),
            _ => {}
        });
        let mut found = Found { pose: *expected, score: f64::NEG_INFINITY, evaluations: 0 };
        let mut bred = 0;
        while bred == 0 || go_on(bred) {
            bred += 1;
            self.scores.clear();
            for individual in self.ga.ask() {
                let pose = *expected * Pose::exp(&motion(&individual.genes, search_range));
                self.scores.push(scorer.score(&pose));
            }
            found.evaluations += self.scores.len();
            self.ga.tell(&self.scores)?;
        }
        let best = self.ga.best();
        found.pose = *expected * Pose::exp(&motion(&best.genes, search_range));
        found.score = best.score;
        Ok(found)
    }

    /// Moves the population along with the object to its new pose.
    pub(crate) fn follow(&mut self, expected: &Pose, found: &Pose, search_range: Deviation) {
        let offset = genes(&(expected.inverse() * *found).log(), search_range);
        self.ga.move_each(|_, genes| genes.iter_mut().zip(&offset).for_each(|(x, by)| *x -= by));
    }
}

fn motion(genes: &[f64], (across, turned): Deviation) -> Twist {
    Twist::from_fn(|i, _| genes[i] * if i < 3 { across } else { turned })
}

fn genes(motion: &Twist, (across, turned): Deviation) -> [f64; 6] {
    std::array::from_fn(|i| (motion[i] / if i < 3 { across } else { turned }).clamp(-1.0, 1.0))
}

/// Which surface points a score compares.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Probes<'a> {
    /// These points.
    InView(&'a [InView]),
    /// Those of these points that face the camera.
    Facing(&'a [usize]),
}

/// Scores poses by the log-likelihood ratios inside the outline, as a share of their maximum, and
/// by the mean correlation of surface points at the coarsest resolution.
#[derive(Clone, Copy)]
pub(crate) struct Scorer<'a> {
    pub(crate) inputs: Inputs<'a>,
    pub(crate) probes: Probes<'a>,
    /// Number of pixels that the outline is expected to contain.
    pub(crate) area: f64,
}

/// Points per camera that are compared for a score.
const POINTS: usize = 24;
/// Log-likelihood ratio of a pixel that counts as one.
const RATIO: f64 = 2.5;
/// Number of points at which the surface has half its weight.
const FEW_POINTS: f64 = 8.0;
/// Least cosine between a probe's normal and the direction to a camera. It is larger than that of
/// points in view, since here nothing tests whether the body hides the probe.
const LEAST_FACING_PROBE: f64 = 0.35;

/// The score of a pose for each kind of evidence, -1 to 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoreTerms {
    /// Log-likelihood ratios inside the outline, as a share of their maximum.
    pub region: f64,
    /// Mean correlation of surface points.
    pub surface: f64,
}

impl ScoreTerms {
    /// Returns the sum of both, by which poses are ranked. // (S48)
    #[must_use]
    pub fn total(&self) -> f64 {
        self.region + self.surface
    }
}

impl Scorer<'_> {
    /// Scores a pose; -1 to 1 for each kind of evidence.
    pub(crate) fn score(&self, pose: &Pose) -> f64 {
        self.terms(pose, Pyramid::LEVELS - 1).total()
    }

    /// Scores a pose by each kind of evidence, with points at the resolution `level`, or at the
    /// finer one at which they were learned.
    pub(crate) fn terms(&self, pose: &Pose, level: usize) -> ScoreTerms {
        let mut region = 0.0;
        let (mut surface, mut points) = (0.0, 0.0);
        for (camera, window) in self.inputs.windows.iter().enumerate() {
            let Some(projection) = window.projection(pose) else { continue };
            if self.inputs.colors.is_some() {
                region += window.region(&projection, self.inputs.solid).0;
            }
            let mut compare = |point: &SurfacePoint| {
                let level = coarsest(&point.templates[..=level]);
                let found = point.correlation(&projection, &window.pyramid, level);
                surface += found.unwrap_or(0.0).max(0.0);
                points += 1.0;
            };
            match self.probes {
                Probes::InView(all) => {
                    let feature = &self.inputs.points.features;
                    let all = || all.iter().filter(|view| !feature[view.point].is_edgel);
                    let of_camera = all().count() / self.inputs.windows.len().max(1);
                    let every = of_camera.div_ceil(POINTS).max(1);
                    let seen = all().filter(|view| view.camera == camera);
                    seen.step_by(every)
                        .for_each(|view| compare(feature[view.point].template(view.template)));
                }
                Probes::Facing(all) => {
                    let Some(eye) = projection.eye() else { continue };
                    for &index in all {
                        let point = &self.inputs.points.features[index].point;
                        let way = eye - point.position;
                        if way.dot(&point.normal) > LEAST_FACING_PROBE * way.norm() {
                            compare(point);
                        }
                    }
                }
            }
        }
        ScoreTerms {
            region: region / (RATIO * self.area.max(1.0)),
            surface: surface / (points + FEW_POINTS),
        }
    }
}

fn coarsest<T>(templates: &[Option<T>]) -> usize {
    templates.iter().rposition(Option::is_some).unwrap_or(0)
}
