//! What one tool does in an APT file, and the tool path that it becomes with what the file does not say. Uses
//! `diagnostic` and `motion`.

use crate::diagnostic::{Diagnostic, Result};
use crate::motion::path::{FeedReference, Pass, PassKind, PassMotion, TimedPoses, ToolPath, ToolSummary};
use crate::motion::pose::Pose;

/// From one place to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Where it leads.
    pub to: Pose,
    /// Feed, mm/min; `None` for a rapid.
    pub feed: Option<f64>,
    /// Line of the statement.
    pub line: usize,
    /// Whether the direction of motion may change at its end.
    pub corner: bool,
}

/// What happens from one tool call to the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Operation {
    /// Line of the tool call, or of the first motion.
    pub line: usize,
    /// Number of the tool.
    pub tool: Option<u32>,
    /// Its length, mm, where the tool call gives it.
    pub tool_length: Option<f64>,
    /// Diameter and corner radius of the cutter, mm.
    pub cutter: Option<[f64; 2]>,
    /// Height of the cutter, mm, where the file gives one.
    pub cutter_height: Option<f64>,
    /// Spindle speed, 1/min.
    pub spindle: Option<f64>,
    /// Whether coolant is asked for.
    pub coolant: bool,
    /// Where it begins, with the line.
    pub start: Option<(Pose, usize)>,
    /// The motion.
    pub legs: Vec<Leg>,
}

/// What a file does not say and the user does.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Assumptions<'a> {
    /// Name of the path where the file has none.
    pub name: &'a str,
    /// Tool number.
    pub tool: Option<u32>,
    /// Tip to gauge line, mm.
    pub gauge_length: Option<f64>,
    /// Length of the flutes, mm: up to here the flank follows the path.
    pub flute_length: Option<f64>,
    /// Spindle speed, 1/min.
    pub spindle: Option<f64>,
    /// Feed where the file gives none, mm/min.
    pub feed: Option<f64>,
    /// How far the flank may leave the path between blocks, mm.
    pub linearization: f64,
}

impl Operation {
    /// The tool path, with every missing piece of knowledge complained about at once.
    pub fn tool_path(&self, name: &str, given: &Assumptions<'_>) -> Result<ToolPath, Vec<Diagnostic>> {
        let mut missing = Vec::new();
        let mut need = |value: Option<f64>, what: &str, option: &str| {
            value.filter(|value| *value > 0.0).unwrap_or_else(|| {
                let message = format!("the file does not say {what}");
                missing.push(*Diagnostic::error(message).help(format!("give {option}")));
                1.0
            })
        };
        let gauge = need(self.tool_length.or(given.gauge_length), "how long the tool is", "--gauge-length MM");
        let flute = need(self.cutter_height.or(given.flute_length), "how long the flutes are", "--flank MM");
        let spindle = need(self.spindle.or(given.spindle), "how fast the spindle turns", "--spindle RPM");
        let fed = self.legs.iter().find(|leg| leg.feed == Some(0.0));
        let feed = match fed {
            Some(_) => need(given.feed, "the feed of its first moves", "--feed MM_PER_MIN"),
            None => given.feed.unwrap_or(1.0),
        };
        if !missing.is_empty() {
            return Err(missing.into_iter().map(|finding| *Box::new(finding).at(self.line, 1)).collect());
        }
        let [diameter, corner] = self.cutter.unwrap_or_default();
        let tool = ToolSummary {
            number: self.tool.or(given.tool).unwrap_or(1),
            description: format!("D{diameter:.3} R{corner:.3} gauge {gauge:.3}"),
            gauge_length: gauge,
            flute_length: flute,
        };
        Ok(ToolPath {
            name: if name.is_empty() { given.name.to_owned() } else { name.to_owned() },
            tool,
            cut_feed: self.legs.iter().filter_map(|leg| leg.feed).fold(feed, f64::max),
            feed_reference: FeedReference::Tip,
            spindle_rpm: spindle,
            linearization: given.linearization,
            overcut_tolerance: given.linearization,
            undercut_tolerance: given.linearization,
            passes: self.passes(feed, flute),
        })
    }

    /// One pass for each run of legs at a feed, or of rapids.
    fn passes(&self, first_feed: f64, flute: f64) -> Vec<Pass> {
        let mut passes: Vec<Pass> = Vec::new();
        let Some((mut at, mut line)) = self.start else { return passes };
        for leg in &self.legs {
            let kind = if leg.feed.is_none() { PassKind::Rapid } else { PassKind::Cut };
            if passes.last().is_none_or(|pass| pass.kind != kind) {
                let motion = PassMotion::Timed(TimedPoses::starting(at, line));
                passes.push(Pass { kind, strip: None, motion });
            }
            let Some(Pass { motion: PassMotion::Timed(timed), .. }) = passes.last_mut() else { continue };
            let way = (leg.to.tip - at.tip).norm();
            // Where the tip stands still the feed is that of the end of the flutes.
            let way = if way > 1e-9 { way } else { (leg.to.at_height(flute) - at.at_height(flute)).norm() };
            let feed = leg.feed.filter(|feed| *feed > 0.0).unwrap_or(first_feed);
            let seconds = if leg.feed.is_some() { 60.0 * way / feed } else { 0.0 };
            timed.push(leg.to, seconds, leg.line, leg.corner);
            (at, line) = (leg.to, leg.line);
        }
        passes
    }
}
