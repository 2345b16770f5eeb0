use std::mem::MaybeUninit;

use super::lanes::{Lanes, Running};
use super::map::ScoreMap;
use super::rows::{Crossing, RowGroup, RowOutline, RowOutlines, Sums};

/// Intervals of a vector of rows, sorted by where they begin.
struct Sorted<L: Lanes, const ROOM: usize> {
    begins: [MaybeUninit<L>; ROOM],
    ends: [MaybeUninit<L>; ROOM],
    count: usize,
}

impl<L: Lanes, const ROOM: usize> Sorted<L, ROOM> {
    /// Sorts one interval in. // insertion sort, the same exchanges in every row
    #[inline(always)]
    unsafe fn insert(&mut self, mut begin: L, mut end: L) {
        // SAFETY: the first `count` entries were written, and there are at most ROOM outlines.
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
/// The instruction set of `L` must be enabled in the caller; there are at most `ROOM` outlines.
#[inline(always)]
pub(super) unsafe fn union_sums<L: Lanes, const ROOM: usize>(
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

/// Gives the score and the area of a vector of rows.
///
/// # Safety
/// `row` must be a kept row, and there are at most `ROOM` outlines.
#[inline(always)]
unsafe fn group_sums<L: Lanes, const ROOM: usize>(
    map: &ScoreMap,
    all: &[RowOutline],
    row: usize,
) -> (L, L) {
    // SAFETY: columns are cut to the image.
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
unsafe fn run<L: Lanes>(group: &RowGroup<L>, begin: L, end: L) -> (L, L) {
    unsafe { (group.look_up(end).0.sub(group.look_up(begin).0), end.sub(begin)) }
}

#[inline(always)]
unsafe fn sweep<L: Lanes, const ROOM: usize>(
    group: &RowGroup<L>,
    sorted: &Sorted<L, ROOM>,
) -> (L, L) {
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
