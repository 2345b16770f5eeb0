use nalgebra::{Vector2, Vector3};

use super::colors::{self, Colors};
use super::solid::Solid;
use crate::camera::{Camera, Channels, ImageView, Mask, View};
use crate::model::half_ball_direction;
use crate::pose::Pose;
use crate::shape::{Outline, Projection};
use crate::track::frame::window::Window;

/// A view of the object from one side, in the object's frame.
#[derive(Debug, Clone)]
struct Side {
    /// Running number of the stored sides.
    id: usize,
    camera: Camera,
    object_from_camera: Pose,
    /// The keyframe of its view, with which it moves.
    keyframe: usize,
    toward: Vector3<f64>,
    pixels: Vec<u8>,
    channels: Channels,
    /// Empty until it is computed.
    mask: Vec<u8>,
    /// Whether the mask was given.
    is_given: bool,
}

/// Views from different sides, stored while tracking.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sides {
    all: Vec<Side>,
    /// Number stored since the body last evolved.
    pub(crate) fresh: usize,
    /// The next `id`.
    next: usize,
}

/// The masks computed for sides, each with its `id`; none for a side whose colours disagree with
/// the body's outline.
pub(crate) type Marks = Vec<(usize, Option<Vec<u8>>)>;

/// Least angle between two sides, in radians.
const SIDES_APART: f64 = 0.15;
/// Least angle of an unseen side from all stored ones, in radians.
const UNSEEN: f64 = 0.6;
/// Number of directions that are tested for unseen sides.
const SIDES: usize = 24;
/// Most that are kept.
const MOST_SIDES: usize = 24;
/// Distance beyond the outline up to which pixels may belong to the object, as a share of the
/// window.
const BEYOND: f64 = 0.08;
/// Side of the square over which the scores of pixels are summed, in pixels.
const BLOCK: usize = 5;
/// Sum of the scores of a square from which on its colour is unambiguous.
const CLEAR: f32 = 0.8 * (BLOCK * BLOCK) as f32;
/// Least overlap of a mask with the outline for it to be accepted.
const LEAST_OVERLAP: f64 = 0.6;

