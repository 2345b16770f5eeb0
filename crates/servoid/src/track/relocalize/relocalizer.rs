use nalgebra::Vector3;

use super::known_turns::{KnownTurns, draw_any};
use crate::evolve::{self, GaError, Rng};
use crate::pose::Pose;
use crate::track::inputs::Inputs;
use crate::track::pose::search::{Deviation, Found, Probes, Scorer, Search};
use crate::track::target::thumbnail::distances;

/// Searches for the object without a prior pose: first scores positions, then orientations at the
/// best positions, then refines the best of both by populations. Memory is reused from call to
/// call.
#[derive(Debug, Clone)]
pub(crate) struct Relocalizer {
    seed: u64,
    round: u64,
    around: Vec<usize>,
    ranked: Vec<Found>,
    best: Vec<Found>,
    /// Which of the `LIGHTS` is tried next, and which one the colours are those of.
    next_light: usize,
    pub(super) light: usize,
}

/// Light in which an object is sought in turn, relative to that in which its colours were learned:
/// in steps that leave most of them in their bins or beside these.
pub(super) const LIGHTS: [f32; 12] =
    [1.0, 0.8, 1.25, 1.0, 0.64, 1.55, 1.0, 0.5, 0.8, 1.0, 0.4, 1.25];
/// Surface points used as probes of all sides.
const PROBES: usize = 60;
/// Number of populations about one pose, and their size and generations.
const ISLANDS: usize = 3;
const POPULATION: usize = 32;
const GENERATIONS: usize = 8;
/// Positions across an image in the first stage.
const COLUMNS: usize = 16;
/// Positions that are examined more closely, orientations tried at each near known ones and anywhere,
/// and poses that are kept.
const PLACES: usize = 12;
const TURNS: (usize, usize) = (40, 40);
const KEPT: usize = 10;
/// Least distance in radii between positions that are examined, and between poses that are kept
/// unless their orientations differ by at least this, in radians.
const PLACES_APART: f64 = 0.7;
const POSES_APART: (f64, f64) = (0.3, 0.4);
/// Search range around the best orientations at the best positions, in radii and radians.
const NEAR: (f64, f64) = (0.5, 0.5);

impl Relocalizer {
    pub(crate) fn new(seed: u64) -> Self {
        let (around, ranked, best) = (Vec::new(), Vec::new(), Vec::new());
        Self { seed, round: 0, around, ranked, best, next_light: 0, light: 0 }
    }

    /// Returns which light is tried next.
    pub(super) fn next_light(&mut self) -> usize {
        let light = self.next_light;
        self.next_light = (light + 1) % LIGHTS.len();
        light
    }

    /// Begins with the light in which colours were learned.
    pub(in crate::track) fn forget_light(&mut self) {
        (self.next_light, self.light) = (0, 0);
    }

    /// Returns random numbers that are not used elsewhere.
    pub(super) fn next_rng(&mut self) -> Rng {
        self.round += 1;
        evolve::rng(self.seed, self.round)
    }

    /// Evolves populations about a pose; returns the best of each, and the number of poses scored.
    pub(crate) fn local(
        &mut self,
        inputs: Inputs<'_>,
        (pose, search_range, area): (&Pose, Deviation, f64),
    ) -> Result<(&[Found], usize), GaError> {
        self.spread_probes(&inputs);
        self.best.clear();
        let mut evaluations = 0;
        for _ in 0..ISLANDS {
            let scorer = Scorer { inputs, probes: Probes::Facing(&self.around), area };
            self.round += 1;
            let rng = evolve::rng(self.seed, self.round);
            let found = evolved(&scorer, (pose, search_range), rng)?;
            evaluations += found.evaluations;
            self.best.push(found);
        }
        Ok((&self.best, evaluations))
    }

    /// Evolves a population about a pose, scored by these surface points; returns its best.
    pub(crate) fn by_points(
        &mut self,
        inputs: Inputs<'_>,
        (pose, search_range, area): (&Pose, Deviation, f64),
        points: &[usize],
    ) -> Result<Found, GaError> {
        let scorer = Scorer { inputs, probes: Probes::Facing(points), area };
        evolved(&scorer, (pose, search_range), self.next_rng())
    }

