//! Reads the first version, which held one template of each point and nothing of its record.

use super::bytes::Reader;
use super::stored::{QUANTA, SAMPLES, StoredPoint, StoredTemplate};
use super::{Appearance, Flaw};
use crate::camera::Pyramid;
use crate::track::target::colors::Colors;
use crate::track::target::memory::Memory;
use crate::track::target::reference::Reference;
use crate::track::target::shares::Shares;

/// First bytes: a name and the version.
pub(super) const MAGIC: &[u8; 8] = b"servoap1";
/// Most points and most colours that are read.
const MOST_ENTRIES: usize = 100_000;
/// Bytes of a colour, and of a point.
const COLOR_BYTES: usize = 8;
const POINT_BYTES: usize = 16 * 8 + 3 + Pyramid::LEVELS * (1 + 4 * SAMPLES);

pub(super) fn read(reader: &mut Reader<'_>) -> Result<Appearance, Flaw> {
    let [grey] = reader.flags()?;
    let points = reader.count("surface points", (MOST_ENTRIES, POINT_BYTES))?;
    let colors = reader.count("colours", (MOST_ENTRIES, COLOR_BYTES))?;
    let numbers = reader.numbers::<{ Reference::FIRST_NUMBERS }>()?;
    let color = |reader: &mut Reader<'_>| {
        let bin = reader.whole()?;
        let share = reader.single()?;
        if Colors::holds(bin as usize) { Ok((bin, share)) } else { Err(Flaw::Outside("colour")) }
    };
    let known = (0..colors).map(|_| color(reader)).collect::<Result<_, _>>().map(Shares)?;
    let points = (0..points).map(|_| point(reader)).collect::<Result<_, _>>()?;
    let colors = if grey { [known, Shares::default()] } else { [Shares::default(), known] };
    let reference = Reference::complete(numbers);
    Ok(Appearance { points, colors, reference, ..Appearance::default() })
}

fn point(reader: &mut Reader<'_>) -> Result<StoredPoint, Flaw> {
    let [px, py, pz, nx, ny, nz] = reader.numbers()?;
    let steps = reader.numbers()?;
    let [tx, ty, tz, variance] = reader.numbers()?;
    let color = reader.take()?;
    let mut patches = [None; Pyramid::LEVELS];
    for patch in &mut patches {
        let [is_there] = reader.flags()?;
        let samples = reader.singles::<SAMPLES>()?;
        *patch = is_there.then(|| samples.map(|sample| (sample * QUANTA).round() as i16));
    }
    let toward = [tx, ty, tz].map(|x| x as f32);
    Ok(StoredPoint {
        position: [px, py, pz],
        normal: [nx, ny, nz].map(|x| x as f32),
        color,
        variance,
        drift_variance: 0.0,
        is_from_body: false,
        is_from_motion: false,
        memory: Memory::default(),
        templates: vec![StoredTemplate { steps, toward, patches }],
    })
}
