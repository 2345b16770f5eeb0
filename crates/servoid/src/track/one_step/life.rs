use nalgebra::{UnitQuaternion, Vector3};

use super::colors::Colors;
use super::population::SearchRange;
use super::{Objective, OneStepError, OneStepSettings, UsableImage};
use crate::camera::{Channels, ImageView};
use crate::evolve::{Ga, rng};
use crate::fitness::{Fitness, Points, PointsView, Region, RegionView, ScoreMap};
use crate::pose::Pose;
use crate::shape::{Body, Projection, Quadric};

/// A population that persists across images. Its genes are offsets from an anchor, the last best
/// pose: metres along the first camera's axes as they were at the start, and a rotation vector in
/// the object's frame.
pub(super) struct Life {
    pub anchor: Pose,
    world_from_axes: UnitQuaternion<f64>,
    ga: Ga,
    draws: u64,
}

impl Life {
    /// Draws a population about a pose, which is one of its members.
    pub fn new(
        anchor: Pose,
        world_from_axes: UnitQuaternion<f64>,
        settings: &OneStepSettings,
        range: &SearchRange,
    ) -> Result<Self, OneStepError> {
        let ga = draw(settings, range, 0)?;
        Ok(Self { anchor, world_from_axes, ga, draws: 1 })
    }

    /// Redraws the population about the anchor.
    pub fn scatter(
        &mut self,
        settings: &OneStepSettings,
        range: &SearchRange,
    ) -> Result<(), OneStepError> {
        self.ga = draw(settings, range, self.draws)?;
        self.draws += 1;
        Ok(())
    }

    /// Returns the poses to be scored.
    pub fn poses(&self) -> Vec<Pose> {
        self.ga.ask().iter().map(|individual| self.decode(&individual.genes)).collect()
    }

    /// Breeds the next generation from the scores of the poses.
    pub fn breed(&mut self, scores: &[f64]) -> Result<(), OneStepError> {
        Ok(self.ga.tell(scores)?)
    }

    /// Returns the score of the best individual of the newest generation.
    pub fn best_score(&self) -> f64 {
        self.ga.best().score
    }

    /// Expresses all genes relative to another pose; the individuals do not move in the world.
    pub fn anchor_at(&mut self, pose: Pose) {
        let (before, axes_from_world) = (self.anchor, self.world_from_axes.inverse());
        let world_from_axes = self.world_from_axes;
        self.ga.move_each(|_, genes| {
            let individual = decode(&before, &world_from_axes, genes);
            // The individual at the anchor is there to the last bit.
            if individual == pose {
                return genes.fill(0.0);
            }
            let offset = axes_from_world * (individual.translation() - pose.translation());
            let turn = (pose.rotation().inverse() * individual.rotation()).scaled_axis();
            let numbers = offset.iter().chain(turn.iter());
            genes.iter_mut().zip(numbers).for_each(|(gene, number)| *gene = *number);
        });
        self.anchor = pose;
    }

    /// Rotates the whole population to an orientation of the anchor.
    pub fn turn_to(&mut self, orientation: UnitQuaternion<f64>) {
        self.anchor = Pose::from_rotation(orientation, self.anchor.translation());
    }

    fn decode(&self, genes: &[f64]) -> Pose {
        decode(&self.anchor, &self.world_from_axes, genes)
    }
}

fn draw(settings: &OneStepSettings, range: &SearchRange, branch: u64) -> Result<Ga, OneStepError> {
    let ranges = range.ranges(settings.genes);
    let mut ga = Ga::new(&ranges, settings.search, rng(settings.seed, branch))?;
    // The first individual is the anchor itself.
    ga.move_each(|index, genes| {
        if index == 0 {
            genes.fill(0.0);
        }
    });
    Ok(ga)
}

fn decode(anchor: &Pose, world_from_axes: &UnitQuaternion<f64>, genes: &[f64]) -> Pose {
    let place = anchor.translation() + world_from_axes * Vector3::new(genes[0], genes[1], genes[2]);
    let rotation = match genes.get(3..6) {
        Some(turn) if turn.iter().any(|&x| x != 0.0) => {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(turn));
            UnitQuaternion::new_normalize((anchor.rotation() * turn).into_inner())
        }
        _ => anchor.rotation(),
    };
    Pose::from_rotation(rotation, place)
}

/// What is scored in the usable images of one observation.
pub(super) struct Maps<'a> {
    usable: &'a [UsableImage<'a>],
    matches: Vec<Vec<u8>>,
    region: Vec<RegionView>,
}

impl<'a> Maps<'a> {
    /// Evaluates every pixel once.
    pub fn new(usable: &'a [UsableImage<'a>], colors: &Colors, objective: Objective) -> Self {
        let (mut matches, mut region) = (vec![], vec![]);
        for one in usable {
            match objective {
                Objective::Points { .. } => matches.push(colors.matches(&one.image)),
                Objective::Region => region.push(RegionView {
                    map: ScoreMap::from_colors(&one.image, &colors.model, 1),
                    projection: Projection::new(&one.camera, &one.world_from_camera),
                    weight: 1.0 / usable.len() as f64,
                }),
            }
        }
        Self { usable, matches, region }
    }

    /// Scores the body at poses, in their order.
    pub fn scores(
        self,
        body: &Body,
        poses: &[Pose],
        objective: Objective,
    ) -> Result<Vec<f64>, OneStepError> {
        let ellipsoids = body.ellipsoids();
        let at = |pose: &Pose| {
            let pose = *pose;
            ellipsoids.iter().map(move |ellipsoid| ellipsoid.transformed(&pose, 1.0).quadric())
        };
        let quadrics: Vec<Quadric> = poses.iter().flat_map(at).collect();
        let (count, alpha) = match objective {
            Objective::Points { count, alpha } => (count, alpha),
            Objective::Region => {
                return Ok(Region::new(self.region).scores(&quadrics, ellipsoids.len()));
            }
        };
        let mut views = Vec::with_capacity(self.usable.len());
        for (one, matches) in self.usable.iter().zip(&self.matches) {
            let matches = ImageView::new(matches, one.image.size_px(), Channels::Grey)?;
            views.push(PointsView::new(one.camera, &one.world_from_camera, matches)?);
        }
        Ok(Points::new(views, count, alpha)?.scores(&quadrics, ellipsoids.len()))
    }
}
