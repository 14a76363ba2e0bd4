//! What a control reads and how it moves between blocks: its dialect with options, and its work offsets. Uses nothing
//! of the crate.

use super::templates::Templates;

/// The control's language.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Dialect {
    /// LinuxCNC 2.9.
    #[serde(rename = "linuxcnc")]
    LinuxCnc,
    /// Fanuc 30i, 31i, 32i.
    #[serde(rename = "fanuc-30i")]
    Fanuc30i,
    /// Haas Next Generation Control.
    #[serde(rename = "haas-ngc")]
    HaasNgc,
    /// Siemens SINUMERIK 840D sl and ONE.
    #[serde(rename = "siemens-840d")]
    Siemens840d,
    /// Heidenhain TNC 640 and iTNC 530, Klartext.
    #[serde(rename = "heidenhain-tnc")]
    HeidenhainTnc,
    /// Mazak Smooth, EIA programs.
    #[serde(rename = "mazak-smooth")]
    MazakSmooth,
    /// Okuma OSP-P200M and P300.
    #[serde(rename = "okuma-osp")]
    OkumaOsp,
    /// grblHAL.
    #[serde(rename = "grblhal")]
    GrblHal,
    /// ISO 6983 words without TCP.
    #[serde(rename = "iso")]
    Iso,
}

impl Dialect {
    /// Every dialect with its name in a machine file.
    pub const ALL: [(Self, &'static str); 9] = [
        (Self::LinuxCnc, "linuxcnc"),
        (Self::Fanuc30i, "fanuc-30i"),
        (Self::HaasNgc, "haas-ngc"),
        (Self::Siemens840d, "siemens-840d"),
        (Self::HeidenhainTnc, "heidenhain-tnc"),
        (Self::MazakSmooth, "mazak-smooth"),
        (Self::OkumaOsp, "okuma-osp"),
        (Self::GrblHal, "grblhal"),
        (Self::Iso, "iso"),
    ];

    /// The name in a machine file.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(dialect, _)| *dialect == self).map_or("", |(_, name)| name)
    }

    /// Extension of a program's file on the control.
    pub fn extension(self) -> &'static str {
        match self {
            Self::LinuxCnc => "ngc",
            Self::Siemens840d => "mpf",
            Self::HeidenhainTnc => "h",
            Self::MazakSmooth => "eia",
            Self::OkumaOsp => "min",
            Self::Fanuc30i | Self::HaasNgc | Self::GrblHal | Self::Iso => "nc",
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

/// What F counts in inverse-time feed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum InverseTimeUnit {
    /// One over the minutes of the block.
    #[default]
    PerMinute,
    /// One over its seconds.
    PerSecond,
    /// Its seconds.
    Seconds,
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

/// How blocks say the tool's orientation with TCP on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrientationWords {
    /// Angles of the rotary axes.
    #[default]
    Angles,
    /// Components of the tool axis in the part frame, from the tip toward the spindle.
    Vectors,
}

/// Units of written programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LengthUnit {
    /// Millimetres.
    #[default]
    Mm,
    /// Inches.
    Inch,
}

/// What a word of a wrapped rotary axis means where it does not say itself which way to turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rollover {
    /// The shorter way.
    #[default]
    Shortest,
    /// The way of its sign, to its magnitude.
    Sign,
    /// The way that does not pass zero.
    Within,
}

/// Which rotary axes turn the shorter way where a program asks for it (M126, DC).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ShortestWay {
    /// Wrapped axes; the words of others are literal angles.
    #[default]
    Wrapped,
    /// Any axis, as far as its travel allows the angle at which it would end; else its word is a literal angle.
    WithinTravel,
}

/// What a number without decimal point means in a word for a length or an angle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PointRule {
    /// It is not known: such numbers are findings.
    #[default]
    Required,
    /// The same as with a point.
    Unit,
    /// A count of the control's least increments.
    Increment,
}

