//! The normal equations of a bundle, with its landmarks eliminated by the Schur complement.

use nalgebra::{DMatrix, DVector, Matrix3, Matrix3x6, Matrix6, Matrix6x3, Vector3, Vector6};

use super::bundle::{Bundle, Landmark, robust};
use crate::pose::Pose;
use crate::shape::product;
use crate::track::target::points::by_motion;

/// Relative regularisation of a landmark's curvature, for directions without any measurement.
const RIDGE: f64 = 1e-9;

/// The normal equations at the current state.
pub(super) struct Reduced {
    /// Index of each keyframe among those that are free.
    free: Vec<Option<usize>>,
    curvature: DMatrix<f64>,
    slope: DVector<f64>,
    landmarks: Vec<Block>,
}

/// The keyframes' remaining curvature and slope, and the inverses of the landmarks' own curvatures.
type Eliminated = (DMatrix<f64>, DVector<f64>, Vec<Matrix3<f64>>);

/// The terms of a landmark, and its mixed terms with the keyframes that saw it.
#[derive(Default)]
struct Block {
    is_fixed: bool,
    curvature: Matrix3<f64>,
    slope: Vector3<f64>,
    with: Vec<(usize, Matrix6x3<f64>)>,
}

impl Reduced {
    pub(super) fn new(bundle: &Bundle) -> Self {
        let mut count = 0;
        let free: Vec<_> = bundle
            .keyframes
            .iter()
            .map(|one| {
                one.prior.map(|_| {
                    count += 1;
                    count - 1
                })
            })
            .collect();
        let mut out = Self {
            free,
            curvature: DMatrix::zeros(6 * count, 6 * count),
            slope: DVector::zeros(6 * count),
            landmarks: Vec::with_capacity(bundle.landmarks.len()),
        };
        out.add_beliefs(bundle);
        let mut sightings = bundle.sightings.as_slice();
        for (index, landmark) in bundle.landmarks.iter().enumerate() {
            let own = sightings.iter().take_while(|one| one.landmark == index).count();
            let (mine, rest) = sightings.split_at(own);
            sightings = rest;
            let mut block = Block::default();
            out.add_anchor(bundle, landmark, &mut block);
            for sighting in mine {
                let Some((off, projection)) = bundle.seen(sighting) else { continue };
                let Some((_, by_place)) = projection.pixel(&landmark.position) else { continue };
                let weight = robust(off.dot(&(sighting.information * off))).1;
                let weighted = sighting.information * weight;
                let by_motion = by_motion(&by_place, &landmark.position);
                block.curvature += by_place.tr_mul(&(weighted * by_place));
                block.slope += by_place.tr_mul(&(weighted * off));
                out.add(sighting.keyframe, &mut block, |curvature, slope, with| {
                    *curvature += by_motion.tr_mul(&(weighted * by_motion));
                    *slope += by_motion.tr_mul(&(weighted * off));
                    *with += by_motion.tr_mul(&(weighted * by_place));
                });
            }
            out.landmarks.push(block);
        }
        out
    }

