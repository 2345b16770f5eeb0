use nalgebra::{UnitQuaternion, Vector3};

use super::frame::senses::FARTHEST_S;
use crate::pose::Pose;

/// Where the object was seen and how it moved: its middle evenly through the world, and turning evenly
/// about it. While it is not seen it is foreseen to go on, ever more slowly.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    seen: At,
    foreseen: At,
    velocity: Vector3<f64>,
    /// Turn a second, in the world.
    turning: Vector3<f64>,
}

#[derive(Debug, Clone, Copy)]
struct At {
    time_s: f64,
    world_from_object: Pose,
}

/// Share of the newest motion in what is predicted.
const NEWEST: f64 = 0.8;
/// Time in which a motion that is not seen loses all but a factor of e.
const FADES_S: f64 = 0.1;

impl Motion {
    pub(super) fn at_rest(time_s: f64, world_from_object: Pose) -> Self {
        let (zero, at) = (Vector3::zeros(), At { time_s, world_from_object });
        Self { seen: at, foreseen: at, velocity: zero, turning: zero }
    }

    /// Says where the object was seen last.
    pub(super) fn last(&self) -> Pose {
        self.seen.world_from_object
    }

    /// Says where the object is at a time if it goes on as before. Where time does not go on, or
    /// jumps, it is where it was.
    pub(super) fn predict(&self, time_s: f64) -> Pose {
        let At { time_s: last_s, world_from_object: here } = self.foreseen;
        let Some(dt) = passed(last_s, time_s) else { return here };
        let turn = UnitQuaternion::from_scaled_axis(self.turning * dt);
        Pose::from_rotation(turn * here.rotation(), here.translation() + self.velocity * dt)
    }

    /// Goes on to a pose that was found.
    pub(super) fn follow(&mut self, time_s: f64, world_from_object: Pose) {
        let At { time_s: last_s, world_from_object: before } = self.seen;
        if let Some(dt) = passed(last_s, time_s) {
            let velocity = (world_from_object.translation() - before.translation()) / dt;
            let turn = world_from_object.rotation() * before.rotation().inverse();
            self.velocity += NEWEST * (velocity - self.velocity);
            self.turning += NEWEST * (turn.scaled_axis() / dt - self.turning);
        } else {
            self.stop();
        }
        self.seen = At { time_s, world_from_object };
        self.foreseen = self.seen;
    }

    /// Time goes on while nothing is seen.
    pub(super) fn wait(&mut self, time_s: f64) {
        let last_s = self.foreseen.time_s;
        self.foreseen = At { time_s, world_from_object: self.predict(time_s) };
        match passed(last_s, time_s) {
            Some(dt) => {
                let left = libm::exp(-dt / FADES_S);
                self.velocity *= left;
                self.turning *= left;
            }
            None => self.stop(),
        }
    }

    fn stop(&mut self) {
        self.velocity = Vector3::zeros();
        self.turning = Vector3::zeros();
    }
}

/// Gives the seconds from one time to a later one, unless that is too far.
fn passed(from_s: f64, to_s: f64) -> Option<f64> {
    let dt = to_s - from_s;
    (dt > 0.0 && dt < FARTHEST_S).then_some(dt)
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT: f64 = 1.0 / 30.0;
    const SPEED: f64 = 0.6;

    /// Where an object is that goes evenly along x and turns about z.
    fn place(time_s: f64) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * time_s);
        Pose::from_rotation(turn, Vector3::x() * (SPEED * time_s))
    }

    /// Follows that object for some images; gives when it was seen last, too.
    fn followed(images: usize) -> (Motion, f64) {
        let mut motion = Motion::at_rest(0.0, place(0.0));
        for index in 1..=images {
            motion.follow(index as f64 * DT, place(index as f64 * DT));
        }
        (motion, images as f64 * DT)
    }

    fn apart(one: &Pose, other: &Pose) -> (f64, f64) {
        let turn = one.rotation().inverse() * other.rotation();
        ((one.translation() - other.translation()).norm(), turn.angle())
    }

    #[test]
    fn what_moves_evenly_is_foreseen_also_where_images_are_missing() {
        let (motion, last_s) = followed(20);
        for missing in 1..10 {
            let later_s = last_s + missing as f64 * DT;
            let (off, turned) = apart(&motion.predict(later_s), &place(later_s));
            assert!(off < 1e-9 && turned < 1e-9, "{missing}: {off} {turned}");
        }
    }

    #[test]
    fn what_is_not_seen_goes_on_ever_more_slowly_and_not_far() {
        let (mut motion, last_s) = followed(20);
        let (mut before, mut step) = (motion.last(), f64::INFINITY);
        for index in 1..60 {
            let now_s = last_s + index as f64 * DT;
            let foreseen = motion.predict(now_s);
            let (went, _) = apart(&before, &foreseen);
            assert!(went > 0.0 && went < step, "{index}: {went} after {step}");
            motion.wait(now_s);
            (before, step) = (foreseen, went);
        }
        let (all, turned) = apart(&motion.last(), &before);
        let most = DT / (1.0 - libm::exp(-DT / FADES_S));
        assert!((0.9..1.0).contains(&(all / (SPEED * most))), "{all}");
        assert!(turned < most);
        assert_eq!(motion.last().translation(), place(last_s).translation());
    }

    #[test]
    fn where_time_stands_still_goes_back_or_jumps_nothing_moves() {
        let (motion, last_s) = followed(20);
        for later_s in [0.0, -1.0, 1.1 * FARTHEST_S, 1e9] {
            let (off, turned) = apart(&motion.predict(last_s + later_s), &place(last_s));
            assert!(off < 1e-12 && turned < 1e-9);
        }
    }
}
