use crate::parallel::*;

use super::choice::Parts;
use super::grow::{add_one, descend, reseed};
use super::ladder::Ladder;
use super::scene::Scene;
use super::settings::workers;
use super::synthetic_views::{SyntheticView, synthetic_views};
use super::watch::Watch;
use super::{ModelError, ModelInput, Settings};
use crate::shape::Body;

/// What modelling reached with one count of ellipsoids.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The body.
    pub body: Body,
    /// F: the agreement with all that was given, at the resolution of the fit; of the paper's method
    /// its own.
    pub fitness: f64,
}

/// Told after each fit: the ellipsoids of the body, F, and the share of the work that is done.
/// `false` stops the work.
pub type Progress<'a> = &'a mut (dyn FnMut(usize, f64, f64) -> bool + Send);

/// Models what was given by the paper's progressive flow (Fig. 1, Sec. 2.2).
///
/// Gives one step for each count of ellipsoids, up to that at which F stops to rise by δ. The
/// overlap with the masks never falls from step to step.
///
/// # Errors
/// If what was given says too little, its views see no common point, none of it has a weight, or a
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
        let parts = if settings.held_out { Parts::of(&given) } else { None };
        let settings = Settings { held_out: parts.is_some(), ..settings };
        let scene = Scene::new(&parts.as_ref().map_or(given, |parts| parts.kept(&given)))?;
        let watch = Watch::new(&settings, progress);
        let lines: Vec<_> = (0..settings.lines)
            .into_par_iter()
            .map(|line| grow(&scene, &settings, line, &watch))
            .collect();
        let lines: Vec<Ladder> = lines.into_iter().collect::<Result<_, _>>()?;
        let mut ladder = cross(&scene, &settings, &lines, &watch)?;
        let scene = if let Some(parts) = &parts {
            ladder.truncate(parts.choose(&given, &ladder, &scene, &settings)?);
            Scene::in_frame(&given, scene.world_from_scene, scene.unit)?
        } else {
            scene
        };
        // Where there is more than outlines, F alone says which body is better.
        let compared = if solid { &[] } else { views.as_slice() };
        let steps = ladder.steps(&scene, compared)?;
        watch.finish(&steps)?;
        Ok(steps)
    })
}

/// Adds ellipsoids one by one, each with its centre on the surface of those that stand, fits all
/// of them together and seeks the redundant ones anew, until ΔF < δ or the maximum is reached and
/// a little beyond. Then takes them away one by one, which may leave a better body of a count than
/// adding did.
pub(super) fn grow(
    scene: &Scene,
    settings: &Settings,
    line: usize,
    watch: &Watch<'_>,
) -> Result<Ladder, ModelError> {
    let mut ladder = Ladder::default();
    let mut top = settings.max_ellipsoids;
    let mut count = 0;
    while count < (top + settings.overshoot).min(Body::MAX_ELLIPSOIDS) {
        count += 1;
        let grown = add_one(scene, ladder.at(count - 1), settings, line)?;
        ladder.offer(reseed(scene, grown, settings, line)?);
        if !settings.held_out && count <= top && ladder.stops_at(count, settings) {
            top = count;
        }
        watch.report(&ladder, count.min(top))?;
    }
    descend(scene, ladder.at(count).clone(), &mut ladder);
    watch.report(&ladder, top)?;
    Ok(ladder)
}

/// Joins the largest bodies of each two lines and takes ellipsoids away from the whole, so that
/// the best parts of both remain; keeps the best body of each count.
fn cross(
    scene: &Scene,
    settings: &Settings,
    lines: &[Ladder],
    watch: &Watch<'_>,
) -> Result<Ladder, ModelError> {
    let mut best = Ladder::default();
    lines.iter().for_each(|line| best.merge(line));
    let pairs: Vec<_> =
        (0..lines.len()).flat_map(|one| (0..one).map(move |two| (one, two))).collect();
    let child = |&(one, two): &(usize, usize)| {
        // Two parents together are at most one full body.
        let parent = |line: &Ladder| line.at(line.count().min(Body::MAX_ELLIPSOIDS / 2)).clone();
        let both = parent(&lines[one]).join(&parent(&lines[two]));
        let mut ladder = best.clone();
        descend(scene, both, &mut ladder);
        watch.report(&ladder, settings.max_ellipsoids)?;
        Ok(ladder)
    };
    let children: Vec<Result<Ladder, ModelError>> = pairs.par_iter().map(child).collect();
    for ladder in children {
        best.merge(&ladder?);
    }
    if !settings.held_out {
        best.cut(settings);
    }
    best.truncate(settings.max_ellipsoids);
    best.offer(reseed(scene, best.top().clone(), settings, lines.len())?);
    Ok(best)
}
