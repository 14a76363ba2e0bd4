//! From motion, part and tool to the verdict. Uses everything in this module, `part`, `tool`, `motion` and `simulate`.

use super::body::Body;
use super::bound::{Bounds, Region};
use super::contacts::{Contact, Contacts, ToolBody};
use super::crossings::{Allowed, crossings};
use super::deviation::{Fineness, PartDeviation, measure};
use super::faults::Faults;
use super::findings::{self, ROUNDING};
use super::links::links;
use super::motion_tree::Instant;
use super::record::{
    AxisRecord, CollisionRecord, DeviationRecord, FindingRecord, MachineVerification, ProgramRecord, RoundTripRecord,
    StripsRecord, ToleranceRecord, Verdict, Verification,
};
use super::round_trip::round_trip;
use super::strips::{Runs, seams};
use super::sweep::Timeline;
use super::swept::Window;
use super::uncertainty::uncertainty;
use crate::motion::ToolPath;
use crate::nc::{Findings, Program};
use crate::part::Part;
use crate::simulate::{LimitViolation, ToolMotion, ToolReach};
use crate::tool::{Section, Tool};

/// What is verified against what.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The program as it was read.
    pub program: &'a Program,
    /// Its motion.
    pub motion: &'a ToolMotion,
    /// The tool it moves.
    pub tool: &'a Tool,
    /// The part.
    pub part: &'a Part,
    /// What is allowed on the part.
    pub tolerance: ToleranceRecord,
    /// The tool path that the program was posted from, where there is one.
    pub path: Option<&'a ToolPath>,
}

/// How to verify. The default suits parts of some centimetres in tolerances of some micrometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How far along the part's normals the tool is looked for.
    pub window: Window,
    /// Depth differences below this are not looked for in time, mm.
    pub resolution: f64,
    /// Distance of neighbouring samples, mm; from the part's area when left out.
    pub spacing: Option<f64>,
    /// Refinement between samples ends when it could not change the extremes by more, mm.
    pub refinement: f64,
    /// Touch of shank, holder, check surfaces and rapids that is no collision, mm.
    pub contact: f64,
    /// Guaranteed bounds are brought this near the sampled extremes, mm, and within the tolerance where these are, if they
    /// can be; none are computed when left out.
    pub bound: Option<f64>,
    /// Distance from the region's edge within which nothing is claimed, mm.
    pub border: f64,
    /// Whether the machine's tolerances are propagated to the part.
    pub uncertainty: bool,
    /// Gives a verdict although the program holds text whose effect is not known.
    pub despite_unknown_text: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            window: Window { inward: 1.0, outward: 1.0 },
            resolution: 1e-6,
            spacing: None,
            refinement: 1e-4,
            contact: 1e-3,
            bound: None,
            border: 0.01,
            uncertainty: false,
            despite_unknown_text: false,
        }
    }
}

/// The record, and what a report shows of it.
#[derive(Clone, Debug)]
pub struct Verified {
    /// What goes to `verify.json`.
    pub record: Verification,
    /// Deviation of every sample of the part.
    pub part: PartDeviation,
    /// Which pass a block belongs to.
    pub runs: Runs,
}

/// How near to the part a rapid grazes it, as a share of the distance of neighbouring samples, between which the tool may
/// touch.
const GRAZING: f64 = 0.1;
/// Height above the tip at which motions are compared where no tool is known, mm.
const BESIDE_TIP: f64 = 50.0;

/// Samples over the part's region when no spacing is given.
const SAMPLES: f64 = 20_000.0;

