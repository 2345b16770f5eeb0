use super::progressive::grow::add_one;
use super::progressive::refine::{Fit, refine};
use super::scene::Scene;
use super::{ModelError, ModelInput, Settings};
use crate::pose::Pose;
use crate::shape::{Ellipsoid, Quadric};

/// Steps of an ascent that fits all ellipsoids together.
const STEPS: usize = 60;
/// Loss of fitness up to which an ellipsoid is removed.
const WORTHLESS: f64 = 5e-4;

/// Evolves the ellipsoids of an object in its own frame, in which all evidence is given: fits them
/// to the current evidence, removes those that do not contribute, and adds one where that gains δ.
/// The frame does not move.
///
/// # Errors
/// If a setting or a weight is out of its range, or no evidence is left.
pub fn evolved(
    given: &ModelInput<'_>,
    ellipsoids: &[Ellipsoid],
    settings: &Settings,
) -> Result<Vec<Ellipsoid>, ModelError> {
    let settings = settings.checked()?.quick();
    given.weights.check()?;
    let reach = |e: &Ellipsoid| e.center().norm() + e.radii().max();
    let unit = ellipsoids.iter().map(reach).fold(f64::MIN_POSITIVE, f64::max);
    let scene = Scene::in_frame(given, Pose::identity(), unit)?;
    let shrunk = |e: &Ellipsoid| e.transformed(&Pose::identity(), 1.0 / unit).quadric();
    let start: Vec<Quadric> = ellipsoids.iter().map(shrunk).collect();
    let mut fit = lean(&scene, refine(&scene.middle, &start, STEPS));
    if fit.quadrics.len() < settings.max_ellipsoids {
        let grown = add_one(&scene, &fit, &settings, 0)?;
        let grown = refine(&scene.middle, &grown.quadrics, STEPS);
        if grown.fitness >= fit.fitness + settings.delta {
            fit = grown;
        }
    }
    Ok(scene.ellipsoids(&fit.quadrics))
}

/// Removes ellipsoids as long as the others fit as well without.
fn lean(scene: &Scene, mut fit: Fit) -> Fit {
    while fit.quadrics.len() > 1 {
        let without = |gone: usize| refine(&scene.middle, &fit.without(&[gone]), STEPS / 4);
        let tried = (0..fit.quadrics.len()).map(without);
        let Some(best) = tried.max_by(|a, b| a.fitness.total_cmp(&b.fitness)) else { break };
        if best.fitness < fit.fitness - WORTHLESS {
            break;
        }
        fit = best;
    }
    fit
}
