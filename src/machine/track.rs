//! Branch and turns of the rotary axes over a whole tool path, by dynamic programming. Uses `diagnostic` and `motion`.
//!
//! Each station of the path has a few states: branch of the inverse kinematics and whole turns of either axis, within
//! the limits. While the tool cuts, a state goes on only to what follows it continuously: same branch, nearest turn;
//! the branch may change only where both meet (pole, fold), and the free axis may turn in place at a pole. On rapids any
//! state may follow any other. The cost is time: the slowest axis' travel over its top speed, plus a little for nearness
//! of limits; the cheapest sequence over all passes wins. Source: Bellman's principle, nothing else.

use super::axes::AxisPosition;
use super::model::{Machine, Travel};
use super::setup::{Setup, unwind};
use super::stations::{Station, Surveyor, whereabouts};
use crate::diagnostic::{Diagnostic, Result};
use crate::motion::ToolPath;
use std::f64::consts::TAU;

/// Largest turn of a rotary axis that counts as continuous between neighbouring stations, radians.
pub(super) const CONTINUOUS: f64 = 0.45;
/// Whole turns that are tried for an axis with many.
const MOST_TURNS: i32 = 5;
/// Slack on limits for rounding, mm and degrees or radians.
const SLACK: f64 = 1e-9;
/// Nearness to a limit that starts to cost, radians.
const MARGIN: f64 = 0.1;
/// Cost of nearness to a limit, seconds a station at the limit.
const MARGIN_COST: f64 = 1e-3;
/// Cost of turning the free axis in place while the tool touches the part, seconds a turn and times its travel.
const DWELL: (f64, f64) = (1.0, 3.0);
/// What helps against a limit.
pub(super) const MORE_ROOM: &str = "move the work offset, mount the part turned, or choose a machine with more travel";
/// Share of the travel from zero that the first position costs.
const START_SHARE: f64 = 0.1;

/// The chosen rotary positions along a path.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// In order; where an axis turns in place, two follow each other at one parameter.
    pub(super) stops: Vec<Stop>,
}

/// A station with its chosen rotary positions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub(super) pass: usize,
    pub(super) t: f64,
    pub(super) rotary: [f64; 2],
}

#[derive(Clone, Copy, Debug)]
struct State {
    rotary: [f64; 2],
    branch: usize,
    cost: f64,
    /// Index of the state before, in the layer before.
    from: usize,
}

/// One step of the dynamic programme: a station, or the turn in place at a free station.
struct Layer {
    station: usize,
    states: Vec<State>,
}

/// An axis position outside its limits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Excess {
    axis: char,
    value: f64,
    limit: f64,
    by: f64,
    unit: &'static str,
}

impl std::fmt::Display for Excess {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { axis, value, limit, by, unit } = self;
        write!(f, "axis {axis} would have to stand at {value:.4} {unit}, {by:.4} {unit} beyond its limit {limit:.4}")
    }
}

/// Chooses branch and turns for the whole path. `pole_radius`, radians: nearer to a pole the free axis may stand
/// anywhere.
pub(super) fn track(path: &ToolPath, setup: &Setup, pole_radius: f64) -> Result<Track> {
    let stations = Surveyor { path, setup, pole_radius }.survey()?;
    Chooser { path, setup, stations: &stations, free_axis: setup.machine().chain[0] }.choose()
}

struct Chooser<'a> {
    path: &'a ToolPath,
    setup: &'a Setup,
    stations: &'a [Station],
    /// Index of the rotary axis that is free at a pole.
    free_axis: usize,
}

