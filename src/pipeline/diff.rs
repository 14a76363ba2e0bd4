//! The largest distance between the motions of two programs, in the part frame. Uses `motion`, `simulate` and the
//! reading half of `nc`.
//!
//! Each block becomes a chain of chords that it leaves by no more than a bound (guaranteed by the simulation), so the
//! figures hold between the blocks' ends, too. Feed moves and rapids are compared apart: the way of a rapid is the
//! machine's business. Passages at a feed are matched one by one where both programs have as many; else all motion is
//! matched as one, and what is a rapid in either program counts as rapid.

use super::followed::Source;
use crate::diagnostic::Diagnostic;
use crate::motion::compare::{Apart, Comparison, Largest, TracePoint, compare};
use crate::simulate::{Segment, SegmentKind, ToolMotion};
use serde::Serialize;

/// Largest distance of a chord from its block, mm: of feed moves, and of rapids.
const CHORD: [f64; 2] = [1e-5, 1e-2];
/// Most chords of one block.
const MOST_CHORDS: f64 = 1e5;

/// Two programs compared. Lengths mm, times s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    format: &'static str,
    version: u32,
    /// Names of the files.
    pub files: [String; 2],
    /// Names of the machines.
    pub machines: [String; 2],
    /// Height above the tip of the axis point that is compared besides the tip.
    pub flank_height_mm: f64,
    /// Moves at a feed.
    pub feed: Differences,
    /// Rapids between them; null where there are none.
    pub rapid: Option<Differences>,
    /// What each program is.
    pub size: [ProgramSize; 2],
    /// Whether passages at a feed are matched one by one; else all motion is matched as one.
    pub matched_by_passage: bool,
    /// The distances are exact to this: blocks are compared by chords.
    pub chord_error_mm: f64,
}

/// The largest differences and where they are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Differences {
    /// Distance of the tips.
    pub tip_mm: Largest,
    /// Distance of the axis points at the height.
    pub flank_mm: Largest,
    /// Difference of the time since the passage began.
    pub time_s: Largest,
}

/// Size of a program.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ProgramSize {
    /// Passages at a feed between rapids.
    pub passages: usize,
    /// Seconds at a feed.
    pub feed_s: f64,
    /// Seconds in all.
    pub duration_s: f64,
    /// Way of the tip at a feed.
    pub feed_length_mm: f64,
}

impl From<Apart> for Differences {
    fn from(apart: Apart) -> Self {
        Self { tip_mm: apart.tip, flank_mm: apart.flank, time_s: apart.time }
    }
}

/// Two programs and the difference between them, with what is remarkable in either.
#[derive(Clone, Debug)]
pub struct Compared {
    /// The figures.
    pub difference: Difference,
    /// Warnings about both programs.
    pub warnings: Vec<Diagnostic>,
}

/// Compares two programs; `height`, mm, is that of the axis point compared besides the tip.
///
/// # Errors
/// A program whose motion is not certain, or that never moves at a feed.
pub fn diff(first: &Source<'_>, second: &Source<'_>, height: f64) -> Result<Compared, Vec<Diagnostic>> {
    let (a, b) = match (first.follow(), second.follow()) {
        (Ok(a), Ok(b)) => (a, b),
        (a, b) => return Err([a.err(), b.err()].into_iter().flatten().flatten().collect()),
    };
    let names = [first.program.name, second.program.name];
    let difference = difference([&a.motion, &b.motion], names, height)?;
    Ok(Compared { difference, warnings: a.warnings.into_iter().chain(b.warnings).collect() })
}

/// Compares two motions; `files` are the names of their programs.
pub(super) fn difference(
    motions: [&ToolMotion; 2],
    files: [&str; 2],
    height: f64,
) -> Result<Difference, Vec<Diagnostic>> {
    let runs = motions.map(|motion| runs(motion, height));
    let whole = runs.each_ref().map(|runs| joined(runs));
    let runs = runs.map(between_feeds);
    for (file, runs) in files.iter().zip(&runs) {
        if runs.is_empty() {
            let finding = Diagnostic::error("the program never moves at a feed").in_file(*file);
            return Err(vec![*finding.help("give a program that cuts")]);
        }
    }
    let (Comparison { feed, rapid }, matched_by_passage) = match_runs(&runs, &whole);
    Ok(Difference {
        format: "regulus-diff",
        version: 1,
        files: files.map(str::to_owned),
        machines: motions.map(|motion| motion.setup().machine().name.clone()),
        flank_height_mm: height,
        feed: feed.into(),
        rapid: rapid.map(Into::into),
        size: [size(motions[0], &runs[0]), size(motions[1], &runs[1])],
        matched_by_passage,
        chord_error_mm: 2.0 * CHORD[0],
    })
}

