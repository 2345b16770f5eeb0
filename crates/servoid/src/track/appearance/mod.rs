//! The appearance of an object as bytes: all that a tracker needs of the object to go on elsewhere
//! as it was.

mod bytes;
mod first_version;
mod flaw;
mod second_version;
mod stored;

use self::bytes::Reader;
pub use self::flaw::Flaw;
use self::stored::{StoredOffset, StoredPoint, StoredView};
use super::TrackError;
use super::target::colors::Colors;
use super::target::contour_offsets::ContourOffsets;
use super::target::keyframes::Keyframes;
use super::target::points::Points;
use super::target::ranges::Ranges;
use super::target::reference::Reference;
use super::target::relief::Relief;
use super::target::shares::Shares;
use super::target::views::Views;
use super::tracker::Tracker;

/// The appearance of an object, apart from its shape: the learned surface points with their
/// templates from all sides and their records, the sides that were seen, the shares of its colours,
/// the offsets of its boundary from the body's outline, and its reference quality.
///
/// It is expressed in the object's frame, so it can be used wherever the object is seen again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Appearance {
    points: Vec<StoredPoint>,
    /// Bins of colours and their shares, in grey images and in others.
    colors: [Shares; 2],
    reference: [f64; Reference::NUMBERS],
    views: Vec<StoredView>,
    offsets: Vec<StoredOffset>,
    /// Number of ellipsoids of the body to which the offsets belong.
    ellipsoids: usize,
    /// Whether the body is not trusted, and the deviation of points from it.
    is_open: bool,
    misfit: Option<f64>,
    /// Variance of the orientation by the noise of images, where motion determines distances.
    noise_variance: f64,
    /// Orientation of the first camera in the object's frame where the pose was given, as
    /// (w, x, y, z).
    given: Option<[f32; 4]>,
}

impl Appearance {
    /// Returns the number of surface points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Writes the appearance as little-endian numbers, as described in `docs/formats.md`.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        second_version::write(self)
    }

    /// Reads what [`Appearance::to_bytes`] wrote, now or in its first version.
    ///
    /// # Errors
    /// If the bytes are not an appearance, are cut short, or contain a number that is not finite or
    /// outside of its range.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrackError> {
        let mut reader = Reader(bytes);
        let read = reader.appearance();
        read.map_err(|flaw| TrackError::Appearance { bytes: bytes.len(), flaw })
    }
}

impl Reader<'_> {
    fn appearance(&mut self) -> Result<Appearance, Flaw> {
        let read = match &self.take::<8>().map_err(|_| Flaw::Unknown)? {
            first_version::MAGIC => first_version::read(self),
            second_version::MAGIC => second_version::read(self),
            _ => Err(Flaw::Unknown),
        }?;
        if self.0.is_empty() { Ok(read) } else { Err(Flaw::TooLong(self.0.len())) }
    }
}

impl Tracker {
    /// Returns the object's appearance, as far as it was learned.
    #[must_use]
    pub fn appearance(&self) -> Appearance {
        let (target, cameras) = (&self.target, self.frame.cameras.len());
        Appearance {
            points: target.points.features.iter().filter_map(StoredPoint::of).collect(),
            colors: target.colors.object_shares(),
            reference: target.reference.numbers(cameras),
            views: target.views.all.iter().map(|view| StoredView::of(view, cameras)).collect(),
            offsets: target.offsets.all_known().map(StoredOffset::of).collect(),
            ellipsoids: target.body.ellipsoids().len(),
            is_open: target.relief.is_open,
            misfit: target.relief.misfit(),
            noise_variance: target.points.noise_variance.min(f64::from(second_version::WIDEST)),
            given: target.relief.given().map(stored::orientation),
        }
    }

    /// Restores the appearance of an object, so that it can be found without a pose.
    pub fn recall(&mut self, appearance: &Appearance) {
        let (target, cameras) = (&mut self.target, self.frame.cameras.len());
        target.reference = Reference::of(appearance.reference, cameras);
        let features = appearance.points.iter().filter_map(StoredPoint::feature);
        target.points = Points::of(features.collect());
        target.points.noise_variance = appearance.noise_variance;
        target.views = Views::of(appearance.views.iter().map(|view| view.view(cameras)));
        let is_open = self.settings.depth_from_motion || appearance.is_open;
        let given = appearance.given.map(stored::rotation);
        target.relief = Relief::known(is_open, appearance.misfit, given);
        let ellipsoids = target.body.ellipsoids().len();
        target.offsets = ContourOffsets::unknown(ellipsoids);
        if ellipsoids == appearance.ellipsoids {
            target.offsets.recall(appearance.offsets.iter().map(StoredOffset::offset));
        }
        // Keyframes and running jobs refer to other points.
        target.keyframes = Keyframes::after(&target.keyframes);
        (target.ranges, self.pending, self.evolving) = (Ranges::default(), None, None);
        target.colors = Colors::new(self.settings.local_colors);
        let [grey, rgb] = &appearance.colors;
        target.colors.recall([grey, rgb]);
    }
}
