use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, Vector2, Vector3};

use crate::camera::{Plane, Pyramid};
use crate::pose::Pose;
use crate::shape::Projection;

/// Samples along a side of a patch.
const SIDE: usize = 4;
/// Samples of a patch.
pub(crate) const SAMPLES: usize = SIDE * SIDE;
/// Grains, of one pixel of its level or less, between the samples of a patch.
const SPACING: f64 = 2.0;
/// Least standard deviation of a pattern, in grey levels; a patch with less is noise.
const LEAST_CONTRAST: f32 = 3.0;

/// A small piece of the surface in an image, normalised for brightness and contrast: zero mean,
/// unit length.
pub type Patch = [f32; SAMPLES];

/// A point of the object's surface that can be recognised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Its position, in the object's frame.
    pub position: Vector3<f64>,
    /// Unit vector out of the surface.
    pub normal: Vector3<f64>,
    /// Steps along the surface that moved its image one grain right and one down where it was
    /// learned: half of the spacing of its template.
    pub steps: [Vector3<f64>; 2],
    /// Unit vector to the camera by which it was learned.
    pub toward: Vector3<f64>,
    /// Its template at each resolution at which it lay completely on the object.
    pub templates: [Option<Patch>; Pyramid::LEVELS],
    /// Its colour.
    pub color: [u8; 3],
}

/// Agreement of a piece of the surface with an image, and its shift to a better agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Agreement {
    /// Its pixel.
    pub pixel: Vector2<f64>,
    /// Derivative of its pixel by the point in the object's frame.
    pub slope: Matrix2x3<f64>,
    /// Normalised cross-correlation with its template, -1 to 1.
    pub correlation: f64,
    /// Sum of the squared gradients of the normalised patch, per square pixel.
    pub tensor: Matrix2<f64>,
    /// Gradients times differences: `tensor⁻¹ pull` is the shift, in pixels, that moves the image
    /// of the point to where its template is.
    pub pull: Vector2<f64>,
    /// Standard deviation of the image's patch, in grey levels.
    pub contrast: f64,
    /// Mean of the image's patch, in grey levels.
    pub brightness: f64,
}

impl SurfacePoint {
    /// Extracts the piece of surface at `position` with a normal from an image; `None` if the
    /// surface is seen at too flat an angle or shows no pattern. Its `grain` is 1 pixel, or less
    /// where the object's image is small; `reach_px` is how far the object extends around it.
    #[must_use]
    pub fn extract(
        projection: &Projection,
        pyramid: &Pyramid,
        [position, normal, toward]: [Vector3<f64>; 3],
        (grain, reach_px): (f64, f64),
    ) -> Option<Self> {
        let (_, slope) = projection.pixel(&position)?;
        let first = normal.cross(&least_axis(&normal)).normalize();
        let tangents = Matrix3x2::from_columns(&[first, normal.cross(&first)]);
        let back = (slope * tangents).try_inverse()?;
        let steps = tangents * back * grain;
        let mut point = Self {
            position,
            normal,
            steps: [steps.column(0).into(), steps.column(1).into()],
            toward,
            templates: [None; Pyramid::LEVELS],
            color: [0; 3],
        };
        for level in 0..Pyramid::LEVELS {
            if 0.5 * SIDE as f64 * SPACING * grain * f64::from(1 << level) > reach_px {
                break;
            }
            point.templates[level] = point.patch(projection, pyramid, level);
        }
        point.templates[0].is_some().then_some(point)
    }

    /// Moves the piece of surface in the object's frame; its templates do not change.
    pub fn move_by(&mut self, motion: &Pose) {
        self.position = motion.transform(&self.position);
        self.steps = self.steps.map(|way| motion.rotation() * way);
        self.normal = motion.rotation() * self.normal;
        self.toward = motion.rotation() * self.toward;
    }

