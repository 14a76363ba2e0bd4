//! Everything a verification found, as one list with codes, lines and remedies. Uses `nc`, `simulate` and the other files
//! of this module.

use super::contacts::{Contact, ToolBody};
use super::course::{course, raised};
use super::deviation::PartDeviation;
use super::faults::{Fault, Faults, Stretch};
use super::modal::modal;
use super::motion_tree::BlockMotion;
use super::record::{DeviationRecord, FindingRecord, ProgramRecord};
use crate::nc::{FindingCode, Program, Weight};
use crate::simulate::{LimitKind, LimitViolation, ToolMotion};
use std::collections::BTreeMap;

/// Stretches of one kind that are listed one by one.
const LISTED: usize = 50;
/// Rounding allowed when a figure is compared with its tolerance, mm.
pub(super) const ROUNDING: f64 = 1e-9;

/// What was found in program and motion, whatever the part. `fails` says whether something else is wrong, too;
/// `despite_doubt` makes warnings of what leaves the motion uncertain.
pub(super) fn of_motion(
    program: &Program,
    motion: &ToolMotion,
    height: f64,
    fails: bool,
    despite_doubt: bool,
) -> Vec<FindingRecord> {
    let read = motion.findings().list().iter();
    let read = read.map(|finding| {
        let record = FindingRecord::from(finding);
        if despite_doubt && finding.leaves_doubt() { FindingRecord { severity: "warning", ..record } } else { record }
    });
    let mut watched = modal(program, motion.setup());
    watched.extend(course(motion, height));
    let mut findings: Vec<FindingRecord> = read.chain(raised(watched, fails).iter().map(FindingRecord::from)).collect();
    if ProgramRecord::of(motion).cut_length_mm == 0.0 {
        findings.push(FindingRecord::new(FindingCode::NoCut, None, "the program makes no move at feed".to_owned()));
    }
    findings
}

/// Limits that are passed: for each axis and kind, every row of lines, by its first line.
pub(super) fn of_limits(limits: &[LimitViolation]) -> Vec<FindingRecord> {
    let mut rows: BTreeMap<(char, LimitKind), Vec<&LimitViolation>> = BTreeMap::new();
    for limit in limits {
        rows.entry((limit.axis, limit.kind)).or_default().push(limit);
    }
    let row = |row: &[&LimitViolation]| {
        let first = row.first()?;
        let excess = |limit: &LimitViolation| (limit.value - limit.limit).abs();
        let worst = row.iter().copied().reduce(|a, b| if excess(b) > excess(a) { b } else { a })?;
        let (code, what) = match first.kind {
            LimitKind::Travel => (FindingCode::Travel, "travel"),
            LimitKind::Speed => (FindingCode::Speed, "speed"),
            LimitKind::Acceleration => (FindingCode::Acceleration, "acceleration"),
            LimitKind::Jerk => (FindingCode::Jerk, "jerk"),
        };
        let (axis, value, limit) = (first.axis, worst.value, worst.limit);
        let at =
            if row.len() > 1 { format!(" on line {}, the worst of {}", worst.line, row.len()) } else { String::new() };
        let message = format!("{what} of {axis} is {value:.4}{at}, the limit {limit:.4}");
        Some(FindingRecord::new(code, Some(first.line), message))
    };
    let rows = rows.values().flat_map(|of_axis| {
        of_axis.chunk_by(|a, b| b.line.saturating_sub(a.line) <= 1).take(LISTED).filter_map(row).collect::<Vec<_>>()
    });
    rows.collect()
}

/// The tool where it must not be, the deepest contacts each with the block of the first. `line` is that of a block.
pub(super) fn of_contacts(contacts: &[(Contact, usize)], line: impl Fn(usize) -> usize) -> Vec<FindingRecord> {
    let one = |(contact, first): &(Contact, usize)| {
        let code = match contact.body {
            ToolBody::FlutesInRapid => FindingCode::RapidInPart,
            _ => FindingCode::Collision,
        };
        let (first, deepest) = (line(*first), line(contact.when.block));
        let at = if deepest == first { String::new() } else { format!(" on line {deepest}") };
        let (body, depth, obstacle) = (contact.body.name(), contact.depth, contact.obstacle.name());
        FindingRecord::new(code, Some(first), format!("{body} {depth:.4} mm into the {obstacle}{at}"))
    };
    contacts.iter().map(one).collect()
}

