//! Fits one strip: start, least squares with falling fairness, then the least largest error.

use super::assess::{Stance, gouge_beside, survey};
use super::chart::Chart;
use super::fit::{FitWeights, SphereFamily, StripFit, StripSpec};
use super::fitted::{Effort, FittedStrip, Look, Resolution, StripError};
use super::limits::{Limits, UNCUT};
use super::polish::Setting;
use super::rails::Rails;
use super::refine::{Judged, held, judged, refine};
use super::start::{Band, StripStart, start_strip};
use super::touch::Probe;
use crate::optimize::{Settings, minimize};
use crate::tool::Tool;
use std::cell::LazyCell;

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

/// How a strip is sought.
#[derive(Clone, Copy)]
struct Attempt {
    /// Weight of what ties the rails to their borders and times; as loosely as coverage allows: it costs accuracy.
    anchor: f64,
    /// Slanted rulings may need all of the flank; straight ones leave it some length to cover the band with.
    slanted: bool,
    /// Least squares before the refinement: what it needs where rulings alone are far off, and no help where fairness
    /// would pull the rails out of a winding band.
    settled: bool,
    /// How many times as many steps least squares takes.
    patience: usize,
}

/// Rulings refined as they lie come first where the tolerance decides and they promise to hold it once lifted, straight ones, which
/// leave the flank more to spare, before slanted ones.
const ATTEMPTS: [Attempt; 6] = [
    Attempt { anchor: 0.0, slanted: false, settled: false, patience: 1 },
    Attempt { anchor: 0.0, slanted: true, settled: false, patience: 1 },
    Attempt { anchor: 1e-5, slanted: true, settled: true, patience: 1 },
    Attempt { anchor: 1e-4, slanted: true, settled: true, patience: PATIENCE },
    Attempt { anchor: 1e-3, slanted: false, settled: true, patience: PATIENCE },
    Attempt { anchor: 1e-2, slanted: false, settled: true, patience: PATIENCE },
];
/// Share of the limits at which such a strip is good enough.
const LAID_ENOUGH: f64 = 0.7;
/// How many times the angle over which a flank of its length may tilt within its limits it may turn to lead what is above
/// it out of the part, and the angle that it may always turn, radians.
const TURNED: f64 = 10.0;
const LEAST_TURN: f64 = 0.1;
/// Of the rulings one in so many is looked at.
const LOOKED_AT: usize = 4;
/// Largest error of a ruling that touches at both ends over root mean square of its misfit: twice that of both sides
/// alike, 720^0.5 / 16.
const LAID_PEAK: f64 = 3.36;
/// How much more firmly a rail is held where it would leave part of the band uncut.
const FIRM: f64 = 300.0;
/// Weight of the same for a single sweep whose flank is only just long enough: no neighbour covers what it misses.
const TIGHT: f64 = 0.3;
/// Weight of a gouge beside the strip, against 1 for a deviation on it: nearly a constraint.
const CLEARANCE: f64 = 100.0;

/// Strain of a strip of several that finer rails may bring down to what is allowed.
const FINER: std::ops::RangeInclusive<f64> = 1.0..=5.0;
/// Largest variation of the deviation along the flank, as a share of that of all, at which the rails' freedom is what
/// holds the error up.
const RIPPLE: f64 = 0.4;
/// Most steps a stage of a fit takes once the plan is to end early: enough for a tool path that can be used.
const HURRIED: usize = 4;

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
    Ok(FittedStrip { motion, deviation, steps: 0, borders: band.borders, resolution: *resolution, look: Look::Coarse })
}

/// The rulings that the fit of a band starts from. Refused where none touches the part, or where what is above the flutes
/// stands in it.
pub(super) fn prepare_strip(
    chart: &Chart<'_>,
    family: &SphereFamily,
    band: &Band,
    limits: &Limits,
) -> Result<StripStart, StripError> {
    let start = start_strip(chart, family, family.lowest(), band).ok_or(StripError::NoStart)?;
    stands_clear(chart, family, limits, &start).map(|()| start)
}

