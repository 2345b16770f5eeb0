//! Eight lanes on any processor, by the vector instructions that it is guaranteed to have.

use wide::f32x8;
#[cfg(feature = "render")]
use wide::f64x8;

#[cfg(feature = "render")]
use super::lanes::{EIGHT, RayLanes, Single};
use super::lanes::{Lanes, RowLanes, Truth};

/// Eight lanes of single precision.
pub(crate) type Eight = f32x8;

macro_rules! portable {
    ($lanes:ty, $scalar:ty) => {
        impl Lanes for $lanes {
            const COUNT: usize = 8;
            type Scalar = $scalar;
            type Truth = Self;

            #[inline(always)]
            fn splat(value: $scalar) -> Self {
                Self::splat(value)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Truth::select(self.less(other), self, other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Truth::select(other.less(self), self, other)
            }

            #[inline(always)]
            fn less(self, other: Self) -> Self {
                self.simd_lt(other)
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> Self {
                self.simd_le(other)
            }
        }

        impl Truth<Self> for $lanes {
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
            fn select(self, yes: Self, no: Self) -> Self {
                self.bitselect(yes, no)
            }

            #[inline(always)]
            fn bits(self) -> u32 {
                self.to_bitmask()
            }
        }

        #[cfg(feature = "render")]
        impl RayLanes for $lanes {
            #[inline(always)]
            fn splat_single(value: f32) -> Self {
                Self::splat(value.into())
            }

            #[inline(always)]
            fn read(values: [$scalar; EIGHT]) -> Self {
                Self::new(values)
            }

            #[inline(always)]
            fn write(self) -> [$scalar; EIGHT] {
                self.to_array()
            }
        }
    };
}

portable!(f32x8, f32);
#[cfg(feature = "render")]
portable!(f64x8, f64);

impl RowLanes for f32x8 {
    type Offsets = [usize; 8];

    #[inline(always)]
    fn ramp(first: usize) -> Self {
        Self::new(std::array::from_fn(|i| (first + i) as f32))
    }

    #[inline(always)]
    fn offsets(first: usize, pitch: usize) -> [usize; 8] {
        std::array::from_fn(|i| (first + i) * pitch)
    }

    #[inline(always)]
    fn total(self, other: Self) -> f32 {
        let eight = (self + other).to_array();
        let four: [f32; 4] = std::array::from_fn(|i| eight[i] + eight[i + 4]);
        (four[0] + four[2]) + (four[1] + four[3])
    }

    #[inline(always)]
    unsafe fn pairs(self, table: *const f32, offsets: [usize; 8]) -> (Self, Self, Self) {
        let at = self.to_array();
        // SAFETY: the caller keeps offset + k + 1 inside the table.
        let read =
            |i: usize, step: usize| unsafe { *table.add(offsets[i] + at[i] as usize + step) };
        let (here, next) =
            (std::array::from_fn(|i| read(i, 0)), std::array::from_fn(|i| read(i, 1)));
        let part = at.map(|x| x - (x as usize) as f32);
        (Self::new(here), Self::new(next), Self::new(part))
    }
}

#[cfg(feature = "render")]
impl Single for f32x8 {
    #[inline(always)]
    fn whole(self) -> [i32; EIGHT] {
        self.fast_trunc_int().to_array()
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        Self::from_i32x8(self.fast_trunc_int())
    }
}
