//! Images that the tests draw: textured ellipsoids in front of a distant background, by ray
//! casting.

use std::ops::Range;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use servoid::camera::{Camera, Channels, ImageView, Mask, Observation};
use servoid::pose::Pose;
use servoid::shape::{Body, Ellipsoid, silhouette};

/// Width and height of the images.
pub const SIZE: [usize; 2] = [320, 240];
/// Approximate distance in pixels between neighbouring values of a pattern.
const CELLS_A_METRE: f64 = 160.0;
const CELLS_A_RADIAN: f64 = 14.0;
/// Rays along each side of a pixel.
const RAYS: usize = 2;

/// An object in front of two cameras.
pub struct Stage {
    pub camera: Camera,
    pub body: Body,
    /// Contribution of the pattern to the object's brightness.
    pub pattern: f64,
    pub channels: Channels,
    /// Seed of the patterns, and of the noise of the images.
    pub seed: u64,
    /// An occluder in front of the object, left of this column.
    pub hidden_left_of: usize,
}

/// The images of two cameras at one instant.
pub struct Shot {
    pub time_s: f64,
    pub eyes: Vec<Pose>,
    pub pictures: Vec<Vec<u8>>,
    pub size: [usize; 2],
    pub channels: Channels,
}

impl Shot {
    pub fn observation(&self) -> Observation<'_> {
        let pictures = self.pictures.iter();
        Observation {
            time_s: self.time_s,
            world_from_camera: self.eyes.clone(),
            images: pictures
                .map(|picture| Some(ImageView::new(picture, self.size, self.channels).unwrap()))
                .collect(),
            depths: Vec::new(),
        }
    }
}

impl Stage {
    pub fn new(ellipsoids: Vec<Ellipsoid>) -> Self {
        Self {
            camera: Camera::new(SIZE, [340.0; 2], [159.5, 119.5]).unwrap(),
            body: Body::new(Pose::identity(), ellipsoids).unwrap(),
            pattern: 1.0,
            channels: Channels::Rgb,
            seed: 0,
            hidden_left_of: 0,
        }
    }

    /// Two ellipsoids without a rotational symmetry.
    pub fn textured() -> Self {
        let solid = |center, radii, turn| Ellipsoid::new(0, center, radii, turn).unwrap();
        Self::new(vec![
            solid([0.0; 3], [0.065, 0.045, 0.05], [0.9, 0.1, 0.3, 0.3]),
            solid([0.03, 0.045, -0.01], [0.03, 0.04, 0.03], [1.0, 0.0, 0.0, 0.0]),
        ])
    }

    pub fn ball(pattern: f64) -> Self {
        let ball = Ellipsoid::new(0, [0.0; 3], [0.05; 3], [1.0, 0.0, 0.0, 0.0]).unwrap();
        Self { pattern, ..Self::new(vec![ball]) }
    }

    pub fn cameras(&self) -> [Camera; 2] {
        [self.camera; 2]
    }

    /// Draws an image for each camera; no image is identical to another.
    pub fn shot(&self, index: usize, eyes: &[Pose; 2], object: Option<&Pose>) -> Shot {
        let seed = |eye: usize| (2 * index + eye) as u64;
        Shot {
            time_s: index as f64 / 30.0,
            eyes: eyes.to_vec(),
            pictures: (0..2).map(|eye| self.draw(&eyes[eye], object, seed(eye))).collect(),
            size: self.camera.size_px(),
            channels: self.channels,
        }
    }

    pub fn mask(&self, eye: &Pose, object: &Pose) -> Vec<u8> {
        silhouette(&self.body.at(*object), &self.camera, eye)
    }

    /// Returns the columns and rows outside of which no ray hits the object.
    fn near(&self, eye: &Pose, object: &Pose) -> [Range<usize>; 2] {
        let mask = self.mask(eye, object);
        let seen = (0..mask.len()).filter(|at| mask[*at] != 0);
        let around = |places: &mut dyn Iterator<Item = usize>| {
            let (first, last) = places.fold((usize::MAX, 0), |(a, b), at| (a.min(at), b.max(at)));
            first.saturating_sub(3)..last + 4
        };
        let [width, _] = self.camera.size_px();
        [around(&mut seen.clone().map(|at| at % width)), around(&mut seen.map(|at| at / width))]
    }

