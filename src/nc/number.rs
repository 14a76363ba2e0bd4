//! Numbers as controls read them: a sign, digits, one decimal point; no exponent, no infinity. Uses nothing of the
//! crate.

use nom::error::{Error, ErrorKind};
use nom::{Err, IResult};

/// A number as it stands in a program.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decimal {
    /// Its value, correctly rounded.
    pub(super) value: f64,
    /// Whether a decimal point is written.
    pub(super) point: bool,
    /// Digits written after the point, at most 255.
    pub(super) decimals: u8,
}

/// Powers of ten that are exact in floating point.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Largest mantissa that is exact in floating point.
const EXACT: u64 = 1 << 53;

/// Larger numbers are none that a control reads.
const LARGEST: f64 = 1e30;

/// Reads one number from the start of `input`, which must not begin with a blank. With `blanks`, blanks between its
/// characters are skipped; blanks after its last digit are left. With `comma`, a comma is a decimal point too. Takes
/// linear time whatever the input.
pub(super) fn decimal(input: &[u8], blanks: bool, comma: bool) -> IResult<&[u8], Decimal> {
    let mut mantissa = 0_u64;
    let (mut digits, mut decimals, mut length) = (0_usize, 0_usize, 0_usize);
    let (mut point, mut exact) = (false, true);
    let signed = matches!(input.first(), Some(b'+' | b'-'));
    for (index, byte) in input.iter().enumerate().skip(usize::from(signed)) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                decimals += usize::from(point);
                exact &= mantissa < EXACT / 10;
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
            }
            b'.' if !point => point = true,
            b',' if comma && !point => point = true,
            b' ' | b'\t' if blanks => continue,
            _ => break,
        }
        length = index + 1;
    }
    let (text, rest) = input.split_at(length);
    if digits == 0 {
        return Err(Err::Error(Error::new(input, ErrorKind::Digit)));
    }
    let magnitude = match POWERS.get(decimals) {
        Some(power) if exact => Some(mantissa as f64 / power),
        _ => long_magnitude(text),
    };
    let Some(magnitude) = magnitude.filter(|value| *value <= LARGEST) else {
        return Err(Err::Error(Error::new(input, ErrorKind::TooLarge)));
    };
    let value = if input.first() == Some(&b'-') { -magnitude } else { magnitude };
    Ok((rest, Decimal { value, point, decimals: decimals.min(255) as u8 }))
}

/// The value of more digits than a float holds exactly.
fn long_magnitude(text: &[u8]) -> Option<f64> {
    let kept = text.iter().filter(|b| b.is_ascii_digit() || matches!(b, b'.' | b','));
    let digits: String = kept.map(|b| if *b == b',' { '.' } else { char::from(*b) }).collect();
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str) -> Option<f64> {
        decimal(text.as_bytes(), false, false).ok().map(|(_, number)| number.value)
    }

    #[test]
    fn reads_what_controls_read() {
        for (text, expected) in [
            ("10.", 10.0),
            ("10", 10.0),
            (".5", 0.5),
            ("-.5", -0.5),
            ("+1", 1.0),
            ("007", 7.0),
            ("-0", 0.0),
            ("0.1", 0.1),
            ("123456789012345678901234567890", 1.234_567_890_123_456_8e29),
            ("0.1000000000000000055511151231257827021181583404541015625", 0.1),
            ("1.5707963267948966192313216916397514420985846996875529", std::f64::consts::FRAC_PI_2),
        ] {
            assert_eq!(value(text), Some(expected), "{text}");
        }
    }

    #[test]
    fn refuses_what_controls_refuse() {
        for text in ["", "-", ".", "-.", "inf", "nan", "e3", "+-1", "#1", "[1]", " 1"] {
            assert_eq!(value(text), None, "{text}");
        }
        assert_eq!(value(&"9".repeat(400)), None);
    }

    #[test]
    fn stops_where_the_number_ends() {
        for (text, blanks, rest) in
            [("1e3", false, "e3"), ("1.2.3", true, ".3"), ("- 2 5. 5 X1", true, " X1"), ("2 5", false, " 5")]
        {
            let (left, _) = decimal(text.as_bytes(), blanks, false).unwrap();
            assert_eq!(std::str::from_utf8(left).unwrap(), rest);
        }
        assert_eq!(decimal(b"- 2 5. 5 X1", true, false).unwrap().1.value, -25.5);
    }

    #[test]
    fn a_comma_is_a_point_where_it_may_be() {
        assert_eq!(decimal(b"+12,5 Y", false, true).unwrap().1.value, 12.5);
        assert_eq!(decimal(b"12345678901234567890,5", false, true).unwrap().1.value, 12_345_678_901_234_567_890.5);
        assert_eq!(decimal(b"12,5", false, false).unwrap().0, b",5");
    }

    proptest! {
        #[test]
        fn reads_as_the_standard_library_does(text in "[-+]?[0-9]{1,25}(\\.[0-9]{0,25})?") {
            prop_assert_eq!(value(&text), Some(text.parse().unwrap()));
        }
    }
}