/// Sweeps the tool, measures the part, and judges.
pub fn verify(subject: &Subject<'_>, settings: &Settings) -> Verified {
    let motion = subject.motion;
    let spacing = settings.spacing.unwrap_or_else(|| (subject.part.surface.area() / SAMPLES).sqrt()).max(1e-3);
    let timeline = Timeline::new(motion, subject.tool.flute_length());
    let flutes = Body::of(subject.tool.flutes().iter());
    let sweep = timeline.sweep(&flutes, settings.window, settings.resolution);
    let fineness = Fineness { spacing, change: settings.refinement, border: settings.border };
    let allowed = Allowed { contact: settings.contact, overcut: subject.tolerance.overcut, spacing };
    let (part, ((crossed, surface), axes)) = rayon::join(
        || measure(&subject.part.surface, &sweep, settings.window, &fineness),
        || rayon::join(|| crossings(motion, subject.tool, subject.part, allowed), || motion.axis_report()),
    );
    let links = links(motion, subject.tool, (&part, surface), settings.window.outward);
    let runs = Runs::of(&links);
    let region = Region { surface: &subject.part.surface, sweep: &sweep, part: &part, runs: &runs };
    let bounds = settings.bound.map(|resolution| region.bounds(resolution, subject.tolerance));
    let seams = seams(&subject.part.surface, &sweep, &part, &runs);

    let mut contacts = Contacts::default();
    let rapids = (subject.tolerance.undercut, settings.window.outward, settings.contact);
    contacts.rapids_in_part(&sweep, &part, &runs, rapids);
    for (body, section) in [(ToolBody::Shank, Section::Shank), (ToolBody::Holder, Section::Holder)] {
        let solid = Body::of(subject.tool.body().filter(|(s, _)| *s == section).map(|(_, element)| element));
        let sweep = timeline.sweep(&solid, settings.window, settings.resolution);
        contacts.body_on_part(body, &sweep, &part, &runs, settings.window.outward, settings.contact);
    }
    for contact in crossed {
        contacts.add(&runs, contact);
    }

    let contacts = contacts.into_sorted();
    let reach = ToolReach { heights: (0.0, subject.tool.flute_length()), radius: flutes.radius };
    // Blocks that only link keep that far away from the part.
    let is_link = |block: usize| links.get(block).copied().unwrap_or(true);
    let clear = |corner: usize| {
        if is_link(corner.saturating_sub(1)) && is_link(corner) { settings.window.outward } else { 0.0 }
    };
    let band = motion.blending_band(&reach, clear);
    let deviation = deviation_record(&part, subject.tolerance, settings.window, (bounds, band));
    let faults = Faults { surface: &subject.part.surface, sweep: &sweep, part: &part, runs: &runs };
    let line = |block: usize| motion.segments().get(block).map_or(0, |segment| segment.line);
    let mut found =
        findings::of_part(&faults, (motion, subject.tolerance.undercut + GRAZING * spacing), &deviation, line);
    found.extend(findings::of_contacts(&contacts, line));
    let how = (subject.tool.flute_length(), settings.despite_unknown_text);
    let listed = list(subject.program, motion, &axes.limits, how, found);
    let round_trip = subject.path.and_then(|path| round_trip(motion, &links, path, subject.tool.flute_length()));
    let mut record = Verification {
        format: "regulus-verify",
        version: 1,
        verdict: Verdict::Pass,
        reasons: Vec::new(),
        deviation,
        strips: StripsRecord {
            count: seams.strips,
            kink_max_deg: seams.kink_max_deg,
            kink_mean_deg: seams.kink_mean_deg,
            gap_max_mm: seams.gap_max,
        },
        program: ProgramRecord::of(motion),
        round_trip: round_trip
            .map(|r| RoundTripRecord { tip_max_mm: r.tip_max, axis_max_deg: r.axis_max.to_degrees() }),
        axes: AxisRecord::all(&axes),
        limits: axes.limits,
        collisions: contacts.iter().map(|(contact, _)| collision(motion, contact)).collect(),
        near_misses: Vec::new(),
        stock: None,
        findings: listed,
        uncertainty: settings.uncertainty.then(|| uncertainty(motion, &part)).flatten(),
    };
    record.reasons = reasons(&record, &part, motion, settings);
    if !record.reasons.is_empty() {
        record.verdict = Verdict::Fail;
    }
    Verified { record, part, runs }
}

