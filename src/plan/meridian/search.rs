//! The search for a tool and its sweeps: starts from several layouts and radii, quick fits of all, the best ones fitted
//! in full with as many coefficients as pay.

use super::fit::SweepFit;
use super::judge::{Judgement, judge};
use super::problem::{Band, Sweep, Terms};
use super::radius::{FREE_COEFFICIENTS, MeridianFamily, RadiusFunction};
use super::{ToolWish, outliers};
use crate::motion::RuledMotion;
use crate::optimize::{Settings, minimize_bordered};
use crate::plan::chart::{Chart, Layout};
use crate::plan::strip::Resolution;
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

    /// Smallest share of a band that is covered.
    pub(super) fn covered(&self) -> f64 {
        self.judged.iter().map(Judgement::covered).fold(1.0, f64::min)
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
/// Radii from which the search starts.
const RADII: usize = 6;
/// Starts that are fitted in full.
const FINALISTS: usize = 2;
/// How far sweeps run past the borders of their band, as a share of its width, and past its ends, as one of the radius.
const MARGIN: f64 = 0.02;
const OVERRUN: f64 = 0.25;
/// Most of the latter, as a share of the band's length.
const LONGEST_OVERRUN: f64 = 0.04;
/// Share of a band that must be covered.
const COVERED: f64 = 0.998;

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
        let mut starts: Vec<(usize, f64)> = Vec::new();
        let mut shortest = f64::INFINITY;
        for (index, chart) in charts.iter().enumerate() {
            for radius in self.radii(chart) {
                let needed = self.needed_length(chart, bands, radius);
                shortest = shortest.min(needed);
                if needed <= self.wish.length.1 {
                    starts.push((index, radius));
                }
            }
        }
        if starts.is_empty() && shortest.is_finite() {
            return Err(NotFound::TooShort(shortest));
        }
        let quick = Resolution { controls: 12, instants: 25, heights: 11 };
        let mut tried: Vec<(usize, Fitted)> = starts
            .par_iter()
            .filter_map(|(index, radius)| {
                let (sweeps, start) = self.start(&charts[*index], bands, *radius, quick.instants)?;
                let fitted = self.fit(&charts[*index], &sweeps, start, &quick, &QUICK)?;
                (fitted.covered() > 0.9).then_some((*index, fitted))
            })
            .collect();
        tried.sort_by(|a, b| a.1.rms().total_cmp(&b.1.rms()));
        let finals: Vec<(usize, Fitted)> = tried
            .into_par_iter()
            .take(FINALISTS)
            .filter_map(|(index, fitted)| Some((index, self.finish(&charts[index], &fitted)?)))
            .collect();
        let score = |fitted: &Fitted| (fitted.covered() < COVERED, fitted.worst());
        finals
            .into_iter()
            .min_by(|a, b| score(&a.1).partial_cmp(&score(&b.1)).unwrap_or(std::cmp::Ordering::Equal))
            .ok_or(NotFound::NoFit)
    }

    /// Radii to start from: spread evenly in proportion between what the wish and the part's hollows allow.
    fn radii(&self, chart: &Chart<'_>) -> Vec<f64> {
        let width = width(chart, &self.whole).1;
        let (low, high) = self.wish.radius;
        let high = high.min(1.5 * width).min(0.8 / hollow(chart, &self.whole).max(1e-9)).max(low);
        let low = low.max(0.04 * width).min(high);
        if high / low < 1.05 {
            return vec![(low * high).sqrt()];
        }
        (0..RADII).map(|i| low * (high / low).powf((i as f64 + 0.5) / RADII as f64)).collect()
    }

    /// Length of the flank that covers the widest band, mm.
    fn needed_length(&self, chart: &Chart<'_>, bands: &[Band], radius: f64) -> f64 {
        let lengths = bands.iter().filter_map(|band| {
            let margin = margin(chart, band, radius);
            Sweep::across(chart, *band, radius, margin, 33).map(|(_, length)| length)
        });
        lengths.fold(0.0, f64::max)
    }

    fn start(
        &self,
        chart: &Chart<'_>,
        bands: &[Band],
        radius: f64,
        instants: usize,
    ) -> Option<(Vec<Sweep>, RadiusFunction)> {
        let length = self.needed_length(chart, bands, radius).max(self.wish.length.0);
        let sweeps: Option<Vec<Sweep>> = bands
            .iter()
            .map(|band| {
                let margin = margin(chart, band, radius);
                let (sweep, _) = Sweep::across(chart, *band, radius, margin, instants)?;
                Some(sweep.stretched(length))
            })
            .collect();
        let free = self.wish.coefficients.unwrap_or(FREE_COEFFICIENTS);
        Some((sweeps?, RadiusFunction::constant(self.wish.family, radius, length, free)?))
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
            let Some(next) = self.again(chart, quick, radius, &resolution(chart, quick, level), &FULL) else {
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
        self.fit(chart, &sweeps?, radius, resolution, stages)
    }

    fn fit(
        &self,
        chart: &Chart<'_>,
        sweeps: &[Sweep],
        radius: RadiusFunction,
        resolution: &Resolution,
        stages: &[(f64, usize)],
    ) -> Option<Fitted> {
        let weights = &self.wish.weights;
        let terms = Terms::new(weights, 1.0);
        let size = (resolution.controls, resolution.heights);
        let mut fit = SweepFit::new((chart, sweeps), (radius, self.wish.radius), size, terms)?;
        let mut x = fit.start()?;
        let mut steps = 0;
        for (guidance, max_steps) in stages {
            if steps > 0 && self.observer.stopped() {
                break;
            }
            fit.terms = Terms::new(weights, *guidance);
            let settings = Settings { max_steps: *max_steps, cost_share: 1e-7, ..Settings::default() };
            steps += minimize_bordered(&mut fit, &mut x, &settings, |_, _| true)?.steps;
            fit.settle(&x);
        }
        let mut fitted = judged(chart, &fit, &x, sweeps, resolution)?;
        if stages.len() > QUICK.len()
            && fitted.worst() > self.limit
            && let Some((more, without)) = outliers::set_aside(&mut fit, &x, self.limit)
        {
            let again = judged(chart, &fit, &without, sweeps, resolution)?;
            steps += more;
            if again.share_within(self.limit) > fitted.share_within(self.limit) {
                fitted = again;
            }
        }
        fitted.steps = steps;
        self.note(&fitted);
        (fitted.radius.first_invalid(200).is_none()).then_some(fitted)
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

fn judged(
    chart: &Chart<'_>,
    fit: &SweepFit<'_>,
    x: &[f64],
    sweeps: &[Sweep],
    resolution: &Resolution,
) -> Option<Fitted> {
    let radius = fit.radius(x);
    let motions = fit.motions(x)?;
    let bands: Vec<Band> = sweeps.iter().map(|sweep| sweep.band).collect();
    let dense = (resolution.instants * 4, resolution.heights * 2);
    let judged: Option<Vec<_>> =
        motions.iter().zip(&bands).map(|(motion, band)| judge(chart, (motion, &radius), band, dense)).collect();
    Some(Fitted { radius, motions, bands, judged: judged?, steps: 0 })
}

/// Control points by the way along the surface; places along the axis by the coefficients they have to settle.
fn resolution(chart: &Chart<'_>, fitted: &Fitted, coefficients: usize) -> Resolution {
    let longest = fitted.bands.iter().map(|band| way(chart, band)).fold(0.0, f64::max);
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
