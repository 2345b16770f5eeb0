use rayon::prelude::*;

use super::refine::{Fit, refine};
use super::scene::Scene;
use super::seed::OpenRegion;
use super::{ModelError, Settings};
use crate::evolve::rng;
use crate::fitness::Fitness;
use crate::observe::View;
use crate::shape::{Body, Quadric};

/// What modelling reached with one count of ellipsoids.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The body.
    pub body: Body,
    /// F: the mean silhouette overlap on the finest level.
    pub fitness: f64,
}

/// Told after each count: the count, the most there may be, and F. `false` stops the work.
pub type Progress<'a> = &'a mut (dyn FnMut(usize, usize, f64) -> bool + Send);

/// Steps of a joint climb on the coarse, middle and fine level.
const STEPS: [usize; 3] = [40, 40, 40];

/// Models what the views show by the paper's progressive flow (Fig. 1, Sec. 2.2).
///
/// Gives one step for each count of ellipsoids, up to that at which F stops to rise by δ.
///
/// # Errors
/// If there are fewer than two views, they see no common point, or a setting is out of its range.
pub fn progressive(
    views: &[View<'_>],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Vec<Step>, ModelError> {
    let settings = settings.checked()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(settings.threads).build();
    let pool = pool.map_err(|_| ModelError::Threads(settings.threads))?;
    pool.install(|| grow(views, &settings, progress))
}

fn grow(
    views: &[View<'_>],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Vec<Step>, ModelError> {
    let scene = Scene::new(views)?;
    let mut standing = Fit { quadrics: Vec::new(), fitness: 0.0 };
    let mut steps = Vec::new();
    while steps.len() < settings.max_ellipsoids {
        let grown = add_one(&scene, &standing, settings)?;
        let settled = reseed(&scene, grown, settings)?;
        let gain = settled.fitness - standing.fitness; // ΔF = F_p - F_(p-1)
        if !steps.is_empty() && gain < settings.delta {
            break;
        }
        standing = settled;
        steps.push(Step { body: scene.body(&standing.quadrics)?, fitness: standing.fitness });
        if !progress(steps.len(), settings.max_ellipsoids, standing.fitness) {
            return Err(ModelError::Stopped);
        }
    }
    Ok(steps)
}

/// Seeks one more ellipsoid on several islands, fits all of them together, keeps the best.
fn add_one(scene: &Scene, standing: &Fit, settings: &Settings) -> Result<Fit, ModelError> {
    let [coarse, .., _] = scene.levels.as_slice() else { return Err(ModelError::NoBaseline) };
    let open = OpenRegion::new(&coarse.views, &standing.quadrics);
    let count = standing.quadrics.len() as u64;
    let seek = |island: u64| {
        let rng = rng(settings.seed, (count << 32) | island);
        let seed = open.search(&standing.quadrics, settings, rng)?;
        let mut all = standing.quadrics.clone();
        all.push(seed);
        Ok(refine(&coarse.overlap, &all, STEPS[0]))
    };
    let islands: Vec<_> = (0..settings.islands as u64).into_par_iter().map(seek).collect();
    let mut found: Vec<Fit> = islands.into_iter().collect::<Result<_, ModelError>>()?;
    found.sort_by(|a, b| b.fitness.total_cmp(&a.fitness));
    found.truncate(2);
    let best = settle_best(scene, &found);
    Ok(best.filter(|fit| fit.fitness >= standing.fitness).unwrap_or_else(|| echo(standing)))
}

/// Climbs from the middle to the finest level with each, keeps the best.
fn settle_best(scene: &Scene, found: &[Fit]) -> Option<Fit> {
    let settle = |fit: &Fit| {
        let finer = scene.levels.iter().zip(STEPS).skip(1);
        finer.fold(fit.clone(), |fit, (level, steps)| refine(&level.overlap, &fit.quadrics, steps))
    };
    let settled: Vec<_> = found.par_iter().map(settle).collect();
    settled.into_iter().reduce(|best, fit| if fit.fitness > best.fitness { fit } else { best })
}

/// Hides a small ellipsoid inside the largest: one more that changes nothing.
fn echo(standing: &Fit) -> Fit {
    let mut out = standing.clone();
    let largest = standing.quadrics.iter().max_by(|a, b| a.bulk().total_cmp(&b.bulk()));
    if let Some(largest) = largest {
        out.quadrics.push(Quadric { center: largest.center, factor: largest.factor * 0.5 });
    }
    out
}

/// Takes ellipsoids out that say least and seeks them anew, as long as that helps.
fn reseed(scene: &Scene, mut standing: Fit, settings: &Settings) -> Result<Fit, ModelError> {
    let coarse = &scene.levels[0];
    let count = standing.quadrics.len();
    for round in 0..settings.reseeds as u64 {
        if count < 2 {
            break;
        }
        let without = |gone: usize| {
            let mut rest = standing.quadrics.clone();
            rest.remove(gone);
            rest
        };
        let mut order: Vec<(usize, f64)> =
            (0..count).map(|gone| (gone, coarse.overlap.score(&without(gone)))).collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        order.truncate(settings.islands);
        let seek = |&(gone, _): &(usize, f64)| {
            let rest = without(gone);
            let branch = ((count as u64) << 32) | ((round + 1) << 16) | gone as u64;
            let open = OpenRegion::new(&coarse.views, &rest);
            let seed = open.search(&rest, settings, rng(settings.seed, branch))?;
            let mut all = rest;
            all.push(seed);
            Ok(refine(&coarse.overlap, &all, STEPS[0]))
        };
        let tried: Vec<_> = order.par_iter().map(seek).collect();
        let mut found: Vec<Fit> = tried.into_iter().collect::<Result<_, ModelError>>()?;
        found.sort_by(|a, b| b.fitness.total_cmp(&a.fitness));
        found.truncate(2);
        match settle_best(scene, &found) {
            Some(fit) if fit.fitness > standing.fitness + 1e-5 => standing = fit,
            _ => break,
        }
    }
    Ok(standing)
}
