use nalgebra::{Matrix2, Matrix2x3, Matrix2x6, Matrix3x6, Matrix6, Vector2, Vector3};

pub(crate) use super::feature::{Feature, WORST};
use super::solid::{Rims, Solid};
use crate::fitness::{Agreement, SAMPLES};
use crate::pose::{Pose, Twist};
use crate::shape::Projection;
use crate::track::frame::occlusion::Occlusion;
use crate::track::frame::window::Window;

/// A point that a camera should see.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InView {
    pub(crate) camera: usize,
    pub(crate) point: usize,
    /// Index of the template expected in its image.
    pub(crate) template: usize,
}

/// Agreement of a point that a camera should see with the camera's image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Match {
    pub(crate) view: InView,
    pub(crate) agreement: Option<Agreement>,
    /// The level of the pyramid of that agreement.
    pub(crate) level: usize,
    /// Its expected pixel.
    pub(crate) pixel: Option<Vector2<f64>>,
    /// Its index among the points in view, and its displacement towards the camera by which it was
    /// learned, in metres.
    pub(crate) at: usize,
    pub(crate) moved: f64,
    /// Whether it shows the rotation that the outline shows least, by more than shading.
    pub(crate) turns: bool,
    /// Whether its point is an edgel.
    pub(crate) is_edgel: bool,
}

impl Match {
    /// Returns whether the image looks as it should at the point.
    pub(crate) fn agrees(&self) -> bool {
        self.agreement.is_some_and(|agreement| agreement.correlation >= RECOGNISED)
    }

    /// Returns whether the image shows the point; an edgel is never told from its neighbours.
    pub(crate) fn is_recognised(&self) -> bool {
        !self.is_edgel && self.agrees()
    }
}

/// The surface points of an object.
#[derive(Debug, Clone, Default)]
pub(crate) struct Points {
    pub(crate) features: Vec<Feature>,
    /// Variance of the object's orientation since the first image, by the points that were seen
    /// last.
    pub(crate) drift_variance: f64,
    /// Additional variance, where a single camera cannot tell a rotation from relief: that due to
    /// noise, in the last image or fading since an earlier one.
    pub(crate) noise_variance: f64,
    /// Additional variance: that due to distances that only the body gave, in the last image.
    pub(crate) relief_variance: f64,
    /// Additional variance: that by which it may have been held back since it was last shown well.
    pub(crate) held_back_variance: f64,
    /// The number that the next point is given.
    pub(crate) next: usize,
    /// Numbers of the points that were recognised last.
    pub(super) seen: Vec<usize>,
    /// Reused memory for their variances.
    pub(super) drifts: Vec<f64>,
}

/// Least cosine between a surface's normal and the direction to a camera that should see it. What
/// the body hides and what lies at its rim is left out as well.
const LEAST_FACING_IN_VIEW: f64 = 0.3;
/// Least cosine between the current viewing direction and the one in which the point was learned.
const LEAST_LIKE: f64 = 0.6;
/// The same two for a point whose distance, and thus whose normal, is a guess.
const LEAST_OF_GUESS: (f64, f64) = (0.5, 0.92);
/// Range of distances inside the outline, in pixels, in which a point lies on the rim: the
/// ellipsoids only approximate the object.
const RIM_PX: (f64, f64) = (-3.0, 4.0);
/// Most points that are kept.
const MOST_POINTS: usize = 600;
/// Capacity for points: those that are kept, and those that an image may add.
const ROOM: usize = MOST_POINTS + 40;
/// Correlation from which on a point counts as recognised.
pub(crate) const RECOGNISED: f64 = 0.75;

impl Points {
    /// Makes a set of previously known points.
    pub(crate) fn of(mut features: Vec<Feature>) -> Self {
        let mut out = Self::default();
        out.add(&mut features);
        out
    }

