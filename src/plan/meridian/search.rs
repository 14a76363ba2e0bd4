//! The search for a tool and its sweeps: starts from several layouts, radii and seeds, quick fits of all, the best ones
//! fitted in full with as many coefficients as pay.

use super::fit::SweepFit;
use super::judge::{Judgement, judge};
use super::line::line_driven;
use super::problem::{Band, Sweep, Terms};
use super::radius::{FREE_COEFFICIENTS, MeridianFamily, RadiusFunction};
use super::{Seed, ToolWish, outliers};
use crate::motion::RuledMotion;
use crate::optimize::{Settings, minimize_bordered};
use crate::plan::chart::{Chart, Layout};
use crate::plan::fitted::Resolution;
use crate::plan::{Observer, Progress, Stage};
use rayon::prelude::*;

/// A tool with its sweeps.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) radius: RadiusFunction,
    pub(super) motions: Vec<RuledMotion>,
    pub(super) bands: Vec<Band>,
    pub(super) judged: Vec<Judgement>,
    pub(super) steps: usize,
    /// What the search started from.
    pub(super) seed: Seed,
}

impl Fitted {
    /// Largest error of either sign, mm.
    pub(super) fn worst(&self) -> f64 {
        self.judged.iter().map(Judgement::worst).fold(0.0, f64::max)
    }

    /// Root mean square error, mm.
    fn rms(&self) -> f64 {
        let squares: f64 = self.judged.iter().map(|j| j.rms * j.rms).sum();
        (squares / self.judged.len() as f64).sqrt()
    }

    /// What counts first: the share that stays uncovered, in steps of two percent, then the largest error.
    fn score(&self) -> (u32, f64) {
        (((1.0 - self.covered()) / UNCOVERED) as u32, self.worst())
    }

    /// Smallest share of a band that is covered.
    pub(super) fn covered(&self) -> f64 {
        self.judged.iter().map(Judgement::covered).fold(1.0, f64::min)
    }

    /// Share of the `whole` that is within `limit`.
    fn area_within(&self, whole: &Band, limit: f64) -> f64 {
        let areas = self.bands.iter().zip(&self.judged).map(|(band, judged)| band.area() * judged.share_within(limit));
        areas.sum::<f64>() / whole.area()
    }

    /// Mean share of the bands within `limit`.
    pub(super) fn share_within(&self, limit: f64) -> f64 {
        self.judged.iter().map(|j| j.share_within(limit)).sum::<f64>() / self.judged.len() as f64
    }
}

/// How guidance (fairness and proximity, as a share of the user's weights) is taken back, and the most steps each.
const QUICK: [(f64, usize); 3] = [(1.0, 8), (1e-2, 12), (1e-4, 20)];
const FULL: [(f64, usize); 6] = [(1e-2, 20), (1e-4, 30), (1e-6, 40), (1e-8, 60), (1e-10, 60), (1e-12, 100)];
/// Coefficients of a free meridian that are tried one after the other while they pay.
const LEVELS: [usize; 4] = [FREE_COEFFICIENTS, 16, 24, 32];
/// Errors below this are as good as none, mm.
const NEGLIGIBLE: f64 = 2e-5;
/// Least gain of a level that makes the next one worth trying.
const GAIN: f64 = 1.25;
/// Lengths from which the search for a cone between given ends starts, against the least.
const LENGTHS: [f64; 2] = [1.0, 1.15];
/// Radii from which the search starts.
const RADII: usize = 6;
/// A stage whose largest error is this many times the best stage's ends the fit: with less guidance it runs off.
const RUN_OFF: f64 = 3.0;
/// Starts that are fitted in full.
const FINALISTS: usize = 2;
/// How far sweeps run past the borders of their band, as a share of its width, and past its ends, as one of the radius.
const MARGIN: f64 = 0.02;
const OVERRUN: f64 = 0.25;
/// Most of the latter, as a share of the band's length.
const LONGEST_OVERRUN: f64 = 0.04;
/// Share of a band by which more of it uncovered counts as worse.
const UNCOVERED: f64 = 0.02;

