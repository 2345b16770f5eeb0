//! Feeds the core with numbers that nobody should give it, drawn by a seed: nothing may panic, take
//! long, or return an impossible answer. `cargo test` runs the corpus and some inputs; with
//! SERVOID_FUZZ_SECONDS it continues for so many seconds, starting at SERVOID_FUZZ_SEED.

#![allow(
    clippy::disallowed_methods,
    clippy::unwrap_used,
    clippy::print_stderr,
    reason = "a test that cannot go on has failed, and one of hours says how far it is"
)]

mod draw;
mod poses;
mod scoring;
mod solids;
mod tracking;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use draw::Draw;

type Target = fn(&mut Draw) -> Result<(), String>;

/// The fuzz targets, and how many inputs of each a round takes: more for cheap ones.
const TARGETS: [(&str, Target, usize); 4] = [
    ("poses", poses::any, 40),
    ("scoring", scoring::any, 40),
    ("solids", solids::any, 10),
    ("tracking", tracking::any, 10),
];
/// Longest time that an input may take.
const LONGEST: Duration = Duration::from_secs(20);
/// Past findings: a target and a seed on each line.
const CORPUS: &str = include_str!("corpus.txt");

/// Runs a target; returns what is wrong with its answer, if anything is.
fn tried(name: &str, target: Target, seed: u64) -> Option<String> {
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| target(&mut Draw::new(seed))));
    let wrong = match outcome {
        Err(_) => Some("it panicked".into()),
        Ok(Err(words)) => Some(words),
        Ok(Ok(())) => None,
    };
    let late = start.elapsed() > LONGEST;
    let wrong = wrong.or_else(|| late.then(|| format!("it took {:?}", start.elapsed())));
    wrong.map(|words| format!("{name} {seed}: {words}"))
}

/// Runs all targets as often as requested, or until the time is over; returns the findings, and the
/// number of inputs of each target in words.
fn round(seed: u64, rounds: usize, until: Option<Instant>) -> (Vec<String>, String) {
    let (mut found, mut turns, mut reported) = (Vec::new(), 0, Instant::now());
    for turn in 0.. {
        if turn >= rounds && until.is_none_or(|end| Instant::now() > end) {
            break;
        }
        for (name, target, often) in TARGETS {
            for input in 0..often {
                let own = seed.wrapping_add((turn * often + input) as u64);
                found.extend(tried(name, target, own).inspect(|words| eprintln!("{words}")));
            }
        }
        turns = turn + 1;
        if until.is_some() && reported.elapsed() > Duration::from_secs(60) {
            reported = Instant::now();
            eprintln!("{}, {} found", counted(turns), found.len());
        }
    }
    (found, counted(turns))
}

/// Returns the number of inputs of some rounds in words.
fn counted(turns: usize) -> String {
    let kinds: Vec<String> =
        TARGETS.iter().map(|(name, _, often)| format!("{name} {}", turns * often)).collect();
    let all: usize = TARGETS.iter().map(|(_, _, often)| turns * often).sum();
    format!("{all} inputs ({})", kinds.join(", "))
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().and_then(|text| text.parse().ok())
}

#[test]
fn what_was_found_once_is_mended() {
    for line in CORPUS.lines().filter(|line| !line.starts_with('#')) {
        let (name, seed) = line.split_once(' ').unwrap();
        let (_, target, _) = TARGETS.iter().find(|one| one.0 == name).unwrap();
        assert_eq!(tried(name, *target, seed.parse().unwrap()), None);
    }
}

#[test]
fn numbers_that_no_one_should_give_are_refused_or_borne() {
    let seconds = number("SERVOID_FUZZ_SECONDS");
    let until = seconds.map(|seconds| Instant::now() + Duration::from_secs(seconds));
    let (found, words) = round(number("SERVOID_FUZZ_SEED").unwrap_or(0), 5, until);
    eprintln!("{} found in {words}", found.len());
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_panic_and_a_wrong_answer_are_found() {
    assert!(tried("planted", |_| Err("it is wrong".into()), 1).unwrap().contains("is wrong"));
    assert!(tried("planted", |_| unreachable!("planted"), 1).unwrap().contains("it panicked"));
    assert_eq!(tried("planted", |_| Ok(()), 1), None);
}
