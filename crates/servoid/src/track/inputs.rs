use super::frame::Frame;
use super::frame::depth_checks::DepthRecord;
use super::frame::rangefinder::Rangefinder;
use super::frame::window::Window;
use super::settings::TrackSettings;
use super::target::Target;
use super::target::bias::Bias;
use super::target::colors::Colors;
use super::target::contour_offsets::ContourOffsets;
use super::target::points::Points;
use super::target::ranges::Ranges;
use super::target::reference::Reference;
use super::target::relief::Relief;
use super::target::solid::Solid;
use super::trust::is_plain;
use crate::camera::{DepthView, ImageView, Observation};
use crate::pose::Pose;

/// What a step compares: the images of one instant, and the target.
#[derive(Clone, Copy)]
pub(super) struct Inputs<'a> {
    pub(super) windows: &'a [Window],
    pub(super) images: &'a [Option<ImageView<'a>>],
    depths: &'a [Option<DepthView<'a>>],
    depth_records: &'a [DepthRecord],
    pub(super) solid: &'a Solid,
    pub(super) points: &'a Points,
    pub(super) ranges: &'a Ranges,
    /// None where colours are not used.
    pub(super) colors: Option<&'a Colors>,
    pub(super) reference: &'a Reference,
    pub(super) bias: &'a Bias,
    pub(super) offsets: &'a ContourOffsets,
    /// Whether surface points measure the pose.
    pub(super) points_measure: bool,
    /// Whether the object moves so fast that its image may be blurred.
    pub(super) is_blurred: bool,
    pub(super) relief: &'a Relief,
}

impl<'a> Inputs<'a> {
    /// Combines the frame of an observation with the target.
    pub(super) fn new(
        frame: &'a Frame,
        observation: &'a Observation<'_>,
        target: &'a Target,
        settings: &TrackSettings,
    ) -> Self {
        Self {
            windows: &frame.windows,
            images: &observation.images,
            depths: &observation.depths,
            depth_records: &frame.depth_records,
            solid: &target.solid,
            points: &target.points,
            ranges: &target.ranges,
            colors: settings.region.then_some(&target.colors),
            reference: &target.reference,
            bias: &target.bias,
            offsets: &target.offsets,
            points_measure: !is_plain(
                settings,
                &target.reference,
                frame.cameras.len(),
                target.outlined.is_adjusted(),
            ),
            is_blurred: frame.is_blurred,
            relief: &target.relief,
        }
    }

    /// Returns the same without colours, and thus without the outline.
    pub(super) fn without_colors(self) -> Self {
        Self { colors: None, ..self }
    }

    /// Returns a camera's depth image, with the object at a pose, if the camera's image can be used
    /// and has the same pixels, and its depth images agree with the body.
    pub(super) fn rangefinder(&self, camera: usize, pose: &Pose) -> Option<Rangefinder<'a>> {
        self.any_rangefinder(camera, pose).filter(|_| self.depth_records[camera].is_believed())
    }

    /// Returns it whether its depth images agree or not.
    pub(super) fn any_rangefinder(&self, camera: usize, pose: &Pose) -> Option<Rangefinder<'a>> {
        let depth = self.depths.get(camera)?.as_ref()?;
        let image = self.images[camera].filter(|_| self.windows[camera].is_open())?;
        let projection = self.windows[camera].projection(pose)?;
        (depth.size_px() == image.size_px()).then(|| Rangefinder::new(depth, projection))?
    }
}
