//! Divides the surface into strips, fits them, and joins them into one path.

use super::bands::Bands;
use super::chart::Chart;
use super::counts::{Range, fewest};
use super::fit::SphereFamily;
use super::fitted::{Effort, FittedStrip, Resolution, StripError};
use super::forecast::{bare_error, evened, evened_ahead, strip_error};
use super::join::joined;
use super::laid::{Gap, Laid, Worth, parted, worth};
use super::layout::{Choice, choose_layouts};
use super::limits::Limits;
use super::link::chart_passes;
use super::polish::Setting;
use super::refine::audited;
use super::start::{Band, StripStart};
use super::strip::{fit_strip, lay_strip, prepare_strip};
use super::{Method, Observer, PlanRequest, Progress, Stage, Strategy, StrategyKind};
use crate::diagnostic::{Diagnostic, Result};
use crate::motion::{Pass, RuledMotion};
use crate::part::OrientedSpline;
use crate::tool::Tool;
use rayon::prelude::*;

/// Share of the limits below which foreseen errors are left as they are.
const FORESEEN: f64 = 0.3;
/// Ratio of the largest strain to the mean from which on borders are moved once more.
const UNEVEN: f64 = 1.5;
/// Largest strain that borders answer where they are moved once more.
const AT_MOST: f64 = 100.0;
/// Share of the limits at which an error is small enough where the tolerance decides the number of strips.
const ENOUGH: f64 = 0.4;
/// The same where the number is given.
const ENOUGH_GIVEN: f64 = 0.1;
/// Layouts tried where the first ones lead to no strips.
const LAYOUTS: usize = 3;
/// Linearizations of one strip toward the least largest error.
const ROUNDS: usize = 40;

/// A strip about to be fitted.
struct Ready {
    band: Band,
    resolution: Resolution,
    /// None where the rulings are not fitted.
    start: Option<StripStart>,
}

/// One planning run.
pub(super) struct Planner<'a> {
    request: &'a PlanRequest<'a>,
    bands: Bands<'a>,
    /// Fewest strips that the flank is long enough for.
    least: usize,
    /// Number of strips to begin with.
    predicted: usize,
}

/// Strips with the planner that found them, and what lies between them.
pub(super) struct Found<'a> {
    pub(super) planner: Planner<'a>,
    pub(super) strips: Vec<FittedStrip>,
    pub(super) gaps: Vec<Gap>,
}

