use rand::RngExt;

use super::{Individual, Rng};

/// Selects the best of `rivals` individuals drawn at random.
///
/// Source: Goldberg, Deb, *A comparative analysis of selection schemes used in genetic algorithms*
/// (1991).
pub(super) fn tournament<'a>(
    population: &'a [Individual],
    rivals: usize,
    rng: &mut Rng,
) -> &'a Individual {
    let mut winner = &population[rng.random_range(0..population.len())];
    for _ in 1..rivals {
        let rival = &population[rng.random_range(0..population.len())];
        if rival.score > winner.score {
            winner = rival;
        }
    }
    winner
}

/// Draws each gene of a child from the range of its parents' genes, widened by `reach` of its
/// length on both sides (BLX-α).
///
/// Source: Eshelman, Schaffer, *Real-coded genetic algorithms and interval-schemata* (1993).
pub(super) fn blend(child: &mut [f64], one: &[f64], two: &[f64], reach: f64, rng: &mut Rng) {
    for (gene, (&a, &b)) in child.iter_mut().zip(one.iter().zip(two)) {
        let (low, high) = (a.min(b), a.max(b));
        let share = (1.0 + 2.0 * reach) * rng.random::<f64>() - reach;
        *gene = low + share * (high - low);
    }
}

/// Adds Gaussian steps of `width` times a gene's range to about `rate` of the genes.
///
/// Source: Bäck, Schwefel, *An overview of evolutionary algorithms for parameter optimization*
/// (1993).
pub(super) fn mutate(
    genes: &mut [f64],
    ranges: &[(f64, f64)],
    width: f64,
    rate: f64,
    rng: &mut Rng,
) {
    for (gene, &(low, high)) in genes.iter_mut().zip(ranges) {
        if rng.random::<f64>() < rate {
            *gene += width * (high - low) * gaussian(rng);
        }
    }
}

/// Reflects genes that left their ranges at the border.
pub(super) fn reflect(genes: &mut [f64], ranges: &[(f64, f64)]) {
    for (gene, &(low, high)) in genes.iter_mut().zip(ranges) {
        let over = if *gene < low { 2.0 * low - *gene } else { *gene };
        let back = if over > high { 2.0 * high - over } else { over };
        *gene = back.clamp(low, high);
    }
}

/// Draws a number from the standard normal distribution (Box, Muller 1958).
fn gaussian(rng: &mut Rng) -> f64 {
    let radius = (-2.0 * libm::log(1.0 - rng.random::<f64>())).sqrt();
    radius * libm::cos(std::f64::consts::TAU * rng.random::<f64>())
}
