//! Offsets of the object's true boundary from the outline of its body, learned where other evidence
//! tells the pose. Where an offset is known, a line across the outline measures the pose within a
//! fraction of a pixel, whatever the ellipsoids leave out.

use nalgebra::{Matrix6, Vector3, Vector6};

use super::bias::Information;

/// Distance of the true boundary outside a place of the outline, in radii of the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Offset {
    pub(crate) mean: f64,
    pub(crate) variance: f64,
    /// The point of the unit ball where it was learned first.
    pub(crate) at: Vector3<f64>,
    /// Whether it was learned at a given pose; then it is never forgotten.
    given: bool,
}

/// A measurement of the boundary at a place of the outline.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    /// The cell of the body's surface whose rim it is.
    pub(crate) cell: usize,
    /// The point of the unit ball that its ellipsoid maps to the rim.
    pub(crate) on_ball: Vector3<f64>,
    /// Distance of the boundary outside the outline, in radii.
    pub(crate) outside: f64,
    /// Its inverse variance.
    pub(crate) information: f64,
    /// Derivative of the outline's position, along its normal and in radii, by a small motion of
    /// the object.
    pub(crate) by_motion: Vector6<f64>,
}

/// What is known of the boundary: one offset per ellipsoid and part of its surface, since the part
/// that forms the outline depends on the side that is seen.
#[derive(Debug, Clone)]
pub(crate) struct ContourOffsets(Vec<Offset>);

/// Cells along the edge of a face of the cube about the unit ball.
const CELLS: usize = 6;
/// Standard deviation of an offset that is not known, in radii, and the largest of one that is.
const UNKNOWN: f64 = 0.1;
const KNOWN: f64 = 0.03;
/// Standard deviation of an offset where it was learned, in radii, beyond what images tell, and its
/// increase per radius of the unit ball from there.
const WITHIN: f64 = 0.003;
const CHANGES: f64 = 0.1;
/// Share of an image's information about an offset that is independent of the images before.
const SHARED: f64 = 0.2;
/// Standard deviation, in radii, that each image from which the tracker learns adds to an offset
/// that was learned at a pose of its own: later poses are better known than earlier ones.
const FADING: f64 = 0.004;

impl Offset {
    /// Returns the variance by which the offset at another point differs.
    fn varied(&self, on_ball: &Vector3<f64>) -> f64 {
        CHANGES * CHANGES * (self.at - on_ball).norm_squared()
    }
}

impl ContourOffsets {
    /// Starts with a number of ellipsoids of which nothing is known.
    pub(crate) fn unknown(ellipsoids: usize) -> Self {
        let offset =
            Offset { mean: 0.0, variance: UNKNOWN * UNKNOWN, at: Vector3::zeros(), given: false };
        Self(vec![offset; ellipsoids * cells_of_one()])
    }

    /// Returns the cell of a point of the unit ball of an ellipsoid.
    pub(crate) fn cell(ellipsoid: usize, on_ball: &Vector3<f64>) -> usize {
        let axis = on_ball.iamax();
        let most = on_ball[axis];
        let face = 2 * axis + usize::from(most < 0.0);
        let along = |next: usize| {
            let place = on_ball[(axis + next) % 3] / most.abs();
            // Equal angles from the middle of the face.
            let place = 0.5 + libm::atan(place) * (2.0 / std::f64::consts::PI);
            ((place * CELLS as f64) as usize).min(CELLS - 1)
        };
        ellipsoid * cells_of_one() + (face * CELLS + along(1)) * CELLS + along(2)
    }

    /// Returns the offset of a cell, if it is known well enough to measure a pose by.
    pub(crate) fn known(&self, cell: usize) -> Option<Offset> {
        self.0.get(cell).copied().filter(|offset| offset.variance < KNOWN * KNOWN)
    }

    /// Learns from an image whose pose is given.
    pub(crate) fn learn_at(&mut self, edges: &[Edge]) {
        self.take(edges, |_| 0.0, 1.0);
        for edge in edges {
            if let Some(offset) = self.0.get_mut(edge.cell) {
                offset.given = true;
            }
        }
    }

    /// Learns from an image whose pose is known by other evidence, with a covariance.
    pub(crate) fn learn(&mut self, edges: &[Edge], pose: &Matrix6<f64>) {
        for offset in self.0.iter_mut().filter(|offset| !offset.given) {
            offset.variance = (offset.variance + FADING * FADING).min(UNKNOWN * UNKNOWN);
        }
        self.take(edges, |by_motion| by_motion.dot(&(pose * by_motion)), SHARED);
    }

