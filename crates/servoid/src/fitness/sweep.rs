use std::mem::MaybeUninit;

use super::lanes::Lanes;
use super::map::ScoreMap;
use super::rows::{Crossing, RowGroup, RowOutlines, Sums};
use crate::shape::Body;

type Stack<L> = [MaybeUninit<L>; Body::MAX_ELLIPSOIDS];

/// Intervals of a vector of rows, sorted by where they begin.
struct Sorted<L: Lanes> {
    begins: Stack<L>,
    ends: Stack<L>,
    count: usize,
}

impl<L: Lanes> Sorted<L> {
    /// Sorts one interval in. // insertion sort, the same exchanges in every row
    #[inline(always)]
    unsafe fn insert(&mut self, mut begin: L, mut end: L) {
        // SAFETY: the first `count` entries were written, and a body has at most MAX_ELLIPSOIDS.
        unsafe {
            for at in (0..self.count).rev() {
                let (other, other_end) =
                    (self.begins[at].assume_init(), self.ends[at].assume_init());
                let first = begin.less(other);
                self.begins[at + 1].write(L::select(first, other, begin));
                self.ends[at + 1].write(L::select(first, other_end, end));
                begin = L::select(first, begin, other);
                end = L::select(first, end, other_end);
            }
            self.begins[0].write(begin);
            self.ends[0].write(end);
            self.count += 1;
        }
    }

    #[inline(always)]
    unsafe fn get(&self, at: usize) -> (L, L) {
        // SAFETY: only called for at < count.
        unsafe { (self.begins[at].assume_init(), self.ends[at].assume_init()) }
    }
}

/// Sums a map over the union of outlines. // Eq. (7)
///
/// Each row's intervals are sorted and swept from left to right; the prefix sums are read only
/// where the union begins and ends.
///
/// # Safety
/// The instruction set of `L` must be enabled in the caller.
#[inline(always)]
pub(super) unsafe fn union_sums<L: Lanes>(map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    // SAFETY: rows run from 0 to the last kept one, and columns are cut to the image.
    unsafe {
        let (mut score, mut area) = (L::splat(0.0), L::splat(0.0));
        let mut row = outlines.first;
        while row <= outlines.last && !outlines.as_slice().is_empty() {
            let group = RowGroup::<L>::new(map, row);
            let mut reached =
                outlines.as_slice().iter().filter(|outline| outline.reaches(row, L::COUNT));
            let pair = (reached.next(), reached.next());
            let (gain, length) = match pair {
                (Some(only), None) => {
                    let crossing = Crossing::new(only, &group);
                    run(&group, crossing.begin, crossing.end)
                }
                (Some(one), Some(two)) => {
                    let stack = [const { MaybeUninit::uninit() }; Body::MAX_ELLIPSOIDS];
                    let mut sorted = Sorted { begins: stack, ends: stack, count: 0 };
                    for outline in [one, two].into_iter().chain(reached) {
                        let crossing = Crossing::new(outline, &group).without_empty(&group);
                        sorted.insert(crossing.begin, crossing.end);
                    }
                    sweep(&group, &sorted)
                }
                _ => (L::splat(0.0), L::splat(0.0)),
            };
            score = score.add(gain);
            area = area.add(length);
            row += L::COUNT;
        }
        let weight = map.stride() as f64;
        Sums {
            score: weight * ScoreMap::QUANTUM * f64::from(score.total()),
            area: weight * f64::from(area.total()),
        }
    }
}

/// Sums each row between two columns.
#[inline(always)]
unsafe fn run<L: Lanes>(group: &RowGroup<L>, begin: L, end: L) -> (L, L) {
    unsafe { (group.look_up(end).0.sub(group.look_up(begin).0), end.sub(begin)) }
}

#[inline(always)]
unsafe fn sweep<L: Lanes>(group: &RowGroup<L>, sorted: &Sorted<L>) -> (L, L) {
    unsafe {
        let zero = L::splat(0.0);
        let (start, mut reached) = sorted.get(0);
        let (mut gaps, mut gap_length) = (zero, zero);
        for at in 1..sorted.count {
            let (begin, end) = sorted.get(at);
            let gap = L::and(reached.less(begin), begin.less(group.width));
            if L::any(gap) {
                let (lost, length) = run(group, reached, begin);
                gaps = gaps.add(L::select(gap, lost, zero));
                gap_length = gap_length.add(L::select(gap, length, zero));
            }
            reached = reached.max(end);
        }
        let (whole, length) = run(group, start, reached);
        let holds = start.less(reached);
        (L::select(holds, whole.sub(gaps), zero), L::select(holds, length.sub(gap_length), zero))
    }
}
