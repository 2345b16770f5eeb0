//! The lanes of x86-64: eight with AVX2, sixteen with AVX-512.
//!
//! SAFETY, of every block: these types are constructed only in functions that enable their
//! instructions, into which every method is inlined.

use std::arch::x86_64::*;
#[cfg(feature = "render")]
use std::ops::Neg;
use std::ops::{Add, Div, Mul, Sub};

#[cfg(feature = "render")]
use super::lanes::{EIGHT, RayLanes, Single};
use super::lanes::{Lanes, RowLanes, Truth};

/// Eight lanes; needs AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

/// Sixteen lanes; needs AVX-512 F, DQ and VL, and AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512);

/// Numbers in one cache line, so that they can be read back at once.
#[repr(align(64))]
struct Aligned<const N: usize>([u32; N]);

/// Reads the pair at `index[first]` and that at `index[first + 1]`: both neighbours in one 64-bit
/// read. On processors whose gathers are slowed down by security mitigations this is twice as fast
/// as a gather.
#[inline(always)]
unsafe fn read_two(table: *const f32, index: &[u32], first: usize) -> __m128d {
    unsafe {
        // Volatile, so that the indices come from memory: extracting them from a vector register
        // one by one would cost more than the reads that need them.
        let pair = |at: usize| {
            let index = index.as_ptr().add(at).read_volatile();
            table.add(index as usize).cast::<f64>()
        };
        _mm_set_pd(pair(first + 1).read_unaligned(), pair(first).read_unaligned())
    }
}

#[inline(always)]
unsafe fn total_of_eight(eight: __m256) -> f32 {
    unsafe {
        let four = _mm_add_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps::<1>(eight));
        let two = _mm_add_ps(four, _mm_movehl_ps(four, four));
        _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)))
    }
}

macro_rules! operator {
    ($lanes:ident, $trait:ident, $method:ident, $instruction:ident) => {
        impl $trait for $lanes {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                unsafe { Self($instruction(self.0, other.0)) }
            }
        }
    };
}

operator!(Avx2, Add, add, _mm256_add_ps);
operator!(Avx2, Sub, sub, _mm256_sub_ps);
operator!(Avx2, Mul, mul, _mm256_mul_ps);
operator!(Avx2, Div, div, _mm256_div_ps);
operator!(Avx512, Add, add, _mm512_add_ps);
operator!(Avx512, Sub, sub, _mm512_sub_ps);
operator!(Avx512, Mul, mul, _mm512_mul_ps);
operator!(Avx512, Div, div, _mm512_div_ps);

impl Lanes for Avx2 {
    const COUNT: usize = 8;
    type Scalar = f32;
    type Truth = Self;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        unsafe { Self(_mm256_set1_ps(value)) }
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
}

