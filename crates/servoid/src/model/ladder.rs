use super::ModelError;
use super::progressive::Step;
use super::refine::Fit;
use super::scene::{Scene, silhouette_ious};
use crate::observe::View;

/// The best body of each count of ellipsoids; on the lowest rung there is none.
#[derive(Default)]
pub(super) struct Ladder {
    rungs: Vec<Fit>,
    ground: Fit,
}

impl Ladder {
    /// Gives the best body of a count; beyond the last, the last.
    pub fn at(&self, count: usize) -> &Fit {
        if count == 0 { &self.ground } else { self.rungs.get(count - 1).unwrap_or(&self.ground) }
    }

    pub fn fitness(&self, count: usize) -> f64 {
        self.at(count).fitness
    }

    /// Keeps a body if it is the best of its count.
    pub fn offer(&mut self, fit: Fit) {
        let count = fit.quadrics.len();
        if count == self.rungs.len() + 1 {
            self.rungs.push(fit);
        } else if let Some(rung) = self.rungs.get_mut(count.wrapping_sub(1)) {
            if fit.fitness > rung.fitness {
                *rung = fit;
            }
        }
    }

    /// Forgets all above a count.
    pub fn truncate(&mut self, top: usize) {
        self.rungs.truncate(top);
    }

    /// Carries the bodies to the world. Where counting pixels contradicts the finest level and a
    /// body is worse than that before it, it is replaced by the one before and an echo in it.
    pub fn steps(&self, scene: &Scene, views: &[View<'_>]) -> Result<Vec<Step>, ModelError> {
        let mut steps = Vec::with_capacity(self.rungs.len());
        let (mut standing, mut reached) = (self.ground.clone(), 0.0);
        for rung in &self.rungs {
            let (mut fit, mut body) = (rung.clone(), scene.body(&rung.quadrics)?);
            let mut overlap = mean(&silhouette_ious(&body, views));
            if overlap < reached || fit.fitness < standing.fitness {
                fit = standing.echo();
                body = scene.body(&fit.quadrics)?;
                overlap = reached;
            }
            steps.push(Step { body, fitness: fit.fitness });
            (standing, reached) = (fit, overlap);
        }
        Ok(steps)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
