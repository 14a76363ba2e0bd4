//! Where a program's time goes: passages at a feed, the blocks that are slower than usual in their passage, and the axis
//! that is nearest to its limit there. Uses `simulate`.

use crate::simulate::{Segment, SegmentKind, ToolMotion};
use serde::Serialize;
use std::collections::BTreeMap;

/// Share of a limit from which an axis counts as what holds a block back.
const BUSY: f64 = 0.8;
/// Slow blocks that are listed.
const LISTED: usize = 20;
/// Ways of the tip below this have no feed, mm.
const STILL: f64 = 1e-6;
/// What holds a block back where no axis does.
const PROGRAMMED: &str = "programmed";

/// Where the time goes. Times s, feeds mm/min of the tip in the part frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pace {
    /// Runs of feed moves between rapids, in the order of the program.
    pub passages: Vec<Passage>,
    /// Blocks that cost most against the usual feed of their passage, the most costly first.
    pub slowest: Vec<SlowBlock>,
    /// Seconds that slower blocks cost against the usual feed of their passage, by what holds them back: the letter of
    /// the axis that is nearest to its speed or acceleration limit, from 0.8 of it, or `programmed`.
    pub lost_s: BTreeMap<String, f64>,
    /// Seconds of rapids.
    pub rapid_s: f64,
}

/// A run of feed moves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Passage {
    /// First and last line.
    pub lines: [usize; 2],
    /// Blocks.
    pub blocks: usize,
    /// Duration.
    pub seconds: f64,
    /// Way of the tip, mm.
    pub length_mm: f64,
    /// Way over duration.
    pub mean_feed: f64,
    /// Its usual feed: half of the way is made at this feed or faster.
    pub usual_feed: f64,
    /// The axis nearest to its limit anywhere in it.
    pub busiest: Load,
}

/// How near an axis is to what it can.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Load {
    /// Letter.
    pub axis: char,
    /// `speed` or `acceleration`.
    pub kind: &'static str,
    /// Share of the limit.
    pub share: f64,
    /// Line of the block.
    pub line: usize,
}

/// A block slower than usual in its passage.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlowBlock {
    /// Line.
    pub line: usize,
    /// Its feed.
    pub feed: f64,
    /// The usual feed of its passage.
    pub usual_feed: f64,
    /// Seconds more than at that feed.
    pub lost_s: f64,
    /// The axis nearest to its limit.
    pub busiest: Load,
}

/// Says where the time of a motion goes.
pub(super) fn pace(motion: &ToolMotion) -> Pace {
    let segments = motion.segments();
    let mut pace = Pace { passages: Vec::new(), slowest: Vec::new(), lost_s: BTreeMap::new(), rapid_s: 0.0 };
    for run in segments.chunk_by(|a, b| a.kind == b.kind) {
        match run.first().map(|segment| segment.kind) {
            Some(SegmentKind::Feed) => pace.passage(motion, run),
            Some(SegmentKind::Rapid) => pace.rapid_s += run.iter().map(|segment| segment.duration).sum::<f64>(),
            None => {}
        }
    }
    // Sorting keeps the order of equal ones.
    pace.slowest.sort_by(|a, b| b.lost_s.total_cmp(&a.lost_s));
    pace.slowest.truncate(LISTED);
    pace
}

impl Pace {
    fn passage(&mut self, motion: &ToolMotion, run: &[Segment]) {
        let loads = loads(motion, run);
        let lengths: Vec<f64> = run.iter().map(|segment| motion.tip_length(segment)).collect();
        let feed = |index: usize| {
            let moved = lengths[index] > STILL && run[index].duration > 0.0;
            moved.then(|| 60.0 * lengths[index] / run[index].duration)
        };
        let usual_feed = usual((0..run.len()).filter_map(|index| Some((feed(index)?, lengths[index]))).collect());
        for (index, segment) in run.iter().enumerate() {
            let Some(feed) = feed(index) else { continue };
            let lost_s = segment.duration - 60.0 * lengths[index] / usual_feed;
            if lost_s <= 1e-9 {
                continue;
            }
            let busiest = loads[index].clone();
            let cause = if busiest.share >= BUSY { busiest.axis.to_string() } else { PROGRAMMED.to_owned() };
            *self.lost_s.entry(cause).or_default() += lost_s;
            self.slowest.push(SlowBlock { line: segment.line, feed, usual_feed, lost_s, busiest });
        }
        let (seconds, length_mm) =
            (run.iter().map(|segment| segment.duration).sum::<f64>(), lengths.iter().sum::<f64>());
        let busiest = loads.into_iter().reduce(|best, load| if load.share > best.share { load } else { best });
        let (Some(first), Some(last), Some(busiest)) = (run.first(), run.last(), busiest) else { return };
        self.passages.push(Passage {
            lines: [first.line, last.line],
            blocks: run.len(),
            seconds,
            length_mm,
            mean_feed: if seconds > 0.0 { 60.0 * length_mm / seconds } else { 0.0 },
            usual_feed,
            busiest,
        });
    }
}

