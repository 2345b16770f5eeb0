//! Visuals relative to a lens at one moment, and which of them a bundle of rays can hit.

use nalgebra::{Matrix3, Vector3};

use super::scene::{Placement, Scene, Visual};
use super::vector::stored;
use crate::pose::Pose;
use crate::simd::Scalar;

/// One moment, in the lens's frame.
pub(super) struct Moment<S> {
    pub visuals: Vec<Placed<S>>,
    /// Up in the world, in the lens's frame.
    pub up: [S; 3],
    /// Towards the lamp, in the lens's frame.
    pub toward: [S; 3],
    /// Two directions across the light, in the lens's frame.
    pub across: [[S; 3]; 2],
}

/// One visual, relative to the lens.
pub(super) struct Placed<S> {
    /// Rows of the rotation.
    pub visual_from_lens: [[S; 3]; 3],
    /// Position of the lens, in the visual's frame.
    pub lens_in_visual: [S; 3],
    /// Towards the lamp, in the visual's frame.
    pub toward: [S; 3],
    /// Sizes read by the shape.
    pub sizes: [S; 3],
    ball: Ball,
}

/// A ball around a visual.
struct Ball {
    direction: Vector3<f64>,
    radius: f64,
    /// Sine and cosine of half the angle that it subtends at the lens; `None` from inside.
    half_angle: Option<[f64; 2]>,
    /// Coordinates of its centre across the light.
    across: [f64; 2],
    /// Coordinate of its centre along the light.
    along: f64,
}

/// Rays that start at the lens, within an angle of an axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cone {
    pub axis: Vector3<f64>,
    pub cosine: f64,
    pub sine: f64,
}

/// The start of rays towards the lamp: a rectangle across the light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Beam {
    pub low: [f64; 2],
    pub high: [f64; 2],
    /// The coordinate farthest from the lamp.
    pub along: f64,
}

impl<S: Scalar> Moment<S> {
    pub fn new(scene: &Scene, placement: &Placement<'_>, index: usize) -> Self {
        let lens_from_world = placement.world_from_lens[index].inverse();
        let turn = lens_from_world.rotation_matrix();
        let toward = (turn * Vector3::from(placement.lighting.toward)).normalize();
        let across = across(&toward);
        let visuals = scene
            .visuals
            .iter()
            .zip(&placement.world_from_visual[index])
            .map(|(visual, &world_from_visual)| {
                placed(&(lens_from_world * world_from_visual), visual, (&toward, &across))
            })
            .collect();
        Self {
            visuals,
            up: stored((turn * Vector3::z()).into()),
            toward: stored(toward.into()),
            across: across.map(|v| stored(v.into())),
        }
    }

    /// Lists the visuals that a cone of rays may hit.
    pub fn in_cone(&self, cone: &Cone, into: &mut Vec<usize>) {
        into.clear();
        let may = |placed: &Placed<S>| placed.ball.intersects_cone(cone);
        into.extend(self.visuals.iter().enumerate().filter(|(_, t)| may(t)).map(|(i, _)| i));
    }

    /// Lists the visuals that may lie between a beam and the lamp.
    pub fn in_beam(&self, beam: &Beam, into: &mut Vec<usize>) {
        into.clear();
        let may = |placed: &Placed<S>| placed.ball.intersects_beam(beam);
        into.extend(self.visuals.iter().enumerate().filter(|(_, t)| may(t)).map(|(i, _)| i));
    }
}

fn placed<S: Scalar>(
    lens_from_visual: &Pose,
    visual: &Visual,
    (toward, across): (&Vector3<f64>, &[Vector3<f64>; 2]),
) -> Placed<S> {
    let visual_from_lens = lens_from_visual.inverse();
    let turn: Matrix3<f64> = visual_from_lens.rotation_matrix();
    let (center, radius) = visual.ball;
    let center = lens_from_visual.transform(&Vector3::from(center));
    // Slightly larger, to allow for rounding.
    let radius = radius * (1.0 + 1e-6) + 1e-6;
    let distance = center.norm();
    let sine = radius / distance;
    Placed {
        visual_from_lens: std::array::from_fn(|row| stored(turn.row(row).transpose().into())),
        lens_in_visual: stored(visual_from_lens.translation().into()),
        toward: stored((turn * toward).into()),
        sizes: stored(visual.shape.sizes()),
        ball: Ball {
            direction: center / distance,
            radius,
            half_angle: (sine < 1.0).then(|| [sine, (1.0 - sine * sine).sqrt()]),
            across: [across[0].dot(&center), across[1].dot(&center)],
            along: toward.dot(&center),
        },
    }
}

/// Returns two directions at right angles to a given one and to each other.
fn across(toward: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let least = toward.iamin();
    let first = toward.cross(&Vector3::ith(least, 1.0)).normalize();
    [first, toward.cross(&first)]
}

impl Ball {
    fn intersects_cone(&self, cone: &Cone) -> bool {
        let Some([sine, cosine]) = self.half_angle else { return true };
        self.direction.dot(&cone.axis) >= cone.cosine * cosine - cone.sine * sine
    }

    fn intersects_beam(&self, beam: &Beam) -> bool {
        let gap =
            |i: usize| (beam.low[i] - self.across[i]).max(self.across[i] - beam.high[i]).max(0.0);
        let (u, v) = (gap(0), gap(1));
        u * u + v * v <= self.radius * self.radius && self.along + self.radius >= beam.along
    }
}
