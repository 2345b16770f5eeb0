//! A bank of Kalman filters: interacting multiple models (IMM), with correlated measurement errors.

use super::MotionError;
use super::measurement::{Measurement, Noise, PARTS, fits};
use super::motion_model::{MotionPrior, white_jerk};
use crate::pose::exact::{Rows, dot};

/// What each part of a state becomes, or its covariance, for one coordinate.
type Parts = [[f64; PARTS]; PARTS];

/// A prediction of the mixture of all filters.
#[derive(Debug, Clone, PartialEq)]
pub struct Mixture {
    /// Offset, speed, acceleration and shared error, n each.
    pub state: Vec<f64>,
    /// Its covariance, 4 n x 4 n by rows.
    pub covariance: Vec<f64>,
}

#[derive(Debug, Clone)]
struct Filter {
    state: Vec<f64>,
    covariance: Rows,
}

/// n coordinates, their speed and acceleration, and the shared error of estimates.
///
/// Kalman filters, one for rest and one for each motion model, are weighted by their likelihood:
/// interacting multiple models. The state of each is (offset, speed, acceleration, shared error of
/// estimates), and offsets are relative to a reference that [`Motion::settle`] moves.
///
/// Source: Blom and Bar-Shalom, *The interacting multiple model algorithm for systems with Markovian
/// switching coefficients* (1988).
#[derive(Debug, Clone)]
pub struct Motion {
    prior: MotionPrior,
    noise: Noise,
    weights: Vec<f64>,
    filters: Vec<Filter>,
}

impl Motion {
    /// Starts with an estimate at the reference, and the initial standard deviations of speed and
    /// acceleration.
    #[must_use]
    pub fn new(prior: MotionPrior, noise: Noise, [speed, acceleration]: [f64; 2]) -> Self {
        let (n, modes) = (noise.fresh.columns, 1 + prior.models.len());
        let lasting = noise.lasting * noise.lasting;
        let filter = |mode: usize| {
            let mut covariance = Rows::zeros(PARTS * n, PARTS * n);
            for row in 0..n {
                for column in 0..n {
                    *covariance.at_mut(row, column) = noise.fresh.at(row, column);
                }
                *covariance.at_mut(row, row) += lasting;
                *covariance.at_mut(row, 3 * n + row) = -lasting;
                *covariance.at_mut(3 * n + row, row) = -lasting;
                *covariance.at_mut(3 * n + row, 3 * n + row) = lasting;
                if mode > 0 {
                    *covariance.at_mut(n + row, n + row) = speed * speed;
                    *covariance.at_mut(2 * n + row, 2 * n + row) = acceleration * acceleration;
                }
            }
            Filter { state: vec![0.0; PARTS * n], covariance }
        };
        let filters = (0..modes).map(filter).collect();
        Self { prior, noise, weights: vec![1.0 / modes as f64; modes], filters }
    }

    /// Returns the number of coordinates.
    #[must_use]
    pub fn coordinates(&self) -> usize {
        self.noise.fresh.columns
    }

    /// Returns the probability of motion, 0 to 1.
    #[must_use]
    pub fn going(&self) -> f64 {
        self.weights[1..].iter().sum()
    }

    /// Predicts the state at a time after the newest estimate.
    #[must_use]
    pub fn ahead(&self, span_s: f64) -> Mixture {
        let n = self.coordinates();
        let steps = self.steps(span_s).into_iter().zip(&self.filters);
        let moved: Vec<Filter> = steps.map(|(step, filter)| filter.moved(n, &step)).collect();
        let Filter { state, covariance } = joined(&self.weights, &moved);
        Mixture { state, covariance: covariance.numbers }
    }

    /// Advances all filters to the time of an estimate with the given noise.
    ///
    /// # Errors
    /// If the noise is of another number of coordinates.
    pub fn advance(&mut self, elapsed_s: f64, noise: Noise) -> Result<(), MotionError> {
        let n = self.coordinates();
        fits("the covariance of an estimate", n * n, noise.fresh.numbers.len())?;
        self.noise = noise;
        self.mix(elapsed_s);
        for (step, filter) in self.steps(elapsed_s).into_iter().zip(&mut self.filters) {
            *filter = filter.moved(n, &step);
        }
        Ok(())
    }

