//! Samples that no sweep can fit, such as a local bump, set aside: redescending weights whose scale falls to the
//! wanted limit (Geman and McClure; the largest patch machinable within a limit is what keeps its weight).

use super::fit::SweepFit;
use crate::optimize::{Settings, minimize_bordered};

/// Rounds in which the scale falls.
const ROUNDS: usize = 10;
/// Steps of the optimizer in each.
const STEPS: usize = 12;

/// Fits again from `x` with outliers losing their weight. Steps and unknowns; none where the fit breaks down.
pub(super) fn set_aside(fit: &mut SweepFit<'_>, x: &[f64], limit: f64) -> Option<(usize, Vec<f64>)> {
    let mut x = x.to_vec();
    let mut steps = 0;
    let mut scale = spread(fit).max(limit);
    let shrink = (limit / scale).powf(1.0 / ROUNDS as f64);
    for _ in 0..ROUNDS {
        for (weight, sample) in fit.sample_weights.iter_mut().zip(&fit.samples) {
            let share = sample.deviation / scale;
            *weight = 1.0 / (1.0 + share * share).powi(2);
        }
        let settings = Settings { max_steps: STEPS, cost_share: 1e-5, ..Settings::default() };
        steps += minimize_bordered(fit, &mut x, &settings, |_, _| true)?.steps;
        fit.settle(&x);
        scale *= shrink;
    }
    Some((steps, x))
}

/// Nine tenths of the samples inside the bands deviate by no more than this, mm.
fn spread(fit: &SweepFit<'_>) -> f64 {
    let mut sizes: Vec<f64> = fit.samples.iter().filter(|s| s.inside).map(|s| s.deviation.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() * 9 / 10).copied().unwrap_or(0.0)
}
