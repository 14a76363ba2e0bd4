//! Least squares of banded problems with a few unknowns that every residual may touch: an arrow-shaped normal
//! matrix, solved by the Schur complement of its band.

use super::descent::{Equations, Outcome, Settings, descend, floor};
use super::levenberg_marquardt::NormalEquations;
use nalgebra::{Cholesky, DMatrix, DVector};

/// Sums of squares of a banded problem with a border.
#[derive(Clone, Debug)]
pub struct BorderedEquations {
    band: NormalEquations,
    /// Column by column, one a shared unknown: its products with the banded unknowns.
    border: Vec<Vec<f64>>,
    /// Products of shared unknowns with each other.
    corner: DMatrix<f64>,
    corner_gradient: DVector<f64>,
}

impl BorderedEquations {
    /// Empty equations for `unknowns` banded and `shared` other unknowns.
    pub fn new(unknowns: usize, half_bandwidth: usize, shared: usize) -> Self {
        Self {
            band: NormalEquations::new(unknowns, half_bandwidth),
            border: vec![vec![0.0; unknowns]; shared],
            corner: DMatrix::zeros(shared, shared),
            corner_gradient: DVector::zeros(shared),
        }
    }

    /// Adds one residual: its gradient by a run of banded unknowns from `first` on, and by all shared ones. Either may
    /// be empty.
    pub fn add(&mut self, first: usize, gradient: &[f64], shared: &[f64], residual: f64, weight: f64) {
        self.band.add(first, gradient, residual, weight);
        for (i, by_shared) in shared.iter().enumerate() {
            let scaled = weight * by_shared;
            if scaled == 0.0 {
                continue;
            }
            for (sum, value) in self.border[i][first..].iter_mut().zip(gradient) {
                *sum += scaled * value;
            }
            for (j, other) in shared.iter().enumerate() {
                self.corner[(i, j)] += scaled * other;
            }
            self.corner_gradient[i] += scaled * residual;
        }
    }

    /// The unknowns at which the gradient vanishes, seen from zero: the solution of a linear problem.
    pub fn solve(&self) -> Option<Vec<f64>> {
        self.step(0.0)
    }

    /// Half the weighted sum of squares gathered so far, and its derivatives by all unknowns, shared ones last.
    pub fn cost_and_gradient(&self) -> (f64, Vec<f64>) {
        let gradient = self.band.gradient.iter().chain(self.corner_gradient.iter());
        (self.band.cost, gradient.copied().collect())
    }
}

impl Equations for BorderedEquations {
    fn cost(&self) -> f64 {
        self.band.cost
    }

    fn diagonal(&self, i: usize) -> f64 {
        let banded = self.band.gradient.len();
        if i < banded { self.band.matrix.diagonal(i) } else { self.corner[(i - banded, i - banded)] }
    }

    fn gradient(&self, i: usize) -> f64 {
        let banded = self.band.gradient.len();
        if i < banded { self.band.gradient[i] } else { self.corner_gradient[i - banded] }
    }

