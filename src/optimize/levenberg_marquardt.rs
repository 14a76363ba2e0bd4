//! Least squares of banded problems.

use super::BandedMatrix;
use super::descent::{Equations, Outcome, Settings, descend, floor};

/// Sums of squares, gathered row by row.
#[derive(Clone, Debug)]
pub struct NormalEquations {
    /// `J^T W J`.
    pub matrix: BandedMatrix,
    /// `J^T W r`.
    pub gradient: Vec<f64>,
    /// Half of `r^T W r`.
    pub cost: f64,
}

impl NormalEquations {
    /// Empty equations for `unknowns` with residuals that touch runs of at most `half_bandwidth + 1`.
    pub fn new(unknowns: usize, half_bandwidth: usize) -> Self {
        Self { matrix: BandedMatrix::zeros(unknowns, half_bandwidth), gradient: vec![0.0; unknowns], cost: 0.0 }
    }

    /// Adds one residual with its gradient, whose nonzero run starts at `first`.
    pub fn add(&mut self, first: usize, gradient: &[f64], residual: f64, weight: f64) {
        self.matrix.add_outer(first, gradient, weight);
        for (sum, value) in self.gradient[first..].iter_mut().zip(gradient) {
            *sum += weight * residual * value;
        }
        self.cost += 0.5 * weight * residual * residual;
    }
}

/// A sum of weighted squares of residuals.
pub trait LeastSquares {
    /// Number of unknowns.
    fn unknowns(&self) -> usize;
    /// Longest run of unknowns that one residual touches, less one.
    fn half_bandwidth(&self) -> usize;
    /// Adds every residual at `x`. `None` where the problem is not defined at `x`; the step is then shortened.
    fn assemble(&mut self, x: &[f64], equations: &mut NormalEquations) -> Option<()>;
}

impl Equations for NormalEquations {
    fn cost(&self) -> f64 {
        self.cost
    }

    fn diagonal(&self, i: usize) -> f64 {
        self.matrix.diagonal(i)
    }

    fn gradient(&self, i: usize) -> f64 {
        self.gradient[i]
    }

    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let mut damped = self.matrix.clone();
        for i in 0..self.gradient.len() {
            damped.add_diagonal(i, damping * floor(self.matrix.diagonal(i)));
        }
        let mut step: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        damped.factor()?.solve(&mut step);
        Some(step)
    }
}

/// Lowers the sum of squares from `x`, in place. `None` when the problem is not defined at the start.
pub fn minimize<P: LeastSquares>(problem: &mut P, x: &mut Vec<f64>, settings: &Settings) -> Option<Outcome> {
    let assemble = |problem: &mut P, x: &[f64]| {
        let mut equations = NormalEquations::new(problem.unknowns(), problem.half_bandwidth());
        problem.assemble(x, &mut equations)?;
        Some(equations)
    };
    descend(problem, assemble, x, settings, |_, _| true)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rosenbrock's valley, chained: minimum 0 at all ones (and a local one where the first is near -1).
    struct Valley(usize);

    impl LeastSquares for Valley {
        fn unknowns(&self) -> usize {
            self.0
        }
        fn half_bandwidth(&self) -> usize {
            1
        }
        fn assemble(&mut self, x: &[f64], equations: &mut NormalEquations) -> Option<()> {
            for i in 0..self.0 - 1 {
                equations.add(i, &[-20.0 * x[i], 10.0], 10.0 * (x[i + 1] - x[i] * x[i]), 1.0);
                equations.add(i, &[-1.0], 1.0 - x[i], 1.0);
            }
            x.iter().all(|v| v.abs() < 1e3).then_some(())
        }
    }

    #[test]
    fn finds_the_bottom_of_a_curved_valley() {
        let mut x = vec![0.3, 1.0, 0.5, 0.8, 1.5];
        let outcome = minimize(&mut Valley(5), &mut x, &Settings { max_steps: 500, ..Settings::default() }).unwrap();
        assert!(outcome.converged && outcome.cost < 1e-20, "{outcome:?}");
        assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-8), "{x:?}");
    }

    #[test]
    fn undefined_start_is_no_result() {
        assert!(minimize(&mut Valley(3), &mut vec![1e4; 3], &Settings::default()).is_none());
    }
}
