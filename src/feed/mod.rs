//! Block durations from path length, stretched to the axis limits. Uses `diagnostic`, `geometry`, `motion` and `machine`.
//!
//! The model: in block `i` of duration `T_i` every axis moves from its end before to its end in the block, `d_i`, at the
//! mean rate `r_i = d_i / T_i`; between blocks `i` and `i + 1` it accelerates by
//!
//! ```text
//! a_i = (r_(i+1) - r_i) / ((T_i + T_(i+1)) / 2)
//! ```
//!
//! Limits are kept in this model, so that whoever has the blocks and their durations can check them. Within a block with
//! TCP on the linear axes do not move evenly; their speed is also kept at quarter points. Motion from rest at the start of
//! a run of feed moves and to rest at its end is the control's own business, as are rapids, which run from rest to rest.

mod profile;
#[cfg(test)]
mod tests;

use crate::machine::{AxisMove, Machine, Segment, Setup};
use crate::motion::{FeedReference, ToolPath};

/// A move and the time it takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedMove {
    /// The move.
    pub axes: AxisMove,
    /// Seconds; for rapids what the axes' top speeds and accelerations allow from rest to rest. Zero for the first
    /// move, which starts from wherever the machine stands.
    pub duration: f64,
    /// Length of the tip's path in the part frame, mm: what a TCP feed word refers to.
    pub tip_length: f64,
}

/// What an axis does too fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExcessKind {
    /// Mean rate in a block.
    Speed,
    /// Change of rate between a block and the next.
    Acceleration,
}

/// An axis beyond its limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// Index of the move; for accelerations that of the later one.
    pub index: usize,
    /// Letter of the axis.
    pub axis: char,
    /// What is too fast.
    pub kind: ExcessKind,
    /// Its value: mm/s, rad/s, mm/s^2 or rad/s^2.
    pub value: f64,
    /// Its limit, same unit.
    pub limit: f64,
}

/// Share of speed and acceleration limits that is used, so that rounding of feed words does not pass them.
const SHARE: (f64, f64) = (0.999, 0.998);
/// No point of the flutes moves faster than this many times the feed, whatever the reference.
const FASTEST_FLANK: f64 = 10.0;
/// Pieces of a block in which lengths and speeds are measured.
const PIECES: usize = 4;

/// What a block is long and needs, before its neighbours are looked at.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// Travel of each axis from end to end, mm and radians.
    travel: [f64; 5],
    /// Largest travel of each axis in a piece of the block, times the number of pieces.
    busiest: [f64; 5],
    /// Lengths of the paths of tip, mid flute and top of the flutes in the part frame, mm.
    tip: f64,
    mid: f64,
    top: f64,
}

impl Block {
    fn measure(segment: &Segment<'_>, flute: f64) -> Self {
        let [from, to] = segment.ends().each_ref().map(|axes| axes.values());
        let mut block =
            Self { travel: std::array::from_fn(|k| to[k] - from[k]), busiest: [0.0; 5], tip: 0.0, mid: 0.0, top: 0.0 };
        let (mut pose, mut axes) = (segment.pose(0.0), from);
        for piece in 1..=PIECES {
            let share = piece as f64 / PIECES as f64;
            let (next, reached) = (segment.pose(share), segment.axes(share).map_or(to, |axes| axes.values()));
            block.tip += (next.tip - pose.tip).norm();
            block.mid += (next.at_height(flute / 2.0) - pose.at_height(flute / 2.0)).norm();
            block.top += (next.at_height(flute) - pose.at_height(flute)).norm();
            for (busiest, (a, b)) in block.busiest.iter_mut().zip(axes.iter().zip(reached)) {
                *busiest = busiest.max((b - a).abs() * PIECES as f64);
            }
            (pose, axes) = (next, reached);
        }
        block
    }

    /// Seconds from rest to rest with every axis at its own top speed and acceleration.
    fn rapid_time(&self, speeds: &[f64; 5], accelerations: &[f64; 5]) -> f64 {
        let axes = self.busiest.iter().zip(speeds.iter().zip(accelerations));
        let times = axes.map(|(way, (speed, acceleration))| {
            let ramp = speed / acceleration;
            if *way >= speed * ramp { way / speed + ramp } else { 2.0 * (way / acceleration).sqrt() }
        });
        times.fold(0.0, f64::max)
    }

