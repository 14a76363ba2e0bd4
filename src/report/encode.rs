//! Text and numbers as they may stand inside a page: escaped HTML, numbers without noise, lists as base64.

/// Text with the five characters that mean something in HTML replaced; control characters become blanks.
pub(super) fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            c if c.is_control() && c != '\n' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// JSON that cannot end the script element it stands in.
pub(super) fn script_json(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c")
}

/// A number with `decimals` digits after the point, thousands set apart by thin blanks, never a negative zero.
pub(super) fn number(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let negative = value < 0.0 && text.bytes().any(|b| (b'1'..=b'9').contains(&b));
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut out = String::from(if negative { "\u{2212}" } else { "" });
    for (i, digit) in whole.chars().enumerate() {
        if i > 0 && (whole.len() - i) % 3 == 0 && whole.len() > 4 {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    out + rest
}

/// Little-endian 32-bit floats in base64.
pub(super) fn floats(numbers: impl IntoIterator<Item = f64>) -> String {
    base64(numbers.into_iter().flat_map(|n| (n as f32).to_le_bytes()))
}

/// Little-endian 32-bit unsigned integers in base64.
pub(super) fn integers(numbers: impl IntoIterator<Item = u32>) -> String {
    base64(numbers.into_iter().flat_map(u32::to_le_bytes))
}

/// RFC 4648 base64 with padding.
fn base64(bytes: impl IntoIterator<Item = u8>) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut bytes = bytes.into_iter();
    let mut out = String::new();
    while let Some(first) = bytes.next() {
        let (second, third) = (bytes.next(), bytes.next());
        let group =
            u32::from(first) << 16 | u32::from(second.unwrap_or_default()) << 8 | u32::from(third.unwrap_or_default());
        let digit = |shift: u32| char::from(DIGITS[(group >> shift & 63) as usize]);
        out.push(digit(18));
        out.push(digit(12));
        out.push(if second.is_some() { digit(6) } else { '=' });
        out.push(if third.is_some() { digit(0) } else { '=' });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_matches_the_standard_vectors() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.bytes()), coded);
        }
        assert_eq!(floats([1.0, -2.5]), "AACAPwAAIMA=");
        assert_eq!(integers([1, u32::MAX]), "AQAAAP////8=");
    }

    #[test]
    fn text_cannot_leave_its_place() {
        assert_eq!(escape("<a b=\"c\" d='e'>&\u{7}"), "&lt;a b=&quot;c&quot; d=&#39;e&#39;&gt;&amp; ");
        assert!(!script_json(&serde_json::json!({"x": "</script><!--"})).contains('<'));
    }

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(-0.00001, 3), "0.000");
        assert_eq!(number(-1234567.891, 1), "\u{2212}1\u{2009}234\u{2009}567.9");
        assert_eq!(number(1234.0, 0), "1234");
    }
}
