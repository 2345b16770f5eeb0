//! Surface positions measured by depth images: they constrain a pose also where nothing is
//! textured.

use nalgebra::{Vector2, Vector3, Vector6};

use super::keyframes::Keyframes;
use super::points::bridged;
use super::record::Record;
use super::solid::{Rims, Solid};
use crate::camera::depth_noise;
use crate::pose::{Pose, Twist};
use crate::track::frame::rangefinder::Rangefinder;

/// A piece of the surface, in the object's frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Range {
    pub(crate) position: Vector3<f64>,
    pub(crate) normal: Vector3<f64>,
    /// The direction to the camera that measured it.
    pub(crate) toward: Vector3<f64>,
    /// The keyframe of its view, with which it moves.
    keyframe: usize,
    /// Variance of its position along the normal, in square metres, and of the object's orientation
    /// since the first image, in square radians.
    variance: f64,
    drift_variance: f64,
    record: Record,
}

/// Residual of a measured position at a pose, along its normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Residual {
    /// Distance of the surface beyond its expected position, in metres, and its derivative by a
    /// small motion.
    pub(crate) off: f64,
    pub(crate) by_motion: Vector6<f64>,
    pub(crate) information: f64,
}

/// The measured surface positions of an object.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ranges {
    pub(crate) all: Vec<Range>,
}

/// Least distance between two, in radii, if the cosine between their normals is at least this.
const RANGES_APART: f64 = 0.12;
const ALIKE: f64 = 0.6;
/// Positions along the longer side of the object's image that are sampled.
const COLUMNS: f64 = 24.0;
/// Most that are kept.
const MOST_RANGES: usize = 800;
/// Least distance inside the outline, and distance to the neighbours from which the normal is
/// computed, in pixels.
const MARGIN_PX: f64 = 4.0;
const BESIDE_PX: f64 = 3.0;
/// Largest distance from the body's surface of a position that counts as the object's, in radii.
const REACH: f64 = 0.3;
/// Depth difference between neighbours that is an edge, in radii.
const EDGE: f64 = 0.25;
/// Least cosine between a normal and the direction to the camera.
const FACING: f64 = 0.4;
/// Weight of a position: errors of neighbours are correlated.
const SHARE: f64 = 0.25;
/// Deviation, in standard deviations or in radii if these are more, beyond which something else was
/// measured.
const FARTHEST: (f64, f64) = (4.0, 0.06);

impl Ranges {
    /// Adds positions where a depth image shows the surface and nothing near is known; `drift` is
    /// the variance of the object's orientation, `keyframe` that of the view.
    pub(crate) fn add(
        &mut self,
        seen: &Rangefinder<'_>,
        (solid, rims): (&Solid, &mut Rims),
        (keyframe, drift): (usize, f64),
        is_clear: impl Fn(&Vector2<f64>) -> bool,
    ) {
        let Some((middle, by_place)) = seen.projection.pixel(&Vector3::zeros()) else { return };
        rims.read(solid, &seen.projection);
        let step = (2.0 * solid.radius * by_place.row(0).norm() / COLUMNS).max(1.0);
        let half = (0.5 * COLUMNS) as i32;
        for at in 0..(2 * half + 1) * (2 * half + 1) {
            if self.all.len() >= MOST_RANGES {
                return;
            }
            let by = [at % (2 * half + 1) - half, at / (2 * half + 1) - half];
            let pixel = middle + Vector2::from(by.map(f64::from)) * step;
            if rims.margin(&pixel) < MARGIN_PX || !is_clear(&pixel) {
                continue;
            }
            let Some(found) = measured(seen, solid, &pixel) else { continue };
            if !self.is_known(&found, RANGES_APART * solid.radius) {
                self.all.push(Range { keyframe, drift_variance: drift, ..found });
            }
        }
    }