    /// Corrects by a measurement, given as its offset, k numbers, from the value at the reference.
    ///
    /// Returns the normalised innovation squared (NIS) of the filter that fits better; beyond
    /// `nis_gate` the measurement is down-weighted.
    ///
    /// # Errors
    /// If the measurement is of another motion or has no axis, its offset is not finite, or its
    /// covariance not positive and finite; the motion is then unchanged.
    pub fn correct(
        &mut self,
        measurement: &Measurement,
        offset: &[f64],
        nis_gate: f64,
    ) -> Result<f64, MotionError> {
        let Measurement { matrix, spread } = measurement;
        fits("a measurement", PARTS * self.coordinates(), matrix.columns)?;
        fits("the offset of a measurement", matrix.count(), offset.len())?;
        if offset.is_empty() {
            return Err(MotionError::NoAxis);
        }
        if let Some(&bad) = offset.iter().find(|x| !x.is_finite()) {
            return Err(MotionError::NotFinite(bad));
        }
        let across = matrix.transposed();
        let seen: Vec<Seen> =
            self.filters.iter().map(|filter| Seen::of(filter, matrix, &across, offset)).collect();
        let mut nis = f64::INFINITY;
        for seen in &seen {
            let whole = seen.known.clone().plus(spread);
            log_determinant(&whole)?; // checks it
            nis = seen.squared(&whole)?.min(nis);
        }
        let spread = spread.scaled((nis / nis_gate).max(1.0));
        let (mut scores, mut corrected) = (Vec::new(), Vec::new());
        for (filter, seen) in self.filters.iter().zip(&seen) {
            let whole = seen.known.clone().plus(&spread);
            scores.push(-0.5 * (seen.squared(&whole)? + log_determinant(&whole)?));
            corrected.push(filter.corrected(seen, &whole)?);
        }
        let most = scores.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (weight, score) in self.weights.iter_mut().zip(&scores) {
            *weight *= libm::exp(score - most);
        }
        let sum: f64 = self.weights.iter().sum();
        for weight in &mut self.weights {
            *weight /= sum;
        }
        self.filters = corrected;
        Ok(nis)
    }

    /// Adds a covariance, n x n by rows, to that of the offset.
    ///
    /// # Errors
    /// If it is of another number of coordinates.
    pub fn inflate(&mut self, unknown: &[f64]) -> Result<(), MotionError> {
        let n = self.coordinates();
        fits("an added covariance", n * n, unknown.len())?;
        for Filter { covariance, .. } in &mut self.filters {
            for (row, values) in unknown.chunks_exact(n).enumerate() {
                for (column, value) in values.iter().enumerate() {
                    *covariance.at_mut(row, column) += value;
                }
            }
        }
        Ok(())
    }

    /// Moves the reference to the estimated position, and returns the shift of n coordinates.
    pub fn settle(&mut self) -> Vec<f64> {
        let n = self.coordinates();
        let mut moved = vec![0.0; n];
        for (weight, filter) in self.weights.iter().zip(&self.filters) {
            for (sum, value) in moved.iter_mut().zip(&filter.state[..n]) {
                *sum += weight * value;
            }
        }
        for filter in &mut self.filters {
            for (value, shift) in filter.state.iter_mut().zip(&moved) {
                *value -= shift;
            }
        }
        moved
    }

    /// Mixes the filters' states by the transition probabilities.
    fn mix(&mut self, elapsed_s: f64) {
        let others = (self.weights.len() - 1) as f64;
        if others == 0.0 {
            return;
        }
        let mut changed = -libm::expm1(-(1.0 + 1.0 / others) * elapsed_s / self.prior.change_s);
        changed /= 1.0 + others;
        let before = &self.weights;
        // The share of the mass of mode `from` that goes to mode `to`.
        let share = |from: usize, to: usize| {
            before[from] * if from == to { 1.0 - others * changed } else { changed }
        };
        let modes = 0..before.len();
        let weights: Vec<f64> = modes
            .clone()
            .map(|to| modes.clone().fold(0.0, |sum, from| sum + share(from, to)))
            .collect();
        let filters = modes
            .clone()
            .map(|to| {
                let shares: Vec<f64> =
                    modes.clone().map(|from| share(from, to) / weights[to]).collect();
                joined(&shares, &self.filters)
            })
            .collect();
        self.weights = weights;
        self.filters = filters;
    }

    /// Returns transition and process noise of each filter, for one coordinate.
    fn steps(&self, span_s: f64) -> Vec<(Parts, Parts)> {
        let (prior, noise) = (&self.prior, &self.noise);
        let left = libm::exp(-span_s / noise.fading_s);
        let comes = -libm::expm1(-2.0 * span_s / prior.lasting_s) * noise.lasting * noise.lasting;
        let jerked = white_jerk(span_s);
        let step = |moved: [[f64; 3]; 3], driven: [[f64; 3]; 3]| {
            let whole = |part: [[f64; 3]; 3], last: f64| {
                let mut out = [[0.0; PARTS]; PARTS];
                for (row, values) in out.iter_mut().zip(part) {
                    row[..3].copy_from_slice(&values);
                }
                out[3][3] = last;
                out
            };
            (whole(moved, left), whole(driven, comes))
        };
        let (mut kept, mut walked) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
        kept[0][0] = 1.0;
        walked[0][0] = prior.rest * prior.rest * span_s;
        let models = prior.models.iter().map(|model| {
            let square = model.jerk() * model.jerk();
            step(model.moved(span_s), jerked.map(|row| row.map(|x| square * x)))
        });
        std::iter::once(step(kept, walked)).chain(models).collect()
    }
}

