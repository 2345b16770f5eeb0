//! The prediction of an object's position and rotation together.

use super::MotionError;
use super::measurement::fits;
use super::motion::{Mixture, Motion};
use crate::pose::exact::Rows;

/// The predicted motion of an object, its position before its rotation, in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct Prediction {
    /// Translation and rotation from the reference.
    pub change: [f64; 6],
    /// Their rates.
    pub twist: [f64; 6],
    /// The rates of these.
    pub acceleration: [f64; 6],
    /// The covariance of the change, 6x6, 0 about unobservable axes.
    pub covariance: Rows,
    /// The covariance of the twist, 6x6, 0 about unobservable axes.
    pub twist_covariance: Rows,
}

/// What is known of an object beside its filtered motions, as 3x3 matrices by rows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beside<'a> {
    /// Covariances to be added to those of position and rotation.
    pub hidden: [&'a [f64]; 2],
    /// The projection onto the axes about which the rotation is unobservable.
    pub open: &'a [f64],
}

/// Predicts an object by the motions of its position and its rotation, of three coordinates each,
/// at a time after the newest estimate.
///
/// # Errors
/// If a motion or a matrix is of other than three coordinates.
pub fn predict(
    motions: [&Motion; 2],
    beside: &Beside<'_>,
    span_s: f64,
) -> Result<Prediction, MotionError> {
    for motion in motions {
        fits("the motion of an object in space", 3, motion.coordinates())?;
    }
    for matrix in [beside.hidden[0], beside.hidden[1], beside.open] {
        fits("a matrix of an object in space", 9, matrix.len())?;
    }
    let ahead = motions.map(|motion| motion.ahead(span_s));
    let part = |first: usize| std::array::from_fn(|i| ahead[i / 3].state[first + i % 3]);
    let mut across = Rows::zeros(3, 3);
    for (at, (value, open)) in across.numbers.iter_mut().zip(beside.open).enumerate() {
        *value = if at % 4 == 0 { 1.0 } else { 0.0 } - open;
    }
    let hidden = beside.hidden.map(|numbers| Rows { numbers: numbers.to_vec(), columns: 3 });
    let [shift, turn] = [0, 1].map(|at| block(&ahead[at], 0).plus(&hidden[at]));
    let [speed, turning] = [0, 1].map(|at| block(&ahead[at], 3));
    Ok(Prediction {
        change: part(0),
        twist: part(3),
        acceleration: part(6),
        covariance: joined(&shift, &turn, &across),
        twist_covariance: joined(&speed, &turning, &across),
    })
}

/// Returns the twist of an object after a time, as far as it is certain.
///
/// `variances` are those of the twist. Its two parts are shortened if their deviations exceed `sure`,
/// in m/s and rad/s.
#[must_use]
pub fn certain_twist(
    twist: &[f64; 6],
    acceleration: &[f64; 6],
    after_s: f64,
    variances: &[f64; 6],
    sure: [f64; 2],
) -> [f64; 6] {
    let share = |part: usize| {
        let [x, y, z] = [0, 1, 2].map(|i| variances[3 * part + i]);
        let most = sure[part] * sure[part];
        (most / most.max(x + y + z)).sqrt()
    };
    let shares = [share(0), share(1)];
    std::array::from_fn(|i| (twist[i] + after_s * acceleration[i]) * shares[i / 3])
}

/// Returns the standard deviation of a point fixed to an object, `lever` from its origin in the
/// world, by the covariance 6x6 of the object's translation and rotation.
///
/// # Errors
/// If the covariance is not 6x6.
pub fn spread_at(covariance: &[f64], lever: [f64; 3]) -> Result<f64, MotionError> {
    fits("a covariance of a pose", 36, covariance.len())?;
    let [x, y, z] = lever;
    let carried = Rows {
        numbers: vec![
            1.0, 0.0, 0.0, 0.0, z, -y, //
            0.0, 1.0, 0.0, -z, 0.0, x, //
            0.0, 0.0, 1.0, y, -x, 0.0,
        ],
        columns: 6,
    };
    let covariance = Rows { numbers: covariance.to_vec(), columns: 6 };
    let spread = carried.times(&covariance).times(&carried.transposed());
    Ok((spread.at(0, 0) + spread.at(1, 1) + spread.at(2, 2)).sqrt())
}

/// Returns the 3x3 block of a covariance that begins at a row and the same column.
fn block(mixture: &Mixture, first: usize) -> Rows {
    let size = mixture.state.len();
    let rows = mixture.covariance.chunks_exact(size).skip(first).take(3);
    Rows { numbers: rows.flat_map(|row| row[first..first + 3].to_vec()).collect(), columns: 3 }
}

/// Joins covariances of translation and rotation to one, without unobservable rotations.
fn joined(shift: &Rows, turn: &Rows, across: &Rows) -> Rows {
    let turn = across.times(turn).times(across);
    let mut whole = Rows::zeros(6, 6);
    for row in 0..3 {
        for column in 0..3 {
            *whole.at_mut(row, column) = shift.at(row, column);
            *whole.at_mut(3 + row, 3 + column) = turn.at(row, column);
        }
    }
    whole
}
