use crate::pose::PoseError;

/// Why a motion of joints or of a hand cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ArmError {
    /// There are as many numbers as do not fit the arm.
    #[error("{what} must be {wanted} numbers for this arm, but {given} were given")]
    Size {
        /// What was given.
        what: &'static str,
        /// The number that fits.
        wanted: usize,
        /// The number that was given.
        given: usize,
    },
    /// Fewer angles were given than there are joints.
    #[error("a chain of {least} joints needs an angle for each of them, but {given} were given")]
    Few {
        /// The number that was given.
        given: usize,
        /// The number of joints.
        least: usize,
    },
    /// A chain has no link.
    #[error("a chain needs a link at least, but has none")]
    NoLink,
    /// Joints do not place the hand at a pose.
    #[error(transparent)]
    Pose(#[from] PoseError),
    /// More joints were given than there are.
    #[error("there are {most} joints, but {given} were given")]
    Count {
        /// The number that was given.
        given: usize,
        /// The number of joints.
        most: usize,
    },
    /// A Jacobian does not have a row for each coordinate of a twist.
    #[error("a Jacobian of a hand must have 6 rows of a number for each joint, but has {0} rows")]
    Rows(usize),
    /// The eigenvalues of what the hand's motion weighs cannot be found.
    #[error("a Jacobian must be made of finite numbers of plausible size")]
    NotFinite,
}

/// Checks the length of a row.
pub(super) fn fits(what: &'static str, wanted: usize, row: &[f64]) -> Result<(), ArmError> {
    if row.len() == wanted {
        return Ok(());
    }
    Err(ArmError::Size { what, wanted, given: row.len() })
}
