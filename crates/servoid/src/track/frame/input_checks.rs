use crate::camera::{Camera, ImageView, Observation};
use crate::track::estimate::Notice;

/// Checks which images of an observation can be used, and what is wrong with the others.
#[derive(Debug, Clone)]
pub(crate) struct InputChecks {
    usable: Vec<bool>,
    prints: Vec<Option<u64>>,
    /// Whether a camera has only repeated its image since another camera last had a new one.
    hangs: Vec<bool>,
    time_s: Option<f64>,
    /// Whether every camera delivered its last image once more.
    stale: bool,
}

/// Longest time between observations across which motion is predicted, in seconds.
pub(crate) const FARTHEST_S: f64 = 0.5;
/// Stride between the bytes that are hashed to tell images apart: a prime, so that all columns and
/// channels are included.
const PRINT_STEP: usize = 97;

impl InputChecks {
    pub(crate) fn new(cameras: usize) -> Self {
        Self {
            usable: vec![false; cameras],
            prints: vec![None; cameras],
            hangs: vec![false; cameras],
            time_s: None,
            stale: false,
        }
    }

    /// Checks an observation; returns what is wrong with it.
    pub(crate) fn check(
        &mut self,
        cameras: &[Camera],
        observation: &Observation<'_>,
    ) -> Vec<Notice> {
        let mut notices = Vec::new();
        self.check_time(observation.time_s, &mut notices);
        for (index, (camera, image)) in cameras.iter().zip(&observation.images).enumerate() {
            let wrong = match image {
                None => Some(Notice::NoImage(index)),
                Some(image) if image.size_px() != camera.size_px() => {
                    let (expected, given) = (camera.size_px(), image.size_px());
                    Some(Notice::WrongSize { camera: index, expected, given })
                }
                Some(image) => {
                    let print = Some(print(image));
                    let same = std::mem::replace(&mut self.prints[index], print) == print;
                    self.hangs[index] &= same;
                    same.then_some(Notice::Repeated(index))
                }
            };
            self.usable[index] = wrong.is_none();
            notices.extend(wrong);
        }
        // If nothing moves, all cameras repeat their images; if only one does, it hangs, and its
        // image is outdated even when the others fail.
        let repeated = notices.iter().filter_map(|notice| match notice {
            Notice::Repeated(camera) => Some(*camera),
            _ => None,
        });
        if self.usable.contains(&true) {
            repeated.for_each(|camera| self.hangs[camera] = true);
            self.stale = false;
        } else {
            repeated.for_each(|camera| self.usable[camera] = !self.hangs[camera]);
            self.stale = self.usable.contains(&true);
        }
        notices
    }

    fn check_time(&mut self, now: f64, notices: &mut Vec<Notice>) {
        let before = self.time_s.replace(now);
        let Some(before) = before else { return };
        if now <= before {
            notices.push(Notice::Time { before, now });
        } else if now - before > FARTHEST_S {
            notices.push(Notice::Jump(now - before));
        }
    }

    /// Returns whether a camera's image can be used.
    pub(crate) fn can_use(&self, camera: usize) -> bool {
        self.usable[camera]
    }

    /// Takes over which images can be used.
    pub(crate) fn use_as(&mut self, other: &Self) {
        self.usable.clone_from(&other.usable);
    }

    /// Marks all images as unusable.
    pub(crate) fn shut(&mut self) {
        self.usable.fill(false);
    }

    /// Returns whether every camera repeated its image: nothing new can be learned.
    pub(crate) fn is_stale(&self) -> bool {
        self.stale
    }
}

/// Returns a hash of an image (FNV-1a over some of its bytes).
fn print(image: &ImageView<'_>) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in image.bytes().iter().step_by(PRINT_STEP) {
        hash = (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
    }
    hash
}
