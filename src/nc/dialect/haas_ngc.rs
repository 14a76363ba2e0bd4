//! Haas Next Generation Control: TCP by G234 with the tool length in the same block.

use super::style::{Style, Templates};
use super::words::{about, known_state, style_with_length_in_tcp};
use super::{Lexical, Rules};
use crate::nc::code::{GCode, MCode, letters};

/// How a Haas NGC reads programs.
pub(super) fn reading() -> Rules {
    let mut rules =
        Rules::of_words(Lexical { blanks_in_numbers: false, semicolon_comments: false, max_block_length: None });
    rules.set_g(&[1540], GCode::NumberedWorkOffset { tenths: 1540, letter: b'P' });
    rules.set_g(&[610], GCode::ExactPath);
    // Smoothing, and ends of modes that are not followed when they begin.
    rules.set_g(&[1870], GCode::Harmless(letters("PE")));
    rules.set_g(&[50, 640, 690, 2550, 2690], GCode::Harmless(0));
    rules.set_g(
        &[
            90, 120, 130, 160, 290, 310, 350, 360, 370, 470, 500, 510, 600, 650, 680, 682, 740, 760, 1100, 1110, 1410,
            1430, 1500, 1530, 2340, 2530, 2540, 2680,
        ],
        GCode::Unsupported,
    );
    // Rotary brakes, chips, lights, coolant.
    rules.set_m(
        &[10, 11, 12, 13, 16, 17, 18, 19, 31, 33, 34, 35, 36, 39, 41, 42, 73, 74, 83, 84, 88, 89],
        MCode::Harmless(letters("PRQ")),
    );
    rules.set_m(&[95, 96, 97], MCode::Unsupported);
    rules.dwell_unit = 1e-3;
    rules.m_codes_per_block = 1;
    rules
}

/// How programs for a Haas NGC are written.
pub(super) fn writing() -> Style {
    let style = style_with_length_in_tcp();
    Style {
        templates: Templates {
            header: concat!("%\nO{{ number | pad(5) }} {{ name | comment }}\n", about!(), known_state!()),
            ..style.templates
        },
        ..style
    }
}