impl Chooser<'_> {
    fn choose(&self) -> Result<Track> {
        let mut layers: Vec<Layer> = Vec::with_capacity(self.stations.len());
        for index in 0..self.stations.len() {
            let states = match layers.last() {
                None => self.first(index)?,
                Some(before) => self.next(before, index)?,
            };
            layers.push(Layer { station: index, states });
            if self.stations[index].free {
                let turned = layers.last().map(|arrived| self.turned_in_place(arrived)).unwrap_or_default();
                layers.push(Layer { station: index, states: turned });
            }
        }
        Ok(self.cheapest(&layers))
    }

    /// Walks back from the cheapest end.
    fn cheapest(&self, layers: &[Layer]) -> Track {
        let mut stops = Vec::with_capacity(layers.len());
        let end = layers.last().map(|layer| layer.states.as_slice()).unwrap_or_default();
        let best = |best: usize, i: usize| if end[i].cost < end[best].cost { i } else { best };
        let mut at = (0..end.len()).fold(0, best);
        for layer in layers.iter().rev() {
            let Some(state) = layer.states.get(at) else { continue };
            let station = &self.stations[layer.station];
            stops.push(Stop { pass: station.pass, t: station.t, rotary: state.rotary });
            at = state.from;
        }
        stops.reverse();
        stops.dedup_by(|b, a| a.pass == b.pass && a.t == b.t && a.rotary == b.rotary);
        Track { stops }
    }

    /// Every state of the first station within the limits.
    fn first(&self, index: usize) -> Result<Vec<State>> {
        let mut states = Vec::new();
        let mut nearest: Option<Excess> = None;
        for (branch, rotary) in self.fresh(index) {
            let cost = START_SHARE * self.travel_time([0.0; 2], rotary);
            match self.excess(index, branch, rotary) {
                None => keep(&mut states, State { rotary, branch, cost: cost + self.margin_cost(rotary), from: 0 }),
                Some(excess) => closer(&mut nearest, excess),
            }
        }
        if states.is_empty() { Err(self.impossible(index, nearest, true)) } else { Ok(states) }
    }

    /// The states of a station that can follow those of the layer before.
    fn next(&self, before: &Layer, index: usize) -> Result<Vec<State>> {
        let (last, here) = (&self.stations[before.station], &self.stations[index]);
        let mut states = Vec::new();
        let mut nearest: Option<Excess> = None;
        let mut attempt = |from: usize, state: &State, branch: usize, rotary: [f64; 2]| {
            let cost = state.cost + self.leg_time(last, here, state, branch, rotary) + self.margin_cost(rotary);
            match self.excess(index, branch, rotary) {
                None => keep(&mut states, State { rotary, branch, cost, from }),
                Some(excess) => closer(&mut nearest, excess),
            }
        };
        let fresh = if here.kind.is_rapid() { self.fresh(index) } else { Vec::new() };
        for (from, state) in before.states.iter().enumerate() {
            for branch in 0..2 {
                if branch != state.branch && !last.merged() && !here.merged() {
                    continue;
                }
                let rotary = self.following(here, branch, state.rotary);
                if (0..2).all(|k| (rotary[k] - state.rotary[k]).abs() <= CONTINUOUS) {
                    attempt(from, state, branch, rotary);
                }
            }
            for (branch, rotary) in &fresh {
                attempt(from, state, *branch, *rotary);
            }
        }
        if states.is_empty() {
            let alone = self.fresh(index).iter().all(|(branch, rotary)| self.excess(index, *branch, *rotary).is_some());
            return Err(self.impossible(index, nearest, alone));
        }
        Ok(states)
    }

    /// At a free station the free axis may turn to where a following station needs it.
    fn turned_in_place(&self, arrived: &Layer) -> Vec<State> {
        let station = &self.stations[arrived.station];
        let wanted = self.wanted_angles(arrived.station);
        let (dwell, factor) = if station.kind.is_rapid() { (0.0, 1.0) } else { DWELL };
        let mut states: Vec<State> = Vec::new();
        for (from, state) in arrived.states.iter().enumerate() {
            keep(&mut states, State { from, ..*state });
            for angle in &wanted {
                let near = unwind(*angle, state.rotary[self.free_axis]);
                for turned in [near - TAU, near, near + TAU] {
                    let mut rotary = state.rotary;
                    rotary[self.free_axis] = turned;
                    if self.excess(arrived.station, state.branch, rotary).is_none() {
                        let cost = state.cost + dwell + factor * self.travel_time(state.rotary, rotary);
                        keep(&mut states, State { rotary, branch: state.branch, cost, from });
                    }
                }
            }
        }
        states
    }

    /// Angles of the free axis in both branches at the next station where it is not free; zero where there is none.
    fn wanted_angles(&self, index: usize) -> Vec<f64> {
        let next = self.stations[index..].iter().find(|station| !station.free);
        match next {
            Some(station) => station.solutions.branches.iter().map(|b| b.rotary[self.free_axis]).collect(),
            None => vec![0.0],
        }
    }

    /// Rotary positions of a branch at a station, turned to be nearest to `rotary`; a free axis stays.
    fn following(&self, here: &Station, branch: usize, rotary: [f64; 2]) -> [f64; 2] {
        let target = here.solutions.branches[branch].rotary;
        std::array::from_fn(|k| if here.free && k == self.free_axis { rotary[k] } else { unwind(target[k], rotary[k]) })
    }

    /// Both branches with every number of whole turns worth trying.
    fn fresh(&self, index: usize) -> Vec<(usize, [f64; 2])> {
        let station = &self.stations[index];
        let machine = self.setup.machine();
        let mut all = Vec::new();
        for (branch, solution) in station.solutions.branches.iter().enumerate() {
            let angles: [Vec<f64>; 2] = std::array::from_fn(|k| {
                let starts = if station.free && k == self.free_axis {
                    self.wanted_angles(index)
                } else {
                    vec![solution.rotary[k]]
                };
                starts.iter().flat_map(|angle| turns(machine.rotary[k].travel, *angle)).collect()
            });
            for first in &angles[0] {
                all.extend(angles[1].iter().map(|second| (branch, [*first, *second])));
            }
        }
        all
    }

    /// An axis outside its limits, if any, in a state of a station.
    fn excess(&self, index: usize, branch: usize, rotary: [f64; 2]) -> Option<Excess> {
        let station = &self.stations[index];
        let linear = if station.free {
            self.setup.with_rotary(&station.pose.tip, rotary).linear
        } else {
            station.solutions.branches[branch].linear
        };
        excess(self.setup.machine(), &AxisPosition { linear, rotary })
    }

    /// Seconds that the slower rotary axis needs, with a little for the other.
    fn travel_time(&self, from: [f64; 2], to: [f64; 2]) -> f64 {
        let times = self.setup.machine().rotary.iter().zip(from.iter().zip(to));
        let times = times.map(|(axis, (from, to))| (to - from).abs() / axis.speed);
        times.fold(0.0, |sum: f64, time| sum.max(time) + 1e-3 * sum.min(time))
    }

    fn leg_time(&self, last: &Station, here: &Station, state: &State, branch: usize, rotary: [f64; 2]) -> f64 {
        let turning = self.travel_time(state.rotary, rotary);
        if !here.kind.is_rapid() {
            return turning;
        }
        // A rapid turns while it travels: only what the turn takes longer counts, and a little of it always.
        let machine = self.setup.machine();
        let (from, to) = (&last.solutions.branches[state.branch], &here.solutions.branches[branch]);
        let linear = machine.linear.iter().zip(from.linear.iter().zip(to.linear));
        let travelling = linear.map(|(axis, (from, to))| (to - from).abs() / axis.speed).fold(0.0, f64::max);
        turning.max(travelling) + 1e-2 * turning
    }

    fn margin_cost(&self, rotary: [f64; 2]) -> f64 {
        let axes = self.setup.machine().rotary.iter().zip(rotary);
        axes.map(|(axis, angle)| match axis.travel {
            Travel::Limited { min, max } => {
                MARGIN_COST * (1.0 - (angle - min).min(max - angle) / MARGIN).clamp(0.0, 1.0)
            }
            Travel::Unlimited | Travel::Wrapped => 0.0,
        })
        .sum()
    }

    /// `alone`: the pose cannot be held at all; else it can, but not reached from where the tool comes.
    fn impossible(&self, index: usize, nearest: Option<Excess>, alone: bool) -> Box<Diagnostic> {
        let station = &self.stations[index];
        let place = whereabouts(self.path, station.pass, &station.pose);
        let Some(needs) = nearest else {
            return Diagnostic::error(format!("{place}: no continuous motion of the rotary axes leads here")).help(
                "the tool axis passes too near to the pole to be followed; tilt the part a little on the table, or \
                 choose another machine",
            );
        };
        if alone {
            return Diagnostic::error(format!("{place} is out of reach: {needs}")).help(MORE_ROOM);
        }
        Diagnostic::error(format!("{place} cannot be reached without leaving the part: {needs}")).help(
            "split the pass where the axis can be turned back, mount the part turned, or choose a machine with more travel",
        )
    }
}

