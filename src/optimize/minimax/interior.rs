//! One linearized minimax problem whose rows touch short runs of the unknowns, by a primal-dual interior-point method of
//! its own: Mehrotra's predictor and corrector (On the implementation of a primal-dual interior point method, 1992) on
//! normal equations that are banded but for two columns, those of tau and sigma. One iteration costs a banded
//! factorization and a pass over the rows that take part, some tens of times less than a general conic solver takes.
//!
//! The problem is that of [`super::subproblem`], in the same scales. Its start is strictly feasible: no step, with tau
//! and sigma so large that every row has room.

use super::rows::{Rows, SIDES};
use super::subproblem::{ActiveSet, Scales, Step};
use crate::optimize::BandedMatrix;
use crate::optimize::banded::dot;
use std::ops::Range;

/// Longest run of unknowns, as a share of their number, for which banded equations pay.
const BANDED_SHARE: f64 = 0.34;
/// Most iterations.
const ITERATIONS: usize = 60;
/// Duality gap, against an objective of about 1, at which a solution is good enough to be judged.
const GAP: f64 = 1e-5;
/// Gradient of the Lagrangian at which it is.
const RESIDUAL: f64 = 1e-5;
/// Share of the way to the boundary that a step may go.
const BOLDNESS: f64 = 0.995;
/// Multiplier from which a side is taken to hold the solution back.
const HOLDING: f64 = 1e-5;

/// A gradient as a run of unknowns without gaps.
struct Run {
    first: usize,
    start: usize,
    end: usize,
}

/// Gradients one behind the other.
#[derive(Default)]
struct Runs {
    runs: Vec<Run>,
    values: Vec<f64>,
}

impl Runs {
    fn push(&mut self, gradient: &[(usize, f64)]) {
        let first = gradient.iter().map(|(i, _)| *i).min().unwrap_or(0);
        let last = gradient.iter().map(|(i, _)| *i + 1).max().unwrap_or(0);
        let start = self.values.len();
        self.values.resize(start + last.saturating_sub(first), 0.0);
        for (i, g) in gradient {
            self.values[start + i - first] = *g;
        }
        self.runs.push(Run { first, start, end: self.values.len() });
    }

    fn get(&self, row: usize) -> (usize, &[f64]) {
        let run = &self.runs[row];
        (run.first, &self.values[run.start..run.end])
    }

    /// How many runs from `row` on start at the same unknown and are as long.
    fn alike(&self, row: usize) -> usize {
        let (first, run) = self.get(row);
        let same = |other: &&Run| other.first == first && other.end - other.start == run.len();
        self.runs[row..].iter().take_while(same).count()
    }

    /// The values of `count` runs from `row` on.
    fn values(&self, row: usize, count: usize) -> &[f64] {
        &self.values[self.runs[row].start..self.runs[row + count - 1].end]
    }

    fn dot(&self, row: usize, y: &[f64]) -> f64 {
        let (first, run) = self.get(row);
        dot(run, &y[first..first + run.len()])
    }

    fn add_to(&self, row: usize, factor: f64, sum: &mut [f64]) {
        let (first, run) = self.get(row);
        for (entry, value) in sum[first..].iter_mut().zip(run) {
            *entry += factor * value;
        }
    }

    fn longest(&self) -> usize {
        self.runs.iter().map(|run| run.end - run.start).max().unwrap_or(0)
    }
}

/// One inequality `factor * run . y - by_tau * tau - by_sigma * sigma <= limit`.
#[derive(Clone, Copy)]
struct Inequality {
    factor: f64,
    by_tau: f64,
    by_sigma: f64,
    limit: f64,
    side: (usize, usize),
}

/// The scaled problem.
struct Problem {
    unknowns: usize,
    runs: Runs,
    /// Those of one run one behind the other.
    inequalities: Vec<Inequality>,
    /// Where those of each run end.
    ends: Vec<usize>,
    /// Bound of each unknown.
    reach: f64,
    /// Hessian of the squared terms.
    hessian: BandedMatrix,
    linear: Vec<f64>,
    penalty: f64,
    half_bandwidth: usize,
}

/// Slacks and multipliers of everything that is bounded.
#[derive(Clone)]
struct Pairs {
    slack: Vec<f64>,
    multiplier: Vec<f64>,
}

/// Primal variables: the step, tau, sigma.
#[derive(Clone)]
struct Point {
    y: Vec<f64>,
    tau: f64,
    sigma: f64,
}

