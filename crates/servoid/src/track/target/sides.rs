use nalgebra::{Vector2, Vector3};

use super::colors::{self, Colors};
use super::solid::Solid;
use crate::model::half_ball_direction;
use crate::observe::{Camera, Channels, ImageView, Mask, View};
use crate::pose::Pose;
use crate::shape::{Outline, Projection};
use crate::track::frame::window::Window;

/// What was seen of the object from one side, in the object's frame.
#[derive(Debug, Clone)]
struct Side {
    camera: Camera,
    object_from_camera: Pose,
    /// The keyframe that its view belonged to: it moves with that.
    keyframe: usize,
    toward: Vector3<f64>,
    pixels: Vec<u8>,
    channels: Channels,
    /// Empty until it is made.
    mask: Vec<u8>,
}

/// Views from different sides, kept while tracking.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sides {
    all: Vec<Side>,
    /// How many were kept since the body last evolved.
    pub(crate) fresh: usize,
}

/// Least angle between the sides of two of them, in radians.
const APART: f64 = 0.15;
/// Least angle from all of them of a side that counts as unseen, in radians.
const UNSEEN: f64 = 0.6;
/// Sides that are asked about.
const SIDES: usize = 24;
/// Most that are kept.
const MOST: usize = 24;
/// Pixels beyond the outline that may still be the object's, as a share of the window.
const BEYOND: f64 = 0.08;
/// Side of the square over which the scores of pixels are averaged, in pixels.
const BLOCK: usize = 5;
/// Sum of the scores of a square from which on its colour is clear.
const CLEAR: f32 = 0.8 * (BLOCK * BLOCK) as f32;
/// Least overlap of a mask with the outline for it to be believed.
const LEAST_OVERLAP: f64 = 0.6;

impl Sides {
    /// Keeps what an open window shows, if none was kept from this side; a given mask as it is.
    pub(crate) fn offer(
        &mut self,
        (window, image, camera): (&Window, &ImageView<'_>, &Camera),
        (world_from_camera, world_from_object): (&Pose, &Pose),
        (keyframe, given): (usize, Option<&ImageView<'_>>),
    ) {
        let object_from_camera = world_from_object.inverse() * *world_from_camera;
        let toward = object_from_camera.translation().normalize();
        let near = |one: &Side| one.toward.angle(&toward) < APART;
        if self.all.len() >= MOST || self.all.iter().any(near) {
            return;
        }
        let (first, size) = window.place_px();
        let Ok(camera) = camera.crop(first, size, 1) else { return };
        let mask = given.map_or_else(Vec::new, |mask| cut(mask, first, size));
        let (pixels, channels) = (cut(image, first, size), image.channels());
        self.all.push(Side {
            camera,
            object_from_camera,
            keyframe,
            toward,
            pixels,
            channels,
            mask,
        });
        self.fresh += 1;
    }

    /// Moves them by what the keyframes of some numbers are moved by, in the object's frame.
    pub(crate) fn move_by(&mut self, by: impl Fn(usize) -> Pose) {
        for one in &mut self.all {
            let moved = by(one.keyframe).inverse() * one.object_from_camera;
            one.object_from_camera = moved.renormalized();
            one.toward = one.object_from_camera.translation().normalize();
        }
    }

    /// Tells the object's pixels by their colours where no mask was given; drops views in which they
    /// disagree with the body's outline.
    pub(crate) fn mark(&mut self, solid: &Solid, colors: &Colors) {
        self.all.retain_mut(|one| one.mark(solid, colors).is_some());
    }

    /// Gives directions from the object to the sides from which nothing was kept.
    pub(crate) fn unseen(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        // From the opposite side an outline is nearly the same.
        let known = |way: &Vector3<f64>| {
            self.all.iter().any(|one| one.toward.dot(way).abs() > libm::cos(UNSEEN))
        };
        (0..SIDES).map(|side| half_ball_direction(side, SIDES)).filter(move |way| !known(way))
    }

    /// Gives those that have a mask as views in the object's frame.
    pub(crate) fn views(&self) -> Vec<View<'_>> {
        self.all.iter().filter_map(Side::view).collect()
    }
}

impl Side {
    fn view(&self) -> Option<View<'_>> {
        let image = ImageView::new(&self.mask, self.camera.size_px(), Channels::Grey).ok()?;
        View::new(self.camera, self.object_from_camera, Mask::new(image).ok()?).ok()
    }

