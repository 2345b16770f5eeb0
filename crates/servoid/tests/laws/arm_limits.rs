//! Laws of the limits of joints and of a hand.

use proptest::prelude::*;
use servoid::pose::exact::{Rows, dot};
use servoid::servo::{
    ArmError, Cause, Drift, HandLimits, Jacobian, JointLimits, JointMotion, JointRanges, Workspace,
    stoppable_speed, stopping_distance,
};

const PERIOD_S: f64 = 0.008;

fn ranges() -> JointRanges {
    JointRanges {
        lower: vec![-1.0, -2.0, -0.5],
        upper: vec![1.0, 1.5, 0.5],
        speed: vec![1.0, 2.0, 3.0],
        acceleration: vec![4.0, 5.0, 6.0],
        jerk: vec![60.0, 80.0, 200.0],
    }
}

fn limits() -> JointLimits {
    JointLimits::new(ranges(), 2, PERIOD_S, 0.02).unwrap()
}

fn three(most: f64) -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-most..most)
}

fn jacobians() -> impl Strategy<Value = Jacobian> {
    prop::collection::vec(-1.0..1.0_f64, 42)
        .prop_map(|numbers| Jacobian::new(Rows { numbers, columns: 7 }).unwrap())
}

fn norm(vector: &[f64]) -> f64 {
    vector.iter().fold(0.0, |sum, x| sum + x * x).sqrt()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn the_stopping_distance_is_that_of_the_hardest_braking(
        speed in 0.05..5.0_f64,
        share in -1.0..1.0_f64,
        deceleration in 0.5..20.0_f64,
        ramp_s in 0.005..0.2_f64,
    ) {
        let jerk = deceleration / ramp_s;
        // One that brakes so hard that it would turn back before it fades is none of these.
        let most = if share > 0.0 { deceleration } else { deceleration.min((2.0 * jerk * speed).sqrt()) };
        let distance = stopping_distance(speed, share * most, deceleration, jerk);
        let (step, mut way, mut at, mut rate) = (2e-4, 0.0, speed, share * most);
        while at > 1e-6 {
            let wanted = (-deceleration).max(-(2.0 * jerk * at).sqrt());
            rate += (wanted - rate).clamp(-jerk * step, jerk * step);
            way += at * step;
            at += rate * step;
        }
        prop_assert!((distance - way).abs() < (0.02 * way).max(1e-3), "{distance} {way}");
    }

    #[test]
    fn a_stoppable_speed_stops_in_time(
        room in 0.0..3.0_f64, deceleration in 0.5..20.0_f64, reaction_s in 0.01..0.1_f64,
    ) {
        prop_assert_eq!(stoppable_speed(-room, deceleration, reaction_s), 0.0);
        let (step, mut left, mut last) = (1e-3, room, f64::INFINITY);
        for _ in 0..10_000 {
            let speed = stoppable_speed(left, deceleration, reaction_s);
            prop_assert!(last - speed <= deceleration * step * (1.0 + 1e-9) || last.is_infinite());
            (left, last) = (left - speed * step, speed);
        }
        prop_assert!((0.0..=(1e-2 * room).max(1e-6)).contains(&left));
    }

    #[test]
    fn joints_that_brake_come_to_rest_along_their_path(start in three(1.0), ticks in 0.0..20.0_f64) {
        let (limits, ranges) = (limits(), ranges());
        let (mut speeds, mut change) = (start.to_vec(), vec![0.0; 3]);
        for _ in 0..2000 {
            let along = limits.braked(&speeds, &change, ticks).unwrap();
            prop_assert!((along[0] * speeds[1] - along[1] * speeds[0]).abs() < 1e-12);
            let next = limits.blindly_braked(&speeds, &change, ticks).unwrap();
            for joint in 0..3 {
                let now = (next[joint] - speeds[joint]) / PERIOD_S;
                let slack = 1.0 + 1e-9;
                prop_assert!(now.abs() <= ranges.acceleration[joint] * slack);
                let jerk = (now - change[joint]).abs() / PERIOD_S;
                prop_assert!(jerk <= ranges.jerk[joint] * slack + 1e-6);
                change[joint] = now;
            }
            speeds = next;
        }
        prop_assert!(norm(&speeds) < 1e-12);
    }
}

