use nalgebra::{Vector2, Vector3};

use crate::camera::{Camera, Channels, ImageView, Pyramid};
use crate::fitness::{Agreement, Backend, ScoreMap};
use crate::pose::Pose;
use crate::shape::{Outline, Projection};
use crate::track::target::colors::{self, Belongs, Colors};
use crate::track::target::solid::Solid;

/// The part of a camera's image around the expected object: its brightness at several resolutions
/// and the scores of its colours. Its memory is reused from image to image.
#[derive(Debug, Clone, Default)]
pub(crate) struct Window {
    /// Projection from the world to the image's pixels.
    from_world: Option<Projection>,
    pub(crate) pyramid: Pyramid,
    map: ScoreMap,
    first_px: [usize; 2],
    size_px: [usize; 2],
    /// Standard deviation of the pyramid's noise, in grey levels.
    pub(crate) noise: f64,
    /// Mean brightness, in grey levels.
    pub(crate) light: f64,
    /// Centre of the object's image, if it is known.
    middle: Option<Vector2<f64>>,
}

/// Rows of the image per row of the map.
const STRIDE: usize = 4;

/// Standard deviation of a patch without its noise, relative to the mean brightness of its window,
/// that shading does not reach: sequences of plain objects have at most 21 such points per camera,
/// and those with a print seldom fewer than 25.
const TEXTURED: f64 = 0.08;

impl Window {
    /// Reads an image around the outlines of the body at a pose; the window is larger than they are
    /// by `margin` of their size. Returns `false` if the object is not in the image.
    pub(crate) fn open(
        &mut self,
        camera: &Camera,
        world_from_camera: &Pose,
        image: &ImageView<'_>,
        (world_from_object, solid, margin): (&Pose, &Solid, f64),
        colors: Option<&Colors>,
    ) -> bool {
        let from_world = Projection::new(camera, world_from_camera);
        self.from_world = None;
        let projection = from_world.moved(world_from_object);
        let Some((low, high)) = bounds(solid.outlines(&projection)) else { return false };
        let extent = (high - low).amax();
        let reach = margin * extent + 16.0;
        let size = camera.size_px();
        let cut = |at: f64, i: usize| at.clamp(0.0, size[i] as f64) as usize;
        let first = [0, 1].map(|i| cut(low[i] - reach, i));
        let last = [0, 1].map(|i| cut(high[i] + reach, i));
        if (0..2).any(|i| first[i] + LEAST_SIDE > last[i]) {
            return false;
        }
        (self.first_px, self.size_px) = (first, [0, 1].map(|i| last[i] - first[i]));
        self.middle = Some((low + high) * 0.5);
        self.read(from_world, image, colors);
        true
    }

    /// Reads the whole image.
    pub(crate) fn open_all_over(
        &mut self,
        camera: &Camera,
        world_from_camera: &Pose,
        image: &ImageView<'_>,
        colors: Option<&Colors>,
    ) {
        (self.first_px, self.size_px) = ([0, 0], camera.size_px());
        self.middle = None;
        self.read(Projection::new(camera, world_from_camera), image, colors);
    }

    fn read(&mut self, from_world: Projection, image: &ImageView<'_>, colors: Option<&Colors>) {
        self.pyramid.read(image, self.first_px, self.size_px);
        self.noise = f64::from(self.pyramid.denoise());
        self.light = f64::from(self.pyramid.plane(Pyramid::LEVELS - 1).mean());
        self.from_world = Some(from_world);
        if let Some(colors) = colors {
            self.score(image, colors);
        }
    }

    /// Returns on which side of the object a pixel lies.
    #[inline]
    fn side(&self, u: usize, v: usize) -> usize {
        self.middle.map_or(colors::ANY_SIDE, |middle| {
            colors::side((u as f64 - middle.x) as f32, (v as f64 - middle.y) as f32)
        })
    }

    /// Returns whether a patch of the surface has the contrast of a pattern.
    pub(crate) fn shows_texture(&self, found: &Agreement) -> bool {
        found.contrast >= self.least_contrast()
    }

