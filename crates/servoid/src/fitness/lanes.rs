//! Vectors of rows: the few operations that the row kernels need, for each instruction set.

/// A vector of single-precision numbers, one a row.
///
/// # Safety
/// Methods of an implementation may only run where its instruction set is present, inside a
/// function that enables it, so that they are inlined there.
pub(super) unsafe trait Lanes: Copy {
    /// Rows a vector.
    const COUNT: usize;
    /// One truth value a row.
    type Truth: Copy;
    /// One offset into a table a row.
    type Offsets: Copy;

    unsafe fn splat(x: f32) -> Self;
    /// Gives first, first + 1, ...
    unsafe fn ramp(first: usize) -> Self;
    /// Gives first * pitch, (first + 1) * pitch, ...
    unsafe fn offsets(first: usize, pitch: usize) -> Self::Offsets;
    unsafe fn add(self, other: Self) -> Self;
    unsafe fn sub(self, other: Self) -> Self;
    unsafe fn mul(self, other: Self) -> Self;
    unsafe fn div(self, other: Self) -> Self;
    /// Gives `self * factor + term`.
    unsafe fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Gives the lesser; `other` if `self` is not a number.
    unsafe fn min(self, other: Self) -> Self;
    /// Gives the greater; `other` if `self` is not a number.
    unsafe fn max(self, other: Self) -> Self;
    unsafe fn sqrt(self) -> Self;
    unsafe fn less(self, other: Self) -> Self::Truth;
    unsafe fn less_equal(self, other: Self) -> Self::Truth;
    unsafe fn and(left: Self::Truth, right: Self::Truth) -> Self::Truth;
    unsafe fn or(left: Self::Truth, right: Self::Truth) -> Self::Truth;
    /// Gives `left` and not `right`.
    unsafe fn and_not(left: Self::Truth, right: Self::Truth) -> Self::Truth;
    unsafe fn any(truth: Self::Truth) -> bool;
    unsafe fn select(truth: Self::Truth, yes: Self, no: Self) -> Self;
    /// Adds the rows up in a fixed order.
    unsafe fn total(self) -> f32;
    /// Reads entries k and k + 1, k = floor(self), of the row at each offset.
    ///
    /// # Safety
    /// `offset + k + 1` must lie inside the table for every row.
    unsafe fn pairs(self, table: *const f32, offsets: Self::Offsets) -> (Self, Self, Self);
}

/// Eight rows in plain arrays: runs everywhere.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; 8]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(&f32, &f32) -> bool) -> [bool; 8] {
        std::array::from_fn(|i| f(&self.0[i], &other.0[i]))
    }
}

// SAFETY: plain arithmetic, present everywhere.
unsafe impl Lanes for Portable {
    const COUNT: usize = 8;
    type Truth = [bool; 8];
    type Offsets = [usize; 8];

    #[inline(always)]
    unsafe fn splat(x: f32) -> Self {
        Self([x; 8])
    }
    #[inline(always)]
    unsafe fn ramp(first: usize) -> Self {
        Self(std::array::from_fn(|i| (first + i) as f32))
    }
    #[inline(always)]
    unsafe fn offsets(first: usize, pitch: usize) -> [usize; 8] {
        std::array::from_fn(|i| (first + i) * pitch)
    }
    #[inline(always)]
    unsafe fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    unsafe fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    unsafe fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    unsafe fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, term: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] * factor.0[i] + term.0[i]))
    }
    #[inline(always)]
    unsafe fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    unsafe fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    unsafe fn sqrt(self) -> Self {
        Self(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    unsafe fn less(self, other: Self) -> [bool; 8] {
        self.compare(other, f32::lt)
    }
    #[inline(always)]
    unsafe fn less_equal(self, other: Self) -> [bool; 8] {
        self.compare(other, f32::le)
    }
    #[inline(always)]
    unsafe fn and(left: [bool; 8], right: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| left[i] & right[i])
    }
    #[inline(always)]
    unsafe fn or(left: [bool; 8], right: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| left[i] | right[i])
    }
    #[inline(always)]
    unsafe fn and_not(left: [bool; 8], right: [bool; 8]) -> [bool; 8] {
        std::array::from_fn(|i| left[i] & !right[i])
    }
    #[inline(always)]
    unsafe fn any(truth: [bool; 8]) -> bool {
        truth.iter().any(|&t| t)
    }
    #[inline(always)]
    unsafe fn select(truth: [bool; 8], yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| if truth[i] { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    unsafe fn total(self) -> f32 {
        self.0.iter().sum()
    }
    #[inline(always)]
    unsafe fn pairs(self, table: *const f32, offsets: [usize; 8]) -> (Self, Self, Self) {
        // SAFETY: the caller keeps offset + k + 1 inside the table.
        let read =
            |i: usize, step: usize| unsafe { *table.add(offsets[i] + self.0[i] as usize + step) };
        let part = Self(self.0.map(|x| x - (x as usize) as f32));
        (Self(std::array::from_fn(|i| read(i, 0))), Self(std::array::from_fn(|i| read(i, 1))), part)
    }
}
