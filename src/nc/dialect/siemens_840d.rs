//! Siemens SINUMERIK 840D sl and ONE: TRAORI with angles or tool vectors (A3= B3= C3=), ORIAXES and ORIVECT.

mod lexer;

pub(super) use lexer::lex;

use super::style::{Style, Templates, Wrapped};
use super::words::{about, style};
use super::{Rules, Syntax};
use crate::machine::{DialectOptions, TcpInterpolation};
use crate::nc::code::{FeedGroup, GCode, MCode, letters};

/// Words of the language. The first three are FGROUP with rotary axes, with linear ones alone, with none named.
const KEYWORDS: &[(&str, GCode)] = &[
    ("FGROUP", GCode::FeedGroup(FeedGroup::All)),
    ("FGROUP", GCode::FeedGroup(FeedGroup::Linear)),
    ("FGROUP", GCode::FeedGroup(FeedGroup::Usual)),
    ("TRAORI", GCode::Tcp(true)),
    ("TRAFOOF", GCode::Tcp(false)),
    ("ORIAXES", GCode::Interpolation(TcpInterpolation::RotaryLinear)),
    ("ORIVECT", GCode::Interpolation(TcpInterpolation::GreatCircle)),
    ("ORIPLANE", GCode::Interpolation(TcpInterpolation::GreatCircle)),
    ("ORIWKS", GCode::Harmless(0)),
    ("ORIMKS", GCode::Unsupported),
    ("ORIEULER", GCode::Harmless(0)),
    ("ORIRPY", GCode::Harmless(0)),
    ("ORIRPY2", GCode::Harmless(0)),
    ("ORIVIRT1", GCode::Unsupported),
    ("ORICURVE", GCode::Unsupported),
    ("ORISON", GCode::Blend),
    ("ORISOF", GCode::Harmless(0)),
    ("SUPA", GCode::MachineFrame),
    ("CYCLE832", GCode::Blend),
    ("COMPON", GCode::Blend),
    ("COMPCURV", GCode::Blend),
    ("COMPCAD", GCode::Blend),
    ("COMPSURF", GCode::Blend),
    ("COMPOF", GCode::Harmless(0)),
    ("SOFT", GCode::Harmless(0)),
    ("BRISK", GCode::Harmless(0)),
    ("DRIVE", GCode::Harmless(0)),
    ("FFWON", GCode::Harmless(0)),
    ("FFWOF", GCode::Harmless(0)),
    ("UPATH", GCode::Harmless(0)),
    ("SPATH", GCode::Harmless(0)),
    ("FNORM", GCode::Harmless(0)),
    ("FIFOCTRL", GCode::Harmless(0)),
    ("STOPFIFO", GCode::Harmless(0)),
    ("STARTFIFO", GCode::Harmless(0)),
    ("STOPRE", GCode::Harmless(0)),
    ("DIAMOF", GCode::Harmless(0)),
    ("CUT2D", GCode::Harmless(0)),
    ("CUT2DF", GCode::Harmless(0)),
    ("CFC", GCode::Harmless(0)),
    ("CFTCP", GCode::Harmless(0)),
    ("MSG", GCode::Harmless(0)),
    ("WORKPIECE", GCode::Harmless(0)),
    ("SETMS", GCode::Harmless(0)),
    ("TOWSTD", GCode::Harmless(0)),
    ("NORM", GCode::Harmless(0)),
    ("KONT", GCode::Harmless(0)),
    ("CIP", GCode::Unsupported),
    ("CT", GCode::Unsupported),
    ("BSPLINE", GCode::Unsupported),
    ("ASPLINE", GCode::Unsupported),
    ("CSPLINE", GCode::Unsupported),
    ("POLY", GCode::Unsupported),
    ("INVCW", GCode::Unsupported),
    ("INVCCW", GCode::Unsupported),
    ("TRANSMIT", GCode::Unsupported),
    ("TRACYL", GCode::Unsupported),
    ("TCARR", GCode::Unsupported),
    ("PAROT", GCode::Unsupported),
];

