use super::{Camera, DepthView, ImageView};
use crate::pose::Pose;
use crate::words::{Digits, s};

/// Why cameras, poses and images do not make an observation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RigError {
    /// A rig needs a camera.
    #[error("a rig needs at least one camera")]
    NoCamera,
    /// A list does not have one entry per camera.
    #[error(
        "a rig of {cameras} camera{} needs as many {what}, but was given {given}",
        s(*cameras)
    )]
    Count {
        /// What is counted.
        what: &'static str,
        /// Cameras of the rig.
        cameras: usize,
        /// Entries given.
        given: usize,
    },
    /// An image does not fit its camera.
    #[error("camera {camera} takes images of {expected:?} pixels, but this one has {given:?}")]
    ImageSize {
        /// Which camera.
        camera: usize,
        /// Its size.
        expected: [usize; 2],
        /// The image's size.
        given: [usize; 2],
    },
    /// A time stamp is not finite.
    #[error("a time stamp must be a finite number of seconds, but it is {}", Digits(*.0))]
    Time(f64),
}

/// Cameras on a common mount. The mount and the cameras on it may move, so each observation has its
/// own poses; `rig_from_camera` are the poses of the cameras at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    cameras: Vec<Camera>,
    rig_from_camera: Vec<Pose>,
}

/// The images of all cameras of a rig at one instant; a camera that delivered nothing has no image.
#[derive(Debug, Clone)]
pub struct Observation<'a> {
    /// Time stamp in seconds.
    pub time_s: f64,
    /// Pose of each camera.
    pub world_from_camera: Vec<Pose>,
    /// Image of each camera.
    pub images: Vec<Option<ImageView<'a>>>,
    /// Depth image of each camera, in the pixels of its image; empty where no camera measures
    /// depth.
    pub depths: Vec<Option<DepthView<'a>>>,
}

impl Rig {
    /// Mounts cameras at their resting poses.
    ///
    /// # Errors
    /// If there is no camera, or not one pose per camera.
    pub fn new(cameras: Vec<Camera>, rig_from_camera: Vec<Pose>) -> Result<Self, RigError> {
        if cameras.is_empty() {
            return Err(RigError::NoCamera);
        }
        check_count("poses", cameras.len(), rig_from_camera.len())?;
        Ok(Self { cameras, rig_from_camera })
    }

    /// Returns the cameras.
    #[must_use]
    pub fn cameras(&self) -> &[Camera] {
        &self.cameras
    }

    /// Makes the observation of one instant: the pose of the rig, the poses of its cameras in it
    /// (`None`: at rest), and the image of each camera.
    ///
    /// # Errors
    /// If the time is not finite, a list does not have one entry per camera, or an image does not
    /// have its camera's size.
    pub fn observation<'a>(
        &self,
        time_s: f64,
        world_from_rig: Pose,
        rig_from_camera: Option<&[Pose]>,
        images: Vec<Option<ImageView<'a>>>,
    ) -> Result<Observation<'a>, RigError> {
        let rig_from_camera = rig_from_camera.unwrap_or(&self.rig_from_camera);
        if !time_s.is_finite() {
            return Err(RigError::Time(time_s));
        }
        check_count("poses", self.cameras.len(), rig_from_camera.len())?;
        check_count("images", self.cameras.len(), images.len())?;
        for (i, (camera, image)) in self.cameras.iter().zip(&images).enumerate() {
            image.map_or(Ok(()), |image| check_image_size(i, camera.size_px(), image))?;
        }
        let world_from_camera = rig_from_camera
            .iter()
            .map(|&rig_from_camera| world_from_rig * rig_from_camera)
            .collect();
        Ok(Observation { time_s, world_from_camera, images, depths: Vec::new() })
    }
}

/// Checks that an image has the size of its camera, or of whatever else it belongs to.
pub(crate) fn check_image_size(
    camera: usize,
    expected: [usize; 2],
    image: ImageView<'_>,
) -> Result<(), RigError> {
    let given = image.size_px();
    if expected == given { Ok(()) } else { Err(RigError::ImageSize { camera, expected, given }) }
}

fn check_count(what: &'static str, cameras: usize, given: usize) -> Result<(), RigError> {
    if cameras == given { Ok(()) } else { Err(RigError::Count { what, cameras, given }) }
}
