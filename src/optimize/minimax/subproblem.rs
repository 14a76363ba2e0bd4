//! One linearized minimax problem, solved by Clarabel's interior-point method over the rows that matter.
//!
//! Unknowns are the step, tau and the largest trespass sigma of the hard sides, each in its own scale:
//! minimize `tau + penalty * sigma + soft(step)` with every active side `sign * (value + gradient . step) <= constant +
//! share * tau` (hard ones `+ sigma`), `|step_i| <= radius`, `tau >= 0`, `sigma >= 0`. Since sigma is free the problem
//! always has a solution; with a penalty above the sum of the multipliers sigma is 0 wherever it can be.

use super::rows::{Rows, SIDES};
use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};

/// Which sides of which rows take part: one bit a side.
#[derive(Clone, Debug, Default)]
pub(super) struct ActiveSet {
    bits: Vec<u8>,
}

impl ActiveSet {
    /// The set of no side of `rows` rows.
    pub(super) fn empty(rows: usize) -> Self {
        Self { bits: vec![0; rows] }
    }

    /// The set of all sides of `rows` rows.
    pub(super) fn whole(rows: usize) -> Self {
        Self { bits: vec![u8::MAX; rows] }
    }

    /// Number of rows it is made for.
    pub(super) fn rows(&self) -> usize {
        self.bits.len()
    }

    /// True when the side takes part.
    pub(super) fn has(&self, row: usize, which: usize) -> bool {
        self.bits[row] & (1 << which) != 0
    }

    /// Takes the side in; false when it already was.
    pub(super) fn insert(&mut self, row: usize, which: usize) -> bool {
        let new = !self.has(row, which);
        self.bits[row] |= 1 << which;
        new
    }
}

/// Sizes of one linearized problem.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scales {
    /// What one unit of tau is in the rows' unit.
    pub(super) unit: f64,
    /// A tau about as large as the solution's.
    pub(super) tau: f64,
    /// Largest change of one unknown.
    pub(super) radius: f64,
    /// Price of a trespass of one unit of tau.
    pub(super) penalty: f64,
}

/// A solution of the linearized problem, as far as the solver came.
#[derive(Clone, Debug)]
pub(super) struct Step {
    /// Change of the unknowns.
    pub(super) step: Vec<f64>,
    /// Sides that hold the solution back, by their multipliers.
    pub(super) holding: Vec<(usize, usize)>,
}

/// Solves over the sides in `active`; `None` when the solver came to nothing usable.
pub(super) fn solve(rows: &Rows, unknowns: usize, active: &ActiveSet, scales: &Scales) -> Option<Step> {
    let (tau_at, sigma_at) = (unknowns, unknowns + 1);
    // One unit of the scaled step changes a row with a unit gradient by as much as one unit of the scaled tau.
    let length = scales.unit * scales.tau;
    let (mut table, mut listed) = (Table::default(), Vec::new());
    for row in 0..rows.len() {
        for which in (0..SIDES).filter(|which| active.has(row, *which)) {
            let Some(side) = rows.sides(row).side(which) else { continue };
            let size = if side.share > 0.0 { side.share * scales.tau } else { length };
            let factor = side.sign * length / size;
            let slack = if side.share > 0.0 { tau_at } else { sigma_at };
            let gradient = rows.gradient(row).iter().map(|(i, g)| (*i, factor * g));
            table.push(gradient.chain([(slack, -1.0)]), (side.constant - side.sign * rows.value(row)) / size);
            listed.push((row, which));
        }
    }
    let reach = scales.radius / length;
    for i in 0..unknowns {
        table.push([(i, 1.0)], reach);
        table.push([(i, -1.0)], reach);
    }
    table.push([(tau_at, -1.0)], 0.0);
    table.push([(sigma_at, -1.0)], 0.0);
    let (quadratic, mut linear) = soft_terms(rows, unknowns, length * length / scales.tau, length / scales.tau);
    linear.extend([1.0, scales.penalty]);
    let cones = [NonnegativeConeT(table.limits.len())];
    let settings = settings();
    let matrix = table.matrix(unknowns + 2);
    let mut solver = DefaultSolver::new(&quadratic, &linear, &matrix, &table.limits, &cones, settings).ok()?;
    solver.solve();
    let solution = &solver.solution;
    // A solver that stalled may still have come near: what its step is worth is judged by the caller on the true
    // problem. Certificates of infeasibility, and what numbers broke, are not points.
    let usable = match solution.status {
        SolverStatus::Solved
        | SolverStatus::AlmostSolved
        | SolverStatus::InsufficientProgress
        | SolverStatus::MaxIterations => true,
        SolverStatus::NumericalError
        | SolverStatus::Unsolved
        | SolverStatus::PrimalInfeasible
        | SolverStatus::DualInfeasible
        | SolverStatus::AlmostPrimalInfeasible
        | SolverStatus::AlmostDualInfeasible
        | SolverStatus::MaxTime
        | SolverStatus::CallbackTerminated => false,
    };
    if !usable || solution.x.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let step = solution.x[..unknowns].iter().map(|y| (y * length).clamp(-scales.radius, scales.radius)).collect();
    let held = listed.iter().zip(&solution.z).filter(|(_, z)| **z > HOLDING).map(|(side, _)| *side);
    Some(Step { step, holding: held.collect() })
}