    /// Reads the patch of the piece of surface in an image; `None` if it is not completely inside
    /// or shows no pattern.
    #[must_use]
    pub fn patch(&self, projection: &Projection, pyramid: &Pyramid, level: usize) -> Option<Patch> {
        let (pixel, slope) = projection.pixel(&self.position)?;
        let grid = self.grid(pixel, &slope, pyramid, level)?;
        let values = grid.map(pyramid.plane(level));
        let (patch, length) = normalized(values)?;
        (length > LEAST_CONTRAST * (SAMPLES as f32).sqrt()).then_some(patch)
    }

    /// Returns the normalised cross-correlation between the template of the piece of surface and an
    /// image.
    #[must_use]
    pub fn correlation(
        &self,
        projection: &Projection,
        pyramid: &Pyramid,
        level: usize,
    ) -> Option<f64> {
        let template = self.templates[level].as_ref()?;
        let (pixel, slope) = projection.pixel(&self.position)?;
        self.likeness(template, (pixel, &slope), pyramid, level).map(f64::from)
    }

    /// Correlates the template of the piece of surface with an image at positions around its
    /// expected one, in steps of a pixel of the resolution, row by row, up to `reach` steps to each
    /// side; outside the image the correlation is 0. Does nothing if it has no template or is not
    /// in view.
    pub fn correlations(
        &self,
        projection: &Projection,
        pyramid: &Pyramid,
        (level, reach): (usize, usize),
        mut each: impl FnMut(usize, f32),
    ) {
        let (Some(template), Some((pixel, slope))) =
            (self.templates[level].as_ref(), projection.pixel(&self.position))
        else {
            return;
        };
        let (side, step) = (2 * reach + 1, f64::from(1_u32 << level));
        for at in 0..side * side {
            let by = Vector2::new((at % side) as f64, (at / side) as f64);
            let beside = pixel + (by - Vector2::repeat(reach as f64)) * step;
            each(at, self.likeness(template, (beside, &slope), pyramid, level).unwrap_or(0.0));
        }
    }

    /// Correlates a template with the image at a pixel; `None` if it is not completely inside or
    /// uniform.
    #[inline(always)]
    fn likeness(
        &self,
        template: &Patch,
        (pixel, slope): (Vector2<f64>, &Matrix2x3<f64>),
        pyramid: &Pyramid,
        level: usize,
    ) -> Option<f32> {
        let grid = self.grid(pixel, slope, pyramid, level)?;
        let (patch, _) = normalized(grid.map(pyramid.plane(level)))?;
        Some(patch.iter().zip(template).map(|(a, b)| a * b).sum())
    }

    /// Returns how far the samples of the piece of surface reach to the right and down of its
    /// centre, in pixels of an image; `None` if it has no template at this resolution. `slope` is
    /// the derivative of its pixel by the point.
    #[must_use]
    pub fn reach_px(&self, slope: &Matrix2x3<f64>, level: usize) -> Option<Vector2<f64>> {
        self.templates[level].as_ref()?;
        let half = 0.5 * (SIDE as f64 - 1.0) * SPACING * f64::from(1_u32 << level);
        Some(((slope * self.steps[0]).abs() + (slope * self.steps[1]).abs()) * half)
    }

