//! Writes and reads the second version, as described in `docs/formats.md`.

use super::bytes::{Reader, Writer};
use super::stored::{SAMPLES, StoredOffset, StoredPoint, StoredTemplate, StoredView};
use super::{Appearance, Flaw};
use crate::camera::Pyramid;
use crate::shape::Body;
use crate::track::target::colors::Colors;
use crate::track::target::contour_offsets::ContourOffsets;
use crate::track::target::feature::MOST_FURTHER;
use crate::track::target::memory::Memory;
use crate::track::target::reference::Reference;
use crate::track::target::shares::Shares;
use crate::track::target::views::MOST_VIEWS;

/// First bytes: a name and the version.
pub(super) const MAGIC: &[u8; 8] = b"servoap2";
/// Most points that are read.
const MOST_POINTS: usize = 10_000;
/// Bytes of a colour, of one of a view and of an offset, and the least of a view and of a point.
const COLOR_BYTES: usize = 8;
const VIEW_COLOR_BYTES: usize = 4;
const VIEW_BYTES: usize = 56;
const OFFSET_BYTES: usize = 25;
const LEAST_POINT_BYTES: usize = 134;
/// Largest variance of an orientation, and largest angle, in radians.
pub(super) const WIDEST: f32 = 1e3;

pub(super) fn write(appearance: &Appearance) -> Vec<u8> {
    let Appearance { points, colors, reference, views, offsets, ellipsoids, .. } = appearance;
    let mut writer = Writer::default();
    writer.bytes(MAGIC);
    writer.flags(&[appearance.is_open, appearance.misfit.is_some(), appearance.given.is_some()]);
    writer.count(*ellipsoids);
    writer.numbers(&[appearance.misfit.unwrap_or_default(), appearance.noise_variance]);
    writer.singles(&appearance.given.unwrap_or([1.0, 0.0, 0.0, 0.0]));
    writer.numbers(reference);
    for colors in colors {
        writer.count(colors.0.len());
        for (bin, share) in &colors.0 {
            writer.whole(*bin);
            writer.singles(&[*share]);
        }
    }
    writer.count(views.len());
    for StoredView { object_from_camera, toward, usual, colors } in views {
        writer.singles(object_from_camera);
        writer.singles(toward);
        writer.singles(usual);
        for colors in colors {
            writer.count(colors.len());
            colors.iter().for_each(|&(bin, quanta)| writer.words(&[bin, quanta]));
        }
    }
    writer.count(offsets.len());
    for StoredOffset { cell, mean, variance, at, given } in offsets {
        writer.whole(*cell);
        writer.singles(&[*mean, *variance]);
        writer.singles(at);
        writer.flags(&[*given]);
    }
    writer.count(points.len().min(MOST_POINTS));
    points.iter().take(MOST_POINTS).for_each(|point| write_point(&mut writer, point));
    writer.0
}

fn write_point(writer: &mut Writer, point: &StoredPoint) {
    writer.numbers(&point.position);
    writer.singles(&point.normal);
    writer.bytes(&point.color);
    writer.numbers(&[point.variance]);
    writer.singles(&[point.drift_variance]);
    writer.flags(&[point.is_from_body, point.is_from_motion]);
    writer.singles(&point.memory.numbers());
    point.memory.counts().iter().for_each(|count| writer.whole(*count));
    writer.bytes(&[point.templates.len() as u8]);
    for StoredTemplate { steps, toward, patches } in &point.templates {
        writer.numbers(steps);
        writer.singles(toward);
        writer.flags(&patches.map(|patch| patch.is_some()));
        patches.iter().flatten().for_each(|patch| writer.shorts(patch));
    }
}

pub(super) fn read(reader: &mut Reader<'_>) -> Result<Appearance, Flaw> {
    let [is_open, is_measured, is_given] = reader.flags()?;
    let ellipsoids = reader.whole()? as usize;
    if ellipsoids > Body::MAX_ELLIPSOIDS {
        return Err(Flaw::Outside("number of ellipsoids"));
    }
    let misfit = Some(reader.number()?).filter(|_| is_measured);
    if misfit.is_some_and(|rms| rms < 0.0) {
        return Err(Flaw::Outside("deviation of points from the body"));
    }
    let noise_variance = reader.number()?;
    if !(0.0..=f64::from(WIDEST)).contains(&noise_variance) {
        return Err(Flaw::Outside("noise of the orientation"));
    }
    let given = Some(reader.unit("orientation of the given pose")?).filter(|_| is_given);
    let reference = reader.numbers::<{ Reference::NUMBERS }>()?;
    let colors = [colors(reader)?, colors(reader)?];
    let count = reader.count("views", (MOST_VIEWS, VIEW_BYTES))?;
    let views = (0..count).map(|_| view(reader)).collect::<Result<_, _>>()?;
    let cells = ContourOffsets::cells(ellipsoids);
    let count = reader.count("boundary offsets", (cells, OFFSET_BYTES))?;
    let offsets = (0..count).map(|_| offset(reader, cells)).collect::<Result<_, _>>()?;
    let count = reader.count("surface points", (MOST_POINTS, LEAST_POINT_BYTES))?;
    let points = (0..count).map(|_| point(reader)).collect::<Result<_, _>>()?;
    Ok(Appearance {
        points,
        colors,
        reference,
        views,
        offsets,
        ellipsoids,
        is_open,
        misfit,
        noise_variance,
        given,
    })
}

