//! Where the search starts: one ruling per instant, its slant chosen by dynamic programming.
//!
//! A ruling stands on the lower border at time h and on the upper border at h + slant, both end spheres touching
//! (Rajain 2023, R7). Which slant is right is decided by the part's curvature along the ruling; the best one is found
//! for all instants together, so that the rails stay smooth and move forward.

use super::assess::Borders;
use super::chart::Chart;
use super::fit::{BESIDE_MARGIN, SphereFamily, StripSpec, side_foot};
use crate::geometry::Point;

/// Shares of a ruling at which its fit is judged.
const JUDGED: usize = 9;
/// Slants tried to each side.
const SLANTS: i32 = 24;
/// What the largest slant must gain of a ruling's squared misfit.
const SLANT_PRICE: f64 = 0.2;
/// Share of the flank that a slanted ruling may take.
const USABLE: f64 = 0.96;
/// One slant in so many is looked at for what the tool above the strip does, at every second instant.
const APART: usize = 4;
/// Points at which flutes above the strip are looked at.
const FLUTES: usize = 3;
/// How far beyond the surface, as a share of its parameter intervals, nothing above the strip can enter it any more.
const FAR: f64 = 0.3;
/// Width of the zone in which the deviations of a straight flank lie over their root mean square: 720^0.5 / 8.
const ZONE: f64 = 3.36;
/// Steps of a golden section: the last is a ten thousandth of the first.
const HALVINGS: usize = 20;
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
    laid(chart, family, lower_height, (low, high), (from, to)).map(|(ruling, _)| ruling)
}

/// The same with the deviations that its misfit is made of, mm, each with its place as a share of the ruling's length.
fn laid(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    (low, high): (f64, f64),
    (from, to): (f64, f64),
) -> Option<(Ruling, Vec<(f64, f64)>)> {
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
    Some((Ruling { lower, upper, misfit: misfit(&errors) }, errors))
}

/// By how much, mm, the zone of a ruling's deviations widens where the tool above the strip must not enter the part
/// either: at the rulings from h with these slants.
fn crowding(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    band: &Band,
    (h, slants): (f64, &[f64]),
) -> Vec<f64> {
    let of = |slant: f64| {
        let head = (band.high, h + slant);
        let (ruling, errors) = laid(chart, family, lower_height, (band.low, band.high), (h, head.1))?;
        Some(crowded(&errors, &beside(chart, family, (&ruling, lower_height), head)))
    };
    // Few are looked at: what is in the way of one is in the way of those next to it.
    let known: Vec<f64> = slants.iter().step_by(APART).map(|slant| of(*slant).unwrap_or(0.0)).collect();
    let between = |i: usize| known[i / APART].min(known[i.div_ceil(APART).min(known.len() - 1)]);
    (0..slants.len()).map(between).collect()
}

/// Clearances of the tool above a ruling that lie over the part, mm, each with its place as a share of the ruling's length:
/// flutes above the strip, shank and holder. What is surely clear is passed over.
fn beside(
    chart: &Chart<'_>,
    family: &SphereFamily,
    (ruling, lower_height): (&Ruling, f64),
    mut near: (f64, f64),
) -> Vec<(f64, f64)> {
    let (lower, span) = (ruling.lower, ruling.upper - ruling.lower);
    let length = span.norm();
    let axis = span / length;
    let top = lower_height + length;
    let flutes = (1..=FLUTES).map(|i| top + (family.highest() - top).max(0.0) * i as f64 / FLUTES as f64);
    let flutes = flutes.map(|height| (height, family.radius(height).0, false));
    let body = family.body().iter().map(|(height, radius)| (*height, *radius, true));
    let (mut found, mut clear) = (Vec::new(), top);
    for (height, radius, straight) in flutes.chain(body) {
        if height <= clear {
            continue;
        }
        let centre = lower + axis * (height - lower_height);
        let Some(foot) = chart.foot(&centre, near) else { break };
        near = foot.frame.place;
        if !foot.frame.within(FAR) {
            break;
        }
        let side = if straight { side_foot(chart, &centre, &axis, radius, &foot) } else { None };
        let (at, distance) = side.map_or((foot, foot.distance - radius), |side| (side, side.distance));
        // Going on along the axis the part comes no nearer than by the way gone.
        clear = height + (0.5 * distance).max(0.0);
        if at.frame.within(BESIDE_MARGIN) {
            found.push(((height - lower_height) / length, distance));
        }
    }
    found
}

