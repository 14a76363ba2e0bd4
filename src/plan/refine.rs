//! Carries a strip from where least squares left it to the least largest error of its true envelope, judged densely on the
//! way.

use super::assess::{Survey, survey};
use super::fitted::{Effort, FittedStrip, Look, Resolution, StripError};
use super::lift::{after, lift, lifted};
use super::polish::{Polish, Setting};
use super::rails::Rails;
use crate::optimize::minimax::{self, minimize_largest};

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
/// Share of its strain that a strip must be left with to be lifted.
const LIFTED: f64 = 0.9;
/// Strain beyond which no lift helps: something beside the flank is in the way, from which the tool must turn.
const WITHIN_REACH: f64 = 3.0;
/// How many times as densely along and across a strip is looked at in the end.
const AUDIT: (usize, usize) = (2, 2);
/// What a flank may then stop short of its border by, mm: the overlap that its border includes is many times as wide.
const SLIGHT: f64 = 2e-3;
/// Share of the overcut limit to which a strip is lifted whose overcut is close to it.
const HELD: f64 = 0.85;
/// Share of a limit beyond which an error is close to it: between the points looked at it may pass it.
pub(super) const CLOSE: f64 = 0.93;
/// Strain up to which it is enough to foresee from the points looked at what lies between them.
const SURE: f64 = 0.9;
/// Share of its error that a round must promise to gain.
const GAIN: f64 = 5e-3;

impl Setting<'_> {
    /// How much a strip strains its limits; an axis that the machine does not make is worth less than any error.
    pub(super) fn strain(&self, strip: &FittedStrip) -> f64 {
        let left = self.family.bound().is_some_and(|bound| bound.is_left(&strip.motion));
        self.limits.strain(&strip.deviation) + if left { UNMADE } else { 0.0 }
    }
}

/// The strip that unknowns stand for, judged densely.
pub(super) fn judge(
    setting: Setting<'_>,
    rails: &Rails,
    x: &[f64],
    resolution: &Resolution,
) -> Result<(FittedStrip, Survey), StripError> {
    judge_more(setting, rails, x, (resolution, (1, 1)))
}

/// The same so many times as densely along and across.
fn judge_more(
    setting: Setting<'_>,
    rails: &Rails,
    x: &[f64],
    (resolution, times): (&Resolution, (usize, usize)),
) -> Result<(FittedStrip, Survey), StripError> {
    let motion = rails.motion(x).ok_or(StripError::BrokeDown)?;
    let dense = (resolution.instants * 4 * times.0, resolution.heights * 2 * times.1);
    let survey = survey(&setting.probe(&motion), setting.borders, dense)?;
    let (borders, resolution) = (*setting.borders, *resolution);
    let mut deviation = survey.worst;
    let audit = times == AUDIT;
    if audit {
        deviation.bare = deviation.bare.filter(|bare| bare.width > SLIGHT);
    }
    let look = if audit || setting.limits.feared(&survey) < SURE { Look::Dense } else { Look::Coarse };
    Ok((FittedStrip { motion, deviation, steps: 0, borders, resolution, look }, survey))
}

/// The strip that unknowns stand for, judged as densely as it takes to tell whether its limits are strained more than
/// `bearable`.
pub(super) fn judge_surely(
    setting: Setting<'_>,
    rails: &Rails,
    x: &[f64],
    (resolution, bearable): (&Resolution, f64),
) -> Result<(FittedStrip, Survey), StripError> {
    let seen = judge(setting, rails, x, resolution)?;
    match matches!(seen.0.look, Look::Dense) || setting.strain(&seen.0) > bearable {
        true => Ok(seen),
        false => judge_more(setting, rails, x, (resolution, AUDIT)),
    }
}

/// A finished strip looked at more densely than while it was fitted, and lifted by what it then trespasses of its limits, or
/// comes too close to that of overcut, where that helps.
pub(super) fn audited(setting: Setting<'_>, strip: FittedStrip) -> FittedStrip {
    let strip = match strip.look {
        Look::Dense => return strip,
        Look::Followed(strip) => return *strip,
        Look::Coarse => strip,
    };
    let (rails, x) = Rails::of(&strip.motion);
    let look = |x: &[f64]| judge_more(setting, &rails, x, (&strip.resolution, AUDIT)).ok();
    let Some((seen, _)) = look(&x) else { return strip };
    let seen = FittedStrip { steps: strip.steps, ..seen };
    let limits = setting.limits;
    let deep = seen.deviation.overcut.max(seen.deviation.outside);
    let enough = deep - HELD * limits.overcut;
    let holds = limits.strain(&after(&seen.deviation, enough)) <= 1.0;
    let (trespasses, close) = (limits.strain(&seen.deviation) > 1.0, deep > CLOSE * limits.overcut);
    if !(trespasses || close && holds) {
        return seen;
    }
    let by = if holds { enough } else { lift(&seen.deviation, limits) };
    let Some((higher, _)) = lifted(setting.chart, &x, by).and_then(|x| look(&x)) else { return seen };
    let better = setting.strain(&higher) < if trespasses { setting.strain(&seen) } else { 1.0 };
    if better { FittedStrip { steps: strip.steps, ..higher } } else { seen }
}

