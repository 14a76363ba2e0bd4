//! LinuxCNC 2.9.

use super::{Lexical, Rules, Style, plain};
use crate::machine::DialectOptions;
use crate::nc::code::{GCode, MCode, letters};
use crate::nc::feed_rules::FeedRules;

/// How LinuxCNC reads programs.
pub(super) fn reading(options: &DialectOptions) -> Rules {
    let mut rules = Rules::empty(Lexical {
        blanks_in_numbers: true,
        semicolon_comments: true,
        max_block_length: Some(options.max_block_length),
    });
    rules.common_codes();
    for (code, meaning) in [
        (610, GCode::ExactPath),
        (611, GCode::ExactPath),
        (640, GCode::Blend),
        (901, GCode::ArcCentre { absolute: true }),
        (911, GCode::ArcCentre { absolute: false }),
        // Ends of G52 and G92 offsets, which are not followed when they begin.
        (921, GCode::Harmless(0)),
        (922, GCode::Harmless(0)),
        (80, GCode::Harmless(0)),
    ] {
        rules.set_g(&[code], meaning);
    }
    for code in [591, 592, 593] {
        rules.set_g(&[code], GCode::WorkOffset(code));
    }
    rules.set_g(
        &[
            50, 51, 52, 53, 60, 61, 62, 63, 70, 171, 181, 191, 281, 301, 330, 331, 382, 383, 384, 385, 411, 421, 431,
            432, 700, 710, 711, 712, 720, 721, 722, 740, 760, 923, 960,
        ],
        GCode::Unsupported,
    );
    rules.set_m(&[60], MCode::Stop);
    rules.set_m(&[19], MCode::Harmless(letters("RQP")));
    rules.set_m(&[48, 49, 50, 51, 52, 53, 62, 63, 64, 65], MCode::Harmless(letters("P")));
    rules.set_m(&[66], MCode::Harmless(letters("PELQ")));
    rules.set_m(&[67, 68], MCode::AnalogOutput);
    rules.set_m(&[61, 70, 71, 72, 73], MCode::Unsupported);
    rules.own_length = true;
    rules.blends_at_start = true;
    rules.end_needed = true;
    rules.arc_turns = true;
    // Four groups of M codes besides the user's own.
    rules.m_codes_per_block = 4;
    rules
}

/// How LinuxCNC applies F words.
pub(super) fn feed_rules() -> FeedRules {
    FeedRules { slowest_inverse_time: Some(0.1), degrees_count_without_tcp: false }
}

/// How programs for LinuxCNC are written.
pub(super) fn writing() -> Style {
    Style {
        opening: |_, name| vec!["%".into(), format!("({})", plain(name))],
        comment: plain,
        safe_start: "G21 G90 G17 G40 G49 G80 G94",
        closing: &["M2", "%"],
        tcp_with_length: false,
        whole_spindle_speed: false,
    }
}