    /// Adds the prior of a landmark from where it was learned.
    fn add_anchor(&mut self, bundle: &Bundle, landmark: &Landmark, block: &mut Block) {
        let found = bundle.anchored(landmark);
        let (Some((off, by_place)), Some(anchor)) = (found, landmark.anchor) else {
            block.is_fixed = true;
            return;
        };
        let weight = robust(off.norm_squared()).1;
        // The prior moves with the keyframe.
        let mut by_motion = Matrix3x6::zeros();
        by_motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&by_place);
        by_motion
            .fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&(-by_place * landmark.position.cross_matrix()));
        block.curvature += by_place * by_place * weight;
        block.slope += by_place * off * weight;
        self.add(anchor.keyframe, block, |curvature, slope, with| {
            *curvature += by_motion.tr_mul(&by_motion) * weight;
            *slope += by_motion.tr_mul(&off) * weight;
            *with += by_motion.tr_mul(&by_place) * weight;
        });
    }

    /// Adds to the blocks of a keyframe, unless it is fixed.
    fn add(
        &mut self,
        keyframe: usize,
        block: &mut Block,
        terms: impl FnOnce(&mut Matrix6<f64>, &mut Vector6<f64>, &mut Matrix6x3<f64>),
    ) {
        let Some(at) = self.free[keyframe] else { return };
        let place = block.with.iter().position(|(one, _)| *one == at).unwrap_or_else(|| {
            block.with.push((at, Matrix6x3::zeros()));
            block.with.len() - 1
        });
        let (mut curvature, mut slope) = (Matrix6::zeros(), Vector6::zeros());
        terms(&mut curvature, &mut slope, &mut block.with[place].1);
        add(&mut self.curvature, (at, at), curvature);
        add_to(&mut self.slope, at, slope);
    }

    fn add_beliefs(&mut self, bundle: &Bundle) {
        for (index, station) in bundle.keyframes.iter().enumerate() {
            let (Some(at), Some(prior), Some(off)) =
                (self.free[index], station.prior, bundle.off(station))
            else {
                continue;
            };
            let weighted = prior.information * robust(off.dot(&(prior.information * off))).1;
            add(&mut self.curvature, (at, at), weighted);
            add_to(&mut self.slope, at, weighted * off);
            let Some((from, other)) = prior.from.and_then(|i| Some((i, self.free[i]?))) else {
                continue;
            };
            let between: Pose =
                station.world_from_object.inverse() * bundle.keyframes[from].world_from_object;
            let by_other = between.adjoint();
            let mixed = weighted * by_other;
            add(&mut self.curvature, (other, other), by_other.tr_mul(&mixed));
            add(&mut self.curvature, (at, other), -mixed);
            add(&mut self.curvature, (other, at), -mixed.transpose());
            add_to(&mut self.slope, other, -by_other.tr_mul(&(weighted * off)));
        }
    }

    /// Returns the step of keyframes and landmarks.
    pub(super) fn step(&self, damping: f64) -> Option<(DVector<f64>, Vec<Vector3<f64>>)> {
        let (matrix, slope, inverses) = self.eliminated(damping)?;
        let motions = matrix.cholesky()?.solve(&slope);
        let shifts = self.landmarks.iter().zip(&inverses).map(|(block, inverse)| {
            let taken =
                block.with.iter().map(|(at, with)| with.tr_mul(&motions.fixed_rows::<6>(6 * at)));
            inverse * (block.slope - taken.sum::<Vector3<f64>>())
        });
        let shifts = shifts.collect();
        Some((motions, shifts))
    }

    /// Returns the variance of each keyframe's orientation, and of the distance of each landmark
    /// for which it is requested.
    pub(super) fn variances(&self, bundle: &Bundle) -> Option<(Vec<f64>, Vec<Option<f64>>)> {
        let (matrix, _, inverses) = self.eliminated(0.0)?;
        let factor = matrix.cholesky()?.unpack();
        let count = factor.nrows() / 6;
        // The inverse is the product of the transposed inverse factor and the inverse factor.
        let mut turns = DMatrix::zeros(6 * count, 3 * count);
        for column in 0..3 * count {
            turns[(column / 3 * 6 + 3 + column % 3, column)] = 1.0;
        }
        factor.solve_lower_triangular_mut(&mut turns).then_some(())?;
        let turn = |at: usize| turns.columns(3 * at, 3).norm_squared();
        let turns = self.free.iter().map(|at| at.map_or(0.0, turn)).collect();
        let landmarks = bundle.landmarks.iter().zip(&self.landmarks).zip(&inverses);
        let distances = landmarks.map(|((landmark, block), inverse)| {
            let anchor = landmark.anchor.filter(|_| landmark.is_from_motion)?;
            let object = bundle.keyframes[anchor.keyframe].world_from_object.rotation();
            let way = object.inverse() * anchor.toward_in_world;
            let by_place = inverse * way;
            let mut by_motion = DVector::zeros(6 * count);
            for (at, with) in &block.with {
                add_to(&mut by_motion, *at, with * by_place);
            }
            factor.solve_lower_triangular_mut(&mut by_motion).then_some(())?;
            Some(way.dot(&by_place) + by_motion.norm_squared())
        });
        Some((turns, distances.collect()))
    }

    /// Eliminates the landmarks.
    fn eliminated(&self, damping: f64) -> Option<Eliminated> {
        let (mut matrix, mut slope) = (self.curvature.clone(), self.slope.clone());
        for i in 0..matrix.nrows() {
            matrix[(i, i)] *= 1.0 + damping;
        }
        let mut inverses = Vec::with_capacity(self.landmarks.len());
        for block in &self.landmarks {
            if block.is_fixed {
                inverses.push(Matrix3::zeros());
                continue;
            }
            let mut own = block.curvature;
            for i in 0..3 {
                own[(i, i)] *= 1.0 + damping;
            }
            own += Matrix3::identity() * (RIDGE * own.trace());
            let inverse = own.cholesky()?.inverse();
            for (at, with) in &block.with {
                let through = product(with, &inverse);
                add_to(&mut slope, *at, -(through * block.slope));
                // Only the part below the diagonal is read.
                for (other, beside) in block.with.iter().filter(|(other, _)| other <= at) {
                    subtract_product(&mut matrix, (*at, *other), &through, beside);
                }
            }
            inverses.push(inverse);
        }
        Some((matrix, slope, inverses))
    }
}

