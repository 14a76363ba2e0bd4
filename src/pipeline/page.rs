//! What the report page shows of a job.

use super::body_views::body_views;
use super::pace::pace;
use super::{Inputs, Judged};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Degrees, Point, Radians};
use crate::machine::Travel;
use crate::part::{DesignSurface, SampleGrid};
use crate::plan::Plan;
use crate::report::{
    self, AxisTrack, Figure, Finding, Mesh, PartView, ReportData, Ruling, SlowRow, StripRow, Timeline, ToolSample,
    TrackKind, tool_outline,
};
use crate::simulate::{Segment, ToolMotion};
use crate::tool::Tool;
use crate::verify::{FindingRecord, MeasuredSample, Milled, Verdict, Verified, removal_rate};

/// Samples of the motion and lines of the tool axis that a page carries at most: enough for a smooth picture, small
/// enough to open at once.
const MOST_SAMPLES: usize = 4000;
const MOST_RULINGS: usize = 1200;
/// Losses of time below this are not shown, s.
const SHORTEST_LOSS: f64 = 0.005;
/// Triangles along a check surface's longer side, roughly.
const SURROUNDING_STEPS: f64 = 60.0;

/// The report page of a judged program, with what its plan came to where it was planned here.
pub fn page(inputs: &Inputs, plan: Option<&Plan>, judged: &Judged, program: &str) -> Result<String> {
    let mut data = data(inputs, inputs.tool()?, judged, program);
    if let Some(plan) = plan {
        data.strips = strip_rows(plan);
        data.advice = plan.verdict.help.clone();
    }
    report::html(&data).map_err(|e| Diagnostic::error(format!("the report cannot be drawn: {e}")))
}

fn data(inputs: &Inputs, tool: &Tool, judged: &Judged, program: &str) -> ReportData {
    let Judged { motion, verified, milled } = judged;
    let record = &verified.record;
    let (bodies, links) = body_views(motion, inputs.fixtures(), every(motion.segments(), MOST_SAMPLES));
    ReportData {
        name: inputs.job.name.clone(),
        verdict: report::Verdict { pass: record.verdict == Verdict::Pass, reasons: record.reasons.clone() },
        facts: facts(inputs, tool),
        input_hash: inputs.hash.clone(),
        part: Some(part_view(verified)),
        surroundings: inputs.part.check.iter().map(surrounding).collect(),
        bodies,
        links,
        rulings: rulings(tool, motion, verified),
        tool: tool_outline(tool),
        timeline: timeline(motion, milled.as_ref()),
        slow: slow_rows(motion),
        figures: figures(verified),
        findings: findings(motion, verified),
        program: program.to_owned(),
        ..ReportData::default()
    }
}

/// Where the feed is lost.
fn slow_rows(motion: &ToolMotion) -> Vec<SlowRow> {
    let row = |stretch: super::pace::SlowStretch| SlowRow {
        lines: (stretch.lines[0], stretch.lines[1]),
        lost: stretch.lost_s,
        feed: stretch.feed,
        usual_feed: stretch.usual_feed,
        cause: stretch.busiest.words(),
    };
    pace(motion).slowest.into_iter().filter(|stretch| stretch.lost_s >= SHORTEST_LOSS).map(row).collect()
}

/// Rows on the strips as planned.
fn strip_rows(plan: &Plan) -> Vec<StripRow> {
    let rows = plan.strips.iter().map(|strip| StripRow {
        overcut: strip.deviation.overcut.max(strip.deviation.outside),
        undercut: strip.deviation.undercut,
        kink: strip.seam.map(|seam| (seam.kink_max_deg, seam.kink_mean_deg)),
        length: strip.length,
        engagement: strip.engagement,
        steps: strip.steps,
        curvature_error: strip.curvature_error,
        limited_by: strip.limited_by.words().to_owned(),
    });
    rows.collect()
}

fn facts(inputs: &Inputs, tool: &Tool) -> Vec<(String, String)> {
    let job = &inputs.job;
    let control = &inputs.machine.control;
    let tcp = if control.tcp { "TCP on" } else { "TCP off" };
    let summary = crate::motion::ToolSummary::of(tool);
    [
        ("Part", job.part.file.clone()),
        ("Tool", format!("T{} {}", summary.number, summary.description)),
        ("Machine", format!("{}, {}", inputs.machine.name, inputs.machine.description)),
        ("Control", format!("{}, {tcp}, {}", control.dialect.name(), job.machine.work_offset)),
        ("Feed", format!("{} mm/min, spindle {} 1/min", job.feed.cut, job.feed.spindle_rpm)),
    ]
    .map(|(label, value)| (label.to_owned(), value))
    .to_vec()
}