fn deviation_record(
    part: &PartDeviation,
    tolerance: ToleranceRecord,
    window: Window,
    (bounds, band): (Option<Bounds>, f64),
) -> DeviationRecord {
    let overcut = part.worst_overcut.and_then(|m| m.deviation()).map_or(0.0, |d| -d);
    let undercut = part.worst_undercut.map_or(0.0, |m| m.deviation().unwrap_or(window.outward));
    let allowed = -tolerance.overcut - ROUNDING..=tolerance.undercut + ROUNDING;
    DeviationRecord {
        overcut_max_mm: overcut,
        undercut_max_mm: undercut,
        within_tolerance_share: part.area_share(|s| s.deviation().is_some_and(|d| allowed.contains(&d))),
        tolerance,
        samples: part.measured,
        overcut_bound_mm: bounds.and_then(|b| b.overcut).map(|bound| bound + band),
        undercut_bound_mm: bounds.and_then(|b| b.undercut).map(|bound| bound + band),
        blending_band_mm: band,
        uncut_share: part.area_share(|s| s.touch.is_none()),
        window_mm: window.outward.min(window.inward),
        border_mm: part.border,
    }
}

fn collision(motion: &ToolMotion, contact: &Contact) -> CollisionRecord {
    let (line, time_s) = place(motion, contact.when);
    CollisionRecord {
        line,
        time_s,
        body_a: contact.body.name().to_owned(),
        body_b: contact.obstacle.name(),
        depth_mm: contact.depth,
    }
}

/// Line and time of an instant.
fn place(motion: &ToolMotion, when: Instant) -> (usize, f64) {
    motion.segments().get(when.block).map_or((0, 0.0), |s| (s.line, s.start + when.share * s.duration))
}

/// What is found in program and motion, with what was found elsewhere, in the order of the program. `height` is that above
/// the tip at which motions are compared beside the tip, mm; `despite` makes warnings of doubts.
fn list(
    program: &Program,
    motion: &ToolMotion,
    limits: &[LimitViolation],
    (height, despite): (f64, bool),
    mut found: Vec<FindingRecord>,
) -> Vec<FindingRecord> {
    found.extend(findings::of_limits(limits));
    let fails = found.iter().any(FindingRecord::is_error);
    found.extend(findings::of_motion(program, motion, height, fails, despite));
    findings::sorted(findings::explained(found))
}

/// Judges a program by what the machine makes of it, without a part: text and state of the control, the course of the
/// motion, limits. `despite_unknown_text` gives a verdict although the control may do something else with some of it.
pub fn verify_motion(program: &Program, motion: &ToolMotion, despite_unknown_text: bool) -> MachineVerification {
    let axes = motion.axis_report();
    let findings = list(program, motion, &axes.limits, (BESIDE_TIP, despite_unknown_text), Vec::new());
    let mut reasons: Vec<String> = doubt_reason(motion.findings(), despite_unknown_text).into_iter().collect();
    reasons.extend(fault_reasons(&findings));
    reasons.extend(limit_reason(&axes.limits));
    MachineVerification {
        format: "regulus-verify",
        version: 1,
        verdict: if reasons.is_empty() { Verdict::Pass } else { Verdict::Fail },
        reasons,
        deviation: (),
        strips: (),
        program: ProgramRecord::of(motion),
        round_trip: (),
        axes: AxisRecord::all(&axes),
        limits: axes.limits,
        collisions: Vec::new(),
        near_misses: Vec::new(),
        findings,
    }
}

/// Why the program fails, worst first.
fn reasons(record: &Verification, part: &PartDeviation, motion: &ToolMotion, settings: &Settings) -> Vec<String> {
    let mut reasons: Vec<String> = doubt_reason(motion.findings(), settings.despite_unknown_text).into_iter().collect();
    reasons.extend(fault_reasons(&record.findings));
    deviation_reasons(&mut reasons, record, part, motion, settings);
    reasons.extend(blending_reason(record));
    for c in &record.collisions {
        reasons.push(format!("line {}: {} {:.4} mm into the {}", c.line, c.body_a, c.depth_mm, c.body_b));
    }
    reasons.extend(limit_reason(&record.limits));
    // What has no figure of its own above, such as a rapid that grazes the part.
    if let Some(error) = record.findings.iter().find(|finding| finding.is_error()).filter(|_| reasons.is_empty()) {
        let line = error.line.map_or(String::new(), |line| format!("line {line}: "));
        reasons.push(format!("{line}{}", error.message));
    }
    reasons
}

