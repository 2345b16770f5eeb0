//! Rigid motions of any numbers.

use nalgebra::{Matrix4, Vector3};
use servoid::camera::Camera;
use servoid::pose::{EulerSequence, Pose, Twist};

use super::draw::Draw;

const LARGE: f64 = 1e6;
const NAMES: [&str; 9] = ["xyz", "XYZ", "zyx", "zxz", "ZYZ", "x", "xy", "xxy", "äöü"];

pub fn any(draw: &mut Draw) -> Result<(), String> {
    let twist = Twist::from_row_slice(&draw.numbers::<6>());
    let moved = Pose::exp(&twist);
    if twist.iter().all(|x| x.abs() < LARGE) {
        same(&Pose::exp(&moved.log()), &moved, "exp(log)")?;
        same(&(moved * moved.inverse()), &Pose::identity(), "a motion and back")?;
    }
    if let Ok(pose) = Pose::from_parts(draw.numbers(), draw.numbers()) {
        whole(&pose)?;
        let matrix = Pose::from_matrix(&pose.matrix()).map_err(|e| format!("own matrix: {e}"))?;
        same(&matrix, &pose, "from_matrix(matrix)")?;
    }
    let mut matrix = draw.pose().matrix();
    matrix[(draw.below(4), draw.below(4))] = draw.number();
    if let Ok(pose) = Pose::from_matrix(&matrix) {
        whole(&pose)?;
    }
    let _ = Pose::from_matrix(&Matrix4::from_row_slice(&draw.numbers::<16>()));
    angles(draw)?;
    if let Some(camera) = draw.camera() {
        seen(&camera, draw)?;
    }
    Ok(())
}

fn angles(draw: &mut Draw) -> Result<(), String> {
    let Ok(sequence) = EulerSequence::from_name(draw.pick(&NAMES)) else { return Ok(()) };
    let given: Vec<f64> = (0..sequence.count()).map(|_| draw.within(-4.0, 4.0)).collect();
    let pose = Pose::from_rotation(sequence.rotation(&given), Vector3::zeros());
    if let Ok(found) = sequence.angles(&pose) {
        let again = Pose::from_rotation(sequence.rotation(&found), Vector3::zeros());
        same(&again, &pose, "Euler angles")?;
    }
    Ok(())
}

fn seen(camera: &Camera, draw: &mut Draw) -> Result<(), String> {
    let point = Vector3::from(draw.numbers());
    let Some(pixel) = camera.project(&point) else { return Ok(()) };
    let is_fair = point.iter().all(|x| x.abs() < LARGE) && point.z > 1e-3;
    if is_fair && !pixel.iter().all(|x| x.is_finite()) {
        return Err(format!("{point:?} is seen at {pixel:?} by {camera:?}"));
    }
    Ok(())
}

fn whole(pose: &Pose) -> Result<(), String> {
    let turn = pose.rotation().into_inner().norm();
    let is_whole = (turn - 1.0).abs() < 1e-9 && pose.translation().iter().all(|x| x.is_finite());
    if is_whole { Ok(()) } else { Err(format!("a pose that is none was let in: {pose:?}")) }
}

fn same(one: &Pose, other: &Pose, what: &str) -> Result<(), String> {
    let reach = 1.0 + other.translation().norm();
    let apart = (one.translation() - other.translation()).norm() / reach;
    let turned = one.rotation().angle_to(&other.rotation());
    if apart < 1e-6 && turned < 1e-6 {
        return Ok(());
    }
    Err(format!("{what} is {apart} and {turned} off: {one:?} instead of {other:?}"))
}
