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

/// One least-squares fit of several.
struct Stage {
    /// Factor of the fairness.
    fairness: f64,
    /// Factor of what ties the rails to their borders and times.
    anchor: f64,
    /// Factor of what holds the motion beside the part.
    extension: f64,
    /// Most steps.
    most: usize,
}

/// Strong fairness first: it carries the rails past the places where the part's fine shape would trap them. Then
/// everything that is not the part itself gives way: what remains of it is the floor of the accuracy.
const STAGES: [Stage; 5] = [
    Stage { fairness: 1e4, anchor: 1.0, extension: 1.0, most: 4 },
    Stage { fairness: 1e2, anchor: 1.0, extension: 1.0, most: 4 },
    Stage { fairness: 1.0, anchor: 1.0, extension: 1.0, most: 8 },
    Stage { fairness: 1e-2, anchor: 0.1, extension: 0.01, most: 8 },
    Stage { fairness: 1e-4, anchor: 0.1, extension: 0.01, most: 8 },
];
/// How many times as many steps a later attempt takes.
const PATIENCE: usize = 4;
/// Attempt from which on rulings are straight.
const STRAIGHTENED: usize = 2;
/// How much more firmly a rail is held where it would leave part of the band uncut.
const FIRM: f64 = 300.0;
/// Weight of the same for a single sweep whose flank is only just long enough: no neighbour covers what it misses.
const TIGHT: f64 = 0.3;
/// Weight of a gouge beside the strip, against 1 for a deviation on it: nearly a constraint.
const CLEARANCE: f64 = 100.0;

/// Most steps a stage of a fit takes once the plan is to end early: enough for a tool path that can be used.
const HURRIED: usize = 4;

/// How the optimizer works on a strip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort<'a> {
    /// Weight of second differences.
    pub(super) fairness: f64,
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
    let deviation = survey(&Probe { chart, tool, family, motion: &motion }, &band.borders, dense)?.whole()?;
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
    let start_of = |band: &Band| start_strip(chart, family, family.lowest(), band).ok_or(StripError::NoStart);
    let mut start = start_of(band)?;
    let mut last = Err(StripError::BrokeDown);
    for (attempt, anchor) in [1e-5, 1e-4, 1e-3, 1e-2].into_iter().enumerate() {
        if attempt == STRAIGHTENED {
            // Slanted rulings may need all of the flank; straight ones leave it some length to cover the band with.
            start = start_of(&Band { slanted: false, ..*band })?;
        }
        let tight = band.borders.low > band.low && band.low <= 0.0 && band.high >= 1.0;
        let firm = if tight { TIGHT } else { FIRM * anchor };
        let weights = FitWeights { extension: 0.3, anchor, firm, fairness: effort.fairness, clearance: CLEARANCE };
        let patience = if attempt == 0 { 1 } else { PATIENCE };
        last = fit_anchored(chart, tool, family, (band, &start), goal, (weights, patience, effort));
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
    (weights, patience, effort): (FitWeights, usize, &Effort<'_>),
) -> Result<FittedStrip, StripError> {
    let mut fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, weights)
        .ok_or(StripError::BrokeDown)?;
    let mut steps = 0;
    let setting = Setting { chart, tool, family, borders: &band.borders, limits };
    let mut x = fit.start(&start.rulings).ok_or(StripError::BrokeDown)?;
    for Stage { fairness, anchor, extension, most } in STAGES {
        fit.weights.fairness = weights.fairness * fairness;
        fit.weights.anchor = weights.anchor * anchor;
        fit.weights.extension = weights.extension * extension;
        let max_steps = if effort.observer.stopped() { most.min(HURRIED) } else { most * patience };
        let settings = Settings { max_steps, cost_share: 1e-3 / patience.pow(3) as f64, damping: 1e-4 };
        steps += minimize(&mut fit, &mut x, &settings).ok_or(StripError::BrokeDown)?.steps;
        fit.recount();
    }
    let refined = refine(setting, fit.rails(), x, resolution, effort)?;
    Ok(FittedStrip { steps: steps + refined.steps, ..refined })
}

