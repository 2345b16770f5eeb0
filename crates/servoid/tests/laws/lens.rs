//! Laws of lenses: projection and rays are inverse, a lens has a limit, and invalid lenses are
//! rejected.

use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use servoid::camera::{Camera, CameraError, Distortion, Lens, NOWHERE_PX};

const SIZE_PX: [usize; 2] = [640, 480];

fn lens(distortion: Distortion) -> Lens {
    Lens::new(SIZE_PX, [420.0, 430.0], [322.5, 236.0], distortion).unwrap()
}

/// Distortions as from calibrations, and somewhat beyond.
fn usual() -> impl Strategy<Value = Distortion> {
    let radial = prop::array::uniform6(-0.3..0.3);
    let decentring = prop::array::uniform2(-0.01..0.01);
    let brown = (radial, decentring).prop_map(|(k, p)| {
        Distortion::BrownConrady([k[0], k[1], p[0], p[1], k[2], k[3], k[4], 0.1 * k[5]])
    });
    let kannala = prop::array::uniform4(-0.1..0.1).prop_map(Distortion::KannalaBrandt);
    prop_oneof![Just(Distortion::None), brown, kannala]
}

fn wild_number() -> impl Strategy<Value = f64> {
    prop_oneof![-10.0..10.0, -1e12..1e12, Just(0.0), Just(1e12), Just(-1e12), -1e-12..1e-12]
}

fn wild() -> impl Strategy<Value = Distortion> {
    prop_oneof![
        prop::array::uniform8(wild_number()).prop_map(Distortion::BrownConrady),
        prop::array::uniform4(wild_number()).prop_map(Distortion::KannalaBrandt),
    ]
}

/// Returns the direction at an angle off the axis, rotated around it.
fn direction(angle: f64, turn: f64) -> Vector3<f64> {
    Vector3::new(angle.sin() * turn.cos(), angle.sin() * turn.sin(), angle.cos())
}

/// Returns the distance from the principal point, in focal lengths, at which a lens images a
/// direction.
fn distance(lens: &Lens, angle: f64, turn: f64) -> f64 {
    let pixel = lens.project(&direction(angle, turn)).unwrap();
    let ([fx, fy], [cx, cy]) = (lens.camera().focal_px(), lens.camera().center_px());
    ((pixel.x - cx) / fx).hypot((pixel.y - cy) / fy)
}

proptest! {
    #[test]
    fn a_ray_points_to_what_its_pixel_shows(
        distortion in usual(), share in 0.0..0.97_f64, turn in 0.0..6.3_f64, far in 0.1..9.0_f64,
    ) {
        let lens = lens(distortion);
        let seen = direction(share * lens.limit(), turn);
        let pixel = lens.project(&(seen * far)).unwrap();
        let ray = lens.ray(pixel.into()).unwrap();
        prop_assert!((ray.norm() - 1.0).abs() < 1e-12);
        prop_assert!((ray - seen).norm() < 1e-9, "{distortion:?}: {ray} instead of {seen}");
    }

    #[test]
    fn a_ray_projects_to_its_pixel_however_wild_the_lens(
        distortion in prop_oneof![usual(), wild()], u in -900.0..1500.0_f64, v in -900.0..1500.0_f64,
    ) {
        let lens = lens(distortion);
        if let Some(ray) = lens.ray([u, v]) {
            prop_assert!((ray.norm() - 1.0).abs() < 1e-9);
            prop_assert!(ray.z > lens.limit().cos() - 1e-9);
            // A direction can lie within rounding of the limit.
            if let Some(pixel) = lens.project(&ray) {
                // For an extreme lens with a steep model, the last digit of a ray is many pixels.
                let digit = 1e-15 * ray.z.powi(-2) * steepness(&lens, &ray);
                prop_assert!((pixel.x - u).hypot(pixel.y - v) < 1e-6 + 64.0 * digit);
            }
        }
    }

    #[test]
    fn the_picture_grows_with_the_angle_up_to_the_limit(
        distortion in prop_oneof![usual(), wild()], turn in 0.0..6.3_f64,
        shares in prop::array::uniform2(0.0..0.999_f64),
    ) {
        let lens = lens(distortion);
        let [inner, outer] = [shares[0].min(shares[1]), shares[0].max(shares[1])];
        prop_assume!(outer - inner > 1e-6);
        let [near, far] = [inner, outer].map(|share| distance(&lens, share * lens.limit(), turn));
        prop_assert!(near <= far * (1.0 + 1e-12), "{near} {far} {distortion:?}");
    }

    #[test]
    fn nothing_is_seen_beyond_the_limit(
        distortion in prop_oneof![usual(), wild()], turn in 0.0..6.3_f64, beyond in 1e-9..1.0_f64,
    ) {
        let lens = lens(distortion);
        let angle = lens.limit() + beyond * (std::f64::consts::PI - lens.limit());
        prop_assert!(lens.project(&direction(angle, turn)).is_none());
    }

    #[test]
    fn numbers_that_are_no_place_give_no_answer_and_no_panic(
        distortion in wild(), p in prop::array::uniform3(prop::num::f64::ANY),
    ) {
        let lens = lens(distortion);
        if let Some(pixel) = lens.project(&Vector3::from(p)) {
            prop_assert!(pixel.iter().all(|x| x.is_finite()));
        }
        if let Some(ray) = lens.ray([p[0], p[1]]) {
            prop_assert!((ray.norm() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_map_gives_the_pixel_of_the_lens_for_each_pixel_of_the_ideal_camera(
        distortion in usual(), tilt in -0.6..0.6_f64, u in 0_usize..64, v in 0_usize..48,
    ) {
        let lens = lens(distortion);
        let camera = Camera::new([64, 48], [40.0, 41.0], [30.0, 25.0]).unwrap();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), tilt);
        let [x, y] = lens.map_to(&camera, &turn)[v * 64 + u];
        let seen = lens.project(&(turn * camera.ray([u as f64, v as f64])));
        let inside = |p: &nalgebra::Vector2<f64>| {
            p.x > -1.0 && p.y > -1.0 && p.x < 640.0 && p.y < 480.0
        };
        match seen.filter(inside) {
            Some(p) => prop_assert!(
                (p.x - f64::from(x)).abs() < 1e-4 && (p.y - f64::from(y)).abs() < 1e-4
            ),
            None => prop_assert_eq!([x, y], [NOWHERE_PX; 2]),
        }
    }
}

fn steepness(lens: &Lens, ray: &Vector3<f64>) -> f64 {
    let moved = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
        let [one, two] = [1e-7, -1e-7].map(|step| lens.project(&(ray + axis * step)));
        one.zip(two).map_or(f64::INFINITY, |(one, two)| (one - two).norm() / 2e-7)
    });
    moved.into_iter().fold(0.0, f64::max)
}

