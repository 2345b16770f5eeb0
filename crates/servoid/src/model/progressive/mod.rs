//! Adds one ellipsoid after another, as in the paper's Fig. 1.

pub(super) mod best_by_count;
pub(super) mod grow;
pub(super) mod hold_out;
pub(super) mod progress;
pub(super) mod refine;
pub(super) mod seed;

use crate::parallel::*;

use self::best_by_count::BestByCount;
use self::grow::{add_one, descend, reseed};
use self::hold_out::HoldOut;
use self::progress::ProgressReporter;
use super::scene::Scene;
use super::settings::workers;
use super::synthetic_views::{SyntheticView, synthetic_views};
use super::{ModelError, ModelInput, Settings};
use crate::shape::Body;

/// The result of modelling with a given number of ellipsoids.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The body.
    pub body: Body,
    /// F: the agreement with all evidence, at the resolution of the fit; for the paper's method,
    /// its own F.
    pub fitness: f64,
}

/// Called after each fit with the number of ellipsoids of the body, F, and the share of the work
/// that is done. Return `false` to stop.
pub type Progress<'a> = &'a mut (dyn FnMut(usize, f64, f64) -> bool + Send);

/// Models an object by the paper's progressive flow (Fig. 1, Sec. 2.2).
///
/// Returns one step for each number of ellipsoids, up to the one after which F no longer rises by
/// δ. The overlap with the masks never decreases from step to step. From a mesh or range samples,
/// the settings `islands`, `splits`, `reseeds`, `lines` and `overshoot` are not those given, but the
/// ones chosen for that evidence.
///
/// # Errors
/// If the evidence is insufficient, its views see no common point, none of it has a weight, or a
/// weight or a setting is out of its range.
pub fn progressive(
    given: &ModelInput<'_>,
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Vec<Step>, ModelError> {
    let settings = settings.checked()?;
    given.weights.check()?;
    let solid = given.mesh.is_some() || !given.samples.is_empty();
    let settings = match given.mesh {
        Some(_) => settings.for_solids(),
        None if solid => settings.for_samples(),
        None => settings,
    };
    workers(settings.threads)?.install(|| {
        let drawn = given.mesh.map_or_else(|| Ok(Vec::new()), synthetic_views)?;
        let drawn = drawn.iter().map(SyntheticView::view).collect::<Result<Vec<_>, _>>()?;
        let views = [given.views, &drawn].concat();
        let given = ModelInput { views: &views, ..*given };
        let hold_out = if settings.held_out { HoldOut::of(&given) } else { None };
        let settings = Settings { held_out: hold_out.is_some(), ..settings };
        let scene =
            Scene::new(&hold_out.as_ref().map_or(given, |hold_out| hold_out.training(&given)))?;
        let reporter = ProgressReporter::new(&settings, progress);
        let lines: Vec<_> = (0..settings.lines)
            .into_par_iter()
            .map(|line| grow(&scene, &settings, line, &reporter))
            .collect();
        let lines: Vec<BestByCount> = lines.into_iter().collect::<Result<_, _>>()?;
        let mut by_count = cross(&scene, &settings, &lines, &reporter)?;
        if let Some(hold_out) = &hold_out {
            by_count.truncate(hold_out.choose(&given, &by_count, &scene, &settings)?);
        }
        // If there is more than outlines, F alone decides which body is better.
        let compared = if solid { &[] } else { views.as_slice() };
        let steps = by_count.steps(&scene, &scene.finest(&given)?, compared)?;
        reporter.finish(&steps)?;
        Ok(steps)
    })
}

/// Adds ellipsoids one by one, each with its centre on the surface of the existing ones, fits all
/// of them together and searches for the redundant ones anew, until ΔF < δ or the maximum is
/// reached, and a little beyond. Then removes them one by one, which may give a better body of a
/// count than adding did.
pub(super) fn grow(
    scene: &Scene,
    settings: &Settings,
    line: usize,
    reporter: &ProgressReporter<'_>,
) -> Result<BestByCount, ModelError> {
    let mut by_count = BestByCount::default();
    let mut top = settings.max_ellipsoids;
    let mut count = 0;
    while count < (top + settings.overshoot).min(Body::MAX_ELLIPSOIDS) {
        count += 1;
        let grown = add_one(scene, by_count.at(count - 1), settings, line)?;
        by_count.offer(reseed(scene, grown, settings, line)?);
        if !settings.held_out && count <= top && by_count.stops_at(count, settings) {
            top = count;
        }
        reporter.report(&by_count, count.min(top))?;
    }
    descend(scene, by_count.at(count).clone(), &mut by_count);
    reporter.report(&by_count, top)?;
    Ok(by_count)
}

/// Joins the largest bodies of each two lines and removes ellipsoids from the union, so that the
/// best parts of both remain; keeps the best body of each count.
fn cross(
    scene: &Scene,
    settings: &Settings,
    lines: &[BestByCount],
    reporter: &ProgressReporter<'_>,
) -> Result<BestByCount, ModelError> {
    let mut best = BestByCount::default();
    lines.iter().for_each(|line| best.merge(line));
    let pairs: Vec<_> =
        (0..lines.len()).flat_map(|one| (0..one).map(move |two| (one, two))).collect();
    let child = |&(one, two): &(usize, usize)| {
        // Two parents together are at most one full body.
        let parent =
            |line: &BestByCount| line.at(line.max_count().min(Body::MAX_ELLIPSOIDS / 2)).clone();
        let both = parent(&lines[one]).join(&parent(&lines[two]));
        let mut by_count = best.clone();
        descend(scene, both, &mut by_count);
        reporter.report(&by_count, settings.max_ellipsoids)?;
        Ok(by_count)
    };
    let children: Vec<Result<BestByCount, ModelError>> = pairs.par_iter().map(child).collect();
    for by_count in children {
        best.merge(&by_count?);
    }
    if !settings.held_out {
        best.cut(settings);
    }
    best.truncate(settings.max_ellipsoids);
    best.offer(reseed(scene, best.top().clone(), settings, lines.len())?);
    Ok(best)
}