fn part_view(verified: &Verified) -> PartView {
    let part = &verified.part;
    let samples = &part.samples;
    PartView {
        mesh: Mesh {
            points: samples.iter().map(|s| s.sample.point).collect(),
            normals: samples.iter().map(|s| s.sample.normal.0.into_inner()).collect(),
            triangles: part.triangles.clone(),
        },
        deviation: samples.iter().map(crate::verify::MeasuredSample::deviation).collect(),
        strip: samples.iter().map(|s| verified.runs.owner(s)).collect(),
        overcut_tolerance: verified.record.deviation.tolerance.overcut,
        undercut_tolerance: verified.record.deviation.tolerance.undercut,
    }
}

fn surrounding(surface: &DesignSurface) -> Mesh {
    let SampleGrid { samples, triangles } = surface.sample(surface.bounds().diagonal() / SURROUNDING_STEPS);
    Mesh {
        points: samples.iter().map(|s| s.point).collect(),
        normals: samples.iter().map(|s| s.normal.0.into_inner()).collect(),
        triangles,
    }
}

/// The tool axis along the flutes at block ends, from the first to the last block of each run that cuts the part.
fn rulings(tool: &Tool, motion: &ToolMotion, verified: &Verified) -> Vec<Ruling> {
    let mut cutting: std::collections::BTreeMap<u32, (usize, usize)> = std::collections::BTreeMap::new();
    for touch in verified.part.samples.iter().filter_map(|s| s.touch) {
        let block = touch.when.block;
        if let Some(run) = verified.runs.of_block(block) {
            let range = cutting.entry(run).or_insert((block, block));
            *range = (range.0.min(block), range.1.max(block));
        }
    }
    let blocks: Vec<(u32, usize)> =
        cutting.iter().flat_map(|(run, (first, last))| (*first..=*last).map(|block| (*run, block))).collect();
    let flute = tool.flute_length();
    let rulings = every(&blocks, MOST_RULINGS).filter_map(|&(strip, block)| {
        let pose = motion.pose(motion.segments().get(block)?, 1.0);
        Some(Ruling { strip, from: pose.tip, to: pose.at_height(flute) })
    });
    rulings.collect()
}

/// At most `most` entries of a list, evenly spread, the first among them.
fn every<T>(list: &[T], most: usize) -> impl Iterator<Item = &T> {
    list.iter().step_by(list.len().div_ceil(most).max(1))
}

/// The motion at block ends.
fn timeline(motion: &ToolMotion, milled: Option<&Milled>) -> Timeline {
    let machine = motion.setup().machine();
    let letters = machine.letters();
    let (speeds, travels) = (machine.speeds(), travels(motion));
    let is_rotary = |index: usize| index >= 3;
    let scale = |index: usize, value: f64| {
        if is_rotary(index) { Degrees::from(Radians(value)).0 } else { value }
    };
    let mut axes: Vec<AxisTrack> = (0..letters.len())
        .map(|i| AxisTrack {
            name: letters[i].to_string(),
            unit: if is_rotary(i) { "deg" } else { "mm" }.to_owned(),
            travel: travels[i].map(|(low, high)| (scale(i, low), scale(i, high))),
            max_speed: Some(scale(i, speeds[i]) * 60.0),
            ..AxisTrack::default()
        })
        .collect();
    let mut samples = Vec::new();
    for segment in every(motion.segments(), MOST_SAMPLES) {
        let pose = motion.pose(segment, 1.0);
        let time = segment.start + segment.duration;
        samples.push(ToolSample { time, tip: pose.tip, axis: pose.axis.into_inner(), line: segment.line });
        for (i, (axis, (position, rate))) in axes.iter_mut().zip(mean_rates(segment)).enumerate() {
            axis.position.push(scale(i, position));
            axis.speed.push(scale(i, rate) * 60.0);
        }
    }
    axes.extend(milled.map(stock_track));
    Timeline { samples, axes }
}

/// Removal rate and engagement at the samples of the timeline.
fn stock_track(milled: &Milled) -> AxisTrack {
    let mut track = AxisTrack { name: "Stock".to_owned(), kind: TrackKind::Stock, ..AxisTrack::default() };
    let moved: Vec<(usize, f64)> =
        milled.moves.blocks.iter().zip(&milled.cut.removals).map(|(b, r)| removal_rate(b, r)).enumerate().collect();
    let mut engagements = milled.cut.engagements.iter().peekable();
    for (block, rate) in every(&moved, MOST_SAMPLES) {
        let mut angle = 0.0_f64;
        while let Some(engagement) = engagements.next_if(|engagement| engagement.block <= *block) {
            angle = angle.max(engagement.angle.to_degrees());
        }
        track.position.push(*rate);
        track.speed.push(angle);
    }
    track
}

