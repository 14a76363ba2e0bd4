//! Block durations from path length, stretched to the axis limits. Uses `diagnostic`, `geometry`, `motion` and `machine`.
//!
//! The model: in block `i` of duration `T_i` every axis moves from its end before to its end in the block, `d_i`, at the
//! mean rate `r_i = d_i / T_i`; between blocks `i` and `i + 1` it accelerates by
//!
//! ```text
//! a_i = (r_(i+1) - r_i) / ((T_i + T_(i+1)) / 2)
//! ```
//!
//! and about block `i` it jerks by the change of that over the mean duration of the three blocks. Limits are kept in this
//! model over each run of feed moves, from rest to rest, so that whoever has the blocks and their durations can check
//! them. Within a block with TCP on the linear axes do not move evenly; their speed, acceleration and jerk are also kept
//! between pieces of the block. Rapids run from rest to rest as fast as the axes can; where the control itself does not
//! keep the axes' speeds with TCP on, a rapid that would pass them becomes a feed move.

mod block;
mod excess;
mod filter;
mod limiter;
mod profile;
mod rapid;
#[cfg(test)]
mod tests;

pub use excess::{Excess, ExcessKind, excesses};
pub use limiter::{AxisLimit, Limiter, Loss};

use crate::machine::{AxisMove, Setup};
use crate::motion::{PassKind, ToolPath};
use block::{Block, Limits};
use limiter::Demand;
use profile::Run;

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

/// Share of speed, acceleration and jerk limits that is used, so that rounding of feed words does not pass them.
const SHARE: (f64, f64, f64) = (0.999, 0.998, 0.997);

/// Every move of a path with its duration, and what holds it back.
#[derive(Clone, Debug)]
pub struct Schedule {
    moves: Vec<TimedMove>,
    /// Block `i` leads from move `i` to move `i + 1`.
    blocks: Vec<Block>,
    demands: Vec<Demand>,
    /// Seconds that each block may not fall below, whatever the axes can.
    floors: Vec<f64>,
    limits: Limits,
    letters: [char; 5],
}

impl Schedule {
    /// Times every move of a path: feed moves by the path's own times, or else by the length of the feed reference's way
    /// in the part over the feed, then stretched to the axes' speeds, accelerations and jerks over each run between rapids; rapids by the axes alone.
    /// `tcp` says how the control interpolates.
    pub fn new(path: &ToolPath, setup: &Setup, tcp: bool, moves: &[AxisMove]) -> Self {
        let limits = Limits::of(setup.machine());
        let feed = path.cut_feed / 60.0;
        let how = setup.interpolation(tcp);
        let first = moves.first().map(|axes| TimedMove { axes: *axes, duration: 0.0, tip_length: 0.0 });
        let mut timed: Vec<TimedMove> = first.into_iter().collect();
        let (mut blocks, mut demands) = (Vec::new(), Vec::new());
        let usable = limits.shares(SHARE.0, SHARE.1, SHARE.2);
        for pair in moves.windows(2) {
            let [from, to] = pair else { continue };
            let block = Block::measure(&setup.segment(&from.to, &to.to, how), path.tool.flute_length);
            let mut axes = *to;
            let demand = if !to.kind.is_rapid() {
                match to.asked {
                    Some(seconds) => Demand::timed(seconds, &block, &usable),
                    None => Demand::feed(&block, feed, path.feed_reference, &usable),
                }
            } else if tcp && rapid::passes_speeds(setup, &[from.to, to.to], &block) {
                axes.kind = PassKind::Retract;
                Demand::slowed_rapid(&block, &usable)
            } else {
                Demand::rapid(&block, &limits)
            };
            timed.push(TimedMove { axes, duration: demand.time(), tip_length: block.tip });
            blocks.push(block);
            demands.push(demand);
        }
        let floors = demands.iter().map(Demand::time).collect();
        let letters = setup.machine().letters();
        let mut schedule = Self { moves: timed, blocks, demands, floors, limits, letters };
        schedule.stretch();
        schedule
    }

    /// Gives every block at least the seconds that the control really takes for it, because its feed word is rounded or
    /// comes to a ceiling, and stretches the others to them. `seconds` is for each move, the first included; none for
    /// rapids and for moves that are not written.
    pub fn slow_to(&mut self, seconds: &[Option<f64>]) {
        for (floor, seconds) in self.floors.iter_mut().zip(seconds.iter().skip(1)) {
            *floor = seconds.map_or(*floor, |seconds| floor.max(seconds));
        }
        self.stretch();
    }

    /// Stretches the floors to the axes' limits over every run.
    fn stretch(&mut self) {
        let usable = self.limits.shares(SHARE.0, SHARE.1, SHARE.2);
        let mut run: Vec<usize> = Vec::new();
        for index in 0..=self.blocks.len() {
            if self.is_feed(index) {
                // What moves nothing in no time is no block.
                if self.floors.get(index).is_some_and(|floor| *floor > 0.0) {
                    run.push(index);
                }
                continue;
            }
            let travels: Vec<[f64; 5]> = run.iter().map(|block| self.blocks[*block].travel).collect();
            let lengths: Vec<f64> = run.iter().map(|block| self.blocks[*block].length()).collect();
            let mut times: Vec<f64> = run.iter().map(|block| self.floors[*block]).collect();
            let (accelerations, jerks) = (&usable.accelerations, &usable.jerks);
            profile::stretch(&mut times, &Run { travels: &travels, lengths: &lengths, accelerations, jerks });
            for (block, time) in run.drain(..).zip(times) {
                self.moves[block + 1].duration = time;
            }
        }
    }

    fn is_feed(&self, block: usize) -> bool {
        self.moves.get(block + 1).is_some_and(|step| !step.axes.kind.is_rapid())
    }

    /// The moves; the first only says where the path begins. Rapids that the control would make too fast have become feed
    /// moves.
    pub fn moves(&self) -> &[TimedMove] {
        &self.moves
    }

    /// Seconds from the first move to the last.
    pub fn total(&self) -> f64 {
        self.moves.iter().map(|step| step.duration).sum()
    }
}
