use super::{Camera, Mask, RigError, check_image_size};
use crate::pose::Pose;

/// An image in which the object is marked: a camera, its pose and a mask.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    camera: Camera,
    world_from_camera: Pose,
    mask: Mask<'a>,
}

impl<'a> View<'a> {
    /// Makes a view of a camera, its pose and a mask.
    ///
    /// # Errors
    /// If the mask does not have the camera's size.
    pub fn new(camera: Camera, world_from_camera: Pose, mask: Mask<'a>) -> Result<Self, RigError> {
        check_image_size(0, camera.size_px(), mask.image())?;
        Ok(Self { camera, world_from_camera, mask })
    }

    /// Returns the camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Returns the pose of the camera in the world.
    #[must_use]
    pub fn world_from_camera(&self) -> Pose {
        self.world_from_camera
    }

    /// Returns the mask.
    #[must_use]
    pub fn mask(&self) -> &Mask<'a> {
        &self.mask
    }
}