/// What differs between controls of one dialect. Each field has a key of the same name in `[control.options]`.
#[derive(Clone, Debug, PartialEq)]
pub struct DialectOptions {
    /// Decimals of X, Y, Z words, mm.
    pub linear_digits: u8,
    /// Decimals of rotary words, degrees.
    pub rotary_digits: u8,
    /// Decimals of the words of a tool vector.
    pub vector_digits: u8,
    /// Decimals of F words.
    pub feed_digits: u8,
    /// Units of written programs.
    pub units: LengthUnit,
    /// How written blocks say the tool's orientation with TCP on.
    pub orientation: OrientationWords,
    /// How feed words are written.
    pub feed_mode: FeedMode,
    /// Largest F of feed per minute, mm/min.
    pub max_feed: f64,
    /// Smallest and largest F of inverse-time feed, 1/min.
    pub inverse_time_range: [f64; 2],
    /// What F counts in inverse-time feed.
    pub inverse_time_unit: InverseTimeUnit,
    /// Radius, mm, at which the turn of a rotary axis counts for a feed per minute with TCP off: F is the speed along
    /// all axes together. Where it is zero, F is the speed of X, Y, Z, or of the rotary axes where these move alone.
    pub feed_radius: f64,
    /// Most blocks that the control takes in a second; written blocks last at least that long.
    pub max_block_rate: f64,
    /// Longest block, characters without the line end.
    pub max_block_length: usize,
    /// G codes that call a tool's length by its number (H) and end it.
    pub length_codes: [String; 2],
    /// Code that turns TCP on for rotary angles; `None` where the control is always in TCP, or never.
    pub tcp_on: Option<String>,
    /// Code that turns TCP on for tool vectors; `None` where [`Self::tcp_on`] does.
    pub tcp_on_vectors: Option<String>,
    /// Code that turns TCP off; `None` as above.
    pub tcp_off: Option<String>,
    /// Whether TCP is on when a program starts.
    pub tcp_at_start: bool,
    /// How the rotary axes turn between blocks that give them as angles with TCP on.
    pub tcp_interpolation: TcpInterpolation,
    /// Whether the control keeps the speeds of the machine's axes with TCP on; else only those of the tip and of the
    /// rotary axes, and rapids that would pass them are written as feed moves, and found where a program has them.
    pub tcp_limits_axes: bool,
    /// How they turn between blocks that give tool vectors.
    pub vector_interpolation: TcpInterpolation,
    /// Whether the control stops at the end of each feed block where a program asks for exact ends (G61, G9, G60).
    pub exact_stop: bool,
    /// How far the control lets each rotary axis that turns leave its way at corners that a program lets it round (G64 P),
    /// radians; `None` as far as the program says, else as two blocks laid over each other bring it.
    pub rounding_rotary: Option<f64>,
    /// Seconds between the places that the control interpolates: it stops at one of them. Zero where that is not known.
    pub cycle: f64,
    /// Which way a wrapped rotary axis turns.
    pub rollover: Rollover,
    /// Which rotary axes turn the shorter way where a program asks for it.
    pub shortest_way: ShortestWay,
    /// What a number without decimal point means.
    pub number_without_point: PointRule,
    /// What such a number counts, mm and degrees.
    pub least_increment: f64,
    /// Whether the decimal sign is a comma in written programs.
    pub decimal_comma: bool,
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

/// The radius at which a degree is a millimetre.
const DEGREE_AS_MM: f64 = 180.0 / std::f64::consts::PI;

impl DialectOptions {
    /// What holds where a machine file says nothing: careful values for the dialect.
    pub fn of(dialect: Dialect) -> Self {
        let code = |text: &str| Some(text.to_owned());
        // The tool call brings the length along.
        let no_codes = || [String::new(), String::new()];
        let iso = Self {
            linear_digits: 4,
            rotary_digits: 4,
            vector_digits: 7,
            feed_digits: 3,
            units: LengthUnit::Mm,
            orientation: OrientationWords::Angles,
            feed_mode: FeedMode::InverseTime,
            max_feed: 99_999.999,
            inverse_time_range: [0.001, 9_999.999],
            inverse_time_unit: InverseTimeUnit::PerMinute,
            feed_radius: DEGREE_AS_MM,
            max_block_rate: 1e6,
            max_block_length: 128,
            length_codes: ["G43".into(), "G49".into()],
            tcp_on: None,
            tcp_on_vectors: None,
            tcp_off: None,
            tcp_at_start: false,
            tcp_interpolation: TcpInterpolation::RotaryLinear,
            tcp_limits_axes: true,
            vector_interpolation: TcpInterpolation::GreatCircle,
            exact_stop: true,
            rounding_rotary: None,
            cycle: 0.0,
            rollover: Rollover::Shortest,
            shortest_way: ShortestWay::Wrapped,
            number_without_point: PointRule::Required,
            least_increment: 0.001,
            decimal_comma: false,
            length_offset_without_tcp: true,
            start_lines: Vec::new(),
            retract_lines: Vec::new(),
            end_lines: Vec::new(),
        };
        let fanuc =
            || Self { tcp_on: code("G43.4"), tcp_on_vectors: code("G43.5"), tcp_off: code("G49"), ..iso.clone() };
        match dialect {
            Dialect::LinuxCnc => Self {
                linear_digits: 5,
                rotary_digits: 5,
                inverse_time_range: [0.001, 99_999.999],
                feed_radius: 0.0,
                max_block_length: 255,
                tcp_on: code("M428"),
                tcp_off: code("M429"),
                tcp_at_start: true,
                tcp_limits_axes: false,
                cycle: 0.001,
                rollover: Rollover::Sign,
                number_without_point: PointRule::Unit,
                start_lines: vec!["G61".into()],
                ..iso
            },
            Dialect::Fanuc30i => fanuc(),
            // G61.1 is a mode of high accuracy, not of stops.
            Dialect::MazakSmooth => Self { exact_stop: false, ..fanuc() },
            Dialect::HaasNgc => Self { tcp_on: code("G234"), tcp_on_vectors: None, ..fanuc() },
            Dialect::OkumaOsp => {
                Self { length_codes: ["G56".into(), "G53".into()], tcp_on: code("G169"), tcp_off: code("G170"), ..iso }
            }
            // Corners are passed exactly without a stop, whatever is asked for.
            Dialect::GrblHal => {
                Self { exact_stop: false, max_block_length: 255, number_without_point: PointRule::Unit, ..iso }
            }
            Dialect::Siemens840d => Self {
                length_codes: no_codes(),
                shortest_way: ShortestWay::WithinTravel,
                vector_digits: 8,
                max_block_length: 512,
                tcp_on: code("TRAORI"),
                tcp_off: code("TRAFOOF"),
                number_without_point: PointRule::Unit,
                ..iso
            },
            Dialect::HeidenhainTnc => Self {
                length_codes: no_codes(),
                vector_digits: 8,
                feed_mode: FeedMode::PerMinute,
                feed_radius: 0.0,
                tcp_on: code("M128"),
                tcp_off: code("M129"),
                rollover: Rollover::Within,
                number_without_point: PointRule::Unit,
                ..iso
            },
            Dialect::Iso => iso,
        }
    }
}

/// A work offset: where the part's zero stands in the machine frame at rotary zero.
#[derive(Clone, Debug, PartialEq)]
pub struct WorkOffset {
    /// Code that selects it, with the word of its number where it has one: `G54`, `G54.1 P3`, `G15 H1`.
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
    /// The shop's own header, tool call, approach, retract and end.
    pub templates: Templates,
    /// In the order of the file; at least one.
    pub work_offsets: Vec<WorkOffset>,
    /// Where G28 and G30 bring the axes, in this order: X, Y, Z, mm, then the rotary axes in the order of the file,
    /// degrees. Zero where the file says nothing.
    pub reference_positions: Vec<[f64; 5]>,
}