/// A piece of motion all at a feed, or all rapid.
struct Run {
    kind: SegmentKind,
    points: Vec<TracePoint>,
}

/// The runs of a motion. Moves that lead nowhere belong to none.
fn runs(motion: &ToolMotion, height: f64) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    // Dwells are no motion: time counts where the tool moves.
    let mut clock = 0.0;
    for segment in motion.segments() {
        let chords = chords(motion, segment, height);
        let point = |k: usize| {
            let share = k as f64 / chords as f64;
            let pose = motion.pose(segment, share);
            let seconds = clock + segment.programmed * share;
            let rapid = segment.kind == SegmentKind::Rapid;
            TracePoint { tip: pose.tip, flank: pose.at_height(height), seconds, line: segment.line, rapid }
        };
        let (start, end) = (point(0), point(chords));
        let still = chords == 1 && start.tip == end.tip && start.flank == end.flank;
        if !still {
            match runs.last_mut().filter(|run| run.kind == segment.kind) {
                Some(run) => run.points.extend((1..=chords).map(point)),
                None => runs.push(Run { kind: segment.kind, points: (0..=chords).map(point).collect() }),
            }
        }
        clock += segment.programmed;
    }
    runs
}

fn joined(runs: &[Run]) -> Vec<TracePoint> {
    runs.iter().flat_map(|run| run.points.iter().copied()).collect()
}

/// The runs from the first to the last at a feed.
fn between_feeds(mut runs: Vec<Run>) -> Vec<Run> {
    let at_feed = |run: &Run| run.kind == SegmentKind::Feed;
    let last = runs.iter().rposition(at_feed).map_or(0, |last| last + 1);
    runs.truncate(last);
    runs.drain(..runs.iter().position(at_feed).unwrap_or(0));
    runs
}

/// How many chords follow a segment closely enough at the tip and at the height.
fn chords(motion: &ToolMotion, segment: &Segment, height: f64) -> usize {
    let off = [0.0, height].map(|h| motion.chord_bound(segment, 0.0, 1.0, h));
    let allowed = CHORD[usize::from(segment.kind == SegmentKind::Rapid)];
    // The bound falls with the square of their number.
    (off[0].max(off[1]) / allowed).sqrt().ceil().clamp(1.0, MOST_CHORDS) as usize
}

/// Largest differences, and whether passages were matched one by one. `whole` is all of both motions: where one program
/// feeds what is a rapid in the other, both are matched from where the first of them begins to cut.
fn match_runs([a, b]: &[Vec<Run>; 2], whole: &[Vec<TracePoint>; 2]) -> (Comparison, bool) {
    // Between two runs at a feed there is one of rapids, so as many runs are as many passages.
    let mut by_passage = None;
    if a.len() == b.len() {
        let found: &mut Comparison = by_passage.insert(Comparison::default());
        for (first, second) in a.iter().zip(b) {
            found.take(&compare(&first.points, &second.points).unwrap_or_default());
        }
        if found.feed.distance() <= SAME_PLACE {
            return (*found, true);
        }
    }
    let [a, b] = whole;
    let (first, last) = (common(a, b, false), common(a, b, true));
    let (a, b) = (between(a, first.0, last.0), between(b, first.1, last.1));
    let whole = compare(a, b).unwrap_or_default();
    match by_passage {
        Some(found) if found.feed.distance() <= whole.feed.distance() => (found, true),
        _ => (whole, false),
    }
}

/// The points from one to another, none if they are the wrong way round.
fn between(points: &[TracePoint], from: usize, to: usize) -> &[TracePoint] {
    points.get(from..=to).unwrap_or_default()
}

/// The first places, or the last ones, that both motions have in common: where one of them begins or ends to feed, and
/// the nearest place of the other.
fn common(a: &[TracePoint], b: &[TracePoint], last: bool) -> (usize, usize) {
    let feeding = |points: &[TracePoint]| {
        let mut indices: Vec<usize> = (0..points.len()).filter(|index| !points[*index].rapid).collect();
        let ends = (indices.first().copied().map(|first| first.saturating_sub(1)), indices.pop());
        if last { ends.1 } else { ends.0 }.unwrap_or(0)
    };
    let nearest = |points: &[TracePoint], place: &TracePoint| {
        let off = |index: &usize| (points[*index].tip - place.tip).norm() + (points[*index].flank - place.flank).norm();
        let least = (0..points.len()).map(|index| off(&index)).fold(f64::INFINITY, f64::min);
        let mut near = (0..points.len()).filter(|index| off(index) <= least + SAME_PLACE);
        let index = if last { near.next_back() } else { near.next() };
        (index.unwrap_or(0), least)
    };
    let (from_a, from_b) = (feeding(a), feeding(b));
    let (in_b, off_b) = a.get(from_a).map_or((0, 0.0), |place| nearest(b, place));
    let (in_a, off_a) = b.get(from_b).map_or((0, 0.0), |place| nearest(a, place));
    if off_b <= off_a { (from_a, in_b) } else { (in_a, from_b) }
}

