use nalgebra::{Matrix3, Vector3};

use super::Fitness;
use crate::camera::{Camera, Channels, ImageError, ImageView, RigError, check_image_size};
use crate::pose::{Pose, even_direction};
use crate::shape::{Body, Ellipsoid, Quadric};

/// Why views and numbers do not make a points term.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PointsError {
    /// The number of points is out of its range.
    #[error("an ellipsoid must be drawn as 1 to {max} points, but m is {given}")]
    Count {
        /// Points given.
        given: usize,
        /// Most points.
        max: usize,
    },
    /// The envelope's margin is not positive.
    #[error("the envelope's margin alpha must be a positive number, but it is {0}")]
    Alpha(f64),
    /// The match image is not grey.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The match image does not have its camera's size, or there is no camera.
    #[error(transparent)]
    Rig(#[from] RigError),
}

/// α: the amount by which the radii of the envelope exceed those of its ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Margin {
    /// One length in metres for all ellipsoids, as in the paper. A splinter at the target's rim
    /// then scores more than an ellipsoid that fills the target: all of its surface is on the hue,
    /// and half of its envelope is beside it.
    Metres(f64),
    /// A share of each ellipsoid's smallest radius, so that the fitness does not depend on scale
    /// and cannot be raised by stretching the radius that is not seen.
    Share(f64),
}

impl Margin {
    fn metres(self, radii: &Vector3<f64>) -> f64 {
        match self {
            Self::Metres(metres) => metres,
            Self::Share(share) => share * radii.min(),
        }
    }
}

/// One camera of the points term, with the pixels that have the target's hue.
#[derive(Debug, Clone, Copy)]
pub struct PointsView<'a> {
    camera: Camera,
    camera_from_world: (Matrix3<f64>, Vector3<f64>),
    matches: ImageView<'a>,
}

impl<'a> PointsView<'a> {
    /// Combines a camera, its pose and a grey image that is non-zero where the hue matches.
    ///
    /// # Errors
    /// If the image is not grey or does not have the camera's size.
    pub fn new(
        camera: Camera,
        world_from_camera: &Pose,
        matches: ImageView<'a>,
    ) -> Result<Self, PointsError> {
        if matches.channels() != Channels::Grey {
            return Err(ImageError::MaskChannels.into());
        }
        check_image_size(0, camera.size_px(), matches)?;
        let camera_from_world = world_from_camera.inverse();
        let camera_from_world =
            (camera_from_world.rotation_matrix(), camera_from_world.translation());
        Ok(Self { camera, camera_from_world, matches })
    }

    /// Returns p: 1 if a point is seen at a pixel of the target's hue, 0 at another pixel, outside
    /// the image and behind the camera.
    fn match_value(&self, point_in_world: &Vector3<f64>) -> i64 {
        let (rotation, translation) = &self.camera_from_world;
        let Some(pixel) = self.camera.project(&(rotation * point_in_world + translation)) else {
            return 0;
        };
        let [width, height] = self.matches.size_px().map(|side| side as f64);
        // The pixel whose square contains the point.
        let (u, v) = (pixel.x + 0.5, pixel.y + 0.5);
        let inside = u >= 0.0 && v >= 0.0 && u < width && v < height;
        i64::from(inside && self.matches.row(v as usize)[u as usize] != 0)
    }
}

/// The paper's fitness: points on an ellipsoid's surface that are seen on the target's hue count
/// for it, points on the envelope around it that are seen there count against it.
///
/// It is highest where the surface just fits into the hue and the envelope's rim lies beside it.
/// The paper halves the sum over two cameras; here it is divided by the number of cameras, and by
/// the number of points m, so that the contribution of one ellipsoid lies between -1 and 1 for any
/// number of either. Ellipsoids are summed one by one: none hides another, and pixels covered by
/// two of them count twice.
#[derive(Debug, Clone)]
pub struct Points<'a> {
    views: Vec<PointsView<'a>>,
    directions: Vec<Vector3<f64>>,
    alpha: Margin,
}