/// That the control may do something else than what was followed.
fn doubt_reason(findings: &Findings, despite: bool) -> Option<String> {
    if !findings.any_doubt() || despite {
        return None;
    }
    let doubts = || findings.list().iter().filter(|finding| finding.leaves_doubt());
    let first = doubts().next().map_or(String::new(), |f| format!(", first line {}: {}", f.line, f.message));
    let count = doubts().count() + findings.omitted();
    Some(format!("what the control does is not certain: {count} finding(s){first}"))
}

/// What is wrong with the program whatever the part: the first finding of each rule.
fn fault_reasons(findings: &[FindingRecord]) -> Vec<String> {
    let mut said: Vec<&str> = Vec::new();
    let mut reasons = Vec::new();
    for finding in findings.iter().filter(|finding| finding.is_error() && findings::is_of_program(finding)) {
        if !said.contains(&finding.id) {
            said.push(finding.id);
            let line = finding.line.map_or(String::new(), |line| format!("line {line}: "));
            reasons.push(format!("{line}{}", finding.message));
        }
    }
    reasons
}

/// That limits are passed.
fn limit_reason(limits: &[LimitViolation]) -> Option<String> {
    let LimitViolation { line, axis, kind, value, limit } = limits.first()?;
    let kind = format!("{kind:?}").to_lowercase();
    let count = limits.len();
    Some(format!(
        "{count} axis limit(s) passed, the first on line {line}: {kind} of {axis} is {value:.4}, the limit {limit:.4}"
    ))
}

/// What is within tolerance only as long as the control does not round corners as far as it may.
fn blending_reason(record: &Verification) -> Option<String> {
    let (deviation, program) = (&record.deviation, &record.program);
    let band = deviation.blending_band_mm;
    let sides = [
        ("overcut", deviation.overcut_max_mm, deviation.tolerance.overcut),
        ("undercut", deviation.undercut_max_mm, deviation.tolerance.undercut),
    ];
    let passed = |(_, value, limit): &(&str, f64, f64)| *value <= limit + ROUNDING && value + band > limit + ROUNDING;
    let (name, value, limit) = sides.into_iter().find(passed)?;
    let (corners, degrees, most) = (program.blending_mm, program.blending_rotary_deg, value + band);
    let turned = if degrees > 0.0 {
        format!(
            ", a rotary axis may be {degrees:.4} degrees off there, which is {band:.4} mm with it at the tool (control.options.\
             rounding_rotary_deg of the machine file says more exactly how far; G61 or G61.1 allows none)"
        )
    } else {
        String::new()
    };
    Some(format!(
        "the program lets the control round corners by {corners} mm{turned}: {name} may be {most:.4} mm, {limit} mm are allowed"
    ))
}

fn deviation_reasons(
    reasons: &mut Vec<String>,
    record: &Verification,
    part: &PartDeviation,
    motion: &ToolMotion,
    settings: &Settings,
) {
    let deviation = &record.deviation;
    let least = |value: f64, window: f64| if value >= window { "at least " } else { "" };
    if deviation.overcut_max_mm > deviation.tolerance.overcut + ROUNDING {
        let (value, limit) = (deviation.overcut_max_mm, deviation.tolerance.overcut);
        let line = part.worst_overcut.and_then(|m| m.touch).map_or(0, |t| place(motion, t.when).0);
        let least = least(value, settings.window.inward);
        reasons.push(format!("line {line}: overcut is {least}{value:.4} mm, {limit} mm are allowed"));
    }
    if deviation.uncut_share > 0.0 || part.worst_undercut.is_some_and(|m| m.touch.is_none()) {
        let percent = 100.0 * deviation.uncut_share;
        reasons.push(format!("no pass comes within {} mm of {percent:.3} % of the part", settings.window.outward));
    } else if deviation.undercut_max_mm > deviation.tolerance.undercut + ROUNDING {
        let (value, limit) = (deviation.undercut_max_mm, deviation.tolerance.undercut);
        let at = part.worst_undercut.map(|m| m.sample.point).unwrap_or_default();
        reasons.push(format!(
            "undercut is {value:.4} mm at ({:.3}, {:.3}, {:.3}), {limit} mm are allowed",
            at.x, at.y, at.z
        ));
    }
}
