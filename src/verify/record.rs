//! The record of a verification, as it is written to `verify.json`. Uses `simulate` for limits and the findings of `nc`.

use crate::diagnostic::Severity;
use crate::geometry::Point;
use crate::nc::{Finding, FindingCode};
use crate::simulate::{AxisReport, AxisStatistics, LimitViolation, SegmentKind, ToolMotion};
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};
use std::ops::Range;

/// Pass or fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Within tolerance and limits, everywhere on the region.
    Pass,
    /// Not so, or not known: the reasons say.
    Fail,
}

/// Everything measured, in the order of the file. Lengths mm, times s, angles degrees.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verification {
    /// `regulus-verify`.
    pub format: &'static str,
    /// 1.
    pub version: u32,
    /// The verdict.
    pub verdict: Verdict,
    /// Why it fails, one sentence each; empty for a pass.
    pub reasons: Vec<String>,
    /// Swept tool against the part.
    pub deviation: DeviationRecord,
    /// How strips meet.
    pub strips: StripsRecord,
    /// The program's size.
    pub program: ProgramRecord,
    /// Program against tool path; null without one.
    pub round_trip: Option<RoundTripRecord>,
    /// What each axis does, under its letter, in the machine's order.
    #[serde(serialize_with = "by_letter")]
    pub axes: Vec<(char, AxisRecord)>,
    /// Limits passed, in the order of the program.
    pub limits: Vec<LimitViolation>,
    /// The tool, or a body of the machine, where it must not be, in the order of time.
    pub collisions: Vec<CollisionRecord>,
    /// Bodies that come nearer to each other than they should, in the order of time.
    pub near_misses: Vec<NearMissRecord>,
    /// The way through the stock; left out where the job has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stock: Option<StockRecord>,
    /// Everything found, in the order of the program, what has no line behind it.
    pub findings: Vec<FindingRecord>,
    /// What errors of the machine within its tolerances would add; null where that was not asked for.
    pub uncertainty: Option<UncertaintyRecord>,
}

/// What errors of the machine within its tolerances change on the part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UncertaintyRecord {
    /// Largest change of the deviation when every number is off the worst way.
    pub worst_case_mm: f64,
    /// Where.
    pub worst_case_point_mm: [f64; 3],
    /// Largest root of the sum of the squares of the changes: errors that know nothing of each other.
    pub rss_mm: f64,
    /// Where.
    pub rss_point_mm: [f64; 3],
    /// Each number of the machine, that which changes most first.
    pub parameters: Vec<ParameterRecord>,
}

/// What one number of the machine changes on the part when it is off by its tolerance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParameterRecord {
    /// Which, in words.
    pub name: String,
    /// By how much it is off.
    pub tolerance: f64,
    /// `mm` or `deg`.
    pub unit: &'static str,
    /// Largest change of the deviation, either way.
    pub change_max_mm: f64,
    /// Where on the part, part frame.
    pub point_mm: [f64; 3],
    /// Line of the program that cuts there.
    pub line: usize,
}

/// What is found of a program on its machine without a part, in the order of the file: the keys of [`Verification`], those
/// about the part null.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MachineVerification {
    /// `regulus-verify`.
    pub format: &'static str,
    /// 1.
    pub version: u32,
    /// Whether the machine can run the program as it is.
    pub verdict: Verdict,
    /// Why not, one sentence each; empty for a pass.
    pub reasons: Vec<String>,
    /// Null: there is no part.
    pub deviation: (),
    /// Null: there is no part.
    pub strips: (),
    /// The program's size.
    pub program: ProgramRecord,
    /// Null: there is no tool path.
    pub round_trip: (),
    /// What each axis does, under its letter, in the machine's order.
    #[serde(serialize_with = "by_letter")]
    pub axes: Vec<(char, AxisRecord)>,
    /// Limits passed, in the order of the program.
    pub limits: Vec<LimitViolation>,
    /// Bodies of the machine that run into each other, in the order of time.
    pub collisions: Vec<CollisionRecord>,
    /// Bodies that come nearer to each other than they should, in the order of time.
    pub near_misses: Vec<NearMissRecord>,
    /// Everything found, in the order of the program.
    pub findings: Vec<FindingRecord>,
}

