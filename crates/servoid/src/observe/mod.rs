//! What cameras say: calibrated cameras, rigs that move and turn, images and masks.

mod camera;
mod image;
mod rig;
mod view;

pub use camera::{Camera, CameraError};
pub use image::{Channels, ImageError, ImageView, Mask};
pub use rig::{Observation, Rig, RigError};
pub use view::View;
