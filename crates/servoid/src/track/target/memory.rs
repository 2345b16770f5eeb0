use super::record::Record;

/// What a surface point remembers of the images in which it should have been recognised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Memory {
    /// Images in which it should have been recognised, and in which it was; both decayed.
    pub(crate) record: [f32; 2],
    /// Images in which it was recognised, and in which it also had the contrast of a pattern.
    pub(crate) images: u32,
    pub(crate) showed: u32,
    /// Rotation of the object, in radians, up to which it is known not to slip.
    pub(crate) proved: f32,
}

/// Largest number of images, since older ones decay.
const MOST_SEEN: f32 = 100.0;

impl Memory {
    /// Makes it of numbers; none if they contradict each other.
    pub(crate) fn new(
        [seen, agreed, proved]: [f32; 3],
        [images, showed]: [u32; 2],
    ) -> Option<Self> {
        let is_record = seen > 0.0 && seen <= MOST_SEEN && (0.0..=seen).contains(&agreed);
        let is_angle = (0.0..=std::f32::consts::TAU).contains(&proved);
        let record = [seen, agreed];
        (is_record && is_angle && showed <= images).then_some(Self {
            record,
            images,
            showed,
            proved,
        })
    }

    /// Returns its numbers.
    pub(crate) fn numbers(&self) -> [f32; 3] {
        let [seen, agreed] = self.record;
        [seen, agreed, self.proved]
    }

    pub(crate) fn counts(&self) -> [u32; 2] {
        [self.images, self.showed]
    }
}

impl Default for Memory {
    /// Returns that of a point that was just detected.
    fn default() -> Self {
        Self { record: Record::new().numbers(), images: 0, showed: 0, proved: 0.0 }
    }
}
