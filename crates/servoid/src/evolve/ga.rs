use rand::RngExt;

use super::{Rng, operators};
use crate::changing::changeable;

/// Settings of a genetic algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GaSettings {
    /// Individuals per generation.
    pub population: usize,
    /// Best individuals that survive unchanged.
    pub elites: usize,
    /// Individuals that compete to become a parent.
    pub rivals: usize,
    /// Share of the parents' range by which a child's range exceeds it.
    pub blend_reach: f64,
    /// Share of genes that mutate.
    pub mutation_rate: f64,
    /// Standard deviation of a mutation in the first generation, as a share of the gene's range.
    pub mutation_width: f64,
    /// Standard deviation below which success never narrows a mutation, as the same share.
    pub least_width: f64,
}

changeable!(GaSettings);

impl Default for GaSettings {
    fn default() -> Self {
        Self {
            population: 48,
            elites: 4,
            rivals: 3,
            blend_reach: 0.3,
            mutation_rate: 0.3,
            mutation_width: 0.15,
            least_width: 1e-4,
        }
    }
}

/// Why a population cannot be created or scored.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GaError {
    /// A setting is out of its range.
    #[error("{name} must be {allowed}, but it is {given}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// What is allowed.
        allowed: &'static str,
        /// What was given.
        given: f64,
    },
    /// A gene's range is empty or not finite.
    #[error("gene {gene}: its range must be finite and rise, but it is {range:?}")]
    Range {
        /// Which gene.
        gene: usize,
        /// Its range.
        range: (f64, f64),
    },
    /// There is not one score per individual.
    #[error("{expected} individuals need as many scores, but {given} were given")]
    Scores {
        /// Individuals.
        expected: usize,
        /// Scores.
        given: usize,
    },
}

/// A hypothesis and its score; before it is scored, that is minus infinity.
#[derive(Debug, PartialEq)]
pub struct Individual {
    /// Its numbers.
    pub genes: Vec<f64>,
    /// Its score: higher is better.
    pub score: f64,
}

impl Clone for Individual {
    fn clone(&self) -> Self {
        Self { genes: self.genes.clone(), score: self.score }
    }

    fn clone_from(&mut self, other: &Self) {
        self.genes.clone_from(&other.genes);
        self.score = other.score;
    }
}

/// A real-coded genetic algorithm with elitism (De Jong 1975), tournament selection, blend
/// crossover and Gaussian mutation whose width follows success (Rechenberg's one-fifth rule, 1973).
///
/// `ask` returns the individuals to score, `tell` takes the scores and breeds the next generation.
/// All individuals are scored each time, including the elites: a new image may change their scores.
/// One generation per image is the paper's 1-step GA.
#[derive(Debug, Clone)]
pub struct Ga {
    settings: GaSettings,
    ranges: Vec<(f64, f64)>,
    population: Vec<Individual>,
    /// Memory of the next generation, so that breeding allocates none.
    next: Vec<Individual>,
    best: Individual,
    width: f64,
    rng: Rng,
}

/// Growth of the mutation width after a success; it shrinks by the fourth root after a failure, so
/// it stays constant at one success in five.
const WIDTH_GROWTH: f64 = 1.22;
/// Largest population: all of it is in memory at once.
const MOST: usize = 100_000;
/// Widest mutation, as a share of the gene's range.
const WIDEST: f64 = 0.5;

impl Ga {
    /// Draws the first generation uniformly from the genes' ranges.
    ///
    /// # Errors
    /// If a setting is out of its range or a gene's range is empty or not finite.
    pub fn new(ranges: &[(f64, f64)], settings: GaSettings, mut rng: Rng) -> Result<Self, GaError> {
        check(ranges, &settings)?;
        let mut draw = || Individual {
            genes: ranges.iter().map(|&(low, high)| rng.random_range(low..=high)).collect(),
            score: f64::NEG_INFINITY,
        };
        let population: Vec<_> = (0..settings.population).map(|_| draw()).collect();
        Ok(Self {
            settings,
            ranges: ranges.to_vec(),
            best: population[0].clone(),
            next: population.clone(),
            population,
            width: settings.mutation_width,
            rng,
        })
    }

    /// Returns the individuals of this generation, to be scored in this order.
    #[must_use]
    pub fn ask(&self) -> &[Individual] {
        &self.population
    }

