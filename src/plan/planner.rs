//! Divides the surface into strips, fits them, and joins them into one path.

use super::assess::Borders;
use super::chart::{Chart, Frame};
use super::fit::SphereFamily;
use super::layout::{Choice, choose_layout};
use super::limits::Limits;
use super::link::chart_passes;
use super::start::{Band, ruling};
use super::strip::{Effort, FittedStrip, Resolution, fit_strip, lay_strip};
use super::{Method, PlanRequest, Progress, Stage, Strategy, StrategyKind};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;
use crate::motion::{Pass, RuledMotion};
use crate::part::OrientedSpline;
use crate::tool::Tool;
use rayon::prelude::*;

/// Strips tried when the number is free.
const MOST_STRIPS: usize = 80;
/// Numbers of strips tried at most before one keeps the tolerance.
const TRIES: usize = 6;
/// Share of the error before below which more strips count as a help.
const HELPED: f64 = 0.9;
/// Least overlap of strips over each other and over the surface's borders, mm, and as a share of a short flank.
const OVERLAP: f64 = 0.25;
const OVERLAP_SHARE: f64 = 0.05;
/// How far strips run past the surface's ends before they lead out, mm: far enough for the fit's free ends.
const OVERRUN: f64 = 3.0;
/// Share of the flank's spare length that overlap may take: slanted rulings need some too.
const SPARED: f64 = 0.8;
/// Share of the overlap that must be there in the end.
const MUST_OVERLAP: f64 = 0.2;
/// Share of its length by which a flank that is only just long enough may miss the borders.
const SLACK: f64 = 2e-4;
/// How far beyond the surface, as a share of its size, a ruling no longer tells what the flank must reach.
const ASIDE: f64 = 0.1;
/// Most rounds in which borders are moved to even out the strips' errors.
const EVENING_ROUNDS: usize = 2;
/// Share of the flank that a strip may be widened to.
const WIDEST: f64 = 0.95;
/// Share of the limits at which an error is small enough where the tolerance decides the number of strips.
const ENOUGH: f64 = 0.4;
/// The same where the number is given.
const ENOUGH_GIVEN: f64 = 0.1;
/// Effort while borders are still moved: (steps, rounds toward the least largest error).
const QUICK: (usize, usize) = (16, 1);
/// Effort at the end.
const FULL: (usize, usize) = (36, 24);

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
    pub(super) fn new(request: &'a PlanRequest<'a>, spline: &'a OrientedSpline) -> Result<Self> {
        let family = flank(request.tool, request.strategy)?;
        let Choice { layout, least, strips, .. } = choose_layout(request, spline, &family)?;
        let planner = Self { request, chart: Chart::new(spline, layout), family, least, predicted: strips };
        planner.check_concavity()?;
        Ok(planner)
    }

    /// Strips in number as asked for, or as few as the tolerance needs.
    pub(super) fn strips(&self) -> Result<Vec<FittedStrip>> {
        let strategy = self.request.strategy;
        let fixed = match (strategy.kind, strategy.strips) {
            (StrategyKind::SingleSweep, _) => Some(1),
            (StrategyKind::MultiStrip, count) => count,
        };
        if let Some(count) = fixed {
            return self.even(count);
        }
        self.fewest()
    }

    /// The fewest strips within tolerance: from the predicted number down while it holds, or up until it does. Where more
    /// strips no longer help, or after a few tries, the best so far stands, and its verdict says what it misses.
    fn fewest(&self) -> Result<Vec<FittedStrip>> {
        let mut count = self.predicted.min(MOST_STRIPS);
        let mut enough: Option<Vec<FittedStrip>> = None;
        let mut best: Option<(f64, Vec<FittedStrip>)> = None;
        let (mut failed, mut tries) = (0, 1);
        loop {
            let found = self.even(count);
            let strain = found.as_ref().map_or(4.0, |strips| self.strain(strips));
            if strain <= 1.0 {
                if count <= self.least.max(failed + 1) || self.request.observer.stopped() {
                    return found;
                }
                enough = found.ok();
                count -= 1;
                continue;
            }
            if let Some(strips) = enough {
                return Ok(strips);
            }
            // The error falls with the square of the width, or faster, as long as width is what limits it.
            let next = (count + 1).max((count as f64 * strain.sqrt().min(2.0) * 0.8).floor() as usize);
            let helped = found.is_err() || best.as_ref().is_none_or(|(least, _)| strain < HELPED * least);
            let last = !helped || tries >= TRIES || next > MOST_STRIPS || self.request.observer.stopped();
            match (found, best) {
                (Ok(strips), before) if before.as_ref().is_none_or(|(least, _)| strain < *least) => {
                    best = Some((strain, strips));
                }
                (Err(error), None) if last => return Err(error),
                (_, before) => best = before,
            }
            if last && let Some((_, strips)) = best {
                return Ok(strips);
            }
            (count, failed, tries) = (next, count, tries + 1);
        }
    }

    fn strain(&self, strips: &[FittedStrip]) -> f64 {
        let limits = self.limits();
        strips.iter().map(|s| limits.strain(&s.deviation)).fold(0.0, f64::max)
    }

    /// `count` strips whose borders are moved until their errors are alike, or all small enough. Borders are judged by
    /// quick fits; only the best ones are fitted with full effort, from where the quick fits left them.
    fn even(&self, count: usize) -> Result<Vec<FittedStrip>> {
        let mut borders = self.equal_borders(count)?;
        if count == 1 || self.request.strategy.method == Method::Rulings {
            return self.fit(&borders, FULL, None);
        }
        let mut fitted = self.fit(&borders, QUICK, None)?;
        let mut best: Option<(f64, Vec<f64>, Vec<FittedStrip>)> = None;
        for round in 0..=EVENING_ROUNDS {
            let strain = self.strain(&fitted);
            let better = best.as_ref().is_none_or(|(least, ..)| strain < *least);
            let limits = self.limits();
            let strains: Vec<f64> = fitted.iter().map(|strip| limits.strain(&strip.deviation)).collect();
            let wanted = evened(&borders, &strains, &self.widest(&borders)?);
            if better {
                best = Some((strain, borders.clone(), fitted.clone()));
            }
            if strain <= 0.8 || round == EVENING_ROUNDS || self.request.observer.stopped() {
                break;
            }
            // A full step can ask for more than the flute reaches; a shorter one in the same sense still helps.
            let tried = [1.0, 0.5, 0.25].iter().find_map(|share| {
                let moved: Vec<f64> = borders.iter().zip(&wanted).map(|(b, w)| b + share * (w - b)).collect();
                self.fit(&moved, QUICK, Some(&fitted)).ok().map(|strips| (moved, strips))
            });
            let Some((moved, strips)) = tried else { break };
            (borders, fitted) = (moved, strips);
        }
        let Some((_, borders, quick)) = best else { return Ok(fitted) };
        self.fit(&borders, FULL, Some(&quick))
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

    /// With the number of strips given the error is to be as small as it can be; otherwise the tolerance decides.
    fn enough(&self) -> f64 {
        let strategy = self.request.strategy;
        let given = strategy.kind == StrategyKind::SingleSweep || strategy.strips.is_some();
        if given { ENOUGH_GIVEN } else { ENOUGH }
    }

    /// Fits every strip, from where `before` left it if there is that.
    fn fit(&self, borders: &[f64], effort: (usize, usize), before: Option<&[FittedStrip]>) -> Result<Vec<FittedStrip>> {
        let count = borders.len() - 1;
        let fitted: Vec<Result<FittedStrip>> = borders
            .par_windows(2)
            .enumerate()
            .map(|(index, pair)| {
                let before = before.and_then(|strips| strips.get(index));
                let fitted = self.fit_one((pair[0], pair[1]), effort, before);
                let strip = fitted.map_err(|e| name_strip(e, index, count))?;
                self.note(index, count, &strip);
                Ok(strip)
            })
            .collect();
        fitted.into_iter().collect()
    }

    fn note(&self, index: usize, strips: usize, strip: &FittedStrip) {
        let (overcut, undercut) = (strip.deviation.overcut.max(strip.deviation.outside), strip.deviation.undercut);
        self.request.observer.note(&Progress { strips, stage: Stage::Strip(index), overcut, undercut });
    }

    fn fit_one(
        &self,
        (low, high): (f64, f64),
        effort: (usize, usize),
        before: Option<&FittedStrip>,
    ) -> Result<FittedStrip> {
        let (band, resolution) = self.band(low, high)?;
        let (chart, tool, family) = (&self.chart, self.request.tool, &self.family);
        let strategy = self.request.strategy;
        let fitted = match strategy.method {
            Method::Rulings => lay_strip(chart, tool, family, &band, &resolution),
            // The method of Rajain 2023 has its own planner.
            Method::Regulus | Method::Rajain2023 => {
                let (steps, rounds) = effort;
                let observer = self.request.observer;
                let effort =
                    Effort { fairness: 1e-9 * strategy.fairness, steps, rounds, enough: self.enough(), observer };
                let fit = |effort: &Effort<'_>| {
                    fit_strip(chart, tool, family, (&band, before), (&resolution, &self.limits()), effort)
                };
                match fit(&effort) {
                    // Only least squares know the bound: where the refinement leaves it, it is left out.
                    Ok(strip) if strategy.reach.as_ref().is_some_and(|bound| bound.is_left(&strip.motion)) => {
                        fit(&Effort { steps: 4 * steps, rounds: 0, ..effort })
                    }
                    fitted => fitted,
                }
            }
        };
        fitted.map_err(|e| {
            Diagnostic::error(e.to_string()).help("use more strips, a shorter or slimmer tool, or another direction")
        })
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
        let controls = ((long / 2.0).ceil() as usize).clamp(24, 60);
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

/// Borders with the strips' widths changed against their strain, none wider than it may be.
fn evened(borders: &[f64], strains: &[f64], widest: &[f64]) -> Vec<f64> {
    let aims: Vec<f64> =
        borders.windows(2).zip(strains).map(|(pair, s)| (pair[1] - pair[0]) * s.max(0.1).powf(-0.35)).collect();
    // Widths in proportion to the aims; what the widest may not take goes to the others.
    let mut held = vec![false; aims.len()];
    let widths = loop {
        let (mut room, mut aim) = (1.0, 0.0);
        for ((aimed, most), held) in aims.iter().zip(widest).zip(&held) {
            if *held { room -= most } else { aim += aimed }
        }
        if aim <= 0.0 || room <= 0.0 {
            return borders.to_vec();
        }
        let width = |i: usize| if held[i] { widest[i] } else { aims[i] * room / aim };
        let widths: Vec<f64> = (0..aims.len()).map(width).collect();
        let Some(over) = (0..aims.len()).find(|i| !held[*i] && widths[*i] > widest[*i]) else { break widths };
        held[over] = true;
    };
    let mut moved = borders.to_vec();
    for (i, width) in widths.iter().enumerate().take(aims.len() - 1) {
        moved[i + 1] = moved[i] + width;
    }
    moved
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