    fn take(&mut self, edges: &[Edge], moved: impl Fn(&Vector6<f64>) -> f64, share: f64) {
        for edge in edges {
            let Some(offset) = self.0.get_mut(edge.cell) else { continue };
            if offset.variance == UNKNOWN * UNKNOWN {
                offset.at = edge.on_ball;
            }
            // Errors of poses stay much the same from image to image, and do not average out.
            let moved = moved(&edge.by_motion) + offset.varied(&edge.on_ball);
            if offset.variance <= moved {
                continue;
            }
            let noise = 1.0 / (share * edge.information) + moved;
            let gain = offset.variance / (offset.variance + noise);
            offset.mean += gain * (edge.outside - offset.mean);
            offset.variance = moved.max((1.0 - gain) * offset.variance);
        }
    }

    /// Returns the information about the pose of edges whose offsets are known: each offset is
    /// marginalised, and shared by all edges of its cell. Brings the edges into the order of their
    /// cells.
    pub(crate) fn measured(&self, edges: &mut [Edge]) -> Information {
        let mut sum = (Matrix6::zeros(), Vector6::zeros());
        edges.sort_unstable_by(|one, other| {
            one.cell.cmp(&other.cell).then(one.outside.total_cmp(&other.outside))
        });
        for together in edges.chunk_by(|one, next| one.cell == next.cell) {
            let Some(offset) = self.known(together[0].cell) else { continue };
            let (mut weight, mut pull, mut by_motion) = (0.0, 0.0, Vector6::zeros());
            for edge in together {
                let off = edge.outside - offset.mean;
                let information =
                    edge.information / (1.0 + edge.information * offset.varied(&edge.on_ball));
                sum.0 += edge.by_motion * edge.by_motion.transpose() * information;
                sum.1 += edge.by_motion * (information * off);
                weight += information;
                pull += information * off;
                by_motion += edge.by_motion * information;
            }
            let variance = offset.variance + WITHIN * WITHIN;
            let open = variance / (1.0 + variance * weight);
            sum.0 -= by_motion * by_motion.transpose() * open;
            sum.1 -= by_motion * (open * pull);
        }
        sum
    }
}

