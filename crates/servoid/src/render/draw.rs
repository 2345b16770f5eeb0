//! Draws an image: tiles of pixels, their rays, what these hit, its light, and the bytes.

use crate::parallel::*;

use super::bounds::{Spread, in_light, in_sight};
use super::look::light::Grey;
use super::look::shade::Lamp;
use super::look::surface::{Seen, seen};
use super::placed::Moment;
use super::rays::{Rays, TILE_PX};
use super::scene::{Placement, Scene};
use super::sensor::Noise;
use super::trace::{nearest, shaded};
use super::vector::{Vector, splat};
use super::{RenderError, within};
use crate::changing::changeable;
use crate::model::Settings;
use crate::simd::{Backend, EIGHT, RayKernel, Single};

/// Settings of an exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Exposure {
    /// Rays along each side of a pixel, which has the square of that in all. Successive rays use
    /// successive moments in turn.
    pub samples: usize,
    /// Standard deviation of the sensor's noise, in grey levels.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
    /// Threads; 0 for all cores.
    pub threads: usize,
}

changeable!(Exposure);

impl Default for Exposure {
    fn default() -> Self {
        Self { samples: 2, noise: 0.0, seed: 0, threads: 0 }
    }
}

impl Exposure {
    /// Most rays along a pixel's side.
    pub const MAX_SAMPLES: usize = 8;
    /// Most noise, in grey levels.
    pub const MAX_NOISE: f64 = 255.0;

    fn check(&self, moments: usize) -> Result<(), RenderError> {
        within("samples", self.samples as f64, [1.0, Self::MAX_SAMPLES as f64])?;
        within("noise", self.noise, [0.0, Self::MAX_NOISE])?;
        let rays = self.samples * self.samples;
        if moments > rays { Err(RenderError::TooManyMoments { moments, rays }) } else { Ok(()) }
    }
}

/// The data for a band of tiles.
pub(super) struct Job<'a> {
    scene: &'a Scene,
    moments: Vec<Moment<f32>>,
    rays: &'a Rays<f32>,
    lamp: Lamp,
    noise: Option<Noise>,
    size_px: [usize; 2],
}

impl Scene {
    /// Draws an image: sRGB bytes, row by row.
    ///
    /// # Errors
    /// If poses do not fit the visuals or each other, or a setting is out of range.
    pub fn render(
        &self,
        placement: &Placement<'_>,
        exposure: &Exposure,
    ) -> Result<Vec<u8>, RenderError> {
        self.render_by(placement, exposure, Backend::used())
    }

    pub(super) fn render_by(
        &self,
        placement: &Placement<'_>,
        exposure: &Exposure,
        backend: Backend,
    ) -> Result<Vec<u8>, RenderError> {
        placement.check(self)?;
        exposure.check(placement.world_from_lens.len())?;
        with_threads(exposure.threads, || {
            let rays = Rays::of(placement.lens, exposure.samples, &self.kept.rays);
            let moment = |index| Moment::new(self, placement, index);
            let job = Job {
                scene: self,
                moments: (0..placement.world_from_lens.len()).map(moment).collect(),
                rays: &rays,
                lamp: Lamp::new(placement.lighting),
                noise: Noise::new(exposure.noise, exposure.seed),
                size_px: placement.lens.camera().size_px(),
            };
            let [width, height] = job.size_px;
            let mut image = vec![0_u8; 3 * width * height];
            let bands = image.par_chunks_mut(3 * width * TILE_PX[1]).enumerate();
            bands.for_each(|(band, rows)| backend.run_rays(Band { job: &job, band, rows }));
            image
        })
    }
}

/// Runs work on a number of threads, or on all cores.
pub(super) fn with_threads<T: Send>(
    threads: usize,
    work: impl FnOnce() -> T + Send,
) -> Result<T, RenderError> {
    if threads == 0 {
        return Ok(work());
    }
    let most = Settings::MAX_THREADS;
    if threads > most {
        let reason = format!("the most are {most}");
        return Err(RenderError::Threads { threads, reason });
    }
    let pool = pool(threads).map_err(|reason| RenderError::Threads { threads, reason })?;
    Ok(pool.install(work))
}

/// Eight rays of a tile, from the lens to what they hit.
#[derive(Clone, Copy)]
struct Packet<L> {
    index: usize,
    ray: Vector<L>,
    /// Multiple of the ray at the hit; 0 without one.
    t: L,
    seen: Seen<L>,
    /// How much the surface faces the lamp.
    facing: L,
}