    /// Returns the least contrast of a pattern with noise, in grey levels.
    pub(crate) fn least_contrast(&self) -> f64 {
        libm::hypot(TEXTURED * self.light, self.noise)
    }

    /// Returns the noise as a share of the least contrast of a pattern.
    pub(crate) fn noise_share(&self) -> f64 {
        self.noise / (TEXTURED * self.light)
    }

    /// Returns the projection of the object's frame at a pose, if the window is open.
    pub(crate) fn projection(&self, world_from_object: &Pose) -> Option<Projection> {
        Some(self.from_world?.moved(world_from_object))
    }

    /// Returns first column and row, and width and height, in pixels of the image.
    pub(crate) fn place_px(&self) -> ([usize; 2], [usize; 2]) {
        (self.first_px, self.size_px)
    }

    /// Closes the window.
    pub(crate) fn close(&mut self) {
        self.from_world = None;
    }

    /// Returns whether the window has one brightness everywhere.
    pub(crate) fn is_blank(&self) -> bool {
        self.pyramid.plane(Pyramid::LEVELS - 1).deviation() < BLANK
    }

    pub(crate) fn is_open(&self) -> bool {
        self.from_world.is_some()
    }

    fn score(&mut self, image: &ImageView<'_>, colors: &Colors) {
        let ([left, top], [width, height]) = (self.first_px, self.size_px);
        let middle = self.middle.map(|m| (m.x as f32 - left as f32, m.y as f32 - top as f32));
        let grey = image.channels() == Channels::Grey;
        let palette = colors.of(image.channels());
        self.map.refill([width, height], STRIDE, |v| {
            let row = image.row(top + v);
            (0..width).map(move |u| {
                let at = left + u;
                let bin = if grey {
                    colors::grey_bin(row[at])
                } else {
                    colors::rgb_bin([row[3 * at], row[3 * at + 1], row[3 * at + 2]])
                };
                let side = middle.map_or(colors::ANY_SIDE, |(middle_u, middle_v)| {
                    colors::side(u as f32 - middle_u, v as f32 - middle_v)
                });
                palette.quanta(bin, side)
            })
        });
    }

    /// Returns the camera's position and unit rays through a grid of pixels over the window, with
    /// `columns` per row; with fewer if the window is so high that there would be more than twice
    /// as many rows.
    pub(crate) fn rays(
        &self,
        columns: usize,
    ) -> Option<(Vector3<f64>, impl Iterator<Item = Vector3<f64>>)> {
        let projection = self.from_world?;
        let inverse = projection.linear.try_inverse()?;
        let eye = projection.eye()?;
        let ([left, top], [width, height]) = (self.first_px, self.size_px);
        let step = width.max(height / 2) as f64 / columns as f64;
        let columns = (width as f64 / step).ceil() as usize;
        let rows = (height as f64 / step).ceil() as usize;
        let rays = (0..columns * rows).map(move |at| {
            let u = left as f64 + (0.5 + (at % columns) as f64) * step;
            let v = top as f64 + (0.5 + (at / columns) as f64) * step;
            (inverse * Vector3::new(u, v, 1.0)).normalize()
        });
        Some((eye, rays))
    }

    /// Returns the point of the world that the camera sees at a pixel and a depth.
    pub(crate) fn point(&self, px: &Vector2<f64>, depth: f64) -> Option<Vector3<f64>> {
        let projection = self.from_world?;
        Some(projection.eye()? + projection.linear.try_inverse()? * px.push(1.0) * depth)
    }

    /// Returns the sum of the scores inside the body's outline at a pose, and the pixels inside.
    pub(crate) fn region(&self, projection: &Projection, solid: &Solid) -> (f64, f64) {
        let here = projection.shifted(self.first_px.map(|x| x as f64));
        let sums = self.map.sums(Backend::used(), &here, &solid.quadrics);
        (sums.score, sums.area)
    }

