//! What the cameras see at one instant.

pub(super) mod depth_checks;
pub(super) mod input_checks;
pub(super) mod occlusion;
pub(super) mod rangefinder;
pub(super) mod window;

use nalgebra::Vector3;

use self::depth_checks::DepthRecord;
use self::input_checks::InputChecks;
use self::window::Window;
use super::TrackError;
use super::estimate::Notice;
use super::target::colors::Colors;
use super::target::solid::Solid;
use crate::camera::{Camera, ImageView, Observation};
use crate::pose::Pose;

/// The cameras and their current images: a window in each usable image, and what is wrong with the
/// others. Memory is reused from image to image.
#[derive(Debug, Clone)]
pub(super) struct Frame {
    pub(super) cameras: Vec<Camera>,
    pub(super) windows: Vec<Window>,
    pub(super) notices: Vec<Notice>,
    /// Whether the object moves so fast that its image may be blurred.
    pub(super) is_blurred: bool,
    /// How far the depth images of each camera agree with the body.
    pub(super) depth_records: Vec<DepthRecord>,
    input_checks: InputChecks,
}

impl Frame {
    pub(super) fn new(cameras: &[Camera]) -> Self {
        Self {
            cameras: cameras.to_vec(),
            windows: vec![Window::default(); cameras.len()],
            notices: Vec::new(),
            is_blurred: false,
            depth_records: vec![DepthRecord::default(); cameras.len()],
            input_checks: InputChecks::new(cameras.len()),
        }
    }

    /// Checks an observation; problems that can be tolerated become notices.
    pub(super) fn check(&mut self, observation: &Observation<'_>) -> Result<(), TrackError> {
        let cameras = self.cameras.len();
        let poses = ("poses", observation.world_from_camera.len());
        for (what, given) in [poses, ("images", observation.images.len())] {
            if given != cameras {
                return Err(TrackError::Count { what, cameras, given });
            }
        }
        let depths = observation.depths.len();
        if depths != 0 && depths != cameras {
            return Err(TrackError::Count { what: "depth images", cameras, given: depths });
        }
        if !observation.time_s.is_finite() {
            return Err(TrackError::Time(observation.time_s));
        }
        self.notices = self.input_checks.check(&self.cameras, observation);
        for (camera, depth) in observation.depths.iter().enumerate() {
            let (expected, given) = (self.cameras[camera].size_px(), depth.map(|d| d.size_px()));
            if let Some(given) = given.filter(|given| *given != expected) {
                self.notices.push(Notice::WrongDepth { camera, expected, given });
            }
        }
        Ok(())
    }

    /// Opens windows around the body at a pose; returns `false` if no camera sees it. Windows are
    /// larger than its image by `margin` of its size.
    pub(super) fn open_windows(
        &mut self,
        observation: &Observation<'_>,
        (pose, solid, margin): (&Pose, &Solid, f64),
        colors: Option<&Colors>,
    ) -> bool {
        for (camera, window) in self.windows.iter_mut().enumerate() {
            window.close();
            let image = observation.images[camera].filter(|_| self.input_checks.can_use(camera));
            let Some(image) = image else { continue };
            let place = (pose, solid, margin);
            let eye = &observation.world_from_camera[camera];
            let inside = window.open(&self.cameras[camera], eye, &image, place, colors);
            if !inside {
                note(&mut self.notices, Notice::OutOfImage(camera));
            } else if window.is_blank() {
                window.close();
                note(&mut self.notices, Notice::Blank(camera));
            }
        }
        self.open() > 0
    }

    /// Opens windows on the whole images.
    pub(super) fn open_all_over(&mut self, observation: &Observation<'_>, colors: Option<&Colors>) {
        for (camera, window) in self.windows.iter_mut().enumerate() {
            window.close();
            let image = observation.images[camera].filter(|_| self.input_checks.can_use(camera));
            if let Some(image) = image {
                let eye = &observation.world_from_camera[camera];
                window.open_all_over(&self.cameras[camera], eye, &image, colors);
            }
        }
    }

    /// Returns the images that can be used.
    pub(super) fn images<'a>(
        &self,
        observation: &Observation<'a>,
    ) -> impl Iterator<Item = ImageView<'a>> {
        let cameras = (0..self.cameras.len()).filter(|&camera| self.input_checks.can_use(camera));
        cameras.filter_map(|camera| observation.images[camera])
    }

    /// Takes over which images can be used from the frame of their observation.
    pub(super) fn take_checks(&mut self, frame: &Self) {
        self.input_checks.use_as(&frame.input_checks);
    }

    /// Returns whether any camera delivered a usable image.
    pub(super) fn can_see(&self) -> bool {
        (0..self.cameras.len()).any(|camera| self.input_checks.can_use(camera))
    }

    /// Marks all images of this observation as unusable: the object has moved since they were new.
    pub(super) fn shut(&mut self) {
        self.input_checks.shut();
        self.notices.push(Notice::Outdated);
    }

    /// Returns whether every camera repeated its image: nothing new can be learned.
    pub(super) fn is_stale(&self) -> bool {
        self.input_checks.is_stale()
    }

    /// Returns the number of open windows.
    pub(super) fn open(&self) -> usize {
        self.windows.iter().filter(|window| window.is_open()).count()
    }

    /// Returns the number of pixels inside the body's outlines at a pose.
    pub(super) fn area(&self, pose: &Pose, solid: &Solid) -> f64 {
        let held = self
            .windows
            .iter()
            .filter_map(|window| Some(window.region(&window.projection(pose)?, solid).1));
        held.sum()
    }

    /// Returns by how many pixels the object's image moves per metre across, in the camera in which
    /// it moves most.
    pub(super) fn px_per_meter(&self, pose: &Pose) -> f64 {
        let slopes = self.windows.iter().filter_map(|window| {
            let (_, slope) = window.projection(pose)?.pixel(&Vector3::zeros())?;
            Some(slope.row(0).norm())
        });
        slopes.fold(0.0, f64::max)
    }
}

/// Adds a notice once.
fn note(notices: &mut Vec<Notice>, notice: Notice) {
    if !notices.contains(&notice) {
        notices.push(notice);
    }
}
