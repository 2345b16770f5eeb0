use crate::parallel::*;

use super::grow::refine_finest;
use super::refine::{Fit, Objective};
use crate::camera::View;
use crate::model::progressive::Step;
use crate::model::scene::{Scene, silhouette_ious};
use crate::model::{ModelError, Settings};

/// The best body for each number of ellipsoids, starting with one.
#[derive(Clone, Default)]
pub(in crate::model) struct BestByCount {
    fits: Vec<Fit>,
    /// The body without ellipsoids.
    empty: Fit,
}

impl BestByCount {
    /// Returns the best body of a count; beyond the last count, that of the last.
    pub fn at(&self, count: usize) -> &Fit {
        let best = self.fits.get(count.min(self.fits.len()).wrapping_sub(1));
        if count == 0 { &self.empty } else { best.unwrap_or(&self.empty) }
    }

    pub fn fitness(&self, count: usize) -> f64 {
        self.at(count).fitness
    }

    /// Returns the greatest count.
    pub fn max_count(&self) -> usize {
        self.fits.len()
    }

    /// Returns the best body of the greatest count.
    pub fn top(&self) -> &Fit {
        self.at(self.fits.len())
    }

    /// Stores a body if it is the best of its count.
    pub fn offer(&mut self, fit: Fit) {
        let count = fit.quadrics.len();
        if count == self.fits.len() + 1 {
            self.fits.push(fit);
        } else if let Some(best) = self.fits.get_mut(count.wrapping_sub(1))
            && fit.worth > best.worth
        {
            *best = fit;
        }
    }

    /// Merges two sets, keeping the better body of each count.
    pub fn merge(&mut self, other: &Self) {
        other.fits.iter().for_each(|fit| self.offer(fit.clone()));
    }

    /// Returns whether an ellipsoid too many has been added: ΔF = F_p - F_(p-1) < δ.
    pub fn stops_at(&self, count: usize, settings: &Settings) -> bool {
        let gain = (self.fitness(count) - self.fitness(count - 1)).max(0.0); // ΔF
        count > 1 && gain < settings.delta
    }

    /// Truncates at the greatest count whose last ellipsoid is worth its cost.
    pub fn cut(&mut self, settings: &Settings) {
        let last = (2..=self.fits.len()).find(|&count| self.stops_at(count, settings));
        let last = last.map_or(self.fits.len(), |count| count - 1);
        self.fits.truncate(last);
    }

    /// Truncates at a count.
    pub fn truncate(&mut self, count: usize) {
        self.fits.truncate(count);
    }

    /// Transforms the bodies to the world. If by its pixels a body is worse than the one before,
    /// contradicting the finest level, it is replaced by the one before with a hidden ellipsoid
    /// added.
    pub fn steps(
        &self,
        scene: &Scene,
        finest: &Objective,
        views: &[View<'_>],
    ) -> Result<Vec<Step>, ModelError> {
        let mut steps = Vec::with_capacity(self.fits.len());
        let (mut current, mut reached) = (self.empty.clone(), 0.0);
        let refined: Vec<_> = self.fits.par_iter().map(|fit| refine_finest(finest, fit)).collect();
        for mut fit in refined {
            let mut body = scene.body(&fit.quadrics)?;
            let mut overlap = mean(&silhouette_ious(&body, views));
            if overlap < reached || fit.fitness < current.fitness {
                fit = current.echo(finest);
                body = scene.body(&fit.quadrics)?;
                overlap = reached;
            }
            steps.push(Step { body, fitness: fit.fitness });
            (current, reached) = (fit, overlap);
        }
        Ok(steps)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}
