//! Scenes with a random outcome: sequences that a test runs with one seed, and whose bounds come
//! from many seeds.

mod evolved;
mod faults;
mod from_masks;
mod learning;
mod measure;
mod modelling;
mod one_step;
mod search;
mod table;
mod track;
mod track_asked;
mod track_lost;
mod track_resolution;

use std::sync::LazyLock;

use servoid::pose::Pose;
use servoid::track::{Estimate, Status};
use table::{LEAST_MARGIN, Row, SEEDS, Sense, bound_of, parsed, written};

/// Figures by the names of their measures.
type Figures = Vec<(&'static str, f64)>;
/// A name, a unit, and the side of its bound on which the figure must be.
type Measure = (&'static str, &'static str, Sense);

/// A sequence with a random outcome.
struct Scene {
    name: &'static str,
    measures: &'static [Measure],
    run: fn(u64) -> Figures,
}

const TABLE: &str = include_str!("../../scenes.tsv");
static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| parsed(TABLE));

/// Images that show the object, but in which it is not tracked.
const NOT_TRACKING: Measure = ("not tracking", "images", Sense::AtMost);
/// Images that show the object, but do not confirm its position.
const NOT_LOCATED: Measure = ("not located", "images", Sense::AtMost);
/// Distance of a pose from the true one.
const OFF: Measure = ("off", "mm", Sense::AtMost);
const TURNED: Measure = ("turned", "deg", Sense::AtMost);
/// What the overlap with silhouettes lacks to 1.
const MISSED: Measure = ("missed", "1", Sense::AtMost);
/// Sequences in which there are not as many as there should be.
const MISCOUNTED: Measure = ("miscounted", "courses", Sense::AtMost);

fn all() -> impl Iterator<Item = &'static Scene> {
    let of_file = [
        evolved::SCENES,
        faults::SCENES,
        learning::SCENES,
        modelling::SCENES,
        one_step::SCENES,
        from_masks::SCENES,
        search::SCENES,
        track::SCENES,
        track_asked::SCENES,
        track_lost::SCENES,
        track_resolution::SCENES,
    ];
    of_file.into_iter().flatten()
}

impl Scene {
    /// Runs the scene with a seed.
    fn figures(&self, seed: u64) -> Figures {
        let figures = (self.run)(seed);
        let found: Vec<_> = figures.iter().map(|(name, _)| *name).collect();
        let expected: Vec<_> = self.measures.iter().map(|(name, ..)| *name).collect();
        assert_eq!(found, expected, "{}", self.name);
        figures
    }

    /// Returns which figures are beyond their bounds, and what is known of these.
    fn beyond(&self, seed: u64) -> Vec<String> {
        let mut complaints = vec![];
        for (measure, value) in self.figures(seed) {
            let row = row(self.name, measure);
            let Row { unit, sense, bound, seeds, worst, .. } = row;
            if row.breaks(value) {
                complaints.push(format!(
                    "{}, seed {seed}: {measure} is {value:.3} {unit}, which must be {sense} \
                     {bound}; the worst of {seeds} seeds was {worst}",
                    self.name
                ));
            }
        }
        complaints
    }
}

fn row(scene: &str, measure: &str) -> &'static Row {
    ROWS.iter().find(|row| row.names() == (scene, measure)).unwrap()
}

/// Runs a scene with seed 0, and fails if a figure is beyond its bound.
pub fn holds(name: &str) {
    holds_for(name, 0..1);
}

/// Runs a scene with some seeds, and fails if a figure is beyond its bound.
pub fn holds_for(name: &str, seeds: std::ops::Range<u64>) {
    let scene = all().find(|scene| scene.name == name).unwrap();
    let beyond: Vec<_> = seeds.flat_map(|seed| scene.beyond(seed)).collect();
    assert!(beyond.is_empty(), "{}", beyond.join("\n"));
}

/// Returns the distance and the angle between two poses, in millimetres and degrees.
fn apart(one: &Pose, other: &Pose) -> (f64, f64) {
    let off = one.inverse() * *other;
    (1000.0 * off.translation().norm(), off.rotation().angle().to_degrees())
}

/// The worst of some estimates: images that are not tracked, and the largest error.
#[derive(Default)]
struct Worst {
    not_tracking: f64,
    not_located: f64,
    off: f64,
    turned: f64,
}