/// Something found in a program, in its motion, or on the part.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FindingRecord {
    /// Line of the program, from 1; null where no line is to blame.
    pub line: Option<usize>,
    /// `error` or `warning`.
    pub severity: &'static str,
    /// Stable code of the rule, such as `R701`.
    pub id: &'static str,
    /// Stable name of the rule, such as `overcut`.
    pub code: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do about it.
    pub help: String,
    /// Where on the part, part frame, mm; null where that is nowhere.
    pub point_mm: Option<[f64; 3]>,
    /// Bytes of the program that are meant, where there are any.
    #[serde(skip)]
    pub span: Option<Range<usize>>,
    /// First and last line of a stretch of the program, where it is about one.
    #[serde(skip)]
    pub lines: Option<(usize, usize)>,
}

impl FindingRecord {
    /// A finding of the weight that its rule has.
    pub fn new(code: FindingCode, line: Option<usize>, message: String) -> Self {
        let finding = Finding::new(code, line.unwrap_or_default(), message, code.rule().remedy);
        Self { line, ..Self::from(&finding) }
    }

    /// The same about a place on the part.
    #[must_use]
    pub fn at(self, point: Point) -> Self {
        Self { point_mm: Some(point.into()), ..self }
    }

    /// What findings are sorted by: the program's lines, those without a line last; on one line, errors first.
    pub(super) fn order(&self) -> impl Ord + use<> {
        (self.line.is_none(), self.line, !self.is_error(), self.id)
    }

    /// Whether it keeps the program from passing.
    pub fn is_error(&self) -> bool {
        self.severity == severity_name(Severity::Error)
    }
}

impl From<&Finding> for FindingRecord {
    fn from(finding: &Finding) -> Self {
        Self {
            line: Some(finding.line),
            severity: severity_name(finding.severity),
            id: finding.code.id(),
            code: finding.code.name(),
            message: finding.message.clone(),
            help: finding.help.clone(),
            point_mm: None,
            span: finding.span.clone(),
            lines: None,
        }
    }
}

/// The name of a severity in files.
fn severity_name(severity: Severity) -> &'static str {
    match severity {
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

/// Deviation of the part's whole given region.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DeviationRecord {
    /// Largest depth removed below the surface; at least this where it equals the window.
    pub overcut_max_mm: f64,
    /// Largest height left above the surface; at least this where it equals the window.
    pub undercut_max_mm: f64,
    /// Share of the area within both tolerances.
    pub within_tolerance_share: f64,
    /// What is allowed.
    pub tolerance: ToleranceRecord,
    /// Samples measured, those between the grid's included.
    pub samples: usize,
    /// Guaranteed upper bound of the overcut, band included; null where none was computed.
    pub overcut_bound_mm: Option<f64>,
    /// Guaranteed upper bound of the undercut, band included; null where none was computed.
    pub undercut_bound_mm: Option<f64>,
    /// How far the tool may leave the motion that is measured where the program lets the control round corners, both ways:
    /// by the tolerance of the linear axes and what rotary axes may be off.
    pub blending_band_mm: f64,
    /// Share of the area that no pass reaches.
    pub uncut_share: f64,
    /// How far along the normals the tool was looked for.
    pub window_mm: f64,
    /// Distance from the region's edge within which nothing is claimed.
    pub border_mm: f64,
}

/// What is allowed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ToleranceRecord {
    /// Material that may be missing below the surface, mm.
    pub overcut: f64,
    /// Material that may be left above it, mm.
    pub undercut: f64,
}

/// How strips meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StripsRecord {
    /// Passes that cut some of the part.
    pub count: usize,
    /// Largest angle between neighbouring strips at their seam.
    pub kink_max_deg: f64,
    /// Its mean along the seams.
    pub kink_mean_deg: f64,
    /// Largest step at a seam, along the part's normal.
    pub gap_max_mm: f64,
}

/// The program's size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProgramRecord {
    /// Moves.
    pub blocks: usize,
    /// From the first move to the last.
    pub duration_s: f64,
    /// Way of the tip at feed.
    pub cut_length_mm: f64,
    /// One over the duration of the shortest feed move.
    pub max_block_rate_hz: f64,
    /// By how much the program lets the control round corners, of the linear axes.
    pub blending_mm: f64,
    /// How far a rotary axis may be off its way there.
    pub blending_rotary_deg: f64,
}

