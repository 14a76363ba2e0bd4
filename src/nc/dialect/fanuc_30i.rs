//! Fanuc series 30i, 31i, 32i: TCP with angles (G43.4) and with tool vectors (G43.5).

use super::style::Style;
use super::words::style_with_length_in_tcp;
use super::{Lexical, Rules};
use crate::nc::code::{GCode, MCode, letters};

/// How a Fanuc 30i reads programs.
pub(super) fn reading() -> Rules {
    let mut rules =
        Rules::of_words(Lexical { blanks_in_numbers: false, semicolon_comments: false, max_block_length: None });
    rules.set_g(&[541], GCode::NumberedWorkOffset { tenths: 541, letter: b'P' });
    rules.set_g(&[610], GCode::ExactPath);
    // High-speed and high-precision modes, stroke checks, and ends of modes that are not followed when they begin.
    rules.set_g(&[51, 50, 80], GCode::Harmless(letters("PQR")));
    rules.set_g(&[90, 150, 220, 230, 500, 501, 620, 630, 640, 670, 690], GCode::Harmless(letters("PQ")));
    rules.set_g(
        &[
            70, 110, 160, 270, 290, 301, 310, 330, 431, 434, 435, 440, 510, 511, 531, 600, 650, 660, 661, 680, 682,
            683, 740, 760, 932, 960,
        ],
        GCode::Unsupported,
    );
    rules.set_m(&[10, 11, 12, 13, 19, 29], MCode::Harmless(0));
    rules.dwell_unit = 1e-3;
    rules.m_codes_per_block = 3;
    rules
}

/// How programs for a Fanuc 30i are written.
pub(super) fn writing() -> Style {
    style_with_length_in_tcp()
}