/// Returns the number of cells of an ellipsoid, on the six faces of the cube.
fn cells_of_one() -> usize {
    6 * CELLS * CELLS
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};
    use proptest::prelude::*;

    use super::*;

    const WEIGHT: f64 = 4e4;

    fn edge(on_ball: Vector3<f64>, outside: f64, by_motion: Vector6<f64>) -> Edge {
        let cell = ContourOffsets::cell(0, &on_ball);
        Edge { cell, on_ball, outside, information: WEIGHT, by_motion }
    }

    fn directions() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0_f64)
            .prop_filter("a direction", |v| Vector3::from(*v).norm() > 0.1)
            .prop_map(|v| Vector3::from(v).normalize())
    }

    /// Knows the offset at a place.
    fn known_at(place: Vector3<f64>, outside: f64) -> ContourOffsets {
        let mut offsets = ContourOffsets::unknown(1);
        for _ in 0..4 {
            offsets.learn_at(&[edge(place, outside, Vector6::zeros())]);
        }
        offsets
    }

    proptest! {
        #[test]
        fn each_point_has_a_cell_and_points_of_one_cell_lie_together(
            one in directions(), other in directions(), ellipsoid in 0..9_usize,
        ) {
            let cells = cells_of_one();
            let cell = ContourOffsets::cell(ellipsoid, &one);
            prop_assert_eq!(cell / cells, ellipsoid);
            prop_assert_ne!(cell, ContourOffsets::cell(ellipsoid + 1, &one));
            prop_assert_ne!(cell, ContourOffsets::cell(ellipsoid, &-one));
            if cell == ContourOffsets::cell(ellipsoid, &other) {
                prop_assert!(one.angle(&other) < 0.4, "{}", one.angle(&other));
            }
        }

        #[test]
        fn edges_of_a_cell_give_the_information_of_a_joint_solution_for_pose_and_offset(
            ways in prop::array::uniform3(prop::array::uniform6(-1.0..1.0_f64)),
            outside in prop::array::uniform3(-0.05..0.05_f64),
            mean in -0.05..0.05_f64,
        ) {
            let place = Vector3::new(0.9, 0.3, 0.2).normalize();
            let offsets = known_at(place, mean);
            let offset = offsets.known(ContourOffsets::cell(0, &place)).unwrap();
            let mut edges: Vec<_> = (0..3)
                .map(|i| edge(place, outside[i], Vector6::from(ways[i])))
                .collect();
            // Seven unknowns: the motion, and the offset, known before.
            let mut normal = SMatrix::<f64, 7, 7>::zeros();
            let mut slope = SVector::<f64, 7>::zeros();
            normal[(6, 6)] = 1.0 / (offset.variance + WITHIN * WITHIN);
            for edge in &edges {
                let mut by = SVector::<f64, 7>::zeros();
                by.fixed_rows_mut::<6>(0).copy_from(&edge.by_motion);
                by[6] = 1.0;
                normal += by * by.transpose() * WEIGHT;
                slope += by * (WEIGHT * (edge.outside - offset.mean));
            }
            let across = normal.fixed_view::<6, 1>(0, 6).into_owned();
            let expected = normal.fixed_view::<6, 6>(0, 0)
                - across * across.transpose() / normal[(6, 6)];
            let pull = slope.fixed_rows::<6>(0) - across * (slope[6] / normal[(6, 6)]);
            let (information, found) = offsets.measured(&mut edges);
            prop_assert!((information - expected).amax() < 1e-9 * WEIGHT);
            prop_assert!((found - pull).amax() < 1e-9 * WEIGHT);
        }
    }

    #[test]
    fn a_boundary_at_its_known_offset_has_no_pull_and_a_shifted_one_has() {
        let (place, way) = (Vector3::x(), Vector6::x());
        let unknown = ContourOffsets::unknown(1);
        assert_eq!(unknown.measured(&mut [edge(place, 0.05, way)]).0, Matrix6::zeros());
        let offsets = known_at(place, 0.05);
        let pull = |outside| offsets.measured(&mut [edge(place, outside, way)]).1[0];
        assert!(pull(0.05).abs() < 0.01 * pull(0.06), "{} {}", pull(0.05), pull(0.06));
        assert!(pull(0.06) > 0.0 && pull(0.04) < 0.0);
    }

    #[test]
    fn an_offset_is_never_known_better_than_the_poses_of_the_images_however_many_there_are() {
        let (place, way) = (Vector3::x(), Vector6::x());
        for sd in [0.05_f64, 0.004] {
            let mut offsets = ContourOffsets::unknown(1);
            for _ in 0..1000 {
                offsets.learn(&[edge(place, 0.05, way)], &(Matrix6::identity() * sd * sd));
            }
            let known = offsets.known(ContourOffsets::cell(0, &place));
            assert_eq!(known.is_some(), sd < KNOWN);
            assert!(known.is_none_or(|offset| offset.variance >= sd * sd));
        }
    }

    #[test]
    fn what_was_learned_at_a_given_pose_stays_and_at_an_estimated_one_fades() {
        let (place, elsewhere) = (Vector3::x(), Vector3::y());
        let known = |offsets: &ContourOffsets, at| offsets.known(ContourOffsets::cell(0, at));
        let mut offsets = known_at(place, 0.02);
        let sure = Matrix6::identity() * 1e-6;
        for _ in 0..100 {
            offsets.learn(&[edge(elsewhere, 0.02, Vector6::x())], &sure);
        }
        let (given, estimated) = (known(&offsets, &place), known(&offsets, &elsewhere));
        assert_eq!(given, known(&known_at(place, 0.02), &place));
        assert!(estimated.is_some());
        for _ in 0..1000 {
            offsets.learn(&[], &sure);
        }
        assert_eq!(known(&offsets, &place), given);
        assert_eq!(known(&offsets, &elsewhere), None);
    }

    #[test]
    fn the_farther_from_where_an_offset_was_learned_the_less_information_it_gives() {
        let middle = Vector3::new(1.0, 0.05, 0.05).normalize();
        let offsets = known_at(middle, 0.02);
        let mut before = f64::INFINITY;
        for step in 0..4 {
            let place = Vector3::new(1.0, 0.05 + 0.05 * f64::from(step), 0.05).normalize();
            let information = offsets.measured(&mut [edge(place, 0.02, Vector6::x())]).0[(0, 0)];
            assert!(information > 0.0 && information < before, "{step}");
            before = information;
        }
    }
}
