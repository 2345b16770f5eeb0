//! What an object looks like, apart from its shape, as it is stored with a body.

mod checks;
#[cfg(test)]
mod laws;
mod reading;
mod writing;

use super::TrackError;
use super::motion::held_back::HeldBack;
use super::target::colors::{Colors, Shares};
use super::target::feature::Feature;
use super::target::keyframes::Keyframes;
use super::target::known_view::KnownView;
use super::target::points::Points;
use super::target::ranges::Ranges;
use super::target::reference::Reference;
use super::tracker::Tracker;
use crate::words::Digits;

/// The appearance of an object, apart from its shape: the learned surface points with all their
/// templates and how often each was recognised, the shares of its colours, the views from which it
/// was seen, and its reference quality.
///
/// It is expressed in the object's frame, so it can be used wherever the object is seen again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Appearance {
    points: Vec<Feature>,
    colors: Shares,
    views: Vec<KnownView>,
    reference: [f64; Reference::NUMBERS],
}

/// First bytes of a written appearance: a name and the version.
const NAME: &[u8; 7] = b"servoap";
/// The version that is written, and the first one.
const NEWEST: u8 = b'2';
const FIRST: u8 = b'1';
/// Radii of a body from its origin within which points of its surface are; learned ones reach 1.
const FARTHEST: f64 = 10.0;

impl Appearance {
    /// Returns the number of surface points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points.len()
    }
}

impl Tracker {
    /// Returns the object's appearance, as far as it was learned.
    #[must_use]
    pub fn appearance(&self) -> Appearance {
        let points = self.target.points.features.iter().filter(|feature| !feature.is_edgel);
        Appearance {
            points: points.map(Feature::detached).collect(),
            colors: self.target.colors.object_shares(),
            views: self.target.remembered_views(),
            reference: self.target.reference.numbers(self.frame.cameras.len()),
        }
    }

    /// Restores the appearance of an object, so that it can be found without a pose.
    ///
    /// # Errors
    /// If points of its surface are far outside the body; the tracker is unchanged.
    pub fn recall(&mut self, appearance: &Appearance) -> Result<(), TrackError> {
        let away = appearance.points.iter().map(|one| one.point.position.norm());
        let farthest = away.fold(0.0, f64::max) / self.target.solid.radius;
        if farthest > FARTHEST {
            return Err(TrackError::Impossible {
                what: "a point's distance, in radii of the body,",
                allowed: format!("{FARTHEST} or less"),
                given: Digits(farthest).to_string(),
            });
        }
        self.target.reference = Reference::of(appearance.reference, self.frame.cameras.len());
        let mut points = appearance.points.clone();
        points.iter_mut().for_each(Feature::withhold);
        self.target.points = Points::of(points);
        // Keyframes and running jobs refer to other points.
        self.target.keyframes = Keyframes::after(&self.target.keyframes);
        self.target.recalled.clone_from(&appearance.views);
        (self.target.ranges, self.pending, self.evolving) = (Ranges::default(), None, None);
        self.held_back = HeldBack::default();
        self.look_alikes.forget();
        self.target.colors = Colors::new(self.settings.local_colors);
        self.target.colors.recall(&appearance.colors);
        self.relocalizer.forget_light();
        Ok(())
    }
}
