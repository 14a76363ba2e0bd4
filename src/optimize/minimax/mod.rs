//! The least largest error: sequential linearized minimax, knowing nothing of tools. Uses nothing of the crate.
//!
//! A problem gives rows: values with their gradients, each held between multiples of a common factor tau or between
//! hard figures ([`Sides`]), and squares to be kept small beside ([`Rows::square`]). Each round linearizes the rows,
//! minimizes tau over them within a trust region by an interior-point method (its own where the rows are banded, Clarabel
//! otherwise) and judges the step by the true rows. Only rows that may come to their limits take part, more are added where
//! a solution trespasses: their number is what costs.
//!
//! Near its end the method converges like Newton's when as many rows as there are unknowns hold the solution (Madsen,
//! An algorithm for minimax solution of overdetermined systems of non-linear equations, 1975). Everything runs in one
//! thread in one order, so results do not depend on the number of threads.

mod interior;
mod rows;
mod subproblem;
#[cfg(test)]
mod tests;

pub use rows::{Rows, Sides};

use rows::SIDES;
use subproblem::{ActiveSet, Scales, Step, solve};

/// A problem of least largest error.
pub trait Minimax {
    /// Number of unknowns. Number those that meet in one row next to each other where possible: it keeps the equations
    /// banded.
    fn unknowns(&self) -> usize;
    /// Adds every row at `x`, in an order that does not depend on `x`. `None` where the problem is not defined at `x`;
    /// the step is then shortened.
    fn linearize(&mut self, x: &[f64], rows: &mut Rows) -> Option<()>;
}

/// When to stop, and how far to go at once.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most rounds, each with one linearization.
    pub max_rounds: usize,
    /// Stop when a round promises to lower the objective by less than this share of it.
    pub gain_share: f64,
    /// Stop once tau is below this and no hard side is trespassed.
    pub enough: f64,
    /// Largest change of one unknown in the first round, in the unknowns' unit.
    pub radius: f64,
    /// Stop when the trust region has shrunk below this.
    pub least_radius: f64,
    /// Price of a trespass of a hard side, in tau, per unit of tau of trespass. Hard sides hold where it is above the
    /// sum of their multipliers.
    pub penalty: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { max_rounds: 20, gain_share: 1e-3, enough: 0.0, radius: 0.01, least_radius: 1e-12, penalty: 100.0 }
    }
}

/// Why a minimization ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// No step promises to gain enough.
    Converged,
    /// The largest error is as small as was asked for.
    Enough,
    /// The trust region shrank to nothing without a step that gained.
    Stalled,
    /// The round limit.
    RoundLimit,
}

/// How a minimization ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Largest error, in multiples of the rows' shares.
    pub tau: f64,
    /// Largest trespass of a hard side, in the rows' unit; 0 when all hold.
    pub trespass: f64,
    /// Linearizations.
    pub rounds: usize,
    /// Why it ended.
    pub ending: Ending,
}

/// What a place is worth.
#[derive(Clone, Copy, Debug)]
struct Worth {
    tau: f64,
    trespass: f64,
    /// Tau, trespass and squares together.
    merit: f64,
}

fn worth(rows: &Rows, step: Option<&[f64]>, penalty: f64) -> Option<Worth> {
    let (tau, trespass) = rows.largest(step)?;
    let merit = tau + penalty * trespass / rows.unit() + rows.soft(step);
    merit.is_finite().then_some(Worth { tau, trespass, merit })
}

