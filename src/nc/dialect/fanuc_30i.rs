//! Fanuc series 30i, 31i, 32i.

use super::{Lexical, Rules, Style, plain};
use crate::nc::code::{GCode, MCode, letters};
use crate::nc::feed_rules::FeedRules;

/// How a Fanuc 30i reads programs.
pub(super) fn reading() -> Rules {
    let mut rules =
        Rules::empty(Lexical { blanks_in_numbers: false, semicolon_comments: false, max_block_length: None });
    rules.common_codes();
    rules.set_g(&[541], GCode::ExtendedWorkOffset(541));
    rules.set_g(&[610], GCode::ExactPath);
    // High-speed and high-precision modes, stroke checks, and ends of modes that are not followed when they begin.
    rules.set_g(&[51, 50, 80], GCode::Harmless(letters("PQR")));
    rules.set_g(&[90, 150, 220, 230, 500, 501, 620, 630, 640, 670, 690], GCode::Harmless(letters("PQ")));
    rules.set_g(
        &[
            70, 110, 160, 270, 290, 301, 310, 330, 431, 435, 440, 510, 511, 531, 600, 650, 660, 661, 680, 682, 683,
            740, 760, 932, 960,
        ],
        GCode::Unsupported,
    );
    rules.set_m(&[10, 11, 12, 13, 19, 29], MCode::Harmless(0));
    rules.point_needed = true;
    rules.dwell_unit = 1e-3;
    rules.m_codes_per_block = 3;
    rules
}

/// How a Fanuc 30i applies F words.
pub(super) fn feed_rules() -> FeedRules {
    FeedRules { slowest_inverse_time: None, degrees_count_without_tcp: true }
}

/// How programs for a Fanuc 30i are written.
pub(super) fn writing() -> Style {
    Style {
        opening: |number, name| vec!["%".into(), format!("O{number:04} ({})", capitals(name))],
        comment: capitals,
        safe_start: "G21 G90 G17 G40 G49 G80 G94",
        closing: &["M30", "%"],
        tcp_with_length: true,
        whole_spindle_speed: true,
    }
}

/// Comments hold capitals only.
fn capitals(text: &str) -> String {
    plain(text).to_ascii_uppercase()
}
