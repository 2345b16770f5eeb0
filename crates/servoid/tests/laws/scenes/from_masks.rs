//! Poses of bodies from masks.

use nalgebra::Vector3;
use servoid::track::TrackError;

use super::Sense::AtMost;
use super::{Figures, MISSED, Measure, OFF, Scene, TURNED, apart};
use crate::from_masks::{bar, body, drawn, hand, placed, somewhere};

const PLACED: &[Measure] = &[OFF, TURNED];

pub const SCENES: &[Scene] = &[
    Scene { name: "placing in two masks", measures: &[MISSED, OFF, TURNED], run: two_masks },
    Scene { name: "placing in one mask", measures: PLACED, run: one_mask },
    Scene {
        name: "placing what does not fit",
        measures: &[("placed", "courses", AtMost), ("overlap", "1", AtMost)],
        run: what_does_not_fit,
    },
    Scene { name: "placing by colours", measures: &[("axis off", "deg", AtMost)], run: by_colours },
];

fn two_masks(seed: u64) -> Figures {
    let truth = somewhere(seed as usize);
    let found = placed(&hand(), &drawn(&hand().at(truth)), seed).unwrap();
    let (off, turned) = apart(&truth, &found.world_from_object);
    vec![("missed", 1.0 - found.iou), ("off", off), ("turned", turned)]
}

fn one_mask(seed: u64) -> Figures {
    let truth = somewhere(seed as usize);
    let found = placed(&hand(), &drawn(&hand().at(truth))[..1], seed).unwrap();
    let (off, turned) = apart(&truth, &found.world_from_object);
    vec![("off", off), ("turned", turned)]
}

/// The bar's outline is the same after half a rotation: its colours distinguish its ends.
fn by_colours(seed: u64) -> Figures {
    let truth = somewhere(seed as usize);
    let found = placed(&bar(), &drawn(&bar().at(truth)), seed).unwrap().world_from_object;
    let [one, other] = [truth, found].map(|pose| pose.rotation() * Vector3::x());
    vec![("axis off", one.angle(&other).to_degrees())]
}

/// A ball is sought in the masks of a rod.
fn what_does_not_fit(seed: u64) -> Figures {
    let (ball, rod) = (body(&[([0.0; 3], [0.05; 3])]), body(&[([0.0; 3], [0.08, 0.006, 0.006])]));
    let (placed, overlap) = match placed(&ball, &drawn(&rod.at(somewhere(seed as usize))), seed) {
        Err(TrackError::Unfit(iou)) => (0.0, iou),
        found => (1.0, found.unwrap().iou),
    };
    vec![("placed", placed), ("overlap", overlap)]
}
