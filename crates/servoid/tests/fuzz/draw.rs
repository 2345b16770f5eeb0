//! Numbers that are mostly valid.

use nalgebra::{UnitQuaternion, Vector3};
use rand::RngExt;
use servoid::camera::Camera;
use servoid::evolve::{Rng, rng};
use servoid::pose::Pose;

const ODD: [f64; 16] = [
    0.0,
    -0.0,
    1e-320,
    1e-154,
    1e-9,
    0.5,
    1.0,
    -1.0,
    std::f64::consts::PI,
    1e9,
    1e154,
    1e308,
    -1e308,
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Random numbers from a seed.
pub struct Draw(Rng);

impl Draw {
    pub fn new(seed: u64) -> Self {
        Self(rng(seed, 7))
    }

    pub fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.0.random::<f64>() < share
    }

    pub fn pick<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())]
    }

    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.random::<f64>()
    }

    /// Mostly from -1 to 1, sometimes any number.
    pub fn number(&mut self) -> f64 {
        if self.chance(0.1) { self.pick(&ODD) } else { self.within(-1.0, 1.0) }
    }

    pub fn numbers<const N: usize>(&mut self) -> [f64; N] {
        std::array::from_fn(|_| self.number())
    }

    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        let most = self.pick(&[1_u16, 2, 256]);
        (0..count).map(|_| self.0.random_range(0..most) as u8).collect()
    }

    /// A pose near the origin, sometimes a farther one.
    pub fn pose(&mut self) -> Pose {
        let turn = Vector3::from_fn(|_, _| self.within(-0.4, 0.4));
        let reach = self.pick(&[0.0, 0.2, 0.2, 0.2, 1e3, 1e9]);
        let shift = Vector3::from_fn(|_, _| self.within(-reach, reach));
        Pose::from_rotation(UnitQuaternion::from_scaled_axis(turn), shift)
    }

    /// A small camera, sometimes an implausible one.
    pub fn camera(&mut self) -> Option<Camera> {
        if self.chance(0.7) {
            return Camera::new([33, 24], [40.0; 2], [16.0, 11.5]).ok();
        }
        let size = [self.pick(&[0, 1, 2, 16, 64, 8193]), self.pick(&[0, 1, 3, 17, 48])];
        let [fu, fv, u, v] = self.numbers().map(|x: f64| 40.0 * x);
        Camera::new(size, [fu, fv], [u, v]).ok()
    }
}
