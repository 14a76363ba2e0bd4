//! What a control reads and how it moves between blocks: its dialect with options, and its work offsets. Uses nothing
//! of the crate.

/// The control's language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Dialect {
    /// LinuxCNC 2.9.
    #[serde(rename = "linuxcnc")]
    LinuxCnc,
    /// Fanuc 30i, 31i, 32i.
    #[serde(rename = "fanuc-30i")]
    Fanuc30i,
}

impl Dialect {
    /// Every dialect with its name in a machine file.
    pub const ALL: [(Self, &'static str); 2] = [(Self::LinuxCnc, "linuxcnc"), (Self::Fanuc30i, "fanuc-30i")];

    /// The name in a machine file.
    pub fn name(self) -> &'static str {
        match self {
            Self::LinuxCnc => "linuxcnc",
            Self::Fanuc30i => "fanuc-30i",
        }
    }
}

/// How feed words are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FeedMode {
    /// G93, F = 1 / minutes of the block.
    InverseTime,
    /// G94, F = tip path per minute with TCP on.
    PerMinute,
}

/// How the control turns the rotary axes between two blocks with TCP on; the tip always goes straight in the part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TcpInterpolation {
    /// Rotary axes linear in their angles.
    #[default]
    RotaryLinear,
    /// Tool axis along the great circle from start to end.
    GreatCircle,
}

/// What differs between controls of one dialect. Each field has a key of the same name in `[control.options]`.
#[derive(Clone, Debug, PartialEq)]
pub struct DialectOptions {
    /// Decimals of X, Y, Z words, mm.
    pub linear_digits: u8,
    /// Decimals of rotary words, degrees.
    pub rotary_digits: u8,
    /// Decimals of F words.
    pub feed_digits: u8,
    /// How feed words are written.
    pub feed_mode: FeedMode,
    /// Largest F of feed per minute, mm/min.
    pub max_feed: f64,
    /// Smallest and largest F of inverse-time feed, 1/min.
    pub inverse_time_range: [f64; 2],
    /// Longest block, characters without the line end.
    pub max_block_length: usize,
    /// Code that turns TCP on; `None` where the control is always in TCP, or never.
    pub tcp_on: Option<String>,
    /// Code that turns TCP off; `None` as above.
    pub tcp_off: Option<String>,
    /// Whether TCP is on when a program starts.
    pub tcp_at_start: bool,
    /// How the rotary axes turn between blocks with TCP on.
    pub tcp_interpolation: TcpInterpolation,
    /// Whether the tool length (G43) is part of the Z word's zero with TCP off: axis = word + work offset + length.
    pub length_offset_without_tcp: bool,
    /// Lines written after the header, verbatim.
    pub start_lines: Vec<String>,
    /// Lines that bring the tool to a safe place with TCP off, written verbatim before the first move and after the
    /// last.
    pub retract_lines: Vec<String>,
    /// Lines written before the end of the program, verbatim.
    pub end_lines: Vec<String>,
}

impl DialectOptions {
    /// What holds where a machine file says nothing: careful values for the dialect.
    pub fn of(dialect: Dialect) -> Self {
        let common = Self {
            linear_digits: 5,
            rotary_digits: 5,
            feed_digits: 3,
            feed_mode: FeedMode::InverseTime,
            max_feed: 99_999.999,
            inverse_time_range: [0.001, 99_999.999],
            max_block_length: 255,
            tcp_on: Some("M428".into()),
            tcp_off: Some("M429".into()),
            tcp_at_start: true,
            tcp_interpolation: TcpInterpolation::RotaryLinear,
            length_offset_without_tcp: true,
            start_lines: Vec::new(),
            retract_lines: Vec::new(),
            end_lines: Vec::new(),
        };
        match dialect {
            Dialect::LinuxCnc => Self { start_lines: vec!["G61".into()], ..common },
            Dialect::Fanuc30i => Self {
                linear_digits: 4,
                rotary_digits: 4,
                inverse_time_range: [0.001, 9_999.999],
                max_block_length: 128,
                tcp_on: Some("G43.4".into()),
                tcp_off: Some("G49".into()),
                tcp_at_start: false,
                ..common
            },
        }
    }
}

/// A work offset: where the part's zero stands in the machine frame at rotary zero.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkOffset {
    /// G code that selects it, such as `G54`.
    pub name: String,
    /// X, Y, Z of the part's zero, mm.
    pub linear: [f64; 3],
}

/// The control of a machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Control {
    /// Its language.
    pub dialect: Dialect,
    /// Whether programs are written with TCP on unless a job says otherwise.
    pub tcp: bool,
    /// What differs between controls of the dialect.
    pub options: DialectOptions,
    /// In the order of the file; at least one.
    pub work_offsets: Vec<WorkOffset>,
}
