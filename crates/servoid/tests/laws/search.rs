//! Laws of the genetic algorithm and of the gradient ascent.

use crate::scenes::{holds, holds_for};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use servoid::evolve::{ClimbSettings, Ga, GaError, GaSettings, climb, rng};

const RANGES: [(f64, f64); 6] = [(-2.0, 3.0); 6];

fn hill(genes: &[f64]) -> f64 {
    -genes.iter().enumerate().map(|(i, x)| (x - 0.3 * i as f64).powi(2)).sum::<f64>()
}

pub fn evolved(seed: u64, generations: usize) -> (Ga, Vec<f64>) {
    let mut ga = Ga::new(&RANGES, GaSettings::default(), rng(seed, 0)).unwrap();
    let mut best = vec![];
    for _ in 0..generations {
        let scores: Vec<f64> = ga.ask().iter().map(|i| hill(&i.genes)).collect();
        ga.tell(&scores).unwrap();
        best.push(ga.best().score);
    }
    (ga, best)
}

#[test]
fn the_same_seed_breeds_the_same_bits_and_another_seed_does_not() {
    let bits = |seed| -> Vec<u64> {
        evolved(seed, 20).0.ask().iter().flat_map(|i| i.genes.clone()).map(f64::to_bits).collect()
    };
    assert_eq!(bits(7), bits(7));
    assert_ne!(bits(7), bits(8));
    assert_ne!(rng(7, 0), rng(7, 1));
}

#[test]
fn the_elite_never_gets_worse_and_finds_the_summit() {
    holds_for("search of a summit", 0..5);
}

#[test]
fn genes_stay_in_their_ranges() {
    let ranges = [(0.0, 1e-3), (-5.0, -4.0), (2.0, 2.0)];
    let mut ga = Ga::new(&ranges, GaSettings::default(), rng(1, 1)).unwrap();
    for _ in 0..30 {
        for individual in ga.ask() {
            let inside = |(x, r): (&f64, &(f64, f64))| (r.0..=r.1).contains(x);
            assert!(individual.genes.iter().zip(&ranges).all(inside), "{individual:?}");
        }
        let scores: Vec<f64> = ga.ask().iter().map(|i| i.genes[0] - i.genes[1]).collect();
        ga.tell(&scores).unwrap();
    }
}

#[test]
fn a_score_that_is_no_number_counts_as_the_worst() {
    let mut ga = Ga::new(&RANGES, GaSettings::default(), rng(3, 0)).unwrap();
    let mut scores = vec![f64::NAN; ga.ask().len()];
    scores[11] = -1e300;
    let genes = ga.ask()[11].genes.clone();
    ga.tell(&scores).unwrap();
    assert_eq!(ga.best().genes, genes);
}

/// Scores a generation with decreasing scores as given, and returns its genes.
fn scored(settings: GaSettings, scores: &[f64]) -> (Ga, Vec<Vec<f64>>) {
    let mut ga = Ga::new(&RANGES, settings, rng(4, 0)).unwrap();
    let genes = ga.ask().iter().map(|one| one.genes.clone()).collect();
    ga.tell(scores).unwrap();
    (ga, genes)
}

proptest! {
    #[test]
    fn the_best_live_on_in_order_and_of_equals_the_first(
        scores in prop::collection::vec((-3..4_i32).prop_map(f64::from), 30),
    ) {
        let settings = GaSettings::default().with(|it| { it.population = 30; it.elites = 7; });
        let (ga, genes) = scored(settings, &scores);
        let mut order: Vec<usize> = (0..30).collect();
        order.sort_by(|a, b| scores[*b].total_cmp(&scores[*a]));
        for (elite, at) in ga.ask().iter().zip(&order[..7]) {
            prop_assert_eq!((&elite.genes, elite.score), (&genes[*at], scores[*at]));
        }
        prop_assert_eq!(&ga.best().genes, &genes[order[0]]);
    }

    #[test]
    fn a_population_moves_in_order_and_stays_in_its_ranges(by in -30.0..30.0_f64) {
        let (mut ga, _) = scored(GaSettings::default(), &[1.0; 48]);
        let before: Vec<_> = ga.ask().to_vec();
        let mut next = 0;
        ga.move_each(|index, genes| {
            assert_eq!((index, genes[0]), (next, before[next].genes[0]));
            next += 1;
            genes.iter_mut().for_each(|gene| *gene += by);
        });
        prop_assert_eq!(next, before.len());
        for (moved, one) in ga.ask().iter().zip(&before) {
            for (x, y) in moved.genes.iter().zip(&one.genes) {
                prop_assert!((-2.0..=3.0).contains(x));
                prop_assert!(!(-2.0..=3.0).contains(&(y + by)) || (x - y - by).abs() < 1e-9);
            }
            prop_assert_eq!(moved.score, one.score);
        }
    }
}

