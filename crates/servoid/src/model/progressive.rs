use super::grow::{add_one, drop_one, reseed};
use super::ladder::Ladder;
use super::scene::Scene;
use super::{ModelError, Settings};
use crate::observe::View;
use crate::shape::Body;

/// What modelling reached with one count of ellipsoids.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// The body.
    pub body: Body,
    /// F: the mean silhouette overlap at the resolution of the fit.
    pub fitness: f64,
}

/// Told after each fit: the ellipsoids of the body, F, and the share of the work that is done.
/// `false` stops the work.
pub type Progress<'a> = &'a mut (dyn FnMut(usize, f64, f64) -> bool + Send);

/// Models what the views show by the paper's progressive flow (Fig. 1, Sec. 2.2).
///
/// Gives one step for each count of ellipsoids, up to that at which F stops to rise by δ. The
/// overlap with the masks never falls from step to step.
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
    pool.install(|| {
        let scene = Scene::new(views)?;
        let ladder = grow(&scene, &settings, progress)?;
        ladder.steps(&scene, views)
    })
}

/// Adds ellipsoids one by one, each with its centre on the surface of those that stand, fits all
/// of them together and seeks the redundant ones anew, until ΔF < δ or the maximum is reached.
/// Then takes them away one by one, which may leave a better body of a count than adding did, and
/// goes up and down again.
fn grow(
    scene: &Scene,
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Ladder, ModelError> {
    let mut ladder = Ladder::default();
    let mut top = settings.max_ellipsoids;
    let fits = settings.passes * (2 * settings.overshoot + 2 * top);
    let mut done = 0;
    for pass in 0..settings.passes {
        let mut count = 1;
        while count <= top + settings.overshoot {
            let grown = add_one(scene, ladder.at(count - 1), settings, pass)?;
            let settled = reseed(scene, grown, settings, pass)?;
            ladder.offer(settled);
            let gain = ladder.fitness(count) - ladder.fitness(count - 1); // ΔF = F_p - F_(p-1)
            if 1 < count && count <= top && gain < settings.delta {
                top = count - 1;
            }
            done += 1;
            report(&ladder, count.min(top), done, fits, progress)?;
            count += 1;
        }
        while count > 2 {
            count -= 1;
            ladder.offer(drop_one(scene, ladder.at(count)));
            done += 1;
            report(&ladder, (count - 1).min(top), done, fits, progress)?;
        }
    }
    ladder.truncate(top);
    Ok(ladder)
}

fn report(
    ladder: &Ladder,
    count: usize,
    done: usize,
    fits: usize,
    progress: &mut (dyn FnMut(usize, f64, f64) -> bool + Send),
) -> Result<(), ModelError> {
    let share = (done as f64 / fits as f64).min(1.0);
    if progress(count, ladder.fitness(count), share) { Ok(()) } else { Err(ModelError::Stopped) }
}
