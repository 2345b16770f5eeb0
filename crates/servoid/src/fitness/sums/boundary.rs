use std::mem::MaybeUninit;

use super::map::ScoreMap;
use super::rows::{Crossing, FEW, RowGroup, RowOutline, RowOutlines, Sums};
use super::running::Running;
use crate::shape::Body;
use crate::simd::{Backend, RowKernel, RowLanes, Truth};

/// Gradient of a sum over the union by the five numbers of one outline, in the order of
/// [`crate::shape::Outline`]: centre u, centre v, slope, half width, half height.
pub(in crate::fitness) type OutlineGradient = [f64; 5];

/// The gradients of Σ ℓ and of the area by one outline.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::fitness) struct OutlineGradients {
    pub score: OutlineGradient,
    pub area: OutlineGradient,
}

/// Derivatives of the root in a vector of rows: by the position across the outline, negated, and by
/// the outline's height, in units of its reciprocal.
#[derive(Clone, Copy)]
struct Lean<L: RowLanes> {
    across: L,
    taller: L,
}

impl<L: RowLanes> Lean<L> {
    #[inline(always)]
    fn new(crossing: &Crossing<L>, quarter_per_blunt: f32) -> Self {
        let per_root = L::splat(1.0).div(crossing.root.max(L::splat(1e-6)));
        let fall = crossing.near.mul(L::splat(2.0 * quarter_per_blunt));
        let across = crossing.across.mul(fall).mul(per_root);
        // A taller outline is less blunt, which reduces the derivative a little near the poles.
        let back = fall.mul(L::splat(1.0).sub(fall)).mul(per_root);
        let back = back.mul(L::splat(0.125 / quarter_per_blunt));
        Self { across, taller: across.mul(crossing.across).sub(back) }
    }
}

/// One of two sets of running sums over the exposed ends of one outline, or all of them if one
/// vector holds them: of the weight w, of w·below, of w·root, and of w times both parts of the
/// [`Lean`], where the left end has the opposite sign.
#[derive(Clone, Copy)]
struct Moments<L: RowLanes>([L; 5]);

impl<L: RowLanes> Moments<L> {
    #[inline(always)]
    fn zero() -> Self {
        Self([L::splat(0.0); 5])
    }

    /// Adds the weights of the right and the left end of a vector of rows.
    #[inline(always)]
    fn add(&mut self, right: L, left: L, crossing: &Crossing<L>, lean: Lean<L>) {
        let (both, apart) = (right.sub(left), right.add(left));
        let steep = apart.mul(lean.across);
        self.0[0] = self.0[0].add(both);
        self.0[1] = both.mul_add(crossing.below, self.0[1]);
        self.0[2] = apart.mul_add(crossing.root, self.0[2]);
        self.0[3] = self.0[3].add(steep);
        self.0[4] = apart.mul_add(lean.taller, self.0[4]);
    }

    #[inline(always)]
    fn gradient(&self, other: &Self, outline: &RowOutline, weight: f64) -> OutlineGradient {
        let mut totals = [0.0; 5];
        for (total, (lanes, others)) in totals.iter_mut().zip(self.0.into_iter().zip(other.0)) {
            *total = weight * f64::from(lanes.total(others));
        }
        let [both, below, root, steep, square] = totals;
        let taper = f64::from(outline.half_width) * f64::from(outline.per_half_height);
        [both, steep * taper - f64::from(outline.slope) * both, below, root, square * taper]
    }
}

/// Sums a map over the union of outlines and differentiates the sums, with the instructions of a
/// backend; `gradients` has one entry per outline.
pub(in crate::fitness) fn gradients(
    backend: Backend,
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    if outlines.as_slice().len() <= FEW {
        backend.run_rows(UnionGradients::<FEW> { map, outlines, gradients })
    } else {
        backend.run_rows(UnionGradients::<{ Body::MAX_ELLIPSOIDS }> { map, outlines, gradients })
    }
}

struct UnionGradients<'a, const ROOM: usize> {
    map: &'a ScoreMap,
    outlines: &'a RowOutlines,
    gradients: &'a mut [OutlineGradients],
}

impl<const ROOM: usize> RowKernel for UnionGradients<'_, ROOM> {
    type Output = Sums;

    #[inline(always)]
    unsafe fn run<L: RowLanes>(self) -> Sums {
        // SAFETY: as the caller promises; there is room for the outlines.
        unsafe { union_gradients::<L, ROOM>(self.map, self.outlines, self.gradients) }
    }
}