fn colors(reader: &mut Reader<'_>) -> Result<Shares, Flaw> {
    let count = reader.count("colours of a kind", (Colors::BINS, COLOR_BYTES))?;
    let color = |reader: &mut Reader<'_>| {
        let bin = reader.whole()?;
        if !Colors::holds(bin as usize) {
            return Err(Flaw::Outside("bin of a colour"));
        }
        Ok((bin, reader.upto("share of a colour", 1.0 + 1e-3)?))
    };
    (0..count).map(|_| color(reader)).collect::<Result<_, _>>().map(Shares)
}

fn view(reader: &mut Reader<'_>) -> Result<StoredView, Flaw> {
    Ok(StoredView {
        object_from_camera: reader.unit("orientation of a view")?,
        toward: reader.unit("direction of a view")?,
        usual: usual(reader)?,
        colors: [view_colors(reader)?, view_colors(reader)?],
    })
}

fn usual(reader: &mut Reader<'_>) -> Result<[f32; 5], Flaw> {
    let inside = reader.upto("ratio inside the outline of a view", 1.0)?;
    let outline = reader.upto("agreement of the outline of a view", 1.0)?;
    let support = reader.single()?;
    let most = f32::MAX;
    let recognised = reader.upto("number of points of a view", most)?;
    Ok([inside, outline, support, recognised, reader.upto("number of points of a view", most)?])
}

fn view_colors(reader: &mut Reader<'_>) -> Result<Vec<(u16, u16)>, Flaw> {
    let count = reader.count("colours of a view", (Colors::BINS, VIEW_COLOR_BYTES))?;
    let color = |reader: &mut Reader<'_>| {
        let [bin, quanta] = reader.words()?;
        if Colors::holds(bin.into()) {
            Ok((bin, quanta))
        } else {
            Err(Flaw::Outside("bin of a colour"))
        }
    };
    (0..count).map(|_| color(reader)).collect()
}

fn offset(reader: &mut Reader<'_>, cells: usize) -> Result<StoredOffset, Flaw> {
    let cell = reader.whole()?;
    if cell as usize >= cells {
        return Err(Flaw::Outside("cell of a boundary offset"));
    }
    let mean = reader.single()?;
    let variance = reader.upto("variance of a boundary offset", WIDEST)?;
    let at = reader.unit("place of a boundary offset")?;
    let [given] = reader.flags()?;
    Ok(StoredOffset { cell, mean, variance, at, given })
}

fn point(reader: &mut Reader<'_>) -> Result<StoredPoint, Flaw> {
    let position = reader.numbers()?;
    let normal = reader.unit("normal of a surface point")?;
    let color = reader.take()?;
    let variance = reader.number()?;
    if variance < 0.0 {
        return Err(Flaw::Outside("variance of a surface point"));
    }
    let drift_variance = reader.upto("drift variance of a surface point", WIDEST)?;
    let [is_from_body, is_from_motion] = reader.flags()?;
    let numbers = reader.singles()?;
    let counts = [reader.whole()?, reader.whole()?];
    let memory = Memory::new(numbers, counts).ok_or(Flaw::Outside("record of a surface point"))?;
    let [count] = reader.take::<1>()?;
    if !(1..=1 + MOST_FURTHER).contains(&usize::from(count)) {
        return Err(Flaw::Outside("number of templates of a surface point"));
    }
    let templates = (0..count).map(|_| template(reader)).collect::<Result<_, _>>()?;
    Ok(StoredPoint {
        position,
        normal,
        color,
        variance,
        drift_variance,
        is_from_body,
        is_from_motion,
        memory,
        templates,
    })
}

fn template(reader: &mut Reader<'_>) -> Result<StoredTemplate, Flaw> {
    let steps = reader.numbers()?;
    let toward = reader.unit("direction of a template")?;
    let is_there = reader.flags::<{ Pyramid::LEVELS }>()?;
    let mut patches = [None; Pyramid::LEVELS];
    for (patch, _) in patches.iter_mut().zip(is_there).filter(|(_, is_there)| *is_there) {
        *patch = Some(reader.shorts::<SAMPLES>()?);
    }
    Ok(StoredTemplate { steps, toward, patches })
}
