//! What is stored of a surface point, a view and the boundary: lengths with all their digits, the
//! rest as precisely as images tell it.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::camera::Pyramid;
pub(super) use crate::fitness::SAMPLES;
use crate::fitness::{Patch, SurfacePoint};
use crate::track::target::contour_offsets::Offset;
use crate::track::target::feature::Feature;
use crate::track::target::memory::Memory;
use crate::track::target::shares::Shares;
use crate::track::target::views::{KnownView, Usual};

/// A sample of a template: that many quanta are 1.
pub(super) const QUANTA: f32 = 32_767.0;
/// A share of a colour in a view: that many quanta are 1.
pub(super) const SHARES: f32 = 65_535.0;

/// A surface point with its templates, the one by which it was detected first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StoredPoint {
    pub(super) position: [f64; 3],
    pub(super) normal: [f32; 3],
    pub(super) color: [u8; 3],
    /// Variance of its position along the direction to the camera that detected it.
    pub(super) variance: f64,
    /// Variance of the object's orientation with which it was learned.
    pub(super) drift_variance: f32,
    pub(super) is_from_body: bool,
    pub(super) is_from_motion: bool,
    pub(super) memory: Memory,
    pub(super) templates: Vec<StoredTemplate>,
}

/// A point's look from one side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StoredTemplate {
    pub(super) steps: [f64; 6],
    pub(super) toward: [f32; 3],
    pub(super) patches: [Option<[i16; SAMPLES]>; Pyramid::LEVELS],
}

/// A side from which the object was seen.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StoredView {
    /// Orientation of the first camera in the object's frame, as (w, x, y, z).
    pub(super) object_from_camera: [f32; 4],
    pub(super) toward: [f32; 3],
    /// The usual ratio inside the outline as a share of that of the colours, agreement of the
    /// outline, and for one camera the support, and the numbers of points that were recognised and
    /// that had the contrast of a pattern.
    pub(super) usual: [f32; 5],
    /// Bins of colours and their shares in quanta, in grey images and in others.
    pub(super) colors: [Vec<(u16, u16)>; 2],
}

/// Where the object's boundary is in a cell of the body's surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StoredOffset {
    pub(super) cell: u32,
    pub(super) mean: f32,
    pub(super) variance: f32,
    pub(super) at: [f32; 3],
    pub(super) given: bool,
}

impl StoredPoint {
    /// Returns what is stored of a feature; none if a number of it is not finite.
    pub(super) fn of(feature: &Feature) -> Option<Self> {
        let point = &feature.point;
        let out = Self {
            position: point.position.into(),
            normal: single(&point.normal),
            color: point.color,
            variance: feature.variance,
            drift_variance: feature.drift_variance as f32,
            is_from_body: feature.is_from_body,
            is_from_motion: feature.is_from_motion,
            memory: feature.memory(),
            templates: feature.templates().map(StoredTemplate::of).collect(),
        };
        out.is_finite().then_some(out)
    }

    fn is_finite(&self) -> bool {
        let Self { position, normal, variance, drift_variance, templates, .. } = self;
        let [seen, agreed, proved] = self.memory.numbers();
        let singles = [*drift_variance, seen, agreed, proved];
        let looks = |one: &StoredTemplate| {
            one.steps.iter().all(|x| x.is_finite()) && one.toward.iter().all(|x| x.is_finite())
        };
        position.iter().chain([variance]).all(|x| x.is_finite())
            && normal.iter().chain(&singles).all(|x| x.is_finite())
            && templates.iter().all(looks)
    }

    /// Makes a feature of it.
    pub(super) fn feature(&self) -> Option<Feature> {
        let mut points = self.templates.iter().map(|template| self.point(template));
        let mut feature = Feature::new(points.next()?, self.variance);
        points.for_each(|further| feature.add_template(further));
        feature.drift_variance = self.drift_variance.into();
        (feature.is_from_body, feature.is_from_motion) = (self.is_from_body, self.is_from_motion);
        feature.remember(&self.memory);
        Some(feature)
    }