    /// Lists the points that open windows should show: all of them, and at most `most` per camera, of
    /// which edgels are only as many as corners leave room for.
    pub(crate) fn in_view(
        &self,
        windows: &[Window],
        pose: &Pose,
        solid: &Solid,
        most: usize,
        (rims, all, out): (&mut Rims, &mut Vec<InView>, &mut Vec<InView>),
    ) {
        out.clear();
        all.clear();
        for (camera, window) in windows.iter().enumerate() {
            let Some(projection) = window.projection(pose) else { continue };
            let Some(eye) = projection.eye() else { continue };
            let begin = all.len();
            rims.read(solid, &projection);
            for (index, feature) in self.features.iter().enumerate() {
                let point = &feature.point;
                let way = (eye - point.position).normalize();
                let (facing, like) = if feature.has_free_distance(solid.radius) {
                    LEAST_OF_GUESS
                } else {
                    (LEAST_FACING_IN_VIEW, LEAST_LIKE)
                };
                let (template, cosine) = feature.nearest_template(&way);
                let shows = way.dot(&point.normal) > facing
                    && cosine > like
                    && !solid.hides(&point.position, &eye)
                    && !is_on_rim(&projection, rims, &point.position);
                if shows {
                    all.push(InView { camera, point: index, template });
                }
            }
            let is_edgel = |view: &InView| self.features[view.point].is_edgel;
            all[begin..].sort_unstable_by_key(|view| (is_edgel(view), view.point));
            let corners = begin + all[begin..].partition_point(|view| !is_edgel(view));
            thin(&all[begin..corners], most, out);
            thin(&all[corners..], most.saturating_sub(corners - begin), out);
        }
    }

    /// Returns the indices of the points that are not edgels.
    pub(crate) fn all_but_edgels(&self) -> impl Iterator<Item = usize> {
        let all = self.features.iter().enumerate();
        all.filter(|(_, feature)| !feature.is_edgel).map(|(index, _)| index)
    }

    /// Adds new points, in memory that is allocated at once for as many as are ever kept.
    pub(crate) fn add(&mut self, fresh: &mut Vec<Feature>) {
        if self.features.capacity() < ROOM {
            self.features.reserve(ROOM.saturating_sub(self.features.len()));
        }
        for feature in fresh.iter_mut() {
            feature.id = self.next;
            self.next += 1;
        }
        self.features.append(fresh);
    }

    /// Updates the records of points by images in which nothing hides them, and drops those that no
    /// longer agree.
    pub(crate) fn count_hits(
        &mut self,
        matches: &[Match],
        (windows, occlusion): (&[Window], &Occlusion),
    ) {
        for Match { view, agreement, pixel, turns, .. } in matches {
            let (Some(agreement), Some(pixel)) = (agreement, pixel) else { continue };
            if occlusion.hides(view.camera, pixel) > 0.0 {
                continue;
            }
            let feature = &mut self.features[view.point];
            let agrees = agreement.correlation > RECOGNISED;
            feature.record.count_hits(agrees);
            if agrees {
                feature.note_texture(windows[view.camera].shows_texture(agreement), *turns);
            }
        }
        self.features.retain(|feature| feature.record.is_good());
        if self.features.len() > MOST_POINTS {
            self.features.retain(|feature| !feature.is_edgel);
        }
        let (count, excess) =
            (self.features.len(), self.features.len().saturating_sub(MOST_POINTS));
        if excess > 0 {
            // Evenly, so that no side of the object is forgotten.
            let mut at = 0;
            self.features.retain(|_| {
                at += 1;
                at * excess / count == (at - 1) * excess / count
            });
        }
    }

    /// Turns back points that were learned since a keyframe, each by its share of a motion that
    /// closes a loop; `drifts` are the variances of the orientation before and after that.
    pub(crate) fn turn_back(&mut self, off: &Twist, drifts: (f64, f64), since: Option<usize>) {
        for feature in self.features.iter_mut().filter(|feature| feature.origin.keyframe >= since) {
            let (share, left) = bridged(feature.drift_variance, drifts);
            feature.drift_variance = left;
            if share > 0.0 {
                feature.move_by(&Pose::exp(&(-off * share)));
            }
        }
    }

    /// Returns the numbers of the points that were recognised last, and their positions.
    pub(crate) fn seen(&self) -> Vec<(usize, Vector3<f64>)> {
        let features = self.seen.iter().filter_map(|id| self.with_id(*id));
        features.map(|feature| (feature.id, feature.point.position)).collect()
    }