/// Sums a map over the union of outlines and differentiates the sums: an integral over the exposed
/// boundary, since the inside of the union does not change.
///
/// # Safety
/// The instruction set of `L` must be enabled in the caller; `gradients` has one entry per outline,
/// and there are at most `ROOM` outlines.
#[inline(always)]
unsafe fn union_gradients<L: RowLanes, const ROOM: usize>(
    map: &ScoreMap,
    outlines: &RowOutlines,
    gradients: &mut [OutlineGradients],
) -> Sums {
    // SAFETY: rows run from 0 to the last kept one; only moments that were written are read.
    unsafe {
        let all = outlines.as_slice();
        let zero = Moments::<L>::zero();
        let mut moments = [const { [const { MaybeUninit::uninit() }; ROOM] }; 2];
        for part in moments.iter_mut().take(L::PARTS) {
            for place in part.iter_mut().take(all.len()) {
                place.write((zero, zero));
            }
        }
        let (mut score, mut area) = (Running::<L>::zero(), Running::zero());
        let mut row = outlines.first;
        while row <= outlines.last && !all.is_empty() {
            // Unrolled, so that the position of each part is known at compile time.
            let (gain, length) = add_group(map, all, row, &mut moments[0]);
            score.add(gain);
            area.add(length);
            row += L::COUNT;
            if L::PARTS == 2 && row <= outlines.last {
                let (gain, length) = add_group(map, all, row, &mut moments[1]);
                score.add(gain);
                area.add(length);
                row += L::COUNT;
            }
        }
        let weight = map.stride() as f64;
        for (index, (outline, out)) in all.iter().zip(gradients).enumerate() {
            let [one, other] = [0, L::PARTS - 1].map(|part| moments[part][index].assume_init_ref());
            out.score = one.0.gradient(&other.0, outline, weight * ScoreMap::QUANTUM);
            out.area = one.1.gradient(&other.1, outline, weight);
        }
        Sums {
            score: weight * ScoreMap::QUANTUM * f64::from(score.total()),
            area: weight * f64::from(area.total()),
        }
    }
}

/// Returns the score and the area of a vector of rows, and adds it to the outlines' moments.
///
/// # Safety
/// `row` must be a kept row; there is one initialised moment per outline, and there are at most
/// `ROOM`.
#[inline(always)]
unsafe fn add_group<L: RowLanes, const ROOM: usize>(
    map: &ScoreMap,
    all: &[RowOutline],
    row: usize,
    moments: &mut [MaybeUninit<(Moments<L>, Moments<L>)>; ROOM],
) -> (L, L) {
    // SAFETY: columns are clipped to the image; only `count` crossings, which were written, are
    // read.
    unsafe {
        let group = RowGroup::<L>::new(map, row);
        let mut crossings = [const { MaybeUninit::<(usize, Crossing<L>)>::uninit() }; ROOM];
        let mut count = 0;
        for (index, outline) in all.iter().enumerate() {
            if outline.reaches(row, L::COUNT) {
                let crossing = Crossing::new(outline, &group).without_empty(&group);
                crossings[count].write((index, crossing));
                count += 1;
            }
        }
        let crossings: &[(usize, Crossing<L>)] =
            std::slice::from_raw_parts(crossings.as_ptr().cast(), count);
        let (mut score, mut area) = (L::splat(0.0), L::splat(0.0));
        for at in 0..count {
            let (begin, end) = exposed(crossings, at);
            if !begin.either(end).any() {
                continue;
            }
            let (index, crossing) = &crossings[at];
            let moments = moments[*index].assume_init_mut();
            let (gain, length) =
                add_ends(&group, crossing, begin, end, moments, all[*index].quarter_per_blunt);
            score = score.add(gain);
            area = area.add(length);
        }
        (score, area)
    }
}

/// Returns in which rows the two ends of an interval lie on the boundary of the union: where no
/// other interval covers them. Of equal ends only that of the first interval counts.
#[inline(always)]
fn exposed<L: RowLanes>(crossings: &[(usize, Crossing<L>)], at: usize) -> (L::Truth, L::Truth) {
    let this = &crossings[at].1;
    let mut begin = this.begin.less(this.end);
    let mut end = begin;
    for (index, (_, other)) in crossings.iter().enumerate() {
        if index == at {
            continue;
        }
        let (over_begin, over_end) = if index < at {
            (other.begin.at_most(this.begin), this.end.at_most(other.end))
        } else {
            (other.begin.less(this.begin), this.end.less(other.end))
        };
        begin = begin.and_not(over_begin.both(this.begin.less(other.end)));
        end = end.and_not(other.begin.less(this.end).both(over_end));
    }
    (begin, end)
}

/// Adds the exposed ends of one interval to the sums and to the moments of its outline.
#[inline(always)]
unsafe fn add_ends<L: RowLanes>(
    group: &RowGroup<L>,
    crossing: &Crossing<L>,
    begin: L::Truth,
    end: L::Truth,
    moments: &mut (Moments<L>, Moments<L>),
    quarter_per_blunt: f32,
) -> (L, L) {
    unsafe {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (left_sum, left_score) = group.look_up(crossing.begin);
        let (right_sum, right_score) = group.look_up(crossing.end);
        // An end clipped by the border does not move.
        let left = begin.both(zero.less(crossing.begin));
        let right = end.both(crossing.end.less(group.width));
        let lean = Lean::new(crossing, quarter_per_blunt);
        let masked = |truth: L::Truth, x| truth.select(x, zero);
        moments.0.add(masked(right, right_score), masked(left, left_score), crossing, lean);
        moments.1.add(masked(right, one), masked(left, one), crossing, lean);
        (
            masked(end, right_sum).sub(masked(begin, left_sum)),
            masked(end, crossing.end).sub(masked(begin, crossing.begin)),
        )
    }
}
