//! The model of the tracked object.

pub(super) mod bias;
pub(super) mod colors;
pub(super) mod contour_offsets;
pub(super) mod feature;
pub(super) mod keyframes;
pub(super) mod known_view;
pub(super) mod look;
mod loops;
mod other_light;
pub(super) mod points;
pub(super) mod ranges;
pub(super) mod record;
pub(super) mod reference;
pub(super) mod relief;
pub(super) mod shift;
pub(super) mod sides;
pub(super) mod sighting;
pub(super) mod solid;
pub(super) mod thumbnail;
mod turn_drift;

use self::bias::Bias;
use self::colors::Colors;
use self::contour_offsets::ContourOffsets;
use self::keyframes::Keyframes;
use self::known_view::KnownView;
use self::points::Points;
use self::ranges::Ranges;
use self::reference::Reference;
use self::relief::Relief;
use self::sides::Sides;
use self::solid::Solid;
use crate::camera::Channels;
use crate::model::Attempt;
use crate::shape::Body;
use crate::track::adjust::outlined::Outlined;
use crate::track::settings::TrackSettings;

/// All that is known of the object: its shape, its appearance, and how well it is recognised while
/// it is tracked.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub(super) body: Body,
    /// The body, prepared for outlines and rays.
    pub(super) solid: Solid,
    pub(super) points: Points,
    pub(super) relief: Relief,
    pub(super) ranges: Ranges,
    pub(super) colors: Colors,
    pub(super) keyframes: Keyframes,
    /// Views that were recalled; its frame is theirs.
    pub(super) recalled: Vec<KnownView>,
    pub(super) sides: Sides,
    pub(super) reference: Reference,
    pub(super) bias: Bias,
    pub(super) offsets: ContourOffsets,
    pub(super) outlined: Outlined,
    /// The last attempt to add an ellipsoid, if it was in vain; not saved with what is known.
    pub(super) vain_growth: Option<Attempt>,
}

impl Target {
    /// Starts with a body of which nothing else is known.
    pub(super) fn new(body: &Body, settings: &TrackSettings) -> Self {
        let solid = Solid::new(body);
        Self {
            body: body.clone(),
            bias: Bias::unknown(solid.radius),
            offsets: ContourOffsets::unknown(body.ellipsoids().len()),
            solid,
            points: Points::default(),
            relief: Relief::new(settings.depth_from_motion, settings.is_of_one_look()),
            ranges: Ranges::default(),
            colors: Colors::new(settings.local_colors),
            keyframes: Keyframes::default(),
            recalled: Vec::new(),
            sides: Sides::default(),
            reference: Reference::default(),
            outlined: Outlined::default(),
            vain_growth: None,
        }
    }

    /// Returns whether anything is known of the object's appearance.
    pub(super) fn has_appearance(&self) -> bool {
        let colors = [Channels::Grey, Channels::Rgb].map(|kind| self.colors.know_object(kind));
        colors.contains(&true) || self.colors.are_known() || !self.points.features.is_empty()
    }
}