    /// Returns whether a position nearer than `least` is known whose normal is similar.
    fn is_known(&self, found: &Range, least: f64) -> bool {
        self.all.iter().any(|one| {
            (one.position - found.position).norm_squared() < least.powi(2)
                && one.normal.dot(&found.normal) > ALIKE
        })
    }

    /// Updates the records of positions by a depth image at a trusted pose, where nothing hides the
    /// object, and drops those that no longer agree: something else was measured there.
    pub(crate) fn count_hits(
        &mut self,
        seen: &Rangefinder<'_>,
        solid: &Solid,
        is_clear: impl Fn(&Vector2<f64>) -> bool,
    ) {
        for one in &mut self.all {
            let Some((pixel, off, _)) = one.off(seen, solid) else { continue };
            if is_clear(&pixel) {
                one.record.count_hits(off.abs() < FARTHEST.1 * solid.radius);
            }
        }
        self.all.retain(|one| one.record.is_good());
    }

    /// Returns the residuals of a depth image at a pose for the positions that its camera should
    /// see; `drift` is the current variance of the object's orientation.
    pub(crate) fn residuals(
        &self,
        seen: &Rangefinder<'_>,
        (solid, drift): (&Solid, f64),
    ) -> impl Iterator<Item = (Vector2<f64>, Residual)> {
        self.all.iter().filter_map(move |one| {
            let (pixel, off, metres) = one.off(seen, solid)?;
            let way = (seen.eye - one.position).normalize();
            let by_turn = one.position.cross(&one.normal);
            let noise = (depth_noise(metres) * way.dot(&one.normal)).powi(2) + one.variance;
            let strayed = (one.drift_variance - drift).max(0.0) / 3.0 * by_turn.norm_squared();
            let variance = noise + strayed;
            let most = (FARTHEST.0 * variance.sqrt()).max(FARTHEST.1 * solid.radius);
            let mut by_motion = Vector6::zeros();
            by_motion.fixed_rows_mut::<3>(0).copy_from(&one.normal);
            by_motion.fixed_rows_mut::<3>(3).copy_from(&by_turn);
            // Larger deviations have less weight.
            let doubt = 1.0 / (1.0 + off * off / (2.0 * noise));
            let information = SHARE * doubt / variance;
            (off.abs() < most).then_some((pixel, Residual { off, by_motion, information }))
        })
    }

    /// Limits the orientation variances to those of the keyframes with which the positions move.
    pub(crate) fn know_drift(&mut self, keyframes: &Keyframes) {
        for one in &mut self.all {
            if let Some(at) = keyframes.place(one.keyframe) {
                one.drift_variance = one.drift_variance.min(keyframes.all[at].drift_variance);
            }
        }
    }

    /// Moves the positions by the motions of their keyframes, in the object's frame.
    pub(crate) fn move_by(&mut self, by: impl Fn(usize) -> Pose) {
        for one in &mut self.all {
            one.move_by(&by(one.keyframe).inverse());
        }
    }

    /// Turns back the positions measured since a keyframe, each by its share of a motion that
    /// closes a loop.
    pub(crate) fn turn_back(&mut self, off: &Twist, drifts: (f64, f64), since: Option<usize>) {
        for one in self.all.iter_mut().filter(|one| Some(one.keyframe) >= since) {
            let (share, left) = bridged(one.drift_variance, drifts);
            one.drift_variance = left;
            if share > 0.0 {
                one.move_by(&Pose::exp(&(-off * share)));
            }
        }
    }
}

impl Range {
    /// Returns the pixel where a camera should see the position, how far beyond it the surface is
    /// there, along its normal, and the measured distance, in metres; none if it should not be
    /// visible, or was not measured.
    fn off(&self, seen: &Rangefinder<'_>, solid: &Solid) -> Option<(Vector2<f64>, f64, f64)> {
        let way = (seen.eye - self.position).normalize();
        if way.dot(&self.normal) < FACING || solid.hides(&self.position, &seen.eye) {
            return None;
        }
        let (pixel, _) = seen.projection.pixel(&self.position)?;
        let (found, metres) = seen.place(&pixel)?;
        Some((pixel, self.normal.dot(&(found - self.position)), metres))
    }