/// Difference of shares of the surface from which on more is clearly more.
const CLEARLY: f64 = 0.02;
/// Resolution of the quick fits.
const QUICK_RESOLUTION: Resolution = Resolution { controls: 12, instants: 25, heights: 11 };

/// From where a search sets out.
#[derive(Clone, Copy, Debug)]
struct Start {
    /// Index of the chart.
    chart: usize,
    /// Radii of the spheres at both ends of the axis, mm.
    radii: (f64, f64),
    /// Distance of their centres, mm.
    length: f64,
    seed: Seed,
}

/// One search.
pub(super) struct Search<'a> {
    pub(super) wish: &'a ToolWish,
    /// The surface itself: charts continue it all around.
    pub(super) whole: Band,
    /// Error that is good enough, mm.
    pub(super) limit: f64,
    /// Follows the search and may end it.
    pub(super) observer: &'a dyn Observer,
}

/// Why no tool was found.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum NotFound {
    /// Every flank would have to be longer than allowed: the least that is needed, mm.
    TooShort(f64),
    /// No start led to a proper tool that covers the surface.
    NoFit,
}

impl Search<'_> {
    /// The best tool that sweeps each of `bands`, in one of `charts`.
    pub(super) fn run(&self, charts: &[Chart<'_>], bands: &[Band]) -> Result<(usize, Fitted), NotFound> {
        let mut starts: Vec<Start> = Vec::new();
        let mut shortest = f64::INFINITY;
        for (chart, on) in charts.iter().enumerate() {
            for radii in self.radii(on) {
                let needed = self.needed_length(on, bands, radii);
                shortest = shortest.min(needed);
                for length in self.lengths(needed) {
                    let seeds = [Seed::Surface, Seed::Line].into_iter();
                    let seeds = seeds.filter(|seed| self.wish.seed.is_none_or(|wanted| wanted == *seed));
                    starts.extend(seeds.map(|seed| Start { chart, radii, length, seed }));
                }
            }
        }
        if starts.is_empty() && shortest.is_finite() {
            return Err(NotFound::TooShort(shortest));
        }
        let mut tried: Vec<(usize, Fitted)> = starts
            .par_iter()
            .filter_map(|start| {
                let chart = &charts[start.chart];
                let (sweeps, radius) = self.start(chart, bands, start)?;
                let fitted = self.fit(chart, &sweeps, (radius, start.seed), &QUICK_RESOLUTION, &QUICK)?;
                (fitted.covered() > 0.9).then_some((start.chart, fitted))
            })
            .collect();
        tried.sort_by(|a, b| a.1.rms().total_cmp(&b.1.rms()));
        // The best ones, and the best of every chart: what curves across it only shows in full.
        let mut seen = vec![0; charts.len()];
        let finalists: Vec<(usize, Fitted)> = tried
            .into_iter()
            .enumerate()
            .filter(|(rank, (chart, _))| {
                seen[*chart] += 1;
                *rank < FINALISTS || seen[*chart] == 1
            })
            .map(|(_, found)| found)
            .collect();
        let finals: Vec<(usize, Fitted)> = finalists
            .into_par_iter()
            .filter_map(|(index, fitted)| Some((index, self.finish(&charts[index], &fitted)?)))
            .collect();
        finals
            .into_iter()
            .min_by(|a, b| a.1.score().partial_cmp(&b.1.score()).unwrap_or(std::cmp::Ordering::Equal))
            .ok_or(NotFound::NoFit)
    }

    /// Whether sweeps are to be preferred to others: fewer within the limit, else those that leave clearly more of the
    /// surface within it, else those whose largest error is smaller.
    pub(super) fn prefers(&self, new: &Fitted, known: &Fitted) -> bool {
        let enough = |fitted: &Fitted| fitted.worst() <= self.limit;
        if enough(new) || enough(known) {
            return enough(new) && (!enough(known) || new.bands.len() < known.bands.len());
        }
        let [of_new, of_known] = [new, known].map(|fitted| fitted.area_within(&self.whole, self.limit));
        if (of_new - of_known).abs() > CLEARLY { of_new > of_known } else { new.worst() < known.worst() }
    }

    /// Radii to start from: those that the wish fixes, or some spread evenly in proportion between what the wish and the
    /// part's hollows allow.
    fn radii(&self, chart: &Chart<'_>) -> Vec<(f64, f64)> {
        if let Some(ends) = self.wish.ends {
            return vec![ends];
        }
        let width = width(chart, &self.whole).1;
        let (low, high) = self.wish.radius;
        let high = high.min(1.5 * width).min(0.8 / hollow(chart, &self.whole).max(1e-9)).max(low);
        let low = low.max(0.04 * width).min(high);
        if high / low < 1.05 {
            let radius = (low * high).sqrt();
            return vec![(radius, radius)];
        }
        let radius = |i: usize| low * (high / low).powf((i as f64 + 0.5) / RADII as f64);
        (0..RADII).map(radius).map(|radius| (radius, radius)).collect()
    }

    /// Length of the flank that covers the widest band, mm.
    fn needed_length(&self, chart: &Chart<'_>, bands: &[Band], radii: (f64, f64)) -> f64 {
        let lengths = bands.iter().filter_map(|band| {
            let margin = margin(chart, band, radii.0.max(radii.1));
            Sweep::across(chart, *band, radii, margin, 33).map(|(_, length)| length)
        });
        lengths.fold(0.0, f64::max)
    }

    /// Lengths to start from, those that are not too long: as long as needed, or as wished at least. Between given ends
    /// the length is the cone's slope, so longer ones are tried too.
    fn lengths(&self, needed: f64) -> Vec<f64> {
        let least = needed.max(self.wish.length.0);
        let tried: &[f64] = if self.wish.ends.is_some() { &LENGTHS } else { &LENGTHS[..1] };
        tried.iter().map(|by| by * least).filter(|length| *length <= self.wish.length.1).collect()
    }

    fn start(&self, chart: &Chart<'_>, bands: &[Band], start: &Start) -> Option<(Vec<Sweep>, RadiusFunction)> {
        let Start { radii, length, seed, .. } = *start;
        let instants = QUICK_RESOLUTION.instants;
        let sweeps: Option<Vec<Sweep>> = bands
            .iter()
            .map(|band| match seed {
                Seed::Line => line_driven(chart, *band, (radii, length, self.wish.family), instants),
                Seed::Surface => {
                    let margin = margin(chart, band, radii.0.max(radii.1));
                    let (sweep, _) = Sweep::across(chart, *band, radii, margin, instants)?;
                    Some(sweep.stretched(length))
                }
            })
            .collect();
        let free = self.wish.coefficients.unwrap_or(FREE_COEFFICIENTS);
        let radius = match self.wish.ends {
            Some(ends) => RadiusFunction::between(ends, length),
            None => RadiusFunction::constant(self.wish.family, radii.0, length, free),
        };
        Some((sweeps?, radius?))
    }

    /// Fits in full with as many coefficients as pay. Each number starts from the quick fit: a fit converged with too
    /// few ends in a valley of its own, out of which more do not lead.
    fn finish(&self, chart: &Chart<'_>, quick: &Fitted) -> Option<Fitted> {
        let levels = match (self.wish.family, self.wish.coefficients) {
            (MeridianFamily::Free, None) => LEVELS.to_vec(),
            (_, wished) => vec![wished.unwrap_or(FREE_COEFFICIENTS)],
        };
        let mut best: Option<Fitted> = None;
        for level in levels {
            let radius = quick.radius.refined(level)?;
            let Some(next) = self.again(chart, quick, radius, &resolution(chart, &quick.bands, level), &FULL) else {
                continue;
            };
            let gain = best.as_ref().map_or(f64::INFINITY, |best| best.rms() / next.rms());
            if gain > 1.0 {
                best = Some(next);
            }
            let good = best.as_ref().is_some_and(|best| best.worst() < NEGLIGIBLE);
            if gain < GAIN || good || self.observer.stopped() {
                break;
            }
        }
        best
    }

    /// Fits again from what was fitted before, with another radius function or resolution.
    fn again(
        &self,
        chart: &Chart<'_>,
        before: &Fitted,
        radius: RadiusFunction,
        resolution: &Resolution,
        stages: &[(f64, usize)],
    ) -> Option<Fitted> {
        let sweeps: Option<Vec<Sweep>> = before
            .motions
            .iter()
            .zip(&before.bands)
            .map(|(motion, band)| Sweep::along(chart, motion, *band, resolution.instants))
            .collect();
        self.fit(chart, &sweeps?, (radius, before.seed), resolution, stages)
    }

    /// A sweep over one rectangle from a radius function, which is kept where it is held: along a motion found before
    /// as far as that passes, or straight across.
    pub(super) fn sweep_over(
        &self,
        chart: &Chart<'_>,
        (radius, before): (RadiusFunction, Option<&RuledMotion>),
        band: Band,
    ) -> Option<Fitted> {
        let ends = (radius.jet(0.0).radius, radius.jet(radius.length()).radius);
        let margin = margin(chart, &band, ends.0.max(ends.1));
        let resolution = resolution(chart, &[band], radius.coefficients().len());
        let sweep = match before {
            Some(motion) => Sweep::over(chart, motion, band, margin.1, resolution.instants)?,
            None => Sweep::across(chart, band, ends, margin, resolution.instants)?.0.stretched(radius.length()),
        };
        self.fit(chart, &[sweep], (radius, Seed::Surface), &resolution, &FULL)
    }

    /// The largest rectangle of the whole that a single sweep makes within the limit.
    pub(super) fn reached(&self, chart: &Chart<'_>, sweep: &Fitted) -> Option<Band> {
        let motion = sweep.motions.first()?;
        let resolution = resolution(chart, &sweep.bands, sweep.radius.coefficients().len());
        let dense = (resolution.instants * 4, resolution.heights * 2);
        judge(chart, (motion, &sweep.radius), (&self.whole, &self.whole), dense)?.largest_patch(&self.whole, self.limit)
    }

    fn fit(
        &self,
        chart: &Chart<'_>,
        sweeps: &[Sweep],
        (radius, seed): (RadiusFunction, Seed),
        resolution: &Resolution,
        stages: &[(f64, usize)],
    ) -> Option<Fitted> {
        let weights = &self.wish.weights;
        let terms = Terms::new(weights, 1.0);
        let size = (resolution.controls, resolution.heights);
        let mut fit = SweepFit::new((chart, sweeps), (radius, self.wish.radius), size, terms)?;
        let mut x = fit.start()?;
        let mut steps = 0;
        let mut best: Option<(Fitted, Vec<f64>)> = None;
        for (index, (guidance, max_steps)) in stages.iter().enumerate() {
            if steps > 0 && self.observer.stopped() {
                break;
            }
            fit.terms = Terms::new(weights, *guidance);
            let settings = Settings { max_steps: *max_steps, cost_share: 1e-7, ..Settings::default() };
            steps += minimize_bordered(&mut fit, &mut x, &settings, |_, _| true)?.steps;
            fit.settle(&x);
            // Quick fits are ranked among each other, and judged once.
            if stages.len() == QUICK.len() && index + 1 < stages.len() {
                continue;
            }
            let fitted = self.judged(&fit, &x, resolution)?;
            let score = fitted.score();
            let least = best.as_ref().map_or((u32::MAX, f64::INFINITY), |(best, _)| best.score());
            if score < least {
                best = Some((fitted, x.clone()));
            } else if score.0 > least.0 || score.1 > RUN_OFF * least.1 {
                break;
            }
        }
        let (mut fitted, x) = best?;
        if stages.len() > QUICK.len() && fitted.worst() > self.limit {
            fit.look(&x)?;
            if let Some((more, without)) = outliers::set_aside(&mut fit, &x, self.limit) {
                let again = self.judged(&fit, &without, resolution)?;
                steps += more;
                if again.share_within(self.limit) > fitted.share_within(self.limit) {
                    fitted = again;
                }
            }
        }
        (fitted.steps, fitted.seed) = (steps, seed);
        self.note(&fitted);
        (fitted.radius.first_invalid(200).is_none()).then_some(fitted)
    }

    /// What unknowns of a fit come to.
    fn judged(&self, fit: &SweepFit<'_>, x: &[f64], resolution: &Resolution) -> Option<Fitted> {
        let (chart, radius) = (fit.chart(), fit.radius(x));
        let motions = fit.motions(x)?;
        let bands: Vec<Band> = fit.bands().collect();
        let dense = (resolution.instants * 4, resolution.heights * 2);
        let one = |(motion, band)| judge(chart, (motion, &radius), (band, &self.whole), dense);
        let judged: Option<Vec<Judgement>> = motions.iter().zip(&bands).map(one).collect();
        Some(Fitted { radius, motions, bands, judged: judged?, steps: 0, seed: Seed::Surface })
    }
}

