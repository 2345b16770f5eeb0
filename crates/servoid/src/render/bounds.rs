//! Boxes around visuals, and which of them a bundle of rays can hit.

use super::placed::Placed;
use super::scene::Visual;
use super::vector::{Vector, splat};
use crate::simd::{EIGHT, RayLanes, Scalar};

/// What rounding may add to a direction, as a share of its largest coordinate; far more than it does.
const SLACK: f64 = 1e-4;

/// A range in each axis of the lens's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread<S> {
    middle: [S; 3],
    half: [S; 3],
}

impl<S: Scalar> Spread<S> {
    /// Makes the range between corners, and `margin` times the farthest coordinate beyond them.
    pub fn new(low: [f64; 3], high: [f64; 3], margin: f64) -> Self {
        let farthest = low.iter().chain(&high).fold(0.0, |far: f64, x| far.max(x.abs()));
        Self {
            middle: std::array::from_fn(|i| S::of(0.5 * (low[i] + high[i]))),
            half: std::array::from_fn(|i| S::of(0.5 * (high[i] - low[i]) + margin * farthest)),
        }
    }

    /// Makes a range of directions, with a margin for rounding.
    pub fn of_directions(low: [f64; 3], high: [f64; 3]) -> Self {
        Self::new(low, high, SLACK)
    }

    /// Returns the range along eight axes of unit length.
    #[inline(always)]
    fn along<L: RayLanes<Scalar = S>>(&self, axes: Vector<L>) -> Interval<L> {
        let sizes = Vector { x: axes.x.abs(), y: axes.y.abs(), z: axes.z.abs() };
        let (middle, half) = (splat::<L>(self.middle).dot(axes), splat::<L>(self.half).dot(sizes));
        Interval { low: middle - half, high: middle + half }
    }
}

struct Interval<L> {
    low: L,
    high: L,
}

/// The boxes of eight visuals, each along the axes of its visual; lane by lane.
pub(super) struct Bounds<S> {
    /// Rows of the rotations.
    visual_from_lens: [[[S; EIGHT]; 3]; 3],
    /// Position of the lens, from the middle of the box.
    lens: [[S; EIGHT]; 3],
    /// Towards the lamp.
    toward: [[S; EIGHT]; 3],
    half_size: [[S; EIGHT]; 3],
    /// Bits of the lanes in use.
    used: u32,
}

impl<S: Scalar> Bounds<S> {
    /// Makes the boxes of visuals, in groups of eight.
    pub fn of_all(visuals: &[Visual], placed: &[Placed<S>]) -> Vec<Self> {
        visuals.chunks(EIGHT).zip(placed.chunks(EIGHT)).map(|(v, p)| Self::new(v, p)).collect()
    }

    fn new(visuals: &[Visual], placed: &[Placed<S>]) -> Self {
        let lanes = |value: &dyn Fn(&Visual, &Placed<S>) -> S| {
            let mut out = [S::of(0.0); EIGHT];
            for (lane, (visual, placed)) in out.iter_mut().zip(visuals.iter().zip(placed)) {
                *lane = value(visual, placed);
            }
            out
        };
        let axes = |value: &dyn Fn(&Visual, &Placed<S>, usize) -> S| {
            std::array::from_fn(|axis| lanes(&|visual, placed| value(visual, placed, axis)))
        };
        Self {
            visual_from_lens: std::array::from_fn(|row| {
                axes(&|_, placed, axis| placed.visual_from_lens[row][axis])
            }),
            lens: axes(&|visual, placed, axis| {
                S::of(placed.lens_in_visual[axis].to_f64() - visual.bounds.0[axis])
            }),
            toward: axes(&|_, placed, axis| placed.toward[axis]),
            half_size: axes(&|visual, _, axis| S::of(visual.bounds.1[axis])),
            used: (1 << visuals.len()) - 1,
        }
    }
}

/// Lists the visuals that rays from the lens may hit.
#[inline(always)]
pub(super) fn in_sight<L: RayLanes>(
    bounds: &[Bounds<L::Scalar>],
    directions: &Spread<L::Scalar>,
    into: &mut Vec<usize>,
) {
    list::<L>(bounds, into, |eight, axis| {
        let lens = L::read(eight.lens[axis]);
        (Interval { low: lens, high: lens }, directions.along(read(&eight.visual_from_lens[axis])))
    });
}

/// Lists the visuals that may lie between positions and the lamp.
#[inline(always)]
pub(super) fn in_light<L: RayLanes>(
    bounds: &[Bounds<L::Scalar>],
    positions: &Spread<L::Scalar>,
    into: &mut Vec<usize>,
) {
    let slack = L::of(SLACK);
    list::<L>(bounds, into, |eight, axis| {
        let lens = L::read(eight.lens[axis]);
        let Interval { low, high } = positions.along(read(&eight.visual_from_lens[axis]));
        let toward = L::read(eight.toward[axis]);
        (
            Interval { low: lens + low, high: lens + high },
            Interval { low: toward - slack, high: toward + slack },
        )
    });
}

#[inline(always)]
fn read<L: RayLanes>([x, y, z]: &[[L::Scalar; EIGHT]; 3]) -> Vector<L> {
    Vector { x: L::read(*x), y: L::read(*y), z: L::read(*z) }
}

