//! A tool path out of what a program makes the tool do: poses close enough together that tip straight and axis on the
//! great circle is the program's motion, with the program's times and lines. Uses `motion` and `simulate`.

use crate::diagnostic::Diagnostic;
use crate::machine::{Setup, Travel};
use crate::motion::{Pass, PassKind, PassMotion, Pose, TimedPoses};
use crate::simulate::{Segment, SegmentKind, ToolMotion};

/// Halvings of a block after which it is taken as it is.
const DEEPEST: u32 = 16;
/// How far the path of a rapid may leave the program's, mm.
const RAPID: f64 = 0.05;
/// Slack on limits for rounding, mm and degrees.
const SLACK: f64 = 1e-9;
/// Whole turns that are tried either way.
const TURNS: i32 = 2;
/// Complaints that are reported at once.
const REPORTED: usize = 50;

/// The passes of a motion: one for each run of feed moves or rapids. `within`, mm: how far tip, and axis point at
/// `height`, may leave the program's motion at a feed.
pub(super) fn passes(motion: &ToolMotion, height: f64, within: f64) -> Vec<Pass> {
    let mut passes: Vec<Pass> = Vec::new();
    for segment in motion.segments() {
        let kind = match segment.kind {
            SegmentKind::Rapid => PassKind::Rapid,
            SegmentKind::Feed => PassKind::Cut,
        };
        let start = motion.pose(segment, 0.0);
        if passes.last().is_none_or(|pass| pass.kind != kind) {
            let begun = PassMotion::Timed(TimedPoses::starting(start, segment.line));
            passes.push(Pass { kind, strip: None, motion: begun });
        }
        let Some(Pass { motion: PassMotion::Timed(timed), .. }) = passes.last_mut() else { continue };
        let within = if kind.is_rapid() { RAPID } else { within };
        let mut follower = Follower { motion, segment, height, within, timed };
        follower.halve((0.0, start), (1.0, motion.pose(segment, 1.0)), 0);
    }
    passes.retain(|pass| matches!(&pass.motion, PassMotion::Timed(timed) if timed.poses.len() > 1));
    passes
}

/// Follows one block.
struct Follower<'a> {
    motion: &'a ToolMotion,
    segment: &'a Segment,
    height: f64,
    within: f64,
    timed: &'a mut TimedPoses,
}

impl Follower<'_> {
    /// Appends the end of a piece of the block, and what is needed before it.
    fn halve(&mut self, from: (f64, Pose), to: (f64, Pose), depth: u32) {
        let off = [0.25, 0.5, 0.75].map(|share| {
            let real = self.motion.pose(self.segment, from.0 + (to.0 - from.0) * share);
            real.distance_along(&from.1.interpolate(&to.1, share), self.height)
        });
        if depth < DEEPEST && off.iter().any(|off| *off > self.within) {
            let share = (from.0 + to.0) / 2.0;
            let middle = (share, self.motion.pose(self.segment, share));
            self.halve(from, middle, depth + 1);
            return self.halve(middle, to, depth + 1);
        }
        let (still, corner) = (from.1 == to.1, to.0 >= 1.0);
        if !still {
            self.timed.push(to.1, self.segment.programmed * (to.0 - from.0), self.segment.line, corner);
        }
    }
}

/// Every line, up to fifty, that leads to a pose which the machine cannot take whatever came before: which axis would
/// have to go how far beyond what it can.
pub(super) fn beyond_reach(passes: &[Pass], setup: &Setup, file: &str) -> Vec<Diagnostic> {
    let mut findings: Vec<Diagnostic> = Vec::new();
    let (mut left, mut last) = (0, 0);
    for pass in passes {
        let PassMotion::Timed(timed) = &pass.motion else { continue };
        for (pose, line) in timed.poses.iter().zip(&timed.lines) {
            if *line == last {
                continue;
            }
            let Some(reason) = why_out_of_reach(setup, pose) else { continue };
            last = *line;
            if findings.len() == REPORTED {
                left += 1;
                continue;
            }
            let message = format!("machine {} cannot go here: {reason}", setup.machine().name);
            let help = "move the work offset, mount the part turned, or choose a machine with more travel";
            let mut finding = *Diagnostic::error(message).in_file(file).help(help);
            if let Some(place) = &mut finding.place {
                place.line = Some(*line);
            }
            findings.push(finding);
        }
    }
    if left > 0 {
        let message = format!("{left} more lines lead out of reach");
        findings.push(*Diagnostic::error(message).in_file(file).help("the first fifty are shown"));
    }
    findings
}

fn why_out_of_reach(setup: &Setup, pose: &Pose) -> Option<String> {
    let solutions = match setup.inverse(pose) {
        Ok(solutions) => solutions,
        Err(e) => return Some(format!("axis {} would have to tilt {:.4} degrees further", e.axis, e.by.to_degrees())),
    };
    let machine = setup.machine();
    let mut least: Option<(f64, String)> = None;
    for branch in &solutions.branches {
        // The axis furthest beyond its limit in this branch.
        let mut worst: (f64, String) = (0.0, String::new());
        for (slot, axis) in machine.rotary.iter().enumerate() {
            let by = by_turns(axis.travel, branch.rotary[slot]).to_degrees();
            if by > worst.0.max(SLACK) {
                let at = branch.rotary[slot].to_degrees();
                worst = (by, format!("axis {} would stand at {at:.4} degrees, {by:.4} beyond its limits", axis.letter));
            }
        }
        for (axis, value) in machine.linear.iter().zip(branch.linear) {
            let by = (axis.min - value).max(value - axis.max);
            if by > worst.0.max(SLACK) && solutions.free.is_none() {
                worst = (by, format!("axis {} would stand at {value:.4} mm, {by:.4} beyond its limits", axis.letter));
            }
        }
        if worst.0 <= 0.0 {
            return None;
        }
        if least.as_ref().is_none_or(|(by, _)| worst.0 < *by) {
            least = Some(worst);
        }
    }
    least.map(|(_, reason)| reason)
}

/// How far the nearest of the angles that differ by whole turns lies beyond the travel, radians.
fn by_turns(travel: Travel, angle: f64) -> f64 {
    let turned = (-TURNS..=TURNS).map(|turns| travel.excess(angle + f64::from(turns) * std::f64::consts::TAU));
    turned.fold(f64::INFINITY, f64::min)
}