/// Solves the problem over the sides in `active`; `None` when its rows are not banded, or the numbers break down.
pub(super) fn solve(rows: &Rows, unknowns: usize, active: &ActiveSet, scales: &Scales) -> Option<Step> {
    let problem = Problem::new(rows, unknowns, active, scales)?;
    let (point, pairs) = problem.run()?;
    let length = scales.unit * scales.tau;
    let step = point.y.iter().map(|y| (y * length).clamp(-scales.radius, scales.radius)).collect();
    let held = problem.inequalities.iter().zip(&pairs.multiplier).filter(|(_, z)| **z > HOLDING);
    Some(Step { step, holding: held.map(|(inequality, _)| inequality.side).collect() })
}

impl Problem {
    fn new(rows: &Rows, unknowns: usize, active: &ActiveSet, scales: &Scales) -> Option<Self> {
        let length = scales.unit * scales.tau;
        let (mut runs, mut inequalities, mut ends) = (Runs::default(), Vec::new(), Vec::new());
        for row in 0..rows.len() {
            let before = inequalities.len();
            for which in (0..SIDES).filter(|which| active.has(row, *which)) {
                let Some(side) = rows.sides(row).side(which) else { continue };
                let size = if side.share > 0.0 { side.share * scales.tau } else { length };
                inequalities.push(Inequality {
                    factor: side.sign * length / size,
                    by_tau: if side.share > 0.0 { 1.0 } else { 0.0 },
                    by_sigma: if side.share > 0.0 { 0.0 } else { 1.0 },
                    limit: (side.constant - side.sign * rows.value(row)) / size,
                    side: (row, which),
                });
            }
            if inequalities.len() > before {
                runs.push(rows.gradient(row));
                ends.push(inequalities.len());
            }
        }
        let mut squares = Runs::default();
        let mut weights = Vec::new();
        for (value, weight, gradient) in rows.squares() {
            squares.push(gradient);
            weights.push((value, weight));
        }
        let longest = runs.longest().max(squares.longest()).max(1);
        if longest as f64 > BANDED_SHARE * unknowns as f64 {
            return None;
        }
        let half_bandwidth = longest - 1;
        let mut hessian = BandedMatrix::zeros(unknowns, half_bandwidth);
        let mut linear = vec![0.0; unknowns];
        for (row, (value, weight)) in weights.iter().enumerate() {
            let (first, run) = squares.get(row);
            hessian.add_outer(first, run, weight * length * length / scales.tau);
            squares.add_to(row, weight * value * length / scales.tau, &mut linear);
        }
        let reach = scales.radius / length;
        let penalty = scales.penalty;
        Some(Self { unknowns, runs, inequalities, ends, reach, hessian, linear, penalty, half_bandwidth })
    }

