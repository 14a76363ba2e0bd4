//! Numbers as programs are written: fixed decimals, no exponent, no signed zero. Uses nothing of the crate.

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

/// As [`steps`], rounded up.
pub(super) fn steps_above(value: f64, digits: u8) -> Option<i64> {
    exact((value * scale(digits)).ceil())
}

/// The value of a number of steps.
pub(super) fn value_of(steps: i64, digits: u8) -> f64 {
    steps as f64 / scale(digits)
}

fn scale(digits: u8) -> f64 {
    POWERS.get(usize::from(digits)).copied().unwrap_or(1e9)
}

/// Powers of ten by the number of decimals.
const POWERS: [f64; 10] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9];

fn exact(steps: f64) -> Option<i64> {
    (steps.abs() < EXACT).then_some(steps as i64)
}

/// How numbers look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct NumberStyle {
    /// A plus sign before what is not negative.
    pub(super) plus: bool,
    /// A point behind whole numbers too.
    pub(super) point_always: bool,
    /// The decimal sign.
    pub(super) point: u8,
}

impl NumberStyle {
    /// As programs of words have it: `-12.5`, `7.`.
    pub(super) const WORDS: Self = Self { plus: false, point_always: true, point: b'.' };
}

/// Writes a number of steps of the last of `digits` decimals (at most 9): at least one digit before the point, no
/// trailing zeros, no sign on zero but a plus where the style has one.
pub(super) fn push_steps(out: &mut String, steps: i64, digits: u8, style: NumberStyle) {
    // 20 digits of a u64, a sign and a point.
    let mut buffer = [0_u8; 24];
    let mut at = buffer.len();
    let mut put = |byte: u8, at: &mut usize| {
        *at -= 1;
        if let Some(place) = buffer.get_mut(*at) {
            *place = byte;
        }
    };
    let mut left = steps.unsigned_abs();
    let mut decimals = digits.min(9);
    while decimals > 0 && left.is_multiple_of(10) {
        left /= 10;
        decimals -= 1;
    }
    if decimals > 0 || style.point_always {
        for _ in 0..decimals {
            put(b'0' + (left % 10) as u8, &mut at);
            left /= 10;
        }
        put(style.point, &mut at);
    }
    loop {
        put(b'0' + (left % 10) as u8, &mut at);
        left /= 10;
        if left == 0 {
            break;
        }
    }
    if steps < 0 {
        put(b'-', &mut at);
    } else if style.plus {
        put(b'+', &mut at);
    }
    out.push_str(buffer.get(at..).and_then(|text| std::str::from_utf8(text).ok()).unwrap_or_default());
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
            push_steps(&mut out, steps(value, digits).unwrap(), digits, NumberStyle::WORDS);
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
        fn written_steps_read_back(written in -1_000_000_000_000_i64..1_000_000_000_000, digits in 0_u8..8, plus: bool, comma: bool) {
            let mut out = String::new();
            let point = if comma { b',' } else { b'.' };
            push_steps(&mut out, written, digits, NumberStyle { plus, point_always: !comma, point });
            let (rest, number) = decimal(out.as_bytes(), false, comma).unwrap();
            prop_assert!(rest.is_empty() && (comma || number.point));
            prop_assert_eq!(out.starts_with('+'), plus && written >= 0);
            prop_assert_eq!(steps(number.value, digits), Some(written));
            prop_assert_eq!(number.value, value_of(written, digits));
        }
    }
}
