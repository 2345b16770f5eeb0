//! Laws of the coverage of a surface.

use crate::modelling::{Scene, samples, solid};
use nalgebra::Vector3;
use servoid::model::coverage;
use servoid::shape::Body;

#[test]
fn half_a_ball_is_seen_from_one_side_and_all_of_it_from_all_sides() {
    let scene = Scene::new(&[solid([0.0; 3], [0.05; 3])]);
    let views = scene.views();
    let body = Body::around(&[solid([0.0; 3], [0.05; 3])]).unwrap();
    let all = coverage(&body, &views, &[]);
    assert!(all.share > 0.9, "{}", all.share);
    let one = coverage(&body, &views[..1], &[]);
    assert!((0.3..0.5).contains(&one.share), "{}", one.share);
    let away = views[0].world_from_camera().rotation() * Vector3::z();
    let toward = body.world_from_object().rotation() * Vector3::from(one.unseen_toward.unwrap());
    assert!(toward.dot(&away) > 0.95);
    let hidden = Body::around(&[solid([0.0; 3], [0.05; 3]), solid([0.0; 3], [0.02; 3])]).unwrap();
    assert_eq!(coverage(&hidden, &views[..1], &[]).by_ellipsoid[1], 1.0);
}

#[test]
fn what_was_not_seen_on_opposite_sides_lies_towards_none() {
    let body = Body::around(&[solid([0.0; 3], [0.05; 3])]).unwrap();
    let band: Vec<_> =
        samples(0.05).into_iter().filter(|sample| sample.direction.z.abs() < 0.5).collect();
    let found = coverage(&body, &[], &band);
    assert!((0.4..0.7).contains(&found.share), "{}", found.share);
    assert_eq!(found.unseen_toward, None);
    // Nothing of it was seen, so the unseen part lies all around.
    let found = coverage(&body, &[], &[]);
    assert_eq!((found.share, found.unseen_toward), (0.0, None));
    let above: Vec<_> = band.into_iter().chain(samples(0.05)[..200].to_vec()).collect();
    let toward = coverage(&body, &[], &above).unseen_toward.unwrap();
    let toward = body.world_from_object().rotation() * Vector3::from(toward);
    assert!(toward.z < -0.95, "{toward}");
}
