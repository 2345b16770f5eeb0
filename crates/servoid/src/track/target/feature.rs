use nalgebra::Vector3;

use super::record::Record;
use crate::fitness::SurfacePoint;
use crate::pose::Pose;

/// A surface point with the variance of its distance and its record of matches.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Feature {
    /// Running number of the point: larger ones are newer.
    pub(crate) id: usize,
    pub(crate) point: SurfacePoint,
    /// Its templates from other sides.
    pub(crate) further: Vec<SurfacePoint>,
    /// Those that were recalled, until the object is proved: where more looks count, a wrong side of
    /// an object whose pattern repeats is proved more easily.
    withheld: Vec<SurfacePoint>,
    pub(crate) origin: Origin,
    /// Variance of its position along `toward`, in square metres.
    pub(crate) variance: f64,
    /// Variance of the object's orientation since the first image when the point was detected, in
    /// square radians: it constrains the orientation no better.
    pub(crate) drift_variance: f64,
    /// Whether it is an edgel, a place on an edge: it shows motions across the edge only, and looks
    /// like its neighbours along it, so that it tells nothing of what is seen where.
    pub(crate) is_edgel: bool,
    /// Whether its distance came from the body alone when it was detected.
    pub(crate) is_from_body: bool,
    /// Whether its distance is estimated from motion alone.
    pub(crate) is_from_motion: bool,
    /// Whether it was recognised while nothing showed the orientation: it does not show it, either.
    /// Not saved.
    pub(crate) slides: bool,
    /// Rotation of the object since then, in radians, up to which it was recognised among many
    /// others: it does not slip within that range.
    pub(crate) proved: f64,
    pub(crate) record: Record,
    pub(crate) texture: Texture,
}

impl Feature {
    pub(crate) fn new(point: SurfacePoint, variance: f64) -> Self {
        let (position, toward) = (point.position, point.toward);
        let origin = Origin { keyframe: None, position, toward, variance };
        let (further, withheld, record) = (Vec::new(), Vec::new(), Record::new());
        Self {
            id: 0,
            point,
            further,
            withheld,
            origin,
            variance,
            drift_variance: 0.0,
            is_edgel: false,
            is_from_body: false,
            is_from_motion: false,
            slides: false,
            proved: 0.0,
            record,
            texture: Texture::default(),
        }
    }

    /// Returns it without what ties it to the images in which it was detected.
    pub(crate) fn detached(&self) -> Self {
        let origin = Self::new(self.point, self.variance).origin;
        let further = [&self.further[..], &self.withheld].concat();
        Self { id: 0, origin, further, withheld: Vec::new(), ..self.clone() }
    }

    /// Withholds its templates from other sides.
    pub(crate) fn withhold(&mut self) {
        self.withheld.append(&mut self.further);
    }

    /// Uses the templates that were withheld.
    pub(crate) fn release(&mut self) {
        self.further.append(&mut self.withheld);
    }

    /// Stores the keyframe, at its pose, in which the point was detected, and the variance of the
    /// orientation at that time.
    pub(crate) fn set_origin(&mut self, (keyframe, pose): (usize, &Pose), drift: f64) {
        self.origin.keyframe = Some(keyframe);
        self.origin.position = pose.transform(&self.point.position);
        self.origin.toward = pose.rotation() * self.point.toward;
        self.drift_variance = drift;
    }

    /// Returns one of its templates, at its position.
    pub(crate) fn template(&self, index: usize) -> &SurfacePoint {
        index.checked_sub(1).and_then(|at| self.further.get(at)).unwrap_or(&self.point)
    }

    /// Returns the template that was learned nearest to a viewing direction, and the cosine between
    /// the two.
    pub(crate) fn nearest_template(&self, way: &Vector3<f64>) -> (usize, f64) {
        let mut best = (0, way.dot(&self.point.toward));
        for (at, other) in self.further.iter().enumerate() {
            let like = way.dot(&other.toward);
            if like > best.1 {
                best = (at + 1, like);
            }
        }
        best
    }

    /// Returns whether there is room for another template.
    pub(crate) fn has_room(&self) -> bool {
        self.further.len() < MOST_FURTHER
    }

    /// Adds another template.
    pub(crate) fn add_template(&mut self, mut other: SurfacePoint) {
        other.position = self.point.position;
        self.further.push(other);
    }

    /// Moves it in the object's frame.
    pub(crate) fn move_by(&mut self, motion: &Pose) {
        self.point.move_by(motion);
        let others = self.further.iter_mut().chain(&mut self.withheld);
        others.for_each(|other| other.move_by(motion));
    }