    /// Compares the piece of surface with an image.
    #[must_use]
    pub fn agreement(
        &self,
        projection: &Projection,
        pyramid: &Pyramid,
        level: usize,
    ) -> Option<Agreement> {
        let template = self.templates[level].as_ref()?;
        let (pixel, slope) = projection.pixel(&self.position)?;
        let grid = self.grid(pixel, &slope, pyramid, level)?;
        let plane = pyramid.plane(level);
        let (mut values, mut right, mut down) = ([0.0; SAMPLES], [0.0; SAMPLES], [0.0; SAMPLES]);
        for (at, (u, v)) in grid.places().enumerate() {
            let sample = plane.sample(u, v);
            (values[at], right[at], down[at]) = (sample.value, sample.right, sample.down);
        }
        let (patch, length) = normalized(values)?;
        let correlation: f32 = patch.iter().zip(template).map(|(a, b)| a * b).sum();
        // The change of the normalised patch by a shift: its gradients without their mean and
        // without the part that only changes the contrast.
        let (right, down) = (flattened(right, &patch, length), flattened(down, &patch, length));
        let dot =
            |a: &Patch, b: &Patch| f64::from(a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>());
        let apart = std::array::from_fn(|i| template[i] - patch[i]);
        let per_pixel = 1.0 / f64::from(1_u32 << level);
        let cross = dot(&right, &down);
        Some(Agreement {
            pixel,
            slope,
            correlation: f64::from(correlation),
            tensor: Matrix2::new(dot(&right, &right), cross, cross, dot(&down, &down))
                * (per_pixel * per_pixel),
            pull: Vector2::new(dot(&right, &apart), dot(&down, &apart)) * per_pixel,
            contrast: f64::from(length) / (SAMPLES as f64).sqrt(),
            brightness: f64::from(values.iter().sum::<f32>()) / SAMPLES as f64,
        })
    }

    /// Places the samples on a level's plane; `None` if one lies outside.
    #[inline(always)]
    fn grid(
        &self,
        pixel: Vector2<f64>,
        slope: &Matrix2x3<f64>,
        pyramid: &Pyramid,
        level: usize,
    ) -> Option<Grid> {
        let [u, v] = pyramid.place(pixel.x, pixel.y, level);
        let right = slope * self.steps[0] * SPACING;
        let down = slope * self.steps[1] * SPACING;
        let half = 0.5 * (SIDE as f64 - 1.0);
        let reach = (right.abs() + down.abs()) * half;
        let plane = pyramid.plane(level);
        let inside = plane.holds(u - reach.x, v - reach.y) && plane.holds(u + reach.x, v + reach.y);
        inside.then(|| Grid {
            first: [u - half * (right.x + down.x), v - half * (right.y + down.y)].map(|x| x as f32),
            right: [right.x as f32, right.y as f32],
            down: [down.x as f32, down.y as f32],
        })
    }
}

/// Positions of the samples of a patch.
struct Grid {
    first: [f32; 2],
    right: [f32; 2],
    down: [f32; 2],
}

impl Grid {
    #[inline(always)]
    fn places(&self) -> impl Iterator<Item = (f32, f32)> {
        (0..SAMPLES).map(|at| {
            let (i, j) = ((at % SIDE) as f32, (at / SIDE) as f32);
            let place = |k: usize| self.first[k] + i * self.right[k] + j * self.down[k];
            (place(0), place(1))
        })
    }

    #[inline(always)]
    fn map(&self, plane: &Plane) -> Patch {
        let mut values = [0.0; SAMPLES];
        for (value, (u, v)) in values.iter_mut().zip(self.places()) {
            *value = plane.sample(u, v).value;
        }
        values
    }
}

/// Normalises a patch and returns its length; `None` if nothing is left.
#[inline(always)]
fn normalized(values: Patch) -> Option<(Patch, f32)> {
    let mean = values.iter().sum::<f32>() / SAMPLES as f32;
    let centered = values.map(|x| x - mean);
    let length = centered.iter().map(|x| x * x).sum::<f32>().sqrt();
    (length > 1e-3).then(|| (centered.map(|x| x / length), length))
}

/// Removes from a patch's gradient what normalisation removes.
#[inline(always)]
fn flattened(gradient: Patch, patch: &Patch, length: f32) -> Patch {
    let mean = gradient.iter().sum::<f32>() / SAMPLES as f32;
    let along = gradient.iter().zip(patch).map(|(a, b)| a * b).sum::<f32>();
    std::array::from_fn(|i| (gradient[i] - mean - along * patch[i]) / length)
}

/// Returns the axis to which a vector is least parallel.
fn least_axis(vector: &Vector3<f64>) -> Vector3<f64> {
    Vector3::ith(vector.iamin(), 1.0)
}