proptest! {
    #[test]
    fn a_window_is_never_empty_and_within_the_change_of_a_period(
        positions in three(2.5),
        velocities in three(3.0),
        previous in three(3.0),
        acceleration in three(8.0),
        braking in prop::collection::vec(0.1..10.0_f64, 0..3),
    ) {
        let now = JointMotion {
            positions: &positions,
            velocities: &velocities,
            previous: &previous,
            acceleration: &acceleration,
        };
        let window = limits().window(&now, &braking).unwrap();
        for (joint, &last) in previous.iter().enumerate() {
            let (lower, upper) = (window.lower[joint], window.upper[joint]);
            prop_assert!(lower <= upper);
            let most = ranges().acceleration[joint] * PERIOD_S * (1.0 + 1e-9) + 1e-12;
            // A speed above its limit, as it was measured, is left at once.
            let over = (last.abs() - ranges().speed[joint]).max(0.0);
            prop_assert!((lower - last).abs() <= most + over);
            prop_assert!((upper - last).abs() <= most + over);
        }
    }

    #[test]
    fn planes_cut_off_what_is_outside_a_ball_and_nothing_inside(
        jacobian in jacobians(),
        last in prop::array::uniform6(-0.02..0.02_f64),
        speeds in prop::collection::vec(-1.0..1.0_f64, 7),
        others in prop::collection::vec(prop::collection::vec(-0.05..0.05_f64, 7), 20),
    ) {
        let limits = |share: f64| HandLimits {
            speeds: [0.5 * share, share],
            steps: [0.1 * share, 0.3 * share],
            period_s: PERIOD_S,
            fading: 2.0,
        };
        let [balls, smaller] = [1.0, 0.99].map(|share| limits(share).balls(&jacobian, &last, 1.0));
        let cuts = balls.cuts(&speeds).unwrap();
        prop_assert_eq!(balls.hold(&speeds).unwrap(), cuts.balls.is_empty());
        prop_assert_eq!(cuts.matrix.numbers.len(), 7 * cuts.balls.len());
        for (row, &most) in cuts.matrix.each().zip(&cuts.upper) {
            prop_assert!(dot(row, &speeds) > most);
            for inside in others.iter().filter(|other| smaller.hold(other).unwrap()) {
                prop_assert!(dot(row, inside) <= most);
            }
        }
    }

    #[test]
    fn a_joint_that_brakes_alone_leaves_the_hand_within_its_acceleration(jacobian in jacobians()) {
        let hand = HandLimits {
            speeds: [0.5, 1.0], steps: [0.02, 0.05], period_s: PERIOD_S, fading: 0.0,
        };
        for (joint, braking) in hand.braking(&jacobian).into_iter().enumerate() {
            let column: Vec<f64> =
                (0..6).map(|row| PERIOD_S * braking * jacobian.rows().at(row, joint)).collect();
            prop_assert!(norm(&column[..3]) <= 0.02 && norm(&column[3..]) <= 0.05);
        }
    }

    #[test]
    fn a_hand_comes_to_rest_in_the_periods_that_it_needs(twist in prop::array::uniform6(-1.0..1.0_f64)) {
        let hand = HandLimits {
            speeds: [0.5, 1.0], steps: [0.02, 0.05], period_s: PERIOD_S, fading: 0.0,
        };
        let ticks = hand.ticks_to_rest(&twist);
        let needed = (norm(&twist[..3]) / 0.02).max(norm(&twist[3..]) / 0.05);
        prop_assert!(needed <= ticks && ticks <= 1.01 * needed);
    }

    #[test]
    fn no_wall_asks_for_more_than_braking_takes(
        place in three(1.5), velocity in three(1.0), object in three(1.5), moves in three(1.0),
        jacobian in jacobians(),
    ) {
        let workspace = workspace();
        let hand = Drift { place, velocity };
        let found = workspace.velocity_limits(&hand, &Drift { place: object, velocity: moves });
        let step = workspace.braking * PERIOD_S;
        let slack = 1e-12;
        for (axis, &speed) in velocity.iter().enumerate() {
            prop_assert!(found.lower[axis] <= speed + step + slack);
            prop_assert!(found.upper[axis] >= speed - step - slack);
        }
        prop_assert!(found.closing >= dot(&found.toward, &velocity) - step - slack);
        prop_assert!((norm(&found.toward) - 1.0).abs() < 1e-12);
        let (rows, lower, upper) = found.rows(&jacobian);
        prop_assert_eq!((rows.count(), rows.columns), (4, 7));
        prop_assert_eq!((lower[3], upper[3]), (f64::NEG_INFINITY, found.closing));
        let joints = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6, -0.7];
        let moved = jacobian.rows().times_vector(&joints);
        let seen = rows.times_vector(&joints);
        prop_assert!((seen[3] - dot(&found.toward, &moved[..3])).abs() < 1e-12);
    }

    #[test]
    fn an_allowed_goal_is_in_the_workspace_and_a_good_one_stays(goal in three(1.5), object in three(0.5)) {
        let workspace = workspace();
        let found = workspace.allowed(goal, object);
        prop_assert!(found.iter().all(|x| x.abs() <= 1.0));
        let apart = |place: [f64; 3]| norm(&[0, 1, 2].map(|i| place[i] - object[i]));
        let inside = goal.iter().all(|x| x.abs() <= 1.0);
        if inside && apart(goal) >= workspace.least_distance {
            prop_assert_eq!(found, goal);
        } else if found.iter().all(|x| x.abs() < 1.0) {
            prop_assert!(apart(found) >= workspace.least_distance * (1.0 - 1e-12));
        }
    }
}