impl Truth<Self> for Avx2 {
    #[inline(always)]
    fn both(self, other: Self) -> Self {
        unsafe { Self(_mm256_and_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        unsafe { Self(_mm256_or_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        unsafe { Self(_mm256_andnot_ps(other.0, self.0)) }
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

impl RowLanes for Avx2 {
    type Offsets = __m256i;

    #[inline(always)]
    fn ramp(first: usize) -> Self {
        unsafe {
            let steps = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
            Self(_mm256_add_ps(_mm256_set1_ps(first as f32), steps))
        }
    }

    #[inline(always)]
    fn offsets(first: usize, pitch: usize) -> __m256i {
        unsafe {
            let steps = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let rows = _mm256_add_epi32(_mm256_set1_epi32(first as i32), steps);
            _mm256_mullo_epi32(rows, _mm256_set1_epi32(pitch as i32))
        }
    }

    #[inline(always)]
    fn total(self, other: Self) -> f32 {
        unsafe { total_of_eight(_mm256_add_ps(self.0, other.0)) }
    }

    #[inline(always)]
    unsafe fn pairs(self, table: *const f32, offsets: __m256i) -> (Self, Self, Self) {
        unsafe {
            let whole = _mm256_cvttps_epi32(self.0);
            let part = _mm256_sub_ps(self.0, _mm256_cvtepi32_ps(whole));
            let at = _mm256_add_epi32(offsets, whole);
            // With this order of rows one shuffle within the halves separates the neighbours.
            let mut index = Aligned([0_u32; 8]);
            _mm256_store_si256(index.0.as_mut_ptr().cast(), at);
            let low = _mm256_set_m128d(read_two(table, &index.0, 4), read_two(table, &index.0, 0));
            let high = _mm256_set_m128d(read_two(table, &index.0, 6), read_two(table, &index.0, 2));
            let (low, high) = (_mm256_castpd_ps(low), _mm256_castpd_ps(high));
            let here = _mm256_shuffle_ps::<0b10_00_10_00>(low, high);
            let next = _mm256_shuffle_ps::<0b11_01_11_01>(low, high);
            (Self(here), Self(next), Self(part))
        }
    }
}

#[cfg(feature = "render")]
impl Neg for Avx2 {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        unsafe { Self(_mm256_xor_ps(self.0, _mm256_set1_ps(-0.0))) }
    }
}

#[cfg(feature = "render")]
impl RayLanes for Avx2 {
    #[inline(always)]
    fn splat_single(value: f32) -> Self {
        Self::splat(value)
    }

    #[inline(always)]
    fn read(values: [f32; EIGHT]) -> Self {
        unsafe { Self(_mm256_loadu_ps(values.as_ptr())) }
    }

    #[inline(always)]
    fn write(self) -> [f32; EIGHT] {
        let mut out = [0.0; EIGHT];
        unsafe { _mm256_storeu_ps(out.as_mut_ptr(), self.0) };
        out
    }
}

#[cfg(feature = "render")]
impl Single for Avx2 {
    #[inline(always)]
    fn whole(self) -> [i32; EIGHT] {
        let mut out = [0; EIGHT];
        unsafe { _mm256_storeu_si256(out.as_mut_ptr().cast(), _mm256_cvttps_epi32(self.0)) };
        out
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        unsafe { Self(_mm256_cvtepi32_ps(_mm256_cvttps_epi32(self.0))) }
    }
}

impl Lanes for Avx512 {
    const COUNT: usize = 16;
    type Scalar = f32;
    type Truth = __mmask16;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        unsafe { Self(_mm512_set1_ps(value)) }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }

    #[inline(always)]
    fn less(self, other: Self) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) }
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
    }
}

impl Truth<Avx512> for __mmask16 {
    #[inline(always)]
    fn both(self, other: Self) -> Self {
        self & other
    }

    #[inline(always)]
    fn either(self, other: Self) -> Self {
        self | other
    }

    #[inline(always)]
    fn and_not(self, other: Self) -> Self {
        self & !other
    }

    #[inline(always)]
    fn select(self, yes: Avx512, no: Avx512) -> Avx512 {
        unsafe { Avx512(_mm512_mask_blend_ps(self, no.0, yes.0)) }
    }

    #[inline(always)]
    fn bits(self) -> u32 {
        self.into()
    }
}

impl RowLanes for Avx512 {
    type Offsets = __m512i;

    #[inline(always)]
    fn ramp(first: usize) -> Self {
        unsafe {
            let steps = _mm512_setr_ps(
                0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0,
                15.0,
            );
            Self(_mm512_add_ps(_mm512_set1_ps(first as f32), steps))
        }
    }

    #[inline(always)]
    fn offsets(first: usize, pitch: usize) -> __m512i {
        unsafe {
            let steps = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let rows = _mm512_add_epi32(_mm512_set1_epi32(first as i32), steps);
            _mm512_mullo_epi32(rows, _mm512_set1_epi32(pitch as i32))
        }
    }

    #[inline(always)]
    fn total(self, _other: Self) -> f32 {
        unsafe {
            let (low, high) = (_mm512_castps512_ps256(self.0), _mm512_extractf32x8_ps::<1>(self.0));
            total_of_eight(_mm256_add_ps(low, high))
        }
    }

    #[inline(always)]
    unsafe fn pairs(self, table: *const f32, offsets: __m512i) -> (Self, Self, Self) {
        unsafe {
            let whole = _mm512_cvttps_epi32(self.0);
            let part = _mm512_sub_ps(self.0, _mm512_cvtepi32_ps(whole));
            let at = _mm512_add_epi32(offsets, whole);
            let mut index = Aligned([0_u32; 16]);
            _mm512_store_si512(index.0.as_mut_ptr().cast(), at);
            let eight = |first: usize| {
                let four = |first: usize| {
                    _mm256_set_m128d(
                        read_two(table, &index.0, first + 2),
                        read_two(table, &index.0, first),
                    )
                };
                _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(four(first)), four(first + 4))
            };
            let (low, high) = (_mm512_castpd_ps(eight(0)), _mm512_castpd_ps(eight(8)));
            let even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
            let odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
            let here = _mm512_permutex2var_ps(low, even, high);
            let next = _mm512_permutex2var_ps(low, odd, high);
            (Self(here), Self(next), Self(part))
        }
    }
}
