//! Calibrated cameras and lenses, rigs of cameras that move, images and masks.

mod brown_conrady;
mod depth;
mod distortion;
mod image;
mod kannala_brandt;
mod lens;
mod pinhole;
mod pyramid;
mod rig;
mod roots;
mod view;

pub use depth::{DepthView, depth_noise};
pub use distortion::Distortion;
pub(crate) use image::ImageBuffer;
pub use image::{Channels, ImageError, ImageView, Mask};
pub use lens::{Lens, NOWHERE_PX};
pub use pinhole::{Camera, CameraError};
pub use pyramid::{Plane, Pyramid, Sample};
pub(crate) use rig::check_image_size;
pub use rig::{Observation, Rig, RigError};
pub use view::View;
