//! Heidenhain TNC 640 and iTNC 530, Klartext: L with rotary angles, LN with tool vectors, under M128 or FUNCTION TCPM.

mod lexer;

pub(super) use lexer::lex;

use super::style::{Style, Templates};
use super::words::style;
use super::{Rules, Syntax};
use crate::machine::TcpInterpolation;
use crate::nc::code::{GCode, MCode, Motion, SpindleTurn, WorkOffsetCode, letters};
use crate::nc::format::NumberStyle;

/// Words of the language in the order of [`Keyword`].
const KEYWORDS: &[(&str, GCode)] = &[
    ("L", GCode::Motion(Motion::Line)),
    ("LN", GCode::Motion(Motion::Line)),
    ("DR-", GCode::Motion(Motion::Arc { clockwise: true })),
    ("DR+", GCode::Motion(Motion::Arc { clockwise: false })),
    ("CC", GCode::CircleCentre),
    ("FMAX", GCode::RapidOnce),
    ("MM", GCode::Units { inch: false }),
    ("INCH", GCode::Units { inch: true }),
    ("TOOL CALL", GCode::ToolCall),
    ("PATHCTRL AXIS", GCode::TcpWith(TcpInterpolation::RotaryLinear)),
    ("PATHCTRL VECTOR", GCode::TcpWith(TcpInterpolation::GreatCircle)),
    ("RESET TCPM", GCode::Tcp(false)),
    ("CYCL DEF 247", GCode::NumberedWorkOffset { tenths: WorkOffsetCode::PRESET, letter: b'Q' }),
    ("CYCL DEF 32", GCode::Blend),
];

/// Index in [`KEYWORDS`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Keyword {
    Line,
    VectorLine,
    Clockwise,
    Counterclockwise,
    CircleCentre,
    Rapid,
    Mm,
    Inch,
    ToolCall,
    TcpmAxis,
    TcpmVector,
    TcpmReset,
    Preset,
    Tolerance,
}

/// How a TNC reads programs.
pub(super) fn reading() -> Rules {
    let mut rules = Rules::empty(Syntax::Klartext);
    rules.keywords = KEYWORDS;
    rules.rotary_tolerance = true;
    rules.common_m_codes();
    rules.set_m(&[13], MCode::Spindle(SpindleTurn::Clockwise));
    rules.set_m(&[14], MCode::Spindle(SpindleTurn::Counterclockwise));
    rules.set_m(&[91], MCode::MachineFrame);
    rules.set_m(&[126], MCode::ShortestWay(true));
    rules.set_m(&[127], MCode::ShortestWay(false));
    rules.set_m(&[128], MCode::Tcp(true));
    rules.set_m(&[129], MCode::Tcp(false));
    rules.set_m(&[10, 11, 12, 19, 25, 26, 27, 101, 102, 107, 108, 117, 137, 141], MCode::Harmless(0));
    rules.set_m(
        &[
            89, 90, 92, 94, 97, 98, 99, 103, 104, 105, 106, 109, 110, 111, 112, 113, 114, 115, 116, 118, 120, 124, 130,
            134, 135, 136, 138, 140, 142, 143, 144, 145, 148, 149, 150,
        ],
        MCode::Unsupported,
    );
    rules.free_letters = letters("Q");
    rules.own_length = true;
    rules.tcp_says_interpolation = true;
    rules.m_codes_per_block = 2;
    rules
}

/// How programs for a TNC are written.
pub(super) fn writing() -> Style {
    let style = style();
    Style {
        templates: Templates {
            header: "BEGIN PGM {{ number }} {% if inch %}INCH{% else %}MM{% endif %}
{{ name | comment }}
{{ ('tool T' ~ tool_number ~ ' ' ~ tool_description) | comment }}
{{ ('part tolerance overcut ' ~ overcut ~ ' undercut ' ~ undercut) | comment }}
{{ ('input ' ~ input) | comment }}
{{ ('machine ' ~ machine ~ ' dialect ' ~ dialect) | comment }}
{{ ('regulus ' ~ version) | comment }}
{{ ('work offset ' ~ work_offset) | comment }}
{% if wrapped %}M126{% else %}M127{% endif %}
{% for line in start_lines %}{{ line }}
{% endfor %}",
            tool_call: "TOOL CALL {{ tool_number }} Z S{{ spindle }}
M3
",
            approach: "{% if rotary %}L {{ rotary }} R0 FMAX
{% endif %}{% if switchable %}L {{ across }} R0 FMAX
{% endif %}{% if tcp %}{{ tcp_on }}
L {{ start }} R0 FMAX
{% else %}L {{ joint }} R0 FMAX
{% endif %}",
            end: "M127
M5
{% for line in end_lines %}{{ line }}
{% endfor %}M30
END PGM {{ number }} {% if inch %}INCH{% else %}MM{% endif %}
",
            ..style.templates
        },
        comment_marks: ["; ", ""],
        numbered_lines: true,
        numbers: NumberStyle { plus: true, point_always: false, point: b'.' },
        feed_units: None,
        rapid: "L ",
        rapid_feed: "FMAX",
        line: "L ",
        motion_stays: false,
        vector: ["TX", "TY", "TZ"],
        whole_vectors: true,
        length_with_tool: true,
        ..style
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_stand_where_their_names_say() {
        for (keyword, name) in [
            (Keyword::Line, "L"),
            (Keyword::VectorLine, "LN"),
            (Keyword::Clockwise, "DR-"),
            (Keyword::Counterclockwise, "DR+"),
            (Keyword::CircleCentre, "CC"),
            (Keyword::Rapid, "FMAX"),
            (Keyword::Mm, "MM"),
            (Keyword::Inch, "INCH"),
            (Keyword::ToolCall, "TOOL CALL"),
            (Keyword::TcpmAxis, "PATHCTRL AXIS"),
            (Keyword::TcpmVector, "PATHCTRL VECTOR"),
            (Keyword::TcpmReset, "RESET TCPM"),
            (Keyword::Preset, "CYCL DEF 247"),
            (Keyword::Tolerance, "CYCL DEF 32"),
        ] {
            assert_eq!(KEYWORDS[keyword as usize].0, name);
        }
    }
}
