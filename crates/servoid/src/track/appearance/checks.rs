//! Refuses an appearance with numbers that no object has.

use nalgebra::Vector3;

use super::Appearance;
use crate::track::TrackError;
use crate::track::target::colors::Shares;
use crate::track::target::feature::{Feature, Texture};
use crate::track::target::known_view::KnownView;
use crate::track::target::record::Record;
use crate::track::target::thumbnail::{MOST_SIDE, Thumbnail};
use crate::words::Digits;

/// By how much lengths of unit vectors and shares may be off.
const ROUNDED: f64 = 1e-3;

/// Checks all numbers of an appearance.
pub(super) fn check(appearance: &Appearance) -> Result<(), TrackError> {
    check_shares(&appearance.colors)?;
    appearance.points.iter().try_for_each(check_feature)?;
    appearance.views.iter().try_for_each(check_view)
}

/// Checks that a count is no more than the most.
pub(super) fn within(what: &'static str, count: usize, most: usize) -> Result<(), TrackError> {
    if count <= most {
        return Ok(());
    }
    Err(TrackError::Impossible {
        what,
        allowed: format!("{most} or less"),
        given: count.to_string(),
    })
}

fn check_shares(shares: &Shares) -> Result<(), TrackError> {
    let mut all = shares.bins.iter();
    all.try_for_each(|(_, share)| is_share("a colour's share of the object", f64::from(*share)))
}

fn check_feature(feature: &Feature) -> Result<(), TrackError> {
    at_least_zero("the variance of a point", feature.variance)?;
    for point in std::iter::once(&feature.point).chain(&feature.further) {
        is_direction("the normal of a point", &point.normal)?;
        is_direction("the view of a point", &point.toward)?;
    }
    at_least_zero("the drift of a point", feature.drift_variance)?;
    at_least_zero("the turn in which a point was recognised", feature.proved)?;
    let Record { seen, agreed } = feature.record;
    let rate = if seen > 0.0 { f64::from(agreed / seen) } else { -1.0 };
    is_share("the hit rate of a point", rate)?;
    let Texture { images, showed, turned } = feature.texture;
    within(
        "the number of images in which a point showed a pattern",
        showed as usize,
        images as usize,
    )?;
    within("the number of images in which a point showed a turn", turned as usize, images as usize)
}

fn check_view(view: &KnownView) -> Result<(), TrackError> {
    let turn = view.object_from_camera.as_ref().norm();
    require("the orientation of a view", "a quaternion of length 1", turn, is_one(turn))?;
    view.thumbnail.as_ref().map_or(Ok(()), check_thumbnail)
}

fn check_thumbnail(thumbnail: &Thumbnail) -> Result<(), TrackError> {
    let Thumbnail { size, cell_px, depth, cells, .. } = thumbnail;
    for count in size {
        let (number, is_possible) = (*count as f64, (1..=MOST_SIDE).contains(count));
        require(
            "the length of a thumbnail in cells",
            &format!("1 to {MOST_SIDE}"),
            number,
            is_possible,
        )?;
    }
    for (what, number) in [("a cell's length", *cell_px), ("the distance of a view", *depth)] {
        require(what, "positive", number, number > 0.0)?;
    }
    for (column, row, brightness) in cells {
        within("the column of a cell of a thumbnail", *column, size[0] - 1)?;
        within("the row of a cell of a thumbnail", *row, size[1] - 1)?;
        let (number, is_possible) =
            (f64::from(*brightness), brightness.abs() <= 1.0 + ROUNDED as f32);
        require("the brightness of a cell of a thumbnail", "-1 to 1", number, is_possible)?;
    }
    Ok(())
}

fn at_least_zero(what: &'static str, number: f64) -> Result<(), TrackError> {
    require(what, "0 or more", number, number >= 0.0)
}

fn is_share(what: &'static str, number: f64) -> Result<(), TrackError> {
    require(what, "0 to 1", number, (0.0..=1.0 + ROUNDED).contains(&number))
}

fn is_direction(what: &'static str, direction: &Vector3<f64>) -> Result<(), TrackError> {
    let length = direction.norm();
    require(what, "a vector of length 1", length, is_one(length))
}

fn is_one(length: f64) -> bool {
    (length - 1.0).abs() <= ROUNDED
}

fn require(
    what: &'static str,
    allowed: &str,
    given: f64,
    is_possible: bool,
) -> Result<(), TrackError> {
    if is_possible {
        return Ok(());
    }
    let (allowed, given) = (allowed.to_string(), Digits(given).to_string());
    Err(TrackError::Impossible { what, allowed, given })
}
