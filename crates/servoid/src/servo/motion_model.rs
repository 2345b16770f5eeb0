//! Motion models of one coordinate: what position, speed and acceleration become.

/// A motion model, driven by white-noise jerk of density `jerk` per s² and root s.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum MotionModel {
    /// The acceleration decays with a time constant.
    ///
    /// Source: Singer, *Estimating optimal tracking filter performance for manned maneuvering
    /// targets* (1970).
    Singer {
        /// Density of the jerk.
        jerk: f64,
        /// Time constant in seconds.
        lasting_s: f64,
    },
    /// An oscillation about any position.
    Oscillation {
        /// Density of the jerk.
        jerk: f64,
        /// Period in seconds.
        period_s: f64,
    },
}

/// What position, speed and acceleration become: rows of a matrix.
pub(super) type Transition = [[f64; 3]; 3];

impl MotionModel {
    /// Returns the density of the jerk.
    #[must_use]
    pub fn jerk(&self) -> f64 {
        let (Self::Singer { jerk, .. } | Self::Oscillation { jerk, .. }) = *self;
        jerk
    }

    /// Returns what position, speed and acceleration become in a time, by rows.
    #[must_use]
    pub fn moved(&self, span_s: f64) -> [[f64; 3]; 3] {
        match *self {
            Self::Singer { lasting_s, .. } => fading_acceleration(span_s, lasting_s),
            Self::Oscillation { period_s, .. } => {
                let rate = 2.0 * std::f64::consts::PI / period_s;
                let (along, across) = (libm::cos(rate * span_s), libm::sin(rate * span_s));
                [
                    [1.0, across / rate, (1.0 - along) / (rate * rate)],
                    [0.0, along, across / rate],
                    [0.0, -rate * across, along],
                ]
            }
        }
    }
}

/// The expected kinds of motion, and the correlation time of estimation errors.
///
/// At rest, the position is a random walk of `rest` per root s; in motion, it follows one of several
/// models. Each mode lasts about `change_s`. Errors that estimates share decay with `lasting_s`.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPrior {
    /// Random walk at rest, per root s.
    pub rest: f64,
    /// The models of motion; none if the object only rests.
    pub models: Vec<MotionModel>,
    /// Mean duration of a mode in seconds.
    pub change_s: f64,
    /// Time constant of shared errors in seconds.
    pub lasting_s: f64,
}

/// Returns the transition of position, speed and decaying acceleration.
fn fading_acceleration(span_s: f64, lasting_s: f64) -> Transition {
    let share = span_s / lasting_s;
    let (left, gained) = (libm::exp(-share), -libm::expm1(-share));
    [
        [1.0, span_s, lasting_s * lasting_s * (share - gained)],
        [0.0, 1.0, lasting_s * gained],
        [0.0, 0.0, left],
    ]
}

/// Returns the covariance of position, speed and acceleration after a time of unit white jerk.
pub(super) fn white_jerk(span_s: f64) -> Transition {
    let mut powers = [span_s; 5];
    for i in 1..5 {
        powers[i] = powers[i - 1] * span_s;
    }
    let [one, two, three, four, five] = powers;
    [
        [five / 20.0, four / 8.0, three / 6.0],
        [four / 8.0, three / 3.0, two / 2.0],
        [three / 6.0, two / 2.0, one],
    ]
}