/// Dense judgements of one strip, each followed by more rounds over the points that stood out.
const JUDGEMENTS: usize = 6;
/// How far a point between those followed must stand out.
const OUTSTANDING: f64 = 1.08;
/// Price of a trespass of the hard limits. Lifting a strip costs as much undercut as it spares overcut, so their
/// multipliers add up to about 1; a higher price would only punish what linearization leaves.
const PENALTY: f64 = 4.0;
/// Strain that an axis beyond the machine's directions counts with.
const UNMADE: f64 = 1e6;
/// Share of a trespass that must be left for further rounds to be given up.
const STUCK: f64 = 0.95;
/// Share of its error that a round must promise to gain.
const GAIN: f64 = 5e-3;

/// The strip that unknowns stand for, judged densely, if it covers its band.
fn judge(
    setting: Setting<'_>,
    rails: &Rails,
    x: &[f64],
    resolution: &Resolution,
) -> Result<(Result<FittedStrip, StripError>, Survey), StripError> {
    let motion = rails.motion(x).ok_or(StripError::BrokeDown)?;
    let dense = (resolution.instants * 4, resolution.heights * 2);
    let survey = survey(&setting.probe(&motion), setting.borders, dense)?;
    let strip = survey.whole().map(|deviation| FittedStrip { motion, deviation, steps: 0 });
    Ok((strip.map_err(StripError::from), survey))
}

/// Carries a strip from where least squares left it to the least largest error of its true envelope.
fn refine(
    setting: Setting<'_>,
    rails: &Rails,
    mut x: Vec<f64>,
    resolution: &Resolution,
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let limits = setting.limits;
    // An axis that the machine does not make is worth less than any error.
    let strain = |strip: &FittedStrip| {
        let left = setting.family.bound().is_some_and(|bound| bound.is_left(&strip.motion));
        limits.strain(&strip.deviation) + if left { UNMADE } else { 0.0 }
    };
    let followed = (2 * resolution.instants - 1, resolution.heights);
    // Least squares may leave a border uncovered, which the refinement then covers.
    let mut best = judge(setting, rails, &x, resolution).and_then(|(strip, _)| strip);
    let Some(mut polish) = Polish::new(setting, rails, &x, followed) else { return best };
    let (mut rounds, mut short_by) = (0, 0.0);
    for _ in 0..JUDGEMENTS {
        let enough = best.as_ref().is_ok_and(|strip: &FittedStrip| strain(strip) < effort.enough);
        // What does not cover its band yet is no plan at all: it may take longer.
        let most = if best.is_ok() { effort.rounds } else { 2 * effort.rounds };
        if enough || rounds >= most || best.is_ok() && effort.observer.stopped() {
            break;
        }
        let Some(radius) = polish.ready(&x) else { break };
        let settings = minimax::Settings {
            max_rounds: (most - rounds).min(effort.rounds.div_ceil(2)),
            enough: 0.9 * effort.enough,
            radius,
            penalty: PENALTY,
            gain_share: GAIN,
            ..minimax::Settings::default()
        };
        let Some(outcome) = minimize_largest(&mut polish, &mut x, &settings) else { break };
        rounds += outcome.rounds;
        let (candidate, survey) = match judge(setting, rails, &x, resolution) {
            Ok(judged) => judged,
            Err(error) => return best.or(Err(error)),
        };
        let of = |found: &Result<FittedStrip, StripError>| found.as_ref().map_or(f64::INFINITY, strain);
        if best.is_err() || of(&candidate) < of(&best) {
            best = candidate.map(|strip| FittedStrip { steps: rounds, ..strip });
        }
        // What stays short by as much as before will do so again.
        let stuck = short_by > 0.0 && outcome.trespass > STUCK * short_by;
        short_by = outcome.trespass;
        if stuck || !polish.follow(&survey, OUTSTANDING * outcome.tau) {
            break;
        }
    }
    best
}