/// Lists the visuals whose boxes a bundle of rays may enter, in their order; `rays` returns the
/// ranges of their starts and of their directions along an axis of eight boxes.
#[inline(always)]
fn list<L: RayLanes>(
    bounds: &[Bounds<L::Scalar>],
    into: &mut Vec<usize>,
    rays: impl Fn(&Bounds<L::Scalar>, usize) -> (Interval<L>, Interval<L>),
) {
    let zero = L::of(0.0);
    into.clear();
    for (group, eight) in bounds.iter().enumerate() {
        let (mut enter, mut leave) = (zero, L::of(f64::INFINITY));
        for axis in 0..3 {
            let (from, along) = rays(eight, axis);
            let half = L::read(eight.half_size[axis]);
            // At a multiple t of their directions, the lowest ray must not be above the box nor the
            // highest below it: two conditions `slope * t <= room`.
            let conditions = [(along.low, half - from.low), (zero - along.high, half + from.high)];
            for (slope, room) in conditions {
                let (falls, end) = (slope.less(zero), room / slope);
                enter = falls.select(end.max(enter), enter);
                leave = falls.select(leave, end.min(leave));
            }
        }
        let mut may = enter.at_most(leave).bits() & eight.used;
        while may != 0 {
            into.push(group * EIGHT + may.trailing_zeros() as usize);
            may &= may - 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use wide::f32x8;

    use super::super::placed::Moment;
    use super::super::rays::{Rays, TILE_PX};
    use super::super::trace::{nearest, shaded};
    use super::super::{Details, Lighting, Paint, Placement, Scene};
    use super::*;
    use crate::camera::{Distortion, Lens};
    use crate::evolve::Rng;
    use crate::pose::Pose;
    use crate::simd::Single;

    const VISUALS: usize = 18;

    /// Visuals of every kind around the origin, from small ones to some that contain the lens.
    fn scene(rng: &mut Rng) -> (Scene, Vec<Pose>) {
        let mut scene = Scene::new();
        let corners = [[0.1, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.1, 0.3], [-0.1, -0.1, -0.1]];
        let faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        let poses = (0..VISUALS).map(|index| {
            let mut size = || 1.5 * libm::pow(rng.random::<f64>(), 4.0) + 1e-3;
            let (sizes, paint) = ([size(), size(), size()], Paint::default());
            match index % 6 {
                0 => scene.add_ellipsoid(sizes, paint),
                1 => scene.add_capsule(sizes[0], sizes[1], paint),
                2 => scene.add_cylinder(sizes[0], sizes[1], paint),
                3 => scene.add_box(sizes, paint),
                4 => scene.add_plane([sizes[0], sizes[1]], paint),
                _ => scene.add_mesh(&corners, &faces, &Details::default(), paint),
            }
            .unwrap();
            let mut number = || 2.0 * rng.random::<f64>() - 1.0;
            let quaternion = nalgebra::Vector4::from_fn(|_, _| number()).normalize();
            Pose::from_parts([number(), number(), number()], quaternion.into()).unwrap()
        });
        let poses = poses.collect();
        (scene, poses)
    }

    /// Checks the eights of one tile: hits, and shadows on what they hit.
    fn check<L: Single>(
        scene: &Scene,
        moment: &Moment<f32>,
        rays: &Rays<f32>,
        tile: [usize; 2],
    ) -> usize {
        let Some(directions) = rays.spread_of(tile) else { return 0 };
        let all: Vec<usize> = (0..VISUALS).collect();
        let (mut some, mut between) = (Vec::new(), Vec::new());
        in_sight::<L>(&moment.bounds, directions, &mut some);
        for row in 0..TILE_PX[1] {
            for column in (0..TILE_PX[0]).step_by(EIGHT) {
                let ray = rays.eight(0, tile[0] * TILE_PX[0] + column, tile[1] * TILE_PX[1] + row);
                let hit = nearest::<L>(&scene.visuals, moment, &all, ray);
                let found = nearest::<L>(&scene.visuals, moment, &some, ray);
                assert_eq!(hit.t.write(), found.t.write());
                assert_eq!(hit.visual.write(), found.visual.write());
                let is_hit = L::of(0.0).at_most(hit.visual);
                let place = ray * is_hit.select(hit.t * L::of(0.9999), L::of(0.0));
                let places = [place.x.write(), place.y.write(), place.z.write()];
                let least = places.map(|x| x.into_iter().fold(f32::INFINITY, f32::min).into());
                let most = places.map(|x| x.into_iter().fold(f32::NEG_INFINITY, f32::max).into());
                in_light::<L>(&moment.bounds, &Spread::new(least, most, 2e-4), &mut between);
                let dark = shaded(&scene.visuals, moment, &all, (place, is_hit));
                let found = shaded(&scene.visuals, moment, &between, (place, is_hit));
                assert_eq!(dark.bits(), found.bits());
            }
        }
        some.len()
    }

    #[test]
    fn a_visual_that_is_not_listed_is_not_hit_and_casts_no_shadow() {
        let mut rng = Rng::seed_from_u64(5);
        for distortion in [Distortion::None, Distortion::KannalaBrandt([0.02, 0.0, 0.0, 0.0])] {
            let lens = Lens::new([96, 64], [60.0, 61.0], [45.0, 31.0], distortion).unwrap();
            let rays = Rays::of(&lens, 1, &std::sync::Mutex::default());
            let [across, down] = rays.tiles();
            let mut listed = 0;
            for _ in 0..20 {
                let (scene, poses) = scene(&mut rng);
                let placement = Placement {
                    lens: &lens,
                    world_from_lens: &[Pose::identity()],
                    world_from_visual: &[poses],
                    lighting: &Lighting::default(),
                };
                let moment = Moment::new(&scene, &placement, 0);
                let tiles = (0..across * down).map(|i| [i % across, i / across]);
                listed +=
                    tiles.map(|tile| check::<f32x8>(&scene, &moment, &rays, tile)).sum::<usize>();
            }
            // Most are left out, or nothing would have been tested.
            let share = listed as f64 / (20 * across * down * VISUALS) as f64;
            assert!((0.02..0.4).contains(&share), "{share} of the visuals are listed");
        }
    }
}