/// Where the part leaves its tolerance, and rapids that graze it at less than `near` mm. `line` is that of a block.
pub(super) fn of_part<M: BlockMotion>(
    faults: &Faults<'_, M>,
    (motion, near): (&M, f64),
    record: &DeviationRecord,
    line: impl Fn(usize) -> usize,
) -> Vec<FindingRecord> {
    let mut findings = Vec::new();
    let part = faults.part;
    for (fault, code, what, allowed) in [
        (Fault::Overcut, FindingCode::Overcut, "overcut", record.tolerance.overcut),
        (Fault::Undercut, FindingCode::Undercut, "undercut", record.tolerance.undercut),
    ] {
        let stretches = faults.stretches(fault, allowed + ROUNDING);
        let one = |stretch: &Stretch| {
            let value = stretch.worst.deviation().map_or(0.0, f64::abs);
            let (begin, first, last) = (line(stretch.begin), line(stretch.first), line(stretch.last));
            let worst = stretch.worst.touch.map_or(first, |touch| line(touch.when.block));
            let least = if value >= record.window_mm { "at least " } else { "" };
            let message = format!(
                "{what} of {least}{value:.4} mm on line {worst}, lines {first} to {last}; {allowed} mm are allowed"
            );
            let found = FindingRecord::new(code, Some(begin), message).at(stretch.worst.sample.point);
            FindingRecord { lines: Some((first, last)), ..found }
        };
        findings.extend(stretches.iter().take(LISTED).map(one));
    }
    findings.extend(faults.grazing_rapids(motion, near).into_iter().map(|block| {
        let message = format!("a rapid between two feed moves stays within {near:.3} mm of the part");
        FindingRecord::new(FindingCode::RapidInPart, Some(line(block)), message)
    }));
    findings.extend(uncut(part, record));
    findings
}

fn uncut(part: &PartDeviation, record: &DeviationRecord) -> Option<FindingRecord> {
    let sample = part.samples.iter().chain(&part.worst_undercut).find(|sample| sample.touch.is_none())?;
    let (window, percent) = (record.window_mm, 100.0 * record.uncut_share);
    let message = format!("no pass comes within {window} mm of {percent:.3} % of the part");
    Some(FindingRecord::new(FindingCode::Uncut, None, message).at(sample.sample.point))
}

/// Whether a finding is a fault of program and motion alone, not of the part, the stock or limits.
pub(super) fn is_of_program(finding: &FindingRecord) -> bool {
    let rule = FindingCode::find(finding.id).map(FindingCode::rule);
    let elsewhere = ["R5", "R7", "R8"].iter().any(|group| finding.id.starts_with(group));
    rule.is_some_and(|rule| rule.weight == Weight::Fault) && !elsewhere
}

/// Material left over is told at the line of what explains it, where that lies in its stretch.
pub(super) fn explained(mut findings: Vec<FindingRecord>) -> Vec<FindingRecord> {
    let explains = [
        FindingCode::WildMove,
        FindingCode::TcpSwitchedInCut,
        FindingCode::CutWithoutTcp,
        FindingCode::LengthOff,
        FindingCode::Overcut,
    ];
    let causes = findings.iter().filter(|finding| finding.is_error() && explains.iter().any(|c| c.id() == finding.id));
    let lines: Vec<usize> = causes.filter_map(|finding| finding.line).collect();
    for finding in findings.iter_mut().filter(|finding| finding.id == FindingCode::Undercut.id()) {
        let Some((first, last)) = finding.lines else { continue };
        let cause = lines.iter().filter(|line| (first..=last + 1).contains(*line)).min();
        finding.line = cause.copied().or(finding.line);
    }
    findings
}

/// In the order of the program; what has no line, last; on one line, errors first.
pub(super) fn sorted(mut findings: Vec<FindingRecord>) -> Vec<FindingRecord> {
    findings.sort_by_key(FindingRecord::order);
    findings
}
