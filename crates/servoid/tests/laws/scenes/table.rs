//! The table `scenes.tsv`: the results of many seeds of each scene, and the resulting bound.
//!
//! It has the columns of the Python tests' `scenes.tsv`.

use std::fmt;
use std::fmt::Write as _;

pub const COLUMNS: [&str; 9] =
    ["scene", "measure", "unit", "sense", "seeds", "median", "worst", "margin", "bound"];
/// Significant digits of the figures, and of the bounds.
const DIGITS: usize = 3;
const BOUND_DIGITS: usize = 2;
pub const SEEDS: usize = 20;
pub const MARGIN: f64 = 1.5;
pub const LEAST_MARGIN: f64 = 1.25;
const HEAD: &str = "\
# What chance does to the scenes of the laws: `cargo test --release --test laws -- --ignored
# measure_the_scenes --nocapture` measured this, and writes it anew. Each figure is that of a scene
# over seeds 0, 1, 2 and so on. Where it may be at most its bound, bound = worst * margin; where it
# must be at least its bound, bound = worst / margin; both to 2 digits. A margin is chosen by hand,
# 1.25 or more, and stays when the rest is measured anew.
";

/// The side of its bound on which a figure must be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    AtMost,
    AtLeast,
}

impl fmt::Display for Sense {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::AtMost { "at most" } else { "at least" })
    }
}

/// The results of many seeds of a scene for one of its figures.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    pub scene: String,
    pub measure: String,
    pub unit: String,
    pub sense: Sense,
    pub seeds: usize,
    pub median: f64,
    pub worst: f64,
    pub margin: f64,
    pub bound: f64,
}

impl Row {
    /// Makes a row of the seeds' results; the margin stays as it was chosen.
    pub fn new(names: [&str; 3], sense: Sense, values: &[f64], margin: f64) -> Self {
        let mut sorted = values.to_vec();
        sorted.sort_by(f64::total_cmp);
        let middle = 0.5 * (sorted[(sorted.len() - 1) / 2] + sorted[sorted.len() / 2]);
        let worst = if sense == Sense::AtMost { sorted[sorted.len() - 1] } else { sorted[0] };
        let [median, worst, margin] = [middle, worst, margin].map(|value| rounded(value, DIGITS));
        let [scene, measure, unit] = names.map(str::to_owned);
        let (seeds, bound) = (values.len(), bound_of(worst, margin, sense));
        Self { scene, measure, unit, sense, seeds, median, worst, margin, bound }
    }

    /// Returns whether a value is beyond the bound, or NaN.
    pub fn breaks(&self, value: f64) -> bool {
        let kept = match self.sense {
            Sense::AtMost => value <= self.bound,
            Sense::AtLeast => value >= self.bound,
        };
        !kept
    }

    pub fn names(&self) -> (&str, &str) {
        (&self.scene, &self.measure)
    }
}

/// Rounds to a number of significant digits.
fn rounded(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap()
}

/// Returns the bound that follows from the worst value and a margin.
pub fn bound_of(worst: f64, margin: f64, sense: Sense) -> f64 {
    let far = if sense == Sense::AtMost { worst * margin } else { worst / margin };
    rounded(far, BOUND_DIGITS)
}

pub fn parsed(text: &str) -> Vec<Row> {
    let mut lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
    assert_eq!(lines.next().unwrap_or_default(), COLUMNS.join("\t"));
    lines.map(row).collect()
}

fn row(line: &str) -> Row {
    let cells: Vec<&str> = line.split('\t').collect();
    assert_eq!(cells.len(), COLUMNS.len(), "{line}");
    let number = |at: usize| -> f64 { cells[at].parse().unwrap() };
    let sense = if cells[3] == "at most" { Sense::AtMost } else { Sense::AtLeast };
    assert_eq!(sense.to_string(), cells[3], "{line}");
    Row {
        scene: cells[0].to_owned(),
        measure: cells[1].to_owned(),
        unit: cells[2].to_owned(),
        sense,
        seeds: cells[4].parse().unwrap(),
        median: number(5),
        worst: number(6),
        margin: number(7),
        bound: number(8),
    }
}

/// Writes a table, its rows in the order of their names.
pub fn written(rows: &[Row]) -> String {
    let mut sorted: Vec<_> = rows.iter().collect();
    sorted.sort_by(|one, other| one.names().cmp(&other.names()));
    let mut text = format!("{HEAD}{}\n", COLUMNS.join("\t"));
    for row in sorted {
        let Row { scene, measure, unit, sense, seeds, median, worst, margin, bound } = row;
        writeln!(
            text,
            "{scene}\t{measure}\t{unit}\t{sense}\t{seeds}\t{median}\t{worst}\t{margin}\t{bound}"
        )
        .unwrap();
    }
    text
}
