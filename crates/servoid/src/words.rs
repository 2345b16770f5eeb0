//! Formats numbers for people, and the words that depend on them.

use std::fmt::{Display, Formatter, Result};

/// Most digits of a number in a message.
const MOST: usize = 6;

/// A number written with six digits at most, and with an exponent where it is very large or very
/// small.
#[derive(Debug, Clone, Copy)]
pub struct Digits(pub f64);

impl Display for Digits {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        let Self(number) = *self;
        let rounded = format!("{number:.*e}", MOST - 1);
        let Some((digits, exponent)) = rounded.split_once('e') else {
            return write!(formatter, "{number}"); // NaN or infinite
        };
        match exponent.parse::<i32>() {
            Ok(exponent) if (-4..MOST as i32).contains(&exponent) => {
                let places = (MOST as i32 - 1 - exponent).unsigned_abs() as usize;
                formatter.write_str(short(&format!("{number:.places$}")))
            }
            _ => write!(formatter, "{}e{exponent}", short(digits)),
        }
    }
}

/// Time stamps from this on, in seconds, cannot come from a clock.
const LAST_SECOND: f64 = 1e12;

/// A time stamp to a millisecond, however long ago the clock's epoch was; a number that no clock
/// reports has six digits at most.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seconds(pub f64);

impl Display for Seconds {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        let Self(time) = *self;
        if time.abs() < LAST_SECOND {
            write!(formatter, "{time:.3}")
        } else {
            Digits(time).fmt(formatter)
        }
    }
}

/// Returns `was` for a count of one and `were` for others.
pub(crate) fn were(count: usize) -> &'static str {
    if count == 1 { "was" } else { "were" }
}

/// Returns the plural `s`, or nothing for a count of one.
pub(crate) fn s(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// Removes trailing zeros of a number's fraction.
fn short(text: &str) -> &str {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { text }
}

#[cfg(test)]
mod tests {
    use super::{Digits, Seconds};

    #[test]
    fn a_number_has_six_digits_at_most() {
        let written = |number| Digits(number).to_string();
        assert_eq!(written(-0.010_314_628_053_750_43), "-0.0103146");
        assert_eq!(written(1e308), "1e308");
        assert_eq!(written(123_456.7), "123457");
        assert_eq!(written(999_999.9), "1e6");
        assert_eq!(written(1.5e-9), "1.5e-9");
        assert_eq!(written(0.25), "0.25");
        assert_eq!(written(100.0), "100");
        assert_eq!(written(0.0), "0");
        assert_eq!(written(f64::NAN), "NaN");
        assert_eq!(written(f64::NEG_INFINITY), "-inf");
    }

    #[test]
    fn a_time_stamp_is_written_to_a_millisecond_if_a_clock_can_show_it() {
        assert_eq!(Seconds(1_795_000_000.033).to_string(), "1795000000.033");
        assert_eq!(Seconds(-0.5).to_string(), "-0.500");
        assert_eq!(Seconds(1e308).to_string(), "1e308");
    }
}