    /// Every run with the range of its inequalities.
    fn by_run(&self) -> impl Iterator<Item = (usize, Range<usize>)> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, end)| start..*end).enumerate()
    }

    /// Number of bounded things: inequalities, both bounds of each unknown, tau and sigma.
    fn bounded(&self) -> usize {
        self.inequalities.len() + 2 * self.unknowns + 2
    }

    /// Slack of every bound at a point, in the order of [`Self::bounded`], without any residual of its own.
    fn slacks(&self, at: &Point) -> Vec<f64> {
        let mut slack = Vec::with_capacity(self.bounded());
        for (run, range) in self.by_run() {
            let moved = self.runs.dot(run, &at.y);
            let left = |i: &Inequality| i.limit - i.factor * moved + i.by_tau * at.tau + i.by_sigma * at.sigma;
            slack.extend(self.inequalities[range].iter().map(left));
        }
        slack.extend(at.y.iter().map(|y| self.reach - y));
        slack.extend(at.y.iter().map(|y| self.reach + y));
        slack.extend([at.tau, at.sigma]);
        slack
    }

    /// Change of every slack along a direction.
    fn slack_rates(&self, along: &Point) -> Vec<f64> {
        let mut rates = Vec::with_capacity(self.bounded());
        for (run, range) in self.by_run() {
            let moved = self.runs.dot(run, &along.y);
            let rate = |i: &Inequality| i.by_tau * along.tau + i.by_sigma * along.sigma - i.factor * moved;
            rates.extend(self.inequalities[range].iter().map(rate));
        }
        rates.extend(along.y.iter().map(|y| -y));
        rates.extend(along.y.iter().copied());
        rates.extend([along.tau, along.sigma]);
        rates
    }

    /// Sum of multipliers times the gradients of what they belong to (of the bounded quantity, not of the slack).
    fn pull(&self, multiplier: &[f64]) -> Point {
        let mut pull = Point { y: vec![0.0; self.unknowns], tau: 0.0, sigma: 0.0 };
        let count = self.inequalities.len();
        for (run, range) in self.by_run() {
            let mut factor = 0.0;
            for (i, z) in self.inequalities[range.clone()].iter().zip(&multiplier[range]) {
                factor += i.factor * z;
                pull.tau -= i.by_tau * z;
                pull.sigma -= i.by_sigma * z;
            }
            self.runs.add_to(run, factor, &mut pull.y);
        }
        for (i, y) in pull.y.iter_mut().enumerate() {
            *y += multiplier[count + i] - multiplier[count + self.unknowns + i];
        }
        pull.tau -= multiplier[count + 2 * self.unknowns];
        pull.sigma -= multiplier[count + 2 * self.unknowns + 1];
        pull
    }

    fn run(&self) -> Option<(Point, Pairs)> {
        let mut at = self.start();
        let slack = self.slacks(&at);
        let count = slack.len() as f64;
        // Multipliers on the central path that at least outweigh the prices of tau and sigma.
        let sum = |by: fn(&Inequality) -> f64, own: f64| -> f64 {
            self.inequalities.iter().zip(&slack).map(|(i, w)| by(i) / w).sum::<f64>() + 1.0 / own
        };
        let mu = (1.0 / sum(|i| i.by_tau, at.tau)).max(self.penalty / sum(|i| i.by_sigma, at.sigma));
        let mut pairs = Pairs { multiplier: slack.iter().map(|w| mu / w).collect(), slack };
        for _ in 0..ITERATIONS {
            let gap: f64 = pairs.slack.iter().zip(&pairs.multiplier).map(|(w, z)| w * z).sum();
            let residual = self.dual_residual(&at, &pairs);
            let worst = residual.y.iter().chain([&residual.tau, &residual.sigma]).fold(0.0_f64, |m, r| m.max(r.abs()));
            if !gap.is_finite() {
                return None;
            }
            if gap < GAP * (1.0 + at.tau + self.penalty * at.sigma) && worst < RESIDUAL {
                break;
            }
            let mu = gap / count;
            let Some(equations) = self.equations(&pairs) else { break };
            // Predictor: straight for the solution.
            let target: Vec<f64> = pairs.slack.iter().zip(&pairs.multiplier).map(|(w, z)| -w * z).collect();
            let (step, rates, pushes) = self.direction(&equations, &pairs, &residual, &target);
            let (a, b) = (reach_of(&pairs.slack, &rates, 1.0), reach_of(&pairs.multiplier, &pushes, 1.0));
            let left: f64 = (0..pairs.slack.len())
                .map(|i| (pairs.slack[i] + a * rates[i]) * (pairs.multiplier[i] + b * pushes[i]))
                .sum();
            let centring = (left / gap).clamp(0.0, 1.0).powi(3);
            drop(step);
            // Corrector: toward the centre, with what the predictor's products left out.
            let target: Vec<f64> = (0..pairs.slack.len())
                .map(|i| centring * mu - pairs.slack[i] * pairs.multiplier[i] - rates[i] * pushes[i])
                .collect();
            let (step, rates, pushes) = self.direction(&equations, &pairs, &residual, &target);
            let a = reach_of(&pairs.slack, &rates, BOLDNESS);
            let b = reach_of(&pairs.multiplier, &pushes, BOLDNESS);
            if !(a > 1e-10 && b > 1e-10) {
                break;
            }
            for (y, d) in at.y.iter_mut().zip(&step.y) {
                *y += a * d;
            }
            at.tau += a * step.tau;
            at.sigma += a * step.sigma;
            for i in 0..pairs.slack.len() {
                pairs.slack[i] += a * rates[i];
                pairs.multiplier[i] += b * pushes[i];
            }
        }
        at.y.iter().all(|y| y.is_finite()).then_some((at, pairs))
    }

    /// No step at all, and room for every row.
    fn start(&self) -> Point {
        let (mut tau, mut sigma) = (1.0_f64, 1.0_f64);
        for i in &self.inequalities {
            if i.by_tau > 0.0 {
                tau = tau.max(-i.limit * 1.5 + 1.0);
            } else {
                sigma = sigma.max(-i.limit * 1.5 + 1.0);
            }
        }
        Point { y: vec![0.0; self.unknowns], tau, sigma }
    }

    /// Gradient of the Lagrangian.
    fn dual_residual(&self, at: &Point, pairs: &Pairs) -> Point {
        let mut residual = self.pull(&pairs.multiplier);
        let curved = self.hessian.times(&at.y);
        for (i, r) in residual.y.iter_mut().enumerate() {
            *r += curved[i] + self.linear[i];
        }
        residual.tau += 1.0;
        residual.sigma += self.penalty;
        residual
    }
}

