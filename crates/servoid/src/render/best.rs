use wide::f32x8;

use super::draw::{Job, draw};
#[cfg(target_arch = "x86_64")]
use super::lanes_x86::Avx2;
use crate::fitness::Backend;

/// The arithmetic that rays are cast with; all give the same bits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Best {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Best {
    /// Gives what goes with a back end, which this processor has.
    pub fn of(backend: Backend) -> Self {
        #[cfg(target_arch = "x86_64")]
        if backend.has_avx2() {
            return Self::Avx2;
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = backend;
        Self::Portable
    }

    pub fn draw(self, job: &Job<'_>, band: usize, rows: &mut [u8]) {
        match self {
            Self::Portable => draw::<f32x8>(job, band, rows),
            // SAFETY: chosen only where the processor has it.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => unsafe { draw_avx2(job, band, rows) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
unsafe fn draw_avx2(job: &Job<'_>, band: usize, rows: &mut [u8]) {
    draw::<Avx2>(job, band, rows);
}

#[cfg(test)]
mod tests {
    use super::super::{Details, Exposure, Lighting, Paint, Placement, Scene, Texture};
    use super::*;
    use crate::camera::{Distortion, Lens};
    use crate::pose::Pose;

    fn pose(x: f64, y: f64, turn: f64) -> Pose {
        let (s, c) = libm::sincos(0.5 * turn);
        Pose::from_parts([x, y, 0.6], [c, 0.6 * s, 0.8 * s, 0.0]).unwrap()
    }

    /// One visual of each kind.
    fn scene() -> (Scene, Vec<Pose>) {
        let bytes: Vec<u8> = (0..3 * 16 * 8).map(|i| (i * 37 % 256) as u8).collect();
        let painted = Paint::default().with_texture(Texture::new(&bytes, [16, 8]).unwrap());
        let painted = painted.with_gloss(0.4).unwrap();
        let mut scene = Scene::new();
        scene.add_ellipsoid([0.08, 0.05, 0.04], painted.clone()).unwrap();
        scene.add_capsule(0.03, 0.05, painted.clone()).unwrap();
        scene.add_cylinder(0.04, 0.05, painted.clone()).unwrap();
        scene.add_box([0.04, 0.05, 0.03], painted.clone()).unwrap();
        scene.add_plane([0.4, 0.4], painted).unwrap();
        let corners = [[0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [-0.1, -0.1, -0.1]];
        let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        scene.add_mesh(&corners, &faces, &Details::default(), Paint::default()).unwrap();
        let poses = [
            pose(-0.12, -0.1, 0.4),
            pose(0.1, -0.1, 1.0),
            pose(0.12, 0.08, 2.0),
            pose(-0.1, 0.08, 0.7),
            pose(0.0, 0.0, 0.2),
            pose(0.0, 0.0, 0.9),
        ];
        (scene, poses.into())
    }

    #[test]
    fn every_arithmetic_gives_the_same_bits() {
        let (scene, poses) = scene();
        let lighting = Lighting { toward: [0.3, -0.5, -0.8], ..Lighting::default() };
        let exposure = Exposure { noise: 3.0, ..Exposure::default() };
        for distortion in [Distortion::None, Distortion::KannalaBrandt([0.02, 0.0, 0.0, 0.0])] {
            let lens = Lens::new([93, 61], [80.0, 81.0], [45.0, 31.0], distortion).unwrap();
            let placement = Placement {
                lens: &lens,
                world_from_lens: &[
                    Pose::identity(),
                    pose(0.01, 0.0, 0.0) * pose(0.0, 0.0, 0.0).inverse(),
                ],
                world_from_visual: &[poses.clone(), poses.clone()],
                lighting: &lighting,
            };
            let best = scene.render(&placement, &exposure).unwrap();
            let portable = scene.render_by(&placement, &exposure, Best::Portable).unwrap();
            assert!(best.iter().any(|&byte| byte > 100));
            assert_eq!(best, portable);
        }
    }
}
