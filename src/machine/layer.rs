//! The states that a leg of a path can be in, and what leads to them. Uses nothing beyond the machine.

use super::legs::{Arrival, Clock, Leg, legs};
use super::limits::Excess;
use super::model::{RotaryMotion, Travel};
use super::place::CONTINUOUS;
use super::setup::{Setup, unwind};
use super::stations::Station;
use crate::motion::PassKind;
use std::f64::consts::TAU;

/// Angles that differ by less are the same, radians.
const SAME: f64 = 1e-9;
/// Whole turns that are tried for an axis with room for many, where nothing says which are near.
const MOST_TURNS: usize = 5;
/// Nearness to a limit that starts to cost, radians.
const MARGIN: f64 = 0.1;
/// Cost of nearness to a limit, seconds a leg at the limit.
const MARGIN_COST: f64 = 1e-2;
/// Largest turn of the free axis on the way out of a pole that needs no turn in place, radians.
pub(super) const CARRIED: f64 = 0.05;
/// Cost of turning the free axis in place while the tool touches the part, seconds a turn and times its travel.
const DWELL: (f64, f64) = (1.0, 3.0);
/// Share of the travel from zero that the first position costs.
const START_SHARE: f64 = 0.1;
/// Cost of leaving the part to turn, more than any travel, in lead-ins and -outs and in cuts, seconds.
const REWIND: (f64, f64) = (1e6, 1.5e6);

/// What all legs have in common.
pub(super) struct Scene<'a> {
    pub(super) setup: &'a Setup,
    pub(super) stations: &'a [Station],
    pub(super) clock: Clock,
    /// Index of the rotary axis that is free at a pole.
    pub(super) free_axis: usize,
    /// By how much an axis that must stand still may miss what a direction asks of it, radians.
    pub(super) slack: f64,
}

impl Scene<'_> {
    /// Whether an axis must stand still along a leg.
    pub(super) fn stands(&self, leg: &Leg, axis: usize) -> bool {
        match self.setup.machine().rotary[axis].motion {
            RotaryMotion::Continuous => false,
            RotaryMotion::Indexed { .. } => leg.last > leg.first || !self.stations[leg.first].kind.is_rapid(),
            RotaryMotion::Absent => true,
        }
    }

    /// Angles at which the axes can be clamped, for those that must be.
    pub(super) fn held(&self, rotary: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|k| match self.setup.machine().rotary[k].motion {
            RotaryMotion::Indexed { step } if step > 0.0 => (rotary[k] / step).round() * step,
            RotaryMotion::Absent => 0.0,
            RotaryMotion::Continuous | RotaryMotion::Indexed { .. } => rotary[k],
        })
    }

    pub(super) fn penalty(&self, leg: &Leg) -> f64 {
        if self.stations[leg.first].kind == PassKind::Cut { REWIND.1 } else { REWIND.0 }
    }
}

/// One way for the rotary axes along a leg.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    pub(super) branch: usize,
    /// Rotary positions at the first and the last station of the leg.
    pub(super) enter: [f64; 2],
    pub(super) leave: [f64; 2],
    pub(super) cost: f64,
    /// Index of the state before, in the leg before.
    pub(super) from: usize,
    pub(super) rewound: bool,
}

/// A leg within the limits: rotary positions at its first and its last station, and what it costs itself.
struct Fit {
    enter: [f64; 2],
    leave: [f64; 2],
    cost: f64,
}

/// The states of one leg while they are found.
pub(super) struct Layer<'a> {
    pub(super) scene: &'a Scene<'a>,
    pub(super) legs: &'a [Leg],
    pub(super) index: usize,
    pub(super) states: Vec<State>,
    /// The excess that is least among those that came farthest.
    pub(super) nearest: Option<(usize, Excess)>,
}

