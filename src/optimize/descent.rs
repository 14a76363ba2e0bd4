//! The damped descent of Levenberg-Marquardt, for normal equations of any shape. Source: Nielsen, Damping parameter in
//! Marquardt's method (1999), for the damping update.

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
    /// False when the step limit, numerical trouble or whoever watched ended it.
    pub converged: bool,
}

/// Normal equations at some place.
pub(super) trait Equations {
    /// Half the weighted sum of squares there.
    fn cost(&self) -> f64;
    /// Entry `i` of the diagonal.
    fn diagonal(&self, i: usize) -> f64;
    /// Entry `i` of the gradient.
    fn gradient(&self, i: usize) -> f64;
    /// The step that solves them with `damping` times the diagonal, floored, added; `None` where that is singular.
    fn step(&self, damping: f64) -> Option<Vec<f64>>;
}

/// What damping counts a diagonal entry as at least.
pub(super) fn floor(diagonal: f64) -> f64 {
    diagonal.max(1e-12)
}

/// Lowers the sum of squares from `x`, in place. `assemble` gives the equations at a place, or `None` where the problem
/// is not defined: the step is then shortened. `watch` sees the problem after each step taken and says whether to go on.
/// `None` when the problem is not defined at the start.
pub(super) fn descend<P, E: Equations>(
    problem: &mut P,
    assemble: impl Fn(&mut P, &[f64]) -> Option<E>,
    x: &mut Vec<f64>,
    settings: &Settings,
    mut watch: impl FnMut(&P, usize) -> bool,
) -> Option<Outcome> {
    let mut here = assemble(problem, x)?;
    let (mut damping, mut growth, mut small_steps) = (settings.damping, 2.0, 0);
    for steps in 1..=settings.max_steps {
        let trial = here.step(damping).and_then(|step| {
            let moved: Vec<f64> = x.iter().zip(&step).map(|(x, s)| x + s).collect();
            let there = assemble(problem, &moved)?;
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
        small_steps = if won <= settings.cost_share * here.cost() { small_steps + 1 } else { 0 };
        *x = moved;
        here = there;
        let converged = small_steps >= 2 || here.cost() == 0.0;
        if !watch(problem, steps) || converged {
            return Some(Outcome { cost: here.cost(), steps, converged });
        }
    }
    Some(Outcome { cost: here.cost(), steps: settings.max_steps, converged: false })
}