/// Reused memory for one ray in each pixel of a tile.
struct Work<L> {
    packets: [Packet<L>; PACKETS],
    /// Visuals that may lie between a surface and the lamp.
    between: Vec<usize>,
}

impl<L: Single> Work<L> {
    #[inline(always)]
    fn new() -> Self {
        let zero = L::of(0.0);
        let none = Vector { x: zero, y: zero, z: zero };
        let seen = Seen { normal: none, albedo: none, gloss: zero };
        let packet = Packet { index: 0, ray: none, t: zero, seen, facing: zero };
        Self { packets: [packet; PACKETS], between: Vec::new() }
    }
}

const PACKETS: usize = TILE_PX[0] * TILE_PX[1] / EIGHT;
const ACROSS: usize = TILE_PX[0] / EIGHT;

/// A band of tiles to be drawn.
struct Band<'a> {
    job: &'a Job<'a>,
    band: usize,
    rows: &'a mut [u8],
}

impl RayKernel for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Single>(self) {
        draw::<L>(self.job, self.band, self.rows);
    }
}

/// Draws a band of tiles.
#[inline(always)]
fn draw<L: Single>(job: &Job<'_>, band: usize, rows: &mut [u8]) {
    let (mut some, mut work) = (Vec::new(), Work::<L>::new());
    for tile in 0..job.rays.tiles()[0] {
        let zero = L::of(0.0);
        let mut sums = [Vector { x: zero, y: zero, z: zero }; PACKETS];
        if let Some(directions) = job.rays.spread_of([tile, band]) {
            let mut listed = usize::MAX;
            for sample in 0..job.rays.per_pixel() {
                let index = sample % job.moments.len();
                if index != listed {
                    in_sight::<L>(&job.moments[index].bounds, directions, &mut some);
                    listed = index;
                }
                let at = (sample, tile, band);
                expose::<L>(job, at, (&some, &mut work), &mut sums);
            }
        }
        develop::<L>(job, [tile, band], &sums, rows);
    }
}

/// Adds the light of one ray in each pixel of a tile.
#[inline(always)]
fn expose<L: Single>(
    job: &Job<'_>,
    (sample, tile, band): (usize, usize, usize),
    (some, work): (&[usize], &mut Work<L>),
    sums: &mut [Vector<L>; PACKETS],
) {
    let moment = &job.moments[sample % job.moments.len()];
    let visuals = &job.scene.visuals;
    let mut reach = Reach::<L>::new();
    let mut count = 0;
    for (index, sum) in sums.iter_mut().enumerate() {
        let (u, v) = place([tile, band], index);
        if u >= job.size_px[0] || v >= job.size_px[1] {
            continue;
        }
        let ray = job.rays.eight::<L>(sample, u, v);
        let zero = L::of(0.0);
        let hit = nearest(visuals, moment, some, ray);
        let is_hit = zero.at_most(hit.visual);
        let bits = is_hit.bits();
        if bits != 0xff {
            // A ray outside the lens's field of view is NaN, and sees nothing.
            let is_ray = ray.z.at_most(ray.z);
            let sky = job.lamp.background(moment, ray);
            let black = Vector { x: zero, y: zero, z: zero };
            let open = Vector::select(is_ray, sky, black);
            *sum = *sum + Vector::select(is_hit, black, open);
        }
        if bits != 0 {
            let seen = seen(visuals, moment, ray, &hit);
            let facing = seen.normal.dot(splat(moment.toward));
            let facing = is_hit.select(facing.max(zero), zero);
            reach.add(ray * hit.t, facing);
            let t = is_hit.select(hit.t, zero);
            work.packets[count] = Packet { index, ray, t, seen, facing };
            count += 1;
        }
    }
    work.between.clear();
    if let Some(positions) = reach.spread() {
        in_light::<L>(&moment.bounds, &positions, &mut work.between);
    }
    for packet in &work.packets[..count] {
        let sum = &mut sums[packet.index];
        *sum = *sum + light(job, moment, &work.between, packet);
    }
}