    /// Returns the small motion of the object that keeps points about where they were in the world
    /// before they were moved; none if they are too few.
    pub(crate) fn moved_since(&self, before: &[(usize, Vector3<f64>)]) -> Option<Twist> {
        let (mut curvature, mut slope) = (Matrix6::zeros(), Twist::zeros());
        let mut count = 0;
        for (id, was) in before {
            let Some(feature) = self.with_id(*id) else { continue };
            let is = &feature.point.position;
            let mut by_motion = Matrix3x6::zeros();
            by_motion.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
            by_motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&-is.cross_matrix());
            curvature += by_motion.tr_mul(&by_motion);
            slope += by_motion.tr_mul(&(was - is));
            count += 1;
        }
        (count >= LEAST_KNOWN).then(|| curvature.cholesky())?.map(|normal| normal.solve(&slope))
    }

    /// Returns the point with a number.
    pub(crate) fn with_id(&self, id: usize) -> Option<&Feature> {
        self.place(id).map(|at| &self.features[at])
    }

    /// Points are in the order of their numbers.
    fn place(&self, id: usize) -> Option<usize> {
        self.features.binary_search_by_key(&id, |feature| feature.id).ok()
    }

    /// Takes over the variances of the orientation at the keyframes in which points were seen: the
    /// smallest counts, and none of points that slide.
    pub(crate) fn know_drift(&mut self, seen: impl Iterator<Item = (usize, f64)>) {
        let mut drifts = vec![f64::INFINITY; self.features.len()];
        for (id, drift) in seen {
            if let Some(at) = self.place(id) {
                drifts[at] = drift.min(drifts[at]);
            }
        }
        for (feature, drift) in self.features.iter_mut().zip(drifts) {
            if drift.is_finite() && !feature.slides {
                feature.drift_variance = drift;
            }
        }
    }

    /// Returns the covariance of a point's pixel, in square pixels, due to the drift of the
    /// orientation when it was learned beyond that of the points seen last. `by_motion` is the
    /// derivative of the pixel by the object's motion.
    pub(crate) fn strayed(&self, point: usize, by_motion: &Matrix2x6<f64>) -> Matrix2<f64> {
        let excess = (self.features[point].drift_variance - self.drift_variance).max(0.0);
        let by_turn = by_motion.fixed_view::<2, 3>(0, 3);
        by_turn * by_turn.transpose() * (excess / 3.0)
    }

    /// Moves points along the direction in which they were learned to where the images show them,
    /// each weighted by its uncertainty relative to the images'; `radius` is the body's.
    pub(crate) fn refine(&mut self, matches: &[Match], radius: f64) {
        for Match { view, agreement, .. } in matches {
            let Some(agreement) = agreement else { continue };
            if agreement.correlation < RECOGNISED {
                continue;
            }
            let feature = &mut self.features[view.point];
            if feature.is_from_motion {
                continue;
            }
            let way = agreement.slope * feature.point.toward;
            let curvature = way.dot(&(agreement.tensor * way));
            let noise = noise(agreement.correlation);
            let information = 1.0 / (noise / curvature + PLACE_PX * PLACE_PX / way.norm_squared());
            if !(curvature > 0.0 && information.is_finite()) {
                continue;
            }
            let step = way.dot(&agreement.pull) / curvature;
            let gain = information * SHARED / (1.0 / feature.variance + information * SHARED);
            feature.place_at(feature.point.position + feature.point.toward * (gain * step));
            feature.variance = (1.0 - gain) * feature.variance + (FADING * radius).powi(2);
        }
    }
}

/// Least number of agreeing points from which the orientation counts as known.
pub(crate) const LEAST_KNOWN: usize = 12;
/// Returns whether a point lies about at the body's outline: its image is that of the outline,
/// which does not move as the surface does.
fn is_on_rim(projection: &Projection, rims: &Rims, point: &Vector3<f64>) -> bool {
    let margin = projection.pixel(point).map(|(pixel, _)| rims.margin(&pixel));
    margin.is_some_and(|margin| (RIM_PX.0..RIM_PX.1).contains(&margin))
}