/// Lowers the largest error from `x`, in place; what is reached is never worse than the start. `None` when the problem
/// is not defined at the start.
pub fn minimize_largest(problem: &mut impl Minimax, x: &mut Vec<f64>, settings: &Settings) -> Option<Outcome> {
    let (mut rows, mut trial) = (Rows::default(), Rows::default());
    problem.linearize(x, &mut rows)?;
    let mut here = worth(&rows, None, settings.penalty)?;
    let penalty = settings.penalty;
    let mut trust = Trust { radius: settings.radius, way: f64::INFINITY, penalty };
    let mut holding = Vec::new();
    let end = |here: &Worth, rounds, ending| Outcome { tau: here.tau, trespass: here.trespass, rounds, ending };
    for round in 1..=settings.max_rounds {
        if here.tau <= settings.enough && here.trespass <= 0.0 {
            return Some(end(&here, round, Ending::Enough));
        }
        let radius = trust.radius;
        if radius < settings.least_radius {
            return Some(end(&here, round, Ending::Stalled));
        }
        let found = best_step(&rows, problem.unknowns(), &here, &trust, &holding);
        let Some((step, promised)) = found else {
            trust.radius *= 0.25;
            continue;
        };
        let promise = here.merit - promised.merit;
        if promise <= settings.gain_share * here.merit {
            return Some(end(&here, round, Ending::Converged));
        }
        let length = step.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        let taken = take(problem, (x.as_slice(), &step.step), &here, penalty, &mut trial);
        let gain = taken.as_ref().map_or(0.0, |taken| (here.merit - taken.worth.merit) / promise);
        let share = taken.as_ref().map_or(SHARES[SHARES.len() - 1], |taken| taken.share);
        if gain < 0.25 {
            trust.radius = share.min(0.3) * length.min(radius);
        } else if gain > 0.7 && length > 0.8 * radius {
            trust.radius *= 3.0;
        }
        if let Some(taken) = taken {
            *x = taken.place;
            trust.way = trial.way_from(&rows);
            std::mem::swap(&mut rows, &mut trial);
            here = taken.worth;
            holding = step.holding;
        }
    }
    Some(end(&here, settings.max_rounds, Ending::RoundLimit))
}

/// Shares of a step that are tried: judging one costs far less than finding another.
const SHARES: [f64; 3] = [1.0, 0.4, 0.15];

/// A step, or part of it, that lowers the objective.
struct Taken {
    share: f64,
    place: Vec<f64>,
    worth: Worth,
}

/// The largest of [`SHARES`] of `step` that lowers the objective; its rows are then in `rows`.
fn take(
    problem: &mut impl Minimax,
    (x, step): (&[f64], &[f64]),
    here: &Worth,
    penalty: f64,
    rows: &mut Rows,
) -> Option<Taken> {
    SHARES.into_iter().find_map(|share| {
        let place: Vec<f64> = x.iter().zip(step).map(|(x, s)| x + share * s).collect();
        rows.clear();
        problem.linearize(&place, rows)?;
        let worth = worth(rows, None, penalty)?;
        (worth.merit < here.merit).then_some(Taken { share, place, worth })
    })
}

/// What a step may be.
#[derive(Clone, Copy, Debug)]
struct Trust {
    /// Largest change of one unknown.
    radius: f64,
    /// The way that the rows changed by in the last step, as [`Rows::way_from`] tells it; infinite before the first.
    way: f64,
    /// Price of a trespass of a hard side.
    penalty: f64,
}

/// Share of tau within which a row takes part from the start.
const BAND: f64 = 0.25;
/// Share of the solution's tau by which a side that does not take part may be trespassed.
const TRESPASS: f64 = 0.01;
/// The same where taking in more sides costs little.
const NARROW_TRESPASS: f64 = 1e-3;
/// Most solutions of one linearized problem, each with more rows.
const FILLINGS: usize = 8;
/// Most solutions of a banded one before all its rows take part.
const BANDED_FILLINGS: usize = 2;

