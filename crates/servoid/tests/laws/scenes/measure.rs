//! Measures the scenes again, and updates their bounds.

#![allow(clippy::print_stdout, reason = "it tells what it measured")]

use std::panic::catch_unwind;
use std::path::Path;
use std::{env, fs, process};

use rayon::prelude::*;

use super::table::{MARGIN, Row, SEEDS, written};
use super::{Figures, ROWS, Scene, all};

/// Number of seeds that are reported, the worst first.
const LISTED: usize = 4;

/// Returns the scenes whose names begin with one of the comma-separated words of `SERVOID_SCENES`;
/// all if it is not set.
fn chosen() -> Vec<&'static Scene> {
    let starts = env::var("SERVOID_SCENES").unwrap_or_default();
    let starts: Vec<_> = starts.split(',').map(str::trim).collect();
    let scenes: Vec<_> =
        all().filter(|scene| starts.iter().any(|start| scene.name.starts_with(start))).collect();
    assert!(!scenes.is_empty(), "no scene begins with any of {starts:?}");
    scenes
}

/// Runs a scene with each seed; returns those that fail.
fn run(scene: &Scene, seeds: usize) -> Option<Vec<Figures>> {
    let one = |seed: usize| {
        let figures = catch_unwind(|| scene.figures(seed as u64));
        figures.inspect_err(|_| println!("{}: seed {seed} fails", scene.name)).ok()
    };
    (0..seeds).into_par_iter().map(one).collect::<Vec<_>>().into_iter().collect()
}

fn measured(scene: &Scene, runs: &[Figures]) -> Vec<Row> {
    let row = |(at, (measure, unit, sense)): (usize, &(&str, &str, _))| {
        let values: Vec<f64> = runs.iter().map(|figures| figures[at].1).collect();
        let before = ROWS.iter().find(|row| row.names() == (scene.name, measure));
        let margin = before.map_or(MARGIN, |row| row.margin);
        let row = Row::new([scene.name, measure, unit], *sense, &values, margin);
        report(&row, &values, before);
        row
    };
    scene.measures.iter().enumerate().map(row).collect()
}

fn report(row: &Row, values: &[f64], before: Option<&Row>) {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| (values[*a] - row.worst).abs().total_cmp(&(values[*b] - row.worst).abs()));
    let seed = |at: &usize| format!("{at}: {:.3}", values[*at]);
    let seeds: Vec<_> = order.iter().take(LISTED).map(seed).collect();
    let had = before.map_or("new".to_owned(), |row| format!("before {}", row.bound));
    let Row { scene, measure, unit, sense, median, bound, .. } = row;
    let seeds = seeds.join(", ");
    println!(
        "{scene}: {measure} {sense} {bound} {unit} ({had}); median {median}, worst by seed {seeds}"
    );
}

/// Writes the whole table or nothing.
fn write(rows: &[Row]) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenes.tsv");
    let beside = path.with_extension(format!("{}.tmp", process::id()));
    fs::write(&beside, written(rows)).unwrap();
    fs::rename(beside, path).unwrap();
}

#[test]
#[ignore = "takes minutes: it measures the bounds that the laws read"]
fn measure_the_scenes_over_many_seeds() {
    let seeds = env::var("SERVOID_SEEDS").map_or(SEEDS, |count| count.parse().unwrap());
    let (mut new, mut failed) = (vec![], vec![]);
    for scene in chosen() {
        match run(scene, seeds) {
            Some(runs) => new.extend(measured(scene, &runs)),
            None => failed.push(scene.name),
        }
    }
    assert!(failed.is_empty(), "the table stays as it was, as these fail: {failed:?}");
    assert!(seeds >= SEEDS, "the table stays as it was: {seeds} seeds are too few, of {SEEDS}");
    let declared = |row: &&Row| {
        all().any(|scene| {
            let known = scene.measures.iter().any(|(measure, ..)| *measure == row.measure);
            scene.name == row.scene && known
        })
    };
    let old = ROWS.iter().filter(declared);
    let kept = old.filter(|row| new.iter().all(|one: &Row| one.names() != row.names())).cloned();
    let rows: Vec<_> = kept.chain(new.iter().cloned()).collect();
    write(&rows);
}