    fn mark(&mut self, solid: &Solid, colors: &Colors) -> Option<()> {
        if !self.mask.is_empty() {
            return Some(());
        }
        let projection = Projection::new(&self.camera, &self.object_from_camera);
        let outlines: Vec<_> = solid.outlines(&projection).collect();
        let (middle, _) = projection.pixel(&Vector3::zeros())?;
        let scores = self.scores(colors, &middle)?;
        let [width, height] = self.camera.size_px();
        let beyond = BEYOND * width.max(height) as f64;
        let (mut mask, mut both, mut either) = (vec![0; width * height], 0_usize, 0_usize);
        for v in 0..height {
            for u in 0..width {
                let inside = holds(&outlines, 0.0, [u, v]);
                // What the body says counts, too: only clear colours overrule it.
                let score = scores[v * width + u];
                let object = score > CLEAR && (inside || holds(&outlines, beyond, [u, v]))
                    || (score > -CLEAR && inside);
                mask[v * width + u] = if object { u8::MAX } else { 0 };
                both += usize::from(object && inside);
                either += usize::from(object || inside);
            }
        }
        self.mask = mask;
        (both as f64 > LEAST_OVERLAP * either as f64).then_some(())
    }

    /// Sums the scores of pixels over squares; the border scores nothing.
    fn scores(&self, colors: &Colors, middle: &Vector2<f64>) -> Option<Vec<f32>> {
        let size = self.camera.size_px();
        let image = ImageView::new(&self.pixels, size, self.channels).ok()?;
        let [width, height] = size;
        let palette = colors.of(self.channels);
        let mut scores = Vec::with_capacity(width * height);
        for v in 0..height {
            for u in 0..width {
                let away = Vector2::new(u as f64, v as f64) - middle;
                let side = colors::side(away.x as f32, away.y as f32);
                scores.push(palette.ratio(colors::bin(&image, u, v), side));
            }
        }
        let along = |scores: &[f32], step: usize, from: usize| {
            (0..BLOCK).map(|i| scores[from + i * step]).sum::<f32>()
        };
        let reach = BLOCK / 2;
        let (mut rows, mut out) = (vec![0.0; scores.len()], vec![0.0; scores.len()]);
        for v in 0..height {
            for u in reach..width.saturating_sub(reach) {
                rows[v * width + u] = along(&scores, 1, v * width + u - reach);
            }
        }
        for v in reach..height.saturating_sub(reach) {
            for u in 0..width {
                out[v * width + u] = along(&rows, width, (v - reach) * width + u);
            }
        }
        Some(out)
    }
}

/// Says whether outlines, grown by some pixels, hold a pixel.
fn holds(outlines: &[Outline], by_px: f64, [u, v]: [usize; 2]) -> bool {
    outlines.iter().any(|outline| {
        let held = outline.grown(by_px).interval(v as f64);
        held.is_some_and(|(begin, end)| (begin..end).contains(&(u as f64)))
    })
}

/// Copies a part of an image.
fn cut(image: &ImageView<'_>, first: [usize; 2], size: [usize; 2]) -> Vec<u8> {
    let bytes = image.channels().count();
    let (begin, end) = (first[0] * bytes, (first[0] + size[0]) * bytes);
    (first[1]..first[1] + size[1]).flat_map(|v| &image.row(v)[begin..end]).copied().collect()
}
