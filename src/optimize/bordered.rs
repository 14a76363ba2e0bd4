//! Levenberg-Marquardt for banded problems with a few unknowns that every residual may touch: an arrow-shaped normal
//! matrix, solved by the Schur complement of its band.

use super::levenberg_marquardt::{NormalEquations, Outcome, Settings};
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

    /// Half the weighted sum of squares gathered so far.
    pub fn cost(&self) -> f64 {
        self.band.cost
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

    fn diagonal(&self, i: usize) -> f64 {
        let banded = self.band.gradient.len();
        if i < banded { self.band.matrix.diagonal(i) } else { self.corner[(i - banded, i - banded)] }
    }

    fn gradient(&self, i: usize) -> f64 {
        let banded = self.band.gradient.len();
        if i < banded { self.band.gradient[i] } else { self.corner_gradient[i - banded] }
    }

    /// The step that solves the equations with `damping` times the diagonal added; banded unknowns first.
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

fn floor(diagonal: f64) -> f64 {
    diagonal.max(1e-12)
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

/// Lowers the sum of squares from `x`, in place. `None` when the problem is not defined at the start.
pub fn minimize_bordered(
    problem: &mut impl BorderedLeastSquares,
    x: &mut Vec<f64>,
    settings: &Settings,
) -> Option<Outcome> {
    let (n, w, q) = (problem.unknowns(), problem.half_bandwidth(), problem.shared());
    let mut here = BorderedEquations::new(n, w, q);
    problem.assemble(x, &mut here)?;
    let mut damping = settings.damping;
    let mut growth = 2.0;
    let mut small_steps = 0;
    for steps in 1..=settings.max_steps {
        let trial = here.step(damping).and_then(|step| {
            let moved: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + s).collect();
            let mut there = BorderedEquations::new(n, w, q);
            problem.assemble(&moved, &mut there)?;
            (there.cost().is_finite() && there.cost() <= here.cost()).then_some((step, moved, there))
        });
        let Some((step, moved, there)) = trial else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                return Some(Outcome { cost: here.cost(), steps, converged: true });
            }
            continue;
        };
        // Gain ratio: what the step won over what the quadratic model promised.
        let promised: f64 = step
            .iter()
            .enumerate()
            .map(|(i, s)| 0.5 * s * (damping * floor(here.diagonal(i)) * s - here.gradient(i)))
            .sum();
        let won = here.cost() - there.cost();
        let gain = if promised > 0.0 { won / promised } else { 1.0 };
        damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-15);
        growth = 2.0;
        let small = won <= settings.cost_share * here.cost();
        *x = moved;
        here = there;
        small_steps = if small { small_steps + 1 } else { 0 };
        if small_steps >= 2 || here.cost() == 0.0 {
            return Some(Outcome { cost: here.cost(), steps, converged: true });
        }
    }
    Some(Outcome { cost: here.cost(), steps: settings.max_steps, converged: false })
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
        let outcome = minimize_bordered(&mut problem, &mut x, &Settings::default()).unwrap();
        assert!(outcome.converged && outcome.cost < 1e-16, "{outcome:?}");
        assert!((x[30] - 3.0).abs() < 1e-6 && (x[31] + 2.0).abs() < 1e-6, "{:?}", &x[30..]);
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
        assert!(minimize_bordered(&mut Nowhere, &mut vec![0.0], &Settings::default()).is_none());
    }
}