/// Nearer places are the same, mm.
const SAME_PLACE: f64 = 0.01;

fn size(motion: &ToolMotion, runs: &[Run]) -> ProgramSize {
    let at_feed = || motion.segments().iter().filter(|segment| segment.kind == SegmentKind::Feed);
    ProgramSize {
        passages: runs.iter().filter(|run| run.kind == SegmentKind::Feed).count(),
        feed_s: at_feed().map(|segment| segment.programmed).sum(),
        duration_s: motion.duration(),
        feed_length_mm: at_feed().map(|segment| motion.tip_length(segment)).sum(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::InputFile;
    use super::*;
    use crate::machine::Machine;

    const START: &str = "G21 G90 G61\nT1 M6\nS1000 M3\nG43 H1\nM428\nG0 X0 Y0 Z50 A0 C0\nG0 Z1 A20 C0\n";

    fn compared(a: &str, b: &str, height: f64) -> Difference {
        let machine = Machine::named("xyzac-trt").unwrap();
        let (a, b) = (format!("{START}{a}M30\n"), format!("{START}{b}M30\n"));
        let source = |name, text: &'static str| Source {
            program: InputFile { name, bytes: text.as_bytes() },
            machine: &machine,
            work_offset: None,
            gauge_length: 100.0,
            despite_unknown_text: false,
        };
        let (a, b) = (source("a.ngc", a.leak()), source("b.ngc", b.leak()));
        diff(&a, &b, height).unwrap().difference
    }

    #[test]
    fn other_block_boundaries_make_no_difference() {
        let whole = "G1 X10 Y10 F600\nX30 Y10 A24 C0\nG0 Z50\n";
        let cut = "G1 X5 Y5 F600\nX10 Y10\nX15 Y10 A21 C0\nX30 Y10 A24 C0\nG0 Z20\nZ50\n";
        let found = compared(whole, cut, 40.0);
        assert!(found.feed.tip_mm.value < 1e-9 && found.feed.flank_mm.value < found.chord_error_mm, "{found:?}");
        assert!(found.feed.time_s.value < 1e-6 && found.matched_by_passage);
        assert_eq!(found.size.map(|size| size.passages), [1, 1]);
    }

    /// The tip straight in both, the axis turning about the tip by 4 degrees against not at all: 2 H sin(2 deg).
    #[test]
    fn the_flank_is_compared_at_its_height() {
        let found = compared("G1 X20 A24 F600\nX21\n", "G1 X20 F600\nX21\n", 40.0);
        assert!((found.feed.flank_mm.value - 80.0 * 2f64.to_radians().sin()).abs() < 1e-4, "{found:?}");
        assert!(found.feed.tip_mm.value < 1.5 && found.feed.flank_mm.lines == [8, 8], "{found:?}");
    }

    /// Both ends of each block agree; the distance lies inside: a block that turns C through the pole's neighbourhood
    /// bulges by what no sample at the ends shows.
    #[test]
    fn what_happens_between_the_ends_is_found() {
        let found = compared("G1 X20 A20 C40 F600\n", "G1 X10 A20 C20 F600\nX20 A20 C40\n", 40.0);
        assert!(found.feed.flank_mm.value < found.chord_error_mm, "the same motion: {found:?}");
        // A tilt across the way: the flank point leaves by 2 H sin(0.5 deg / 2) at the middle, where the first has no end.
        let bulged = compared("G1 X20 F600\n", "G1 X10 A20.5 F600\nX20 A20\n", 40.0);
        let expected = 80.0 * 0.25_f64.to_radians().sin();
        assert!((bulged.feed.flank_mm.value - expected).abs() < found.chord_error_mm, "{bulged:?} {expected}");
        assert_eq!(bulged.feed.flank_mm.lines[1], 8);
    }

    #[test]
    fn feeds_and_rapids_are_told_apart() {
        let found = compared("G1 X20 F600\nG0 Z30\nX0\nZ1\nG1 X20\n", "G1 X20 F300\nG0 Z40\nX0\nZ1\nG1 X20\n", 40.0);
        assert!(found.feed.tip_mm.value < 1e-9, "{found:?}");
        assert!((found.feed.time_s.value - 2.0).abs() < 1e-9, "{found:?}");
        assert!((found.rapid.unwrap().tip_mm.value - 10.0).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn programs_with_other_passages_are_matched_as_a_whole() {
        let found = compared("G1 X20 F600\nG0 X30\nG1 X40\n", "G1 X40 F600\n", 40.0);
        assert!(!found.matched_by_passage && found.feed.tip_mm.value < 1e-9, "{found:?}");
    }
}
