//! Writes an appearance as little-endian numbers, as described in `docs/formats.md`.

use nalgebra::Vector3;

use super::{Appearance, NAME, NEWEST};
use crate::fitness::{Patch, SurfacePoint};
use crate::track::target::colors::Shares;
use crate::track::target::feature::{Feature, Texture};
use crate::track::target::known_view::KnownView;
use crate::track::target::thumbnail::Thumbnail;

/// The bytes written so far.
struct Writer(Vec<u8>);

impl Appearance {
    /// Writes the appearance as little-endian numbers, as described in `docs/formats.md`.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Writer([NAME.as_slice(), &[NEWEST]].concat());
        out.byte(u8::from(self.colors.grey));
        for count in [self.points.len(), self.colors.bins.len(), self.views.len()] {
            out.count(count);
        }
        self.reference.iter().for_each(|x| out.number(*x));
        out.shares(&self.colors);
        self.points.iter().for_each(|one| out.feature(one));
        self.views.iter().for_each(|one| out.view(one));
        out.0
    }
}

impl Writer {
    fn byte(&mut self, byte: u8) {
        self.0.push(byte);
    }

    fn count(&mut self, count: usize) {
        self.0.extend((count as u32).to_le_bytes());
    }

    fn number(&mut self, number: f64) {
        self.0.extend(number.to_le_bytes());
    }

    fn single(&mut self, number: f32) {
        self.0.extend(number.to_le_bytes());
    }

    fn vector(&mut self, vector: &Vector3<f64>) {
        vector.iter().for_each(|x| self.number(*x));
    }

    /// Writes whether something is there.
    fn flag(&mut self, is_there: bool) {
        self.byte(u8::from(is_there));
    }

    fn shares(&mut self, shares: &Shares) {
        for (bin, share) in &shares.bins {
            self.0.extend(bin.to_le_bytes());
            self.single(*share);
        }
    }

    fn feature(&mut self, feature: &Feature) {
        let SurfacePoint { position, normal, steps: [right, down], toward, .. } = &feature.point;
        [position, normal, right, down, toward].iter().for_each(|one| self.vector(one));
        self.number(feature.variance);
        self.0.extend(feature.point.color);
        self.patches(&feature.point);
        [feature.is_from_body, feature.is_from_motion, feature.slides]
            .iter()
            .for_each(|one| self.flag(*one));
        self.number(feature.drift_variance);
        self.number(feature.proved);
        self.single(feature.record.seen);
        self.single(feature.record.agreed);
        let Texture { images, showed, turned } = feature.texture;
        [images, showed, turned].iter().for_each(|count| self.0.extend(count.to_le_bytes()));
        self.byte(feature.further.len() as u8);
        for other in &feature.further {
            let SurfacePoint { normal, steps: [right, down], toward, .. } = other;
            [normal, right, down, toward].iter().for_each(|one| self.vector(one));
            self.patches(other);
        }
    }

    fn patches(&mut self, point: &SurfacePoint) {
        for patch in &point.templates {
            self.flag(patch.is_some());
            let patch: Patch = patch.unwrap_or_default();
            patch.iter().for_each(|x| self.single(*x));
        }
    }

    fn view(&mut self, view: &KnownView) {
        let turn = view.object_from_camera.quaternion();
        [turn.w, turn.i, turn.j, turn.k].iter().for_each(|x| self.number(*x));
        self.flag(view.eye.is_some());
        self.vector(&view.eye.unwrap_or_default());
        self.flag(view.thumbnail.is_some());
        if let Some(thumbnail) = &view.thumbnail {
            self.thumbnail(thumbnail);
        }
    }

    fn thumbnail(&mut self, thumbnail: &Thumbnail) {
        let Thumbnail { size, cell_px, origin, depth, cells } = thumbnail;
        size.iter().for_each(|count| self.byte(*count as u8));
        [*cell_px, origin.x, origin.y, *depth].iter().for_each(|x| self.number(*x));
        self.count(cells.len());
        for (column, row, brightness) in cells {
            [column, row].iter().for_each(|at| self.byte(**at as u8));
            self.single(*brightness);
        }
    }
}
