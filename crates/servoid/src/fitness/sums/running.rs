use crate::simd::RowLanes;

/// Sixteen running sums over vectors of rows that are added one after another, without a gap.
#[derive(Clone, Copy)]
pub(in crate::fitness) struct Running<L: RowLanes> {
    /// The sum for the next vector, and the sum for the one after it.
    next: L,
    after: L,
}

impl<L: RowLanes> Running<L> {
    #[inline(always)]
    pub fn zero() -> Self {
        Self { next: L::splat(0.0), after: L::splat(0.0) }
    }

    #[inline(always)]
    pub fn add(&mut self, rows: L) {
        let sum = self.next + rows;
        if L::PARTS == 1 {
            self.next = sum;
        } else {
            // The order of the two does not matter in the end: a + b is b + a.
            (self.next, self.after) = (self.after, sum);
        }
    }

    #[inline(always)]
    pub fn total(self) -> f32 {
        self.next.total(self.after)
    }
}