/// An axis outside its limits, if any; the rotary axes first.
pub(super) fn excess(machine: &Machine, axes: &AxisPosition) -> Option<Excess> {
    let rotary = machine.rotary.iter().zip(axes.rotary).find_map(|(axis, angle)| {
        let by = axis.travel.excess(angle);
        let limit = if let Travel::Limited { min, max } = axis.travel { angle.clamp(min, max) } else { angle };
        let [value, limit, by] = [angle, limit, by].map(f64::to_degrees);
        (by > SLACK).then_some(Excess { axis: axis.letter, value, limit, by, unit: "degrees" })
    });
    let linear = machine.linear.iter().zip(axes.linear).find_map(|(axis, value)| {
        let by = (axis.min - value).max(value - axis.max);
        let limit = value.clamp(axis.min, axis.max);
        (by > SLACK).then_some(Excess { axis: axis.letter, value, limit, by, unit: "mm" })
    });
    rotary.or(linear)
}

/// The same direction with whole turns added: all that fit, or some about the middle of a long travel; at least the
/// nearest to the middle, which may not fit.
fn turns(travel: Travel, angle: f64) -> Vec<f64> {
    match travel {
        Travel::Unlimited | Travel::Wrapped => vec![unwind(angle, 0.0)],
        Travel::Limited { min, max } => {
            let middle = unwind(angle, (min + max) / 2.0);
            let most = MOST_TURNS / 2;
            let fitting = |k: &i32| travel.excess(middle + f64::from(*k) * TAU) <= SLACK;
            let mut turns: Vec<f64> = (-most..=most).filter(fitting).map(|k| middle + f64::from(k) * TAU).collect();
            if turns.is_empty() {
                turns.push(middle);
            }
            turns
        }
    }
}

/// Keeps the cheaper of two equal states; the earlier one where the cost is equal.
fn keep(states: &mut Vec<State>, state: State) {
    let same = |other: &&mut State| {
        other.branch == state.branch && (0..2).all(|k| (other.rotary[k] - state.rotary[k]).abs() < 1e-6)
    };
    match states.iter_mut().find(same) {
        Some(other) if state.cost < other.cost => *other = state,
        Some(_) => {}
        None => states.push(state),
    }
}

fn closer(nearest: &mut Option<Excess>, excess: Excess) {
    if nearest.is_none_or(|other| excess.by < other.by) {
        *nearest = Some(excess);
    }
}