/// A strip that holds its limits where it was looked at, refined over more points where a denser look finds that it does
/// not and no lift helps: where the part's edge is sharp its envelope may rise steeply between two instants.
pub(super) fn held(setting: Setting<'_>, strip: FittedStrip, effort: &Effort<'_>) -> FittedStrip {
    let misses = |strip: &FittedStrip| setting.limits.strain(&strip.deviation) > 1.0;
    if misses(&strip) {
        return strip;
    }
    let seen = audited(setting, strip.clone());
    if !misses(&seen) {
        return FittedStrip { look: Look::Followed(Box::new(seen)), ..strip };
    }
    let (rails, x) = Rails::of(&strip.motion);
    let FittedStrip { steps, resolution, .. } = strip;
    let (instants, heights) = (AUDIT.0 * resolution.instants, AUDIT.1 * resolution.heights);
    let dense = Resolution { instants, heights, ..resolution };
    let refined =
        judge(setting, &rails, &x, &dense).and_then(|(seen, _)| refine(setting, &rails, (x, Ok(seen)), &dense, effort));
    let look = Look::Dense;
    refined.map_or(strip, |refined| FittedStrip { steps: steps + refined.steps, resolution, look, ..refined })
}

/// A strip as it was judged: its unknowns, what came of them, and the points that tell.
pub(super) struct Judged {
    pub(super) x: Vec<f64>,
    pub(super) strip: FittedStrip,
    pub(super) survey: Survey,
}

/// The strip that unknowns stand for, or the same lifted where it then strains its limits clearly less. A single sweep is
/// fitted closely enough without.
pub(super) fn judged(
    setting: Setting<'_>,
    rails: &Rails,
    x: Vec<f64>,
    resolution: &Resolution,
) -> Result<Judged, StripError> {
    let (strip, survey) = judge(setting, rails, &x, resolution)?;
    let by = lift(&strip.deviation, setting.limits);
    let clearly = (LIFTED * setting.limits.strain(&strip.deviation)).min(WITHIN_REACH);
    if !setting.alone()
        && setting.limits.strain(&after(&strip.deviation, by)) < clearly
        && let Some(x) = lifted(setting.chart, &x, by)
        && let Ok((lifted, survey)) = judge(setting, rails, &x, resolution)
        && setting.strain(&lifted) < setting.strain(&strip)
    {
        return Ok(Judged { x, strip: lifted, survey });
    }
    Ok(Judged { x, strip, survey })
}

/// Carries a strip from where least squares left it, judged, to the least largest error of its true envelope. Least squares
/// may leave a border uncovered, which this then covers.
pub(super) fn refine(
    setting: Setting<'_>,
    rails: &Rails,
    (mut x, mut best): (Vec<f64>, Result<FittedStrip, StripError>),
    resolution: &Resolution,
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let strain = |strip: &FittedStrip| setting.strain(strip);
    let followed = (2 * resolution.instants - 1, resolution.heights);
    let Some(mut polish) = Polish::new(setting, rails, &x, followed) else { return best };
    let (mut rounds, mut short_by) = (0, 0.0);
    for _ in 0..JUDGEMENTS {
        let enough = best.as_ref().is_ok_and(|strip: &FittedStrip| strain(strip) < effort.enough);
        // What does not cover its band yet is no plan at all: it may take longer.
        let covers = best.as_ref().is_ok_and(|strip| strip.deviation.bare.is_none());
        let most = if covers { effort.rounds } else { 2 * effort.rounds };
        if enough || rounds >= most || covers && effort.observer.stopped() {
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
        let (candidate, survey) = match judged(setting, rails, x, resolution) {
            Ok(judged) => {
                x = judged.x;
                (judged.strip, judged.survey)
            }
            Err(error) => return best.or(Err(error)),
        };
        if best.as_ref().map_or(true, |best| strain(&candidate) < strain(best)) {
            best = Ok(FittedStrip { steps: rounds, ..candidate });
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
