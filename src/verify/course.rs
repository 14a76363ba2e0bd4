//! What is wrong with the course of a motion whatever the part: rotary axes that unwind in the cut, blocks that lead far
//! away and back, blocks too fast for the control to read. Uses `machine`, `nc` and `simulate`.

use crate::diagnostic::Severity;
use crate::geometry::Point;
use crate::nc::{Finding, FindingCode};
use crate::simulate::{Segment, SegmentKind, ToolMotion};
use std::f64::consts::PI;

/// A block turns unlike its neighbours when it turns so many times as far as each of them.
const UNLIKE: f64 = 10.0;
/// A block leads away when both it and the next are so many times as long as what they skip, and as their neighbours.
const AWAY: f64 = 3.0;
/// What is not looked at, mm: as small as rounded words.
const LEAST_AWAY: f64 = 0.05;
/// Blocks in a row that must be too fast for the control before that is said: its buffer bridges fewer.
const BUFFERED: usize = 8;

/// Everything found in the course of a motion. `height` is that above the tip at which motions are compared beside the
/// tip, mm.
pub(super) fn course(motion: &ToolMotion, height: f64) -> Vec<Finding> {
    let mut findings = Vec::new();
    for run in motion.segments().chunk_by(|a, b| a.kind == b.kind) {
        if run.first().is_some_and(|segment| segment.kind == SegmentKind::Feed) {
            findings.extend(unwinding(motion, run));
            findings.extend(wild_moves(motion, run, height));
            findings.extend(starvation(motion, run));
        }
    }
    findings
}

/// How far a rotary axis turns in a block, radians.
fn turn(segment: &Segment, slot: usize) -> f64 {
    let angle = |rotary: &[f64; 2]| rotary.get(slot).copied().unwrap_or_default();
    angle(&segment.to.rotary) - angle(&segment.from.rotary)
}

/// Blocks in which a rotary axis turns by more than half a turn, and much further than in the turning blocks beside it. A
/// block that turns alone is a turned cut.
fn unwinding<'a>(motion: &'a ToolMotion, run: &'a [Segment]) -> impl Iterator<Item = Finding> + 'a {
    let letters = motion.setup().machine().rotary.each_ref().map(|axis| axis.letter);
    let found = move |(slot, letter): (usize, char)| {
        let turns: Vec<f64> = run.iter().map(|segment| turn(segment, slot)).collect();
        let suspect = move |(k, segment): (usize, &Segment)| {
            let own = turns.get(k).copied()?;
            let beside = |index: Option<usize>| index.and_then(|i| turns.get(i)).copied().unwrap_or_default();
            let neighbours = [beside(k.checked_sub(1)), beside(Some(k + 1))];
            // Turning and turning back: the first of both is to blame.
            let returned = |other: f64| other * own < 0.0 && other.abs() > PI;
            let gentle = |other: &f64| *other != 0.0 && other.abs() * UNLIKE < own.abs();
            let unlike = neighbours.iter().any(gentle) || returned(neighbours[1]);
            (own.abs() > PI && unlike && !returned(neighbours[0])).then(|| {
                let message = format!("{letter} turns by {:.3} degrees in one feed block", own.to_degrees());
                let help = "write an angle near the one before, or leave the part and turn in a rapid";
                Finding::new(FindingCode::Unwinding, segment.line, message, help)
            })
        };
        run.iter().enumerate().filter_map(suspect)
    };
    letters.into_iter().enumerate().flat_map(found)
}

/// Blocks that lead far away, the next one leading back.
fn wild_moves(motion: &ToolMotion, run: &[Segment], height: f64) -> Vec<Finding> {
    let end = |share: f64| {
        move |segment: &Segment| {
            let pose = motion.pose(segment, share);
            [pose.tip, pose.at_height(height)]
        }
    };
    let places: Vec<[Point; 2]> = run.iter().take(1).map(end(0.0)).chain(run.iter().map(end(1.0))).collect();
    let apart = |a: &[Point; 2], b: &[Point; 2]| (a[0] - b[0]).norm().max((a[1] - b[1]).norm());
    let wild = |(segment, around): (&Segment, &[[Point; 2]])| {
        let [far, before, here, after, beyond] = around else { return None };
        let (out, back) = (apart(before, here), apart(here, after));
        let usual = apart(before, after).max(apart(far, before)).max(apart(after, beyond));
        let away = out.min(back);
        (away > AWAY * usual && away > LEAST_AWAY).then(|| {
            let message = format!("the block leads {out:.3} mm away and the next one {back:.3} mm back");
            let help = "check its coordinates against those of the blocks before and after it";
            Finding::new(FindingCode::WildMove, segment.line, message, help)
        })
    };
    run.iter().skip(1).zip(places.windows(5)).filter_map(wild).collect()
}

/// A row of blocks that follow each other faster than the control reads them.
fn starvation(motion: &ToolMotion, run: &[Segment]) -> Option<Finding> {
    let rate = motion.setup().machine().control.options.max_block_rate;
    let fast = |segment: &Segment| segment.duration * rate < 1.0 - ROUNDING;
    let rows = || run.chunk_by(|a, b| fast(a) == fast(b)).filter(|row| row.len() > BUFFERED && row.iter().all(fast));
    let first = rows().next()?.first()?;
    let (blocks, seconds) =
        rows().flatten().fold((0_usize, 0.0), |(count, sum), segment| (count + 1, sum + segment.duration));
    let lost = blocks as f64 / rate - seconds;
    let message = format!(
        "{blocks} blocks follow each other at {:.0} a second, the control takes {rate}: it loses {lost:.2} s and stutters",
        blocks as f64 / seconds
    );
    let help = "post with fewer blocks (a larger linearization), or with less feed";
    Some(Finding::new(FindingCode::Starvation, first.line, message, help))
}

/// Share of a duration that is lost to the digits of feed words.
const ROUNDING: f64 = 1e-3;

/// The findings, with those that would explain why something else is wrong raised to errors where something is.
pub(super) fn raised(findings: Vec<Finding>, fails: bool) -> Vec<Finding> {
    let explains = |code| {
        matches!(
            code,
            FindingCode::WildMove
                | FindingCode::OtherWorkOffset
                | FindingCode::CutWithoutTcp
                | FindingCode::TcpSwitchedInCut
                | FindingCode::LengthOff
        )
    };
    let raise =
        |finding: Finding| if fails && explains(finding.code) { finding.weighing(Severity::Error) } else { finding };
    findings.into_iter().map(raise).collect()
}
