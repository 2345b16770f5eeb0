use nalgebra::{Matrix2, Vector2};

use super::points::{Match, Points};
use super::shift::Shift;
use crate::track::frame::occlusion::Occlusion;
use crate::track::frame::window::Window;

/// An observation of a landmark by a camera.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sighting {
    /// Number of the landmark.
    pub(crate) id: usize,
    pub(crate) camera: usize,
    pub(crate) pixel: Vector2<f64>,
    pub(crate) information: Matrix2<f64>,
}

/// Largest deviation of a match in pixels.
const FARTHEST_PX: f64 = 3.0;
/// Weight of an observation without the contrast of a pattern: shading slips along the surface.
const SHADING: f64 = 0.3;

impl Sighting {
    /// Makes it of a match, if the point is recognised and nothing hides it.
    pub(super) fn of(
        found: &Match,
        points: &Points,
        (windows, occlusion): (&[Window], &Occlusion),
    ) -> Option<Self> {
        let (agreement, pixel) = (found.agreement.as_ref()?, found.pixel?);
        let camera = found.view.camera;
        if !found.agrees() || occlusion.hides(camera, &pixel) > 0.0 {
            return None;
        }
        let shift = Shift::pixels(agreement).filter(|shift| shift.norm() < FARTHEST_PX)?;
        let Shift { information, .. } = Shift::new(agreement, found.level, &Matrix2::zeros())?;
        let id = points.features[found.view.point].id;
        let share = if windows[camera].shows_texture(agreement) { 1.0 } else { SHADING };
        let information = (information + information.transpose()) * (0.5 * share);
        Some(Self { id, camera, pixel: pixel + shift, information })
    }
}