/// The feed at which, or faster, half of the way is made; of pairs of feed and way.
fn usual(mut feeds: Vec<(f64, f64)>) -> f64 {
    feeds.sort_by(|a, b| b.0.total_cmp(&a.0));
    let half = feeds.iter().map(|(_, way)| way).sum::<f64>() / 2.0;
    let mut made = 0.0;
    let reached = feeds.iter().find(|(_, way)| {
        made += way;
        made >= half
    });
    reached.map_or(0.0, |(feed, _)| *feed)
}

/// For each block of a run the axis nearest to its limit: mean speed in the block, and change of speed to either
/// neighbour over the mean duration of both.
fn loads(motion: &ToolMotion, run: &[Segment]) -> Vec<Load> {
    let machine = motion.setup().machine();
    let (letters, speeds, accelerations) = (machine.letters(), machine.speeds(), machine.accelerations());
    let rates: Vec<[f64; 5]> = run
        .iter()
        .map(|segment| {
            let (from, to) = (segment.from.values(), segment.to.values());
            let rate = |k: usize| if segment.duration > 0.0 { (to[k] - from[k]) / segment.duration } else { 0.0 };
            std::array::from_fn(rate)
        })
        .collect();
    let one = |index: usize| {
        let mut load = Load { axis: letters[0], kind: "speed", share: 0.0, line: run[index].line };
        for k in 0..5 {
            let mut see = |kind, share: f64| {
                if share > load.share {
                    load = Load { axis: letters[k], kind, share, line: run[index].line };
                }
            };
            see("speed", rates[index][k].abs() / speeds[k]);
            for other in [index.checked_sub(1), Some(index + 1).filter(|next| *next < run.len())].into_iter().flatten()
            {
                let span = (run[index].duration + run[other].duration) / 2.0;
                if span > 0.0 {
                    see("acceleration", (rates[other][k] - rates[index][k]).abs() / span / accelerations[k]);
                }
            }
        }
        load
    };
    (0..run.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Machine, Setup};
    use crate::nc::{Rules, read};
    use crate::simulate::simulate;

    fn pace_of(body: &str) -> Pace {
        let machine = Machine::named("xyzac-trt").unwrap();
        let text = format!("G21 G90 G61\nT1 M6\nS1000 M3\nG43 H1\nM428\nG0 X0 Y0 Z50 A0 C0\nG0 Z10\n{body}M30\n");
        let program = read(text.as_bytes(), &Rules::of(&machine));
        pace(&simulate(&program, &Setup::at(&machine, [0.0; 3], 100.0).unwrap(), None))
    }

    #[test]
    fn time_is_told_by_passage() {
        // 10 mm and 20 mm at 600 mm/min, a rapid, 10 mm at 300.
        let pace = pace_of("G1 X10 F600\nX30\nG0 Z20\nG1 X20 F300\n");
        let seen: Vec<_> = pace.passages.iter().map(|p| (p.lines, p.blocks, p.seconds, p.mean_feed)).collect();
        assert_eq!(seen.len(), 2);
        for (seen, expected) in seen.iter().zip([([8, 9], 2, 3.0, 600.0), ([11, 11], 1, 2.0, 300.0)]) {
            assert!(seen.0 == expected.0 && seen.1 == expected.1, "{seen:?}");
            assert!((seen.2 - expected.2).abs() < 1e-9 && (seen.3 - expected.3).abs() < 1e-6, "{seen:?}");
        }
        assert!(pace.slowest.is_empty() && pace.rapid_s > 0.0);
    }

    #[test]
    fn lost_time_is_blamed_on_the_axis_at_its_limit_or_on_the_program() {
        // C turns 36 degrees in 0.1 s, all of its 360 degrees/s, while the tip makes 1 mm: 600 mm/min against 6000.
        let pace = pace_of("G93 G1 X10 F600\nX11 C36 F600\nX12 C36.1 F60\nX22 F600\n");
        let slow: Vec<_> = pace.slowest.iter().map(|s| (s.line, s.busiest.axis)).collect();
        assert_eq!(slow[0].0, 10);
        let blocked = pace.slowest.iter().find(|s| s.line == 9).unwrap();
        assert_eq!(blocked.busiest.axis, 'C');
        assert!((blocked.feed - 600.0).abs() < 1e-6 && (blocked.lost_s - 0.09).abs() < 1e-9, "{blocked:?}");
        assert!(pace.lost_s["C"] >= 0.09 - 1e-9, "{:?}", pace.lost_s);
        let plain = pace_of("G1 X100 F6000\nX110 F3000\n");
        assert!((plain.lost_s[PROGRAMMED] - 0.1).abs() < 1e-9, "{plain:?}");
    }
}
