//! Fits one strip: start, least squares with falling fairness, then the least largest error.

use super::Observer;
use super::assess::{AssessError, Deviation, Survey, survey};
use super::chart::Chart;
use super::fit::{FitWeights, SphereFamily, StripFit};
use super::limits::Limits;
use super::polish::{Polish, Setting};
use super::rails::Rails;
use super::start::{Band, StripStart, start_strip};
use super::touch::Probe;
use crate::motion::RuledMotion;
use crate::optimize::minimax::{self, minimize_largest};
use crate::optimize::{Settings, minimize};
use crate::tool::Tool;

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

/// Factors of the fairness, one fit after another, and which share of the most steps each may take.
const STAGES: [(f64, usize); 5] = [(1e4, 4), (1e2, 4), (1.0, 2), (1e-2, 2), (1e-4, 1)];
/// Stage that a fit which goes on from an earlier one begins with.
const RESUMED: usize = 2;
/// How much more firmly a rail is held where it would leave part of the band uncut.
const FIRM: f64 = 300.0;
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
    /// Most linearizations toward the least largest error.
    pub(super) rounds: usize,
    /// Share of the limits below which errors are small enough.
    pub(super) enough: f64,
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
    let weights = FitWeights { extension: 0.0, anchor: 0.0, firm: 0.0, fairness: 0.0, clearance: 0.0 };
    let fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, weights)
        .ok_or(StripError::BrokeDown)?;
    let x = fit.start(&start.rulings).ok_or(StripError::BrokeDown)?;
    let motion = fit.rails().motion(&x).ok_or(StripError::BrokeDown)?;
    let dense = (resolution.instants * 4, resolution.heights * 2);
    let deviation = survey(&Probe { chart, tool, family, motion: &motion }, &band.borders, dense)?.worst;
    Ok(FittedStrip { motion, deviation, steps: 0 })
}

/// Fits the motion of `tool` over the band of `chart`, from where an earlier fit of about the same band ended, if there
/// is one. Rails are tied to their borders as loosely as coverage allows:
/// what ties them costs accuracy.
pub(super) fn fit_strip(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    (band, before): (&Band, Option<&FittedStrip>),
    goal: (&Resolution, &Limits),
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let start = start_strip(chart, family, family.lowest(), band).ok_or(StripError::NoStart)?;
    let mut last = Err(StripError::BrokeDown);
    for anchor in [1e-5, 1e-4, 1e-3, 1e-2] {
        let weights =
            FitWeights { extension: 0.3, anchor, firm: FIRM * anchor, fairness: effort.fairness, clearance: CLEARANCE };
        last = fit_anchored(chart, tool, family, (band, &start, before), goal, (weights, effort));
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
    (band, start, before): (&Band, &StripStart, Option<&FittedStrip>),
    (resolution, limits): (&Resolution, &Limits),
    (weights, effort): (FitWeights, &Effort<'_>),
) -> Result<FittedStrip, StripError> {
    let mut fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, weights)
        .ok_or(StripError::BrokeDown)?;
    let resumed = before.and_then(|strip| fit.rails().resume(&strip.motion));
    let fresh = resumed.is_none();
    let mut x = resumed.or_else(|| fit.start(&start.rulings)).ok_or(StripError::BrokeDown)?;
    let mut steps = 0;
    // Strong fairness first: it carries the rails past the places where the part's fine shape would trap them. Then
    // everything that is not the part itself gives way: what remains of it is the floor of the accuracy.
    for (i, (factor, share)) in STAGES.into_iter().enumerate().skip(if fresh { 0 } else { RESUMED }) {
        fit.weights.fairness = weights.fairness * factor;
        fit.weights.anchor = weights.anchor * factor.clamp(1e-2, 1.0);
        fit.weights.extension = weights.extension * factor.sqrt().clamp(1e-2, 1.0);
        let most = effort.steps / share;
        let max_steps = if effort.observer.stopped() { most.min(HURRIED) } else { most };
        let damping = if i == 0 { 1e-4 } else { 1e-8 };
        let settings = Settings { max_steps, cost_share: 1e-5, damping };
        steps += minimize(&mut fit, &mut x, &settings).ok_or(StripError::BrokeDown)?.steps;
        fit.recount();
    }
    let setting = Setting { chart, tool, family, borders: &band.borders, limits };
    let refined = refine(setting, fit.rails(), x, resolution, effort)?;
    Ok(FittedStrip { steps: steps + refined.steps, ..refined })
}

/// Dense judgements of one strip, each followed by more rounds over the points that stood out.
const JUDGEMENTS: usize = 4;
/// Share by which a point between those followed must stand out.
const OUTSTANDING: f64 = 1.005;
/// A step's roughness that costs as much as the error itself, as a multiple of the error.
const ROUGH: f64 = 1e3;
/// First trust region, as a multiple of the error.
const BOLD: f64 = 10.0;
/// Price of a trespass of the hard limits. Lifting a strip costs as much undercut as it spares overcut, so their
/// multipliers add up to about 1; a higher price would only punish what linearization leaves.
const PENALTY: f64 = 4.0;
/// Share of its error that a round must promise to gain.
const GAIN: f64 = 5e-3;
/// Smallest error that is still worked on, mm.
const RESOLUTION: f64 = 1e-9;

/// Carries a strip from where least squares left it to the least largest error of its true envelope.
fn refine(
    setting: Setting<'_>,
    rails: &Rails,
    mut x: Vec<f64>,
    resolution: &Resolution,
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let limits = setting.limits;
    let judge = |x: &[f64], steps: usize| -> Result<(FittedStrip, Survey), StripError> {
        let motion = rails.motion(x).ok_or(StripError::BrokeDown)?;
        let dense = (resolution.instants * 4, resolution.heights * 2);
        let survey = survey(&setting.probe(&motion), setting.borders, dense)?;
        Ok((FittedStrip { motion, deviation: survey.worst, steps }, survey))
    };
    // Least squares may leave a border uncovered, which the refinement then covers.
    let mut best = judge(&x, 0).map(|(strip, _)| strip);
    let followed = (2 * resolution.instants - 1, resolution.heights);
    let Some(mut polish) = Polish::new(setting, rails, &x, followed) else { return best };
    let mut rounds = 0;
    for _ in 0..JUDGEMENTS {
        let enough = best.as_ref().is_ok_and(|strip| limits.strain(&strip.deviation) < effort.enough);
        if enough || rounds >= effort.rounds || best.is_ok() && effort.observer.stopped() {
            break;
        }
        let Some(worst) = polish.worst(&x) else { break };
        polish.price = limits.strain_of(worst) / (ROUGH * worst.abs().max(RESOLUTION)).powi(2);
        let settings = minimax::Settings {
            max_rounds: effort.rounds - rounds,
            enough: 0.9 * effort.enough,
            radius: BOLD * worst.abs().max(RESOLUTION),
            penalty: PENALTY,
            gain_share: GAIN,
            ..minimax::Settings::default()
        };
        let Some(outcome) = minimize_largest(&mut polish, &mut x, &settings) else { break };
        rounds += outcome.rounds;
        let (candidate, survey) = match judge(&x, rounds) {
            Ok(judged) => judged,
            Err(error) => return best.or(Err(error)),
        };
        let strain = limits.strain(&candidate.deviation);
        if best.as_ref().map_or(f64::INFINITY, |best| limits.strain(&best.deviation)) > strain {
            best = Ok(candidate);
        }
        if !polish.follow(&survey, OUTSTANDING * outcome.tau) {
            break;
        }
    }
    best
}
