use super::{Camera, Mask};
use crate::pose::Pose;

/// One picture that says where the object is: a camera, its pose and a mask.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    camera: Camera,
    world_from_camera: Pose,
    mask: Mask<'a>,
}

impl<'a> View<'a> {
    /// Joins a camera, its pose and a mask.
    ///
    /// # Errors
    /// If the mask has not the camera's size.
    pub fn new(
        camera: Camera,
        world_from_camera: Pose,
        mask: Mask<'a>,
    ) -> Result<Self, super::RigError> {
        let (expected, given) = (camera.size_px(), mask.image().size_px());
        if expected != given {
            return Err(super::RigError::ImageSize { camera: 0, expected, given });
        }
        Ok(Self { camera, world_from_camera, mask })
    }

    /// Gives the camera.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Gives the pose of the camera in the world.
    #[must_use]
    pub fn world_from_camera(&self) -> Pose {
        self.world_from_camera
    }

    /// Gives the mask.
    #[must_use]
    pub fn mask(&self) -> &Mask<'a> {
        &self.mask
    }
}
