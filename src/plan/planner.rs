//! Divides the surface into strips, fits them, and joins them into one path.

use super::assess::Borders;
use super::chart::{Chart, Frame};
use super::counts::{Counts, MOST_STRIPS, Range, Trial, fewest};
use super::fit::SphereFamily;
use super::forecast::{Run, bare_error, evened, evened_ahead, narrowed, strip_error};
use super::join::joined;
use super::layout::{Choice, choose_layouts};
use super::limits::Limits;
use super::link::chart_passes;
use super::start::{Band, StripStart, ruling};
use super::strip::{Effort, FittedStrip, Resolution, StripError, fit_strip, lay_strip, prepare_strip};
use super::{Method, PlanRequest, Progress, Stage, Strategy, StrategyKind};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;
use crate::motion::{Pass, RuledMotion};
use crate::part::OrientedSpline;
use crate::tool::Tool;
use rayon::prelude::*;

/// Least overlap of strips over each other and over the surface's borders, mm, and as a share of a short flank.
const OVERLAP: f64 = 0.25;
const OVERLAP_SHARE: f64 = 0.03;
/// How far strips run past the surface's ends before they lead out, mm: far enough for the fit's free ends.
const OVERRUN: f64 = 3.0;
/// Share of the flank's spare length that overlap may take: slanted rulings need some too.
const SPARED: f64 = 0.8;
/// Share of the overlap that must be there in the end.
const MUST_OVERLAP: f64 = 0.33;
/// Share of its length by which a flank that is only just long enough may miss the borders.
const SLACK: f64 = 4e-4;
/// How far beyond the surface, as a share of its size, a ruling no longer tells what the flank must reach.
const ASIDE: f64 = 0.1;
/// Strips fitted first where the number may still change: those foreseen to err most.
const PROBED: usize = 8;
/// Share of the limits from which on their errors miss them so clearly that the rest is not fitted.
const MISSED: f64 = 1.5;
/// Share of the limits below which foreseen errors are left as they are.
const FORESEEN: f64 = 0.3;
/// Ratio of the largest strain to the mean from which on borders are moved once more.
const UNEVEN: f64 = 1.5;
/// Share of the flank that a strip may be widened to.
const WIDEST: f64 = 0.95;
/// Share of the limits at which an error is small enough where the tolerance decides the number of strips.
const ENOUGH: f64 = 0.4;
/// The same where the number is given.
const ENOUGH_GIVEN: f64 = 0.1;
/// Layouts tried where the first ones lead to no strips.
const LAYOUTS: usize = 3;
/// One strip in so many may miss the limits whatever their number: it is divided.
const OUTLYING: usize = 5;
/// Rounds in which strips that miss the limits are divided.
const MENDINGS: usize = 4;
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
    chart: Chart<'a>,
    family: SphereFamily,
    /// Fewest strips that the flank is long enough for.
    least: usize,
    /// Number of strips to begin with.
    predicted: usize,
}

