//! The lanes of x86-64, where a processor has AVX2.

use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

use super::lanes::{COUNT, Lanes, Single};

/// Eight numbers in one register. Made only in functions that enable AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

macro_rules! operator {
    ($trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for Avx2 {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: inlined into a function that enables AVX2.
                unsafe { Self($instruction(self.0, other.0)) }
            }
        }
    };
}

operator!(Add, add, _mm256_add_ps);
operator!(Sub, sub, _mm256_sub_ps);
operator!(Mul, mul, _mm256_mul_ps);
operator!(Div, div, _mm256_div_ps);

impl Neg for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        // SAFETY: as above.
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}

// SAFETY, of every block: inlined into a function that enables AVX2; arrays have eight numbers.
impl Lanes for Avx2 {
    type Scalar = f32;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        unsafe { Self(_mm256_set1_ps(value)) }
    }

    #[inline(always)]
    fn splat_single(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn read(values: [f32; COUNT]) -> Self {
        unsafe { Self(_mm256_loadu_ps(values.as_ptr())) }
    }

    #[inline(always)]
    fn write(self) -> [f32; COUNT] {
        let mut out = [0.0; COUNT];
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
        out
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self {
        unsafe { Self(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> Self {
        unsafe { Self(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) }
    }

    #[inline(always)]
    fn both(self, other: Self) -> Self {
        unsafe { Self(_mm256_and_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn select(self, yes: Self, no: Self) -> Self {
        unsafe { Self(_mm256_blendv_ps(no.0, yes.0, self.0)) }
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        unsafe { _mm256_movemask_ps(self.0) as u32 }
    }
}

impl Single for Avx2 {
    #[inline(always)]
    fn whole(self) -> [i32; COUNT] {
        let mut out = [0; COUNT];
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), _mm256_cvttps_epi32(self.0)) };
        out
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        unsafe { Self(_mm256_cvtepi32_ps(_mm256_cvttps_epi32(self.0))) }
    }
}