/// Fits the motion of `tool` over the band of `chart`, from its rulings. Rails are tied to their borders as loosely as
/// coverage allows: what ties them costs accuracy.
pub(super) fn fit_strip(
    chart: &Chart<'_>,
    tool: &Tool,
    family: &SphereFamily,
    (band, start): (&Band, &StripStart),
    (resolution, limits): (&Resolution, &Limits),
    effort: &Effort<'_>,
) -> Result<FittedStrip, StripError> {
    let setting = Setting { chart, tool, family, borders: &band.borders, limits };
    let straight = LazyCell::new(|| prepare_strip(chart, family, &Band { slanted: false, ..*band }, limits));
    let strain = |found: &Result<FittedStrip, StripError>| {
        found.as_ref().map_or(f64::INFINITY, |strip| limits.strain(&strip.deviation))
    };
    let (mut best, mut hopeless) = (Err(StripError::BrokeDown), 0);
    for attempt in ATTEMPTS.into_iter().filter(|attempt| attempt.settled || effort.tolerant) {
        let start = if attempt.slanted { Ok(start) } else { straight.as_ref().map_err(StripError::clone) };
        let promises = |start: &StripStart| LAID_PEAK * start.misfit + start.crowded < limits.mean();
        if !attempt.settled && !start.as_ref().is_ok_and(|start| promises(start)) {
            continue;
        }
        let effort = Effort { enough: if attempt.settled { effort.enough } else { LAID_ENOUGH }, ..*effort };
        let found = start.and_then(|start| attempt_strip(setting, (band, start), resolution, (&attempt, &effort)));
        // What rulings alone lead to stands only where it is good enough, and what leaves part of its band uncut only where
        // nothing else is found.
        let stands = strain(&found) <= if attempt.settled { UNCUT } else { 1.0 };
        hopeless += usize::from(found.as_ref().is_err_and(StripError::is_hopeless));
        if best.is_err() || strain(&found) < strain(&best) {
            best = found;
        }
        if stands || hopeless > 1 {
            break;
        }
    }
    let best = match best {
        Ok(strip) if FINER.contains(&limits.strain(&strip.deviation)) && !effort.observer.stopped() => {
            let finer = finer_strip(setting, (start, &strip), effort);
            Ok(finer.filter(|finer| limits.strain(&finer.deviation) < limits.strain(&strip.deviation)).unwrap_or(strip))
        }
        best => best,
    };
    best.map(|strip| if effort.tolerant { held(setting, strip, effort) } else { strip })
}

/// A strip once more with twice the pieces in its rails: what a part's finest shape asks for at some places only.
fn finer_strip(
    setting: Setting<'_>,
    (start, strip): (&StripStart, &FittedStrip),
    effort: &Effort<'_>,
) -> Option<FittedStrip> {
    let resolution = strip.resolution.finer(2);
    if resolution.controls == strip.resolution.controls {
        return None;
    }
    let (rails, x) = Rails::of(&strip.motion);
    let start = along(start, &Settled { rails, x, steps: 0 }, resolution.instants)?;
    let weights = FitWeights { extension: 0.0, anchor: 0.0, firm: 0.0, fairness: 0.0, clearance: 0.0 };
    let at = settle(setting, (&start, &resolution), (&weights, &[]), (1, effort)).ok()?;
    let found = judged(setting, &at.rails, at.x.clone(), &resolution);
    let refined = refine(setting, &at.rails, standing(found, at.x), &resolution, effort).ok()?;
    Some(FittedStrip { steps: strip.steps + refined.steps, ..refined })
}

/// Refuses rulings under which shank or holder stand so deep in the part that no turn that the flank can take, still
/// touching it, leads them out.
fn stands_clear(
    chart: &Chart<'_>,
    family: &SphereFamily,
    limits: &Limits,
    start: &StripStart,
) -> Result<(), StripError> {
    let spec = &start.spec;
    let lower_height = family.lowest();
    let turn = (TURNED * (limits.overcut + limits.undercut) / (family.highest() - lower_height)).max(LEAST_TURN);
    for ((lower, upper), (from, to)) in
        start.rulings.iter().zip(spec.lower_time.iter().zip(&spec.upper_time)).step_by(LOOKED_AT)
    {
        let feet = [(spec.low, *from), (spec.high, *to)];
        let stance = Stance { lower: *lower, upper: *upper, lower_height, feet };
        let gouge = gouge_beside(chart, family, &stance).ok_or(StripError::BrokeDown)?;
        if gouge.depth > turn * (gouge.height - lower_height).abs() {
            return Err(StripError::Body(gouge));
        }
    }
    Ok(())
}

/// Rails where least squares or the rulings left them.
struct Settled {
    rails: Rails,
    x: Vec<f64>,
    steps: usize,
}

