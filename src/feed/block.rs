//! What a block asks of the axes and of the flutes, before its neighbours are looked at. Uses `machine` and `motion`.

use crate::machine::{Machine, Segment};
use crate::motion::FeedReference;

/// Rotary way, radians, in which the linear axes are looked at twice within a block.
const PIECE: f64 = 0.05;
/// Most pieces of a block.
const MOST_PIECES: f64 = 512.0;
/// No point of the flutes moves faster than this many times the feed, whatever the reference.
pub(super) const FASTEST_FLANK: f64 = 10.0;

/// What each axis can, in the order of the machine's letters; mm, radians and seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) speeds: [f64; 5],
    pub(super) accelerations: [f64; 5],
    pub(super) jerks: [f64; 5],
}

impl Limits {
    /// Those of a machine.
    pub(super) fn of(machine: &Machine) -> Self {
        Self { speeds: machine.speeds(), accelerations: machine.accelerations(), jerks: machine.jerks() }
    }

    /// Shares of them, so that the rounding of feed words does not pass them.
    pub(super) fn shares(&self, speed: f64, acceleration: f64, jerk: f64) -> Self {
        Self {
            speeds: self.speeds.map(|v| v * speed),
            accelerations: self.accelerations.map(|a| a * acceleration),
            jerks: self.jerks.map(|j| j * jerk),
        }
    }
}

/// A block measured. Times are to be thought with the control going through it evenly.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Travel of each axis from end to end, mm and radians.
    pub(super) travel: [f64; 5],
    /// Largest first, second and third derivative of each axis by the share of the block: differences over its pieces.
    pub(super) busiest: [[f64; 5]; 3],
    /// Lengths of the paths of tip, mid flute and top of the flutes in the part frame, mm.
    pub(super) tip: f64,
    pub(super) mid: f64,
    pub(super) top: f64,
}

impl Block {
    pub(super) fn measure(segment: &Segment<'_>, flute: f64) -> Self {
        let [from, to] = segment.ends().each_ref().map(|axes| axes.values());
        let turn = (to[3] - from[3]).abs().max((to[4] - from[4]).abs());
        let pieces = 2.0 * (turn / PIECE).ceil().clamp(1.0, MOST_PIECES / 2.0);
        let travel = std::array::from_fn(|k| to[k] - from[k]);
        let mut block = Self { travel, busiest: [[0.0; 5]; 3], tip: 0.0, mid: 0.0, top: 0.0 };
        let (mut pose, mut axes) = (segment.pose(0.0), from);
        // Differences of first and second order of the piece before.
        let mut before: [Option<[f64; 5]>; 2] = [None; 2];
        for piece in 1..=pieces as u32 {
            let share = f64::from(piece) / pieces;
            let (next, reached) = (segment.pose(share), segment.axes(share).map_or(to, |axes| axes.values()));
            block.tip += (next.tip - pose.tip).norm();
            block.mid += (next.at_height(flute / 2.0) - pose.at_height(flute / 2.0)).norm();
            block.top += (next.at_height(flute) - pose.at_height(flute)).norm();
            let first: [f64; 5] = std::array::from_fn(|k| (reached[k] - axes[k]) * pieces);
            let second = before[0].map(|last| std::array::from_fn(|k| (first[k] - last[k]) * pieces));
            let third = before[1]
                .zip(second)
                .map(|(last, second): ([f64; 5], [f64; 5])| std::array::from_fn(|k| (second[k] - last[k]) * pieces));
            for (busiest, order) in block.busiest.iter_mut().zip([Some(first), second, third]) {
                let order: [f64; 5] = order.unwrap_or_default();
                busiest.iter_mut().zip(order).for_each(|(most, value)| *most = most.max(value.abs()));
            }
            before = [Some(first), second];
            (pose, axes) = (next, reached);
        }
        block
    }

    /// Way of the faster end of the flutes, mm.
    pub(super) fn length(&self) -> f64 {
        self.tip.max(self.top)
    }

    /// Length that the feed is the speed along, mm.
    fn reference_length(&self, reference: FeedReference) -> f64 {
        match reference {
            FeedReference::Tip => self.tip,
            FeedReference::Mid => self.mid,
            FeedReference::Top => self.top,
            FeedReference::Fastest => self.length(),
            // Simpson's rule: exact where the speed grows evenly or as the square of the height.
            FeedReference::Mean => (self.tip + 4.0 * self.mid + self.top) / 6.0,
        }
    }

    /// Seconds that the feed asks for; `feed` in mm/s.
    pub(super) fn asked_time(&self, feed: f64, reference: FeedReference) -> f64 {
        self.reference_length(reference) / feed
    }

    /// Seconds in which no point of the flutes is far faster than the feed.
    pub(super) fn flank_time(&self, feed: f64) -> f64 {
        self.length() / (FASTEST_FLANK * feed)
    }

    /// Seconds that each axis needs within the block for its speed, its acceleration and its jerk.
    pub(super) fn axis_times(&self, limits: &Limits) -> [[f64; 5]; 3] {
        let [first, second, third] = &self.busiest;
        [
            std::array::from_fn(|k| first[k] / limits.speeds[k]),
            std::array::from_fn(|k| (second[k] / limits.accelerations[k]).sqrt()),
            std::array::from_fn(|k| (third[k] / limits.jerks[k]).cbrt()),
        ]
    }

    /// Seconds from rest to rest with every axis at its own top speed and acceleration.
    pub(super) fn rapid_time(&self, limits: &Limits) -> f64 {
        let axes = self.busiest[0].iter().zip(limits.speeds.iter().zip(&limits.accelerations));
        axes.map(|(way, (speed, acceleration))| rest_to_rest(*way, *speed, *acceleration)).fold(0.0, f64::max)
    }
}

/// Seconds from rest to rest.
fn rest_to_rest(way: f64, speed: f64, acceleration: f64) -> f64 {
    let ramp = speed / acceleration;
    if way >= speed * ramp { way / speed + ramp } else { 2.0 * (way / acceleration).sqrt() }
}