impl Layer<'_> {
    fn leg(&self) -> &Leg {
        &self.legs[self.index]
    }

    /// Every state of the first leg.
    pub(super) fn begin(&mut self) {
        for (branch, enter) in self.fresh() {
            let cost = START_SHARE * self.scene.clock.turn(&[0.0; 2], &enter);
            self.admit(branch, enter, cost, 0, false);
        }
    }

    /// The states that can follow those of the leg before.
    pub(super) fn follow(&mut self, before: &[State]) {
        let arrival = self.leg().arrival;
        for (from, state) in before.iter().enumerate() {
            match arrival {
                Arrival::Start => {}
                Arrival::Rapid => self.fly(from, state),
                Arrival::Continuous | Arrival::Meeting | Arrival::Rewind => self.go_on(from, state),
            }
        }
        let cheapest = before.iter().enumerate().min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
        let Some((from, state)) = cheapest else { return };
        match arrival {
            Arrival::Rapid => {
                for (branch, enter) in self.fresh() {
                    let cost = state.cost + self.flight(state, branch, &enter);
                    self.admit(branch, enter, cost, from, false);
                }
            }
            Arrival::Rewind => {
                let penalty = state.cost + self.scene.penalty(self.leg());
                for (branch, enter) in self.fresh().into_iter().chain(self.around(&state.leave)) {
                    let cost = penalty + self.scene.clock.turn(&state.leave, &enter);
                    self.admit(branch, enter, cost, from, true);
                }
            }
            Arrival::Start | Arrival::Continuous | Arrival::Meeting => {}
        }
    }

    /// What follows a state while the tool stays where it is.
    fn go_on(&mut self, from: usize, state: &State) {
        let scene = self.scene;
        let leg = *self.leg();
        let left_pole = self.legs[self.index - 1].branches.is_none();
        for branch in 0..2 {
            if branch != state.branch && !left_pole && leg.arrival != Arrival::Meeting {
                continue;
            }
            let near = self.near(branch, &state.leave);
            let turning = |k: usize| (near[k] - state.leave[k]).abs();
            let steady = |k: usize| turning(k) <= CONTINUOUS;
            if !left_pole {
                if steady(0) && steady(1) {
                    self.admit(branch, near, state.cost + scene.clock.turn(&state.leave, &near), from, false);
                }
                continue;
            }
            // The free axis turns in place at the pole.
            let free = scene.free_axis & 1;
            if !steady(1 - free) {
                continue;
            }
            let turns = scene.setup.machine().rotary[free].is_continuous();
            for whole in [-TAU, 0.0, TAU] {
                let mut enter = near;
                enter[free] += whole;
                let held = (enter[free] - state.leave[free]).abs() < CARRIED;
                let (dwell, factor) = if held { (0.0, 1.0) } else { DWELL };
                if held || turns {
                    let cost = state.cost + dwell + factor * scene.clock.turn(&state.leave, &enter);
                    self.admit(branch, enter, cost, from, false);
                }
            }
        }
    }

    /// What follows a state over a rapid.
    fn fly(&mut self, from: usize, state: &State) {
        for (branch, enter) in self.around(&state.leave) {
            let cost = state.cost + self.flight(state, branch, &enter);
            self.admit(branch, enter, cost, from, false);
        }
    }

    /// Cost of a rapid, which turns while it travels: what the turn takes longer counts, and a little of it always.
    fn flight(&self, state: &State, branch: usize, enter: &[f64; 2]) -> f64 {
        let (scene, leg) = (self.scene, self.leg());
        let linear = |index: usize, branch: usize| scene.stations[index].solutions.branches[branch & 1].linear;
        let turning = scene.clock.turn(&state.leave, enter);
        let from = linear(self.legs[self.index - 1].last, state.branch);
        turning.max(scene.clock.way(&from, &linear(leg.first, branch))) + 1e-2 * turning
    }

    /// Rotary positions of a branch at the first station, turned to be nearest to `rotary`; a free axis stays.
    fn near(&self, branch: usize, rotary: &[f64; 2]) -> [f64; 2] {
        let leg = self.leg();
        let free = leg.branches.is_none();
        let target = self.scene.stations[leg.first].solutions.branches[branch & 1].rotary;
        std::array::from_fn(
            |k| {
                if free && k == self.scene.free_axis { rotary[k] } else { unwind(target[k], rotary[k]) }
            },
        )
    }

    /// Both branches, each axis at the turn nearest to `rotary` and at the ones beside it.
    fn around(&self, rotary: &[f64; 2]) -> Vec<(usize, [f64; 2])> {
        let mut all = Vec::with_capacity(18);
        for branch in 0..2 {
            let near = self.near(branch, rotary);
            for first in [-TAU, 0.0, TAU] {
                all.extend([-TAU, 0.0, TAU].map(|second| (branch, [near[0] + first, near[1] + second])));
            }
        }
        all
    }

    /// Both branches with every number of whole turns worth trying, whatever came before.
    fn fresh(&self) -> Vec<(usize, [f64; 2])> {
        let (scene, leg) = (self.scene, self.leg());
        let mut all = Vec::new();
        for branch in 0..2 {
            let angles: [Vec<f64>; 2] = std::array::from_fn(|k| {
                let travel = scene.setup.machine().rotary[k].travel;
                match &leg.branches {
                    Some(followed) => {
                        let followed = &followed[branch & 1];
                        turns(travel, followed.start[k], followed.low[k], followed.high[k])
                    }
                    None if k == scene.free_axis => self.wanted(k, travel),
                    None => {
                        let angle = scene.stations[leg.first].solutions.branches[branch & 1].rotary[k];
                        turns(travel, angle, angle, angle)
                    }
                }
            });
            for first in &angles[0] {
                all.extend(angles[1].iter().map(|second| (branch, [*first, *second])));
            }
        }
        all
    }

    /// Angles of the free axis that the next leg starts with; zero where there is none.
    fn wanted(&self, axis: usize, travel: Travel) -> Vec<f64> {
        let next = self.legs.get(self.index + 1).map(|leg| leg.branches);
        match next {
            Some(Some(followed)) => followed
                .iter()
                .flat_map(|f| turns(travel, f.start[axis & 1], f.low[axis & 1], f.high[axis & 1]))
                .collect(),
            _ => turns(travel, 0.0, 0.0, 0.0),
        }
    }

    /// Keeps a state if its leg fits the limits, and if none like it is cheaper.
    fn admit(&mut self, branch: usize, enter: [f64; 2], cost: f64, from: usize, rewound: bool) {
        match self.fit(branch, enter) {
            Ok(Fit { enter, leave, cost: own }) => {
                let cost = cost + own;
                keep(&mut self.states, State { branch, enter, leave, cost, from, rewound });
            }
            Err(found) => {
                let nearer = |(station, excess): &(usize, Excess)| {
                    found.0 > *station || (found.0 == *station && found.1.by < excess.by)
                };
                if self.nearest.as_ref().is_none_or(nearer) {
                    self.nearest = Some(found);
                }
            }
        }
    }

    /// Where the leg leads from rotary positions at its first station, and what it costs itself; or the station and axis
    /// that are in the way.
    fn fit(&self, branch: usize, enter: [f64; 2]) -> Result<Fit, (usize, Excess)> {
        let (scene, leg) = (self.scene, self.leg());
        let machine = scene.setup.machine();
        let followed = match &leg.branches {
            None => return self.fit_free(enter),
            Some(followed) => &followed[branch & 1],
        };
        let mut enter = enter;
        let mut leave = enter;
        let mut margin = 0.0;
        for k in 0..2 {
            let axis = &machine.rotary[k];
            let shift = enter[k] - followed.start[k];
            let (low, high) = (followed.low[k] + shift, followed.high[k] + shift);
            if scene.stands(leg, k) {
                let held = scene.held(enter)[k];
                let moves = (high - held).max(held - low);
                if moves > scene.slack {
                    return Err((
                        self.first_beyond(branch, k, enter[k], |angle| (angle - held).abs() <= scene.slack),
                        Excess::of_standing(axis, held, moves),
                    ));
                }
                if let Some(excess) = Excess::of_rotary(axis, held, 0.0) {
                    return Err((leg.first, excess));
                }
                (enter[k], leave[k]) = (held, held);
                continue;
            }
            let excess = [low, high].into_iter().filter_map(|angle| Excess::of_rotary(axis, angle, 0.0));
            if let Some(excess) = excess.max_by(|a, b| a.by.total_cmp(&b.by)) {
                let within = |angle: f64| Excess::of_rotary(axis, angle, 0.0).is_none();
                return Err((self.first_beyond(branch, k, enter[k], within), excess));
            }
            leave[k] = followed.end[k] + shift;
            if let Travel::Limited { min, max } = axis.travel {
                margin += MARGIN_COST * (1.0 - (low - min).min(max - high) / MARGIN).clamp(0.0, 1.0);
            }
        }
        match followed.outside {
            Some(found) => Err(found),
            None => Ok(Fit { enter, leave, cost: margin + followed.seconds }),
        }
    }

    /// The same where the tool axis stays in the pole.
    fn fit_free(&self, enter: [f64; 2]) -> Result<Fit, (usize, Excess)> {
        let (scene, leg) = (self.scene, self.leg());
        let enter = scene.held(enter);
        for index in [leg.first, leg.last] {
            let axes = scene.setup.with_rotary(&scene.stations[index].pose.tip, enter);
            if let Some(excess) = Excess::of(scene.setup.machine(), &axes) {
                return Err((index, excess));
            }
        }
        Ok(Fit { enter, leave: enter, cost: 0.0 })
    }

    /// The first station of the leg at which an axis leaves what is allowed.
    fn first_beyond(&self, branch: usize, axis: usize, enter: f64, allowed: impl Fn(f64) -> bool) -> usize {
        let leg = self.leg();
        let mut angle = enter;
        let beyond = |index: &usize| {
            angle = unwind(self.scene.stations[*index].solutions.branches[branch & 1].rotary[axis & 1], angle);
            !allowed(angle)
        };
        (leg.first..=leg.last).find(beyond).unwrap_or(leg.first)
    }

    /// Whether no state at all fits at some station of the leg, from wherever it might be reached.
    pub(super) fn alone(&self) -> bool {
        let (scene, leg) = (self.scene, *self.leg());
        if leg.branches.is_none() {
            return false;
        }
        (leg.first..=leg.last).any(|index| {
            let one = legs(&scene.stations[index..=index], scene.setup, None);
            let station = &scene.stations[index..=index];
            let alone = Scene { stations: station, clock: Clock::new(scene.setup.machine()), ..*scene };
            let layer = Layer { scene: &alone, legs: &one, index: 0, states: Vec::new(), nearest: None };
            layer.fresh().iter().all(|(branch, enter)| layer.fit(*branch, *enter).is_err())
        })
    }
}

