//! What holds each block back, and what that costs. Uses the other files of this module and `motion`.

use super::Schedule;
use super::block::{Block, Limits};
use super::profile::joint;
use crate::motion::FeedReference;
use std::collections::BTreeMap;

/// Which limit of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum AxisLimit {
    /// Speed.
    Speed,
    /// Acceleration.
    Acceleration,
    /// Jerk.
    Jerk,
}

/// What holds a block back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limiter {
    /// Nothing: the feed that is asked for is kept.
    Feed,
    /// The fastest point of the flutes, where the feed's reference hardly moves.
    Flank,
    /// An axis, by its letter.
    Axis(char, AxisLimit),
    /// The feed word: its digits, or its ceiling.
    Word,
    /// It is a rapid.
    Rapid,
}

/// What one limiter costs.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Loss {
    /// What holds the blocks back.
    pub limiter: Limiter,
    /// How many blocks.
    pub blocks: usize,
    /// Seconds that they take longer than the feed asks for.
    pub seconds: f64,
}

/// What a block alone asks for, before its neighbours are looked at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Demand {
    /// Seconds that the feed asks for; `None` where it asks for nothing.
    asked: Option<f64>,
    /// Seconds for the fastest point of the flutes.
    flank: f64,
    /// Seconds for each axis' speed, acceleration and jerk within the block.
    axes: [[f64; 5]; 3],
    /// Seconds of a rapid.
    rapid: f64,
}

impl Demand {
    pub(super) fn feed(block: &Block, feed: f64, reference: FeedReference, limits: &Limits) -> Self {
        let (asked, flank) = (Some(block.asked_time(feed, reference)), block.flank_time(feed));
        Self { asked, flank, axes: block.axis_times(limits), rapid: 0.0 }
    }

    /// A block of a path that brings its own times.
    pub(super) fn timed(seconds: f64, block: &Block, limits: &Limits) -> Self {
        Self { asked: Some(seconds), flank: 0.0, axes: block.axis_times(limits), rapid: 0.0 }
    }

    pub(super) fn slowed_rapid(block: &Block, limits: &Limits) -> Self {
        Self { asked: None, flank: 0.0, axes: block.axis_times(limits), rapid: 0.0 }
    }

    pub(super) fn rapid(block: &Block, limits: &Limits) -> Self {
        Self { asked: None, flank: 0.0, axes: [[0.0; 5]; 3], rapid: block.rapid_time(limits) }
    }

    /// Seconds that the block takes at least.
    pub(super) fn time(&self) -> f64 {
        let axes = self.axes.iter().flatten().copied().fold(0.0, f64::max);
        axes.max(self.asked.unwrap_or(0.0)).max(self.flank).max(self.rapid)
    }
}

/// Share of a duration that is no loss.
const NOTHING: f64 = 0.003;

impl Schedule {
    /// What holds back each block; block `i` leads to move `i + 1`.
    pub fn limiters(&self) -> Vec<Limiter> {
        (0..self.blocks.len()).map(|block| self.limiter(block)).collect()
    }

    /// What holds the blocks back and what that costs, the most costly first; the feed itself and rapids are left out.
    pub fn losses(&self) -> Vec<Loss> {
        let mut found: BTreeMap<Limiter, (usize, f64)> = BTreeMap::new();
        for (block, limiter) in self.limiters().into_iter().enumerate() {
            if matches!(limiter, Limiter::Feed | Limiter::Rapid) {
                continue;
            }
            let lost = self.duration(block) - self.demands[block].asked.unwrap_or(0.0);
            let sum = found.entry(limiter).or_default();
            *sum = (sum.0 + 1, sum.1 + lost);
        }
        let one = |(limiter, (blocks, seconds))| Loss { limiter, blocks, seconds };
        let mut losses: Vec<Loss> = found.into_iter().map(one).collect();
        losses.sort_by(|a, b| b.seconds.total_cmp(&a.seconds));
        losses
    }

    fn duration(&self, block: usize) -> f64 {
        self.moves[block + 1].duration
    }

    fn limiter(&self, block: usize) -> Limiter {
        let (demand, duration) = (&self.demands[block], self.duration(block));
        if !self.is_feed(block) {
            return Limiter::Rapid;
        }
        if demand.asked.is_some_and(|asked| duration <= asked * (1.0 + NOTHING)) {
            return Limiter::Feed;
        }
        // Each limit with the factor by which time could be less for it: the nearest to one holds the block back.
        let letters = self.letters;
        let mut nearest = (Limiter::Flank, demand.flank / duration);
        let mut offer = |limiter, factor: f64| {
            if factor > nearest.1 {
                nearest = (limiter, factor);
            }
        };
        let around = self.accelerations_around(block);
        for k in 0..5 {
            let own = |order: usize| demand.axes[order][k] / duration;
            offer(Limiter::Axis(letters[k], AxisLimit::Speed), own(0));
            let joints = around[1][k].abs().max(around[2][k].abs()) / self.limits.accelerations[k];
            offer(Limiter::Axis(letters[k], AxisLimit::Acceleration), own(1).max(joints.sqrt()));
            let jerks = self.jerk_around(block, &around, k) / self.limits.jerks[k];
            offer(Limiter::Axis(letters[k], AxisLimit::Jerk), own(2).max(jerks.cbrt()));
        }
        if self.floors[block] > demand.time() * (1.0 + NOTHING) {
            offer(Limiter::Word, self.floors[block] / duration);
        }
        nearest.0
    }

    /// Accelerations at the joints before the block before, before the block, after it, and after the block after.
    fn accelerations_around(&self, block: usize) -> [[f64; 5]; 4] {
        let at = |block: Option<usize>| match block.filter(|block| self.is_feed(*block)) {
            Some(block) => (self.blocks[block].travel, self.duration(block)),
            None => ([0.0; 5], 0.0),
        };
        let side = |offset: usize| (block + offset).checked_sub(2);
        std::array::from_fn(|i| joint(at(side(i)), at(side(i + 1))))
    }

    fn jerk_around(&self, block: usize, around: &[[f64; 5]; 4], axis: usize) -> f64 {
        let time = |offset: usize| {
            let block = (block + offset).checked_sub(2).filter(|block| self.is_feed(*block));
            block.map_or(0.0, |block| self.duration(block))
        };
        let jerks = (0..3).map(|i| {
            let span = time(i) + time(i + 1) + time(i + 2);
            if span > 0.0 { 3.0 * (around[i + 1][axis] - around[i][axis]).abs() / span } else { 0.0 }
        });
        jerks.fold(0.0, f64::max)
    }
}
