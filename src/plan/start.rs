//! Where the search starts: one ruling per instant, its slant chosen by dynamic programming.
//!
//! A ruling stands on the lower border at time h and on the upper border at h + slant, both end spheres touching
//! (Rajain 2023, R7). Which slant is right is decided by the part's curvature along the ruling; the best one is found
//! for all instants together, so that the rails stay smooth and move forward.

use super::assess::Borders;
use super::chart::Chart;
use super::fit::{SphereFamily, StripSpec};
use crate::geometry::Point;

/// Shares of a ruling at which its fit is judged.
const JUDGED: usize = 9;
/// Slants tried to each side.
const SLANTS: i32 = 24;
/// What the largest slant must gain of a ruling's squared misfit.
const SLANT_PRICE: f64 = 0.2;
/// Share of the flank that a slanted ruling may take.
const USABLE: f64 = 0.96;
/// Largest slant tried, as a multiple of the strip's width.
const LARGEST_SLANT: f64 = 1.4;

/// A ruling that touches the part with both end spheres, and how well the flank between them fits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ruling {
    /// Centre of the lower sphere, mm.
    pub(super) lower: Point,
    /// Centre of the upper sphere, mm.
    pub(super) upper: Point,
    /// Root mean square deviation of the flank over the surface once the ruling may still shift and tilt, mm.
    pub(super) misfit: f64,
}

/// The ruling from (`low`, h) to (`high`, h + slant).
pub(super) fn ruling(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    (low, high): (f64, f64),
    (from, to): (f64, f64),
) -> Option<Ruling> {
    let (foot, head) = (chart.frame((low, from))?, chart.frame((high, to))?);
    let lower = foot.point + foot.normal * family.radius(lower_height).0;
    let mut upper = head.point + head.normal * family.radius(lower_height).0;
    for _ in 0..6 {
        let height = lower_height + (upper - lower).norm();
        upper = head.point + head.normal * family.radius(height).0;
    }
    let (span, length) = (upper - lower, (upper - lower).norm());
    // Beside the surface a ruling may lie as it likes.
    let mut errors = Vec::with_capacity(JUDGED);
    for k in 0..JUDGED {
        let f = k as f64 / (JUDGED - 1) as f64;
        let near = (low + f * (high - low), from + f * (to - from));
        let at = chart.foot(&(lower + span * f), near)?;
        if at.frame.inside() {
            errors.push((f, at.distance - family.radius(lower_height + f * length).0));
        }
    }
    Some(Ruling { lower, upper, misfit: misfit(&errors) })
}

/// Root mean square distance of values, each with its place, from their regression line; 0 for fewer than three.
fn misfit(values: &[(f64, f64)]) -> f64 {
    if values.len() < 3 {
        return 0.0;
    }
    let n = values.len() as f64;
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| values.iter().map(of).sum::<f64>();
    let (middle, mean) = (sum(&|v| v.0) / n, sum(&|v| v.1) / n);
    let spread = sum(&|v| (v.0 - middle).powi(2));
    let slope = sum(&|v| (v.0 - middle) * v.1) / spread;
    (sum(&|v| (v.1 - mean - slope * (v.0 - middle)).powi(2)) / n).sqrt()
}

/// The borders (`low`, `high`), and how many instants.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// g of the lower border, margins included.
    pub(super) low: f64,
    /// g of the upper border, margins included.
    pub(super) high: f64,
    /// What the strip must cover, without margins.
    pub(super) borders: Borders,
    /// Overrun beyond both ends of the surface, in h.
    pub(super) overrun: f64,
    /// Time samples.
    pub(super) instants: usize,
    /// False: rulings stand across the strip, at equal h on both borders.
    pub(super) slanted: bool,
}

/// A strip ready to be fitted: where its rails start and end, and a ruling per instant.
#[derive(Clone, Debug)]
pub(super) struct StripStart {
    /// Borders and times.
    pub(super) spec: StripSpec,
    /// One ruling per time sample: sphere centres on the lower and the upper rail.
    pub(super) rulings: Vec<(Point, Point)>,
    /// Largest misfit of the rulings, mm.
    pub(super) misfit: f64,
}

/// Chooses slants, then lays rulings so that both ends of each pass the surface's edges.
pub(super) fn start_strip(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    band: &Band,
) -> Option<StripStart> {
    let coarse = 25.min(band.instants);
    let (begin, end) = (band.borders.first, band.borders.last);
    let times: Vec<f64> = (0..coarse).map(|j| begin + (end - begin) * j as f64 / (coarse - 1) as f64).collect();
    let slants = match band.slanted {
        true => smoothed(choose_slants(chart, family, lower_height, band, &times)?),
        false => vec![0.0; coarse],
    };
    let slant = |h: f64| -> f64 {
        let x = ((h - begin) / (end - begin)).clamp(0.0, 1.0) * (coarse - 1) as f64;
        let i = (x as usize).min(coarse - 2);
        slants[i] + (x - i as f64) * (slants[i + 1] - slants[i])
    };
    let first = begin - slants[0].max(0.0) - band.overrun;
    let last = end - slants[coarse - 1].min(0.0) + band.overrun;
    let lower_time: Vec<f64> =
        (0..band.instants).map(|j| first + (last - first) * j as f64 / (band.instants - 1) as f64).collect();
    let upper_time: Vec<f64> = lower_time.iter().map(|h| h + slant(*h)).collect();
    let mut rulings = Vec::with_capacity(band.instants);
    let mut misfit = 0.0_f64;
    for (from, to) in lower_time.iter().zip(&upper_time) {
        let found = ruling(chart, family, lower_height, (band.low, band.high), (*from, *to))?;
        misfit = misfit.max(found.misfit);
        rulings.push((found.lower, found.upper));
    }
    let spec = StripSpec { low: band.low, high: band.high, lower_time, upper_time };
    Some(StripStart { spec, rulings, misfit })
}

