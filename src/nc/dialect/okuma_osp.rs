//! Okuma OSP-P200M, P300: TCP by G169 with the tool length in the same block, ended by G170.

use super::style::{Style, Templates};
use super::words::{about, style_with_length_in_tcp};
use super::{Lexical, Rules};
use crate::nc::code::{GCode, MCode};

/// How an Okuma OSP reads programs.
pub(super) fn reading() -> Rules {
    let mut rules =
        Rules::of_words(Lexical { blanks_in_numbers: false, semicolon_comments: false, max_block_length: None });
    // The usual codes of work offsets and tool length mean something else; a machine file names its own.
    rules.set_g(&[430, 490, 530], GCode::Unknown);
    rules.set_g(&[150], GCode::NumberedWorkOffset { tenths: 150, letter: b'H' });
    rules.set_g(&[540, 550, 560, 570, 580, 590], GCode::Unsupported);
    rules.set_g(&[610], GCode::ExactPath);
    rules.set_g(&[640], GCode::Harmless(0));
    rules.set_g(&[60, 160, 220, 300, 310, 600, 620, 690, 1000, 1010, 1020, 1030, 1160, 1680, 1690], GCode::Unsupported);
    rules.set_m(&[10, 11, 12, 13, 19, 20, 21, 26, 27], MCode::Harmless(0));
    rules.set_m(&[510, 511], MCode::Harmless(0));
    rules
}

/// How programs for an Okuma OSP are written.
pub(super) fn writing() -> Style {
    let style = style_with_length_in_tcp();
    Style {
        templates: Templates {
            header: concat!(
                "O{{ number | pad(4) }}\n{{ name | comment }}\n",
                about!(),
                "{% if inch %}G20{% else %}G21{% endif %} G90 G17 G40 G80 G94
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
        ..style
    }
}