/// By how much what must not enter the part beside a flank widens the zone, mm, in which the deviations of the flank lie
/// once it may shift and tilt. Both as (share, deviation).
fn crowded(flank: &[(f64, f64)], beside: &[(f64, f64)]) -> f64 {
    let extent = flank.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), (f, _)| (l.min(*f), h.max(*f)));
    let spread = extent.1 - extent.0;
    if beside.is_empty() || spread.is_nan() || spread <= 0.0 {
        return 0.0;
    }
    let height = |tilt: f64| flank.iter().map(|(f, e)| e + tilt * f).fold(f64::NEG_INFINITY, f64::max);
    let depth =
        |points: &[(f64, f64)], tilt: f64| points.iter().map(|(f, e)| -e - tilt * f).fold(f64::NEG_INFINITY, f64::max);
    let alone = |tilt: f64| height(tilt) + depth(flank, tilt);
    let all = |tilt: f64| height(tilt) + depth(flank, tilt).max(depth(beside, tilt));
    // No tilt that widens the zone by itself is of use.
    let (best, least) = lowest_of(alone, 2.0 * alone(0.0) / spread);
    if depth(beside, best) <= depth(flank, best) {
        return 0.0;
    }
    lowest_of(all, 2.0 * all(0.0) / spread).1 - least
}

/// Where a convex function is least between -`reach` and `reach`, and its value there: golden section.
fn lowest_of(value: impl Fn(f64) -> f64, reach: f64) -> (f64, f64) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (-reach, reach);
    let mut inner = [high - golden * (high - low), low + golden * (high - low)];
    let mut values = inner.map(&value);
    for _ in 0..HALVINGS {
        if values[0] < values[1] {
            high = inner[1];
            inner = [high - golden * (high - low), inner[0]];
            values = [value(inner[0]), values[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + golden * (high - low)];
            values = [values[1], value(inner[1])];
        }
    }
    let at = 0.5 * (low + high);
    (at, value(at))
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
    /// Most that they are crowded by, mm.
    pub(super) crowded: f64,
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
    let (slants, crowded) = match band.slanted {
        true => choose_slants(chart, family, lower_height, band, &times)?,
        false => (vec![0.0; coarse], 0.0),
    };
    let slants = smoothed(slants);
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
    Some(StripStart { spec, rulings, misfit, crowded })
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

/// The slant, in h, at each of `times`: least sum of squared misfits plus a price for turning the axis. With the most, mm,
/// that the tool above the strip crowds a ruling by.
fn choose_slants(
    chart: &Chart<'_>,
    family: &SphereFamily,
    lower_height: f64,
    band: &Band,
    times: &[f64],
) -> Option<(Vec<f64>, f64)> {
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
    let mut crowds: Vec<Vec<f64>> = Vec::new();
    for (j, h) in times.iter().enumerate() {
        let crowd = match crowds.last().filter(|_| j % 2 == 1) {
            Some(before) => before.clone(),
            None => crowding(chart, family, lower_height, band, (*h, &candidates)),
        };
        let local: Vec<f64> = candidates
            .iter()
            .zip(&crowd)
            .map(|(slant, crowded)| {
                let found = ruling(chart, family, lower_height, (band.low, band.high), (*h, h + slant));
                let lean = slant / (step * f64::from(SLANTS));
                let fits = |r: &Ruling| *slant == 0.0 || (r.upper - r.lower).norm() <= longest;
                // Slant pays only where it clearly fits better: on a cylinder, say, every slant fits alike.
                let cost = |r: Ruling| {
                    (r.misfit + crowded / ZONE).powi(2) * (1.0 + SLANT_PRICE * lean * lean) + price * lean * lean
                };
                found.filter(fits).map_or(f64::INFINITY, cost)
            })
            .collect();
        costs.push(local.clone());
        crowds.push(crowd);
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
    let crowded = path.iter().zip(&crowds).map(|(at, crowd)| crowd[*at]).fold(0.0, f64::max);
    Some((path.iter().zip(&costs).map(|(at, local)| candidates[*at] + step * lowest(local, *at)).collect(), crowded))
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
    fn what_lies_beside_a_flank_crowds_it_by_what_no_tilt_spares() {
        // A straight flank of length 1 over a hollow of curvature 8: touching at its ends it stands 1 above the middle.
        let over = |f: f64| 4.0 * f * (1.0 - f);
        let points = |from: f64, to: f64| (0..=20).map(move |i| from + (to - from) * f64::from(i) / 20.0);
        let flank: Vec<(f64, f64)> = points(0.0, 1.0).map(|f| (f, over(f))).collect();
        let beside = |of: &dyn Fn(f64) -> f64| points(1.05, 2.0).map(|f| (f, of(f))).collect::<Vec<_>>();
        // Twice as long it touches at 0 and 2, and stands 4 above the place at 1.
        let zone = crowded(&flank, &beside(&over));
        assert!((zone - 3.0).abs() < 1e-3, "{zone}");
        assert!(crowded(&flank, &beside(&|_| 0.1)).abs() < 1e-12);
        assert!(crowded(&flank, &[]).abs() < 1e-12);
    }

    #[test]
    fn misfit_ignores_shift_and_tilt() {
        let at = |of: &dyn Fn(f64) -> f64| (0..JUDGED).map(|i| (i as f64, of(i as f64))).collect::<Vec<_>>();
        assert!(misfit(&at(&|x| 3.0 - 0.7 * x)) < 1e-12);
        assert!(misfit(&at(&|x| (x - 4.0).powi(2))) > 1.0);
    }
}