/// Returns the light along eight rays.
#[inline(always)]
fn light<L: Single>(
    job: &Job<'_>,
    moment: &Moment<f32>,
    between: &[usize],
    packet: &Packet<L>,
) -> Vector<L> {
    let zero = L::of(0.0);
    let Packet { ray, t, seen, facing, .. } = packet;
    let open = zero.less(*facing);
    let mut dark = zero.less(zero);
    if open.bits() != 0 && !between.is_empty() {
        // Slightly off the surface, so that it does not shade itself because of rounding.
        let place = *ray * *t + seen.normal * (*t * L::of(LIFT));
        dark = shaded(&job.scene.visuals, moment, between, (place, open));
    }
    let light = job.lamp.shine(moment, (*ray, seen), (*facing, dark));
    Vector::select(zero.less(*t), light, Vector { x: zero, y: zero, z: zero })
}

/// Offset from a surface at which shadow rays start, as a share of the distance.
const LIFT: f64 = 1e-4;

/// Returns the first pixel of a packet.
#[inline(always)]
fn place([tile, band]: [usize; 2], packet: usize) -> (usize, usize) {
    (tile * TILE_PX[0] + packet % ACROSS * EIGHT, band * TILE_PX[1] + packet / ACROSS)
}

/// Bounds of the positions that the lamp may reach.
struct Reach<L> {
    low: Vector<L>,
    high: Vector<L>,
}

impl<L: Single> Reach<L> {
    #[inline(always)]
    fn new() -> Self {
        let far = L::of(f64::INFINITY);
        let low = Vector { x: far, y: far, z: far };
        Self { low, high: -low }
    }

    #[inline(always)]
    fn add(&mut self, place: Vector<L>, facing: L) {
        let is_lit = L::of(0.0).less(facing);
        let include = |low: &mut L, high: &mut L, x: L| {
            *low = is_lit.select(x, *low).min(*low);
            *high = is_lit.select(x, *high).max(*high);
        };
        include(&mut self.low.x, &mut self.high.x, place.x);
        include(&mut self.low.y, &mut self.high.y, place.y);
        include(&mut self.low.z, &mut self.high.z, place.z);
    }

    /// Returns their range, with a margin for the offset from the surface; `None` if there are
    /// none.
    #[inline(always)]
    fn spread(&self) -> Option<Spread<f32>> {
        let low = [self.low.x, self.low.y, self.low.z].map(|x| f64::from(least(x)));
        let high = [self.high.x, self.high.y, self.high.z].map(|x| -f64::from(least(-x)));
        (low[0] <= high[0]).then(|| Spread::new(low, high, 2.0 * LIFT))
    }
}

#[inline(always)]
fn least<L: Single>(x: L) -> f32 {
    let mut out = f32::INFINITY;
    for value in x.write() {
        out = if value < out { value } else { out };
    }
    out
}

/// Converts the light of a tile to bytes.
#[inline(always)]
fn develop<L: Single>(
    job: &Job<'_>,
    tile: [usize; 2],
    sums: &[Vector<L>; PACKETS],
    rows: &mut [u8],
) {
    let [width, height] = job.size_px;
    let share = L::of(1.0 / job.rays.per_pixel() as f64);
    let grey = Grey::new();
    for (index, sum) in sums.iter().enumerate() {
        let (u, v) = place(tile, index);
        if u >= width || v >= height {
            continue;
        }
        let noise = if let Some(noise) = job.noise {
            noise.eight((v * width + u) as u64)
        } else {
            [[0.0; EIGHT]; 3]
        };
        let reds = levels(grey, sum.x * share, noise[0]);
        let greens = levels(grey, sum.y * share, noise[1]);
        let blues = levels(grey, sum.z * share, noise[2]);
        let from = 3 * (v % TILE_PX[1] * width + u);
        let pixels = rows[from..].chunks_exact_mut(3).take(EIGHT.min(width - u));
        for (lane, bytes) in pixels.enumerate() {
            bytes.copy_from_slice(&[reds[lane] as u8, greens[lane] as u8, blues[lane] as u8]);
        }
    }
}

/// Returns the grey levels of linear strengths.
#[inline(always)]
fn levels<L: Single>(grey: Grey, strength: L, noise: [f32; EIGHT]) -> [i32; EIGHT] {
    let level = grey.of_root(strength.min(L::of(1.0)).sqrt()) + L::read(noise);
    (level.max(L::of(0.0)).min(L::of(255.0)) + L::of(0.5)).whole()
}
