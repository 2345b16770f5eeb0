#[cfg(feature = "render")]
use std::ops::Neg;
use std::ops::{Add, Div, Mul, Sub};

/// Number of rays in a group.
#[cfg(feature = "render")]
pub(crate) const EIGHT: usize = 8;

/// Number of running sums over which rows are distributed before they are added up.
const SUMS: usize = 16;

/// A vector of numbers.
///
/// Implementations for a set of instructions may only be used on a processor that has it, inside a
/// function that enables it: [`super::Backend`] ensures that.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Number of lanes.
    const COUNT: usize;
    /// Type of a lane.
    type Scalar: Scalar;
    /// One truth value per lane.
    type Truth: Truth<Self>;

    fn splat(value: Self::Scalar) -> Self;
    fn sqrt(self) -> Self;
    /// Returns the lesser; `other` if either is NaN.
    fn min(self, other: Self) -> Self;
    /// Returns the greater; `other` if either is NaN.
    fn max(self, other: Self) -> Self;
    fn less(self, other: Self) -> Self::Truth;
    fn at_most(self, other: Self) -> Self::Truth;

    /// Returns `self * factor + term`, rounded twice.
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
}

/// A vector of truth values.
pub(crate) trait Truth<L>: Copy {
    fn both(self, other: Self) -> Self;
    fn either(self, other: Self) -> Self;
    /// Returns where this holds and the other does not.
    fn and_not(self, other: Self) -> Self;
    /// Returns `yes` where this holds, `no` elsewhere.
    fn select(self, yes: L, no: L) -> L;
    /// Returns one bit per truth value, the first lowest.
    fn bits(self) -> u32;

    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// Operations for sums over the rows of images, with one number per row.
///
/// Rows are summed in a fixed order: sixteen running sums, of which number i takes every sixteenth
/// row. If a register has eight lanes, even and odd groups of rows have sums of their own.
pub(crate) trait RowLanes: Lanes<Scalar = f32> {
    /// Registers that contain the sixteen running sums.
    const PARTS: usize = SUMS / Self::COUNT;
    /// One offset into a table per row.
    type Offsets: Copy;

    /// Returns first, first + 1, ...
    fn ramp(first: usize) -> Self;
    /// Returns first * pitch, (first + 1) * pitch, ...
    fn offsets(first: usize, pitch: usize) -> Self::Offsets;
    /// Adds up sixteen running sums by halves: 8 to 8, 4 to 4, 2 to 2. If one register contains
    /// them all, `other` is ignored.
    fn total(self, other: Self) -> f32;
    /// Reads entries k and k + 1, k = floor(self), of the row at each offset; also returns self -
    /// k.
    ///
    /// # Safety
    /// `offset + k + 1` must lie inside the table for every row.
    unsafe fn pairs(self, table: *const f32, offsets: Self::Offsets) -> (Self, Self, Self);
}

/// A number as stored in memory.
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

/// Operations for eight rays: a truth value is a number with all bits one or all bits zero.
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

/// Further operations for rays of single precision.
#[cfg(feature = "render")]
pub(crate) trait Single: RayLanes<Scalar = f32> {
    /// Integer parts, rounded towards zero, of numbers below 2^31.
    fn whole(self) -> [i32; EIGHT];
    /// The same as floating-point numbers.
    fn trunc(self) -> Self;
}
