use crate::parallel::*;

use super::best_by_count::BestByCount;
use super::refine::{Fit, Objective, refine, refine_by_lead};
use super::seed::search;
use crate::evolve::rng;
use crate::fitness::{Evidence, Fitness};
use crate::model::scene::Scene;
use crate::model::{ModelError, Settings};
use crate::shape::Quadric;

/// Steps of a joint ascent on the coarse level, on the middle one, and of the last one on the
/// finest.
const STEPS: [usize; 3] = [80, 40, 300];

/// Steps of an ascent between two removals without a full fit.
const PASSING_STEPS: usize = 12;

/// Fits that are continued on the finer levels.
const FINALISTS: usize = 2;

/// Gain below which a change is not worth another round.
const WORTHWHILE: f64 = 1e-5;

/// Searches for one more ellipsoid on several islands, by splitting existing ones and, up to a few,
/// for all of them from scratch; fits all of them together, and keeps the best.
pub(in crate::model) fn add_one(
    scene: &Scene,
    current: &Fit,
    settings: &Settings,
    line: usize,
) -> Result<Fit, ModelError> {
    let mut found = larger(scene, current, settings, line)?;
    if (1..MOST_AFRESH).contains(&current.quadrics.len()) {
        found.push(afresh(scene, current.quadrics.len() + 1, settings, line)?);
    }
    Ok(best_of(scene, current, found))
}

/// Does the same to a body that is known already, and is kept: none is searched from scratch.
pub(in crate::model) fn add_to_known(
    scene: &Scene,
    current: &Fit,
    settings: &Settings,
) -> Result<Fit, ModelError> {
    Ok(best_of(scene, current, larger(scene, current, settings, 0)?))
}

/// Adds an ellipsoid to the current ones in several ways, and fits all of each together.
fn larger(
    scene: &Scene,
    current: &Fit,
    settings: &Settings,
    line: usize,
) -> Result<Vec<Fit>, ModelError> {
    let open = scene.coarse.total.open(&current.quadrics);
    let search_one = |island: usize| {
        let branch = branch(line, current.quadrics.len(), 0, island);
        search_and_fit(scene, open.as_ref(), &current.quadrics, settings, branch)
    };
    // The first ellipsoid matters most and costs little.
    let islands = settings.islands * if current.quadrics.is_empty() { FIRST_ISLANDS } else { 1 };
    let found: Vec<_> = (0..islands).into_par_iter().map(search_one).collect();
    let mut found: Vec<Fit> = found.into_iter().collect::<Result<_, _>>()?;
    found.extend(splits(scene, current, settings.splits));
    Ok(found)
}

/// Returns the best of some fits, or the current one if none is better.
fn best_of(scene: &Scene, current: &Fit, found: Vec<Fit>) -> Fit {
    settle_best(scene, found)
        .filter(|fit| fit.fitness >= current.fitness)
        .unwrap_or_else(|| current.echo(&scene.coarse))
}

/// Islands for the first ellipsoid, per island of a later ellipsoid.
const FIRST_ISLANDS: usize = 4;
/// Largest number of ellipsoids that is searched from scratch.
const MOST_AFRESH: usize = 8;

/// Searches for all ellipsoids of a count one after another and fits them together only in the end:
/// the existing ones need not be part of the best body of the next count (one ellipsoid fills a
/// mug, but the parts of its wall make up the better body).
fn afresh(
    scene: &Scene,
    count: usize,
    settings: &Settings,
    line: usize,
) -> Result<Fit, ModelError> {
    let mut quadrics = Vec::with_capacity(count);
    for place in 0..count {
        let Some(lead) = scene.coarse.total.lead() else { break };
        let rng = rng(settings.seed, branch(line, count, AFRESH, place));
        quadrics.push(search(lead.open(&quadrics).as_ref(), &quadrics, settings, rng)?);
    }
    let led = refine_by_lead(&scene.coarse, &quadrics, STEPS[0]);
    Ok(refine(&scene.coarse, &led, STEPS[0]))
}

/// Round number in the seeds of searches from scratch.
const AFRESH: usize = 0xffff;

/// Splits each ellipsoid across each of its axes, and fits the `keep` most promising results.
fn splits(scene: &Scene, current: &Fit, keep: usize) -> Vec<Fit> {
    let coarse = &scene.coarse;
    let places: Vec<(usize, usize)> = (0..current.quadrics.len())
        .flat_map(|which| (0..3).map(move |axis| (which, axis)))
        .collect();
    let split = |&(which, axis): &(usize, usize)| {
        let halves = current.quadrics[which].halves(axis);
        let all = [current.without(&[which]), halves.to_vec()].concat();
        refine(coarse, &all, PASSING_STEPS)
    };
    let mut found: Vec<Fit> = places.par_iter().map(split).collect();
    found.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    found.truncate(keep);
    found.par_iter().map(|fit| refine(coarse, &fit.quadrics, STEPS[0])).collect()
}

