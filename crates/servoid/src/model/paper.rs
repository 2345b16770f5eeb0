use crate::parallel::*;
use nalgebra::Vector3;

use super::scene::{common_point, mean_radius};
use super::settings::{check_common, check_count, workers};
use super::{ModelError, Progress, Step};
use crate::camera::View;
use crate::changing::changeable;
use crate::evolve::{Ga, GaSettings, rng};
use crate::fitness::{Margin, Points, PointsView};
use crate::pose::{Pose, even_turn};
use crate::shape::{Body, Ellipsoid};

/// Settings of the paper's own method. The paper gives none of these numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PaperSettings {
    /// Most ellipsoids.
    pub max_ellipsoids: usize,
    /// δ: the method stops when another ellipsoid raises F by less.
    pub delta: f64,
    /// Seed of every search.
    pub seed: u64,
    /// Worker threads; 0 uses as many as the machine has. The result does not depend on it.
    pub threads: usize,
    /// m: points on each surface, and on each envelope.
    pub points: usize,
    /// α: the amount by which an envelope's radii exceed its ellipsoid's.
    pub alpha: Margin,
    /// Generations for each ellipsoid.
    pub generations: usize,
    /// Settings of the genetic algorithm.
    pub search: GaSettings,
}

changeable!(PaperSettings);

impl Default for PaperSettings {
    fn default() -> Self {
        Self {
            max_ellipsoids: 3,
            delta: 0.05,
            seed: 0,
            threads: 0,
            points: 500,
            alpha: Margin::Share(0.3),
            generations: 300,
            search: GaSettings { population: 100, ..GaSettings::default() },
        }
    }
}

impl PaperSettings {
    /// Returns the settings if all are in their ranges.
    ///
    /// # Errors
    /// If a setting is out of its range.
    pub fn checked(self) -> Result<Self, ModelError> {
        check_common(self.max_ellipsoids, self.delta)?;
        check_count("generations", self.generations, 1)?;
        self.search.checked()?;
        Ok(self)
    }
}

/// Search range of the first centre around the common point of the lines of sight, along each axis
/// of the first camera, and range of the radii, both in the object's mean radius.
const REACH: f64 = 2.0;
const RADII: (f64, f64) = (0.15, 2.5);

/// Models by the paper's own method, the baseline: its points term and a plain genetic algorithm,
/// in the flow of its Fig. 1. Each view's mask marks the pixels with the target's hue.
///
/// The first ellipsoid is the largest that fits into the hue; the centres of all others lie on the
/// surface of the first. An ellipsoid is not moved again once it is found. The fitness is a plain
/// sum over the ellipsoids, in which nothing keeps a later one away from what others cover.
///
/// # Errors
/// If there are fewer than two views, they see no common point, or a setting is out of its range.
pub fn paper(
    views: &[View<'_>],
    settings: &PaperSettings,
    progress: Progress<'_>,
) -> Result<Vec<Step>, ModelError> {
    let settings = settings.checked()?;
    workers(settings.threads)?.install(|| {
        let mut search = Search::new(views, &settings, progress)?;
        let (mut current, mut steps, mut reached) = (Vec::new(), Vec::new(), 0.0);
        while current.len() < settings.max_ellipsoids {
            current.push(search.next(&current, reached)?);
            let fitness = search.points.fitness(&current); // F_p
            let gain = fitness - reached; // ΔF_p = F_p - F_(p-1)
            if current.len() > 1 && gain < settings.delta {
                break;
            }
            steps.push(Step { body: Body::around(&current)?, fitness });
            reached = fitness;
        }
        search.report(steps.len(), reached, 1.0)?;
        Ok(steps)
    })
}

/// Poses that one thread scores in a batch.
const PIECE: usize = 256;

/// Scores a body at poses by the points term; of the settings only `points`, `alpha` and `threads`
/// matter. The bits are the same on any number of threads.
///
/// # Errors
/// If there is no view, or a setting is out of its range.
pub fn paper_scores(
    views: &[View<'_>],
    body: &Body,
    poses: &[Pose],
    settings: &PaperSettings,
) -> Result<Vec<f64>, ModelError> {
    let settings = settings.checked()?;
    let points = points_of(views, &settings)?;
    let of_piece = |piece: &[Pose]| -> Vec<f64> {
        piece.iter().map(|&pose| points.fitness(&body.at(pose).in_world())).collect()
    };
    let pieces: Vec<_> =
        workers(settings.threads)?.install(|| poses.par_chunks(PIECE).map(of_piece).collect());
    Ok(pieces.concat())
}

fn points_of<'a>(views: &[View<'a>], settings: &PaperSettings) -> Result<Points<'a>, ModelError> {
    let eye = |view: &View<'a>| {
        PointsView::new(*view.camera(), &view.world_from_camera(), view.mask().image())
    };
    let eyes = views.iter().map(eye).collect::<Result<_, _>>()?;
    Ok(Points::new(eyes, settings.points, settings.alpha)?)
}