    /// Searches for the object in the whole images, at distances from near to far: half of the
    /// orientations that are tried are near those at which it was seen before. The poses at which
    /// it was detected are tried in any case.
    pub(crate) fn global(
        &mut self,
        inputs: Inputs<'_>,
        known: &KnownTurns,
        (detected, (near, far)): (&[Found], (f64, f64)),
        area_at: impl Fn(f64) -> f64,
    ) -> Result<(&[Found], usize), GaError> {
        self.spread_probes(&inputs);
        let mut rng = self.next_rng();
        let radius = inputs.solid.radius;
        let area = area_at((near * far).sqrt());
        let scorer = Scorer { inputs, probes: Probes::Facing(&self.around), area };
        let bare = Scorer { probes: Probes::Facing(&[]), ..scorer };
        let mut evaluations = places(&bare, known, (near, far), &mut rng, &mut self.ranked);
        keep(&mut self.ranked, PLACES, |one, other| one.apart(other) > PLACES_APART * radius);
        self.best.clear();
        for place in &self.ranked {
            let position = place.pose.translation();
            for at in 0..TURNS.0 + TURNS.1 {
                let is_known = at < TURNS.0;
                let turn =
                    if is_known { known.draw_at(&position, &mut rng) } else { draw_any(&mut rng) };
                let pose = Pose::from_rotation(turn, position);
                self.best.push(Found { pose, score: scorer.score(&pose), evaluations: 1 });
            }
        }
        evaluations += self.best.len();
        keep(&mut self.best, KEPT.saturating_sub(detected.len()), |one, other| {
            let turn = (one.rotation().inverse() * other.rotation()).angle();
            one.apart(other) > POSES_APART.0 * radius || turn > POSES_APART.1
        });
        self.best.extend_from_slice(detected);
        let search_range = (NEAR.0 * radius, NEAR.1);
        for found in &mut self.best {
            self.round += 1;
            let rng = evolve::rng(self.seed, self.round);
            *found = evolved(&scorer, (&found.pose, search_range), rng)?;
            evaluations += found.evaluations;
        }
        self.best.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok((&self.best, evaluations))
    }

    fn spread_probes(&mut self, inputs: &Inputs<'_>) {
        self.around.clear();
        self.around.extend(inputs.points.all_but_edgels());
        let (count, kept) = (self.around.len(), self.around.len().min(PROBES));
        for at in 0..kept {
            self.around[at] = self.around[at * count / kept];
        }
        self.around.truncate(kept);
    }
}

/// Evolves a population about a pose; returns its best.
fn evolved(
    scorer: &Scorer<'_>,
    (pose, search_range): (&Pose, Deviation),
    rng: Rng,
) -> Result<Found, GaError> {
    let mut search = Search::new(POPULATION, rng)?;
    search.run(scorer, (pose, pose), search_range, |bred| bred < GENERATIONS)
}

/// Scores the body, in a known orientation and any other, at positions all over the first open
/// camera's image.
fn places(
    scorer: &Scorer<'_>,
    known: &KnownTurns,
    (near, far): (f64, f64),
    rng: &mut Rng,
    out: &mut Vec<Found>,
) -> usize {
    out.clear();
    let open = scorer.inputs.windows.iter().find_map(|window| window.rays(COLUMNS));
    let Some((eye, rays)) = open else { return 0 };
    for ray in rays {
        for distance in distances(near, far) {
            let place: Vector3<f64> = eye + ray * distance;
            for turn in [known.draw_at(&place, rng), draw_any(rng)] {
                let pose = Pose::from_rotation(turn, place);
                out.push(Found { pose, score: scorer.score(&pose), evaluations: 1 });
            }
        }
    }
    out.len()
}

/// Keeps the best poses, each different enough from the better ones.
fn keep(all: &mut Vec<Found>, most: usize, differ: impl Fn(&Pose, &Pose) -> bool) {
    all.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept = 0;
    for at in 0..all.len() {
        if kept < most && all[..kept].iter().all(|better| differ(&better.pose, &all[at].pose)) {
            all.swap(kept, at);
            kept += 1;
        }
    }
    all.truncate(kept);
}