/// An angle with whole turns added so that what lies between `low` and `high` fits: all that do, or some about the middle
/// of a long travel; at least the nearest to the middle, which may not fit.
fn turns(travel: Travel, angle: f64, low: f64, high: f64) -> Vec<f64> {
    let Travel::Limited { min, max } = travel else { return vec![unwind(angle, 0.0)] };
    let middle = (((min + max) - (low + high)) / 2.0 / TAU).round();
    let (least, most) = (((min - low) / TAU - SAME).ceil(), ((max - high) / TAU + SAME).floor());
    if least > most {
        return vec![angle + middle * TAU];
    }
    let beside = (MOST_TURNS / 2) as f64;
    let (from, to) = (least.max(middle - beside), most.min(middle + beside));
    (0..MOST_TURNS).map(|k| from + k as f64).take_while(|k| *k <= to).map(|k| angle + k * TAU).collect()
}

/// Keeps the cheaper of two equal states; the earlier one where the cost is equal.
fn keep(states: &mut Vec<State>, state: State) {
    let same = |other: &&mut State| {
        other.branch == state.branch && (0..2).all(|k| (other.enter[k] - state.enter[k]).abs() < 1e-6)
    };
    match states.iter_mut().find(same) {
        Some(other) if state.cost < other.cost => *other = state,
        Some(_) => {}
        None => states.push(state),
    }
}