#[test]
fn a_barrel_ends_where_its_radius_stops_rising() {
    // r (1 - 0.3 r²) is largest at r² = 1 / 0.9.
    let barrel = lens(Distortion::from_name("brown_conrady", &[-0.3, 0.0, 0.0, 0.0]).unwrap());
    assert!((barrel.limit().tan() - (1.0_f64 / 0.9).sqrt()).abs() < 1e-12);
    // Beyond it, the bare formula would show the inside a second time.
    assert!(barrel.project(&Vector3::new(1.2, 0.0, 1.0)).is_none());
}

#[test]
fn a_quotient_ends_at_its_pole() {
    // r (1 + k r²) / (1 - r²) rises to its pole at r = 1.
    let pole = Distortion::from_name("brown_conrady", &[0.1, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0]);
    assert!((lens(pole.unwrap()).limit() - std::f64::consts::FRAC_PI_4).abs() < 1e-12);
}

#[test]
fn a_fisheye_sees_ninety_degrees_and_more_and_ends_at_a_hundred_and_twenty() {
    let fisheye = lens(Distortion::KannalaBrandt([0.0; 4]));
    assert!((fisheye.limit().to_degrees() - 120.0).abs() < 1e-9);
    for (degrees, seen) in [(90.0, true), (119.9, true), (120.1, false), (180.0, false)] {
        let point = direction(f64::to_radians(degrees), 0.0);
        let pixel = lens(Distortion::KannalaBrandt([0.0; 4])).project(&point);
        assert_eq!(pixel.is_some(), seen, "{degrees}");
        if let Some(pixel) = pixel {
            assert!((pixel.x - 322.5 - 420.0 * f64::to_radians(degrees)).abs() < 1e-9);
        }
    }
}

#[test]
fn brown_conrady_and_a_pinhole_see_less_than_ninety_degrees() {
    for distortion in [Distortion::None, Distortion::BrownConrady([0.0; 8])] {
        assert!(lens(distortion).project(&Vector3::new(1.0, 0.0, 0.01)).is_some());
        assert!(lens(distortion).project(&Vector3::x()).is_none());
    }
}

#[test]
fn the_point_in_the_lens_itself_is_not_seen() {
    for name in Distortion::MODELS {
        let count = if name == "pinhole" { 0 } else { 4 };
        let distortion = Distortion::from_name(name, &[0.0; 4][..count]).unwrap();
        assert_eq!(distortion.name(), name);
        assert!(lens(distortion).project(&Vector3::zeros()).is_none());
    }
}

#[test]
fn what_is_no_lens_is_refused_with_what_was_given() {
    let error = Distortion::from_name("fov", &[]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "unknown model 'fov'; known models: pinhole, brown_conrady, kannala_brandt"
    );
    for (name, given) in [("pinhole", 1), ("brown_conrady", 3), ("kannala_brandt", 5)] {
        let error = Distortion::from_name(name, &vec![0.0; given]).unwrap_err();
        assert!(matches!(error, CameraError::Coefficients { given: g, .. } if g == given));
        let verb = if given == 1 { "was" } else { "were" };
        assert!(error.to_string().contains(&format!("but {given} {verb} given")), "{error}");
    }
    for bad in [f64::NAN, f64::INFINITY, -1e13] {
        let error = Distortion::from_name("kannala_brandt", &[0.0, bad, 0.0, 0.0]).unwrap_err();
        assert!(matches!(error, CameraError::Coefficient { index: 1, .. }), "{error}");
        let direct = Distortion::BrownConrady([0.0, 0.0, bad, 0.0, 0.0, 0.0, 0.0, 0.0]);
        assert!(Lens::new(SIZE_PX, [1.0; 2], [0.0; 2], direct).is_err());
    }
}
