//! Laws of what is written of an appearance.

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;
use rand::RngExt;

use super::Appearance;
use crate::evolve::{self, Rng};
use crate::fitness::SurfacePoint;
use crate::pose::even_turn;
use crate::track::TrackError;
use crate::track::target::colors::Shares;
use crate::track::target::feature::{Feature, MOST_FURTHER, Texture};
use crate::track::target::keyframes::MOST_KEYFRAMES;
use crate::track::target::known_view::KnownView;
use crate::track::target::record::Record;
use crate::track::target::thumbnail::{MOST_SIDE, Thumbnail};

fn vector(rng: &mut Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

fn direction(rng: &mut Rng) -> Vector3<f64> {
    turn(rng) * Vector3::z()
}

fn turn(rng: &mut Rng) -> UnitQuaternion<f64> {
    even_turn(rng.random(), rng.random(), rng.random())
}

fn template(rng: &mut Rng, position: Vector3<f64>, color: [u8; 3]) -> SurfacePoint {
    SurfacePoint {
        position,
        normal: direction(rng),
        steps: [vector(rng), vector(rng)],
        toward: direction(rng),
        templates: std::array::from_fn(|_| {
            let is_there = rng.random::<f32>() < 0.7;
            is_there.then(|| std::array::from_fn(|_| rng.random_range(-1.0..1.0)))
        }),
        color,
    }
}

fn feature(rng: &mut Rng) -> Feature {
    let (position, color) = (vector(rng), [rng.random(), rng.random(), rng.random()]);
    let mut feature = Feature::new(template(rng, position, color), rng.random());
    for _ in 0..rng.random_range(0..=MOST_FURTHER) {
        let other = template(rng, position, color);
        feature.further.push(other);
    }
    (feature.drift_variance, feature.proved) = (rng.random(), rng.random());
    (feature.is_from_body, feature.is_from_motion) = (rng.random(), rng.random());
    feature.slides = rng.random();
    let seen = rng.random_range(1.0..14.0);
    feature.record = Record { seen, agreed: seen * rng.random_range(0.0..1.0) };
    let images = rng.random_range(0..1000);
    let (showed, turned) = (rng.random_range(0..=images), rng.random_range(0..=images));
    feature.texture = Texture { images, showed, turned };
    feature
}

fn shares(rng: &mut Rng) -> Shares {
    let bins = (0..rng.random_range(0..40)).map(|bin| (100 * bin, rng.random())).collect();
    Shares { grey: rng.random(), bins }
}

fn thumbnail(rng: &mut Rng) -> Thumbnail {
    let size = [rng.random_range(1..=MOST_SIDE), rng.random_range(1..=MOST_SIDE)];
    let cells = (0..size[0] * size[1]).filter(|at| !at.is_multiple_of(3));
    Thumbnail {
        size,
        cell_px: rng.random_range(4.0..40.0),
        origin: Vector2::new(rng.random(), rng.random()),
        depth: rng.random_range(0.1..2.0),
        cells: cells.map(|at| (at % size[0], at / size[0], rng.random_range(-1.0..1.0))).collect(),
    }
}

fn view(rng: &mut Rng) -> KnownView {
    KnownView {
        object_from_camera: turn(rng),
        eye: rng.random::<bool>().then(|| vector(rng)),
        thumbnail: rng.random::<bool>().then(|| thumbnail(rng)),
    }
}

fn appearance(seed: u64) -> Appearance {
    let rng = &mut evolve::rng(seed, 0);
    let (points, views) = (rng.random_range(0..5), rng.random_range(0..4));
    Appearance {
        points: (0..points).map(|_| feature(rng)).collect(),
        colors: shares(rng),
        views: (0..views).map(|_| view(rng)).collect(),
        reference: std::array::from_fn(|_| rng.random_range(-9.0..99.0)),
    }
}

proptest! {
    #[test]
    fn whatever_is_known_is_read_as_it_was_written(seed: u64) {
        let known = appearance(seed);
        let bytes = known.to_bytes();
        prop_assert_eq!(Appearance::from_bytes(&bytes), Ok(known));
    }

    #[test]
    fn a_part_of_what_was_written_is_no_appearance(
        seed: u64,
        cut in any::<prop::sample::Index>(),
        more in prop::collection::vec(any::<u8>(), 1..9),
    ) {
        let bytes = appearance(seed).to_bytes();
        let length = cut.index(bytes.len());
        let refused = Appearance::from_bytes(&bytes[..length]);
        prop_assert_eq!(refused, Err(TrackError::Appearance(length)));
        let longer = [bytes, more].concat();
        let refused = Appearance::from_bytes(&longer);
        prop_assert_eq!(refused, Err(TrackError::Appearance(longer.len())));
    }
}

#[test]
fn what_has_more_parts_than_a_tracker_keeps_is_refused_in_words() {
    let refusal = |known: &Appearance| {
        Appearance::from_bytes(&known.to_bytes()).map(|_| ()).unwrap_err().to_string()
    };
    let rng = &mut evolve::rng(0, 0);
    let mut crowded = feature(rng);
    crowded.further = vec![crowded.point; MOST_FURTHER + 1];
    let known = Appearance { points: vec![crowded], ..Appearance::default() };
    assert!(refusal(&known).starts_with("the number of further templates of a point in the"));
    let many = vec![view(rng); MOST_KEYFRAMES + 1];
    let known = Appearance { views: many, ..Appearance::default() };
    assert!(
        refusal(&known).starts_with("the number of views in the appearance is 65, but it must")
    );
    let wide = Thumbnail { size: [MOST_SIDE + 1, 3], ..thumbnail(rng) };
    let one = KnownView { thumbnail: Some(wide), ..view(rng) };
    let known = Appearance { views: vec![one], ..Appearance::default() };
    assert!(refusal(&known).starts_with("the length of a thumbnail in cells in the appearance is"));
}
