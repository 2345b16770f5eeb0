//! The rotation that an outline shows least, and whether the surface shows it instead.

use nalgebra::{Matrix3, Matrix6, SymmetricEigen, Vector2, Vector3, Vector6};

use crate::fitness::Agreement;
use crate::pose::Pose;
use crate::track::target::points::by_motion;

/// Share of all information that is added to that of the translation, so that it has an inverse.
const OPEN: f64 = 1e-6;
/// Part of the noise's variance that is taken off the squared gradient of a patch per pixel, of
/// which noise adds 0.6 where images are smoothed.
const IN_GRADIENT: f64 = 0.5;
/// Squared gradient that is added across a motion, per squared pixel, so that it has an inverse.
const LEAST_ACROSS: f64 = 1e-9;
/// Change of a point's image per radian of rotation, compared with the brightness of the object or
/// of its surroundings, above which it is none of shading.
const SHADING: f64 = 1.0;

/// The rotation about the object's centre that moves an outline least, after the translation that
/// undoes most of its motion.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WeakestTurn {
    /// The two together, per radian of rotation: a small motion in the object's frame.
    motion: Vector6<f64>,
    /// How far the outline moves per radian, compared with how far it moves per radius of
    /// translation, both rms.
    pub(crate) lever: f64,
}

impl WeakestTurn {
    /// Finds it by the information that the outline has of a small motion in the object's frame;
    /// none if the outline is not seen.
    pub(crate) fn of(information: &Matrix6<f64>, radius: f64) -> Option<Self> {
        let block = |row, column| information.fixed_view::<3, 3>(row, column).into_owned();
        let (across, mixed, turned) = (block(0, 0), block(0, 3), block(3, 3));
        let all = across.trace();
        let inverse = (across + Matrix3::identity() * (OPEN * all)).try_inverse()?;
        let undone = -inverse * mixed;
        let left = SymmetricEigen::new(turned + mixed.transpose() * undone);
        let weakest = left.eigenvalues.imin();
        let found: Vector3<f64> = left.eigenvectors.column(weakest).into();
        // Of its two signs always the same.
        let axis = if found[found.iamax()] > 0.0 { found } else { -found };
        let shift = undone * axis;
        Some(Self {
            motion: Vector6::new(shift.x, shift.y, shift.z, axis.x, axis.y, axis.z),
            lever: (left.eigenvalues[weakest].max(0.0) / all).sqrt() / radius,
        })
    }

    /// Returns the motion of an object that turns by an angle in radians, in its own frame.
    pub(crate) fn by(&self, angle: f64) -> Pose {
        Pose::exp(&(self.motion * angle))
    }

    /// Returns the angle about the axis by which one pose is turned from another, in radians.
    pub(crate) fn angle_from(&self, one: &Pose, other: &Pose) -> f64 {
        let off = (one.inverse() * *other).log();
        off.fixed_rows::<3>(3).dot(&self.motion.fixed_rows::<3>(3))
    }

    /// Returns whether the image of a point changes faster with the rotation than that of a surface
    /// without print: by noise, or by shading, which is as bright as `light` at most. A shift across
    /// the motion is no change: rings stay rings.
    pub(crate) fn is_shown_by(
        &self,
        (found, level): (&Agreement, usize),
        position: &Vector3<f64>,
        (noise, light): (f64, f64),
    ) -> bool {
        let motion: Vector2<f64> = by_motion(&found.slope, position) * self.motion;
        let squared = motion.norm_squared();
        let beside = Vector2::new(-motion.y, motion.x);
        let pull = found.tensor * motion;
        let (mixed, across) = (beside.dot(&pull), beside.dot(&(found.tensor * beside)));
        let alone = motion.dot(&pull) - mixed * mixed / (across + LEAST_ACROSS * squared);
        let change = found.contrast * found.contrast * alone
            - IN_GRADIENT * gradient_noise(noise, level) * squared;
        change > (SHADING * light).powi(2)
    }
}