#[test]
fn populations_that_cannot_breed_are_refused() {
    let made = |settings| Ga::new(&RANGES, settings, rng(0, 0)).map(|_| ());
    let normal = GaSettings::default();
    for settings in [
        normal.with(|it| it.population = 1),
        normal.with(|it| it.elites = normal.population),
        normal.with(|it| it.rivals = 0),
        normal.with(|it| it.mutation_rate = f64::NAN),
        normal.with(|it| it.mutation_width = -0.1),
        normal.with(|it| it.least_width = 0.6),
        normal.with(|it| it.blend_reach = 5.0),
    ] {
        assert!(matches!(made(settings), Err(GaError::Setting { .. })), "{settings:?}");
    }
    for range in [(1.0, 0.0), (0.0, f64::INFINITY), (f64::NAN, 1.0)] {
        let refused = Ga::new(&[(0.0, 1.0), range], normal, rng(0, 0));
        assert!(matches!(refused, Err(GaError::Range { gene: 1, .. })));
    }
    let mut ga = Ga::new(&RANGES, normal, rng(0, 0)).unwrap();
    let expected = ga.ask().len();
    assert_eq!(ga.tell(&[0.0; 3]), Err(GaError::Scores { expected, given: 3 }));
}

const CLIMB: ClimbSettings = ClimbSettings::new(200, 0.1, 0.0);

proptest! {
    #[test]
    fn a_climb_reaches_the_summit_of_a_quadratic(
        entries in prop::collection::vec(-1.0..1.0_f64, 25), start in prop::collection::vec(-3.0..3.0_f64, 5),
    ) {
        let root = DMatrix::from_vec(5, 5, entries);
        let bowl = &root * root.transpose() + DMatrix::identity(5, 5) * 0.1;
        let summit = DVector::from_vec(vec![0.5, -1.0, 2.0, 0.0, 1.0]);
        let found = climb(&start, &CLIMB, |at, uphill| {
            let off = DVector::from_column_slice(at) - &summit;
            uphill.copy_from_slice((-(&bowl * &off)).as_slice());
            -0.5 * off.dot(&(&bowl * &off))
        });
        prop_assert!(found.score > -1e-6, "{found:?}");
    }

    #[test]
    fn a_climb_never_ends_below_its_start(start in prop::collection::vec(-3.0..3.0_f64, 3), seed in 0.1..9.0_f64) {
        let rough = |at: &[f64]| at.iter().map(|x| (seed * x).sin() - 0.3 * x.abs()).sum::<f64>();
        let found = climb(&start, &CLIMB, |at, uphill| {
            for (slope, x) in uphill.iter_mut().zip(at) {
                *slope = seed * (seed * x).cos() - 0.3 * x.signum();
            }
            rough(at)
        });
        prop_assert!(found.score >= rough(&start) && found.score == rough(&found.at));
    }
}

#[test]
fn a_climb_without_a_usable_slope_stays_where_it_is() {
    for slope in [0.0, f64::NAN, f64::INFINITY] {
        let found = climb(&[1.0, 2.0], &CLIMB, |_, uphill| {
            uphill.fill(slope);
            5.0
        });
        assert_eq!((found.at, found.score), (vec![1.0, 2.0], 5.0));
    }
}

/// Returns the spread of a population on a plateau, where no child is better, so that the mutations
/// narrow as far as allowed.
pub fn spread(seed: u64, least_width: f64) -> f64 {
    let settings = GaSettings::default().with(|it| it.least_width = least_width);
    let mut ga = Ga::new(&[(-1.0, 1.0)], settings, rng(seed, 0)).unwrap();
    for _ in 0..200 {
        let scores: Vec<_> = ga.ask().iter().map(|one| -one.genes[0].abs().max(0.01)).collect();
        ga.tell(&scores).unwrap();
    }
    ga.ask().iter().map(|one| one.genes[0].abs()).fold(0.0, f64::max)
}

#[test]
fn a_mutation_is_never_narrower_than_the_least_width() {
    holds("search on a plateau");
}