fn workspace() -> Workspace {
    Workspace {
        lower: [-1.0; 3],
        upper: [1.0; 3],
        least_distance: 0.2,
        braking: 2.0,
        reaction_s: 0.03,
        period_s: PERIOD_S,
    }
}

#[test]
fn the_cause_of_a_bound_is_the_limit_that_acts() {
    let window = |place: f64, previous: f64, acceleration: f64| {
        let (place, previous, acceleration) = ([place; 3], [previous; 3], [acceleration; 3]);
        let now = JointMotion {
            positions: &place,
            velocities: &previous,
            previous: &previous,
            acceleration: &acceleration,
        };
        limits().window(&now, &[]).unwrap().causes[1][0]
    };
    assert_eq!(window(0.0, 0.0, 0.0), Cause::Jerk);
    assert_eq!(window(0.0, 0.1, 3.9), Cause::Acceleration);
    assert_eq!(window(-0.9, 0.999, 0.0), Cause::Speed);
    assert_eq!(window(1.0, 0.0, 0.0), Cause::Limit);
}

#[test]
fn what_does_not_fit_the_joints_is_refused_in_words() {
    let limits = limits();
    let words = |error: ArmError| error.to_string();
    let short = JointRanges { speed: vec![1.0; 2], ..ranges() };
    assert_eq!(
        words(JointLimits::new(short, 2, PERIOD_S, 0.02).unwrap_err()),
        "the greatest speeds of joints must be 3 numbers for this arm, but 2 were given"
    );
    assert_eq!(
        words(JointLimits::new(ranges(), 4, PERIOD_S, 0.02).unwrap_err()),
        "there are 3 joints, but 4 were given"
    );
    assert_eq!(
        words(limits.braked(&[0.0; 2], &[0.0; 3], 0.0).unwrap_err()),
        "the commanded speeds of joints must be 3 numbers for this arm, but 2 were given"
    );
    let now = JointMotion {
        positions: &[0.0; 3],
        velocities: &[0.0; 4],
        previous: &[0.0; 3],
        acceleration: &[0.0; 3],
    };
    assert_eq!(
        words(limits.window(&now, &[]).unwrap_err()),
        "the speeds of joints must be 3 numbers for this arm, but 4 were given"
    );
}