fn attempt_strip(
    setting: Setting<'_>,
    (band, start): (&Band, &StripStart),
    resolution: &Resolution,
    (attempt, effort): (&Attempt, &Effort<'_>),
) -> Result<FittedStrip, StripError> {
    let tight = band.borders.low > band.low && band.low <= 0.0 && band.high >= 1.0;
    let anchor = attempt.anchor;
    let firm = if tight { TIGHT } else { FIRM * anchor };
    let weights = FitWeights { extension: 0.3, anchor, firm, fairness: effort.fairness, clearance: CLEARANCE };
    let stages = if attempt.settled { STAGES.as_slice() } else { &[] };
    let mut at = settle(setting, (start, resolution), (&weights, stages), (attempt.patience, effort))?;
    let (mut resolution, mut steps) = (*resolution, at.steps);
    let mut found = judged(setting, &at.rails, at.x.clone(), &resolution);
    // Narrow strips are held up by the shape of the tool.
    let alone = setting.alone() && attempt.settled;
    if let Some(times) = held_by_rails(setting, &found, effort).filter(|_| alone) {
        resolution = resolution.finer(times);
        let start = along(start, &at, resolution.instants).ok_or(StripError::BrokeDown)?;
        at = settle(setting, (&start, &resolution), (&weights, &[]), (attempt.patience, effort))?;
        steps += at.steps;
        found = judged(setting, &at.rails, at.x.clone(), &resolution);
    }
    let refined = refine(setting, &at.rails, standing(found, at.x), &resolution, effort)?;
    Ok(FittedStrip { steps: steps + refined.steps, ..refined })
}

/// Rails through the rulings of `start`, then least squares in `stages`.
fn settle(
    setting: Setting<'_>,
    (start, resolution): (&StripStart, &Resolution),
    (weights, stages): (&FitWeights, &[Stage]),
    (patience, effort): (usize, &Effort<'_>),
) -> Result<Settled, StripError> {
    let (chart, family) = (setting.chart, setting.family);
    let mut fit = StripFit::new(chart, family, &start.spec, resolution.controls, resolution.heights, *weights)
        .ok_or(StripError::BrokeDown)?;
    let mut steps = 0;
    let mut x = fit.start(&start.rulings).ok_or(StripError::BrokeDown)?;
    for Stage { fairness, anchor, extension, most } in stages {
        fit.weights.fairness = weights.fairness * fairness;
        fit.weights.anchor = weights.anchor * anchor;
        fit.weights.extension = weights.extension * extension;
        let max_steps = if effort.observer.stopped() { *most.min(&HURRIED) } else { most * patience };
        let settings = Settings { max_steps, cost_share: 1e-3 / patience.pow(3) as f64, damping: 1e-4 };
        steps += minimize(&mut fit, &mut x, &settings).ok_or(StripError::BrokeDown)?.steps;
        fit.recount();
    }
    Ok(Settled { rails: fit.rails().clone(), x, steps })
}

/// What a refinement starts from: what was judged, or where it could not be judged.
fn standing(found: Result<Judged, StripError>, x: Vec<f64>) -> (Vec<f64>, Result<FittedStrip, StripError>) {
    match found {
        Ok(Judged { x, strip, .. }) => (x, Ok(strip)),
        Err(error) => (x, Err(error)),
    }
}

/// How many times as many pieces the rails should have where errors that are still too large hardly vary along the flank,
/// but from instant to instant: there not the shape of the tool holds them up but the freedom of the rails, whose error
/// falls with the fourth power of their pieces.
fn held_by_rails(setting: Setting<'_>, found: &Result<Judged, StripError>, effort: &Effort<'_>) -> Option<usize> {
    let Ok(Judged { survey, .. }) = found else { return None };
    let excess = setting.limits.strain(&survey.worst) / effort.enough;
    if excess <= 1.0 || effort.observer.stopped() {
        return None;
    }
    let spread = survey.points.chunks(survey.heights).map(|points| {
        let over = points.iter().filter_map(|point| point.deviation);
        let (least, most) = over.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), e| (l.min(e), m.max(e)));
        most - least
    });
    let worst = survey.worst.overcut + survey.worst.undercut;
    (spread.fold(0.0, f64::max) < RIPPLE * worst).then(|| excess.powf(0.25).ceil() as usize)
}

/// Rulings at `instants` instants on rails that are there already.
fn along(start: &StripStart, at: &Settled, instants: usize) -> Option<StripStart> {
    let motion = at.rails.motion(&at.x)?;
    let (first, last) = motion.domain();
    let share = |j: usize| j as f64 / (instants - 1) as f64;
    let between = |values: &[f64]| -> Vec<f64> {
        let place = |j: usize| share(j) * (values.len() - 1) as f64;
        let value = |x: f64| {
            let i = (x as usize).min(values.len() - 2);
            values[i] + (x - i as f64) * (values[i + 1] - values[i])
        };
        (0..instants).map(|j| value(place(j))).collect()
    };
    let rulings = (0..instants).map(|j| {
        let t = first + (last - first) * share(j);
        (motion.lower.point(t), motion.upper.point(t))
    });
    let StripSpec { low, high, lower_time, upper_time } = &start.spec;
    let spec = StripSpec { low: *low, high: *high, lower_time: between(lower_time), upper_time: between(upper_time) };
    Some(StripStart { spec, rulings: rulings.collect(), ..*start })
}