/// Words that do nothing, or end what they begin, where nothing belongs to them; else they are not followed.
const HARMLESS_ALONE: [&str; 13] = [
    "ROT", "AROT", "ROTS", "AROTS", "TRANS", "ATRANS", "SCALE", "ASCALE", "MIRROR", "AMIRROR", "MCALL", "CYCLE800",
    "PAROTOF",
];

/// How an 840D reads programs.
pub(super) fn reading(options: &DialectOptions) -> Rules {
    let mut rules = Rules::empty(Syntax::Siemens { max_block_length: options.max_block_length });
    rules.common_codes();
    rules.keywords = KEYWORDS;
    rules.rotary_tolerance = true;
    for (codes, meaning) in [
        (&[700, 7000][..], GCode::Units { inch: true }),
        (&[710, 7100], GCode::Units { inch: false }),
        (&[530, 1530], GCode::MachineFrame),
        (&[90, 600], GCode::ExactPath),
        (&[640, 6410, 6420, 6430, 6440, 6450], GCode::Blend),
        (&[450, 451, 4500, 4510, 4600, 4610, 6010, 6020, 6030, 620, 2900, 2910], GCode::Harmless(0)),
        // The usual codes for these mean something else here, or nothing.
        (&[200, 210, 280, 300, 430, 490, 800, 980, 990, 520, 920, 100, 730], GCode::Unknown),
        (&[810, 820, 830, 840, 850, 860, 870, 880, 890], GCode::Unknown),
        (&[330, 340, 350, 630, 740, 750, 250, 260, 580, 590, 1100, 1110, 1120, 1470, 1480], GCode::Unsupported),
    ] {
        rules.set_g(codes, meaning);
    }
    for code in std::iter::once(500).chain(505..600) {
        rules.set_g(&[code * 10], GCode::WorkOffset(code * 10));
    }
    rules.set_m(&[17], MCode::End);
    rules.set_m(&[10, 11, 12, 13, 19, 40, 41, 42, 43, 44, 45, 70], MCode::Harmless(0));
    rules.set_m(&[98, 99], MCode::Unknown);
    rules.free_letters = letters("DH");
    rules.length_by_d = true;
    rules.dwell_in_f = true;
    rules.arc_turns = true;
    rules
}

/// How programs for an 840D are written.
pub(super) fn writing() -> Style {
    let style = style();
    Style {
        templates: Templates {
            header: concat!(
                "{{ name | comment }}\n",
                about!(),
                "{% if inch %}G700{% else %}G710{% endif %} G90 G17 G40 G94
{% for line in start_lines %}{{ line }}
{% endfor %}{% if per_minute and not tcp %}FGROUP(X,Y,Z{% if feed_radius != '0' %},{{ letters | join(',') }})
{% for letter in letters %}FGREF[{{ letter }}]={{ feed_radius }}
{% endfor %}{% else %})
{% endif %}{% endif %}"
            ),
            tool_call: "T{{ tool_number }} M6
D1
{{ work_offset }}
S{{ spindle }} M3
",
            approach: "{% if rotary %}G0 {{ rotary }}
{% endif %}{% if switchable %}G0 {{ across }}
{% endif %}{% if tcp %}{{ tcp_on }}
ORIWKS
{% if great_circle %}ORIVECT{% else %}ORIAXES{% endif %}
{{ work_offset }}
G0 {{ start }}
{% else %}G0 {{ joint }}
{% endif %}",
            end: "M5
{% for line in end_lines %}{{ line }}
{% endfor %}M30
",
            ..style.templates
        },
        comment_marks: ["; ", ""],
        whole_spindle_speed: false,
        vector: ["A3=", "B3=", "C3="],
        wrapped: Wrapped { before: "=DC(", behind: ")" },
        length_with_tool: true,
        ..style
    }
}
