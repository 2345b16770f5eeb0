use nalgebra::{Matrix2x3, Matrix2x6, Vector2, Vector3};

use super::solid::Solid;
use crate::fitness::{Agreement, SurfacePoint};
use crate::pose::Pose;
use crate::track::frame::window::Window;

/// A surface point with how well its distance is known and how it has done.
#[derive(Debug, Clone)]
pub(crate) struct Known {
    pub(crate) point: SurfacePoint,
    /// Variance of its place along `toward`, in square metres.
    pub(crate) variance: f64,
    /// Images in which it should have been recognised, and was; both fade.
    seen: f32,
    agreed: f32,
}

impl Known {
    pub(crate) fn new(point: SurfacePoint, variance: f64) -> Self {
        Self { point, variance, seen: 2.0, agreed: 2.0 }
    }

    pub(crate) fn quality(&self) -> f32 {
        self.agreed / self.seen
    }
}

/// A point that a camera should see.
#[derive(Debug, Clone, Copy)]
pub(crate) struct InView {
    pub(crate) camera: usize,
    pub(crate) point: usize,
}

/// How a point that a camera should see agrees with its image.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Match {
    pub(crate) view: InView,
    pub(crate) agreement: Option<Agreement>,
    /// Where it should be.
    pub(crate) pixel: Option<Vector2<f64>>,
}

/// The surface points of an object.
#[derive(Debug, Clone, Default)]
pub(crate) struct Points {
    pub(crate) known: Vec<Known>,
}

/// Least cosine between a surface's normal and the way to a camera that sees it.
const LEAST_FACING: f64 = 0.3;
/// Least cosine between the ways to a camera now and when the point was learned.
const LEAST_LIKE: f64 = 0.6;
/// Points are kept up to this number.
const MOST: usize = 600;
/// Points that there is room for: those that are kept, and what an image may bring.
const ROOM: usize = MOST + 40;
/// A point that agrees with less than this share of the images is dropped.
const LEAST_QUALITY: f32 = 0.4;
/// Correlation from which on a point counts as recognised.
const RECOGNISED: f64 = 0.75;
/// How much of the past counts when points are judged.
const MEMORY: f32 = 0.93;

impl Points {
    /// Lists the points that open windows should show, at most `most` a camera.
    pub(crate) fn in_view(
        &self,
        windows: &[Window],
        pose: &Pose,
        solid: &Solid,
        most: usize,
        out: &mut Vec<InView>,
    ) {
        out.clear();
        for (camera, window) in windows.iter().enumerate() {
            let Some(projection) = window.projection(pose) else { continue };
            let Some(eye) = projection.eye() else { continue };
            let begin = out.len();
            for (index, known) in self.known.iter().enumerate() {
                let point = &known.point;
                let way = (eye - point.position).normalize();
                let shows = way.dot(&point.normal) > LEAST_FACING
                    && way.dot(&point.toward) > LEAST_LIKE
                    && !solid.hides(&point.position, &eye);
                if shows {
                    out.push(InView { camera, point: index });
                }
            }
            thin(out, begin, most);
        }
    }

    /// Takes in new points, in memory that is there at once for as many as are ever kept.
    pub(crate) fn add(&mut self, fresh: &mut Vec<Known>) {
        if self.known.capacity() < ROOM {
            self.known.reserve(ROOM.saturating_sub(self.known.len()));
        }
        self.known.append(fresh);
    }

    /// Judges points by what images said of them, and drops those that no longer agree.
    pub(crate) fn judge(&mut self, matches: &[Match]) {
        for Match { view, agreement, .. } in matches {
            let Some(agreement) = agreement else { continue };
            let known = &mut self.known[view.point];
            known.seen = MEMORY * known.seen + 1.0;
            known.agreed *= MEMORY;
            if agreement.correlation > RECOGNISED {
                known.agreed += 1.0;
            }
        }
        self.known.retain(|known| known.quality() > LEAST_QUALITY);
        let (count, excess) = (self.known.len(), self.known.len().saturating_sub(MOST));
        if excess > 0 {
            // Evenly, so that no side of the object is forgotten.
            let mut at = 0;
            self.known.retain(|_| {
                at += 1;
                at * excess / count == (at - 1) * excess / count
            });
        }
    }

    /// Moves points along the way in which they were learned to where the images show them, each by
    /// as much as it is less certain than the images; `radius` is the body's.
    pub(crate) fn refine(&mut self, matches: &[Match], radius: f64) {
        for Match { view, agreement, .. } in matches {
            let Some(agreement) = agreement else { continue };
            if agreement.correlation < RECOGNISED {
                continue;
            }
            let known = &mut self.known[view.point];
            let way = agreement.slope * known.point.toward;
            let curvature = way.dot(&(agreement.tensor * way));
            let noise = noise(agreement.correlation);
            let information = 1.0 / (noise / curvature + PLACE_PX * PLACE_PX / way.norm_squared());
            if !(curvature > 0.0 && information.is_finite()) {
                continue;
            }
            let step = way.dot(&agreement.pull) / curvature;
            let gain = information * SHARED / (1.0 / known.variance + information * SHARED);
            known.point.position += known.point.toward * (gain * step);
            known.variance = (1.0 - gain) * known.variance + (FADING * radius).powi(2);
        }
    }
}

/// Share of what an image says of a point that is its own and not the pose's.
const SHARED: f64 = 0.2;
/// Standard deviation of what is forgotten of a point's place in an image, as a share of the body's
/// radius.
const FADING: f64 = 1e-4;
/// Standard deviation of where a patch is found beyond its noise, in pixels: surfaces are not flat.
pub(crate) const PLACE_PX: f64 = 0.25;

/// Variance of a normalised patch's samples at a correlation.
pub(crate) fn noise(correlation: f64) -> f64 {
    (2.0 * (1.0 - correlation) / 16.0).max(0.0) + 4e-4
}

/// Gives how the pixel of a point of the object moves with a small motion of the object in its own
/// frame.
pub(crate) fn by_motion(slope: &Matrix2x3<f64>, point: &Vector3<f64>) -> Matrix2x6<f64> {
    let mut out = Matrix2x6::zeros();
    out.fixed_view_mut::<2, 3>(0, 0).copy_from(slope);
    out.fixed_view_mut::<2, 3>(0, 3).copy_from(&(-slope * point.cross_matrix()));
    out
}

/// Keeps `most` of the entries from `begin` on, evenly.
fn thin(out: &mut Vec<InView>, begin: usize, most: usize) {
    let count = out.len() - begin;
    if count > most {
        for kept in 0..most {
            out[begin + kept] = out[begin + kept * count / most];
        }
        out.truncate(begin + most);
    }
}
