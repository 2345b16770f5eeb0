//! Laws of the kinematics of an arm, of its hand's law, and of what its cameras look at.

use nalgebra::Vector6;
use proptest::prelude::*;
use servoid::pose::Pose;
use servoid::pose::exact::Rows;
use servoid::servo::{
    ArmError, Chain, HandGains, Jacobian, Link, Moving, QuadraticLaw, change_between, correction,
    fixation, hand_weights, lost_speed, newton_turn, quaternion_error, seen_from_head, shares,
    shifted_and_turned, within,
};

const STEP: f64 = 1e-5;

fn pose(numbers: [f64; 6]) -> Pose {
    Pose::exp(&Vector6::from(numbers))
}

fn six(most: f64) -> impl Strategy<Value = [f64; 6]> {
    prop::array::uniform6(-most..most)
}

/// Returns any chain and angles of its joints, with one of a joint that does not belong to it.
fn chains() -> impl Strategy<Value = (Chain, Vec<f64>)> {
    let joint = (-1.6..1.6_f64, -0.3..0.5_f64, -3.0..3.0_f64);
    (prop::collection::vec(joint, 1..9), six(0.5)).prop_map(|(joints, hand)| {
        let links: Vec<Link> =
            joints.iter().map(|&(twist, along, _)| Link { twist, along }).collect();
        let angles = joints.iter().map(|&(_, _, angle)| angle).chain([0.7]).collect();
        (Chain::new(&links, &pose(hand)).unwrap(), angles)
    })
}

/// Returns the paper's arm, bent.
fn bent() -> (Chain, Vec<f64>) {
    let quarter = std::f64::consts::FRAC_PI_2;
    let twists = [0.0, -quarter, quarter, -quarter, quarter, -quarter, quarter];
    let along = [0.3, 0.0, 0.3, 0.0, 0.3, 0.0, 0.1];
    let links = twists.into_iter().zip(along).map(|(twist, along)| Link { twist, along });
    let chain = Chain::new(&links.collect::<Vec<_>>(), &Pose::identity()).unwrap();
    (chain, vec![0.1, -0.6, 0.2, 1.2, -0.3, 0.8, 0.4])
}

fn law(posture: Vec<f64>) -> QuadraticLaw {
    QuadraticLaw {
        posture,
        posture_gain: 0.5,
        angular_weight: 0.3,
        damping: 0.05,
        damped_below: 0.02,
    }
}

fn twist_of(jacobian: &Jacobian, speeds: &[f64]) -> [f64; 6] {
    jacobian.rows().times_vector(speeds).try_into().unwrap()
}

