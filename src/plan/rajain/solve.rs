//! Levenberg-Marquardt for a banded problem with a few more unknowns that every residual may touch (a border). Uses
//! `optimize`.
//!
//! With the banded block A, the border B and the corner C, the step solves [A B; B' C]: A is factored as a band, and the
//! corner by its Schur complement C - B' A^-1 B. Damping as in `optimize` (Nielsen 1999).

use crate::optimize::{NormalEquations, Outcome, Settings};
use nalgebra::{DMatrix, DVector};

/// Normal equations with a border.
#[derive(Clone, Debug)]
pub(super) struct BorderedEquations {
    band: NormalEquations,
    /// One column a border unknown.
    border: Vec<Vec<f64>>,
    corner: DMatrix<f64>,
    corner_gradient: DVector<f64>,
    /// Half the weighted sum of squares.
    pub(super) cost: f64,
}

impl BorderedEquations {
    pub(super) fn new(unknowns: usize, half_bandwidth: usize, border: usize) -> Self {
        Self {
            band: NormalEquations::new(unknowns, half_bandwidth),
            border: vec![vec![0.0; unknowns]; border],
            corner: DMatrix::zeros(border, border),
            corner_gradient: DVector::zeros(border),
            cost: 0.0,
        }
    }

    /// Adds a residual whose gradient is `run` from unknown `first`, and `globals` on the border.
    pub(super) fn add(&mut self, first: usize, run: &[f64], globals: &[f64], residual: f64, weight: f64) {
        if weight == 0.0 {
            return;
        }
        self.band.add(first, run, residual, weight);
        self.cost += 0.5 * weight * residual * residual;
        for (c, by_global) in globals.iter().enumerate().filter(|(_, g)| **g != 0.0) {
            for (entry, value) in self.border[c][first..].iter_mut().zip(run) {
                *entry += weight * by_global * value;
            }
            for (other, by_other) in globals.iter().enumerate() {
                self.corner[(c, other)] += weight * by_global * by_other;
            }
            self.corner_gradient[c] += weight * residual * by_global;
        }
    }

    /// Derivative of the cost along a direction over all unknowns, the border's last.
    #[cfg(test)]
    pub(super) fn slope(&self, direction: &[f64]) -> f64 {
        let gradient = self.band.gradient.iter().chain(self.corner_gradient.iter());
        gradient.zip(direction).map(|(g, d)| g * d).sum()
    }

