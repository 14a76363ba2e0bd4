//! Which words of APT mean what, apart from motion. Uses nothing of the crate.

/// Words that change nothing about the motion and are not carried on; post-processors differ in what they make of them.
pub(super) const HARMLESS: [&str; 27] = [
    "PPRINT",
    "REMARK",
    "INSERT",
    "LETTER",
    "MACHIN",
    "SELECT",
    "DISPLY",
    "PAINT",
    "INTOL",
    "OUTTOL",
    "TOLER",
    "TLDATA",
    "TOOL PATH",
    "END-OF-PATH",
    "END",
    "REWIND",
    "LEADER",
    "OPSKIP",
    "SEQNO",
    "OPSTOP",
    "STOP",
    "DELAY",
    "NOPOST",
    "CLPRNT",
    "MODE",
    "CLEARP",
    "OP",
];

/// What a feed counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FeedUnit {
    /// Units of the file a minute.
    PerMinute,
    /// Millimetres a minute, whatever the file's units.
    MmPerMinute,
    /// Inches a minute.
    InchPerMinute,
    /// Units of the file a revolution.
    PerRevolution,
    /// Millimetres a revolution.
    MmPerRevolution,
    /// Inches a revolution.
    InchPerRevolution,
}

impl FeedUnit {
    /// The unit that a minor word of FEDRAT or CYCLE names.
    pub(super) fn named(word: &str) -> Option<Self> {
        Some(match word {
            "PERMIN" | "FPM" => Self::PerMinute,
            "MMPM" => Self::MmPerMinute,
            "IPM" => Self::InchPerMinute,
            "PERREV" | "FPR" => Self::PerRevolution,
            "MMPR" => Self::MmPerRevolution,
            "IPR" => Self::InchPerRevolution,
            _ => return None,
        })
    }

    /// mm/min; `scale` is the file's unit in mm. `None` for a feed per revolution of a spindle whose speed is not known.
    pub(super) fn mm_per_minute(self, value: f64, scale: f64, spindle: Option<f64>) -> Option<f64> {
        Some(match self {
            Self::PerMinute => value * scale,
            Self::MmPerMinute => value,
            Self::InchPerMinute => value * 25.4,
            Self::PerRevolution => value * scale * spindle?,
            Self::MmPerRevolution => value * spindle?,
            Self::InchPerRevolution => value * 25.4 * spindle?,
        })
    }
}
