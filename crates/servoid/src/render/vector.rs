use crate::simd::{RayLanes, Scalar};
use std::ops::{Add, Mul, Neg, Sub};

/// Eight vectors, or one.
#[derive(Clone, Copy)]
pub(super) struct Vector<T> {
    pub x: T,
    pub y: T,
    pub z: T,
}

/// Returns eight copies of a vector.
#[inline(always)]
pub(super) fn splat<L: RayLanes>(v: [L::Scalar; 3]) -> Vector<L> {
    Vector { x: L::splat(v[0]), y: L::splat(v[1]), z: L::splat(v[2]) }
}

/// Returns eight copies of a vector of single precision.
#[inline(always)]
pub(super) fn splat_single<L: RayLanes>(v: [f32; 3]) -> Vector<L> {
    Vector { x: L::splat_single(v[0]), y: L::splat_single(v[1]), z: L::splat_single(v[2]) }
}

/// Converts three numbers to the precision in which a scene stores them.
pub(super) fn stored<S: Scalar>(v: [f64; 3]) -> [S; 3] {
    v.map(S::of)
}

impl<L: RayLanes> Add for Vector<L> {
    type Output = Self;

    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { x: self.x + o.x, y: self.y + o.y, z: self.z + o.z }
    }
}

impl<L: RayLanes> Sub for Vector<L> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { x: self.x - o.x, y: self.y - o.y, z: self.z - o.z }
    }
}

impl<L: RayLanes> Neg for Vector<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { x: -self.x, y: -self.y, z: -self.z }
    }
}

impl<L: RayLanes> Mul<L> for Vector<L> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, by: L) -> Self {
        Self { x: self.x * by, y: self.y * by, z: self.z * by }
    }
}

impl<L: RayLanes> Vector<L> {
    #[inline(always)]
    pub fn dot(self, o: Self) -> L {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }

    /// Multiplies componentwise.
    #[inline(always)]
    pub fn times(self, o: Self) -> Self {
        Self { x: self.x * o.x, y: self.y * o.y, z: self.z * o.z }
    }

    #[inline(always)]
    pub fn unit(self) -> Self {
        let length = self.dot(self).max(L::of(1e-30)).sqrt();
        self * (L::of(1.0) / length)
    }

    #[inline(always)]
    pub fn select(truth: L, yes: Self, no: Self) -> Self {
        Self {
            x: truth.select(yes.x, no.x),
            y: truth.select(yes.y, no.y),
            z: truth.select(yes.z, no.z),
        }
    }

    /// Multiplies by a matrix of rows.
    #[inline(always)]
    pub fn turned(self, rows: &[[L::Scalar; 3]; 3]) -> Self {
        Self {
            x: self.dot(splat(rows[0])),
            y: self.dot(splat(rows[1])),
            z: self.dot(splat(rows[2])),
        }
    }

    /// Multiplies by the transpose of a matrix of rows.
    #[inline(always)]
    pub fn turned_back(self, rows: &[[L::Scalar; 3]; 3]) -> Self {
        splat::<L>(rows[0]) * self.x + splat::<L>(rows[1]) * self.y + splat::<L>(rows[2]) * self.z
    }
}
