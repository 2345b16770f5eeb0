//! Eight numbers at once: the arithmetic that every ray is cast with.
//!
//! What is generic over lanes is always inlined and holds no closure, so that it ends up whole in the
//! function that enables a processor's instructions.
//!
//! No multiplication is fused with an addition, so that each processor gives the same bits.

use std::ops::{Add, Div, Mul, Neg, Sub};

use wide::{f32x8, f64x8};

/// How many rays go together.
pub(super) const COUNT: usize = 8;

/// A number as a scene stores it.
pub(super) trait Scalar: Copy + Send + Sync + 'static {
    fn of(value: f64) -> Self;
    fn to_f64(self) -> f64;
}

impl Scalar for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
}

impl Scalar for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
}

/// Eight numbers; a truth is a number of ones or of zeros in every bit.
pub(super) trait Lanes:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type Scalar: Scalar;

    fn splat(value: Self::Scalar) -> Self;
    fn splat_single(value: f32) -> Self;
    fn read(values: [Self::Scalar; COUNT]) -> Self;
    fn write(self) -> [Self::Scalar; COUNT];
    fn sqrt(self) -> Self;
    /// The smaller; the second where one is no number.
    fn min(self, other: Self) -> Self;
    /// The larger; the second where one is no number.
    fn max(self, other: Self) -> Self;
    fn less(self, other: Self) -> Self;
    fn at_most(self, other: Self) -> Self;
    fn both(self, other: Self) -> Self;
    /// Takes `yes` where this truth holds, `no` elsewhere.
    fn select(self, yes: Self, no: Self) -> Self;
    /// One bit for each truth, the first lowest.
    fn bits(self) -> u32;

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::splat(Self::Scalar::of(value))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
}

/// What single precision does besides.
pub(super) trait Single: Lanes<Scalar = f32> {
    /// Whole parts, towards zero, of numbers below 2^31.
    fn whole(self) -> [i32; COUNT];
    /// The same as numbers.
    fn trunc(self) -> Self;
}

impl Single for f32x8 {
    #[inline(always)]
    fn whole(self) -> [i32; COUNT] {
        self.fast_trunc_int().to_array()
    }

    #[inline(always)]
    fn trunc(self) -> Self {
        Self::from_i32x8(self.fast_trunc_int())
    }
}

macro_rules! portable {
    ($lanes:ty, $scalar:ty) => {
        impl Lanes for $lanes {
            type Scalar = $scalar;

            #[inline(always)]
            fn splat(value: $scalar) -> Self {
                Self::splat(value)
            }

            #[inline(always)]
            fn splat_single(value: f32) -> Self {
                Self::splat(value.into())
            }

            #[inline(always)]
            fn read(values: [$scalar; COUNT]) -> Self {
                Self::new(values)
            }

            #[inline(always)]
            fn write(self) -> [$scalar; COUNT] {
                self.to_array()
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.less(other).select(self, other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                other.less(self).select(self, other)
            }

            #[inline(always)]
            fn less(self, other: Self) -> Self {
                self.simd_lt(other)
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> Self {
                self.simd_le(other)
            }

            #[inline(always)]
            fn both(self, other: Self) -> Self {
                self & other
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
    };
}

portable!(f32x8, f32);
portable!(f64x8, f64);