/// The best step within the trust region, and what the linearized problem promises of it; `None` when the solver fails
/// on it.
fn best_step(
    rows: &Rows,
    unknowns: usize,
    here: &Worth,
    trust: &Trust,
    holding: &[(usize, usize)],
) -> Option<(Step, Worth)> {
    let unit = rows.unit();
    let Trust { radius, way, penalty } = *trust;
    let tau = here.tau.max(here.trespass / unit).max(f64::MIN_POSITIVE.sqrt());
    let scales = Scales { unit, tau, radius, penalty };
    let mut active = within_reach(rows, here, way);
    for filling in 0..=BANDED_FILLINGS {
        let Some(step) = interior::solve(rows, unknowns, &active, &scales) else { break };
        let promised = worth(rows, Some(&step.step), penalty)?;
        let reached = reached(rows, &active, &step.step);
        let beyond = NARROW_TRESPASS * reached.0.max(TRESPASS * tau) * unit;
        let grown = take_in(rows, &mut active, |row| rows.moved(row, &step.step), reached, beyond);
        if !grown || filling == BANDED_FILLINGS {
            return Some((step, promised));
        }
        if filling + 1 == BANDED_FILLINGS {
            active = ActiveSet::whole(rows.len());
        }
    }
    let mut active = ActiveSet::empty(rows.len());
    for (row, which) in holding.iter().filter(|(row, _)| *row < rows.len()) {
        active.insert(*row, *which);
    }
    take_in(rows, &mut active, |row| rows.value(row), (here.tau, 0.0), -BAND * tau * unit);
    let mut best: Option<(Step, Worth)> = None;
    for _ in 0..FILLINGS {
        let Some(step) = solve(rows, unknowns, &active, &scales) else { break };
        let promised = worth(rows, Some(&step.step), penalty)?;
        let reached = reached(rows, &active, &step.step);
        let beyond = TRESPASS * reached.0.max(TRESPASS * tau) * unit;
        let grown = take_in(rows, &mut active, |row| rows.moved(row, &step.step), reached, beyond);
        if best.as_ref().is_none_or(|(_, least)| promised.merit < least.merit) {
            best = Some((step, promised));
        }
        if !grown {
            break;
        }
    }
    best
}

/// Every side that may come to its limit in a step no longer than `way`, tau coming down by as much as any row can.
fn within_reach(rows: &Rows, here: &Worth, way: f64) -> ActiveSet {
    if !way.is_finite() {
        return ActiveSet::whole(rows.len());
    }
    let shares = |row: &usize| rows.sides(*row).above.is_finite() || rows.sides(*row).below.is_finite();
    let steepest = (0..rows.len()).filter(shares).map(|row| rows.steepness(row)).fold(0.0, f64::max);
    let unit = rows.unit();
    let mut active = ActiveSet::empty(rows.len());
    for row in 0..rows.len() {
        let (value, steepness) = (rows.value(row), rows.steepness(row));
        for which in 0..SIDES {
            let Some(side) = rows.sides(row).side(which) else { continue };
            let margin = way * (steepness + steepest * side.share / unit);
            if side.sign * value + margin >= side.constant + side.share * here.tau {
                active.insert(row, which);
            }
        }
    }
    active
}

/// The least tau, and the largest trespass of a hard side, that the active sides allow after `step`.
fn reached(rows: &Rows, active: &ActiveSet, step: &[f64]) -> (f64, f64) {
    let (mut tau, mut trespass) = (0.0_f64, 0.0_f64);
    for row in 0..active.rows() {
        for which in (0..SIDES).filter(|which| active.has(row, *which)) {
            let Some(side) = rows.sides(row).side(which) else { continue };
            let past = side.sign * rows.moved(row, step) - side.constant;
            if side.share > 0.0 {
                tau = tau.max(past / side.share);
            } else {
                trespass = trespass.max(past);
            }
        }
    }
    (tau, trespass)
}

/// Takes in every side whose value, at a tau and a trespass of hard sides, lies more than `beyond` past its limit. True
/// when one was new.
fn take_in(
    rows: &Rows,
    active: &mut ActiveSet,
    value: impl Fn(usize) -> f64,
    (tau, trespass): (f64, f64),
    beyond: f64,
) -> bool {
    let unit = rows.unit();
    let mut grown = false;
    for row in 0..active.rows() {
        let value = value(row);
        for which in 0..SIDES {
            let Some(side) = rows.sides(row).side(which) else { continue };
            let (size, slack) = if side.share > 0.0 { (side.share / unit, side.share * tau) } else { (1.0, trespass) };
            if side.sign * value > side.constant + slack + beyond * size {
                grown |= active.insert(row, which);
            }
        }
    }
    grown
}