/// Data of the search for each ellipsoid.
struct Search<'a> {
    points: Points<'a>,
    settings: &'a PaperSettings,
    world_from_box: Pose,
    unit: f64,
    progress: Progress<'a>,
}

impl<'a> Search<'a> {
    fn new(
        views: &[View<'a>],
        settings: &'a PaperSettings,
        progress: Progress<'a>,
    ) -> Result<Self, ModelError> {
        if views.len() < 2 {
            return Err(ModelError::TooFewViews(views.len()));
        }
        let middle = common_point(views)?;
        let unit = mean_radius(views, &middle);
        let world_from_box = Pose::from_rotation(views[0].world_from_camera().rotation(), middle);
        let points = points_of(views, settings)?;
        Ok(Self { points, settings, world_from_box, unit, progress })
    }

    /// Evolves one more ellipsoid. The existing ones add the same to every candidate's F, so only
    /// the candidates are scored.
    fn next(&mut self, current: &[Ellipsoid], reached: f64) -> Result<Ellipsoid, ModelError> {
        let PaperSettings { generations, max_ellipsoids, seed, search, .. } = *self.settings;
        let mut ga = Ga::new(&ranges(), search, rng(seed, current.len() as u64))?;
        for generation in 0..generations {
            let candidates = ga.ask().iter();
            let candidates: Vec<_> = candidates
                .map(|individual| self.decode(&individual.genes, current.first()))
                .collect::<Result<_, _>>()?;
            let scores: Vec<_> = candidates
                .par_iter()
                .with_min_len(8)
                .map(|candidate| self.points.fitness(std::slice::from_ref(candidate)))
                .collect();
            ga.tell(&scores)?;
            let done = current.len() * generations + generation;
            let share = done as f64 / (max_ellipsoids * generations) as f64;
            self.report(current.len(), reached, share)?;
        }
        self.decode(&ga.best().genes, current.first())
    }

    /// Decodes the genes of an ellipsoid: position (3), logarithms of the radii (3), rotation (3).
    /// The position is a point of the box or, once there is a first ellipsoid, a direction to its
    /// surface.
    fn decode(&self, genes: &[f64], first: Option<&Ellipsoid>) -> Result<Ellipsoid, ModelError> {
        let place = Vector3::new(genes[0], genes[1], genes[2]);
        let center = match first {
            Some(first) => {
                let direction = place.try_normalize(0.0).unwrap_or_else(Vector3::x);
                first.center() + first.factor() * direction
            }
            None => self.world_from_box.transform(&(place * REACH * self.unit)),
        };
        let radii = [genes[3], genes[4], genes[5]].map(|size| libm::exp(size) * self.unit);
        let turn = self.world_from_box.rotation() * even_turn(genes[6], genes[7], genes[8]);
        let quaternion = Pose::from_rotation(turn, center).quaternion();
        Ok(Ellipsoid::new(0, center.into(), radii, quaternion)?)
    }

    fn report(&mut self, count: usize, fitness: f64, share: f64) -> Result<(), ModelError> {
        if (self.progress)(count, fitness, share) { Ok(()) } else { Err(ModelError::Stopped) }
    }
}

fn ranges() -> [(f64, f64); 9] {
    let (place, size, share) = ((-1.0, 1.0), (libm::log(RADII.0), libm::log(RADII.1)), (0.0, 1.0));
    [place, place, place, size, size, size, share, share, share]
}
