use super::progressive::grow::add_to_known;
use super::progressive::refine::{Fit, Objective, refine};
use super::scene::{Scene, solids};
use super::{ModelError, ModelInput, Settings};
use crate::pose::Pose;
use crate::shape::{Ellipsoid, Quadric};

/// Steps of an ascent that fits all ellipsoids together.
const STEPS: usize = 60;
/// Loss of fitness up to which an ellipsoid is removed.
const WORTHLESS: f64 = 5e-4;

/// An attempt to add an ellipsoid that gained less than δ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Attempt {
    /// Fitness without it, and what it gained.
    fitness: f64,
    gain: f64,
}

impl Attempt {
    /// Returns whether another attempt may gain δ, now that the fitness without is another one: what
    /// the body lost since, the next ellipsoid can gain.
    fn may_gain(&self, delta: f64, fitness: f64) -> bool {
        self.gain + self.fitness - fitness >= delta
    }
}

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
    Ok(evolved_after(None, given, ellipsoids, settings)?.0)
}

/// Does the same after a last attempt to add an ellipsoid that was in vain, if there was one, but
/// makes no other that would be so, too; returns what is the last attempt in vain now.
pub(crate) fn evolved_after(
    vain: Option<Attempt>,
    given: &ModelInput<'_>,
    ellipsoids: &[Ellipsoid],
    settings: &Settings,
) -> Result<(Vec<Ellipsoid>, Option<Attempt>), ModelError> {
    let settings = settings.checked()?.quick();
    given.weights.check()?;
    let reach = |e: &Ellipsoid| e.center().norm() + e.radii().max();
    let unit = ellipsoids.iter().map(reach).fold(f64::MIN_POSITIVE, f64::max);
    let frame = Pose::identity();
    let middle = Scene::middle_in(given, &frame, unit)?;
    let found = |fit: &Fit| solids(&fit.quadrics, &frame, unit);
    let shrunk = |e: &Ellipsoid| e.transformed(&frame, 1.0 / unit).quadric();
    let start: Vec<Quadric> = ellipsoids.iter().map(shrunk).collect();
    let fit = lean(&middle, refine(&middle, &start, STEPS));
    let is_full = fit.quadrics.len() >= settings.max_ellipsoids;
    if is_full || vain.is_some_and(|vain| !vain.may_gain(settings.delta, fit.fitness)) {
        return Ok((found(&fit), vain));
    }
    let scene = Scene::around(middle, given, frame, unit)?;
    let grown = add_to_known(&scene, &fit, &settings)?;
    let grown = refine(&scene.middle, &grown.quadrics, STEPS);
    let gain = grown.fitness - fit.fitness;
    if gain >= settings.delta {
        return Ok((found(&grown), None));
    }
    Ok((found(&fit), Some(Attempt { fitness: fit.fitness, gain })))
}

/// Removes ellipsoids as long as the others fit as well without.
fn lean(objective: &Objective, mut fit: Fit) -> Fit {
    while fit.quadrics.len() > 1 {
        let without = |gone: usize| refine(objective, &fit.without(&[gone]), STEPS / 4);
        let tried = (0..fit.quadrics.len()).map(without);
        let Some(best) = tried.max_by(|a, b| a.fitness.total_cmp(&b.fitness)) else { break };
        if best.fitness < fit.fitness - WORTHLESS {
            break;
        }
        fit = best;
    }
    fit
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::{SyntheticView, half_ball_direction};
    use crate::shape::Body;

    const ONE: ([f64; 3], [f64; 3]) = ([0.0; 3], [0.09, 0.05, 0.04]);
    const OTHER: ([f64; 3], [f64; 3]) = ([0.03, 0.09, 0.02], [0.03, 0.05, 0.03]);

    fn solid((center, radii): ([f64; 3], [f64; 3])) -> Ellipsoid {
        Ellipsoid::new(0, center, radii, [0.9, 0.1, 0.3, 0.3]).unwrap()
    }

    /// Evolves ellipsoids by views of others from all around.
    fn evolve(
        seen: &[Ellipsoid],
        from: &[Ellipsoid],
        vain: Option<Attempt>,
    ) -> (Vec<Ellipsoid>, Option<Attempt>) {
        let body = Body::new(Pose::identity(), seen.to_vec()).unwrap();
        let around = (0..7).map(|i| half_ball_direction(i, 7));
        let synthetic = SyntheticView::of_body(&body, around).unwrap();
        let views: Vec<_> = synthetic.iter().map(|one| one.view().unwrap()).collect();
        let given = ModelInput { views: &views, ..ModelInput::default() };
        evolved_after(vain, &given, from, &Settings::default()).unwrap()
    }

    #[test]
    fn an_ellipsoid_that_was_not_needed_is_sought_again_only_once_the_body_fits_worse() {
        let (one, both) = ([solid(ONE)], [solid(ONE), solid(OTHER)]);
        let (same, vain) = evolve(&one, &one, None);
        assert!(same.len() == 1 && vain.is_some());
        for other in [vain, Some(Attempt { fitness: 0.5, gain: 0.0 })] {
            let (again, kept) = evolve(&one, &one, other);
            assert_eq!(again, same);
            assert_eq!(kept.map(|it| it.fitness), other.map(|it| it.fitness), "it was sought");
        }
        let (grown, kept) = evolve(&both, &one, vain);
        assert!(grown.len() > 1 && kept.is_none(), "another side shows more");
        let sure = Attempt { fitness: 2.0, gain: 0.0 };
        assert_eq!(evolve(&both, &one, Some(Attempt { fitness: 0.0, ..sure })).0.len(), 1);
        assert!(evolve(&both, &one, Some(sure)).0.len() > 1);
    }
}
