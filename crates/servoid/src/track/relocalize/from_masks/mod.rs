//! Estimates the pose of a known body from masks.

mod climbing;
mod painted;
mod turns;

use crate::parallel::*;

use self::climbing::{FIRST, Fit, LAST};
use self::painted::Painted;
use crate::camera::{ImageView, RigError, View, check_image_size};
use crate::pose::Pose;
use crate::shape::Body;
use crate::track::TrackError;
use crate::track::target::solid::Solid;

/// A pose, and how well the outlines there agree with the masks: intersection over union.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaskFit {
    /// The pose of the object in the world.
    pub world_from_object: Pose,
    /// Mean intersection over union in the masks.
    pub iou: f64,
}

/// Size of the object in pixels, along its longer side, for trying orientations, and for the final
/// refinement.
const COARSE_PX: usize = 48;
const FINE_PX: usize = 160;
/// Orientations that are tried, and the number of them that are refined.
const TURNS: usize = 1500;
const KEPT: usize = 32;
/// Least angle between those that are kept, in radians.
const TURNS_APART: f64 = 0.3;
/// Difference in overlap below which colours decide between poses.
const ALIKE: f64 = 0.05;
/// Difference in overlap and colours up to which two poses fit about as well, and the rotation from
/// which on they are two, in radians.
const AS_GOOD: f64 = 0.02;
const OTHER_RAD: f64 = 0.35;
/// Least overlap of a body that fits.
const LEAST_IOU: f64 = 0.5;

/// Finds the pose at which a body's outlines agree with masks; the pose stored in the body is
/// ignored. Orientations that outlines alone do not distinguish are distinguished by `colors`, one
/// per ellipsoid, if `images` are given too, one per view. The same seed gives the same bits.
///
/// # Errors
/// If there is no view, there is not one image per view or one colour per ellipsoid, or the overlap
/// is below a half at any pose.
pub fn pose_from_masks(
    body: &Body,
    views: &[View<'_>],
    images: Option<&[ImageView<'_>]>,
    colors: Option<&[[u8; 3]]>,
    seed: u64,
) -> Result<MaskFit, TrackError> {
    poses_from_masks(body, views, images, colors, seed).map(|found| found[0])
}

/// Finds all poses at which a body's outlines agree with masks about as well as at the best one,
/// which comes first, and that are turned from each other by 20 degrees or more: masks alone often
/// do not distinguish two sides of a box, and never how a body of revolution is turned.
///
/// # Errors
/// As for [`pose_from_masks`].
pub fn poses_from_masks(
    body: &Body,
    views: &[View<'_>],
    images: Option<&[ImageView<'_>]>,
    colors: Option<&[[u8; 3]]>,
    seed: u64,
) -> Result<Vec<MaskFit>, TrackError> {
    check(body, views, images, colors)?;
    let solid = Solid::new(body);
    let coarse = Fit::new(&solid, views, COARSE_PX)?;
    let main = views.iter().max_by_key(|view| view.mask().area_px()).ok_or(TrackError::NoMask)?;
    let tried: Vec<_> = turns::spread(TURNS, seed)
        .into_par_iter()
        .map(|turn| coarse.scored(turns::centred(&solid, turn, main)))
        .map(|one| (one.iou, one))
        .collect();
    let kept = turns::best_apart(tried, KEPT, TURNS_APART);
    let better: Vec<_> = kept.par_iter().map(|one| coarse.climbed(one, &FIRST)).collect();
    let best = better.iter().map(|one| one.iou).fold(0.0, f64::max);
    if best < LEAST_IOU {
        return Err(TrackError::Unfit(best));
    }
    let alike: Vec<_> = better.into_iter().filter(|one| one.iou > best - ALIKE).collect();
    let fine = Fit::new(&solid, views, FINE_PX)?;
    let sharp: Vec<_> = alike.par_iter().map(|one| fine.climbed(one, &LAST)).collect();
    let painted = images.zip(colors).map(|(images, colors)| Painted::new(views, images, colors));
    let worth = |one: &MaskFit| {
        one.iou + painted.as_ref().map_or(0.0, |painted| painted.agreement(&solid, one))
    };
    // Of equals, the last one is used.
    let mut rated: Vec<_> = sharp.into_iter().rev().map(|one| (worth(&one), one)).collect();
    let highest = rated.iter().map(|(worth, _)| *worth).fold(f64::NEG_INFINITY, f64::max);
    rated.retain(|(worth, _)| *worth >= highest - AS_GOOD);
    let found = turns::best_apart(rated, KEPT, OTHER_RAD);
    if found.is_empty() { Err(TrackError::NoMask) } else { Ok(found) }
}

fn check(
    body: &Body,
    views: &[View<'_>],
    images: Option<&[ImageView<'_>]>,
    colors: Option<&[[u8; 3]]>,
) -> Result<(), TrackError> {
    if let Some(images) = images {
        let (cameras, given) = (views.len(), images.len());
        if cameras != given {
            return Err(RigError::Count { what: "images", cameras, given }.into());
        }
        for (index, (view, image)) in views.iter().zip(images).enumerate() {
            check_image_size(index, view.camera().size_px(), *image)?;
        }
    }
    let ellipsoids = body.ellipsoids().len();
    match colors {
        Some(colors) if colors.len() != ellipsoids => {
            Err(TrackError::Colors { ellipsoids, given: colors.len() })
        }
        _ => Ok(()),
    }
}
