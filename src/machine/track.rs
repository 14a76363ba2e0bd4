//! Branch and turns of the rotary axes over a whole tool path, by dynamic programming over its legs. Uses `diagnostic`
//! and `motion`.
//!
//! Each leg of the path has a few states: branch of the inverse kinematics and whole turns of either axis, within the
//! limits. While the tool cuts, a state goes on only to what follows it continuously: same branch, nearest turn; the
//! branch may change only where both meet (pole, fold), and the free axis may turn in place at a pole. On rapids any
//! state may follow any other. Where no sequence of states reaches the end, the tool may leave the part, turn and come
//! back at the same place, as few times as possible. The cost is time: the slowest axis' travel over its top speed, plus
//! a little for nearness of limits; the cheapest sequence over the whole path wins. Source: Bellman's principle.

use super::course::Courses;
use super::layer::{CARRIED, Layer, Scene, State};
use super::legs::{Arrival, Clock, Leg, legs};
use super::limits::Excess;
use super::model::RotaryMotion;
use super::place::{Stop, whereabouts};
use super::rewind::{Rewinder, Room};
use super::setup::{Setup, unwind};
use super::stations::{Station, Surveyor};
use crate::diagnostic::{Diagnostic, Result};
use crate::motion::ToolPath;

/// Angles that differ by less are the same, radians.
const SAME: f64 = 1e-9;
/// Places for leaving the part that are tried before giving up.
const MOST_PLACES: usize = 24;

/// The chosen rotary positions along a path.
#[derive(Clone, Debug)]
pub(super) struct Track {
    /// In order; where an axis turns in place, two follow each other at one parameter.
    pub(super) stops: Vec<Stop>,
    /// What the choice costs, and what no choice can be below.
    pub(super) choice: Choice,
}

/// What the choice of branches and turns costs. No sequence of branches and turns that keeps the limits costs less than
/// the one chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choice {
    /// Seconds that the slowest axes need for their ways at top speed, with what turns in place and nearness to limits
    /// count; without the fixed cost of rewinds.
    pub seconds: f64,
    /// What remains if limits are left out and the branch may change anywhere for nothing: a bound for every choice.
    pub least: f64,
    /// How often the tool leaves the part to turn back; fewer are not possible with the places tried.
    pub rewinds: usize,
}

/// Why a leg has no state.
struct DeadEnd {
    leg: usize,
    /// What came nearest, and at which station.
    nearest: Option<(usize, Excess)>,
    /// The leg cannot be followed at all, from wherever.
    alone: bool,
}

/// Chooses branch and turns for the whole path. `slack`, radians: nearer to a pole the free axis may stand anywhere, and
/// by so much an axis that must stand still may miss what a direction asks of it. Ways out of the part stay clear of what
/// stands in the room.
pub(super) fn track(path: &ToolPath, courses: &Courses<'_>, room: Room<'_>, slack: f64) -> Result<Track> {
    let setup = room.setup;
    let stations = Surveyor { path, courses, setup, pole_radius: slack }.survey()?;
    let chooser = Chooser::new(path, setup, &stations, slack);
    match chooser.choose(None) {
        Ok(track) => Ok(track),
        Err(stuck) if stuck.alone => Err(chooser.impossible(&stuck, &legs(&stations, setup, None))),
        Err(stuck) => chooser.choose_with_rewinds(courses, room, &stuck),
    }
}

struct Chooser<'a> {
    path: &'a ToolPath,
    scene: Scene<'a>,
}

impl<'a> Chooser<'a> {
    fn new(path: &'a ToolPath, setup: &'a Setup, stations: &'a [Station], slack: f64) -> Self {
        let machine = setup.machine();
        let scene = Scene { setup, stations, clock: Clock::new(machine), free_axis: machine.chain[0], slack };
        Self { path, scene }
    }

    /// The cheapest sequence of states; with `rewinds`, the tool may leave the part at the stations where that says so.
    fn choose(&self, rewinds: Option<&[bool]>) -> Result<Track, DeadEnd> {
        let legs = legs(self.scene.stations, self.scene.setup, rewinds);
        let mut layers: Vec<Vec<State>> = Vec::with_capacity(legs.len());
        for index in 0..legs.len() {
            let mut layer = Layer { scene: &self.scene, legs: &legs, index, states: Vec::new(), nearest: None };
            match layers.last() {
                None => layer.begin(),
                Some(before) => layer.follow(before),
            }
            if layer.states.is_empty() {
                let alone = layer.alone();
                return Err(DeadEnd { leg: index, nearest: layer.nearest, alone });
            }
            layers.push(layer.states);
        }
        Ok(self.cheapest(&legs, &layers))
    }

    /// Walks back from the cheapest end, then forward along its stations.
    fn cheapest(&self, legs: &[Leg], layers: &[Vec<State>]) -> Track {
        let end = layers.last().map(Vec::as_slice).unwrap_or_default();
        let mut at = (0..end.len()).fold(0, |best, i| if end[i].cost < end[best].cost { i } else { best });
        let mut chosen: Vec<State> = Vec::with_capacity(layers.len());
        for layer in layers.iter().rev() {
            let Some(state) = layer.get(at) else { continue };
            chosen.push(*state);
            at = state.from;
        }
        chosen.reverse();
        let mut stops: Vec<Stop> = Vec::with_capacity(self.scene.stations.len());
        for (index, (leg, state)) in legs.iter().zip(&chosen).enumerate() {
            let next =
                chosen.get(index + 1).filter(|_| legs.get(index + 1).is_some_and(|n| n.arrival != Arrival::Rapid));
            self.walk(leg, state, next, &mut stops);
        }
        let same = |a: &Stop, b: &Stop| (0..2).all(|k| (a.rotary[k] - b.rotary[k]).abs() < SAME);
        stops.dedup_by(|b, a| a.pass == b.pass && a.t == b.t && same(a, b));
        let cheaper = |leg: &Leg| leg.branches.map_or(0.0, |[a, b]| a.seconds.min(b.seconds));
        let rewound = chosen.iter().zip(legs).filter(|(state, _)| state.rewound);
        let paid: f64 = rewound.clone().map(|(_, leg)| self.scene.penalty(leg)).sum();
        let seconds = chosen.last().map_or(0.0, |state| state.cost) - paid;
        let choice = Choice { seconds, least: legs.iter().map(cheaper).sum(), rewinds: rewound.count() };
        Track { stops, choice }
    }