impl Filter {
    /// Returns the filter after a step, of which transition and process noise are those of each of
    /// n coordinates.
    fn moved(&self, n: usize, (step, drive): &(Parts, Parts)) -> Self {
        let size = PARTS * n;
        let (mut state, mut half) = (vec![0.0; size], Rows::zeros(size, size));
        for (part, factors) in step.iter().enumerate() {
            for (from, &factor) in factors.iter().enumerate().filter(|(_, factor)| **factor != 0.0)
            {
                for i in 0..n {
                    let (to, from) = (part * n + i, from * n + i);
                    state[to] += factor * self.state[from];
                    let values = &self.covariance.numbers[from * size..(from + 1) * size];
                    let sums = &mut half.numbers[to * size..(to + 1) * size];
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += factor * value;
                    }
                }
            }
        }
        let mut covariance = Rows::zeros(size, size);
        let rows = covariance.numbers.chunks_exact_mut(size).zip(half.each());
        for (row, (sums, values)) in rows.enumerate() {
            for (part, factors) in step.iter().enumerate() {
                for (from, &factor) in factors.iter().enumerate().filter(|(_, f)| **f != 0.0) {
                    for i in 0..n {
                        sums[part * n + i] += values[from * n + i] * factor;
                    }
                }
                sums[part * n + row % n] += drive[row / n][part];
            }
        }
        Self { state, covariance }
    }

    fn corrected(&self, seen: &Seen, whole: &Rows) -> Result<Self, MotionError> {
        let gain = solved(whole, &seen.shared)?.transposed();
        let mut state = self.state.clone();
        for (value, change) in state.iter_mut().zip(gain.times_vector(&seen.gap)) {
            *value += change;
        }
        let taken = gain.times(&seen.shared);
        let mut left = self.covariance.clone();
        for (value, taken) in left.numbers.iter_mut().zip(&taken.numbers) {
            *value -= taken;
        }
        let even = left.transposed();
        for (value, other) in left.numbers.iter_mut().zip(&even.numbers) {
            *value = 0.5 * (*value + other);
        }
        Ok(Self { state, covariance: left })
    }
}

/// A measurement as a filter sees it.
struct Seen {
    gap: Vec<f64>,
    /// Covariance of the measured value and the state, k x 4 n.
    shared: Rows,
    /// Covariance of the predicted value, k x k.
    known: Rows,
}

impl Seen {
    fn of(filter: &Filter, matrix: &Rows, across: &Rows, offset: &[f64]) -> Self {
        let expected = matrix.times_vector(&filter.state);
        let shared = matrix.times(&filter.covariance);
        let known = shared.times(across);
        let gap = offset.iter().zip(expected).map(|(seen, expected)| seen - expected).collect();
        Self { gap, shared, known }
    }

    /// Returns the innovation squared, normalised by its covariance.
    fn squared(&self, covariance: &Rows) -> Result<f64, MotionError> {
        let gap = Rows { numbers: self.gap.clone(), columns: 1 };
        Ok(dot(&self.gap, &solved(covariance, &gap)?.numbers))
    }
}

/// Returns mean and covariance of a mixture of Gaussians.
fn joined(weights: &[f64], filters: &[Filter]) -> Filter {
    let size = filters[0].state.len();
    let (mut state, mut covariance) = (vec![0.0; size], Rows::zeros(size, size));
    for (weight, filter) in weights.iter().zip(filters) {
        for (sum, value) in state.iter_mut().zip(&filter.state) {
            *sum += weight * value;
        }
        for (sum, value) in covariance.numbers.iter_mut().zip(&filter.covariance.numbers) {
            *sum += weight * value;
        }
    }
    let mut apart = Rows::zeros(size, size);
    for (weight, filter) in weights.iter().zip(filters) {
        let gaps: Vec<f64> = filter.state.iter().zip(&state).map(|(x, mean)| x - mean).collect();
        for (sums, gap) in apart.numbers.chunks_exact_mut(size).zip(&gaps) {
            let factor = weight * gap;
            for (sum, other) in sums.iter_mut().zip(&gaps) {
                *sum += factor * other;
            }
        }
    }
    Filter { state, covariance: covariance.plus(&apart) }
}

fn solved(matrix: &Rows, right: &Rows) -> Result<Rows, MotionError> {
    matrix.solve(right).ok_or(MotionError::Innovation(0.0))
}

fn log_determinant(matrix: &Rows) -> Result<f64, MotionError> {
    if !matrix.numbers.iter().all(|x| x.is_finite()) {
        return Err(MotionError::Innovation(f64::NAN));
    }
    let (values, _) = matrix.symmetric_eigen().ok_or(MotionError::Innovation(f64::NAN))?;
    if let Some(&least) = values.first().filter(|least| **least <= 0.0) {
        return Err(MotionError::Innovation(least));
    }
    Ok(values.into_iter().fold(0.0, |sum, value| sum + libm::log(value)))
}