    fn point(&self, template: &StoredTemplate) -> SurfacePoint {
        let [a, b, c, d, e, f] = template.steps;
        let patch = |quanta: [i16; SAMPLES]| quanta.map(|one| f32::from(one) / QUANTA);
        SurfacePoint {
            position: self.position.into(),
            normal: double(self.normal),
            steps: [Vector3::new(a, b, c), Vector3::new(d, e, f)],
            toward: double(template.toward),
            templates: template.patches.map(|one| one.map(patch)),
            color: self.color,
        }
    }
}

impl StoredTemplate {
    pub(super) fn of(point: &SurfacePoint) -> Self {
        let [right, down] = point.steps;
        let quanta = |patch: Patch| patch.map(|sample| (sample * QUANTA).round() as i16);
        Self {
            steps: [right.x, right.y, right.z, down.x, down.y, down.z],
            toward: single(&point.toward),
            patches: point.templates.map(|one| one.map(quanta)),
        }
    }
}

impl StoredView {
    /// Returns what is stored of a view, with the points that each of `cameras` recognised.
    pub(super) fn of(view: &KnownView, cameras: usize) -> Self {
        let Usual { inside, outline, support, recognised, textured } = view.usual;
        let each = 1.0 / cameras as f64;
        let usual = [inside, outline, support * each, recognised * each, textured * each];
        let quanta = |share: f32| (share * SHARES).round() as u16;
        let colors =
            |all: &Shares| all.0.iter().map(|&(bin, share)| (bin as u16, quanta(share))).collect();
        Self {
            object_from_camera: orientation(view.object_from_camera),
            toward: single(&view.toward),
            usual: usual.map(|x| x as f32),
            colors: view.colors.each_ref().map(colors),
        }
    }

    /// Makes a view of it, for other cameras.
    pub(super) fn view(&self, cameras: usize) -> KnownView {
        let [inside, outline, support, recognised, textured] = self.usual.map(f64::from);
        let all = cameras as f64;
        let share = |&(bin, quanta): &(u16, u16)| (u32::from(bin), f32::from(quanta) / SHARES);
        let colors = |all: &Vec<(u16, u16)>| Shares(all.iter().map(share).collect());
        KnownView {
            object_from_camera: rotation(self.object_from_camera),
            toward: double(self.toward),
            usual: Usual {
                inside,
                outline,
                support: support * all,
                recognised: recognised * all,
                textured: textured * all,
            },
            colors: self.colors.each_ref().map(colors),
        }
    }
}

impl StoredOffset {
    pub(super) fn of((cell, offset): (usize, &Offset)) -> Self {
        Self {
            cell: cell as u32,
            mean: offset.mean as f32,
            variance: offset.variance as f32,
            at: single(&offset.at),
            given: offset.given,
        }
    }

    pub(super) fn offset(&self) -> (usize, Offset) {
        let offset = Offset {
            mean: self.mean.into(),
            variance: self.variance.into(),
            at: double(self.at),
            given: self.given,
        };
        (self.cell as usize, offset)
    }
}

/// Returns a rotation as (w, x, y, z).
pub(super) fn orientation(rotation: UnitQuaternion<f64>) -> [f32; 4] {
    let turn = rotation.into_inner().coords;
    [turn.w, turn.x, turn.y, turn.z].map(|x| x as f32)
}

/// Returns the rotation of (w, x, y, z).
pub(super) fn rotation(orientation: [f32; 4]) -> UnitQuaternion<f64> {
    let [w, x, y, z] = orientation.map(f64::from);
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

pub(super) fn single(vector: &Vector3<f64>) -> [f32; 3] {
    [vector.x, vector.y, vector.z].map(|x| x as f32)
}

fn double(vector: [f32; 3]) -> Vector3<f64> {
    vector.map(f64::from).into()
}