/// Subtracts the product of a matrix and a transposed one from a block; written out, like `product`.
fn subtract_product(
    matrix: &mut DMatrix<f64>,
    (row, column): (usize, usize),
    left: &Matrix6x3<f64>,
    right: &Matrix6x3<f64>,
) {
    let mut place = matrix.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    for j in 0..6 {
        let by = right.row(j);
        for i in 0..6 {
            place[(i, j)] -= left[(i, 0)] * by[0] + left[(i, 1)] * by[1] + left[(i, 2)] * by[2];
        }
    }
}

fn add(matrix: &mut DMatrix<f64>, (row, column): (usize, usize), block: Matrix6<f64>) {
    let mut place = matrix.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    place += block;
}

fn add_to(vector: &mut DVector<f64>, row: usize, block: Vector6<f64>) {
    let mut place = vector.fixed_rows_mut::<6>(6 * row);
    place += block;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::adjust::bundle::scene;

    #[test]
    fn variances_of_distances_are_those_of_all_unknowns_together() {
        let bundle = scene(3, 0.0);
        let reduced = Reduced::new(&bundle);
        let (_, found) = reduced.variances(&bundle).unwrap();
        let (poses, count) = (reduced.slope.len(), bundle.landmarks.len());
        let mut whole = DMatrix::zeros(poses + 3 * count, poses + 3 * count);
        whole.view_mut((0, 0), (poses, poses)).copy_from(&reduced.curvature);
        for (at, block) in reduced.landmarks.iter().enumerate() {
            let own = poses + 3 * at;
            // A fixed landmark has no uncertainty.
            let sure = if block.is_fixed { 1e12 } else { 0.0 };
            let curvature = block.curvature + Matrix3::identity() * sure;
            whole.fixed_view_mut::<3, 3>(own, own).copy_from(&curvature);
            for (keyframe, with) in block.with.iter().filter(|_| !block.is_fixed) {
                whole.fixed_view_mut::<6, 3>(6 * keyframe, own).copy_from(with);
                whole.fixed_view_mut::<3, 6>(own, 6 * keyframe).copy_from(&with.transpose());
            }
        }
        let covariance = whole.cholesky().unwrap().inverse();
        let mut checked = 0;
        for (at, variance) in found.iter().enumerate() {
            let Some(variance) = variance else { continue };
            let anchor = bundle.landmarks[at].anchor.unwrap();
            let object = bundle.keyframes[anchor.keyframe].world_from_object.rotation();
            let way = object.inverse() * anchor.toward_in_world;
            let own = covariance.fixed_view::<3, 3>(poses + 3 * at, poses + 3 * at);
            let expected = way.dot(&(own * way));
            assert!((variance / expected - 1.0).abs() < 1e-4, "{variance} {expected}");
            checked += 1;
        }
        assert_eq!(checked, 6);
    }

    #[test]
    fn slopes_are_those_of_the_cost() {
        const STEP: f64 = 1e-6;
        for seed in 0..4 {
            let bundle = scene(seed, 0.01);
            let reduced = Reduced::new(&bundle);
            let still = vec![Vector3::zeros(); bundle.landmarks.len()];
            let slope = |motions: &DVector<f64>, shifts: &[Vector3<f64>]| {
                let back: Vec<_> = shifts.iter().map(|shift| -shift).collect();
                let cost = |motions: &DVector<f64>, shifts: &[Vector3<f64>]| {
                    let mut moved = bundle.clone();
                    bundle.move_into(&mut moved, motions, shifts);
                    moved.cost()
                };
                -0.5 * (cost(motions, shifts) - cost(&-motions, &back)) / (2.0 * STEP)
            };
            for i in 0..reduced.slope.len() {
                let mut motions = DVector::zeros(reduced.slope.len());
                motions[i] = STEP;
                let (found, computed) = (slope(&motions, &still), reduced.slope[i]);
                assert!(
                    (found - computed).abs() < 0.01 * (1.0 + computed.abs()),
                    "{i}: {found} {computed}"
                );
            }
            for (i, block) in reduced.landmarks.iter().enumerate().filter(|(_, one)| !one.is_fixed)
            {
                for axis in 0..3 {
                    let mut shifts = still.clone();
                    shifts[i][axis] = STEP;
                    let (found, computed) =
                        (slope(&DVector::zeros(reduced.slope.len()), &shifts), block.slope[axis]);
                    assert!(
                        (found - computed).abs() < 1e-4 * (1.0 + computed.abs()),
                        "{found} {computed}"
                    );
                }
            }
        }
    }
}
