//! The model of the tracked object.

pub(super) mod bias;
pub(super) mod colors;
pub(super) mod contour_offsets;
pub(super) mod feature;
pub(super) mod keyframes;
pub(super) mod memory;
pub(super) mod points;
pub(super) mod ranges;
mod record;
pub(super) mod reference;
pub(super) mod relief;
pub(super) mod shares;
pub(super) mod shift;
pub(super) mod sides;
pub(super) mod solid;
mod turn_drift;
pub(super) mod views;

use nalgebra::Vector3;

use self::bias::Bias;
use self::colors::Colors;
use self::contour_offsets::ContourOffsets;
use self::keyframes::Keyframes;
use self::points::Points;
use self::ranges::Ranges;
use self::reference::Reference;
use self::relief::Relief;
use self::sides::Sides;
use self::solid::Solid;
use self::views::Views;
use crate::camera::Channels;
use crate::shape::Body;

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
    pub(super) views: Views,
    pub(super) sides: Sides,
    pub(super) reference: Reference,
    pub(super) bias: Bias,
    pub(super) offsets: ContourOffsets,
}

impl Target {
    /// Starts with a body of which nothing else is known.
    pub(super) fn new(body: &Body, local_colors: bool) -> Self {
        let solid = Solid::new(body);
        Self {
            body: body.clone(),
            bias: Bias::unknown(solid.radius),
            offsets: ContourOffsets::unknown(body.ellipsoids().len()),
            solid,
            points: Points::default(),
            relief: Relief::new(false),
            ranges: Ranges::default(),
            colors: Colors::new(local_colors),
            keyframes: Keyframes::default(),
            views: Views::default(),
            sides: Sides::default(),
            reference: Reference::default(),
        }
    }

    /// Returns the quality that is usual where the object is seen from a direction.
    pub(super) fn usual(&self, toward: &Vector3<f64>) -> Reference {
        self.views.usual(toward, &self.reference)
    }

    /// While the object is sought by views, gives it the colours of one side, or else of all.
    pub(super) fn color(&mut self, toward: Option<&Vector3<f64>>, kinds: &[Channels]) {
        self.views.color(toward, &mut self.colors);
        self.views.foresee(&self.colors, kinds);
    }

    /// Takes what is usual from a direction as the reference: the object was found there.
    pub(super) fn settle(&mut self, toward: &Vector3<f64>) {
        self.reference = self.usual(toward);
        self.views.settle();
    }

    /// Returns whether anything is known of the object's appearance.
    pub(super) fn has_appearance(&self) -> bool {
        let colors = [Channels::Grey, Channels::Rgb].map(|kind| self.colors.know_object(kind));
        colors.contains(&true) || self.colors.are_known() || !self.points.features.is_empty()
    }
}