/// Returns the variance of noise at a level of an image's pyramid, as far as it changes from pixel to
/// pixel of the image, in square grey levels.
pub(crate) fn gradient_noise(noise: f64, level: usize) -> f64 {
    // Both the noise and its gradient per pixel are half as large at the next level.
    (noise / f64::from(1_u32 << (2 * level))).powi(2)
}

#[cfg(test)]
pub(crate) mod tests {
    use nalgebra::{Matrix2, Matrix2x3};
    use proptest::prelude::*;

    use super::*;

    pub(crate) const RADIUS: f64 = 0.05;
    /// Points of an outline that move when it turns, in metres, and their normals.
    pub(crate) const HANDLE: [(Vector3<f64>, Vector2<f64>); 2] = [
        (Vector3::new(0.5 * RADIUS, 0.1 * RADIUS, 0.8 * RADIUS), Vector2::new(1.0, 0.0)),
        (Vector3::new(-0.5 * RADIUS, 0.3 * RADIUS, -0.6 * RADIUS), Vector2::new(0.0, 1.0)),
    ];
    /// Pixels per metre, and grey levels.
    const SCALE_PX: f64 = 1000.0;
    const LIGHT: f64 = 100.0;

    fn slope(pixels: f64) -> Matrix2x3<f64> {
        Matrix2x3::new(pixels, 0.0, 0.0, 0.0, pixels, 0.0)
    }

    /// Returns the information of an outline: points in the object's frame and their normals, as
    /// seen along z by a camera far away, all in another unit of length.
    pub(crate) fn outlined(rim: &[(Vector3<f64>, Vector2<f64>)], scale: f64) -> Matrix6<f64> {
        let mut information = Matrix6::zeros();
        for (point, normal) in rim {
            let line = by_motion(&slope(SCALE_PX / scale), &(point * scale)).tr_mul(normal);
            information += line * line.transpose();
        }
        information
    }

    /// The axis of the vase, which leans towards the camera.
    const LEAN: f64 = 0.4;

    fn axis() -> Vector3<f64> {
        Vector3::new(0.0, libm::cos(LEAN), libm::sin(LEAN))
    }

    /// Returns the outline of a body of revolution of a height and with a waist: its normals are
    /// across the line of sight.
    pub(crate) fn vase(height: f64, waist: f64) -> Vec<(Vector3<f64>, Vector2<f64>)> {
        let (axis, aside) = (axis(), Vector3::x());
        let front = aside.cross(&axis);
        let mut rim = Vec::new();
        for step in -20..=20 {
            let along = 0.05 * f64::from(step);
            let around = 0.4 * RADIUS * (1.0 - waist * (1.0 - along * along));
            let flare = 0.8 * RADIUS * waist * along / height;
            let far = flare * libm::tan(LEAN);
            for side in [-1.0, 1.0] {
                let out = aside * side * libm::sqrt(1.0 - far * far) + front * far;
                let normal = (out - axis * flare).normalize();
                rim.push((axis * (height * along) + out * around, normal.xy()));
            }
        }
        rim
    }

    /// Returns what an image of some size shows of the point on the front of a vase: how fast it
    /// varies, in contrasts per pixel of a small image, from side to side and downwards.
    fn seen(size: f64, (aside, down): (f64, f64), contrast: f64) -> (Agreement, Vector3<f64>) {
        let found = Agreement {
            pixel: Vector2::zeros(),
            slope: slope(size * SCALE_PX),
            correlation: 1.0,
            tensor: Matrix2::new(aside * aside, 0.0, 0.0, down * down) / (size * size),
            pull: Vector2::zeros(),
            contrast,
            brightness: LIGHT,
        };
        (found, Vector3::x().cross(&axis()) * -0.4 * RADIUS)
    }

    fn of_vase() -> WeakestTurn {
        WeakestTurn::of(&outlined(&vase(RADIUS, 0.3), 1.0), RADIUS).unwrap()
    }