    /// Appends the stops of a leg. Where the tool leaves a pole, the free axis turns in place where it is nearest to it.
    fn walk(&self, leg: &Leg, state: &State, next: Option<&State>, stops: &mut Vec<Stop>) {
        // `solved` is where the linear axes stand if the rotary ones stand as the branch has them.
        let mut stop = |index: usize, rotary: [f64; 2], solved: Option<[f64; 3]>, rewound: bool| {
            let station = &self.scene.stations[index];
            let linear = solved.unwrap_or_else(|| self.scene.setup.with_rotary(&station.pose.tip, rotary).linear);
            stops.push(Stop { pass: station.pass, t: station.t, rotary, linear, rewound });
        };
        let mut rotary = state.enter;
        if leg.branches.is_none() {
            let distance = |index: &usize| self.scene.setup.pole_distance(&self.scene.stations[*index].pose.axis);
            let nearest =
                (leg.first..=leg.last).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(leg.first);
            for index in leg.first..=leg.last {
                let wanted = self.scene.stations[index].solutions.branches[state.branch & 1].rotary;
                rotary = std::array::from_fn(|k| {
                    if k == self.scene.free_axis { rotary[k] } else { unwind(wanted[k], rotary[k]) }
                });
                stop(index, self.scene.held(rotary), None, false);
                let turned = next.filter(|_| index == nearest).map(|next| next.enter[self.scene.free_axis]);
                if let Some(angle) = turned.filter(|angle| (angle - rotary[self.scene.free_axis]).abs() >= CARRIED) {
                    rotary[self.scene.free_axis] = angle;
                    stop(index, self.scene.held(rotary), None, false);
                }
            }
            return;
        }
        let stands = [0, 1].map(|k| self.scene.stands(leg, k));
        for index in leg.first..=leg.last {
            let wanted = &self.scene.stations[index].solutions.branches[state.branch & 1];
            rotary = std::array::from_fn(|k| unwind(wanted.rotary[k], rotary[k]));
            let held = std::array::from_fn(|k| if stands[k] { state.enter[k] } else { rotary[k] });
            let solved = (stands == [false; 2]).then_some(wanted.linear);
            stop(index, held, solved, state.rewound && index == leg.first);
        }
    }

    /// The best sequence with as few departures from the part as possible, each with room.
    fn choose_with_rewinds(&self, courses: &Courses<'_>, room: Room<'_>, stuck: &DeadEnd) -> Result<Track> {
        let refused = || self.impossible(stuck, &legs(self.scene.stations, self.scene.setup, None));
        let continuous = self.scene.setup.machine().rotary.iter().all(|axis| axis.motion != RotaryMotion::Absent);
        let rewinder = Rewinder::new(self.path, courses, room).filter(|_| continuous).ok_or_else(refused)?;
        let mut allowed: Vec<bool> = self.scene.stations.iter().map(|s| !s.kind.is_rapid() && !s.free).collect();
        // Neighbours of a place without room are not tried again.
        let neighbours = self.scene.stations.len() / 100;
        let mut no_room = None;
        for _ in 0..MOST_PLACES {
            let Ok(track) = self.choose(Some(&allowed)) else { break };
            let mut failed = Vec::new();
            for pair in track.stops.windows(2).filter(|pair| pair[1].rewound) {
                if let Err(error) = rewinder.maneuver(&pair[0], &pair[1]) {
                    failed.push((pair[1].pass, pair[1].t));
                    no_room.get_or_insert(error);
                }
            }
            if failed.is_empty() {
                return Ok(track);
            }
            for (pass, t) in failed {
                let place = self.scene.stations.iter().position(|s| s.pass == pass && s.t == t).unwrap_or(0);
                let around = place.saturating_sub(neighbours)..(place + neighbours + 1).min(allowed.len());
                allowed[around].fill(false);
            }
        }
        Err(no_room.unwrap_or_else(refused))
    }

    fn impossible(&self, stuck: &DeadEnd, legs: &[Leg]) -> Box<Diagnostic> {
        let leg = &legs[stuck.leg];
        let station = stuck.nearest.map_or(leg.first, |(station, _)| station);
        let station = &self.scene.stations[station];
        let place = whereabouts(self.path, station.pass, &station.pose);
        let Some((_, needs)) = stuck.nearest else {
            return Diagnostic::error(format!("{place}: no continuous motion of the rotary axes leads here")).help(
                "the tool axis passes too near to the pole to be followed; tilt the part a little on the table, or \
                 choose another machine",
            );
        };
        if stuck.alone {
            return Diagnostic::error(format!("{place} is out of reach: {needs}")).help(needs.remedy());
        }
        Diagnostic::error(format!("{place} cannot be reached without leaving the part: {needs}")).help(
            "split the pass where the axis can be turned back, mount the part turned, or choose a machine with more travel",
        )
    }
}
