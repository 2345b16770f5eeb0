use nalgebra::Vector3;

use super::colors::Colors;
use super::solid::Solid;
use super::window::Window;
use crate::model::half_ball_direction;
use crate::observe::{Camera, Channels, ImageView, Mask, View};
use crate::pose::Pose;

/// Where the object's pixels were, seen from one side: a view in the object's frame.
#[derive(Debug, Clone)]
pub(super) struct Keyframe {
    camera: Camera,
    object_from_camera: Pose,
    toward: Vector3<f64>,
    mask: Vec<u8>,
}

/// Views from different sides, kept while tracking.
#[derive(Debug, Clone, Default)]
pub(super) struct Keyframes {
    all: Vec<Keyframe>,
    /// How many were kept since the body last evolved.
    pub(super) fresh: usize,
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

impl Keyframes {
    /// Keeps what an open window shows, if none was kept from this side. A given mask is kept as it
    /// is; else colours tell the object's pixels.
    pub(super) fn offer(
        &mut self,
        (window, image, camera): (&Window, &ImageView<'_>, &Camera),
        (world_from_camera, world_from_object): (&Pose, &Pose),
        (solid, colors): (&Solid, &Colors),
        given: Option<&ImageView<'_>>,
    ) {
        let object_from_camera = world_from_object.inverse() * *world_from_camera;
        let toward = object_from_camera.translation().normalize();
        let near = |one: &Keyframe| one.toward.angle(&toward) < APART;
        if self.all.len() >= MOST || self.all.iter().any(near) {
            return;
        }
        let (first, size) = window.place_px();
        let Ok(camera) = camera.crop(first, size, 1) else { return };
        let mask = match given {
            Some(mask) => Some(cut(mask, first, size)),
            None => colored(window, image, (world_from_object, solid, colors)),
        };
        let Some(mask) = mask else { return };
        self.all.push(Keyframe { camera, object_from_camera, toward, mask });
        self.fresh += 1;
    }

    /// Gives directions from the object to the sides from which nothing was kept.
    pub(super) fn unseen(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        // From the opposite side an outline is nearly the same.
        let known = |way: &Vector3<f64>| {
            self.all.iter().any(|one| one.toward.dot(way).abs() > UNSEEN.cos())
        };
        (0..SIDES).map(|side| half_ball_direction(side, SIDES)).filter(move |way| !known(way))
    }

    /// Gives them as views in the object's frame.
    pub(super) fn views(&self) -> Vec<View<'_>> {
        self.all.iter().filter_map(Keyframe::view).collect()
    }
}

impl Keyframe {
    fn view(&self) -> Option<View<'_>> {
        let image = ImageView::new(&self.mask, self.camera.size_px(), Channels::Grey).ok()?;
        View::new(self.camera, self.object_from_camera, Mask::new(image).ok()?).ok()
    }
}

fn cut(mask: &ImageView<'_>, first: [usize; 2], size: [usize; 2]) -> Vec<u8> {
    let rows = (first[1]..first[1] + size[1]).map(|v| &mask.row(v)[first[0]..first[0] + size[0]]);
    rows.flatten().copied().collect()
}

/// Tells the object's pixels by their colours, near the outline; `None` if they disagree with it.
fn colored(
    window: &Window,
    image: &ImageView<'_>,
    (pose, solid, colors): (&Pose, &Solid, &Colors),
) -> Option<Vec<u8>> {
    let projection = window.projection(pose)?;
    let outlines: Vec<_> = solid.quadrics.iter().filter_map(|q| projection.outline(q)).collect();
    let (first, [width, height]) = window.place_px();
    let beyond = BEYOND * width.max(height) as f64;
    let (mut mask, mut both, mut either) = (vec![0; width * height], 0_usize, 0_usize);
    let scores = averaged(window, image, colors);
    for v in 0..height {
        let row = (first[1] + v) as f64;
        let held = |by_px: f64| outlines.iter().filter_map(move |o| o.grown(by_px).interval(row));
        let holds =
            |(begin, end): (f64, f64), u: usize| (begin..end).contains(&((first[0] + u) as f64));
        for u in 0..width {
            let inside = held(0.0).any(|interval| holds(interval, u));
            // What the body says counts, too: only clear colours overrule it.
            let score = scores[v * width + u];
            let object = score > CLEAR
                && (inside || held(beyond).any(|interval| holds(interval, u)))
                || (score > -CLEAR && inside);
            mask[v * width + u] = if object { 255 } else { 0 };
            both += usize::from(object && inside);
            either += usize::from(object || inside);
        }
    }
    (both as f64 > LEAST_OVERLAP * either as f64).then_some(mask)
}

/// Averages the scores of a window's pixels over squares; the border scores nothing.
fn averaged(window: &Window, image: &ImageView<'_>, colors: &Colors) -> Vec<f32> {
    let (first, [width, height]) = window.place_px();
    let mut scores = Vec::with_capacity(width * height);
    for v in 0..height {
        let score = |u: usize| {
            let (u, v) = ((first[0] + u) as f64, (first[1] + v) as f64);
            window.ratio(image, colors, u, v).unwrap_or(0.0) as f32
        };
        scores.extend((0..width).map(score));
    }
    let along = |scores: &[f32], step: usize, count: usize, from: usize| {
        let end = from + (count - 1) * step;
        (from..=end).step_by(step).map(|at| scores[at]).sum::<f32>()
    };
    let (reach, mut rows, mut out) = (BLOCK / 2, vec![0.0; scores.len()], vec![0.0; scores.len()]);
    for v in 0..height {
        for u in reach..width.saturating_sub(reach) {
            rows[v * width + u] = along(&scores, 1, BLOCK, v * width + u - reach);
        }
    }
    for v in reach..height.saturating_sub(reach) {
        for u in 0..width {
            out[v * width + u] = along(&rows, width, BLOCK, (v - reach) * width + u);
        }
    }
    out
}
