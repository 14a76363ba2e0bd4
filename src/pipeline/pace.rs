//! Where a program's time goes: passages at a feed, the stretches that are slower than usual in their passage, and the
//! limit that is nearest there. Uses `machine` and `simulate`.

use crate::simulate::{Segment, SegmentKind, ToolMotion};
use serde::Serialize;
use std::collections::BTreeMap;

/// Share of a limit from which an axis counts as what holds a block back.
const BUSY: f64 = 0.8;
/// Slow stretches that are listed.
const LISTED: usize = 20;
/// Ways of the tip below this have no feed, mm.
const STILL: f64 = 1e-6;
/// What holds a block back where no limit does.
const PROGRAMMED: &str = "programmed";
/// What holds a block back that is as short as the control takes them.
const BLOCK_RATE: &str = "block-rate";
/// Kind of a limit: how fast an axis may be.
const SPEED: &str = "speed";

/// Where the time goes. Times s, feeds mm/min of the tip in the part frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pace {
    /// Runs of feed moves between rapids, in the order of the program.
    pub passages: Vec<Passage>,
    /// Stretches that cost most against the usual feed of their passage, the most costly first.
    pub slowest: Vec<SlowStretch>,
    /// Seconds that slower blocks cost against the usual feed of their passage, by what holds them back: the letter of
    /// the axis that is nearest to a limit, from 0.8 of it, or `block-rate`, or `programmed`.
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
    /// Its usual feed: of the way on which no axis is near its top speed, half is made at this feed or faster. Links as
    /// fast as the axes can do not count.
    pub usual_feed: f64,
    /// The axis nearest to its limit anywhere in it.
    pub busiest: Load,
}

/// How near an axis is to what it can, or the control to the blocks that it takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Load {
    /// Letter; none for the control's block rate.
    pub axis: Option<char>,
    /// `speed`, `acceleration`, `jerk` or `block-rate`.
    pub kind: &'static str,
    /// Share of the limit.
    pub share: f64,
    /// Line of the block.
    pub line: usize,
}

/// Blocks in a row that are slower than usual in their passage for one reason.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SlowStretch {
    /// First and last line.
    pub lines: [usize; 2],
    /// Blocks.
    pub blocks: usize,
    /// Lowest feed.
    pub feed: f64,
    /// The usual feed of its passage.
    pub usual_feed: f64,
    /// Seconds more than at that feed.
    pub lost_s: f64,
    /// What holds it back: letter of an axis, `block-rate` or `programmed`.
    pub cause: String,
    /// The limit that is nearest.
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
            let moved = lengths[index] > STILL && run[index].programmed > 0.0;
            moved.then(|| 60.0 * lengths[index] / run[index].programmed)
        };
        let feeds = |wanted: &dyn Fn(usize) -> bool| -> Vec<(f64, f64)> {
            let indices = (0..run.len()).filter(|index| wanted(*index));
            indices.filter_map(|index| Some((feed(index)?, lengths[index]))).collect()
        };
        let free = feeds(&|index| loads[index].kind != SPEED || loads[index].share < BUSY);
        let usual_feed = usual(if free.is_empty() { feeds(&|_| true) } else { free });
        // The stretch that the block before belongs to.
        let mut open: Option<(usize, SlowStretch)> = None;
        for (index, segment) in run.iter().enumerate() {
            let Some(feed) = feed(index) else { continue };
            let lost_s = segment.programmed - 60.0 * lengths[index] / usual_feed;
            if lost_s <= 1e-9 {
                continue;
            }
            let busiest = loads[index].clone();
            let cause = busiest.cause();
            *self.lost_s.entry(cause.clone()).or_default() += lost_s;
            let lines = [segment.line; 2];
            let block = SlowStretch { lines, blocks: 1, feed, usual_feed, lost_s, cause, busiest };
            open = Some(match open.take() {
                Some((last, stretch)) if last + 1 == index && stretch.goes_on(&block) => (index, stretch.with(block)),
                before => {
                    self.slowest.extend(before.map(|(_, stretch)| stretch));
                    (index, block)
                }
            });
        }
        self.slowest.extend(open.map(|(_, stretch)| stretch));
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

impl Load {
    fn cause(&self) -> String {
        match self.axis {
            _ if self.share < BUSY => PROGRAMMED.to_owned(),
            Some(letter) => letter.to_string(),
            None => BLOCK_RATE.to_owned(),
        }
    }

    /// What it is, in words.
    pub fn words(&self) -> String {
        match self.axis {
            Some(letter) => format!("{letter} at {:.0} % of its {}", self.share * 100.0, self.kind),
            None => format!("{:.0} % of the control's block rate", self.share * 100.0),
        }
    }
}

impl SlowStretch {
    /// Whether a further block is slow for the same reason.
    fn goes_on(&self, block: &Self) -> bool {
        self.cause == block.cause
    }

