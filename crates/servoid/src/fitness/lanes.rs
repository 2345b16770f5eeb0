//! Vectors of rows: the few operations that the row kernels need, for each instruction set.
//!
//! Every instruction set gives the same bits. Each operation is rounded as IEEE 754 has it, no
//! multiplication is fused with an addition, and rows are added up in one order: sixteen running
//! sums, whatever a register holds, of which number i takes every sixteenth row. Where a register
//! holds eight, even and odd groups of rows have sums of their own.

/// Running sums that rows are spread over before they are added up.
const SUMS: usize = 16;

/// A vector of single-precision numbers, one a row.
///
/// # Safety
/// Methods of an implementation may only run where its instruction set is present, inside a
/// function that enables it, so that they are inlined there.
pub(super) unsafe trait Lanes: Copy {
    /// Rows a vector: 8 or 16.
    const COUNT: usize;
    /// Vectors that hold the sixteen running sums.
    const PARTS: usize = SUMS / Self::COUNT;
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
    /// Gives `self * factor + term`, rounded twice.
    #[inline(always)]
    unsafe fn mul_add(self, factor: Self, term: Self) -> Self {
        unsafe { self.mul(factor).add(term) }
    }
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
    /// Adds sixteen running sums up, in halves: 8 to 8, 4 to 4, 2 to 2. Where one vector holds them
    /// all, `other` is left out.
    unsafe fn total(self, other: Self) -> f32;
    /// Reads entries k and k + 1, k = floor(self), of the row at each offset.
    ///
    /// # Safety
    /// `offset + k + 1` must lie inside the table for every row.
    unsafe fn pairs(self, table: *const f32, offsets: Self::Offsets) -> (Self, Self, Self);
}

/// Sixteen running sums over vectors of rows that are added one after another, without a gap.
#[derive(Clone, Copy)]
pub(super) struct Running<L: Lanes> {
    /// What the next vector is added to, and what the one after it is.
    next: L,
    after: L,
}

impl<L: Lanes> Running<L> {
    #[inline(always)]
    pub unsafe fn zero() -> Self {
        unsafe { Self { next: L::splat(0.0), after: L::splat(0.0) } }
    }

    #[inline(always)]
    pub unsafe fn add(&mut self, rows: L) {
        unsafe {
            let sum = self.next.add(rows);
            if L::PARTS == 1 {
                self.next = sum;
            } else {
                // Which of the two is which does not matter in the end: a + b is b + a.
                (self.next, self.after) = (self.after, sum);
            }
        }
    }

    #[inline(always)]
    pub unsafe fn total(self) -> f32 {
        unsafe { self.next.total(self.after) }
    }
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
    unsafe fn total(self, other: Self) -> f32 {
        let eight = self.zip(other, |a, b| a + b).0;
        let four: [f32; 4] = std::array::from_fn(|i| eight[i] + eight[i + 4]);
        (four[0] + four[2]) + (four[1] + four[3])
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
