//! Codes that mean the same in every dialect derived from RS-274-D, and how such programs look.

use super::Rules;
use super::style::{Style, Templates, Wrapped};
use crate::nc::code::{Coolant, FeedUnit, GCode, MCode, Motion, Plane, SpindleTurn};
use crate::nc::format::NumberStyle;

impl Rules {
    /// Puts the common codes into the tables.
    pub(super) fn common_codes(&mut self) {
        let g = [
            (0, GCode::Motion(Motion::Rapid)),
            (10, GCode::Motion(Motion::Line)),
            (20, GCode::Motion(Motion::Arc { clockwise: true })),
            (30, GCode::Motion(Motion::Arc { clockwise: false })),
            (40, GCode::Dwell),
            (170, GCode::Plane(Plane::Xy)),
            (180, GCode::Plane(Plane::Zx)),
            (190, GCode::Plane(Plane::Yz)),
            (200, GCode::Units { inch: true }),
            (210, GCode::Units { inch: false }),
            (280, GCode::Reference(1)),
            (300, GCode::Reference(2)),
            (400, GCode::Harmless(0)),
            (430, GCode::LengthOn { tcp: None }),
            (490, GCode::LengthOff { tcp: false }),
            (530, GCode::MachineFrame),
            (800, GCode::Harmless(0)),
            (900, GCode::Distance { incremental: false }),
            (910, GCode::Distance { incremental: true }),
            (930, GCode::Feed(FeedUnit::InverseTime)),
            (940, GCode::Feed(FeedUnit::PerMinute)),
            (950, GCode::Feed(FeedUnit::PerRevolution)),
            (970, GCode::Harmless(0)),
            (980, GCode::Harmless(0)),
            (990, GCode::Harmless(0)),
        ];
        for (code, meaning) in g {
            self.set_g(&[code], meaning);
        }
        for code in [540, 550, 560, 570, 580, 590] {
            self.set_g(&[code], GCode::WorkOffset(code));
        }
        self.set_g(&[410, 420, 810, 820, 830, 840, 850, 860, 870, 880, 890, 520, 920, 100, 730], GCode::Unsupported);
        self.common_m_codes();
    }

    /// Puts the common M codes into the table.
    pub(super) fn common_m_codes(&mut self) {
        self.set_m(&[0, 1], MCode::Stop);
        self.set_m(&[2, 30], MCode::End);
        self.set_m(&[3], MCode::Spindle(SpindleTurn::Clockwise));
        self.set_m(&[4], MCode::Spindle(SpindleTurn::Counterclockwise));
        self.set_m(&[5], MCode::Spindle(SpindleTurn::Off));
        self.set_m(&[6], MCode::ToolChange);
        self.set_m(&[7], MCode::Coolant(Coolant::Mist));
        self.set_m(&[8], MCode::Coolant(Coolant::Flood));
        self.set_m(&[9], MCode::Coolant(Coolant::Off));
        self.set_m(&[98, 99], MCode::Unsupported);
    }
}

/// What the program is for, in comments.
macro_rules! about {
    () => {
        "{{ ('tool T' ~ tool_number ~ ' ' ~ tool_description) | comment }}
{{ ('part tolerance overcut ' ~ overcut ~ ' undercut ' ~ undercut) | comment }}
{{ ('input ' ~ input) | comment }}
{{ ('machine ' ~ machine ~ ' dialect ' ~ dialect) | comment }}
{{ ('regulus ' ~ version) | comment }}
"
    };
}
pub(super) use about;

/// A known state, then the machine's own lines.
macro_rules! known_state {
    () => {
        "{% if inch %}G20{% else %}G21{% endif %} G90 G17 G40 G49 G80 G94
{% for line in start_lines %}{{ line }}
{% endfor %}"
    };
}
pub(super) use known_state;

/// How programs of letters and numbers look unless a dialect says otherwise.
pub(super) fn style() -> Style {
    Style {
        templates: Templates {
            header: concat!("%\nO{{ number | pad(4) }} {{ name | comment }}\n", about!(), known_state!()),
            retract: "{{ tcp_off }}
{% for line in retract_lines %}{{ line }}
{% endfor %}",
            tool_call: "T{{ tool_number }} M6
{{ work_offset }}
{{ length_on }}
S{{ spindle }} M3
",
            approach: "{% if rotary %}G0 {{ rotary }}
{% endif %}{% if switchable %}G0 {{ across }}
{% endif %}{% if tcp %}{{ tcp_on }}
G0 {{ start }}
{% else %}G0 {{ joint }}
{% endif %}",
            end: "{{ length_off }}
M5
{% for line in end_lines %}{{ line }}
{% endfor %}M30
%
",
        },
        plain_text: capitals,
        comment_marks: ["(", ")"],
        whole_spindle_speed: true,
        numbered_lines: false,
        numbers: NumberStyle::WORDS,
        feed_units: Some(["G93 ", "G94 "]),
        rapid: "G0 ",
        rapid_feed: "",
        line: "G1 ",
        motion_stays: true,
        vector: ["I", "J", "K"],
        whole_vectors: false,
        wrapped: Wrapped { before: "", behind: "" },
        length_with_tool: false,
        length_with_tcp: false,
    }
}

/// As [`style`], with TCP called in a block that brings the tool length and moves.
pub(super) fn style_with_length_in_tcp() -> Style {
    let style = style();
    Style {
        templates: Templates {
            approach: "{% if rotary %}G0 {{ rotary }}
{% endif %}{% if switchable %}G0 {{ across }}
{% endif %}{% if tcp %}G0 {{ tcp_on }} H{{ tool_number }} {{ start }}
{% else %}G0 {{ joint }}
{% endif %}",
            ..style.templates
        },
        length_with_tcp: true,
        ..style
    }
}

/// Printable ASCII without what ends or nests a comment; anything else becomes a question mark.
pub(super) fn plain(text: &str) -> String {
    let allowed = |c: char| (c.is_ascii_graphic() || c == ' ') && !"()%;".contains(c);
    text.chars().map(|c| if allowed(c) { c } else { '?' }).collect()
}

/// As [`plain`], in capitals.
pub(super) fn capitals(text: &str) -> String {
    plain(text).to_ascii_uppercase()
}