impl<'a> Planner<'a> {
    /// Strips in number as asked for, or as few as the tolerance needs, joined, with the planner that found them: along the
    /// lines that promise most, or along the next where these lead to none.
    pub(super) fn plan(request: &'a PlanRequest<'a>, spline: &'a OrientedSpline) -> Result<(Self, Vec<FittedStrip>)> {
        let family = flank(request.tool, request.strategy)?;
        let mut refused = None;
        for Choice { layout, least, strips, .. } in choose_layouts(request, spline, &family)?.into_iter().take(LAYOUTS)
        {
            let chart = Chart::new(spline, layout).widened();
            let planner = Self { request, chart, family: family.clone(), least, predicted: strips };
            match planner.check_concavity().and_then(|()| planner.separate()) {
                Ok(strips) => {
                    let strips = joined(request, (&planner.chart, &planner.family, &planner.limits()), strips);
                    return Ok((planner, strips));
                }
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        Err(refused.unwrap_or_else(|| Diagnostic::error("no lines to cut along were found")))
    }

    /// Strips each fitted by itself.
    fn separate(&self) -> Result<Vec<FittedStrip>> {
        let strategy = self.request.strategy;
        let fixed = match (strategy.kind, strategy.strips) {
            (StrategyKind::SingleSweep, _) => Some(1),
            (StrategyKind::MultiStrip, count) => count,
        };
        if let Some(count) = fixed {
            return self.even(count);
        }
        let strips = fewest(self, Range { least: self.least, predicted: self.predicted })?;
        Ok(self.mended(strips))
    }

    /// Strips that miss the limits divided into more and narrower ones, those that hold left as they are.
    fn mended(&self, mut strips: Vec<FittedStrip>) -> Vec<FittedStrip> {
        let limits = self.limits();
        for more in 0..MENDINGS {
            let strains: Vec<f64> = strips.iter().map(|strip| limits.strain(&strip.deviation)).collect();
            let runs = narrowed(&borders_of(&strips), &strains, more);
            let most = runs.iter().map(|run| run.borders.len() - 1).sum::<usize>() + strips.len();
            if runs.is_empty() || most > MOST_STRIPS || self.request.observer.stopped() {
                break;
            }
            // From the last on, so that the places of those before stay.
            for Run { old, borders } in runs.into_iter().rev() {
                let before = strains.get(old.clone()).unwrap_or_default().iter().copied().fold(0.0, f64::max);
                if let Ok(found) = self.fit(&borders)
                    && self.strain(&found) < before
                {
                    strips.splice(old, found);
                }
            }
        }
        strips
    }

    /// What came of strips that are as many as asked for: those that miss the limits are divided.
    fn whole_of(&self, strips: Vec<FittedStrip>) -> Trial<Vec<FittedStrip>> {
        let strain = self.strain(&strips);
        if strain <= 1.0 {
            return Trial::Whole(strips, strain);
        }
        let strips = self.mended(strips);
        let strain = self.strain(&strips);
        if strain <= 1.0 { Trial::Mended(strips) } else { Trial::Whole(strips, strain) }
    }

    /// Largest strain of strips fitted of `count` in all, but for the few that are divided in the end.
    fn usual_strain(&self, strips: &[FittedStrip], count: usize) -> f64 {
        let limits = self.limits();
        let mut strains: Vec<f64> = strips.iter().map(|strip| limits.strain(&strip.deviation)).collect();
        strains.sort_by(|a, b| b.total_cmp(a));
        strains.get(count / OUTLYING).copied().unwrap_or(0.0)
    }

    fn strain(&self, strips: &[FittedStrip]) -> f64 {
        let limits = self.limits();
        strips.iter().map(|s| limits.strain(&s.deviation)).fold(0.0, f64::max)
    }

    /// Borders of `count` strips that are foreseen to err alike, and the errors foreseen as shares of the limits. With
    /// `lapped`, of strips with their overlaps: it tells more surely whether a number holds.
    fn ahead(&self, count: usize, lapped: bool) -> Result<(Vec<f64>, Vec<f64>)> {
        let limits = self.limits();
        let mean = 0.5 * (limits.overcut + limits.undercut);
        let (chart, family) = (&self.chart, &self.family);
        let strain = |(low, high): (f64, f64)| {
            let error = match lapped {
                true => self.band(low, high).ok().and_then(|(band, _)| strip_error(chart, family, &band)),
                false => bare_error(chart, family, (low, high)),
            };
            error.map_or(f64::INFINITY, |error| error / mean)
        };
        evened_ahead(self.equal_borders(count)?, FORESEEN, strain, |borders| self.widest(borders))
    }

    /// `count` strips whose borders are where their errors are alike: as foreseen, and once more as found where that was
    /// far off.
    fn even(&self, count: usize) -> Result<Vec<FittedStrip>> {
        if count == 1 || self.request.strategy.method == Method::Rulings {
            return self.fit(&self.equal_borders(count)?);
        }
        let (borders, _) = self.ahead(count, false)?;
        let strips = self.fit(&borders)?;
        Ok(self.evened(&borders, strips))
    }

    /// Strips fitted once more between moved borders where their errors were far from alike and that helps.
    fn evened(&self, borders: &[f64], strips: Vec<FittedStrip>) -> Vec<FittedStrip> {
        let limits = self.limits();
        let strains: Vec<f64> = strips.iter().map(|strip| limits.strain(&strip.deviation)).collect();
        let (worst, mean) = (self.strain(&strips), strains.iter().sum::<f64>() / strips.len() as f64);
        if worst <= 1.0 || worst <= UNEVEN * mean || self.request.observer.stopped() {
            return strips;
        }
        let again = self.widest(borders).and_then(|widest| self.fit(&evened(borders, &strains, &widest)));
        again.ok().filter(|again| self.strain(again) < worst).unwrap_or(strips)
    }

    /// The widest that each strip may become, in g, with the flank that there is.
    fn widest(&self, borders: &[f64]) -> Result<Vec<f64>> {
        let reach = WIDEST * (self.family.highest() - self.family.lowest());
        let width = |pair: &[f64]| {
            let (low, high) = (pair[0], pair[1]);
            let (first, last) = self.chart.span(low, high);
            let (needed, _) = self.longest_ruling(&Borders { low, high, first, last })?;
            Ok((high - low) * (reach / needed).max(1.0))
        };
        borders.windows(2).map(width).collect()
    }

    /// Planned errors leave room for blocks and rounding.
    fn limits(&self) -> Limits {
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
    fn fit(&self, borders: &[f64]) -> Result<Vec<FittedStrip>> {
        let all: Vec<usize> = (0..borders.len() - 1).collect();
        self.fit_some(borders, &all)
    }

    /// Fits the strips of these indices, in their order; none where one of them has nothing to start from.
    fn fit_some(&self, borders: &[f64], indices: &[usize]) -> Result<Vec<FittedStrip>> {
        let named = |error, index: usize| name_strip(error, index, borders.len() - 1);
        let ready: Vec<Result<Ready>> = indices
            .par_iter()
            .map(|index| self.ready((borders[*index], borders[*index + 1])).map_err(|e| named(e, *index)))
            .collect();
        let ready: Vec<Ready> = ready.into_iter().collect::<Result<_>>()?;
        let fitted: Vec<Result<FittedStrip>> = indices
            .par_iter()
            .zip(&ready)
            .map(|(index, ready)| {
                let strip = self.fit_one(ready).map_err(|e| named(e, *index))?;
                self.note(*index, borders.len() - 1, &strip);
                Ok(strip)
            })
            .collect();
        fitted.into_iter().collect()
    }

    fn note(&self, index: usize, strips: usize, strip: &FittedStrip) {
        let (overcut, undercut) = (strip.deviation.overcut.max(strip.deviation.outside), strip.deviation.undercut);
        self.request.observer.note(&Progress { strips, stage: Stage::Strip(index), overcut, undercut });
    }

    fn ready(&self, (low, high): (f64, f64)) -> Result<Ready> {
        let (band, resolution) = self.band(low, high)?;
        let start = match self.request.strategy.method {
            Method::Rulings => None,
            // The method of Rajain 2023 has its own planner.
            Method::Regulus | Method::Rajain2023 => {
                Some(prepare_strip(&self.chart, &self.family, &band, &self.limits()).map_err(|e| unfit(&e))?)
            }
        };
        Ok(Ready { band, resolution, start })
    }

    fn fit_one(&self, ready: &Ready) -> Result<FittedStrip> {
        let Ready { band, resolution, start } = ready;
        let (chart, tool, family) = (&self.chart, self.request.tool, &self.family);
        let strategy = self.request.strategy;
        let Some(start) = start else {
            return lay_strip(chart, tool, family, band, resolution).map_err(|e| unfit(&e));
        };
        let observer = self.request.observer;
        let fairness = 1e-9 * strategy.fairness;
        let enough = if self.is_given() { ENOUGH_GIVEN } else { ENOUGH };
        let effort = Effort { fairness, rounds: ROUNDS, enough, tolerant: !self.is_given(), observer };
        fit_strip(chart, tool, family, (band, start), (resolution, &self.limits()), &effort).map_err(|e| unfit(&e))
    }

    /// The longest flank, mm, that rulings straight across between two borders need, and where.
    fn longest_ruling(&self, borders: &Borders) -> Result<(f64, Point)> {
        let Borders { low, high, first, last } = *borders;
        let mut worst = (0.0, self.frame((low, first))?.point);
        for j in 0..=20 {
            let h = first + (last - first) * f64::from(j) / 20.0;
            let foot = self.frame((low, h))?;
            let [middle, head] = [0.5 * (low + high), high].map(|g| self.frame((g, h)));
            if foot.beyond.min(middle?.beyond).min(head?.beyond) > ASIDE {
                continue;
            }
            let found = ruling(&self.chart, &self.family, self.family.lowest(), (low, high), (h, h));
            let Some(needed) = found.map(|found| (found.upper - found.lower).norm()) else { continue };
            if needed > worst.0 {
                worst = (needed, foot.point);
            }
        }
        Ok(worst)
    }

    /// The tool must fit into the hollows of the part, across its axis.
    fn check_concavity(&self) -> Result<()> {
        let radius = self.family.radius(self.family.lowest()).0.min(self.family.radius(self.family.highest()).0);
        let mut worst: Option<(f64, Point)> = None;
        for i in 0..=40 {
            for j in 0..=40 {
                let place = (f64::from(i) / 40.0, f64::from(j) / 40.0);
                let frame = self.frame(place)?;
                let Some((tangent, _)) = frame.along_gauge().filter(|_| frame.inside()) else { continue };
                let hollow = self.chart.curvature(place, &tangent).unwrap_or(0.0);
                if hollow * radius >= 1.0 && worst.is_none_or(|(w, _)| hollow > w) {
                    worst = Some((hollow, frame.point));
                }
            }
        }
        let Some((hollow, at)) = worst else { return Ok(()) };
        Err(Diagnostic::error(format!(
            "the tool is too big for the part: near ({:.3}, {:.3}, {:.3}) the surface is hollow with radius {:.3} mm across the axis, the slimmest part of the flank has {radius:.3} mm",
            at.x, at.y, at.z, 1.0 / hollow
        ))
        .help("use a tool with a smaller diameter, or another cutting direction"))
    }

    /// Values of g that divide the surface into `count` bands of equal mean width.
    fn equal_borders(&self, count: usize) -> Result<Vec<f64>> {
        let fine = 200;
        let mut lengths = vec![0.0];
        for i in 0..fine {
            let mut step = 0.0;
            for j in 0..=8 {
                let g = |i: u32| f64::from(i) / f64::from(fine);
                let (first, last) = self.chart.span(g(i), g(i + 1));
                let at = |i: u32| self.frame((g(i), first + (last - first) * f64::from(j) / 8.0));
                step += (at(i + 1)?.point - at(i)?.point).norm();
            }
            lengths.push(lengths[i as usize] + step);
        }
        let total = lengths[fine as usize];
        let mut borders = vec![0.0];
        for i in 1..count {
            let wanted = total * i as f64 / count as f64;
            let at = lengths.partition_point(|l| *l < wanted).clamp(1, fine as usize);
            let share = (wanted - lengths[at - 1]) / (lengths[at] - lengths[at - 1]);
            borders.push((at as f64 - 1.0 + share) / f64::from(fine));
        }
        borders.push(1.0);
        Ok(borders)
    }

    fn frame(&self, place: (f64, f64)) -> Result<Frame> {
        self.chart.frame(place).ok_or_else(|| {
            Diagnostic::error(format!("the surface has no normal near {place:?} of its parameters"))
                .help("repair the surface: it has a fold or a pole there")
        })
    }

    fn band(&self, low: f64, high: f64) -> Result<(Band, Resolution)> {
        let (mut narrow, mut wide, mut long) = (f64::INFINITY, 0.0_f64, 0.0);
        let (first, last) = self.chart.span(low, high);
        let mut before = self.frame((0.5 * (low + high), first))?.point;
        for j in 0..=8 {
            let h = first + (last - first) * f64::from(j) / 8.0;
            let (lower, upper) = (self.frame((low, h))?, self.frame((high, h))?);
            if lower.beyond.min(upper.beyond) <= ASIDE || narrow.is_infinite() {
                let width = (upper.point - lower.point).norm();
                (narrow, wide) = (narrow.min(width), wide.max(width));
            }
            let middle = self.frame((0.5 * (low + high), h))?.point;
            long += (middle - before).norm();
            before = middle;
        }
        let reach = self.family.highest() - self.family.lowest();
        let (needed, at) = self.longest_ruling(&Borders { low, high, first, last })?;
        if needed > reach * (1.0 + SLACK) {
            return Err(too_short(needed, reach, &at));
        }
        // A flank that is only just long enough has nothing left to overlap with.
        let spare = 0.5 * (reach - needed).max(0.0);
        let wanted = OVERLAP.min(OVERLAP_SHARE * reach).max(0.03 * narrow);
        let per_mm = (high - low) / narrow;
        let overlap = wanted.min(SPARED * spare) * per_mm;
        let margin = if spare < MUST_OVERLAP * wanted { -SLACK * reach * per_mm } else { MUST_OVERLAP * overlap };
        // A control point about every two millimetres; looked at twice as densely, so that nodes hide no overshoot.
        let controls = ((long / 2.0).ceil() as usize).clamp(24, 160);
        let heights = ((wide / 2.0).ceil() as usize + 6).clamp(8, 15);
        let resolution = Resolution { controls, instants: 2 * controls + 1, heights };
        let band = Band {
            // Neighbours overlap; each must cover a little more than its own band.
            borders: Borders { low: low - margin, high: high + margin, first, last },
            low: low - overlap,
            high: high + overlap,
            overrun: OVERRUN.min(reach) / long * (last - first),
            instants: resolution.instants,
            slanted: self.request.strategy.method == Method::Regulus,
        };
        Ok((band, resolution))
    }

    /// Leads, links and retracts around the strips.
    pub(super) fn passes(&self, motions: &[RuledMotion]) -> Result<Vec<Pass>> {
        chart_passes(self.request, &self.chart, motions)
    }
}

impl Counts for Planner<'_> {
    type Strips = Vec<FittedStrip>;

    fn foreseen(&self, count: usize) -> Result<f64> {
        Ok(self.ahead(count, true)?.1.into_iter().fold(0.0, f64::max))
    }

    /// Strips as [`Planner::even`] fits them, unless those that are foreseen to err most clearly miss the limits.
    fn trial(&self, count: usize) -> Result<Trial<Vec<FittedStrip>>> {
        if count <= PROBED || self.request.strategy.method == Method::Rulings {
            return self.even(count).map(|strips| self.whole_of(strips));
        }
        let (borders, foreseen) = self.ahead(count, true)?;
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|a, b| foreseen[*b].total_cmp(&foreseen[*a]));
        let (mut strips, mut rest) = (Vec::with_capacity(count), order.as_slice());
        while !rest.is_empty() {
            let (next, later) = rest.split_at(rest.len().min(strips.len().max(PROBED)));
            strips.extend(self.fit_some(&borders, next)?);
            let strain = self.usual_strain(&strips, count);
            if strain > MISSED && !self.request.observer.stopped() {
                return Ok(Trial::Missed(strain));
            }
            rest = later;
        }
        let mut placed: Vec<(usize, FittedStrip)> = order.into_iter().zip(strips).collect();
        placed.sort_by_key(|(index, _)| *index);
        let strips: Vec<FittedStrip> = placed.into_iter().map(|(_, strip)| strip).collect();
        Ok(self.whole_of(strips))
    }

    fn size(strips: &Vec<FittedStrip>) -> usize {
        strips.len()
    }

    fn whole(&self, count: usize) -> Result<Vec<FittedStrip>> {
        self.even(count)
    }

    fn stopped(&self) -> bool {
        self.request.observer.stopped()
    }
}

/// The lines g = const between strips, and the surface's ends.
fn borders_of(strips: &[FittedStrip]) -> Vec<f64> {
    let between = strips.windows(2).map(|pair| 0.5 * (pair[0].borders.high + pair[1].borders.low));
    std::iter::once(0.0).chain(between).chain(std::iter::once(1.0)).collect()
}

/// What helps where a strip does not fit.
fn unfit(error: &StripError) -> Box<Diagnostic> {
    Diagnostic::error(error.to_string()).help(match error {
        StripError::Body(_) => "use a longer or slimmer tool above the flutes, or another direction",
        _ => "use more strips, a shorter or slimmer tool, or another direction",
    })
}

fn too_short(needed: f64, reach: f64, at: &Point) -> Box<Diagnostic> {
    Diagnostic::error(format!(
        "the tool is too short by {:.3} mm: near ({:.2}, {:.2}, {:.2}) the strip needs {needed:.3} mm of flank, the tool has {reach:.3} mm",
        needed - reach, at.x, at.y, at.z
    ))
    .help("give a longer [tool] flute_length, a smaller [strategy] engage_from, or more strips")
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

/// Says which strip an error is about.
fn name_strip(mut error: Box<Diagnostic>, index: usize, count: usize) -> Box<Diagnostic> {
    error.message = format!("strip {} of {count}: {}", index + 1, error.message);
    error
}
