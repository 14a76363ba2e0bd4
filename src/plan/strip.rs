//! Fits one strip: start, least squares with falling fairness, then reweighting toward the least largest error.

use super::Observer;
use super::assess::{AssessError, Deviation, assess};
use super::chart::Chart;
use super::fit::{FitWeights, SphereFamily, StripFit};
use super::start::{Band, StripStart, start_strip};
use crate::motion::RuledMotion;
use crate::optimize::{Settings, minimize};
use crate::tool::Tool;

/// What a strip's deviation should stay below, mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Below the surface.
    pub(super) overcut: f64,
    /// Above the surface.
    pub(super) undercut: f64,
}

impl Limits {
    /// Largest of both errors, each as a share of its limit.
    pub(super) fn strain(&self, deviation: &Deviation) -> f64 {
        (deviation.overcut.max(deviation.outside) / self.overcut).max(deviation.undercut / self.undercut)
    }
}

/// How finely a strip is modelled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Resolution {
    /// Control points a rail.
    pub(super) controls: usize,
    /// Instants at which the fit looks, at least twice the control points.
    pub(super) instants: usize,
    /// Heights at which it looks.
    pub(super) heights: usize,
}

/// A fitted strip.
#[derive(Clone, Debug)]
pub(super) struct FittedStrip {
    /// The tool's motion.
    pub(super) motion: RuledMotion,
    /// Its envelope's deviation, sampled densely.
    pub(super) deviation: Deviation,
    /// Steps of the optimizer.
    pub(super) steps: usize,
}

/// Why a strip could not be fitted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum StripError {
    /// No rulings to start from.
    #[error("no ruling of the tool touches the part along the whole strip without its rails turning back")]
    NoStart,
    /// The fit broke down.
    #[error("the fit broke down; the part is too curved for this tool at this strip width")]
    BrokeDown,
    /// The fitted motion has no proper envelope.
    #[error("the fitted motion has no envelope: {0}")]
    Envelope(#[from] AssessError),
}

/// Weight of a gouge beside the strip, against 1 for a deviation on it: nearly a constraint.
const CLEARANCE: f64 = 100.0;

/// Most steps a stage of a fit takes once the plan is to end early: enough for a tool path that can be used.
const HURRIED: usize = 4;

/// How the optimizer works on a strip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort<'a> {
    /// Weight of second differences.
    pub(super) fairness: f64,
    /// Most steps of the first fit at its final fairness.
    pub(super) steps: usize,
    /// Most rounds of reweighting.
    pub(super) rounds: usize,
    /// May end the work early.
    pub(super) observer: &'a dyn Observer,
}

/// Lays the tool on rulings across the band, both end spheres touching, and optimizes nothing.
pub(super) fn lay_strip(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    band: &Band,
    resolution: &Resolution,
) -> Result<FittedStrip, StripError> {
    let start = start_strip(chart, family, family.lowest(), band).ok_or(StripError::NoStart)?;
    let weights = FitWeights { extension: 0.0, anchor: 0.0, fairness: 0.0, clearance: 0.0 };
    let fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, weights)
        .ok_or(StripError::BrokeDown)?;
    let x = fit.start(&start.rulings).ok_or(StripError::BrokeDown)?;
    let motion = fit.motion(&x).ok_or(StripError::BrokeDown)?;
    let dense = (resolution.instants * 4, resolution.heights * 2);
    let deviation = assess(chart, tool, family, (&motion, &band.borders), dense)?;
    Ok(FittedStrip { motion, deviation, steps: 0 })
}

/// Fits the motion of `tool` over the band of `chart`. Rails are tied to their borders as loosely as coverage allows:
/// what ties them costs accuracy.
pub(super) fn fit_strip(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    band: &Band,
    goal: (&Resolution, &Limits),
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let start = start_strip(chart, family, family.lowest(), band).ok_or(StripError::NoStart)?;
    let mut last = Err(StripError::BrokeDown);
    for anchor in [1e-5, 1e-4, 1e-3, 1e-2] {
        let weights = FitWeights { extension: 0.3, anchor, fairness: effort.fairness, clearance: CLEARANCE };
        last = fit_anchored(chart, tool, family, (band, &start), goal, (weights, effort));
        if last.is_ok() {
            break;
        }
    }
    last
}

