//! Levenberg-Marquardt for banded problems. Source: Nielsen, Damping parameter in Marquardt's method (1999), for the
//! damping update.

use super::BandedMatrix;

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

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Most steps tried.
    pub max_steps: usize,
    /// Stop when a step lowers the cost by less than this share of it.
    pub cost_share: f64,
    /// Damping at the start, as a share of the diagonal.
    pub damping: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { max_steps: 60, cost_share: 1e-9, damping: 1e-4 }
    }
}

/// How a minimization ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// Half the weighted sum of squares at the end.
    pub cost: f64,
    /// Steps tried.
    pub steps: usize,
    /// False when the step limit or numerical trouble ended it.
    pub converged: bool,
}

/// Lowers the sum of squares from `x`, in place. `None` when the problem is not defined at the start.
pub fn minimize(problem: &mut impl LeastSquares, x: &mut Vec<f64>, settings: &Settings) -> Option<Outcome> {
    let (n, w) = (problem.unknowns(), problem.half_bandwidth());
    let mut here = NormalEquations::new(n, w);
    problem.assemble(x, &mut here)?;
    let mut damping = settings.damping;
    let mut growth = 2.0;
    let mut small_steps = 0;
    for steps in 1..=settings.max_steps {
        let mut damped = here.matrix.clone();
        for i in 0..n {
            damped.add_diagonal(i, damping * here.matrix.diagonal(i).max(1e-12));
        }
        let step = damped.factor().map(|factor| {
            let mut step: Vec<f64> = here.gradient.iter().map(|g| -g).collect();
            factor.solve(&mut step);
            step
        });
        let trial = step.as_ref().and_then(|step| {
            let moved: Vec<f64> = x.iter().zip(step).map(|(x, s)| x + s).collect();
            let mut there = NormalEquations::new(n, w);
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
        // Gain ratio: what the step won over what the quadratic model promised.
        let promised: f64 = step
            .iter()
            .enumerate()
            .map(|(i, s)| 0.5 * s * (damping * here.matrix.diagonal(i).max(1e-12) * s - here.gradient[i]))
            .sum();
        let won = here.cost - there.cost;
        let gain = if promised > 0.0 { won / promised } else { 1.0 };
        damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).max(1.0 / 3.0);
        damping = damping.max(1e-15);
        growth = 2.0;
        let small = won <= settings.cost_share * here.cost;
        *x = moved;
        here = there;
        small_steps = if small { small_steps + 1 } else { 0 };
        if small_steps >= 2 || here.cost == 0.0 {
            return Some(Outcome { cost: here.cost, steps, converged: true });
        }
    }
    Some(Outcome { cost: here.cost, steps: settings.max_steps, converged: false })
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