/// Program against tool path.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RoundTripRecord {
    /// Largest distance of the tips.
    pub tip_max_mm: f64,
    /// Largest angle between the axes.
    pub axis_max_deg: f64,
}

/// One axis. Linear axes mm and s, rotary axes degrees and s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AxisRecord {
    /// Lowest position.
    pub min: f64,
    /// Highest position.
    pub max: f64,
    /// Length of its way there and back.
    pub travel: f64,
    /// Highest speed at feed.
    pub max_rate: f64,
    /// Highest acceleration at feed.
    pub max_accel: f64,
}

/// The tool where it must not be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CollisionRecord {
    /// Line of the program, from 1.
    pub line: usize,
    /// When it is deepest.
    pub time_s: f64,
    /// What moves.
    pub body_a: String,
    /// What it runs into.
    pub body_b: String,
    /// How deep.
    pub depth_mm: f64,
}

/// Two bodies nearer to each other than they should be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct NearMissRecord {
    /// Line of the program, from 1.
    pub line: usize,
    /// When they are nearest.
    pub time_s: f64,
    /// What moves.
    pub body_a: String,
    /// What it comes near to.
    pub body_b: String,
    /// How near.
    pub distance_mm: f64,
}

/// The way through the stock.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StockRecord {
    /// Distance of neighbouring lines.
    pub cell_mm: f64,
    /// Lines.
    pub lines: usize,
    /// Before the program.
    pub volume_before_mm3: f64,
    /// After it.
    pub volume_after_mm3: f64,
    /// Taken by feed moves.
    pub removed_mm3: f64,
    /// Taken by rapids.
    pub removed_by_rapids_mm3: f64,
    /// Taken by shank and holder.
    pub removed_by_body_mm3: f64,
    /// Share of the time at feed in moves that take nothing.
    pub air_share: f64,
    /// Highest removal rate of a move.
    pub removal_max_cm3_min: f64,
    /// Its line; null where nothing was taken.
    pub removal_max_line: Option<usize>,
    /// Widest engagement of the flutes, to about a cell over their radius.
    pub engagement_max_deg: f64,
    /// Its line; null where the flutes were never in material.
    pub engagement_max_line: Option<usize>,
}

impl ProgramRecord {
    /// The size of a motion.
    pub fn of(motion: &ToolMotion) -> Self {
        let feed = || motion.segments().iter().filter(|s| s.kind == SegmentKind::Feed);
        let shortest = feed().map(|s| s.duration).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
        Self {
            blocks: motion.segments().len(),
            duration_s: motion.duration(),
            cut_length_mm: feed().fold(0.0, |length, s| length + motion.tip_length(s)),
            max_block_rate_hz: 1.0 / shortest,
            blending_mm: motion.blending(),
            blending_rotary_deg: motion.rotary_blending().to_degrees(),
        }
    }
}

impl AxisRecord {
    /// Every axis with its letter, in the machine's order.
    pub fn all(report: &AxisReport) -> Vec<(char, Self)> {
        let one = |a: &AxisStatistics| {
            let (max_rate, max_accel) = (a.max_rate, a.max_acceleration);
            (a.letter, Self { min: a.min, max: a.max, travel: a.travel, max_rate, max_accel })
        };
        report.axes.iter().map(one).collect()
    }
}

/// Writes the axes as a map from letter to record that keeps their order.
///
/// # Errors
/// Those of the serializer.
pub fn by_letter<S: Serializer>(axes: &[(char, AxisRecord)], serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(Some(axes.len()))?;
    for (letter, record) in axes {
        map.serialize_entry(letter, record)?;
    }
    map.end()
}

impl Verification {
    /// Adds a finding in its place; an error fails the program.
    pub fn add(&mut self, finding: FindingRecord) {
        if finding.is_error() {
            self.verdict = Verdict::Fail;
            let line = finding.line.map_or(String::new(), |line| format!("line {line}: "));
            self.reasons.push(format!("{line}{}", finding.message));
        }
        self.findings.push(finding);
        self.findings.sort_by_key(FindingRecord::order);
    }

    /// The text of `verify.json`, ending in a line break.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }
}