fn fit_anchored(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    (band, start): (&Band, &StripStart),
    (resolution, limits): (&Resolution, &Limits),
    (weights, effort): (FitWeights, &Effort<'_>),
) -> Result<FittedStrip, StripError> {
    let mut fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, weights)
        .ok_or(StripError::BrokeDown)?;
    let mut x = fit.start(&start.rulings).ok_or(StripError::BrokeDown)?;
    let mut steps = 0;
    // Strong fairness first: it carries the rails past the places where the part's fine shape would trap them.
    for (factor, max_steps) in [(1e4, effort.steps / 4), (1e2, effort.steps / 4), (1.0, effort.steps)] {
        fit.weights.fairness = weights.fairness * factor;
        let max_steps = if effort.observer.stopped() { max_steps.min(HURRIED) } else { max_steps };
        let settings = Settings { max_steps, cost_share: 1e-5, ..Settings::default() };
        steps += minimize(&mut fit, &mut x, &settings).ok_or(StripError::BrokeDown)?.steps;
        fit.recount();
    }
    let judge = |fit: &StripFit<'_>, x: &[f64]| -> Result<FittedStrip, StripError> {
        let motion = fit.motion(x).ok_or(StripError::BrokeDown)?;
        let dense = (resolution.instants * 4, resolution.heights * 2);
        let deviation = assess(chart, tool, family, (&motion, &band.borders), dense)?;
        Ok(FittedStrip { motion, deviation, steps: 0 })
    };
    let mut best = judge(&fit, &x)?;
    let mut gouge = best.deviation.outside;
    for _ in 0..effort.rounds {
        if limits.strain(&best.deviation) < 0.4 || effort.observer.stopped() {
            break;
        }
        fit.recount();
        reweight(&mut fit, limits);
        if gouge > 0.3 * limits.overcut {
            fit.weights.clearance *= 3.0;
        }
        let settings = Settings { max_steps: 6, cost_share: 1e-4, ..Settings::default() };
        let Some(outcome) = minimize(&mut fit, &mut x, &settings) else { break };
        steps += outcome.steps;
        let Ok(candidate) = judge(&fit, &x) else { break };
        gouge = candidate.deviation.outside;
        if limits.strain(&candidate.deviation) < limits.strain(&best.deviation) {
            best = candidate;
        }
    }
    best.steps = steps;
    Ok(best)
}

/// Lawson's rule for the least largest error: samples gain weight with their error. Deviations are measured from the
/// middle of what the limits allow, as far as the present spread needs it.
fn reweight(fit: &mut StripFit<'_>, limits: &Limits) {
    let inside = || fit.deviations.iter().filter(|s| s.inside).map(|s| s.deviation);
    let (low, high) = inside().fold((0.0_f64, 0.0_f64), |(l, h), e| (l.min(e), h.max(e)));
    // Where the band [low, high] of width w should lie so that both ends strain their limits equally.
    let middle = (high - low) * (limits.undercut - limits.overcut) / (2.0 * (limits.undercut + limits.overcut));
    fit.target = middle;
    let largest = inside().map(|e| (e - middle).abs()).fold(1e-12, f64::max);
    let (mut sum, mut count) = (0.0, 0);
    for (weight, sample) in fit.sample_weights.iter_mut().zip(&fit.deviations) {
        if sample.inside {
            *weight *= 0.25 + (sample.deviation - middle).abs() / largest;
            sum += *weight;
            count += 1;
        }
    }
    let scale = f64::from(count) / sum;
    for (weight, sample) in fit.sample_weights.iter_mut().zip(&fit.deviations) {
        if sample.inside {
            *weight = (*weight * scale).max(1e-3);
        }
    }
}