    /// Takes their scores and breeds the next generation. A score that is not a number counts as
    /// the worst.
    ///
    /// # Errors
    /// If there is not one score per individual.
    pub fn tell(&mut self, scores: &[f64]) -> Result<(), GaError> {
        let (expected, given) = (self.population.len(), scores.len());
        if expected != given {
            return Err(GaError::Scores { expected, given });
        }
        for (individual, &score) in self.population.iter_mut().zip(scores) {
            individual.score = if score.is_nan() { f64::NEG_INFINITY } else { score };
        }
        let elites = self.settings.elites;
        let champion = self.population[..elites].iter().map(|e| e.score).fold(f64::MIN, f64::max);
        sort(&mut self.population);
        let success = elites > 0 && self.population[0].score > champion;
        let factor = if success { WIDTH_GROWTH } else { libm::pow(WIDTH_GROWTH, -0.25) };
        self.width = (self.width * factor).clamp(self.settings.least_width, WIDEST);
        self.best.clone_from(&self.population[0]);
        self.breed();
        Ok(())
    }

    /// Returns the best individual of the generation that was scored last.
    #[must_use]
    pub fn best(&self) -> &Individual {
        &self.best
    }

    /// Moves the individuals that are scored next, in order, elites first: for a world that has
    /// moved since they were scored. A gene that leaves its range is reflected.
    pub fn move_each(&mut self, mut change: impl FnMut(usize, &mut [f64])) {
        for (index, individual) in self.population.iter_mut().enumerate() {
            change(index, &mut individual.genes);
            operators::reflect(&mut individual.genes, &self.ranges);
        }
    }

    fn breed(&mut self) {
        let Self { settings, ranges, population, next, width, rng, .. } = self;
        let (elites, children) = next.split_at_mut(settings.elites);
        elites.iter_mut().zip(&*population).for_each(|(place, elite)| place.clone_from(elite));
        for Individual { genes, score } in children {
            let one = operators::tournament(population, settings.rivals, rng);
            let two = operators::tournament(population, settings.rivals, rng);
            operators::blend(genes, &one.genes, &two.genes, settings.blend_reach, rng);
            operators::mutate(genes, ranges, *width, settings.mutation_rate, rng);
            operators::reflect(genes, ranges);
            *score = f64::NEG_INFINITY;
        }
        std::mem::swap(population, next);
    }
}

/// Sorts individuals by decreasing score, in place; the sort is stable.
fn sort(population: &mut [Individual]) {
    for end in 1..population.len() {
        let at = population[..end].partition_point(|other| other.score >= population[end].score);
        population[at..=end].rotate_right(1);
    }
}

impl GaSettings {
    /// Returns the settings if all are in their ranges.
    pub(crate) fn checked(self) -> Result<Self, GaError> {
        check(&[], &self)?;
        Ok(self)
    }
}

fn check(ranges: &[(f64, f64)], settings: &GaSettings) -> Result<(), GaError> {
    let GaSettings { population, elites, rivals, blend_reach, mutation_rate, .. } = *settings;
    let GaSettings { mutation_width, least_width, .. } = *settings;
    let bounded = |name, allowed, given: f64, fits: bool| {
        if fits { Ok(()) } else { Err(GaError::Setting { name, allowed, given }) }
    };
    let fits = (2..=MOST).contains(&population);
    bounded("population", "2 to 100000", population as f64, fits)?;
    bounded("elites", "below the population", elites as f64, elites < population)?;
    bounded("rivals", "at least 1", rivals as f64, rivals >= 1)?;
    bounded("blend_reach", "0 to 2", blend_reach, (0.0..=2.0).contains(&blend_reach))?;
    bounded("mutation_rate", "0 to 1", mutation_rate, (0.0..=1.0).contains(&mutation_rate))?;
    bounded("mutation_width", "0 to 1", mutation_width, (0.0..=1.0).contains(&mutation_width))?;
    bounded("least_width", "0 to 0.5", least_width, (0.0..=WIDEST).contains(&least_width))?;
    for (gene, &range) in ranges.iter().enumerate() {
        if !(range.0.is_finite() && range.1.is_finite() && range.0 <= range.1) {
            return Err(GaError::Range { gene, range });
        }
    }
    Ok(())
}