    /// The damped step; border unknowns that are not free stay.
    fn step(&self, damping: f64, free: &[bool]) -> Option<Vec<f64>> {
        let mut matrix = self.band.matrix.clone();
        for i in 0..matrix.size() {
            matrix.add_diagonal(i, damping * self.band.matrix.diagonal(i).max(FLOOR));
        }
        let factor = matrix.factor()?;
        let mut step: Vec<f64> = self.band.gradient.iter().map(|g| -g).collect();
        factor.solve(&mut step);
        let used: Vec<usize> = (0..free.len()).filter(|c| free[*c]).collect();
        let columns: Vec<Vec<f64>> = used
            .iter()
            .map(|c| {
                let mut column = self.border[*c].clone();
                factor.solve(&mut column);
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
        let schur = DMatrix::from_fn(used.len(), used.len(), |r, c| {
            let diagonal = if r == c { damping * self.corner[(used[r], used[r])].max(FLOOR) } else { 0.0 };
            self.corner[(used[r], used[c])] + diagonal - dot(&self.border[used[r]], &columns[c])
        });
        let right =
            DVector::from_fn(used.len(), |r, _| -self.corner_gradient[used[r]] - dot(&self.border[used[r]], &step));
        let corner = if used.is_empty() { right } else { schur.lu().solve(&right)? };
        for (column, value) in columns.iter().zip(corner.iter()) {
            for (s, c) in step.iter_mut().zip(column) {
                *s -= c * value;
            }
        }
        let mut all = vec![0.0; free.len()];
        for (c, value) in used.iter().zip(corner.iter()) {
            all[*c] = *value;
        }
        step.extend(all);
        step.iter().all(|s| s.is_finite()).then_some(step)
    }

    /// What a step promises to win: half of `s' (damping D s - g)`.
    fn promised(&self, step: &[f64], damping: f64) -> f64 {
        let n = self.band.gradient.len();
        let banded = (0..n).map(|i| (self.band.matrix.diagonal(i), self.band.gradient[i]));
        let corner = (0..self.corner_gradient.len()).map(|c| (self.corner[(c, c)], self.corner_gradient[c]));
        let each = banded.chain(corner).zip(step);
        each.map(|((diagonal, gradient), s)| 0.5 * s * (damping * diagonal.max(FLOOR) * s - gradient)).sum()
    }
}

/// Least diagonal that damping counts with.
const FLOOR: f64 = 1e-12;

/// A sum of squares with a border.
pub(super) trait Bordered {
    /// Number of unknowns beside the border.
    fn unknowns(&self) -> usize;
    /// Longest run of unknowns that one residual touches, less one.
    fn half_bandwidth(&self) -> usize;
    /// Which border unknowns are free.
    fn border(&self) -> Vec<bool>;
    /// Adds every residual at `x`, the border's unknowns last. `None` where the problem is not defined.
    fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()>;
}

/// Lowers the sum of squares from `x`, in place; `watch` sees the problem after each step taken and says whether to go
/// on. `None` when the problem is not defined at the start.
pub(super) fn minimize<P: Bordered>(
    problem: &mut P,
    x: &mut Vec<f64>,
    settings: &Settings,
    mut watch: impl FnMut(&P, usize) -> bool,
) -> Option<Outcome> {
    let free = problem.border();
    let empty = BorderedEquations::new(problem.unknowns(), problem.half_bandwidth(), free.len());
    let mut here = empty.clone();
    problem.assemble(x, &mut here)?;
    let (mut damping, mut growth, mut small_steps) = (settings.damping, 2.0, 0);
    for steps in 1..=settings.max_steps {
        let step = here.step(damping, &free);
        let trial = step.as_ref().and_then(|step| {
            let moved: Vec<f64> = x.iter().zip(step).map(|(x, s)| x + s).collect();
            let mut there = empty.clone();
            problem.assemble(&moved, &mut there)?;
            (there.cost.is_finite() && there.cost <= here.cost).then_some((moved, there))
        });
        let Some(((moved, there), step)) = trial.zip(step) else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                return Some(Outcome { cost: here.cost, steps, converged: true });
            }
            continue;
        };
        let promised = here.promised(&step, damping);
        let won = here.cost - there.cost;
        let gain = if promised > 0.0 { won / promised } else { 1.0 };
        damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-15);
        growth = 2.0;
        small_steps = if won <= settings.cost_share * here.cost { small_steps + 1 } else { 0 };
        *x = moved;
        here = there;
        let converged = small_steps >= 2 || here.cost == 0.0;
        if !watch(problem, steps) || converged {
            return Some(Outcome { cost: here.cost, steps, converged });
        }
    }
    Some(Outcome { cost: here.cost, steps: settings.max_steps, converged: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a circle of unknown centre height and radius: a chain x with x_i = c + r s_i, and two border unknowns.
    struct Line {
        free: Vec<bool>,
    }

    impl Bordered for Line {
        fn unknowns(&self) -> usize {
            6
        }
        fn half_bandwidth(&self) -> usize {
            1
        }
        fn border(&self) -> Vec<bool> {
            self.free.clone()
        }
        fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()> {
            for i in 0..6 {
                let s = i as f64;
                // Each unknown is c + r s, and measured as 2 + 3 s.
                equations.add(i, &[1.0], &[-1.0, -s], x[i] - x[6] - x[7] * s, 1.0);
                equations.add(i, &[1.0], &[0.0, 0.0], x[i] - 2.0 - 3.0 * s, 1.0);
            }
            Some(())
        }
    }

    #[test]
    fn border_unknowns_are_found_and_fixed_ones_stay() {
        let mut x = vec![0.0; 8];
        let mut problem = Line { free: vec![true, true] };
        let outcome = minimize(&mut problem, &mut x, &Settings::default(), |_, _| true).unwrap();
        assert!(outcome.cost < 1e-12 && (x[6] - 2.0).abs() < 1e-6 && (x[7] - 3.0).abs() < 1e-6, "{x:?}");
        let mut x = vec![0.0; 8];
        let mut problem = Line { free: vec![false, true] };
        minimize(&mut problem, &mut x, &Settings::default(), |_, _| true).unwrap();
        // Least squares of 2 + 3 s by r s alone: r = 3 + 2 sum(s) / sum(s^2).
        assert!(x[6] == 0.0 && (x[7] - (3.0 + 2.0 * 15.0 / 55.0)).abs() < 1e-6, "{x:?}");
    }

    #[test]
    fn whoever_watches_can_end_it() {
        let mut x = vec![0.0; 8];
        let outcome = minimize(&mut Line { free: vec![true, true] }, &mut x, &Settings::default(), |_, _| false);
        assert_eq!(outcome.map(|o| (o.steps, o.converged)), Some((1, false)));
    }
}