/// Multiplier, against 1 for their sum, from which a side is taken to hold the solution back.
const HOLDING: f64 = 1e-5;

fn settings() -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_threads: 1,
        max_iter: 80,
        tol_gap_abs: 1e-7,
        tol_gap_rel: 1e-7,
        presolve_enable: false,
        ..DefaultSettings::default()
    }
}

/// Inequalities `row . x <= limit`, gathered row by row.
#[derive(Default)]
struct Table {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
    limits: Vec<f64>,
}

impl Table {
    fn push(&mut self, entries: impl IntoIterator<Item = (usize, f64)>, limit: f64) {
        let row = self.limits.len();
        for (column, value) in entries {
            self.rows.push(row);
            self.columns.push(column);
            self.values.push(value);
        }
        self.limits.push(limit);
    }

    /// Compressed columns. Entries come row by row, so counting by column keeps each column's rows in order.
    fn matrix(&self, columns: usize) -> CscMatrix<f64> {
        let mut starts = vec![0; columns + 1];
        for column in &self.columns {
            starts[column + 1] += 1;
        }
        for column in 0..columns {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let (mut rows, mut values) = (vec![0; self.rows.len()], vec![0.0; self.rows.len()]);
        for ((row, column), value) in self.rows.iter().zip(&self.columns).zip(&self.values) {
            rows[next[*column]] = *row;
            values[next[*column]] = *value;
            next[*column] += 1;
        }
        CscMatrix::new(self.limits.len(), columns, starts, rows, values)
    }
}

/// Upper triangle of the Hessian and the gradient of the squared terms, times the two factors; tau and sigma have none.
///
/// Column by column from the first unknown that meets it in a row: narrow where neighbours meet neighbours, full only
/// for unknowns that meet all others.
fn soft_terms(rows: &Rows, unknowns: usize, by_hessian: f64, by_gradient: f64) -> (CscMatrix<f64>, Vec<f64>) {
    let mut tops: Vec<usize> = (0..unknowns).collect();
    for (_, _, gradient) in rows.squares() {
        let first = gradient.iter().map(|(i, _)| *i).min().unwrap_or(0);
        for (i, _) in gradient {
            tops[*i] = tops[*i].min(first);
        }
    }
    let mut starts = vec![0; unknowns + 3];
    for column in 0..unknowns {
        starts[column + 1] = starts[column] + column - tops[column] + 1;
    }
    starts[unknowns + 1] = starts[unknowns];
    starts[unknowns + 2] = starts[unknowns];
    let (mut values, mut linear) = (vec![0.0; starts[unknowns]], vec![0.0; unknowns]);
    for (value, weight, gradient) in rows.squares() {
        for (column, g) in gradient {
            linear[*column] += by_gradient * weight * value * g;
            for (row, other) in gradient.iter().filter(|(row, _)| row <= column) {
                values[starts[*column] + row - tops[*column]] += by_hessian * weight * g * other;
            }
        }
    }
    let row_numbers = (0..unknowns).flat_map(|column| tops[column]..=column).collect();
    (CscMatrix::new(unknowns + 2, unknowns + 2, starts, row_numbers, values), linear)
}
