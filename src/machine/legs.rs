//! The stations of a path cut into legs along which neither branch nor turns of the rotary axes can change. Uses
//! `motion`.
//!
//! Along a leg a branch of the inverse kinematics is followed once, from the angles within half a turn of zero: its
//! extremes tell for every number of whole turns at once whether the leg fits the limits, so that choosing them needs a
//! look at each leg, not at each pose.

use super::limits::Excess;
use super::model::Machine;
use super::setup::{Setup, unwind};
use super::stations::Station;

/// How the first station of a leg is reached from the last of the leg before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Arrival {
    /// From wherever the machine stands.
    Start,
    /// Continuously; the stations are neighbours.
    Continuous,
    /// It is the same station, where both branches meet.
    Meeting,
    /// By a rapid, on which anything may turn.
    Rapid,
    /// It is the same station; the tool may leave the part there, turn, and come back.
    Rewind,
}

/// What one branch does along a leg. Radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Followed {
    /// At the first station, within half a turn of zero.
    pub(super) start: [f64; 2],
    /// At the last station, followed from there.
    pub(super) end: [f64; 2],
    /// Extremes on the way.
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
    /// Seconds that the slowest axis needs, with a little for the others.
    pub(super) seconds: f64,
    /// The first station at which a linear axis passes a limit.
    pub(super) outside: Option<(usize, Excess)>,
}

/// A stretch of stations, from `first` to `last` inclusive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leg {
    pub(super) first: usize,
    pub(super) last: usize,
    pub(super) arrival: Arrival,
    /// What the branches do along it; `None` where the tool axis stays in the pole and the free axis stands anywhere.
    pub(super) branches: Option<[Followed; 2]>,
}

/// Seconds that axes need for their ways: the slowest one's, with a little for the others.
pub(super) struct Clock {
    linear: [f64; 3],
    rotary: [f64; 2],
}

/// Share of the time of axes that are not the slowest.
const OTHERS: f64 = 1e-3;

impl Clock {
    pub(super) fn new(machine: &Machine) -> Self {
        Self {
            linear: machine.linear.each_ref().map(|axis| 1.0 / axis.speed),
            rotary: machine.rotary.each_ref().map(|axis| 1.0 / axis.speed),
        }
    }

    pub(super) fn turn(&self, from: &[f64; 2], to: &[f64; 2]) -> f64 {
        let [a, b] = [0, 1].map(|k: usize| (to[k] - from[k]).abs() * self.rotary[k]);
        a.max(b) + OTHERS * a.min(b)
    }

    pub(super) fn way(&self, from: &[f64; 3], to: &[f64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k: usize| (to[k] - from[k]).abs() * self.linear[k]);
        x.max(y).max(z)
    }

    fn both(&self, turn: f64, way: f64) -> f64 {
        turn.max(way) + OTHERS * turn.min(way)
    }
}

/// Cuts stations into legs. With `rewinds`, the tool may leave the part at each station where that says so.
pub(super) fn legs(stations: &[Station], setup: &Setup, rewinds: Option<&[bool]>) -> Vec<Leg> {
    let cutter = LegCutter { stations, setup, clock: Clock::new(setup.machine()) };
    let mut legs = Vec::new();
    let (mut first, mut arrival) = (0, Arrival::Start);
    for index in 1..=stations.len() {
        let (before, here) = (&stations[index - 1], stations.get(index));
        let rapid = here.is_some_and(|here| here.kind.is_rapid());
        let changes = here.is_none_or(|here| here.free != before.free);
        let may_rewind = rewinds.is_some_and(|at| at.get(index - 1).is_some_and(|may| *may));
        // The leg that is open could be left at its last station, which would be the first of the next one.
        let splits = !before.free && index - 1 > first && here.is_some_and(|here| !here.kind.is_rapid());
        if rapid || changes {
            legs.push(cutter.leg(first, index - 1, arrival));
            (first, arrival) = (index, if rapid { Arrival::Rapid } else { Arrival::Continuous });
        } else if splits && before.merged() {
            legs.push(cutter.leg(first, index - 1, arrival));
            (first, arrival) = (index - 1, Arrival::Meeting);
        } else if splits && may_rewind {
            legs.push(cutter.leg(first, index - 1, arrival));
            (first, arrival) = (index - 1, Arrival::Rewind);
        }
    }
    legs
}

struct LegCutter<'a> {
    stations: &'a [Station],
    setup: &'a Setup,
    clock: Clock,
}

impl LegCutter<'_> {
    fn leg(&self, first: usize, last: usize, arrival: Arrival) -> Leg {
        let free = self.stations[first].free;
        let branches = (!free).then(|| [0, 1].map(|branch| self.follow(first, last, branch)));
        Leg { first, last, arrival, branches }
    }

    fn follow(&self, first: usize, last: usize, branch: usize) -> Followed {
        let solution = |index: usize| &self.stations[index].solutions.branches[branch & 1];
        let start = solution(first).rotary;
        let mut followed = Followed { start, end: start, low: start, high: start, seconds: 0.0, outside: None };
        let machine = self.setup.machine();
        for index in first..=last {
            let here = solution(index);
            let next: [f64; 2] = std::array::from_fn(|k| unwind(here.rotary[k], followed.end[k]));
            if index > first {
                let way = self.clock.way(&solution(index - 1).linear, &here.linear);
                followed.seconds += self.clock.both(self.clock.turn(&followed.end, &next), way);
            }
            followed.low = std::array::from_fn(|k| followed.low[k].min(next[k]));
            followed.high = std::array::from_fn(|k| followed.high[k].max(next[k]));
            followed.end = next;
            if followed.outside.is_none() {
                followed.outside = Excess::of_linear(machine, &here.linear).map(|excess| (index, excess));
            }
        }
        followed
    }
}
