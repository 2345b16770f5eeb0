use super::map::ScoreMap;
use crate::shape::{Body, Outline};
use crate::simd::{RowLanes, Truth};

/// An outline prepared for the rows of one map: single precision, columns relative to the left
/// *edge* of the image, first and last kept row.
#[derive(Debug, Clone, Copy)]
pub(in crate::fitness) struct RowOutline {
    pub center_u: f32,
    pub center_v: f32,
    pub slope: f32,
    pub half_width: f32,
    pub per_half_height: f32,
    /// Where 1 - across² is less than this, a row is so near to a pole that it is averaged.
    pub blunt: f32,
    pub quarter_per_blunt: f32,
    pub first: usize,
    pub last: usize,
}

/// Distance in pixels from the corner beyond which single precision does not resolve an outline,
/// and it counts as unseen.
const FARTHEST: f64 = 1e6;

/// Rows within this relative distance of the outline's reach count as reached, so that rounding to
/// single precision never opens a row that is left out: a kernel may or may not visit it.
const SLACK: f64 = 1e-6;

/// A row that no outline reaches.
const FAR_AWAY: f32 = 1e9;

impl RowOutline {
    /// Prepares an outline; `None` if it touches no kept row or is too large for the numbers.
    #[inline(always)]
    pub fn new(outline: &Outline, map: &ScoreMap) -> Option<Self> {
        let reach = outline.reach(map.stride() as f64);
        let reach_v = outline.center_v.abs() + reach;
        let reach = reach + SLACK * reach_v;
        let top = (outline.center_v - reach) * map.per_stride();
        let bottom = (outline.center_v + reach) * map.per_stride();
        let last_row = map.rows() as f64 - 1.0;
        // Fails for NaN as well.
        let reaches = top <= last_row && bottom >= 0.0 && outline.half_height > 0.0;
        let reach_u = outline.center_u.abs() + outline.half_width;
        let bounded = reach_u < FARTHEST && reach_v < FARTHEST;
        if !reaches || !bounded {
            return None;
        }
        let blunt = outline.bluntness(map.stride() as f64) as f32;
        Some(Self {
            center_u: (outline.center_u + 0.5) as f32,
            center_v: outline.center_v as f32,
            slope: outline.slope as f32,
            half_width: outline.half_width as f32,
            per_half_height: 1.0 / outline.half_height as f32,
            blunt,
            quarter_per_blunt: 0.25 / blunt,
            first: top.max(0.0) as usize,
            last: bottom.min(last_row) as usize,
        })
    }

    /// Returns whether the outline may reach one of `count` rows from `row`.
    #[inline(always)]
    pub fn reaches(&self, row: usize, count: usize) -> bool {
        self.first < row + count && self.last >= row
    }
}

/// The outlines of one candidate in one view.
pub(in crate::fitness) struct RowOutlines {
    entries: [std::mem::MaybeUninit<RowOutline>; Body::MAX_ELLIPSOIDS],
    count: usize,
    /// First and last row that an outline reaches.
    pub first: usize,
    pub last: usize,
}

impl RowOutlines {
    #[inline(always)]
    pub fn new() -> Self {
        let entries = [const { std::mem::MaybeUninit::uninit() }; Body::MAX_ELLIPSOIDS];
        Self { entries, count: 0, first: usize::MAX, last: 0 }
    }

    /// Adds an outline; beyond [`Body::MAX_ELLIPSOIDS`] it is dropped.
    #[inline(always)]
    pub fn push(&mut self, outline: RowOutline) {
        if let Some(place) = self.entries.get_mut(self.count) {
            place.write(outline);
            self.count += 1;
            self.first = self.first.min(outline.first);
            self.last = self.last.max(outline.last);
        }
    }

    #[inline(always)]
    pub fn as_slice(&self) -> &[RowOutline] {
        // SAFETY: the first `count` entries were written.
        unsafe { std::slice::from_raw_parts(self.entries.as_ptr().cast(), self.count) }
    }
}

/// Number of outlines that are processed in a small array: initialising a large one costs as much
/// as their sums.
pub(in crate::fitness) const FEW: usize = 8;

/// Sums over the rows of a map inside a union of outlines.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sums {
    /// Sum of the scores inside, Σ ℓ.
    pub score: f64,
    /// Pixels inside.
    pub area: f64,
}

/// A vector of kept rows: their pixel rows and their offsets in the map.
pub(in crate::fitness) struct RowGroup<L: RowLanes> {
    pub rows: L,
    pub offsets: L::Offsets,
    pub width: L,
    table: *const f32,
}

impl<L: RowLanes> RowGroup<L> {
    /// # Safety
    /// `first` must be a kept row of the map; the instruction set of `L` must be enabled.
    #[inline(always)]
    pub unsafe fn new(map: &ScoreMap, first: usize) -> Self {
        let index = L::ramp(first);
        let rows = index.mul(L::splat(map.stride() as f32));
        let kept = index.less(L::splat(map.rows() as f32));
        Self {
            rows: kept.select(rows, L::splat(FAR_AWAY)),
            offsets: L::offsets(first, map.pitch()),
            width: L::splat(map.size_px()[0] as f32),
            table: map.prefix().as_ptr(),
        }
    }

    /// Sums a row from its left edge to column `at` (0 to width), and returns the score there.
    ///
    /// # Safety
    /// `at` must lie between 0 and the width.
    #[inline(always)]
    pub unsafe fn look_up(&self, at: L) -> (L, L) {
        // SAFETY: a row has width + 2 entries and COUNT rows of padding follow the last one.
        unsafe {
            let (here, next, part) = at.pairs(self.table, self.offsets);
            let score = next.sub(here);
            (part.mul_add(score, here), score)
        }
    }

    /// Clips a column to the image; NaN becomes an edge.
    #[inline(always)]
    pub fn cut(&self, column: L) -> L {
        column.min(self.width).max(L::splat(0.0))
    }
}

/// The crossing of one outline with a vector of rows.
#[derive(Clone, Copy)]
pub(in crate::fitness) struct Crossing<L: RowLanes> {
    pub below: L,
    pub across: L,
    pub root: L,
    /// 1 - across², clipped and shifted to lie between 0 and twice the bluntness.
    pub near: L,
    pub begin: L,
    pub end: L,
}

impl<L: RowLanes> Crossing<L> {
    #[inline(always)]
    pub fn new(outline: &RowOutline, group: &RowGroup<L>) -> Self {
        let below = group.rows.sub(L::splat(outline.center_v));
        let across = below.mul(L::splat(outline.per_half_height));
        let square = L::splat(1.0).sub(across.mul(across));
        let blunt = L::splat(outline.blunt);
        let near = square.min(blunt).add(blunt).max(L::splat(0.0));
        let far = square.sub(blunt).max(L::splat(0.0));
        let root = near.mul(near).mul_add(L::splat(outline.quarter_per_blunt), far).sqrt();
        let middle = below.mul_add(L::splat(outline.slope), L::splat(outline.center_u));
        let half = root.mul(L::splat(outline.half_width));
        let (begin, end) = (group.cut(middle.sub(half)), group.cut(middle.add(half)));
        Self { below, across, root, near, begin, end }
    }

    /// Moves empty intervals out of the way: they begin at the right edge and end at the left.
    #[inline(always)]
    pub fn without_empty(mut self, group: &RowGroup<L>) -> Self {
        let holds = self.begin.less(self.end);
        self.begin = holds.select(self.begin, group.width);
        self.end = holds.select(self.end, L::splat(0.0));
        self
    }
}
