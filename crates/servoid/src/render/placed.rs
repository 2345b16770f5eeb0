//! Visuals relative to a lens at one moment.

use nalgebra::{Matrix3, Vector3};

use super::bounds::Bounds;
use super::scene::{Placement, Scene, Visual};
use super::vector::stored;
use crate::pose::Pose;
use crate::simd::Scalar;

/// One moment, in the lens's frame.
pub(super) struct Moment<S> {
    pub visuals: Vec<Placed<S>>,
    /// Boxes around them.
    pub bounds: Vec<Bounds<S>>,
    /// Up in the world, in the lens's frame.
    pub up: [S; 3],
    /// Towards the lamp, in the lens's frame.
    pub toward: [S; 3],
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
}

impl<S: Scalar> Moment<S> {
    pub fn new(scene: &Scene, placement: &Placement<'_>, index: usize) -> Self {
        let lens_from_world = placement.world_from_lens[index].inverse();
        let turn = lens_from_world.rotation_matrix();
        let toward = (turn * Vector3::from(placement.lighting.toward)).normalize();
        let visuals: Vec<Placed<S>> = scene
            .visuals
            .iter()
            .zip(&placement.world_from_visual[index])
            .map(|(visual, &world_from_visual)| {
                placed(&(lens_from_world * world_from_visual), visual, &toward)
            })
            .collect();
        Self {
            bounds: Bounds::of_all(&scene.visuals, &visuals),
            visuals,
            up: stored((turn * Vector3::z()).into()),
            toward: stored(toward.into()),
        }
    }
}

fn placed<S: Scalar>(lens_from_visual: &Pose, visual: &Visual, toward: &Vector3<f64>) -> Placed<S> {
    let visual_from_lens = lens_from_visual.inverse();
    let turn: Matrix3<f64> = visual_from_lens.rotation_matrix();
    Placed {
        visual_from_lens: std::array::from_fn(|row| stored(turn.row(row).transpose().into())),
        lens_in_visual: stored(visual_from_lens.translation().into()),
        toward: stored((turn * toward).into()),
        sizes: stored(visual.shape.sizes()),
    }
}