    fn move_by(&mut self, by: &Pose) {
        self.position = by.transform(&self.position);
        let turn = by.rotation();
        (self.normal, self.toward) = (turn * self.normal, turn * self.toward);
    }
}

/// Returns the surface position that a depth image shows at a pixel.
fn measured(seen: &Rangefinder<'_>, solid: &Solid, pixel: &Vector2<f64>) -> Option<Range> {
    let (position, metres) = seen.place(pixel)?;
    let way = (position - seen.eye).normalize();
    let hit = solid.hit(&seen.eye, &way)?;
    let beside = |u: f64, v: f64| {
        let (place, beside) = seen.place(&(pixel + Vector2::new(u, v) * BESIDE_PX))?;
        ((beside - metres).abs() < EDGE * solid.radius).then_some(place)
    };
    let across = beside(1.0, 0.0)? - beside(-1.0, 0.0)?;
    let down = beside(0.0, 1.0)? - beside(0.0, -1.0)?;
    let normal = down.cross(&across).try_normalize(0.0)?;
    let normal = if normal.dot(&way) > 0.0 { -normal } else { normal };
    let facing = -normal.dot(&way);
    let near = (hit.point - position).norm() < REACH * solid.radius;
    let variance = (depth_noise(metres) * facing).powi(2);
    let (keyframe, drift_variance, record) = (0, 0.0, Record::new());
    let range =
        Range { position, normal, toward: -way, keyframe, variance, drift_variance, record };
    (near && facing > FACING).then_some(range)
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix6;

    use super::*;
    use crate::camera::{Camera, DepthView};
    use crate::shape::{Body, Ellipsoid, Projection};

    const SIZE: [usize; 2] = [160, 120];
    const RADII: [f64; 3] = [0.05, 0.035, 0.025];

    fn solid() -> Solid {
        let egg = Ellipsoid::new(0, [0.0; 3], RADII, [1.0, 0.0, 0.0, 0.0]).unwrap();
        Solid::new(&Body::new(Pose::identity(), vec![egg]).unwrap())
    }

    fn world() -> Projection {
        let camera = Camera::new(SIZE, [200.0; 2], [79.5, 59.5]).unwrap();
        Projection::new(&camera, &Pose::identity())
    }

    fn pose_at(turned: f64, aside: f64) -> Pose {
        Pose::exp(&Twist::new(aside, 0.0, 0.4, 0.3, 0.5 + turned, 0.2))
    }

    /// Measures the egg at a pose, with an error of `beyond` in the distance.
    fn image(pose: &Pose, beyond: f64) -> Vec<f32> {
        let (solid, projection) = (solid(), world().moved(pose));
        let (eye, to_ray) = (projection.eye().unwrap(), projection.linear.try_inverse().unwrap());
        let depth = |i: usize| {
            let pixel = Vector2::new((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
            let way = to_ray * (Vector3::new(pixel.x, pixel.y, 1.0) - projection.offset) - eye;
            let hit = solid
                .hit(&eye, &way)
                .map(|hit| projection.linear.row(2).dot(&hit.point.transpose()));
            hit.map_or(f32::NAN, |z| (z + projection.offset.z + beyond) as f32)
        };
        (0..SIZE[0] * SIZE[1]).map(depth).collect()
    }

    fn seen<'a>(depth: &'a DepthView<'_>, pose: &Pose) -> Rangefinder<'a> {
        Rangefinder::new(depth, world().moved(pose)).unwrap()
    }

    fn learned(pose: &Pose) -> Ranges {
        let pixels = image(pose, 0.0);
        let depth = DepthView::new(&pixels, SIZE).unwrap();
        let mut ranges = Ranges::default();
        let body = (&solid(), &mut Rims::default());
        ranges.add(&seen(&depth, pose), body, (0, 0.0), |_| true);
        ranges
    }

    #[test]
    fn what_is_measured_lies_on_the_surface_and_its_normals_stand_on_it() {
        let ranges = learned(&pose_at(0.0, 0.0));
        assert!(ranges.all.len() > 25, "{}", ranges.all.len());
        let to_ball = Vector3::from(RADII.map(|r| 1.0 / r));
        for one in &ranges.all {
            let at = one.position.component_mul(&to_ball);
            assert!((at.norm() - 1.0).abs() < 1e-5);
            let normal = at.component_mul(&to_ball).normalize();
            assert!(one.normal.dot(&normal) > 0.97, "{} {normal}", one.normal);
        }
    }

    #[test]
    fn steps_by_depth_residuals_alone_converge_to_the_true_pose() {
        let truth = pose_at(0.0, 0.0);
        let (ranges, pixels) = (learned(&truth), image(&pose_at(0.06, 0.0015), 0.0));
        let depth = DepthView::new(&pixels, SIZE).unwrap();
        let mut pose = truth;
        for _ in 0..30 {
            let (mut curvature, mut slope) = (Matrix6::identity() * 1e-3, Twist::zeros());
            let seen = seen(&depth, &pose);
            for (_, found) in ranges.residuals(&seen, (&solid(), 0.0)) {
                curvature += found.by_motion * found.by_motion.transpose() * found.information;
                slope += found.by_motion * (found.off * found.information);
            }
            pose = pose * Pose::exp(&curvature.cholesky().unwrap().solve(&slope));
        }
        let off = (pose.inverse() * pose_at(0.06, 0.0015)).log();
        let (across, turned) = (off.fixed_rows::<3>(0).norm(), off.fixed_rows::<3>(3).norm());
        assert!(across < 3e-4 && turned < 0.02, "{across} {turned}");
    }

    #[test]
    fn depth_far_before_or_behind_the_surface_gives_no_residual() {
        let pose = pose_at(0.0, 0.0);
        let ranges = learned(&pose);
        for (beyond, measures) in [(0.0, true), (0.002, true), (0.03, false), (-0.03, false)] {
            let pixels = image(&pose, beyond);
            let depth = DepthView::new(&pixels, SIZE).unwrap();
            let seen = seen(&depth, &pose);
            assert_eq!(
                ranges.residuals(&seen, (&solid(), 0.0)).next().is_some(),
                measures,
                "{beyond}"
            );
        }
    }

    #[test]
    fn what_was_measured_before_the_object_once_is_dropped_and_its_surface_stays() {
        let pose = pose_at(0.0, 0.0);
        let (truth, finger) = (image(&pose, 0.0), image(&pose, -0.012));
        let mut ranges = learned(&pose);
        let count = ranges.all.len();
        let [truth, finger] = [&truth, &finger].map(|it| DepthView::new(it, SIZE).unwrap());
        ranges.add(&seen(&finger, &pose), (&solid(), &mut Rims::default()), (0, 0.0), |_| true);
        assert!(ranges.all.len() > count);
        for _ in 0..20 {
            ranges.count_hits(&seen(&truth, &pose), &solid(), |_| true);
        }
        assert_eq!(ranges.all.len(), count);
    }

    #[test]
    fn the_same_surface_is_not_learned_twice() {
        let pose = pose_at(0.0, 0.0);
        let mut ranges = learned(&pose);
        let (count, pixels) = (ranges.all.len(), image(&pose, 0.0));
        let depth = DepthView::new(&pixels, SIZE).unwrap();
        let body = (&solid(), &mut Rims::default());
        ranges.add(&seen(&depth, &pose), body, (1, 0.0), |_| true);
        assert_eq!(ranges.all.len(), count);
    }
}
