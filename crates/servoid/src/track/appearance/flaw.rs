use thiserror::Error;

/// Why bytes are not an appearance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Flaw {
    /// They do not begin with the name of the format.
    #[error("they do not begin with servoap1 or servoap2")]
    Unknown,
    /// They end before the last entry does.
    #[error("they are cut short")]
    CutShort,
    /// Bytes follow the last entry.
    #[error("{0} more follow the last entry")]
    TooLong(usize),
    /// There are more entries of a kind than an object has.
    #[error("they hold {given} {what}, and an object has at most {most}")]
    TooMany {
        /// The kind of entry.
        what: &'static str,
        /// Entries given.
        given: usize,
        /// Entries allowed.
        most: usize,
    },
    /// A number is not finite.
    #[error("a number in them is not finite")]
    NotFinite,
    /// A flag is neither set nor cleared.
    #[error("a flag in them is neither 0 nor 1")]
    Flags,
    /// A direction or an orientation does not have the length 1.
    #[error("the {0} does not have the length 1")]
    NotUnit(&'static str),
    /// A number is outside of its range.
    #[error("the {0} is outside of its range")]
    Outside(&'static str),
}
