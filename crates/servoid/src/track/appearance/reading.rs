//! Reads an appearance that was written, by this version or an earlier one.

use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector2, Vector3};

use super::checks::{check, within};
use super::{Appearance, FIRST, NAME, NEWEST};
use crate::camera::Pyramid;
use crate::fitness::{Patch, SurfacePoint};
use crate::track::TrackError;
use crate::track::target::colors::{Colors, Shares};
use crate::track::target::feature::{Feature, MOST_FURTHER, Texture};
use crate::track::target::keyframes::MOST_KEYFRAMES;
use crate::track::target::known_view::KnownView;
use crate::track::target::record::Record;
use crate::track::target::thumbnail::{MOST_SIDE, Thumbnail};

/// Most points and most colours that are read.
const MOST_ENTRIES: usize = 100_000;

impl Appearance {
    /// Reads what [`Appearance::to_bytes`] wrote, or an earlier version of it.
    ///
    /// # Errors
    /// If the bytes are not an appearance, are of a later version, are cut short, or contain a
    /// number that is not finite or impossible, such as a negative variance.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, TrackError> {
        let mut reader = Reader { rest: bytes, length: bytes.len(), knows_all: true };
        if reader.take()? != *NAME {
            return Err(reader.unreadable());
        }
        match reader.byte()? {
            FIRST => reader.knows_all = false,
            NEWEST => {}
            other if other.is_ascii_digit() => return Err(TrackError::Newer(other - b'0')),
            _ => return Err(reader.unreadable()),
        }
        let read = reader.appearance()?;
        if !reader.rest.is_empty() {
            return Err(reader.unreadable());
        }
        check(&read)?;
        Ok(read)
    }
}

/// The bytes not read yet.
struct Reader<'a> {
    rest: &'a [u8],
    /// The number of all bytes.
    length: usize,
    /// Whether they are of a version that holds all that is known, not only the points' first
    /// templates and the newest colours.
    knows_all: bool,
}

impl Reader<'_> {
    fn appearance(&mut self) -> Result<Appearance, TrackError> {
        let grey = self.flag()?;
        let points = self.count("the number of points", MOST_ENTRIES)?;
        let colors = self.count("the number of colours", MOST_ENTRIES)?;
        let views =
            if self.knows_all { self.count("the number of views", MOST_KEYFRAMES)? } else { 0 };
        Ok(Appearance {
            reference: self.numbers()?,
            colors: self.shares(grey, colors)?,
            points: (0..points).map(|_| self.feature()).collect::<Result<_, _>>()?,
            views: (0..views).map(|_| self.view()).collect::<Result<_, _>>()?,
        })
    }

    fn shares(&mut self, grey: bool, count: usize) -> Result<Shares, TrackError> {
        let share = |reader: &mut Self| {
            let bin = reader.whole()?;
            if !Colors::holds(bin as usize) {
                return Err(reader.unreadable());
            }
            Ok((bin, reader.single()?))
        };
        let bins = (0..count).map(|_| share(self)).collect::<Result<_, TrackError>>()?;
        Ok(Shares { grey, bins })
    }

    fn feature(&mut self) -> Result<Feature, TrackError> {
        let position = self.vector()?;
        let mut point = self.template(position)?;
        let variance = self.number()?;
        point.color = self.take()?;
        self.patches(&mut point)?;
        let mut feature = Feature::new(point, variance);
        if !self.knows_all {
            return Ok(feature);
        }
        feature.is_from_body = self.flag()?;
        feature.is_from_motion = self.flag()?;
        feature.slides = self.flag()?;
        [feature.drift_variance, feature.proved] = self.numbers()?;
        feature.record = Record { seen: self.single()?, agreed: self.single()? };
        feature.texture =
            Texture { images: self.whole()?, showed: self.whole()?, turned: self.whole()? };
        let further = usize::from(self.byte()?);
        within("the number of further templates of a point", further, MOST_FURTHER)?;
        for _ in 0..further {
            let mut other = self.template(position)?;
            other.color = feature.point.color;
            self.patches(&mut other)?;
            feature.further.push(other);
        }
        Ok(feature)
    }

    /// Reads the directions of a template of a point at a position.
    fn template(&mut self, position: Vector3<f64>) -> Result<SurfacePoint, TrackError> {
        Ok(SurfacePoint {
            position,
            normal: self.vector()?,
            steps: [self.vector()?, self.vector()?],
            toward: self.vector()?,
            templates: [None; Pyramid::LEVELS],
            color: [0; 3],
        })
    }

    fn patches(&mut self, point: &mut SurfacePoint) -> Result<(), TrackError> {
        for template in &mut point.templates {
            let is_there = self.flag()?;
            let mut patch = Patch::default();
            for sample in &mut patch {
                *sample = self.single()?;
            }
            *template = is_there.then_some(patch);
        }
        Ok(())
    }

    fn view(&mut self) -> Result<KnownView, TrackError> {
        let [w, i, j, k] = self.numbers()?;
        let object_from_camera: UnitQuaternion<f64> =
            Unit::new_unchecked(Quaternion::new(w, i, j, k));
        let is_seen = self.flag()?;
        let eye = Some(self.vector()?).filter(|_| is_seen);
        let thumbnail = if self.flag()? { Some(self.thumbnail()?) } else { None };
        Ok(KnownView { object_from_camera, eye, thumbnail })
    }

    fn thumbnail(&mut self) -> Result<Thumbnail, TrackError> {
        let size = [self.byte()?, self.byte()?].map(usize::from);
        let [cell_px, u, v, depth] = self.numbers()?;
        let most = MOST_SIDE * MOST_SIDE;
        let count = self.count("the number of cells of a thumbnail", most)?;
        let cell = |reader: &mut Self| {
            let [column, row] = [reader.byte()?, reader.byte()?].map(usize::from);
            Ok((column, row, reader.single()?))
        };
        let cells = (0..count).map(|_| cell(self)).collect::<Result<_, TrackError>>()?;
        Ok(Thumbnail { size, cell_px, origin: Vector2::new(u, v), depth, cells })
    }

    fn unreadable(&self) -> TrackError {
        TrackError::Appearance(self.length)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], TrackError> {
        let (taken, rest) =
            self.rest.split_first_chunk::<N>().ok_or(TrackError::Appearance(self.length))?;
        self.rest = rest;
        Ok(*taken)
    }

    fn byte(&mut self) -> Result<u8, TrackError> {
        let [byte] = self.take()?;
        Ok(byte)
    }

    /// Reads whether something is there.
    fn flag(&mut self) -> Result<bool, TrackError> {
        let byte = self.byte()?;
        if byte < 2 { Ok(byte == 1) } else { Err(self.unreadable()) }
    }

    fn count(&mut self, what: &'static str, most: usize) -> Result<usize, TrackError> {
        let count = self.whole()? as usize;
        within(what, count, most)?;
        Ok(count)
    }

    fn whole(&mut self) -> Result<u32, TrackError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn number(&mut self) -> Result<f64, TrackError> {
        let number = f64::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(self.unreadable()) }
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f64; N], TrackError> {
        let mut all = [0.0; N];
        for number in &mut all {
            *number = self.number()?;
        }
        Ok(all)
    }

    fn vector(&mut self) -> Result<Vector3<f64>, TrackError> {
        Ok(Vector3::from(self.numbers::<3>()?))
    }

    fn single(&mut self) -> Result<f32, TrackError> {
        let number = f32::from_le_bytes(self.take()?);
        if number.is_finite() { Ok(number) } else { Err(self.unreadable()) }
    }
}
