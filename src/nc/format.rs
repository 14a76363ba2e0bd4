//! Numbers as programs are written: fixed decimals, point always, no exponent, no signed zero. Uses nothing of the
//! crate.

/// Largest number of steps that a float holds exactly.
const EXACT: f64 = (1_u64 << 53) as f64;

/// `value` in steps of the last of `digits` decimals, rounded to nearest; `None` where it is not finite or too large to
/// be written exactly.
pub(super) fn steps(value: f64, digits: u8) -> Option<i64> {
    exact((value * scale(digits)).round())
}

/// As [`steps`], rounded down.
pub(super) fn steps_below(value: f64, digits: u8) -> Option<i64> {
    exact((value * scale(digits)).floor())
}

/// The value of a number of steps.
pub(super) fn value_of(steps: i64, digits: u8) -> f64 {
    steps as f64 / scale(digits)
}

fn scale(digits: u8) -> f64 {
    10_f64.powi(i32::from(digits))
}

fn exact(steps: f64) -> Option<i64> {
    (steps.abs() < EXACT).then_some(steps as i64)
}

/// Writes a number of steps of the last of `digits` decimals: point always, at least one digit before it, no trailing
/// zeros, no sign on zero.
pub(super) fn push_steps(out: &mut String, steps: i64, digits: u8) {
    use std::fmt::Write;
    let width = usize::from(digits.min(15));
    let unit = 10_u64.pow(width as u32);
    let magnitude = steps.unsigned_abs();
    if steps < 0 {
        out.push('-');
    }
    let fraction = magnitude % unit;
    // Writing to a string cannot fail.
    let _ = write!(out, "{}.", magnitude / unit);
    if fraction > 0 {
        let _ = write!(out, "{fraction:0width$}");
        out.truncate(out.trim_end_matches('0').len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nc::number::decimal;
    use proptest::prelude::*;

    #[test]
    fn writes_no_signed_zero_and_no_trailing_zeros() {
        for (value, digits, text) in [
            (-0.000_4, 3, "0."),
            (-0.0, 3, "0."),
            (10.0, 3, "10."),
            (-0.05, 3, "-0.05"),
            (1.26, 1, "1.3"),
            (7.0, 0, "7."),
            (100.0, 0, "100."),
        ] {
            let mut out = String::new();
            push_steps(&mut out, steps(value, digits).unwrap(), digits);
            assert_eq!(out, text);
        }
    }

    #[test]
    fn refuses_what_is_no_number_to_a_control() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            assert_eq!(steps(value, 3), None);
            assert_eq!(steps_below(value, 3), None);
        }
    }

    proptest! {
        #[test]
        fn written_steps_read_back(written in -1_000_000_000_000_i64..1_000_000_000_000, digits in 0_u8..8) {
            let mut out = String::new();
            push_steps(&mut out, written, digits);
            let (rest, number) = decimal(out.as_bytes(), false).unwrap();
            prop_assert!(rest.is_empty() && number.point);
            prop_assert_eq!(steps(number.value, digits), Some(written));
            prop_assert_eq!(number.value, value_of(written, digits));
        }
    }
}
