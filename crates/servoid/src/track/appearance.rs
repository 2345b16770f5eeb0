use nalgebra::Vector3;

use super::TrackError;
use super::motion::held_back::HeldBack;
use super::target::colors::Colors;
use super::target::keyframes::Keyframes;
use super::target::points::{Feature, Points};
use super::target::ranges::Ranges;
use super::target::reference::Reference;
use super::tracker::Tracker;
use crate::camera::Pyramid;
use crate::fitness::{Patch, SurfacePoint};
use crate::words::Digits;

/// The appearance of an object, apart from its shape: the learned surface points with the variance
/// of each, the shares of its colours, and its reference quality.
///
/// It is expressed in the object's frame, so it can be used wherever the object is seen again.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Appearance {
    points: Vec<(SurfacePoint, f64)>,
    /// Bins of colours and their shares; grey images have other bins.
    colors: Vec<(u32, f32)>,
    grey: bool,
    reference: [f64; Reference::NUMBERS],
}

/// First bytes of a written appearance: a name and the version.
const MAGIC: &[u8; 8] = b"servoap1";
/// Numbers of 8 bytes per point besides its colour and templates.
const NUMBERS: usize = 16;
/// Most points and most colours that are read.
const MOST_ENTRIES: usize = 100_000;
/// By how much lengths of unit vectors and shares may be off.
const ROUNDED: f64 = 1e-3;
/// Radii of a body from its origin within which points of its surface are; learned ones reach 1.
const FARTHEST: f64 = 10.0;

impl Appearance {
    /// Returns the number of surface points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.points.len()
    }

    /// Writes the appearance as little-endian numbers, as described in `docs/formats.md`.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = MAGIC.to_vec();
        out.push(u8::from(self.grey));
        for count in [self.points.len(), self.colors.len()] {
            out.extend((count as u32).to_le_bytes());
        }
        self.reference.iter().for_each(|x| out.extend(x.to_le_bytes()));
        for (bin, share) in &self.colors {
            out.extend(bin.to_le_bytes());
            out.extend(share.to_le_bytes());
        }
        for (point, variance) in &self.points {
            let [right, down] = &point.steps;
            for vector in [&point.position, &point.normal, right, down, &point.toward] {
                vector.iter().for_each(|x| out.extend(x.to_le_bytes()));
            }
            out.extend(variance.to_le_bytes());
            out.extend(point.color);
            for template in &point.templates {
                out.push(u8::from(template.is_some()));
                template.unwrap_or_default().iter().for_each(|x| out.extend(x.to_le_bytes()));
            }
        }
        out
    }

    /// Reads what [`Appearance::to_bytes`] wrote.
    ///
    /// # Errors
    /// If the bytes are not an appearance, are cut short, or contain a number that is not finite or
    /// impossible, such as a negative variance.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrackError> {
        let mut reader = Reader(bytes);
        let read = reader.read().ok_or(TrackError::Appearance(bytes.len()))?;
        read.check()?;
        Ok(read)
    }

    fn check(&self) -> Result<(), TrackError> {
        let wrong = |what: &'static str, allowed: &str, given: f64| {
            let (allowed, given) = (allowed.to_string(), Digits(given).to_string());
            Err(TrackError::Impossible { what, allowed, given })
        };
        for (_, share) in &self.colors {
            if !(0.0..=1.0 + ROUNDED as f32).contains(share) {
                return wrong("a colour's share of the object", "0 to 1", f64::from(*share));
            }
        }
        for (point, variance) in &self.points {
            if *variance < 0.0 {
                return wrong("the variance of a point", "0 or more", *variance);
            }
            let directions =
                [("the normal of a point", point.normal), ("the view of a point", point.toward)];
            for (what, direction) in directions {
                if (direction.norm() - 1.0).abs() > ROUNDED {
                    return wrong(what, "a vector of length 1", direction.norm());
                }
            }
        }
        Ok(())
    }
}