    fn draw(&self, eye: &Pose, object: Option<&Pose>, seed: u64) -> Vec<u8> {
        let solids: Vec<_> =
            self.body.ellipsoids().iter().map(|e| (e.center(), inverse(e))).collect();
        let object_from_eye = object.map(|object| object.inverse() * *eye);
        let near = object.map(|object| self.near(eye, object));
        let [width, height] = self.camera.size_px();
        let mut pixels = Vec::with_capacity(width * height * 3);
        let mut grain = Grain((seed * 2 + 1) ^ mix(self.seed));
        for v in 0..height {
            for u in 0..width {
                let close = near.as_ref().is_some_and(|[x, y]| x.contains(&u) && y.contains(&v));
                let rays = if close { RAYS * RAYS } else { 0 };
                let (mut sum, mut beside) = (Vector3::zeros(), (RAYS * RAYS - rays) as f64);
                for ray in 0..rays {
                    let off = |k: usize| (k as f64 + 0.5) / RAYS as f64 - 0.5;
                    let place = [u as f64 + off(ray % RAYS), v as f64 + off(ray / RAYS)];
                    let way = self.camera.ray(place);
                    let shown = object_from_eye.filter(|_| u >= self.hidden_left_of);
                    let hit = shown.and_then(|pose| {
                        first_hit(&solids, &pose.translation(), &(pose.rotation() * way))
                    });
                    match hit {
                        Some(point) => sum += self.skin(&point),
                        None => beside += 1.0,
                    }
                }
                if beside > 0.0 {
                    let way = eye.rotation() * self.camera.ray([u as f64, v as f64]);
                    sum += self.far(&way.normalize()) * beside;
                }
                let color = sum / (RAYS * RAYS) as f64;
                let bytes = [0, 1, 2].map(|i| (color[i] + grain.next()).clamp(0.0, 255.0) as u8);
                match self.channels {
                    Channels::Rgb => pixels.extend(bytes),
                    _ => pixels.push(bytes[1]),
                }
            }
        }
        pixels
    }

    fn skin(&self, point: &Vector3<f64>) -> Vector3<f64> {
        let value = noise(&(point * CELLS_A_METRE), self.seed) - 0.5;
        let light = 1.0 + 1.2 * self.pattern * value;
        Vector3::new(190.0, 110.0, 60.0) * light
    }

    /// The background: a pattern so far away that only rotations of the camera move it.
    fn far(&self, direction: &Vector3<f64>) -> Vector3<f64> {
        let light = 0.6 + 0.8 * noise(&(direction * CELLS_A_RADIAN), self.seed);
        Vector3::new(60.0, 110.0, 130.0) * light
    }
}

/// Poses of the usual two cameras, beside the origin's line of sight at a distance of 0.45 m.
pub fn eyes() -> [Pose; 2] {
    [-0.03, 0.03]
        .map(|x| Pose::from_rotation(UnitQuaternion::identity(), Vector3::new(x, 0.0, -0.45)))
}

/// Poses of cameras that look at a point.
pub fn eyes_at(point: &Vector3<f64>) -> [Pose; 2] {
    eyes().map(|eye| {
        let look = Rotation3::face_towards(&(point - eye.translation()), &Vector3::y());
        Pose::from_rotation(UnitQuaternion::from_rotation_matrix(&look), eye.translation())
    })
}

pub fn masks<'a>(pictures: &'a [Vec<u8>]) -> Vec<Option<Mask<'a>>> {
    let image = |picture: &'a [u8]| ImageView::new(picture, SIZE, Channels::Grey).unwrap();
    pictures.iter().map(|picture| Some(Mask::new(image(picture)).unwrap())).collect()
}

fn inverse(ellipsoid: &Ellipsoid) -> Matrix3<f64> {
    ellipsoid.factor().try_inverse().unwrap()
}

fn first_hit(
    solids: &[(Vector3<f64>, Matrix3<f64>)],
    eye: &Vector3<f64>,
    way: &Vector3<f64>,
) -> Option<Vector3<f64>> {
    let along = |(center, to_ball): &(Vector3<f64>, Matrix3<f64>)| {
        let (from, way) = (to_ball * (eye - center), to_ball * way);
        let (a, b) = (way.norm_squared(), from.dot(&way));
        let root = b * b - a * (from.norm_squared() - 1.0);
        (root > 0.0).then(|| (-b - root.sqrt()) / a)
    };
    let nearest = solids.iter().filter_map(along).min_by(f64::total_cmp)?;
    Some(eye + way * nearest)
}

/// A smooth pattern in space, 0 to 1: interpolated values at the corners of a grid.
fn noise(place: &Vector3<f64>, seed: u64) -> f64 {
    let cell = place.map(f64::floor);
    let share = (place - cell).map(|x| x * x * (3.0 - 2.0 * x));
    let hash = |key: u64, k: usize, step: usize| {
        let at = (cell[k] as i64 + step as i64) as u64;
        mix(key ^ at.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    };
    let first = [0, 1].map(|i| hash(7 ^ mix(seed), 0, i));
    let second = [0, 1, 2, 3].map(|i| hash(first[i & 1], 1, i >> 1));
    let corner = |i: usize| {
        let step = [i & 1, i >> 1 & 1, i >> 2 & 1];
        let weight: f64 =
            (0..3).map(|k| if step[k] == 1 { share[k] } else { 1.0 - share[k] }).product();
        weight * (hash(second[i & 3], 2, step[2]) >> 40) as f64 / (1_u64 << 24) as f64
    };
    (0..8).map(corner).sum()
}

fn mix(mut x: u64) -> u64 {
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Sensor noise: up to a grey level and a half either way.
struct Grain(u64);

impl Grain {
    fn next(&mut self) -> f64 {
        self.0 = mix(self.0.wrapping_add(0x9e37_79b9_7f4a_7c15));
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 * 3.0 - 1.0
    }
}