impl<'a> Planner<'a> {
    /// Strips in number as asked for, or as few as the tolerance needs, joined: along the lines that promise most, or along
    /// the next where these leave part of the surface to none.
    pub(super) fn plan(request: &'a PlanRequest<'a>, spline: &'a OrientedSpline) -> Result<Found<'a>> {
        let family = flank(request.tool, request.strategy)?;
        let slanted = request.strategy.method == Method::Regulus;
        let (mut refused, mut best) = (None, None);
        for Choice { layout, least, strips, .. } in choose_layouts(request, spline, &family)?.into_iter().take(LAYOUTS)
        {
            let bands = Bands { chart: Chart::new(spline, layout).widened(), family: family.clone(), slanted };
            let planner = Self { request, bands, least, predicted: strips };
            let laid = planner.bands.check_concavity().and_then(|()| planner.separate());
            match laid.and_then(|laid| Ok((planner.worth(&laid), planner.parted(laid)?))) {
                Ok((worth, (strips, gaps))) => {
                    let found = Found { planner, strips, gaps };
                    if worth.0 <= 0.0 || request.observer.stopped() {
                        return Ok(found.joined());
                    }
                    if best.as_ref().is_none_or(|(least, _)| worth < *least) {
                        best = Some((worth, found));
                    }
                }
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        match best {
            Some((_, found)) => Ok(found.joined()),
            None => Err(refused.unwrap_or_else(|| Diagnostic::error("no lines to cut along were found"))),
        }
    }

    /// Strips each fitted by itself.
    fn separate(&self) -> Result<Vec<Laid>> {
        let strategy = self.request.strategy;
        let fixed = match (strategy.kind, strategy.strips) {
            (StrategyKind::SingleSweep, _) => Some(1),
            (StrategyKind::MultiStrip, count) => count,
        };
        if let Some(count) = fixed {
            return self.even(count);
        }
        fewest(self, Range { least: self.least, predicted: self.predicted })
    }

    fn worth(&self, laid: &[Laid]) -> Worth {
        worth(laid, &self.limits())
    }

    fn parted(&self, laid: Vec<Laid>) -> Result<(Vec<FittedStrip>, Vec<Gap>)> {
        parted(laid, |band| self.bands.middle(band))
    }

    pub(super) fn observer(&self) -> &dyn Observer {
        self.request.observer
    }

    pub(super) fn method(&self) -> Method {
        self.request.strategy.method
    }

    /// Borders of `count` strips that are foreseen to err alike, and the errors foreseen as shares of the limits. With
    /// `lapped`, of strips with their overlaps: it tells more surely whether a number holds.
    pub(super) fn ahead(&self, count: usize, lapped: bool) -> Result<(Vec<f64>, Vec<f64>)> {
        let limits = self.limits();
        let mean = 0.5 * (limits.overcut + limits.undercut);
        let Bands { chart, family, .. } = &self.bands;
        let strain = |(low, high): (f64, f64)| {
            let error = match lapped {
                true => self.bands.band(low, high).ok().and_then(|(band, _)| strip_error(chart, family, &band)),
                false => bare_error(chart, family, (low, high)),
            };
            error.map_or(f64::INFINITY, |error| error / mean)
        };
        evened_ahead(self.bands.equal_borders(count)?, FORESEEN, strain, |borders| self.bands.widest(borders))
    }

    /// `count` strips whose borders are where their errors are alike: as foreseen, and once more as found where that was
    /// far off.
    pub(super) fn even(&self, count: usize) -> Result<Vec<Laid>> {
        if count == 1 || self.method() == Method::Rulings {
            return Ok(self.fit(&self.bands.equal_borders(count)?));
        }
        let (borders, _) = self.ahead(count, false)?;
        let laid = self.fit(&borders);
        Ok(self.evened(&borders, laid))
    }

    /// Strips fitted once more between moved borders where their errors were far from alike and that helps.
    fn evened(&self, borders: &[f64], laid: Vec<Laid>) -> Vec<Laid> {
        let limits = self.limits();
        let strains: Vec<f64> = laid.iter().map(|band| band.strain(&limits).min(AT_MOST)).collect();
        let worst = strains.iter().copied().fold(0.0, f64::max);
        let mean = strains.iter().sum::<f64>() / strains.len() as f64;
        if worst <= 1.0 || worst <= UNEVEN * mean || self.observer().stopped() {
            return laid;
        }
        let Ok(widest) = self.bands.widest(borders) else { return laid };
        let again = self.fit(&evened(borders, &strains, &widest));
        if self.worth(&again) < self.worth(&laid) { again } else { laid }
    }

    /// Planned errors leave room for blocks and rounding.
    pub(super) fn limits(&self) -> Limits {
        let room = |tolerance: f64| (tolerance - self.request.linearization).max(0.5 * tolerance).max(1e-6);
        Limits { overcut: room(self.request.overcut_tolerance), undercut: room(self.request.undercut_tolerance) }
    }

    /// True where the number of strips is given: the error is then to be as small as it can be; otherwise the tolerance
    /// decides.
    fn is_given(&self) -> bool {
        let strategy = self.request.strategy;
        strategy.kind == StrategyKind::SingleSweep || strategy.strips.is_some()
    }

    /// Fits every strip.
    pub(super) fn fit(&self, borders: &[f64]) -> Vec<Laid> {
        let all: Vec<usize> = (0..borders.len() - 1).collect();
        self.fit_some(borders, &all)
    }

    /// Fits the strips of these indices, in their order.
    pub(super) fn fit_some(&self, borders: &[f64], indices: &[usize]) -> Vec<Laid> {
        let of = |index: &usize| {
            let (low, high) = (borders[*index], borders[*index + 1]);
            let strip = self.ready((low, high)).and_then(|ready| self.fit_one(&ready));
            if let Ok(strip) = &strip {
                self.note(*index, borders.len() - 1, strip);
            }
            Laid { low, high, strip }
        };
        indices.par_iter().map(of).collect()
    }

    fn note(&self, index: usize, strips: usize, strip: &FittedStrip) {
        let (overcut, undercut) = (strip.deviation.overcut.max(strip.deviation.outside), strip.deviation.undercut);
        self.request.observer.note(&Progress { strips, stage: Stage::Strip(index), overcut, undercut });
    }

    fn ready(&self, (low, high): (f64, f64)) -> Result<Ready> {
        let (band, resolution) = self.bands.band(low, high)?;
        let start = match self.request.strategy.method {
            Method::Rulings => None,
            // The method of Rajain 2023 has its own planner.
            Method::Regulus | Method::Rajain2023 => Some(
                prepare_strip(&self.bands.chart, &self.bands.family, &band, &self.limits()).map_err(|e| unfit(&e))?,
            ),
        };
        Ok(Ready { band, resolution, start })
    }

    fn fit_one(&self, ready: &Ready) -> Result<FittedStrip> {
        let Ready { band, resolution, start } = ready;
        let Bands { chart, family, .. } = &self.bands;
        let (tool, strategy) = (self.request.tool, self.request.strategy);
        let Some(start) = start else {
            return lay_strip(chart, tool, family, band, resolution).map_err(|e| unfit(&e));
        };
        let observer = self.observer();
        let fairness = 1e-9 * strategy.fairness;
        let enough = if self.is_given() { ENOUGH_GIVEN } else { ENOUGH };
        let effort = Effort { fairness, rounds: ROUNDS, enough, tolerant: !self.is_given(), observer };
        fit_strip(chart, tool, family, (band, start), (resolution, &self.limits()), &effort).map_err(|e| unfit(&e))
    }

    /// Leads, links and retracts around the strips.
    pub(super) fn passes(&self, motions: &[RuledMotion]) -> Result<Vec<Pass>> {
        chart_passes(self.request, &self.bands.chart, motions)
    }
}

impl Found<'_> {
    /// The strips looked at densely, and joined.
    fn joined(self) -> Self {
        let planner = &self.planner;
        let Bands { chart, family, .. } = &planner.bands;
        let limits = &planner.limits();
        let tool = planner.request.tool;
        let audit = |strip: FittedStrip| {
            let borders = strip.borders;
            audited(Setting { chart, tool, family, borders: &borders, limits }, strip)
        };
        let fitted = planner.method() == Method::Regulus;
        let strips = if fitted { self.strips.into_par_iter().map(audit).collect() } else { self.strips };
        Self { strips: joined(planner.request, (chart, family, limits), strips), ..self }
    }
}

/// What helps where a strip does not fit.
fn unfit(error: &StripError) -> Box<Diagnostic> {
    Diagnostic::error(error.to_string()).help(match error {
        StripError::Body(_) => "use a longer or slimmer tool above the flutes, or another direction",
        _ => "use more strips, a shorter or slimmer tool, or another direction",
    })
}

/// The spheres of the flank that the strategy uses.
pub(super) fn flank(tool: &Tool, strategy: &Strategy) -> Result<SphereFamily> {
    let from = strategy.engage_from.unwrap_or_else(|| default_engagement(tool));
    let family = SphereFamily::new(tool, from).map(|family| family.within(strategy.reach.clone()));
    family.ok_or_else(|| {
        Diagnostic::error(format!("the tool has no flank above {from} mm to mill with"))
            .help("give a longer flute_length, or a smaller [strategy] engage_from")
    })
}

/// The flank is used from a little above its lowest conical, cylindrical or barrel-shaped point.
fn default_engagement(tool: &Tool) -> f64 {
    let flank_start = tool.flutes().last().map_or(0.0, |e| e.start().height);
    flank_start + 0.02 * (tool.flute_length() - flank_start)
}