    fn with(mut self, block: Self) -> Self {
        self.lines[1] = block.lines[1];
        self.blocks += 1;
        self.feed = self.feed.min(block.feed);
        self.lost_s += block.lost_s;
        if block.busiest.share > self.busiest.share {
            self.busiest = block.busiest;
        }
        self
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

/// For each block of a run the limit that is nearest: of mean speed in the block, of its change to either neighbour over
/// the mean duration of both, of the change of that about the block, and of the duration of blocks.
fn loads(motion: &ToolMotion, run: &[Segment]) -> Vec<Load> {
    let machine = motion.setup().machine();
    let limits = [machine.speeds(), machine.accelerations(), machine.jerks()];
    let seconds = |index: usize| run.get(index).map_or(0.0, |segment| segment.programmed);
    let over = |value: f64, time: f64| if time > 0.0 { value / time } else { 0.0 };
    let rate = |index: usize, axis: usize| {
        let way = run.get(index).map_or(0.0, |segment| segment.to.values()[axis] - segment.from.values()[axis]);
        over(way, seconds(index))
    };
    // Between a block and the next.
    let acceleration = |index: usize, axis: usize| {
        let inside = index + 1 < run.len();
        let change = rate(index + 1, axis) - rate(index, axis);
        if inside { over(2.0 * change, seconds(index) + seconds(index + 1)) } else { 0.0 }
    };
    let one = |index: usize| {
        let line = run[index].line;
        let share = over(1.0 / machine.control.options.max_block_rate, seconds(index));
        let mut load = Load { axis: None, kind: BLOCK_RATE, share, line };
        let before = index.checked_sub(1);
        for (axis, letter) in machine.letters().into_iter().enumerate() {
            let [at_start, at_end] = [before, Some(index)].map(|joint| joint.map_or(0.0, |k| acceleration(k, axis)));
            let inside = before.is_some() && index + 1 < run.len();
            let span = before.map_or(0.0, seconds) + seconds(index) + seconds(index + 1);
            let jerk = if inside { over(3.0 * (at_end - at_start), span) } else { 0.0 };
            let values = [rate(index, axis).abs(), at_start.abs().max(at_end.abs()), jerk.abs()];
            for ((kind, value), limits) in [SPEED, "acceleration", "jerk"].into_iter().zip(values).zip(limits) {
                if value / limits[axis] > load.share {
                    load = Load { axis: Some(letter), kind, share: value / limits[axis], line };
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
        let mut machine = Machine::named("xyzac-trt").unwrap();
        machine.control.options.exact_stop = false;
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
        assert_eq!(pace.slowest[0].lines, [10, 10]);
        let blocked = pace.slowest.iter().find(|s| s.lines == [9, 9]).unwrap();
        assert_eq!(blocked.busiest.axis, Some('C'));
        assert!((blocked.feed - 600.0).abs() < 1e-6 && (blocked.lost_s - 0.09).abs() < 1e-9, "{blocked:?}");
        assert!(pace.lost_s["C"] >= 0.09 - 1e-9, "{:?}", pace.lost_s);
        let plain = pace_of("G1 X100 F6000\nX110 F3000\n");
        assert!((plain.lost_s[PROGRAMMED] - 0.1).abs() < 1e-9, "{plain:?}");
    }
    #[test]
    fn blocks_in_a_row_that_are_slow_for_one_reason_are_one_stretch() {
        let mut body = "G93 G1 X10 F600\n".to_owned();
        for k in 1..=5 {
            body += &format!("X{} C{} F600\n", 10 + k, 36 * k);
        }
        let pace = pace_of(&(body + "X100 C180 F66\n"));
        let blocked = &pace.slowest[0];
        assert_eq!((blocked.lines, blocked.blocks, blocked.cause.as_str()), ([9, 13], 5, "C"), "{pace:?}");
        assert!((blocked.lost_s - pace.lost_s["C"]).abs() < 1e-9);
    }

    #[test]
    fn jerk_and_block_rate_are_named() {
        let of = |change: fn(&mut Machine)| {
            let mut machine = Machine::named("xyzac-trt").unwrap();
            change(&mut machine);
            let blocks: String = (1..=40).map(|k| format!("X{} F6000\n", f64::from(k * k * k) * 0.001)).collect();
            let text = format!("G21 G90 G61\nT1 M6\nS1000 M3\nG43 H1\nM428\nG0 X0 Y0 Z50 A0 C0\nG93 G1\n{blocks}M30\n");
            let program = read(text.as_bytes(), &Rules::of(&machine));
            pace(&simulate(&program, &Setup::at(&machine, [0.0; 3], 100.0).unwrap(), None))
        };
        let rated = of(|machine| machine.control.options.max_block_rate = 100.0);
        assert!(rated.slowest[0].cause == BLOCK_RATE && rated.lost_s[BLOCK_RATE] > 0.0, "{rated:?}");
        let jerked = of(|machine| {
            machine.linear[0].jerk = Some(1000.0);
        });
        assert_eq!((jerked.slowest[0].busiest.axis, jerked.slowest[0].busiest.kind), (Some('X'), "jerk"), "{jerked:?}");
    }

    #[test]
    fn links_as_fast_as_the_axes_can_are_not_usual() {
        // 20 mm at 600 mm/min, 400 mm at the top speed of X, 20 mm more.
        let pace = pace_of("G1 X20 F600\nX420 F30000\nX440 F600\n");
        assert!((pace.passages[0].usual_feed - 600.0).abs() < 1e-6, "{pace:?}");
        assert!(pace.slowest.is_empty(), "{pace:?}");
    }
}