impl Worst {
    fn add(&mut self, found: &Estimate, truth: &Pose) {
        self.not_tracking += f64::from(u8::from(found.status != Status::Tracking));
        self.not_located += f64::from(u8::from(!found.located));
        self.add_pose(&found.world_from_object, truth);
    }

    fn add_pose(&mut self, found: &Pose, truth: &Pose) {
        let (off, turned) = apart(found, truth);
        (self.off, self.turned) = (self.off.max(off), self.turned.max(turned));
    }

    /// Returns the figures of `NOT_LOCATED`, `OFF` and `TURNED`, for an object whose orientation is
    /// unobservable.
    fn plain_figures(&self) -> Figures {
        vec![("not located", self.not_located), ("off", self.off), ("turned", self.turned)]
    }

    /// Returns the figures of `NOT_TRACKING`, `OFF` and `TURNED`.
    fn figures(&self) -> Figures {
        vec![("not tracking", self.not_tracking), ("off", self.off), ("turned", self.turned)]
    }
}

/// Returns what is wrong with a table of scenes.
fn faults(rows: &[Row], scenes: &[&Scene]) -> Vec<String> {
    let mut complaints = vec![];
    for row in rows {
        let Row { sense, seeds, worst, margin, bound, .. } = *row;
        let mut complain = |what: &str| complaints.push(format!("{:?} {what}", row.names()));
        if bound != bound_of(worst, margin, sense) {
            complain("has a bound that does not follow from its worst figure and its margin");
        }
        if seeds < SEEDS {
            complain("is of too few seeds");
        }
        if margin < LEAST_MARGIN {
            complain("has too small a margin");
        }
        let declared = scenes.iter().filter(|scene| scene.name == row.scene);
        let known = (row.measure.as_str(), row.unit.as_str(), sense);
        if !declared.flat_map(|scene| scene.measures).any(|measure| *measure == known) {
            complain("is of no scene");
        }
    }
    for scene in scenes {
        for (measure, ..) in scene.measures {
            if rows.iter().filter(|row| row.names() == (scene.name, measure)).count() != 1 {
                complaints.push(format!("{} needs one row for {measure}", scene.name));
            }
        }
    }
    complaints
}

#[test]
fn every_bound_follows_from_what_at_least_twenty_seeds_of_a_scene_gave() {
    let scenes: Vec<_> = all().collect();
    assert_eq!(faults(&ROWS, &scenes), Vec::<String>::new());
    assert_eq!(written(&ROWS), TABLE, "the table is not as it would be written");
}

#[test]
fn a_table_that_was_bent_is_found_out() {
    let scenes: Vec<_> = all().collect();
    let bent = |bend: fn(&mut Vec<Row>)| {
        let mut rows = ROWS.clone();
        bend(&mut rows);
        faults(&rows, &scenes).len()
    };
    assert_eq!(bent(|rows| rows[0].bound += 1.0), 1);
    assert_eq!(bent(|rows| rows[1].seeds = 19), 1);
    assert_eq!(bent(|rows| rows[0].unit += "s"), 1);
    assert_eq!(bent(|rows| rows.push(rows[0].clone())), 1);
    assert_eq!(bent(|rows| rows.truncate(rows.len() - 1)), 1);
    assert_eq!(bent(|rows| rows[0].scene += "s"), 2);
    let thin = |rows: &mut Vec<Row>| {
        let Row { scene, measure, unit, sense, worst, .. } = rows[0].clone();
        rows[0] = Row::new([&scene, &measure, &unit], sense, &[worst; SEEDS], 1.1);
    };
    assert_eq!(bent(thin), 1);
}

#[test]
fn a_figure_breaks_its_bound_on_one_side_and_what_is_no_number_always_does() {
    let row = |sense| Row::new(["a", "b", "c"], sense, &[3.0, 1.0, 2.0, 4.0], 2.0);
    let (most, least) = (row(Sense::AtMost), row(Sense::AtLeast));
    assert_eq!((most.median, most.worst, most.bound), (2.5, 4.0, 8.0));
    assert_eq!((least.median, least.worst, least.bound), (2.5, 1.0, 0.5));
    assert!(!most.breaks(8.0) && most.breaks(8.1) && most.breaks(f64::NAN));
    assert!(!least.breaks(0.5) && least.breaks(0.4) && least.breaks(f64::NAN));
}