impl Search<'_> {
    fn note(&self, fitted: &Fitted) {
        let most = |of: fn(&Judgement) -> f64| fitted.judged.iter().map(of).fold(0.0, f64::max);
        self.observer.note(&Progress {
            strips: fitted.bands.len(),
            stage: Stage::Step(fitted.steps),
            overcut: most(|j| j.overcut),
            undercut: most(|j| j.undercut),
        });
    }
}

/// Control points by the way along the surface; places along the axis by the coefficients they have to settle.
fn resolution(chart: &Chart<'_>, bands: &[Band], coefficients: usize) -> Resolution {
    let longest = bands.iter().map(|band| way(chart, band)).fold(0.0, f64::max);
    let controls = ((longest / 2.5).ceil() as usize).clamp(20, 60);
    Resolution { controls, instants: 2 * controls + 1, heights: (5 * coefficients / 4 + 2).clamp(15, 61) }
}

/// How far a sweep runs past the borders of its band and past its ends, mm.
fn margin(chart: &Chart<'_>, band: &Band, radius: f64) -> (f64, f64) {
    (MARGIN * width(chart, band).0, (OVERRUN * radius).min(LONGEST_OVERRUN * way(chart, band)))
}

/// Mean and largest width of a band, mm.
fn width(chart: &Chart<'_>, band: &Band) -> (f64, f64) {
    let widths: Vec<f64> = (0..=8)
        .filter_map(|j| {
            let h = band.start + (band.end - band.start) * f64::from(j) / 8.0;
            Some((chart.frame((band.high, h))?.point - chart.frame((band.low, h))?.point).norm())
        })
        .collect();
    let mean = widths.iter().sum::<f64>() / widths.len().max(1) as f64;
    (mean, widths.iter().copied().fold(0.0, f64::max))
}