/// Rounds off the steps between the slants tried: binomial smoothing, ends held.
fn smoothed(mut values: Vec<f64>) -> Vec<f64> {
    for _ in 0..values.len() {
        let inner: Vec<f64> = values.windows(3).map(|w| 0.25 * w[0] + 0.5 * w[1] + 0.25 * w[2]).collect();
        let last = values.len() - 1;
        values[1..last].copy_from_slice(&inner);
    }
    values
}

/// The slant, in h, at each of `times`: least sum of squared misfits plus a price for turning the axis.
fn choose_slants(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    band: &Band,
    times: &[f64],
) -> Option<Vec<f64>> {
    let h = 0.5 * (band.borders.first + band.borders.last);
    let middle = chart.frame((0.5 * (band.low + band.high), h))?;
    let width = (chart.frame((band.high, h))?.point - chart.frame((band.low, h))?.point).norm();
    let step = LARGEST_SLANT * width / f64::from(SLANTS) / middle.along.norm();
    let candidates: Vec<f64> = (-SLANTS..=SLANTS).map(|i| f64::from(i) * step).collect();
    let interval = times[1] - times[0];
    // A slanted ruling needs a longer flank; the fit may lengthen it a little more.
    let longest = USABLE * (family.highest() - lower_height);
    let price = 1e-9 * width * width;
    let mut best: Vec<f64> = Vec::new();
    let mut from: Vec<Vec<usize>> = Vec::new();
    let mut costs: Vec<Vec<f64>> = Vec::new();
    for (j, h) in times.iter().enumerate() {
        let local: Vec<f64> = candidates
            .iter()
            .map(|slant| {
                let found = ruling(chart, family, lower_height, (band.low, band.high), (*h, h + slant));
                let lean = slant / (step * f64::from(SLANTS));
                let fits = |r: &Ruling| *slant == 0.0 || (r.upper - r.lower).norm() <= longest;
                // Slant pays only where it clearly fits better: on a cylinder, say, every slant fits alike.
                let cost = |r: Ruling| r.misfit * r.misfit * (1.0 + SLANT_PRICE * lean * lean) + price * lean * lean;
                found.filter(fits).map_or(f64::INFINITY, cost)
            })
            .collect();
        costs.push(local.clone());
        if j == 0 {
            best = local;
            continue;
        }
        let mut next = vec![f64::INFINITY; candidates.len()];
        let mut back = vec![0; candidates.len()];
        for (c, slant) in candidates.iter().enumerate() {
            for (p, previous) in candidates.iter().enumerate() {
                let turn = slant - previous;
                // The upper rail must move forward, by at least a third of the lower one's way.
                if interval + turn < interval / 3.0 {
                    continue;
                }
                let steps = turn / step;
                let cost = best[p] + local[c] + price * steps * steps;
                if cost < next[c] {
                    next[c] = cost;
                    back[c] = p;
                }
            }
        }
        best = next;
        from.push(back);
    }
    let mut at = (0..best.len()).min_by(|a, b| best[*a].total_cmp(&best[*b]))?;
    if !best[at].is_finite() {
        return None;
    }
    let mut path = vec![at];
    for back in from.iter().rev() {
        at = back[at];
        path.push(at);
    }
    path.reverse();
    Some(path.iter().zip(&costs).map(|(at, local)| candidates[*at] + step * lowest(local, *at)).collect())
}

/// Where the parabola through a value and its two neighbours is lowest, in steps from it, within half a step.
fn lowest(values: &[f64], at: usize) -> f64 {
    let (Some(before), Some(after)) = (at.checked_sub(1).and_then(|i| values.get(i)), values.get(at + 1)) else {
        return 0.0;
    };
    let bend = before - 2.0 * values[at] + after;
    if bend > 0.0 && bend.is_finite() { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lowest_point_between_values_is_found() {
        let values: Vec<f64> = (0..5).map(|i| (f64::from(i) - 2.3).powi(2)).collect();
        assert!((lowest(&values, 2) - 0.3).abs() < 1e-12);
        assert_eq!((lowest(&values, 0), lowest(&[1.0, 0.0, f64::INFINITY], 1)), (0.0, 0.0));
    }

    #[test]
    fn misfit_ignores_shift_and_tilt() {
        let at = |of: &dyn Fn(f64) -> f64| (0..JUDGED).map(|i| (i as f64, of(i as f64))).collect::<Vec<_>>();
        assert!(misfit(&at(&|x| 3.0 - 0.7 * x)) < 1e-12);
        assert!(misfit(&at(&|x| (x - 4.0).powi(2))) > 1.0);
    }
}