impl Sides {
    /// Stores the view in an open window if none was stored from this side; a given mask is stored
    /// unchanged. If the storage is full, one of the two nearest sides is dropped in favour of one
    /// that is farther from all others.
    pub(crate) fn offer(
        &mut self,
        (window, image, camera): (&Window, &ImageView<'_>, &Camera),
        (world_from_camera, world_from_object): (&Pose, &Pose),
        (keyframe, given): (usize, Option<&ImageView<'_>>),
    ) {
        let object_from_camera = world_from_object.inverse() * *world_from_camera;
        let toward = object_from_camera.translation().normalize();
        let apart = self.all.iter().map(|one| one.toward.angle(&toward)).fold(f64::MAX, f64::min);
        if apart < SIDES_APART {
            return;
        }
        let (first, size) = window.place_px();
        let Ok(camera) = camera.crop(first, size, 1) else { return };
        let mask = given.map_or_else(Vec::new, |mask| cut(mask, first, size));
        let (pixels, channels) = (cut(image, first, size), image.channels());
        if self.all.len() >= MOST_SIDES {
            let Some(redundant) = self.redundant(apart) else { return };
            self.all.remove(redundant);
        }
        self.all.push(Side {
            id: self.next,
            camera,
            object_from_camera,
            keyframe,
            toward,
            pixels,
            channels,
            mask,
            is_given: given.is_some(),
        });
        self.fresh += 1;
        self.next += 1;
    }

    /// Returns the later of the two nearest sides, if they are nearer to each other than `apart`.
    fn redundant(&self, apart: f64) -> Option<usize> {
        let mut nearest = (apart, None);
        for (at, one) in self.all.iter().enumerate().filter(|(_, one)| !one.is_given) {
            for other in &self.all[..at] {
                let between = one.toward.angle(&other.toward);
                if between < nearest.0 {
                    nearest = (between, Some(at));
                }
            }
        }
        nearest.1
    }

    /// Moves the sides by the motions of their keyframes, in the object's frame.
    pub(crate) fn move_by(&mut self, by: impl Fn(usize) -> Pose) {
        for one in &mut self.all {
            let moved = by(one.keyframe).inverse() * one.object_from_camera;
            one.object_from_camera = moved.renormalized();
            one.toward = one.object_from_camera.translation().normalize();
        }
    }

    /// Segments the object by its colours where no mask was given; drops views in which they
    /// disagree with the body's outline. Returns the computed masks.
    pub(crate) fn mark(&mut self, solid: &Solid, colors: &Colors) -> Marks {
        let mut marks = Marks::new();
        self.all.retain_mut(|one| {
            let is_new = one.mask.is_empty();
            let is_good = one.mark(solid, colors).is_some();
            if is_new {
                marks.push((one.id, is_good.then(|| one.mask.clone())));
            }
            is_good
        });
        marks
    }

    /// Takes over masks that were computed for a copy.
    pub(crate) fn take_over(&mut self, marks: Marks) {
        for (id, mask) in marks {
            let Ok(at) = self.all.binary_search_by_key(&id, |one| one.id) else { continue };
            match mask {
                Some(mask) => self.all[at].mask = mask,
                None => drop(self.all.remove(at)),
            }
        }
    }

    /// Returns directions from the object to the sides that were not seen.
    pub(crate) fn unseen(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        // From the opposite side an outline is nearly the same.
        let known = |way: &Vector3<f64>| {
            self.all.iter().any(|one| one.toward.dot(way).abs() > libm::cos(UNSEEN))
        };
        (0..SIDES).map(|side| half_ball_direction(side, SIDES)).filter(move |way| !known(way))
    }

    /// Returns the sides that have a mask as views in the object's frame.
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
        let image = ImageView::new(&self.pixels, self.camera.size_px(), self.channels).ok()?;
        let scores = scores(&image, colors, &middle);
        let [width, height] = self.camera.size_px();
        let beyond = BEYOND * width.max(height) as f64;
        let (mut mask, mut both, mut either) = (vec![0; width * height], 0_usize, 0_usize);
        for v in 0..height {
            for u in 0..width {
                let inside = holds(&outlines, 0.0, [u, v]);
                // The body's outline counts, too: only unambiguous colours overrule it.
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
}

/// Sums the scores of pixels over squares; the border has a score of 0. `middle` is that of the
/// object.
pub(crate) fn scores(image: &ImageView<'_>, colors: &Colors, middle: &Vector2<f64>) -> Vec<f32> {
    let [width, height] = image.size_px();
    let palette = colors.of(image.channels());
    let mut scores = Vec::with_capacity(width * height);
    for v in 0..height {
        for u in 0..width {
            let away = Vector2::new(u as f64, v as f64) - middle;
            let side = colors::side(away.x as f32, away.y as f32);
            scores.push(palette.ratio(colors::bin(image, u, v), side));
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
    out
}

/// Returns whether outlines, grown by some pixels, contain a pixel.
pub(crate) fn holds(outlines: &[Outline], by_px: f64, [u, v]: [usize; 2]) -> bool {
    outlines.iter().any(|outline| {
        let held = outline.grown(by_px).interval(v as f64);
        held.is_some_and(|(begin, end)| (begin..end).contains(&(u as f64)))
    })
}

/// Copies a part of an image.
pub(crate) fn cut(image: &ImageView<'_>, first: [usize; 2], size: [usize; 2]) -> Vec<u8> {
    let bytes = image.channels().count();
    let (begin, end) = (first[0] * bytes, (first[0] + size[0]) * bytes);
    (first[1]..first[1] + size[1]).flat_map(|v| &image.row(v)[begin..end]).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Twist;

    fn side(id: usize, degrees: f64) -> Side {
        let object_from_camera =
            Pose::exp(&Twist::new(0.0, 0.0, 0.0, 0.0, degrees.to_radians(), 0.0))
                * Pose::exp(&Twist::new(0.0, 0.0, 0.4, 0.0, 0.0, 0.0));
        Side {
            id,
            camera: Camera::new([4, 4], [4.0; 2], [1.5; 2]).unwrap(),
            object_from_camera,
            keyframe: 0,
            toward: object_from_camera.translation().normalize(),
            pixels: vec![0; 16],
            channels: Channels::Grey,
            mask: Vec::new(),
            is_given: id == 0,
        }
    }

    fn of(degrees: &[f64]) -> Sides {
        let all: Vec<_> = degrees.iter().enumerate().map(|(id, at)| side(id, *at)).collect();
        Sides { next: all.len(), all, fresh: 0 }
    }

    #[test]
    fn the_later_of_the_two_nearest_sides_makes_room_but_never_a_given_one() {
        let sides = of(&[0.0, 40.0, 9.0, 52.0]);
        assert_eq!(sides.redundant(0.3), Some(2));
        assert_eq!(sides.redundant(0.15), None);
        let given_last = Sides { all: vec![side(1, 0.0), side(0, 9.0)], ..Sides::default() };
        assert_eq!(given_last.redundant(0.3), None);
    }

    #[test]
    fn masks_are_taken_over_by_the_sides_that_are_still_there() {
        let mut sides = of(&[0.0, 20.0, 40.0, 60.0]);
        sides.all.remove(1);
        let mask = vec![1_u8; 16];
        sides.take_over(vec![(1, Some(mask.clone())), (2, Some(mask.clone())), (3, None)]);
        let left: Vec<_> = sides.all.iter().map(|one| (one.id, one.mask.len())).collect();
        assert_eq!(left, [(0, 0), (2, 16)]);
    }
}
