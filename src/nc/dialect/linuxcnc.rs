//! LinuxCNC 2.9.

use super::style::{Style, Templates};
use super::words::{about, known_state, plain, style};
use super::{Lexical, Rules};
use crate::machine::DialectOptions;
use crate::nc::code::{GCode, MCode, letters};

/// How LinuxCNC reads programs.
pub(super) fn reading(options: &DialectOptions) -> Rules {
    let mut rules = Rules::of_words(Lexical {
        blanks_in_numbers: true,
        semicolon_comments: true,
        max_block_length: Some(options.max_block_length),
    });
    rs274_codes(&mut rules);
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

/// Codes of the RS-274/NGC interpreter beyond the common ones.
pub(super) fn rs274_codes(rules: &mut Rules) {
    for (code, meaning) in [
        (610, GCode::ExactPath),
        (611, GCode::ExactPath),
        (640, GCode::Blend),
        (901, GCode::ArcCentre { absolute: true }),
        (911, GCode::ArcCentre { absolute: false }),
        // Ends of G52 and G92 offsets, which are not followed when they begin.
        (921, GCode::Harmless(0)),
        (922, GCode::Harmless(0)),
        (800, GCode::MotionOff),
    ] {
        rules.set_g(&[code], meaning);
    }
    for code in [591, 592, 593] {
        rules.set_g(&[code], GCode::WorkOffset(code));
    }
    rules.set_g(
        &[
            50, 51, 52, 53, 60, 61, 62, 63, 70, 80, 171, 181, 191, 281, 301, 330, 331, 382, 383, 384, 385, 411, 421,
            431, 432, 700, 710, 711, 712, 720, 721, 722, 740, 760, 923, 960,
        ],
        GCode::Unsupported,
    );
}

/// How programs for LinuxCNC are written.
pub(super) fn writing() -> Style {
    let style = style();
    Style {
        templates: Templates {
            header: concat!("%\n{{ name | comment }}\n", about!(), known_state!()),
            // With TCP on, rapids may pass the speeds of the axes: the way there is done without, or else slowly and one
            // word at a time.
            approach: "{% if rotary and turn_feed %}G94 G1 {{ rotary }} F{{ turn_feed }}
{% elif rotary %}G0 {{ rotary }}
{% endif %}{% if switchable %}G0 {{ across }}
G0 {{ joint }}
{% if tcp %}{{ tcp_on }}
G0 {{ start }}
{% endif %}{% else %}{% for word in start_words %}G0 {{ word }}
{% endfor %}{% endif %}",
            end: "{{ length_off }}
M5
{% for line in end_lines %}{{ line }}
{% endfor %}M2
%
",
            ..style.templates
        },
        plain_text: plain,
        whole_spindle_speed: false,
        ..style
    }
}
