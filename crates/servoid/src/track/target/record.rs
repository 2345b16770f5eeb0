/// Record of how often a point or a position of the surface was recognised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Record {
    /// Images in which it should have been recognised, and in which it was; both decay.
    pub(crate) seen: f32,
    pub(crate) agreed: f32,
}

/// Images with which a new one starts, and the decay per image.
const AT_FIRST: f32 = 2.0;
const MEMORY: f32 = 0.93;
/// Least share of the images that must agree.
const LEAST_HIT_RATE: f32 = 0.4;

impl Record {
    /// Starts as if it had always agreed.
    pub(crate) fn new() -> Self {
        Self { seen: AT_FIRST, agreed: AT_FIRST }
    }

    /// Adds an image in which it should have been recognised.
    pub(crate) fn count_hits(&mut self, agrees: bool) {
        self.seen = MEMORY * self.seen + 1.0;
        self.agreed *= MEMORY;
        if agrees {
            self.agreed += 1.0;
        }
    }

    /// Returns the share of the images in which it was recognised.
    pub(crate) fn hit_rate(&self) -> f32 {
        self.agreed / self.seen
    }

    /// Returns whether it still agrees often enough to be kept.
    pub(crate) fn is_good(&self) -> bool {
        self.hit_rate() > LEAST_HIT_RATE
    }
}
