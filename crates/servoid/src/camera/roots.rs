//! Zeros of polynomials and of increasing functions, as needed to invert a lens model.

/// Returns the smallest zero in (0, `until`) at which a polynomial changes its sign.
///
/// Coefficients are in increasing order of powers. Between neighbouring zeros of its derivative a
/// polynomial is monotonic, so each such interval has one zero at most, and bisection finds it.
pub(super) fn first_zero(polynomial: &[f64], until: f64) -> Option<f64> {
    zeros(polynomial, until).first().copied()
}

fn zeros(polynomial: &[f64], until: f64) -> Vec<f64> {
    if polynomial.len() < 2 {
        return Vec::new();
    }
    let powers = polynomial.iter().enumerate().skip(1);
    let slope: Vec<f64> = powers.map(|(power, a)| a * power as f64).collect();
    let mut marks = vec![0.0];
    marks.extend(zeros(&slope, until));
    marks.push(until);
    let pieces = marks.windows(2);
    pieces.filter_map(|piece| zero_between(polynomial, piece[0], piece[1])).collect()
}

fn zero_between(polynomial: &[f64], mut low: f64, mut high: f64) -> Option<f64> {
    let rises = value(polynomial, high) > 0.0;
    if rises == (value(polynomial, low) > 0.0) {
        return None;
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return Some(low);
        }
        if (value(polynomial, middle) > 0.0) == rises {
            high = middle;
        } else {
            low = middle;
        }
    }
}

fn value(polynomial: &[f64], x: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, a| sum * x + a)
}

/// Returns the argument in [0, `until`] at which an increasing function reaches `target`, or the
/// end of the interval that comes closest to it. The function returns its value and its slope.
pub(super) fn reach(function: impl Fn(f64) -> (f64, f64), target: f64, until: f64) -> f64 {
    let (mut low, mut high) = (0.0, until);
    if function(high).0 <= target {
        return high;
    }
    let mut at = target.clamp(low, high);
    // Newton's steps, and bisection where a step would leave the bracket.
    for _ in 0..100 {
        let (value, slope) = function(at);
        if (value - target).abs() <= 4.0 * f64::EPSILON * target {
            return at;
        }
        if value > target {
            high = at;
        } else {
            low = at;
        }
        let step = at - (value - target) / slope;
        at = if step > low && step < high { step } else { 0.5 * (low + high) };
    }
    at
}