/// Length of a band's middle line, mm.
fn way(chart: &Chart<'_>, band: &Band) -> f64 {
    let middle = 0.5 * (band.low + band.high);
    let at = |j: i32| chart.frame((middle, band.start + (band.end - band.start) * f64::from(j) / 24.0));
    (0..24).filter_map(|j| Some((at(j + 1)?.point - at(j)?.point).norm())).sum()
}

/// Largest curvature of the part's hollows along the cut, 1/mm; 0 where there is none.
fn hollow(chart: &Chart<'_>, band: &Band) -> f64 {
    let mut most: f64 = 0.0;
    for i in 0..=20 {
        for j in 0..=20 {
            let (x, y) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
            let place = (band.low + x * (band.high - band.low), band.start + y * (band.end - band.start));
            let along = chart.frame(place).and_then(|frame| frame.along_gauge());
            let curvature = along.and_then(|(tangent, _)| chart.curvature(place, &tangent));
            most = most.max(curvature.unwrap_or(0.0));
        }
    }
    most
}

/// Layouts with the parameters' roles exchanged, tip and sense as wished.
pub(super) fn both_ways(of: impl Fn(bool) -> Option<Layout>, only: Option<bool>) -> Vec<Layout> {
    [true, false].into_iter().filter(|along_u| only.is_none_or(|wanted| wanted == *along_u)).filter_map(of).collect()
}