    /// Moves it to a position.
    pub(crate) fn place_at(&mut self, position: Vector3<f64>) {
        self.point.position = position;
        let others = self.further.iter_mut().chain(&mut self.withheld);
        others.for_each(|other| other.position = position);
    }

    /// Returns whether its distance is solved with each pose, because motion is to determine it and
    /// has not yet.
    pub(crate) fn has_free_distance(&self, radius: f64) -> bool {
        self.is_from_motion && self.variance > (WORST * radius).powi(2)
    }

    pub(crate) fn hit_rate(&self) -> f32 {
        self.record.hit_rate()
    }

    /// Records whether it had the contrast of a pattern in an image in which it was recognised, and
    /// whether it showed the rotation that the outline showed least.
    pub(crate) fn note_texture(&mut self, shows: bool, turns: bool) {
        let Texture { images, showed, turned } = &mut self.texture;
        *images = images.saturating_add(1);
        *showed = showed.saturating_add(u32::from(shows));
        *turned = turned.saturating_add(u32::from(turns));
    }

    /// Returns whether it is known to be part of a pattern: it had the contrast of one in most
    /// images, not necessarily in each.
    pub(crate) fn is_printed(&self) -> bool {
        self.texture.is_most(self.texture.showed)
    }

    /// Returns whether it is known to show rotations that the outline does not, as it did so in most
    /// images.
    pub(crate) fn shows_turns(&self) -> bool {
        self.texture.is_most(self.texture.turned)
    }
}

/// Number of images in which a point was recognised, and in which it also had the contrast of a
/// pattern, or showed the rotation that the outline showed least.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Texture {
    pub(crate) images: u32,
    pub(crate) showed: u32,
    pub(crate) turned: u32,
}

impl Texture {
    fn is_most(&self, count: u32) -> bool {
        self.images >= LEAST_LOOKS && count >= self.images.div_ceil(2)
    }
}

/// Images in which a point must be recognised before it may be known as part of a pattern.
const LEAST_LOOKS: u32 = 8;

/// Most templates besides the first.
pub(crate) const MOST_FURTHER: usize = 4;
/// Largest standard deviation of a measured distance of a point, as a share of the body's radius.
pub(crate) const WORST: f64 = 0.05;

/// Position of a point when it was detected, in the world's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Origin {
    /// The keyframe of its view, with which it moves. None for a point that was given.
    pub(crate) keyframe: Option<usize>,
    pub(crate) position: Vector3<f64>,
    pub(crate) toward: Vector3<f64>,
    /// Variance of the position along `toward`, in square metres.
    pub(crate) variance: f64,
}

impl Origin {
    /// Attaches a point to another keyframe if its own was dropped; `moved` maps the object's pose
    /// at its own keyframe to that at the other.
    pub(crate) fn adopt(&mut self, dropped: usize, (heir, moved): (usize, &Pose)) {
        if self.keyframe == Some(dropped) {
            self.keyframe = Some(heir);
            self.position = moved.transform(&self.position);
            self.toward = moved.rotation() * self.toward;
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::camera::Pyramid;

    /// Makes a point in the middle of the object that a camera learned from the front.
    pub(crate) fn feature() -> Feature {
        let point = SurfacePoint {
            position: Vector3::zeros(),
            normal: -Vector3::z(),
            steps: [Vector3::x() * 1e-3, Vector3::y() * 1e-3],
            toward: -Vector3::z(),
            templates: [None; Pyramid::LEVELS],
            color: [0; 3],
        };
        Feature::new(point, 1e-6)
    }

    #[test]
    fn templates_that_are_withheld_are_known_but_not_used_until_they_are_released() {
        let mut known = feature();
        known.add_template(SurfacePoint { toward: Vector3::x(), ..known.point });
        let all = known.clone();
        assert_eq!(known.nearest_template(&Vector3::x()).0, 1);
        known.withhold();
        assert_eq!(known.nearest_template(&Vector3::x()).0, 0);
        assert_eq!(known.detached().further, all.further);
        known.release();
        assert_eq!(known, all);
    }

    #[test]
    fn what_mostly_had_the_contrast_of_a_pattern_is_printed_and_what_had_it_now_and_then_is_not() {
        let (mut print, mut shading) = (feature(), feature());
        for image in 0..40 {
            assert_eq!(print.is_printed(), image >= LEAST_LOOKS, "{image}");
            assert!(!shading.is_printed(), "{image}");
            print.note_texture(image < 20, image % 3 == 0);
            shading.note_texture(image % 5 == 0, image % 3 > 0);
        }
        assert!(print.is_printed(), "half of the images is enough");
        assert!(shading.shows_turns() && !print.shows_turns());
        print.note_texture(false, false);
        assert!(!print.is_printed(), "less is not");
    }
}
