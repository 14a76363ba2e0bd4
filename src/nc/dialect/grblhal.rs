//! grblHAL: joint coordinates and G93; no TCP unless a machine file names codes for it.

use super::style::{Style, Templates};
use super::words::{about, plain, style};
use super::{Lexical, Rules, linuxcnc};
use crate::machine::DialectOptions;
use crate::nc::code::{GCode, MCode, letters};

/// How grblHAL reads programs.
pub(super) fn reading(options: &DialectOptions) -> Rules {
    let mut rules = Rules::of_words(Lexical {
        blanks_in_numbers: true,
        semicolon_comments: true,
        max_block_length: Some(options.max_block_length),
    });
    linuxcnc::rs274_codes(&mut rules);
    // Corners are passed exactly whatever is asked for: the planner slows down for them.
    rules.set_g(&[640], GCode::Harmless(letters("PQ")));
    rules.set_m(&[60], MCode::Stop);
    rules.set_m(&[48, 49, 50, 51, 52, 53, 56, 62, 63, 64, 65], MCode::Harmless(letters("P")));
    rules.set_m(&[66, 67, 68], MCode::Harmless(letters("PELQ")));
    rules.set_m(&[61, 70, 71, 72, 73], MCode::Unsupported);
    rules.own_length = true;
    rules.arc_turns = true;
    rules
}

/// How programs for grblHAL are written.
pub(super) fn writing() -> Style {
    let style = style();
    Style {
        templates: Templates {
            header: concat!(
                "{{ name | comment }}\n",
                about!(),
                "{% if inch %}G20{% else %}G21{% endif %} G90 G17 G49 G80 G94
{% for line in start_lines %}{{ line }}
{% endfor %}"
            ),
            end: "{{ length_off }}
M5
{% for line in end_lines %}{{ line }}
{% endfor %}M2
",
            ..style.templates
        },
        plain_text: plain,
        whole_spindle_speed: false,
        ..style
    }
}