    /// Seconds that the path or its feed, in mm/s, and the axis speeds demand.
    fn feed_time(&self, asked: Option<f64>, feed: f64, reference: FeedReference, speeds: &[f64; 5]) -> f64 {
        let axes = self.busiest.iter().zip(speeds).map(|(way, speed)| way / (speed * SHARE.0));
        if let Some(seconds) = asked {
            return axes.fold(seconds, f64::max);
        }
        let fastest = self.tip.max(self.top);
        let length = match reference {
            FeedReference::Tip => self.tip,
            FeedReference::Mid => self.mid,
            FeedReference::Top => self.top,
            FeedReference::Fastest => fastest,
        };
        axes.fold((length / feed).max(fastest / (FASTEST_FLANK * feed)), f64::max)
    }
}

/// Times every move of a path: feed moves by the path's own times, or else by the length of the feed reference's way in
/// the part over the feed, then
/// stretched to the axes' speeds and accelerations over each run between rapids; rapids by the axes alone. `tcp` says
/// how the control interpolates.
pub fn durations(path: &ToolPath, setup: &Setup, tcp: bool, moves: &[AxisMove]) -> Vec<TimedMove> {
    let machine = setup.machine();
    let (speeds, accelerations) = (machine.speeds(), machine.accelerations());
    let how = setup.interpolation(tcp);
    let blocks: Vec<Block> = moves
        .windows(2)
        .map(|pair| Block::measure(&setup.segment(&pair[0].to, &pair[1].to, how), path.tool.flute_length))
        .collect();
    let feed = path.cut_feed / 60.0;
    let mut times: Vec<f64> = blocks
        .iter()
        .zip(moves.iter().skip(1))
        .map(|(block, step)| {
            if step.kind.is_rapid() {
                block.rapid_time(&speeds, &accelerations)
            } else {
                block.feed_time(step.asked, feed, path.feed_reference, &speeds)
            }
        })
        .collect();
    for run in runs(moves) {
        let travels: Vec<[f64; 5]> = blocks[run.clone()].iter().map(|block| block.travel).collect();
        let lengths: Vec<f64> = blocks[run.clone()].iter().map(|block| block.tip.max(block.top)).collect();
        profile::stretch(&mut times[run], &travels, &lengths, &accelerations.map(|a| a * SHARE.1));
    }
    let first = moves.first().map(|axes| TimedMove { axes: *axes, duration: 0.0, tip_length: 0.0 });
    let rest = moves.iter().skip(1).zip(times.iter().zip(&blocks));
    let rest =
        rest.map(|(axes, (duration, block))| TimedMove { axes: *axes, duration: *duration, tip_length: block.tip });
    first.into_iter().chain(rest).collect()
}

/// Runs of feed moves between rapids, as ranges of blocks; block `i` leads from move `i` to move `i + 1`.
fn runs(moves: &[AxisMove]) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut start = None;
    for (block, step) in moves.iter().skip(1).enumerate() {
        match (step.kind.is_rapid(), start) {
            (false, None) => start = Some(block),
            (true, Some(from)) => {
                runs.push(from..block);
                start = None;
            }
            _ => {}
        }
    }
    runs.extend(start.map(|from| from..moves.len() - 1));
    runs
}

/// Every axis speed and acceleration beyond its limit in the model of this module, for feed moves with their final
/// durations; empty when all is well.
pub fn excesses(moves: &[TimedMove], machine: &Machine) -> Vec<Excess> {
    let (letters, speeds, accelerations) = (machine.letters(), machine.speeds(), machine.accelerations());
    let mut found = Vec::new();
    let mut before: Option<([f64; 5], f64)> = None;
    for (index, pair) in moves.windows(2).enumerate() {
        let [from, to] = pair else { continue };
        if to.axes.kind.is_rapid() {
            before = None;
            continue;
        }
        let (a, b) = (from.axes.to.values(), to.axes.to.values());
        let rates: [f64; 5] = std::array::from_fn(|k| (b[k] - a[k]) / to.duration);
        for k in 0..5 {
            let mut check = |kind, value: f64, limit: f64| {
                // A move of no length in no time is no motion.
                if value > limit {
                    found.push(Excess { index: index + 1, axis: letters[k], kind, value, limit });
                }
            };
            check(ExcessKind::Speed, rates[k].abs(), speeds[k]);
            if let Some((last, duration)) = before {
                let change = (rates[k] - last[k]).abs() / ((duration + to.duration) / 2.0);
                check(ExcessKind::Acceleration, change, accelerations[k]);
            }
        }
        before = Some((rates, to.duration));
    }
    found
}
