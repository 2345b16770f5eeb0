#[cfg(feature = "render")]
use std::ops::Neg;
use std::ops::{Add, Div, Mul, Sub};

/// How many rays go together.
#[cfg(feature = "render")]
pub(crate) const EIGHT: usize = 8;

/// Running sums that rows are spread over before they are added up.
const SUMS: usize = 16;

/// Numbers side by side.
///
/// Implementations for a set of instructions may only be used where a processor has it, inside a
/// function that enables it: [`super::Backend`] sees to that.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// How many numbers there are.
    const COUNT: usize;
    /// One of the numbers.
    type Scalar: Scalar;
    /// One truth for each number.
    type Truth: Truth<Self>;

    fn splat(value: Self::Scalar) -> Self;
    fn sqrt(self) -> Self;
    /// Returns the lesser; `other` where one is no number.
    fn min(self, other: Self) -> Self;
    /// Returns the greater; `other` where one is no number.
    fn max(self, other: Self) -> Self;
    fn less(self, other: Self) -> Self::Truth;
    fn at_most(self, other: Self) -> Self::Truth;

    /// Returns `self * factor + term`, rounded twice.
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
}

/// Truths side by side.
pub(crate) trait Truth<L>: Copy {
    fn both(self, other: Self) -> Self;
    fn either(self, other: Self) -> Self;
    /// Holds where this does and the other does not.
    fn and_not(self, other: Self) -> Self;
    /// Takes `yes` where this holds, `no` elsewhere.
    fn select(self, yes: L, no: L) -> L;
    /// Returns one bit for each truth, the first lowest.
    fn bits(self) -> u32;

    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// What sums over the rows of images need: one number a row.
///
/// Rows are added up in one order: sixteen running sums, of which number i takes every sixteenth
/// row. Where a register holds eight, even and odd groups of rows have sums of their own.
pub(crate) trait RowLanes: Lanes<Scalar = f32> {
    /// Registers that hold the sixteen running sums.
    const PARTS: usize = SUMS / Self::COUNT;
    /// One offset into a table a row.
    type Offsets: Copy;

    /// Returns first, first + 1, ...
    fn ramp(first: usize) -> Self;
    /// Returns first * pitch, (first + 1) * pitch, ...
    fn offsets(first: usize, pitch: usize) -> Self::Offsets;
    /// Adds sixteen running sums up, in halves: 8 to 8, 4 to 4, 2 to 2. Where one register holds
    /// them all, `other` is left out.
    fn total(self, other: Self) -> f32;
    /// Reads entries k and k + 1, k = floor(self), of the row at each offset, and gives self - k.
    ///
    /// # Safety
    /// `offset + k + 1` must lie inside the table for every row.
    unsafe fn pairs(self, table: *const f32, offsets: Self::Offsets) -> (Self, Self, Self);
}

/// A number as it lies in memory.
#[cfg_attr(not(feature = "render"), expect(dead_code, reason = "rays alone convert numbers"))]
pub(crate) trait Scalar: Copy + Send + Sync + 'static {
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

/// What eight rays need: a truth is a number of ones or of zeros in every bit.
#[cfg(feature = "render")]
pub(crate) trait RayLanes: Lanes<Truth = Self> + Truth<Self> + Neg<Output = Self> {
    fn splat_single(value: f32) -> Self;
    fn read(values: [Self::Scalar; EIGHT]) -> Self;
    fn write(self) -> [Self::Scalar; EIGHT];

    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::splat(Self::Scalar::of(value))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.max(-self)
    }
}

/// What rays of single precision do besides.
#[cfg(feature = "render")]
pub(crate) trait Single: RayLanes<Scalar = f32> {
    /// Whole parts, towards zero, of numbers below 2^31.
    fn whole(self) -> [i32; EIGHT];
    /// The same as numbers.
    fn trunc(self) -> Self;
}