/// Largest share of a step that keeps every value positive, times `boldness`, at most 1.
fn reach_of(values: &[f64], rates: &[f64], boldness: f64) -> f64 {
    let mut limit = f64::INFINITY;
    for (value, rate) in values.iter().zip(rates) {
        // Few lower the limit: the others need no division.
        if *rate < 0.0 && value + limit * rate < 0.0 {
            limit = -value / rate;
        }
    }
    (boldness * limit).min(1.0)
}

/// Normal equations, factored: banded block, the two full columns solved through it, and their Schur complement.
struct Equations {
    factor: crate::optimize::banded::Factor,
    /// Columns of tau and sigma before and after the banded solve.
    columns: [Vec<f64>; 2],
    solved: [Vec<f64>; 2],
    /// Schur complement: tau-tau, tau-sigma, sigma-sigma.
    corner: [f64; 3],
}

impl Problem {
    fn equations(&self, pairs: &Pairs) -> Option<Equations> {
        let mut matrix = BandedMatrix::zeros(self.unknowns, self.half_bandwidth);
        matrix.add(&self.hessian);
        let mut columns = [vec![0.0; self.unknowns], vec![0.0; self.unknowns]];
        let mut corner = [0.0; 3];
        let count = self.inequalities.len();
        let ratio = |k: usize| pairs.multiplier[k] / pairs.slack[k];
        let mut weights = Vec::with_capacity(self.ends.len());
        for (run, range) in self.by_run() {
            let (mut weight, mut by_tau, mut by_sigma) = (0.0, 0.0, 0.0);
            for k in range {
                let (i, d) = (&self.inequalities[k], ratio(k));
                weight += d * i.factor * i.factor;
                by_tau -= d * i.factor * i.by_tau;
                by_sigma -= d * i.factor * i.by_sigma;
                corner[0] += d * i.by_tau * i.by_tau;
                corner[1] += d * i.by_tau * i.by_sigma;
                corner[2] += d * i.by_sigma * i.by_sigma;
            }
            weights.push(weight);
            self.runs.add_to(run, by_tau, &mut columns[0]);
            self.runs.add_to(run, by_sigma, &mut columns[1]);
        }
        let mut run = 0;
        while run < weights.len() {
            let alike = self.runs.alike(run);
            let (first, _) = self.runs.get(run);
            matrix.add_outers(first, self.runs.values(run, alike), &weights[run..run + alike]);
            run += alike;
        }
        for i in 0..self.unknowns {
            matrix.add_diagonal(i, ratio(count + i) + ratio(count + self.unknowns + i));
        }
        corner[0] += ratio(count + 2 * self.unknowns);
        corner[2] += ratio(count + 2 * self.unknowns + 1);
        let factor = matrix.factor()?;
        let solved = columns.clone().map(|mut column| {
            factor.solve(&mut column);
            column
        });
        corner[0] -= dot(&columns[0], &solved[0]);
        corner[1] -= dot(&columns[0], &solved[1]);
        corner[2] -= dot(&columns[1], &solved[1]);
        let sound = corner[0] > 0.0 && corner[2] > 0.0 && corner[0] * corner[2] > corner[1] * corner[1];
        sound.then_some(Equations { factor, columns, solved, corner })
    }

    /// Newton's direction for `w z` to change by `target`: point, slacks, multipliers.
    fn direction(
        &self,
        equations: &Equations,
        pairs: &Pairs,
        residual: &Point,
        target: &[f64],
    ) -> (Point, Vec<f64>, Vec<f64>) {
        let scaled: Vec<f64> = target.iter().zip(&pairs.slack).map(|(t, w)| t / w).collect();
        let pull = self.pull(&scaled);
        let mut y: Vec<f64> = residual.y.iter().zip(&pull.y).map(|(r, p)| -r - p).collect();
        equations.factor.solve(&mut y);
        let right = [
            -residual.tau - pull.tau - dot(&equations.columns[0], &y),
            -residual.sigma - pull.sigma - dot(&equations.columns[1], &y),
        ];
        let [a, b, c] = equations.corner;
        let determinant = a * c - b * b;
        let tau = (c * right[0] - b * right[1]) / determinant;
        let sigma = (a * right[1] - b * right[0]) / determinant;
        for (i, y) in y.iter_mut().enumerate() {
            *y -= tau * equations.solved[0][i] + sigma * equations.solved[1][i];
        }
        let step = Point { y, tau, sigma };
        let rates = self.slack_rates(&step);
        let pushes = (0..target.len()).map(|i| scaled[i] - pairs.multiplier[i] / pairs.slack[i] * rates[i]).collect();
        (step, rates, pushes)
    }
}
