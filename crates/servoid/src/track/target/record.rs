/// How a point or a place of the surface has done.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Record {
    /// Images in which it should have been recognised, and was; both fade.
    seen: f32,
    agreed: f32,
}

/// Images for which a new one counts, and how much of the past counts then.
const AT_FIRST: f32 = 2.0;
const MEMORY: f32 = 0.93;
/// Share of the images that must agree.
const LEAST_HIT_RATE: f32 = 0.4;

impl Record {
    /// Begins with trust.
    pub(crate) fn new() -> Self {
        Self { seen: AT_FIRST, agreed: AT_FIRST }
    }

    /// Takes in an image in which it should have been recognised.
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
