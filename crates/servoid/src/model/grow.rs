use rayon::prelude::*;

use super::refine::{Fit, refine};
use super::scene::Scene;
use super::seed::OpenRegion;
use super::{ModelError, Settings};
use crate::evolve::rng;
use crate::fitness::Fitness;
use crate::shape::Quadric;

/// Steps of a joint climb on the coarse, middle and fine level.
const STEPS: [usize; 3] = [40, 40, 40];

/// Fits that go on from the coarse level to the finer ones.
const FINALISTS: usize = 2;

/// Gain in F below which a change is not worth another round.
const WORTHWHILE: f64 = 1e-5;

/// Seeks one more ellipsoid on several islands, fits all of them together, keeps the best.
pub(super) fn add_one(
    scene: &Scene,
    standing: &Fit,
    settings: &Settings,
    pass: usize,
) -> Result<Fit, ModelError> {
    let open = OpenRegion::new(&scene.coarsest().views, &standing.quadrics);
    let seek = |island: usize| {
        let branch = branch(pass, standing.quadrics.len(), 0, island);
        seek_and_fit(scene, &open, &standing.quadrics, settings, branch)
    };
    let found: Vec<_> = (0..settings.islands).into_par_iter().map(seek).collect();
    let best = settle_best(scene, found.into_iter().collect::<Result<_, _>>()?);
    Ok(best.filter(|fit| fit.fitness >= standing.fitness).unwrap_or_else(|| standing.echo()))
}

/// Takes ellipsoids out that say least and seeks them anew, as long as that helps.
pub(super) fn reseed(
    scene: &Scene,
    mut standing: Fit,
    settings: &Settings,
    pass: usize,
) -> Result<Fit, ModelError> {
    let count = standing.quadrics.len();
    let rounds = if count < 2 { 0 } else { settings.reseeds };
    for round in 1..=rounds {
        let seek = |&gone: &usize| {
            let rest = standing.without(gone);
            let open = OpenRegion::new(&scene.coarsest().views, &rest);
            seek_and_fit(scene, &open, &rest, settings, branch(pass, count, round, gone))
        };
        let mut order = by_loss(scene, &standing);
        order.truncate(settings.islands);
        let found: Vec<_> = order.par_iter().map(seek).collect();
        match settle_best(scene, found.into_iter().collect::<Result<_, _>>()?) {
            Some(fit) if fit.fitness > standing.fitness + WORTHWHILE => standing = fit,
            _ => break,
        }
    }
    Ok(standing)
}

/// Takes the ellipsoid away that says least and fits the others together.
pub(super) fn drop_one(scene: &Scene, standing: &Fit) -> Fit {
    let fit = |&gone: &usize| {
        let rest = standing.without(gone);
        refine(&scene.coarsest().overlap, &rest, STEPS[0])
    };
    let mut order = by_loss(scene, standing);
    order.truncate(2 * FINALISTS);
    let found = order.par_iter().map(fit).collect();
    settle_best(scene, found).unwrap_or_default()
}

/// Numbers the search that a generator of random numbers serves.
fn branch(pass: usize, count: usize, round: usize, place: usize) -> u64 {
    [pass, count, round, place].iter().fold(0, |name, &part| (name << 16) | part as u64)
}

/// Orders the ellipsoids by how little F falls without them.
fn by_loss(scene: &Scene, standing: &Fit) -> Vec<usize> {
    let overlap = &scene.coarsest().overlap;
    let left: Vec<f64> =
        (0..standing.quadrics.len()).map(|gone| overlap.score(&standing.without(gone))).collect();
    let mut order: Vec<usize> = (0..left.len()).collect();
    order.sort_by(|&a, &b| left[b].total_cmp(&left[a]));
    order
}

fn seek_and_fit(
    scene: &Scene,
    open: &OpenRegion,
    standing: &[Quadric],
    settings: &Settings,
    branch: u64,
) -> Result<Fit, ModelError> {
    let seed = open.search(standing, settings, rng(settings.seed, branch))?;
    let all = [standing, &[seed]].concat();
    Ok(refine(&scene.coarsest().overlap, &all, STEPS[0]))
}

/// Climbs from the middle to the finest level with the best few, keeps the best of them.
fn settle_best(scene: &Scene, mut found: Vec<Fit>) -> Option<Fit> {
    found.sort_by(|a, b| b.fitness.total_cmp(&a.fitness));
    found.truncate(FINALISTS);
    let settle = |fit: &Fit| {
        let finer = scene.levels.iter().zip(STEPS).skip(1);
        finer.fold(fit.clone(), |fit, (level, steps)| refine(&level.overlap, &fit.quadrics, steps))
    };
    let settled: Vec<_> = found.par_iter().map(settle).collect();
    settled.into_iter().reduce(|best, fit| if fit.fitness > best.fitness { fit } else { best })
}