/// Share of an image's information about a point that is independent of the pose.
const SHARED: f64 = 0.2;
/// Standard deviation added to a point's position per image, as a share of the body's radius.
const FADING: f64 = 1e-4;
/// Standard deviation of a patch's position beyond its noise, in pixels: surfaces are not flat.
pub(crate) const PLACE_PX: f64 = 0.25;

/// Variance of a normalised patch's samples at full correlation.
const LEAST_NOISE: f64 = 4e-4;

/// Returns the variance of a normalised patch's samples at a correlation.
pub(crate) fn noise(correlation: f64) -> f64 {
    (2.0 * (1.0 - correlation) / SAMPLES as f64).max(0.0) + LEAST_NOISE
}

/// Returns the derivative of the pixel of a point of the object by a small motion of the object in
/// its own frame.
pub(crate) fn by_motion(slope: &Matrix2x3<f64>, point: &Vector3<f64>) -> Matrix2x6<f64> {
    let mut out = Matrix2x6::zeros();
    out.fixed_view_mut::<2, 3>(0, 0).copy_from(slope);
    out.fixed_view_mut::<2, 3>(0, 3).copy_from(&(-slope * point.cross_matrix()));
    out
}

/// Selects `most` of all entries, evenly.
pub(crate) fn thin(all: &[InView], most: usize, out: &mut Vec<InView>) {
    let (count, kept) = (all.len(), all.len().min(most));
    out.extend((0..kept).map(|at| all[at * count / kept]));
}

/// Returns the share of a drift that had occurred when a point was learned, and its remaining
/// variance once the loop is closed: that of a random walk with known ends.
pub(crate) fn bridged(variance: f64, (before, after): (f64, f64)) -> (f64, f64) {
    let share = ((variance - after) / (before - after)).clamp(0.0, 1.0);
    (share, after.min(variance) + (variance - after).max(0.0) * (1.0 - share))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::camera::Pyramid;
    use crate::fitness::SurfacePoint;

    proptest! {
        #[test]
        fn a_closed_loop_leaves_its_ends_where_they_are_known_and_nothing_less_certain(
            before in 0.01..0.1_f64,
            left in 0.0..0.25_f64,
            variance in 0.0..0.1_f64,
        ) {
            let after = left * before;
            prop_assert_eq!(bridged(after, (before, after)).0, 0.0);
            let (whole, kept) = bridged(before, (before, after));
            prop_assert!((whole - 1.0).abs() < 1e-12 && (kept - after).abs() < 1e-12);
            let (share, kept) = bridged(variance, (before, after));
            prop_assert!((0.0..=1.0).contains(&share) && (0.0..=variance).contains(&kept));
        }
    }

    #[test]
    fn a_loop_that_closes_turns_back_what_was_learned_on_the_way_and_leaves_what_was_known_before()
    {
        let (before, after) = (0.04, 0.0004);
        let point = SurfacePoint {
            position: Vector3::new(0.03, 0.01, 0.04),
            normal: Vector3::z(),
            steps: [Vector3::x() * 1e-3, Vector3::y() * 1e-3],
            toward: Vector3::z(),
            templates: [None; Pyramid::LEVELS],
            color: [0; 3],
        };
        let learned = |drift: f64| {
            let mut feature = Feature::new(point, 1e-8);
            feature.drift_variance = drift;
            feature
        };
        let mut points = Points::of(vec![learned(0.0), learned(after), learned(before)]);
        let off = Twist::new(0.002, 0.0, -0.001, 0.1, 0.2, -0.05);
        points.turn_back(&off, (before, after), None);
        for old in &points.features[..2] {
            assert_eq!(old.point, point);
        }
        // Seen from the pose after the jump, the point is where it was seen from the pose before.
        let newest = &points.features[2];
        assert!(
            (Pose::exp(&off).transform(&newest.point.position) - point.position).norm() < 1e-12
        );
        assert!((Pose::exp(&off).rotation() * newest.point.toward - point.toward).norm() < 1e-12);
        assert!((newest.drift_variance - after).abs() < 1e-12);
    }
}
