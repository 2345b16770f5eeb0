use std::mem::MaybeUninit;

use super::map::ScoreMap;
use super::rows::{Crossing, FEW, RowGroup, RowOutline, RowOutlines, Sums};
use super::running::Running;
use crate::shape::Body;
use crate::simd::{Backend, RowKernel, RowLanes, Truth};

/// Intervals of a vector of rows, sorted by their start.
struct Sorted<L: RowLanes, const ROOM: usize> {
    begins: [MaybeUninit<L>; ROOM],
    ends: [MaybeUninit<L>; ROOM],
    count: usize,
}

impl<L: RowLanes, const ROOM: usize> Sorted<L, ROOM> {
    /// Inserts one interval. // insertion sort, the same exchanges in every row
    #[inline(always)]
    unsafe fn insert(&mut self, mut begin: L, mut end: L) {
        // SAFETY: the first `count` entries were written, and there are at most ROOM outlines.
        unsafe {
            for at in (0..self.count).rev() {
                let (other, other_end) =
                    (self.begins[at].assume_init(), self.ends[at].assume_init());
                let first = begin.less(other);
                self.begins[at + 1].write(first.select(other, begin));
                self.ends[at + 1].write(first.select(other_end, end));
                begin = first.select(begin, other);
                end = first.select(end, other_end);
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

/// Sums a map over the union of outlines, with the instructions of a backend.
pub(in crate::fitness) fn sums(backend: Backend, map: &ScoreMap, outlines: &RowOutlines) -> Sums {
    if outlines.as_slice().len() <= FEW {
        backend.run_rows(UnionSums::<FEW> { map, outlines })
    } else {
        backend.run_rows(UnionSums::<{ Body::MAX_ELLIPSOIDS }> { map, outlines })
    }
}

struct UnionSums<'a, const ROOM: usize> {
    map: &'a ScoreMap,
    outlines: &'a RowOutlines,
}

impl<const ROOM: usize> RowKernel for UnionSums<'_, ROOM> {
    type Output = Sums;

    #[inline(always)]
    unsafe fn run<L: RowLanes>(self) -> Sums {
        // SAFETY: as the caller promises; there is room for the outlines.
        unsafe { union_sums::<L, ROOM>(self.map, self.outlines) }
    }
}

/// Sums a map over the union of outlines. // Eq. (7)
///
/// Each row's intervals are sorted and swept from left to right; the prefix sums are read only
/// where the union begins and ends.
///
/// # Safety
/// The instruction set of `L` must be enabled in the caller; there are at most `ROOM` outlines.
#[inline(always)]
unsafe fn union_sums<L: RowLanes, const ROOM: usize>(
    map: &ScoreMap,
    outlines: &RowOutlines,
) -> Sums {
    // SAFETY: rows run from 0 to the last kept one.
    unsafe {
        let (mut score, mut area) = (Running::<L>::zero(), Running::zero());
        let mut row = outlines.first;
        while row <= outlines.last && !outlines.as_slice().is_empty() {
            let (gain, length) = group_sums::<L, ROOM>(map, outlines.as_slice(), row);
            score.add(gain);
            area.add(length);
            row += L::COUNT;
        }
        let weight = map.stride() as f64;
        Sums {
            score: weight * ScoreMap::QUANTUM * f64::from(score.total()),
            area: weight * f64::from(area.total()),
        }
    }
}

/// Returns the score and the area of a vector of rows.
///
/// # Safety
/// `row` must be a kept row, and there are at most `ROOM` outlines.
#[inline(always)]
unsafe fn group_sums<L: RowLanes, const ROOM: usize>(
    map: &ScoreMap,
    all: &[RowOutline],
    row: usize,
) -> (L, L) {
    // SAFETY: columns are clipped to the image.
    unsafe {
        let group = RowGroup::<L>::new(map, row);
        let mut reached = all.iter().filter(|outline| outline.reaches(row, L::COUNT));
        match (reached.next(), reached.next()) {
            (Some(only), None) => {
                let crossing = Crossing::new(only, &group);
                run(&group, crossing.begin, crossing.end)
            }
            (Some(one), Some(two)) => {
                let stack = [const { MaybeUninit::uninit() }; ROOM];
                let mut sorted = Sorted::<L, ROOM> { begins: stack, ends: stack, count: 0 };
                for outline in [one, two].into_iter().chain(reached) {
                    let crossing = Crossing::new(outline, &group).without_empty(&group);
                    sorted.insert(crossing.begin, crossing.end);
                }
                sweep(&group, &sorted)
            }
            _ => (L::splat(0.0), L::splat(0.0)),
        }
    }
}

/// Sums each row between two columns.
#[inline(always)]
unsafe fn run<L: RowLanes>(group: &RowGroup<L>, begin: L, end: L) -> (L, L) {
    unsafe { (group.look_up(end).0.sub(group.look_up(begin).0), end.sub(begin)) }
}

#[inline(always)]
unsafe fn sweep<L: RowLanes, const ROOM: usize>(
    group: &RowGroup<L>,
    sorted: &Sorted<L, ROOM>,
) -> (L, L) {
    unsafe {
        let zero = L::splat(0.0);
        let (start, mut reached) = sorted.get(0);
        let (mut gaps, mut gap_length) = (zero, zero);
        for at in 1..sorted.count {
            let (begin, end) = sorted.get(at);
            let gap = reached.less(begin).both(begin.less(group.width));
            if gap.any() {
                let (lost, length) = run(group, reached, begin);
                gaps = gaps.add(gap.select(lost, zero));
                gap_length = gap_length.add(gap.select(length, zero));
            }
            reached = reached.max(end);
        }
        let (whole, length) = run(group, start, reached);
        let holds = start.less(reached);
        (holds.select(whole.sub(gaps), zero), holds.select(length.sub(gap_length), zero))
    }
}