    fn step(&self, damping: f64) -> Option<Vec<f64>> {
        let (n, q) = (self.band.gradient.len(), self.border.len());
        let mut band = self.band.matrix.clone();
        for i in 0..n {
            band.add_diagonal(i, damping * floor(self.diagonal(i)));
        }
        let factor = band.factor()?;
        let mut free = self.band.gradient.clone();
        factor.solve(&mut free);
        let solved: Vec<Vec<f64>> = self
            .border
            .iter()
            .map(|column| {
                let mut column = column.clone();
                factor.solve(&mut column);
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let mut schur = self.corner.clone();
        let mut right = self.corner_gradient.clone();
        for i in 0..q {
            schur[(i, i)] += damping * floor(self.diagonal(n + i));
            right[i] -= dot(&self.border[i], &free);
            for j in 0..q {
                schur[(i, j)] -= dot(&self.border[i], &solved[j]);
            }
        }
        let shared = if q > 0 { Cholesky::new(schur)?.solve(&right) } else { right };
        let mut step: Vec<f64> = free.iter().map(|value| -value).collect();
        for (column, value) in solved.iter().zip(shared.iter()) {
            for (step, entry) in step.iter_mut().zip(column) {
                *step += entry * value;
            }
        }
        step.extend(shared.iter().map(|value| -value));
        step.iter().all(|value| value.is_finite()).then_some(step)
    }
}

/// A sum of weighted squares of residuals; unknowns are the banded ones, then the shared ones.
pub trait BorderedLeastSquares {
    /// Number of banded unknowns.
    fn unknowns(&self) -> usize;
    /// Longest run of banded unknowns that one residual touches, less one.
    fn half_bandwidth(&self) -> usize;
    /// Number of shared unknowns.
    fn shared(&self) -> usize;
    /// Adds every residual at `x`. `None` where the problem is not defined at `x`; the step is then shortened.
    fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()>;
}

/// Lowers the sum of squares from `x`, in place; `watch` sees the problem after each step taken and says whether to go
/// on. A shared unknown that no residual touches stays where it is. `None` when the problem is not defined at the start.
pub fn minimize_bordered<P: BorderedLeastSquares>(
    problem: &mut P,
    x: &mut Vec<f64>,
    settings: &Settings,
    watch: impl FnMut(&P, usize) -> bool,
) -> Option<Outcome> {
    let assemble = |problem: &mut P, x: &[f64]| {
        let mut equations = BorderedEquations::new(problem.unknowns(), problem.half_bandwidth(), problem.shared());
        problem.assemble(x, &mut equations)?;
        Some(equations)
    };
    descend(problem, assemble, x, settings, watch)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fits y = x[i] + a s + b s^2 to values whose smooth part is a parabola: x is held small, a and b are shared.
    struct Parabola {
        values: Vec<f64>,
    }

    impl BorderedLeastSquares for Parabola {
        fn unknowns(&self) -> usize {
            self.values.len()
        }
        fn half_bandwidth(&self) -> usize {
            1
        }
        fn shared(&self) -> usize {
            2
        }
        fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()> {
            let n = self.values.len();
            for (i, value) in self.values.iter().enumerate() {
                let s = i as f64 / n as f64;
                let model = x[i] + x[n] * s + x[n + 1] * s * s;
                equations.add(i, &[1.0], &[s, s * s], model - value, 1.0);
                equations.add(i, &[1.0], &[], x[i], 1e-3);
                if i + 1 < n {
                    equations.add(i, &[1.0, -1.0], &[], x[i] - x[i + 1], 1e-3);
                }
            }
            Some(())
        }
    }

    #[test]
    fn shared_unknowns_are_found_together_with_the_banded_ones() {
        let values: Vec<f64> = (0..30).map(|i| f64::from(i) / 30.0).map(|s| 3.0 * s - 2.0 * s * s).collect();
        let mut problem = Parabola { values };
        let mut x = vec![0.5; 32];
        let outcome = minimize_bordered(&mut problem, &mut x, &Settings::default(), |_, _| true).unwrap();
        assert!(outcome.converged && outcome.cost < 1e-16, "{outcome:?}");
        assert!((x[30] - 3.0).abs() < 1e-6 && (x[31] + 2.0).abs() < 1e-6, "{:?}", &x[30..]);
    }

    #[test]
    fn untouched_shared_unknowns_stay_and_whoever_watches_can_end_it() {
        struct Line;
        impl BorderedLeastSquares for Line {
            fn unknowns(&self) -> usize {
                6
            }
            fn half_bandwidth(&self) -> usize {
                1
            }
            fn shared(&self) -> usize {
                2
            }
            fn assemble(&mut self, x: &[f64], equations: &mut BorderedEquations) -> Option<()> {
                for i in 0..6 {
                    let s = i as f64;
                    // Each unknown is r s, and measured as 2 + 3 s.
                    equations.add(i, &[1.0], &[0.0, -s], x[i] - x[7] * s, 1.0);
                    equations.add(i, &[1.0], &[], x[i] - 2.0 - 3.0 * s, 1.0);
                }
                Some(())
            }
        }
        let mut x = vec![0.0; 8];
        x[6] = 0.7;
        minimize_bordered(&mut Line, &mut x, &Settings::default(), |_, _| true).unwrap();
        // Least squares of 2 + 3 s by r s alone: r = 3 + 2 sum(s) / sum(s^2).
        assert!(x[6] == 0.7 && (x[7] - (3.0 + 2.0 * 15.0 / 55.0)).abs() < 1e-6, "{x:?}");
        let outcome = minimize_bordered(&mut Line, &mut vec![0.0; 8], &Settings::default(), |_, _| false);
        assert_eq!(outcome.map(|o| (o.steps, o.converged)), Some((1, false)));
    }

    #[test]
    fn undefined_start_is_no_result() {
        struct Nowhere;
        impl BorderedLeastSquares for Nowhere {
            fn unknowns(&self) -> usize {
                1
            }
            fn half_bandwidth(&self) -> usize {
                0
            }
            fn shared(&self) -> usize {
                0
            }
            fn assemble(&mut self, _: &[f64], _: &mut BorderedEquations) -> Option<()> {
                None
            }
        }
        assert!(minimize_bordered(&mut Nowhere, &mut vec![0.0], &Settings::default(), |_, _| true).is_none());
    }
}
