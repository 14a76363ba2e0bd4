//! What there is to know about a tool path in a file: own CL, or APT of another CAM system with what of it is not
//! understood. Uses `motion`.

use super::foreign::{complaints, is_apt};
use super::inspect::{FORMAT, FindingSummary};
use crate::diagnostic::{Diagnostic, Result, Severity};
use crate::motion::apt::{self, Assumptions};
use crate::motion::{Pass, PassKind, Pose, ToolPath, cl};
use serde::Serialize;

/// How far chords may leave circles while a file is looked at, mm.
const CHORD: f64 = 0.001;

/// A tool path file in figures.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PathSummary {
    format: &'static str,
    version: u32,
    kind: &'static str,
    /// Name of the file.
    pub file: String,
    /// `regulus-cl` or `apt`.
    pub form: &'static str,
    /// Name of the path.
    pub name: String,
    /// Lines of the file.
    pub lines: usize,
    /// What one tool does after the other.
    pub operations: Vec<OperationSummary>,
    /// What is not understood, by line and word.
    pub findings: Vec<FindingSummary>,
}

/// What one tool does. Lengths mm, times s, feeds mm/min; null where the file does not say.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OperationSummary {
    /// Number of the tool.
    pub tool: Option<u32>,
    /// Tip to gauge line.
    pub gauge_length: Option<f64>,
    /// Length of the flutes, or height of the cutter.
    pub flute_length: Option<f64>,
    /// Revolutions per minute.
    pub spindle: Option<f64>,
    /// Places that the path goes through straight, or corners and knots of curved passes.
    pub places: usize,
    /// Way of the tip at a feed, between those places.
    pub feed_length_mm: f64,
    /// Way of the tip in rapids.
    pub rapid_length_mm: f64,
    /// Seconds at a feed; null where the file gives none before its first feed moves.
    pub feed_s: Option<f64>,
    /// Lowest corner of the tip's box.
    pub low: [f64; 3],
    /// Highest corner.
    pub high: [f64; 3],
    /// Largest angle between tool axis and +Z, degrees.
    pub tilt_max_deg: f64,
}

/// Looks at a tool path file. Returns what is not understood as warnings, too.
pub fn inspect_path(text: &str, file: &str) -> Result<(PathSummary, Vec<Diagnostic>)> {
    let mut summary = PathSummary {
        format: FORMAT.0,
        version: FORMAT.1,
        kind: "path",
        file: file.to_owned(),
        form: "regulus-cl",
        name: String::new(),
        lines: text.lines().count(),
        operations: Vec::new(),
        findings: Vec::new(),
    };
    if !is_apt(file) {
        let path = cl::read(text, file)?;
        summary.operations.push(OperationSummary {
            tool: Some(path.tool.number),
            gauge_length: Some(path.tool.gauge_length),
            flute_length: Some(path.tool.flute_length),
            spindle: Some(path.spindle_rpm),
            ..measure(&path)
        });
        summary.name = path.name;
        return Ok((summary, Vec::new()));
    }
    let read = apt::read(text, CHORD);
    summary.form = "apt";
    summary.name = read.name.clone();
    for operation in &read.operations {
        // Any numbers will do for what the figures below do not depend on.
        let given = Assumptions {
            gauge_length: Some(1.0),
            flute_length: Some(1.0),
            spindle: Some(1.0),
            feed: Some(f64::MAX),
            linearization: CHORD,
            ..Assumptions::default()
        };
        let path = operation.tool_path(&read.name, &given).map_err(|mut e| Box::new(e.swap_remove(0)))?;
        summary.operations.push(OperationSummary {
            tool: operation.tool,
            gauge_length: operation.tool_length,
            flute_length: operation.cutter_height,
            spindle: operation.spindle,
            ..measure(&path)
        });
        if operation.legs.iter().any(|leg| leg.feed == Some(0.0))
            && let Some(summary) = summary.operations.last_mut()
        {
            summary.feed_s = None;
        }
    }
    let finding = |unread: &apt::Unread| FindingSummary {
        line: unread.line,
        severity: if unread.harmless { "warning" } else { "error" },
        code: "not-understood",
        message: format!("{}: {}", unread.word, unread.reason),
        help: "check what it is for".to_owned(),
    };
    summary.findings = read.unread.iter().map(finding).collect();
    let mut messages = complaints(&read, file, text);
    messages.iter_mut().for_each(|message| message.severity = Severity::Warning);
    Ok((summary, messages))
}

/// Figures of the motion alone.
fn measure(path: &ToolPath) -> OperationSummary {
    let mut summary = OperationSummary {
        tool: None,
        gauge_length: None,
        flute_length: None,
        spindle: None,
        places: 0,
        feed_length_mm: 0.0,
        rapid_length_mm: 0.0,
        feed_s: Some(0.0),
        low: [0.0; 3],
        high: [0.0; 3],
        tilt_max_deg: 0.0,
    };
    for pass in &path.passes {
        let mut last: Option<(f64, Pose)> = None;
        for t in pass.motion.breaks() {
            let Some(pose) = pass.motion.pose(t) else { continue };
            summary.see(path, pass, last, (t, pose));
            last = Some((t, pose));
        }
    }
    summary
}

impl OperationSummary {
    fn see(&mut self, path: &ToolPath, pass: &Pass, last: Option<(f64, Pose)>, (t, pose): (f64, Pose)) {
        let tip: [f64; 3] = pose.tip.into();
        if self.places == 0 {
            (self.low, self.high) = (tip, tip);
        }
        self.places += 1;
        for (k, value) in tip.into_iter().enumerate() {
            self.low[k] = self.low[k].min(value);
            self.high[k] = self.high[k].max(value);
        }
        self.tilt_max_deg = self.tilt_max_deg.max(pose.axis.z.clamp(-1.0, 1.0).acos().to_degrees());
        let Some((before, from)) = last else { return };
        let way = (pose.tip - from.tip).norm();
        if pass.kind == PassKind::Rapid {
            self.rapid_length_mm += way;
        } else {
            self.feed_length_mm += way;
            let seconds = pass.motion.seconds(before, t).unwrap_or(60.0 * way / path.cut_feed);
            self.feed_s = self.feed_s.map(|sum| sum + seconds);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn apt_is_summed_up_with_what_is_not_understood() {
        let text = "PARTNO/x\nUNITS/MM\nWOBBLE\nLOADTL/4\nGOTO/0,0,9\nFEDRAT/600\nGOTO/0,0,-1\nGOTO/0,8,-1,0,0.6,0.8\nRAPID\nGOTO/0,8,4\nFINI\n";
        let (summary, messages) = inspect_path(text, "x.apt").unwrap();
        let operation = &summary.operations[0];
        assert_eq!((operation.tool, operation.gauge_length, summary.name.as_str()), (Some(4), None, "x"));
        assert_eq!((operation.low, operation.high), ([0.0, 0.0, -1.0], [0.0, 8.0, 9.0]));
        assert!((operation.feed_length_mm - 18.0).abs() < 1e-9 && (operation.feed_s.unwrap() - 1.8).abs() < 1e-9);
        assert!((operation.rapid_length_mm - 5.0).abs() < 1e-9 && (operation.tilt_max_deg - 36.869_897).abs() < 1e-5);
        let found: Vec<_> = summary.findings.iter().map(|f| (f.line, f.severity, f.message.as_str())).collect();
        assert_eq!(found, [(3, "error", "WOBBLE: this word is not known here")]);
        assert_eq!((messages.len(), messages[0].severity), (1, Severity::Warning));
    }
}