    proptest! {
        #[test]
        fn no_outline_of_a_body_of_revolution_shows_its_turn_about_the_axis(
            height in 0.6..2.0_f64,
            waist in 0.2..0.8_f64,
        ) {
            let rim = vase(height * RADIUS, waist);
            let weakest = WeakestTurn::of(&outlined(&rim, 1.0), RADIUS).unwrap();
            prop_assert!(weakest.lever < 1e-3);
            prop_assert!(weakest.motion.fixed_rows::<3>(3).dot(&axis()).abs() > 0.999);
        }

        #[test]
        fn the_lever_of_an_outline_is_the_same_in_any_unit_of_length(scale in 0.01..100.0_f64) {
            let rim = [&vase(RADIUS, 0.3)[..], &HANDLE].concat();
            let [one, other] = [1.0, scale]
                .map(|scale| WeakestTurn::of(&outlined(&rim, scale), scale * RADIUS).unwrap().lever);
            prop_assert!(one > 0.03 && (one - other).abs() < 1e-9 * one);
        }

        #[test]
        fn what_a_pose_was_turned_by_is_what_it_is_turned_by(
            twist in proptest::array::uniform6(-1.0..1.0_f64),
            angle in -1.5..1.5_f64,
            shift in proptest::array::uniform3(-0.1..0.1_f64),
        ) {
            let (weakest, pose) = (of_vase(), Pose::exp(&twist.into()));
            let turned = pose * weakest.by(angle);
            prop_assert!((weakest.angle_from(&pose, &turned) - angle).abs() < 1e-9);
            let moved = turned * Pose::exp(&Vector6::new(shift[0], shift[1], shift[2], 0.0, 0.0, 0.0));
            prop_assert!((weakest.angle_from(&pose, &moved) - angle).abs() < 1e-9);
        }

        #[test]
        fn a_turn_is_shown_by_what_changes_along_its_way_and_never_by_rings(
            aside in 0.0..1.0_f64,
            down in 0.0..1.0_f64,
            contrast in 3.0..60.0_f64,
        ) {
            // A turn of a radian moves the front of this vase by 20 pixels to the side.
            let (found, at) = seen(1.0, (aside, down), contrast);
            let is_shown = of_vase().is_shown_by((&found, 0), &at, (0.0, LIGHT));
            let change = 20.0 * aside * contrast / (SHADING * LIGHT);
            prop_assume!((change - 1.0).abs() > 1e-3);
            prop_assert_eq!(is_shown, change > 1.0);
        }

        #[test]
        fn what_shows_a_turn_does_so_in_any_light_and_with_pixels_of_any_size(
            aside in 0.0..1.0_f64,
            noise in 0.0..5.0_f64,
            light in 0.2..2.0_f64,
            size in 0.5..2.0_f64,
        ) {
            let weakest = of_vase();
            let (found, at) = seen(1.0, (aside, 0.3), 30.0);
            let one = weakest.is_shown_by((&found, 0), &at, (noise, LIGHT));
            let (other, _) = seen(size, (aside, 0.3), light * 30.0);
            let seen = (light * noise / size, light * LIGHT);
            prop_assert_eq!(weakest.is_shown_by((&other, 0), &at, seen), one);
        }
    }

    #[test]
    fn noise_shows_no_turn() {
        let (found, at) = seen(1.0, (0.7, 0.7), 10.0);
        let is_shown = |noise| of_vase().is_shown_by((&found, 0), &at, (noise, LIGHT));
        assert!(is_shown(5.0) && !is_shown(10.0));
        let coarse = of_vase().is_shown_by((&found, 1), &at, (10.0, LIGHT));
        assert!(coarse, "there is a quarter of it at half the resolution");
    }

    #[test]
    fn an_outline_that_is_not_seen_shows_nothing() {
        assert!(WeakestTurn::of(&Matrix6::zeros(), RADIUS).is_none());
    }
}
