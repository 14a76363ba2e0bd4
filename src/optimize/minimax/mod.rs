//! The least largest error: sequential linearized minimax, knowing nothing of tools. Uses nothing of the crate.
//!
//! A problem gives rows: values with their gradients, each held between multiples of a common factor tau or between
//! hard figures ([`Sides`]), and squares to be kept small beside ([`Rows::square`]). Each round linearizes the rows,
//! minimizes tau over them within a trust region by an interior-point method (Clarabel) and judges the step by the true
//! rows. Only rows near their limits take part, more are added where a solution trespasses: their number is what costs.
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
    let mut radius = settings.radius;
    let mut holding = Vec::new();
    let end = |here: &Worth, rounds, ending| Outcome { tau: here.tau, trespass: here.trespass, rounds, ending };
    for round in 1..=settings.max_rounds {
        if here.tau <= settings.enough && here.trespass <= 0.0 {
            return Some(end(&here, round, Ending::Enough));
        }
        if radius < settings.least_radius {
            return Some(end(&here, round, Ending::Stalled));
        }
        let found = best_step(&rows, problem.unknowns(), &here, radius, settings.penalty, &holding);
        let Some((step, promised)) = found else {
            radius *= 0.25;
            continue;
        };
        let promise = here.merit - promised.merit;
        if promise <= settings.gain_share * here.merit {
            return Some(end(&here, round, Ending::Converged));
        }
        let length = step.step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
        let taken = take(problem, (x.as_slice(), &step.step), &here, settings.penalty, &mut trial);
        let gain = taken.as_ref().map_or(0.0, |taken| (here.merit - taken.worth.merit) / promise);
        let share = taken.as_ref().map_or(SHARES[SHARES.len() - 1], |taken| taken.share);
        if gain < 0.25 {
            radius = share.min(0.3) * length.min(radius);
        } else if gain > 0.7 && length > 0.8 * radius {
            radius *= 3.0;
        }
        if let Some(taken) = taken {
            *x = taken.place;
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

/// Share of tau within which a row takes part from the start.
const BAND: f64 = 0.25;
/// Share of the solution's tau by which a side that does not take part may be trespassed.
const TRESPASS: f64 = 0.01;
/// Most solutions of one linearized problem, each with more rows.
const FILLINGS: usize = 8;

/// The best step within the trust region, and what the linearized problem promises of it; `None` when the solver fails
/// on it.
fn best_step(
    rows: &Rows,
    unknowns: usize,
    here: &Worth,
    radius: f64,
    penalty: f64,
    holding: &[(usize, usize)],
) -> Option<(Step, Worth)> {
    let unit = rows.unit();
    let tau = here.tau.max(here.trespass / unit).max(f64::MIN_POSITIVE.sqrt());
    let scales = Scales { unit, tau, radius, penalty };
    if let Some(step) = interior::solve(rows, unknowns, &scales) {
        let promised = worth(rows, Some(&step.step), penalty)?;
        return Some((step, promised));
    }
    let mut active = ActiveSet::empty(rows.len());
    for (row, which) in holding.iter().filter(|(row, _)| *row < rows.len()) {
        active.insert(*row, *which);
    }
    take_in(rows, &mut active, |row| rows.value(row), here.tau, -BAND * tau * unit);
    let mut best: Option<(Step, Worth)> = None;
    for _ in 0..FILLINGS {
        let Some(step) = solve(rows, unknowns, &active, &scales) else { break };
        let promised = worth(rows, Some(&step.step), penalty)?;
        let reached = reached_tau(rows, &active, &step.step);
        let beyond = TRESPASS * reached.max(TRESPASS * tau) * unit;
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

/// The least tau that the active sides allow after `step`.
fn reached_tau(rows: &Rows, active: &ActiveSet, step: &[f64]) -> f64 {
    let mut tau = 0.0_f64;
    for row in 0..active.rows() {
        for which in (0..SIDES).filter(|which| active.has(row, *which)) {
            if let Some(side) = rows.sides(row).side(which).filter(|side| side.share > 0.0) {
                tau = tau.max((side.sign * rows.moved(row, step) - side.constant) / side.share);
            }
        }
    }
    tau
}

/// Takes in every side whose value, at `tau`, lies more than `beyond` past its limit. True when one was new.
fn take_in(rows: &Rows, active: &mut ActiveSet, value: impl Fn(usize) -> f64, tau: f64, beyond: f64) -> bool {
    let unit = rows.unit();
    let mut grown = false;
    for row in 0..active.rows() {
        let value = value(row);
        for which in 0..SIDES {
            let Some(side) = rows.sides(row).side(which) else { continue };
            let size = if side.share > 0.0 { side.share / unit } else { 1.0 };
            if side.sign * value > side.constant + side.share * tau + beyond * size {
                grown |= active.insert(row, which);
            }
        }
    }
    grown
}