impl<'a> Points<'a> {
    /// Most points per ellipsoid.
    pub const MAX_COUNT: usize = 65_536;

    /// Makes the term of its cameras; `count` is m, the number of points on each surface, and
    /// `alpha` the margin of the envelopes.
    ///
    /// # Errors
    /// If there is no camera, `count` is out of its range or `alpha` is not positive.
    pub fn new(
        views: Vec<PointsView<'a>>,
        count: usize,
        alpha: Margin,
    ) -> Result<Self, PointsError> {
        if views.is_empty() {
            return Err(RigError::NoCamera.into());
        }
        Self::check(count, alpha)?;
        let directions = (0..count).map(|index| direction(index, count)).collect();
        Ok(Self { views, directions, alpha })
    }

    /// Returns whether a number of points and a margin can be used.
    pub(crate) fn check(count: usize, alpha: Margin) -> Result<(), PointsError> {
        if count == 0 || count > Self::MAX_COUNT {
            return Err(PointsError::Count { given: count, max: Self::MAX_COUNT });
        }
        let (Margin::Metres(number) | Margin::Share(number)) = alpha;
        if !(number.is_finite() && number > 0.0) {
            return Err(PointsError::Alpha(number));
        }
        Ok(())
    }

    /// Returns m points of the surface, each with the point of the envelope in the same direction,
    /// in the world.
    pub fn pairs_in_world(&self, ellipsoid: &Ellipsoid) -> impl Iterator<Item = [Vector3<f64>; 2]> {
        let (center, radii) = (ellipsoid.center(), ellipsoid.radii());
        let rotation = ellipsoid.rotation().to_rotation_matrix().into_inner();
        let envelope = radii.add_scalar(self.alpha.metres(&radii));
        self.directions.iter().map(move |direction| {
            let on = radii.component_mul(direction); // Eqs. (1), (3)
            let out = envelope.component_mul(direction); // Eqs. (2), (4)
            let both = [on, out]; // Eq. (5), adapted: the union, where an intersection is printed
            both.map(|point| center + rotation * point) // Eq. (6)
        })
    }

    /// Scores ellipsoids given in the world.
    #[must_use]
    pub fn fitness(&self, ellipsoids_in_world: &[Ellipsoid]) -> f64 {
        let pairs = ellipsoids_in_world.iter().flat_map(|ellipsoid| self.pairs_in_world(ellipsoid));
        // Eq. (7), adapted: each camera once, where the right one is printed twice; p is whether
        // the hue matches, where the hue itself is printed; the mean over cameras and points.
        let balance = |view: &PointsView<'_>, [on, out]: &[Vector3<f64>; 2]| {
            view.match_value(on) - view.match_value(out)
        };
        let total: i64 =
            pairs.map(|pair| self.views.iter().map(|view| balance(view, &pair)).sum::<i64>()).sum();
        total as f64 / (self.views.len() * self.directions.len()) as f64
    }
}

impl Fitness for Points<'_> {
    /// Scores one hypothesis; each ellipsoid's points are spread along its principal axes, the
    /// longest first.
    fn score(&self, hypothesis: &[Quadric]) -> f64 {
        let solid = |quadric| Ellipsoid::from_quadric(quadric, 0.0);
        let looked_at = hypothesis.iter().take(Body::MAX_ELLIPSOIDS);
        self.fitness(&looked_at.map(solid).collect::<Vec<_>>())
    }
}

/// Returns (sin θ, cos θ sin φ, cos θ cos φ) for one of `count` pairs of angles.
///
/// The paper lets both angles run from -π to π, which covers an ellipsoid twice, and does not
/// specify how they are chosen. Here θ runs from -π/2 to π/2, which covers it once: sin θ in even
/// steps, and φ in steps of the golden angle, so that points are evenly distributed on a sphere.
fn direction(index: usize, count: usize) -> Vector3<f64> {
    let unit = even_direction(index, (2 * index + 1) as f64 / count as f64 - 1.0);
    Vector3::new(unit.z, unit.y, unit.x) // Eq. (1), adapted: covers it once
}