/// The bytes not read yet.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn read(&mut self) -> Option<Appearance> {
        if &self.take::<8>()? != MAGIC {
            return None;
        }
        let grey = self.flag()?;
        let counts = [u32::from_le_bytes(self.take()?), u32::from_le_bytes(self.take()?)];
        let [points, colors] = counts.map(|count| count as usize);
        if points > MOST_ENTRIES || colors > MOST_ENTRIES {
            return None;
        }
        let mut reference = [0.0; Reference::NUMBERS];
        for number in &mut reference {
            *number = self.number()?;
        }
        let color = |reader: &mut Self| {
            let bin = u32::from_le_bytes(reader.take()?);
            Some((bin, reader.single()?)).filter(|(bin, _)| Colors::holds(*bin as usize))
        };
        let colors = (0..colors).map(|_| color(self)).collect::<Option<_>>()?;
        let points = (0..points).map(|_| self.point()).collect::<Option<_>>()?;
        self.0.is_empty().then_some(Appearance { points, colors, grey, reference })
    }

    fn point(&mut self) -> Option<(SurfacePoint, f64)> {
        let mut numbers = [0.0; NUMBERS];
        for number in &mut numbers {
            *number = self.number()?;
        }
        let vector = |i: usize| Vector3::from_column_slice(&numbers[3 * i..3 * i + 3]);
        let mut point = SurfacePoint {
            position: vector(0),
            normal: vector(1),
            steps: [vector(2), vector(3)],
            toward: vector(4),
            templates: [None; Pyramid::LEVELS],
            color: self.take()?,
        };
        for template in &mut point.templates {
            let is_there = self.flag()?;
            let mut patch = Patch::default();
            for sample in &mut patch {
                *sample = self.single()?;
            }
            *template = is_there.then_some(patch);
        }
        Some((point, numbers[NUMBERS - 1]))
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*taken)
    }

    fn flag(&mut self) -> Option<bool> {
        let [byte] = self.take::<1>()?;
        (byte < 2).then_some(byte == 1)
    }

    fn number(&mut self) -> Option<f64> {
        Some(f64::from_le_bytes(self.take()?)).filter(|x| x.is_finite())
    }

    fn single(&mut self) -> Option<f32> {
        Some(f32::from_le_bytes(self.take()?)).filter(|x| x.is_finite())
    }
}

impl Tracker {
    /// Returns the object's appearance, as far as it was learned.
    #[must_use]
    pub fn appearance(&self) -> Appearance {
        let points = self.target.points.features.iter().filter(|feature| !feature.is_edgel);
        let points = points.map(|feature| (feature.point, feature.variance));
        let (grey, colors) = self.target.colors.object_shares();
        Appearance {
            points: points.collect(),
            colors,
            grey,
            reference: self.target.reference.numbers(self.frame.cameras.len()),
        }
    }

    /// Restores the appearance of an object, so that it can be found without a pose.
    ///
    /// # Errors
    /// If points of its surface are far outside the body; the tracker is unchanged.
    pub fn recall(&mut self, appearance: &Appearance) -> Result<(), TrackError> {
        let away = appearance.points.iter().map(|(point, _)| point.position.norm());
        let farthest = away.fold(0.0, f64::max) / self.target.solid.radius;
        if farthest > FARTHEST {
            return Err(TrackError::Impossible {
                what: "a point's distance, in radii of the body,",
                allowed: format!("{FARTHEST} or less"),
                given: Digits(farthest).to_string(),
            });
        }
        self.target.reference = Reference::of(appearance.reference, self.frame.cameras.len());
        let feature =
            appearance.points.iter().map(|&(point, variance)| Feature::new(point, variance));
        self.target.points = Points::of(feature.collect());
        // Keyframes and running jobs refer to other points.
        self.target.keyframes = Keyframes::after(&self.target.keyframes);
        (self.target.ranges, self.pending, self.evolving) = (Ranges::default(), None, None);
        self.held_back = HeldBack::default();
        self.look_alikes.forget();
        self.target.colors = Colors::new(self.settings.local_colors);
        self.target.colors.recall(&appearance.colors, appearance.grey);
        self.relocalizer.forget_light();
        Ok(())
    }
}
