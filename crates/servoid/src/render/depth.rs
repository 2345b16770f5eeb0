use crate::parallel::*;
use wide::f64x8;

use super::RenderError;
use super::bounds::in_sight;
use super::look::light::Lighting;
use super::placed::Moment;
use super::rays::{Rays, TILE_PX};
use super::scene::{Placement, Scene};
use super::trace::nearest;
use crate::camera::Lens;
use crate::pose::Pose;
use crate::simd::{EIGHT, RayLanes};

/// The depth at each pixel's centre, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// Metres along the lens's z; NaN where there is nothing.
    pub depth: Vec<f32>,
    /// Index of the visual; -1 where there is nothing.
    pub visual: Vec<i32>,
}

impl Scene {
    /// Returns the depth and the visual at each pixel's centre.
    ///
    /// # Errors
    /// If there is not one pose for each visual, or one of them is too far away.
    pub fn depth(
        &self,
        lens: &Lens,
        world_from_lens: &Pose,
        world_from_visual: &[Pose],
    ) -> Result<Depth, RenderError> {
        let placement = Placement {
            lens,
            world_from_lens: std::slice::from_ref(world_from_lens),
            world_from_visual: &[world_from_visual.to_vec()],
            lighting: &Lighting::default(),
        };
        placement.check(self)?;
        let moment = Moment::<f64>::new(self, &placement, 0);
        let rays = Rays::of(lens, 1, &self.kept.exact);
        let [width, height] = lens.camera().size_px();
        let mut out =
            Depth { depth: vec![f32::NAN; width * height], visual: vec![-1; width * height] };
        let size = width * TILE_PX[1];
        let bands = out.depth.par_chunks_mut(size).zip(out.visual.par_chunks_mut(size));
        bands.enumerate().for_each(|(band, (depth, visual))| {
            measure(self, &moment, &rays, (band, width), (depth, visual));
        });
        Ok(out)
    }
}

fn measure(
    scene: &Scene,
    moment: &Moment<f64>,
    rays: &Rays<f64>,
    (band, width): (usize, usize),
    (depth, visual): (&mut [f32], &mut [i32]),
) {
    let mut some = Vec::new();
    for tile in 0..rays.tiles()[0] {
        let Some(directions) = rays.spread_of([tile, band]) else { continue };
        in_sight::<f64x8>(&moment.bounds, directions, &mut some);
        if some.is_empty() {
            continue;
        }
        for row in 0..depth.len() / width {
            let end = width.min((tile + 1) * TILE_PX[0]);
            for u in (tile * TILE_PX[0]..end).step_by(EIGHT) {
                let ray = rays.eight::<f64x8>(0, u, band * TILE_PX[1] + row);
                let hit = nearest(&scene.visuals, moment, &some, ray);
                let (z, number) = ((ray.z * hit.t).write(), hit.visual.write());
                for lane in (0..EIGHT.min(width - u)).filter(|&lane| number[lane] >= 0.0) {
                    depth[row * width + u + lane] = z[lane] as f32;
                    visual[row * width + u + lane] = number[lane] as i32;
                }
            }
        }
    }
}