fn assert_near(one: &[f64], other: &[f64], most: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!(one.len(), other.len());
    for (a, b) in one.iter().zip(other) {
        prop_assert!((a - b).abs() <= most, "{:?} is not {:?}", one, other);
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_jacobian_of_a_chain_is_the_slope_of_its_hand((chain, angles) in chains()) {
        let jacobian = chain.jacobian(&angles).unwrap();
        for joint in 0..angles.len() {
            let at = |step: f64| {
                let mut angles = angles.clone();
                angles[joint] += step;
                chain.world_from_hand(&angles).unwrap()
            };
            let change = change_between(&at(-STEP), &at(STEP)).unwrap();
            let column: Vec<f64> = (0..6).map(|row| jacobian.rows().at(row, joint)).collect();
            assert_near(&column, &change.map(|x| x / (2.0 * STEP)), 1e-8)?;
        }
    }

    #[test]
    fn a_change_leads_from_one_pose_to_the_other(before in six(1.5), after in six(1.5)) {
        let (before, after) = (pose(before), pose(after));
        let change = change_between(&before, &after).unwrap();
        let reached = shifted_and_turned(&before, &change).unwrap();
        assert_near(reached.matrix().as_slice(), after.matrix().as_slice(), 1e-12)?;
    }

    #[test]
    fn products_and_inverses_of_moving_poses_have_the_derivatives_of_their_matrices(
        a in six(1.0), b in six(1.0), turning in six(0.8), sliding in six(0.8),
    ) {
        // Motions of constant twists in the world, whose second derivatives are exact as well.
        let at = |time_s: f64| {
            let moved = |start: [f64; 6], twist: [f64; 6]| {
                let change = twist.map(|x| time_s * x);
                shifted_and_turned(&pose(start), &change).unwrap()
            };
            (moved(a, turning), moved(b, sliding))
        };
        let (first, second) = at(0.0);
        let moving = (
            Moving::from_twist(&first, &turning, None),
            Moving::from_twist(&second, &sliding, None),
        );
        let found = &moving.0.inverse().unwrap() * &moving.1;
        let matrix = |time_s: f64| {
            let (one, other) = at(time_s);
            (one.inverse() * other).matrix().transpose()
        };
        let step = 1e-4;
        let (before, now, after) = (matrix(-step), matrix(0.0), matrix(step));
        assert_near(&found.matrix().numbers, now.as_slice(), 1e-12)?;
        assert_near(&found.first().numbers, ((after - before) / (2.0 * step)).as_slice(), 1e-6)?;
        let bent = (after - 2.0 * now + before) / (step * step);
        assert_near(&found.second().numbers, bent.as_slice(), 1e-5)?;
    }

    #[test]
    fn a_moving_pose_keeps_its_twist(start in six(1.5), twist in six(1.0)) {
        let moving = Moving::from_twist(&pose(start), &twist, None);
        assert_near(&moving.twist(), &twist, 1e-12)?;
        let slowed = Moving::from_twist(&pose(start), &twist, Some(&[0.0; 6]));
        prop_assert_eq!(moving, slowed);
    }

    #[test]
    fn a_twist_within_lengths_keeps_its_direction(
        twist in six(3.0), linear in 0.01..3.0_f64, angular in 0.01..3.0_f64,
    ) {
        let [first, second] = shares(&twist, [linear, angular]);
        prop_assert!(first <= 1.0 && second <= 1.0);
        let found = within(&twist, [linear, angular]);
        for (part, (share, most)) in [(first, linear), (second, angular)].into_iter().enumerate() {
            let length = |twist: &[f64]| {
                twist[3 * part..3 * part + 3].iter().fold(0.0, |sum, x| sum + x * x).sqrt()
            };
            prop_assert!(length(&found) <= most * (1.0 + 1e-12));
            prop_assert!(share == 1.0 || length(&found) >= most * (1.0 - 1e-12));
            assert_near(&found[3 * part..3 * part + 3], &[0, 1, 2].map(|i| share * twist[3 * part + i]), 0.0)?;
        }
    }

    #[test]
    fn a_hand_at_rest_is_led_straight_to_a_goal_at_rest(hand in six(1.0), change in six(0.4)) {
        let hand = pose(hand);
        let goal = shifted_and_turned(&hand, &change).unwrap();
        let error = Moving::at_rest(&(hand.inverse() * goal));
        let gains = HandGains { position: 2.0, position_rate: 0.1, turn: 4.0, turn_rate: 0.2 };
        let twist = correction(&error, &hand, &gains).unwrap();
        assert_near(&twist[..3], &[0, 1, 2].map(|i| 2.0 * change[i]), 1e-12)?;
        let angle = change[3..].iter().fold(0.0, |sum, x| sum + x * x).sqrt();
        prop_assume!(angle > 1e-6);
        let sine = (0.5 * angle).sin();
        assert_near(&twist[3..], &[3, 4, 5].map(|i| 4.0 * sine * change[i] / angle), 1e-12)?;
        let off = quaternion_error(&error).unwrap();
        let length = off.iter().fold(0.0, |sum, x| sum + x * x).sqrt();
        prop_assert!((length - sine.abs()).abs() < 1e-12);
    }

    #[test]
    fn joints_move_the_hand_as_wanted_where_no_direction_is_damped(twist in six(0.3)) {
        let (chain, angles) = bent();
        let jacobian = chain.jacobian(&angles).unwrap();
        let law = law(vec![0.0; 7]);
        let (speeds, weights) = law.setpoint(&jacobian, &angles, &twist).unwrap();
        assert_near(&twist_of(&jacobian, &speeds), &twist, 1e-5)?;
        assert_near(&weights.numbers, &weights.transposed().numbers, 1e-12)?;
        let lost = lost_speed(&jacobian, &twist, law.angular_weight, law.damped_below).unwrap();
        prop_assert_eq!(lost, 0.0);
    }

    #[test]
    fn a_straight_arm_loses_speed_along_itself_and_turns_no_joint_fast(speed in 0.05..0.5_f64) {
        let (chain, _) = bent();
        let jacobian = chain.jacobian(&[0.0; 7]).unwrap();
        let law = law(vec![0.0; 7]);
        let along = [0.0, 0.0, speed, 0.0, 0.0, 0.0];
        let lost = lost_speed(&jacobian, &along, law.angular_weight, law.damped_below).unwrap();
        // A straight arm can move in no more than three directions, and shifts along itself are in
        // one to three of the others.
        prop_assert!(lost <= speed + 1e-9 && lost >= speed / 3.0_f64.sqrt() - 1e-9, "{}", lost);
        let (speeds, _) = law.setpoint(&jacobian, &[0.0; 7], &along).unwrap();
        prop_assert!(speeds.iter().all(|x| x.abs() < speed / law.damping));
    }

    #[test]
    fn newton_turns_lead_a_hand_to_near_goals(change in six(0.05)) {
        let (chain, mut angles) = bent();
        let goal = shifted_and_turned(&chain.world_from_hand(&angles).unwrap(), &change).unwrap();
        for _ in 0..8 {
            let left = change_between(&chain.world_from_hand(&angles).unwrap(), &goal).unwrap();
            let turn = newton_turn(&chain.jacobian(&angles).unwrap(), &left).unwrap();
            prop_assert!(turn.iter().all(|x| x.abs() <= 0.3 + 1e-12));
            angles.iter_mut().zip(turn).for_each(|(angle, turn)| *angle += turn);
        }
        let left = change_between(&chain.world_from_hand(&angles).unwrap(), &goal).unwrap();
        assert_near(&left, &[0.0; 6], 1e-9)?;
    }

    #[test]
    fn rates_of_the_gaze_are_the_slopes_of_its_angles(
        hand in six(1.0), head in six(0.3), twist in six(1.0), shown in six(0.3),
    ) {
        let [a, b, c, u, v, w] = shown;
        let (hand, head) = (pose(hand), pose(head));
        let point = (hand * head).transform(&[a, b, 0.8 + c].into());
        let gaze = |time_s: f64| {
            let moved = shifted_and_turned(&hand, &twist.map(|x| time_s * x)).unwrap();
            let at = [point.x + time_s * u, point.y + time_s * v, point.z + time_s * w];
            let (place, velocity) = seen_from_head(&moved, &head, &twist, at, [u, v, w]);
            fixation(0.1, place, velocity)
        };
        let (before, after) = (gaze(-STEP).angles, gaze(STEP).angles);
        let slopes = [0, 1, 2].map(|i| (after[i] - before[i]) / (2.0 * STEP));
        assert_near(&gaze(0.0).rates, &slopes, 1e-6)?;
    }
}

#[test]
fn weights_of_the_hand_measure_its_motion_and_a_little_of_the_joints() {
    let (chain, angles) = bent();
    let jacobian = chain.jacobian(&angles).unwrap();
    let (weights, speeds) = (hand_weights(&jacobian, 0.3), [0.1, -0.2, 0.3, 0.0, 0.1, 0.2, -0.1]);
    let square = |row: &[f64]| row.iter().fold(0.0, |sum, x| sum + x * x);
    let found = Rows { numbers: speeds.to_vec(), columns: 7 }.times(&weights).times_vector(&speeds);
    let twist = twist_of(&jacobian, &speeds);
    let expected = square(&twist[..3]) + 0.09 * square(&twist[3..]) + 1e-3 * square(&speeds);
    assert!((found[0] - expected).abs() < 1e-12);
}

#[test]
fn what_does_not_fit_an_arm_is_refused_in_words() {
    let (chain, angles) = bent();
    let words = |error: ArmError| error.to_string();
    assert_eq!(
        words(Chain::new(&[], &Pose::identity()).unwrap_err()),
        "a chain needs a link at least, but has none"
    );
    assert_eq!(
        words(chain.jacobian(&angles[..6]).unwrap_err()),
        "a chain of 7 joints needs an angle for each of them, but 6 were given"
    );
    let mut odd = angles.clone();
    odd[2] = f64::NAN;
    assert_eq!(
        words(chain.world_from_hand(&odd).unwrap_err()),
        "a pose must be made of finite numbers, but it holds NaN"
    );
    assert_eq!(
        words(Jacobian::new(Rows::zeros(5, 7)).unwrap_err()),
        "a Jacobian of a hand must have 6 rows of a number for each joint, but has 5 rows"
    );
    let jacobian = chain.jacobian(&angles).unwrap();
    assert_eq!(
        words(law(vec![0.0; 6]).setpoint(&jacobian, &angles, &[0.0; 6]).unwrap_err()),
        "the preferred angles of joints must be 7 numbers for this arm, but 6 were given"
    );
    let odd = Jacobian::new(Rows { numbers: vec![f64::INFINITY; 42], columns: 7 }).unwrap();
    for error in [
        law(vec![0.0; 7]).setpoint(&odd, &angles, &[0.0; 6]).unwrap_err(),
        lost_speed(&odd, &[0.0; 6], 0.3, 0.02).unwrap_err(),
    ] {
        assert_eq!(error, ArmError::NotFinite);
    }
}
