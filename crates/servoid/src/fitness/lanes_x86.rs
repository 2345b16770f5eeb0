//! The row vectors of x86-64: eight rows with AVX2, sixteen with AVX-512.

use std::arch::x86_64::*;

use super::lanes::Lanes;

/// Eight rows: needs AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

/// Sixteen rows: needs AVX-512 F, DQ and VL, and AVX2.
#[derive(Clone, Copy)]
pub(super) struct Avx512(__m512);

/// Numbers that lie in one cache line, so that they can be read back at once.
#[repr(align(64))]
struct Aligned<const N: usize>([u32; N]);

/// Reads the pair at `index[first]` and that at `index[first + 1]`: both neighbours in one 64-bit
/// read. On processors whose gathers are slowed down for safety this is twice as fast as a gather.
#[inline(always)]
unsafe fn read_two(table: *const f32, index: &[u32], first: usize) -> __m128d {
    unsafe {
        // Volatile, so that the indices come from memory: taking them out of a vector register one
        // by one would cost more than the reads that they are for.
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

// SAFETY: every method is inlined into a function that enables AVX2.
unsafe impl Lanes for Avx2 {
    const COUNT: usize = 8;
    type Truth = __m256;
    type Offsets = __m256i;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(_mm256_set1_ps(x)) }
    }
    #[inline(always)]
    unsafe fn ramp(first: usize) -> Self {
        unsafe {
            let steps = _mm256_setr_ps(0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0);
            Self(_mm256_add_ps(_mm256_set1_ps(first as f32), steps))
        }
    }
    #[inline(always)]
    unsafe fn offsets(first: usize, pitch: usize) -> __m256i {
        unsafe {
            let steps = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let rows = _mm256_add_epi32(_mm256_set1_epi32(first as i32), steps);
            _mm256_mullo_epi32(rows, _mm256_set1_epi32(pitch as i32))
        }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe { Self(_mm256_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe { Self(_mm256_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe { Self(_mm256_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe { Self(_mm256_div_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm256_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm256_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm256_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    unsafe fn less(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    unsafe fn less_equal(self, other: Self) -> __m256 {
        unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    unsafe fn and(left: __m256, right: __m256) -> __m256 {
        unsafe { _mm256_and_ps(left, right) }
    }
    #[inline(always)]
    unsafe fn or(left: __m256, right: __m256) -> __m256 {
        unsafe { _mm256_or_ps(left, right) }
    }
    #[inline(always)]
    unsafe fn and_not(left: __m256, right: __m256) -> __m256 {
        unsafe { _mm256_andnot_ps(right, left) }
    }
    #[inline(always)]
    unsafe fn any(truth: __m256) -> bool {
        unsafe { _mm256_movemask_ps(truth) != 0 }
    }
    #[inline(always)]
    unsafe fn select(truth: __m256, yes: Self, no: Self) -> Self {
        unsafe { Self(_mm256_blendv_ps(no.0, yes.0, truth)) }
    }
    #[inline(always)]
    unsafe fn total(self, other: Self) -> f32 {
        unsafe { total_of_eight(_mm256_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn pairs(self, table: *const f32, offsets: __m256i) -> (Self, Self, Self) {
        unsafe {
            let whole = _mm256_cvttps_epi32(self.0);
            let part = _mm256_sub_ps(self.0, _mm256_cvtepi32_ps(whole));
            let at = _mm256_add_epi32(offsets, whole);
            // This order of rows lets one shuffle within the halves set the neighbours apart.
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

// SAFETY: every method is inlined into a function that enables AVX-512 F, DQ, VL and AVX2.
unsafe impl Lanes for Avx512 {
    const COUNT: usize = 16;
    type Truth = __mmask16;
    type Offsets = __m512i;

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        unsafe { Self(_mm512_set1_ps(x)) }
    }
    #[inline(always)]
    unsafe fn ramp(first: usize) -> Self {
        unsafe {
            let steps = _mm512_setr_ps(
                0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0,
                15.0,
            );
            Self(_mm512_add_ps(_mm512_set1_ps(first as f32), steps))
        }
    }
    #[inline(always)]
    unsafe fn offsets(first: usize, pitch: usize) -> __m512i {
        unsafe {
            let steps = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
            let rows = _mm512_add_epi32(_mm512_set1_epi32(first as i32), steps);
            _mm512_mullo_epi32(rows, _mm512_set1_epi32(pitch as i32))
        }
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        unsafe { Self(_mm512_add_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        unsafe { Self(_mm512_sub_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        unsafe { Self(_mm512_mul_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        unsafe { Self(_mm512_div_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        unsafe { Self(_mm512_min_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        unsafe { Self(_mm512_max_ps(self.0, other.0)) }
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        unsafe { Self(_mm512_sqrt_ps(self.0)) }
    }
    #[inline(always)]
    unsafe fn less(self, other: Self) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    unsafe fn less_equal(self, other: Self) -> __mmask16 {
        unsafe { _mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0) }
    }
    #[inline(always)]
    unsafe fn and(left: __mmask16, right: __mmask16) -> __mmask16 {
        left & right
    }
    #[inline(always)]
    unsafe fn or(left: __mmask16, right: __mmask16) -> __mmask16 {
        left | right
    }
    #[inline(always)]
    unsafe fn and_not(left: __mmask16, right: __mmask16) -> __mmask16 {
        left & !right
    }
    #[inline(always)]
    unsafe fn any(truth: __mmask16) -> bool {
        truth != 0
    }
    #[inline(always)]
    unsafe fn select(truth: __mmask16, yes: Self, no: Self) -> Self {
        unsafe { Self(_mm512_mask_blend_ps(truth, no.0, yes.0)) }
    }
    #[inline(always)]
    unsafe fn total(self, _other: Self) -> f32 {
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