    /// Returns the log-likelihood ratio of the pixel nearest to a position; `None` outside the
    /// window.
    pub(crate) fn ratio(
        &self,
        image: &ImageView<'_>,
        colors: &Colors,
        u: f64,
        v: f64,
    ) -> Option<f64> {
        let ([left, top], [width, height]) = (self.first_px, self.size_px);
        let (right, below) = (u + 0.5 - left as f64, v + 0.5 - top as f64);
        if !(right >= 0.0 && below >= 0.0 && right < width as f64 && below < height as f64) {
            return None;
        }
        let (u, v) = (left + right as usize, top + below as usize);
        let palette = colors.of(image.channels());
        Some(f64::from(palette.ratio(colors::bin(image, u, v), self.side(u, v))))
    }

    /// Counts the window's pixels as object inside the outlines and as background outside; pixels
    /// within `border_px` of the outlines are not counted.
    pub(crate) fn count_colors(
        &self,
        image: &ImageView<'_>,
        outlines: &[Outline],
        border_px: f64,
        colors: &mut Colors,
    ) {
        let palette = colors.of_mut(image.channels());
        let ([left, top], [width, height]) = (self.first_px, self.size_px);
        let mut labels = [Belongs::Background; MOST_LABELS];
        let labels = &mut labels[..width.div_ceil(TEACHING_STRIDE)];
        for v in (0..height).step_by(TEACHING_STRIDE) {
            labels.fill(Belongs::Background);
            for (by_px, belongs) in [(border_px, Belongs::Unknown), (-border_px, Belongs::Object)] {
                for outline in outlines {
                    let held = outline.grown(by_px).interval((top + v) as f64);
                    let Some((begin, end)) = held else { continue };
                    let cut = |u: f64| {
                        let label = ((u - left as f64) / TEACHING_STRIDE as f64).max(0.0);
                        (label as usize).min(labels.len())
                    };
                    let (begin, end) = (cut(begin), cut(end));
                    labels[begin..end].fill(belongs);
                }
            }
            let shift = v / TEACHING_STRIDE % 2;
            for (at, &belongs) in labels.iter().enumerate() {
                let u = (at * TEACHING_STRIDE + shift).min(width - 1);
                if belongs != Belongs::Unknown {
                    let side = self.side(left + u, top + v);
                    palette.count(colors::bin(image, left + u, top + v), belongs, side);
                }
            }
        }
    }

    /// Counts the window's pixels as a mask labels them.
    pub(crate) fn count_mask(
        &self,
        image: &ImageView<'_>,
        mask: &ImageView<'_>,
        colors: &mut Colors,
    ) {
        let palette = colors.of_mut(image.channels());
        let ([left, top], [width, height]) = (self.first_px, self.size_px);
        for v in top..top + height {
            for u in left..left + width {
                let belongs =
                    if mask.row(v)[u] == 0 { Belongs::Background } else { Belongs::Object };
                palette.count(colors::bin(image, u, v), belongs, self.side(u, v));
            }
        }
    }
}

/// Standard deviation of brightness, in grey levels, below which a window is blank.
const BLANK: f32 = 1.0;
/// Least width and height of a window, in pixels.
const LEAST_SIDE: usize = 24;
/// Pixels between those that are counted for the colours.
const TEACHING_STRIDE: usize = 3;
/// Most of them in a row.
const MOST_LABELS: usize = Camera::MAX_SIDE_PX.div_ceil(TEACHING_STRIDE);

/// Returns the bounding box of outlines in the image, if there are any.
pub(crate) fn bounds(
    outlines: impl IntoIterator<Item = Outline>,
) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let mut found: Option<(Vector2<f64>, Vector2<f64>)> = None;
    for outline in outlines {
        let covariance = outline.covariance_px();
        let half = Vector2::new(covariance[(0, 0)].sqrt(), covariance[(1, 1)].sqrt());
        let (low, high) = (outline.center_px() - half, outline.center_px() + half);
        found = Some(found.map_or((low, high), |(a, b)| (a.inf(&low), b.sup(&high))));
    }
    found
}