/// Position of each axis at the end of a block, and its mean speed in it; mm, radians and s.
fn mean_rates(segment: &Segment) -> Vec<(f64, f64)> {
    let rate = |way: f64| if segment.programmed > 0.0 { way / segment.programmed } else { 0.0 };
    let ends = segment.from.values().into_iter().zip(segment.to.values());
    ends.map(|(from, to)| (to, rate(to - from))).collect()
}

fn travels(motion: &ToolMotion) -> [Option<(f64, f64)>; 5] {
    let machine = motion.setup().machine();
    let [x, y, z] = machine.linear.each_ref().map(|axis| Some((axis.min, axis.max)));
    let [first, second] = machine.rotary.each_ref().map(|axis| match axis.travel {
        Travel::Limited { min, max } => Some((min, max)),
        Travel::Unlimited | Travel::Wrapped => None,
    });
    [x, y, z, first, second]
}

fn figures(verified: &Verified) -> Vec<Figure> {
    let record = &verified.record;
    let judged = |label: &str, value: f64, unit: &str, limit: f64| Figure {
        label: label.to_owned(),
        value,
        decimals: 4,
        unit: unit.to_owned(),
        limit: Some(limit),
        ok: Some(value <= limit),
    };
    let plain = |label: &str, value: f64, decimals: usize, unit: &str| Figure {
        label: label.to_owned(),
        value,
        decimals,
        unit: unit.to_owned(),
        limit: None,
        ok: None,
    };
    let (deviation, strips, program) = (&record.deviation, &record.strips, &record.program);
    let mut figures = vec![
        judged("Overcut", deviation.overcut_max_mm, "mm", deviation.tolerance.overcut),
        judged("Undercut", deviation.undercut_max_mm, "mm", deviation.tolerance.undercut),
        plain("Within tolerance", deviation.within_tolerance_share * 100.0, 2, "% of the area"),
        plain("Reached by no pass", deviation.uncut_share * 100.0, 2, "% of the area"),
        plain("Strips", strips.count as f64, 0, ""),
        plain("Largest kink between strips", strips.kink_max_deg, 3, "deg"),
        plain("Largest step between strips", strips.gap_max_mm, 4, "mm"),
        judged("Collisions", record.collisions.len() as f64, "", 0.0),
        plain("Near misses", record.near_misses.len() as f64, 0, ""),
        judged("Axis limits passed", record.limits.len() as f64, "", 0.0),
        plain("Duration", program.duration_s, 1, "s"),
        plain("Way of the tip at feed", program.cut_length_mm, 1, "mm"),
        plain("Blocks", program.blocks as f64, 0, ""),
        plain("Fastest blocks", program.max_block_rate_hz, 1, "1/s"),
    ];
    if let Some(trip) = &record.round_trip {
        figures.push(plain("Tip against tool path", trip.tip_max_mm, 5, "mm"));
        figures.push(plain("Axis against tool path", trip.axis_max_deg, 5, "deg"));
    }
    if let Some(uncertainty) = &record.uncertainty {
        figures.push(plain("Machine's tolerances on the part, worst case", uncertainty.worst_case_mm, 5, "mm"));
        figures.push(plain("The same as independent errors", uncertainty.rss_mm, 5, "mm"));
        figures.extend(uncertainty.parameters.iter().map(|parameter| {
            let label = format!("By {}, {} {}", parameter.name, parameter.tolerance, parameter.unit);
            plain(&label, parameter.change_max_mm, 5, "mm")
        }));
    }
    for figure in &mut figures {
        // Counts have no digits after the point; speeds of blocks of no length are not shown.
        if figure.unit.is_empty() {
            figure.decimals = 0;
        }
    }
    figures.retain(|figure| figure.value.is_finite());
    figures
}

/// Everything found, and where the part deviates most.
fn findings(motion: &ToolMotion, verified: &Verified) -> Vec<Finding> {
    let one = |finding: &FindingRecord| Finding {
        line: finding.line,
        point: finding.point_mm.map(Point::from),
        code: format!("{} {}", finding.id, finding.code),
        error: finding.is_error(),
        text: finding.message.clone(),
        help: finding.help.clone(),
    };
    let extreme = |sample: &MeasuredSample, what: &str| {
        let size = sample.deviation().map_or("not reached".to_owned(), |d| format!("{:.4} mm", d.abs()));
        Finding {
            line: sample.touch.and_then(|t| motion.segments().get(t.when.block)).map(|s| s.line),
            point: Some(sample.sample.point),
            text: format!("Largest {what}: {size}"),
            ..Finding::default()
        }
    };
    let part = &verified.part;
    let overcut = part.worst_overcut.iter().map(|sample| extreme(sample, "overcut"));
    let undercut = part.worst_undercut.iter().map(|sample| extreme(sample, "undercut"));
    verified.record.findings.iter().map(one).chain(overcut).chain(undercut).collect()
}