/// Removes ellipsoids that contribute little, alone or with one that hides them, and searches for
/// them anew, as long as that helps.
pub(in crate::model) fn reseed(
    scene: &Scene,
    mut current: Fit,
    settings: &Settings,
    line: usize,
) -> Result<Fit, ModelError> {
    let count = current.quadrics.len();
    let rounds = if count < 2 { 0 } else { settings.reseeds };
    for round in 1..=rounds {
        let removals = removals(scene, &current, settings);
        let search_one = |place: usize| {
            let mut fit = Fit { quadrics: current.without(&removals[place]), ..Fit::default() };
            while fit.quadrics.len() < count {
                let open = scene.coarse.total.open(&fit.quadrics);
                let branch = branch(line, fit.quadrics.len(), round, place);
                fit = search_and_fit(scene, open.as_ref(), &fit.quadrics, settings, branch)?;
            }
            Ok(fit)
        };
        let found: Vec<_> = (0..removals.len()).into_par_iter().map(search_one).collect();
        match settle_best(scene, found.into_iter().collect::<Result<_, ModelError>>()?) {
            Some(fit) if fit.worth > current.worth + WORTHWHILE => current = fit,
            _ => break,
        }
    }
    Ok(current)
}

/// Selects what to remove: the single ellipsoids with the least loss, and the pairs that hide each
/// other most, whose joint loss is far greater than that of each alone.
fn removals(scene: &Scene, current: &Fit, settings: &Settings) -> Vec<Vec<usize>> {
    let whole = scene.coarse.total.score(&current.quadrics);
    let loss = |gone: &[usize]| whole - scene.coarse.total.score(&current.without(gone));
    let count = current.quadrics.len();
    let alone: Vec<f64> = (0..count).map(|one| loss(&[one])).collect();
    let mut singles: Vec<usize> = (0..count).collect();
    singles.sort_by(|&a, &b| alone[a].total_cmp(&alone[b]));
    singles.truncate(settings.singles);
    let pairs: Vec<_> = (0..count).flat_map(|one| (0..one).map(move |two| [one, two])).collect();
    let hiding =
        |&[one, two]: &[usize; 2]| (loss(&[one, two]) - alone[one] - alone[two], [one, two]);
    let mut pairs: Vec<(f64, [usize; 2])> = pairs.par_iter().map(hiding).collect();
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
    pairs.truncate(if count > 2 { settings.pairs } else { 0 });
    let singles = singles.into_iter().map(|one| vec![one]);
    singles.chain(pairs.into_iter().map(|(_, pair)| pair.to_vec())).collect()
}

/// Removes ellipsoids one by one and offers the remaining ones as the best body of their count;
/// counts without a body yet are only passed through.
pub(in crate::model) fn descend(scene: &Scene, from: Fit, by_count: &mut BestByCount) {
    let mut current = from;
    while current.quadrics.len() > 2 {
        let count = current.quadrics.len() - 1;
        if count > by_count.max_count() {
            let gone = by_loss(scene, &current)[0];
            current = refine(&scene.coarse, &current.without(&[gone]), PASSING_STEPS);
        } else {
            by_count.offer(drop_one(scene, &current));
            current = by_count.at(count).clone();
        }
    }
}

/// Removes the ellipsoid that contributes least and fits the others together.
fn drop_one(scene: &Scene, current: &Fit) -> Fit {
    let fit = |&gone: &usize| refine(&scene.coarse, &current.without(&[gone]), STEPS[0]);
    let mut order = by_loss(scene, current);
    order.truncate(2 * FINALISTS);
    let found = order.par_iter().map(fit).collect();
    settle_best(scene, found).unwrap_or_default()
}

/// Returns the number of a search's random number generator.
fn branch(line: usize, count: usize, round: usize, place: usize) -> u64 {
    [line, count, round, place].iter().fold(0, |name, &part| (name << 16) | part as u64)
}

/// Orders the ellipsoids by the loss of F without them.
fn by_loss(scene: &Scene, current: &Fit) -> Vec<usize> {
    let total = &scene.coarse.total;
    let left: Vec<f64> =
        (0..current.quadrics.len()).map(|gone| total.score(&current.without(&[gone]))).collect();
    let mut order: Vec<usize> = (0..left.len()).collect();
    order.sort_by(|&a, &b| left[b].total_cmp(&left[a]));
    order
}

fn search_and_fit(
    scene: &Scene,
    open: &dyn Fitness,
    current: &[Quadric],
    settings: &Settings,
    branch: u64,
) -> Result<Fit, ModelError> {
    let seed = search(open, current, settings, rng(settings.seed, branch))?;
    let all = [current, &[seed]].concat();
    Ok(refine(&scene.coarse, &all, STEPS[0]))
}

/// Refines the best few on the middle level, and keeps the best of them.
fn settle_best(scene: &Scene, mut found: Vec<Fit>) -> Option<Fit> {
    found.sort_by(|a, b| b.worth.total_cmp(&a.worth));
    found.truncate(FINALISTS);
    let settle = |fit: &Fit| refine(&scene.middle, &fit.quadrics, STEPS[1]);
    let settled: Vec<_> = found.par_iter().map(settle).collect();
    settled.into_iter().reduce(|best, fit| if fit.worth > best.worth { fit } else { best })
}

/// Refines on the finest level, in all views.
pub(in crate::model) fn refine_finest(finest: &Objective, fit: &Fit) -> Fit {
    refine(finest, &fit.quadrics, STEPS[2])
}
