//! Which way the cut runs: parameter lines or the level sets of a field, where the tip is, and in which sense.

use super::attainable::FlankLaw;
use super::chart::{Chart, Layout, Lines};
use super::field::{AxisField, Field, Sheet, Wish};
use super::fit::SphereFamily;
use super::forecast::bare_errors;
use super::reach::within_bound;
use super::{PlanRequest, Strategy, StrategyKind, TipSide};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Point, Vector};
use crate::part::OrientedSpline;
use rayon::prelude::*;
use std::sync::Arc;

/// Mean angle, degrees, up to which the parameter line nearest the wanted direction is taken for it.
const NEAR_ENOUGH: f64 = 20.0;
/// Constant angles that the search for a field starts from.
const STARTS: usize = 12;
/// Share of a direction that must lie in the surface.
const SQUARE: f64 = 0.1;
/// Most fields looked at.
const FIELDS: usize = 4;
/// Share of the flank that a strip's width may take: the rest overlaps.
const USABLE: f64 = 0.93;
/// How many times its reach a flank may have to span before lines count as unfit.
const TOO_LONG: f64 = 1.05;
/// Error, mm, that unfit lines count with: more than any that can be reached.
const UNFIT: f64 = 1e3;
/// Multiple of the tolerance from which on the tool above the strips is in the way.
const CROWDED: f64 = 2.0;
/// Strips predicted at most.
const MOST_STRIPS: usize = 200;

/// A layout and how many strips it is likely to need.
#[derive(Clone, Debug)]
pub(super) struct Choice {
    /// The layout.
    pub(super) layout: Layout,
    /// Fewest strips that the flank is long enough for.
    pub(super) least: usize,
    /// Predicted number of strips within tolerance, or the number asked for.
    pub(super) strips: usize,
    /// Predicted largest error, mm, in that many strips.
    error: f64,
    /// What the tool above the strips adds to it, mm, where that is more than the tolerance allows; otherwise 0.
    crowded: f64,
}

impl Choice {
    /// Room for the tool above the strips comes first; then fewer strips are better, then a smaller error; predicted ones
    /// decide only when they are clearly smaller.
    fn beats(&self, other: &Self) -> bool {
        if self.crowded < 0.9 * other.crowded || other.crowded < 0.9 * self.crowded {
            return self.crowded < other.crowded;
        }
        self.strips < other.strips || self.strips == other.strips && self.error < 0.9 * other.error
    }
}

/// Lines to cut along, those first that promise the fewest strips within tolerance, or the least error in the number asked
/// for; never empty.
pub(super) fn choose_layouts(
    request: &PlanRequest<'_>,
    spline: &OrientedSpline,
    family: &SphereFamily,
) -> Result<Vec<Choice>> {
    let lines = candidates(request.strategy, spline, &family.law())?;
    let lines = within_bound(request.strategy, spline, lines, |lines| orient(request.strategy, spline, lines));
    // In order, so that the choice does not depend on which is ready first.
    let choices: Vec<Option<Choice>> =
        lines.into_par_iter().map(|lines| predict(request, spline, family, lines)).collect();
    let mut left: Vec<Choice> = choices.into_iter().flatten().collect();
    let mut ranked = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let best = (1..left.len()).fold(0, |best, i| if left[i].beats(&left[best]) { i } else { best });
        ranked.push(left.remove(best));
    }
    if ranked.is_empty() {
        return Err(Diagnostic::error("no cutting direction was found in which the tool can sweep this surface")
            .help("give [strategy] direction, use more strips, or a smaller tool"));
    }
    Ok(ranked)
}

/// True where a direction runs along u rather than along v.
pub(super) fn runs_along_u(spline: &OrientedSpline, direction: &Vector) -> bool {
    angles_to(spline, direction).is_ok_and(|[off_u, off_v]| off_u < off_v)
}

/// Parameter lines first: what is simplest stands unless something else is clearly better.
fn candidates(strategy: &Strategy, spline: &OrientedSpline, flank: &FlankLaw) -> Result<Vec<Lines>> {
    let (mut lines, nearest) = match strategy.direction {
        None => (vec![Lines::AlongV, Lines::AlongU], None),
        Some(direction) => {
            let [off_u, off_v] = angles_to(spline, &direction)?;
            let nearest = if off_u < off_v { Lines::AlongU } else { Lines::AlongV };
            if off_u.min(off_v) <= NEAR_ENOUGH && strategy.direction_weight >= 1.0 {
                return Ok(vec![nearest]);
            }
            (Vec::new(), Some(nearest))
        }
    };
    let Some(sheet) = Sheet::new(spline) else { return Ok(lines) };
    let wish = strategy.direction.map(|direction| Wish { direction, weight: strategy.direction_weight });
    let starts: Vec<usize> = (0..STARTS).collect();
    let solved: Vec<Option<AxisField>> = starts
        .into_par_iter()
        .map(|k| AxisField::solve(&sheet, flank, wish, std::f64::consts::PI * k as f64 / STARTS as f64))
        .collect();
    let mut axes: Vec<AxisField> = Vec::new();
    for field in solved.into_iter().flatten() {
        if !axes.iter().any(|known| known.resembles(&field, &sheet)) {
            axes.push(field);
        }
    }
    axes.sort_by(|a, b| a.worst.total_cmp(&b.worst));
    let fields = axes.iter().filter_map(|axis| Field::new(&sheet, axis, wish));
    // What the user wants can always be had, whatever the curvature would prefer.
    let plain = wish.map(|wish| AxisField::square_to(&sheet, &wish.direction, flank));
    let plain = plain.and_then(|axis| Field::new(&sheet, &axis, wish));
    lines.extend(fields.take(FIELDS).chain(plain).map(|field| Lines::Field(Arc::new(field))));
    if lines.is_empty() {
        lines.extend(nearest);
    }
    Ok(lines)
}

/// How many strips along these lines are likely to need, judged by the rulings of a few of them.
fn predict(request: &PlanRequest<'_>, spline: &OrientedSpline, family: &SphereFamily, lines: Lines) -> Option<Choice> {
    let strategy = request.strategy;
    let layout = orient(strategy, spline, lines)?;
    let chart = Chart::new(spline, layout.clone());
    let reach = family.law().reach;
    let least = fewest(&chart, reach)?;
    let wanted = match strategy.kind {
        StrategyKind::SingleSweep => Some(1),
        StrategyKind::MultiStrip => strategy.strips,
    };
    let tolerance = 0.5 * (request.overcut_tolerance + request.undercut_tolerance);
    let mut strips = wanted.unwrap_or(least);
    loop {
        let stretch = stretch(&chart, strips)? / reach;
        // Of lines along which the flank is too short, those that ask least of it.
        let [error, beside] =
            if stretch > TOO_LONG { [UNFIT * stretch, 0.0] } else { foreseen(&chart, family, strips)? };
        let next = (strips as f64 * (error / tolerance).sqrt().min(1.5)).ceil() as usize;
        if wanted.is_some() || error <= tolerance || next <= strips || next > MOST_STRIPS {
            let crowded = if error + beside > CROWDED * tolerance { beside } else { 0.0 };
            return Some(Choice { layout, least, strips, error, crowded });
        }
        strips = next;
    }
}

/// Fewest strips for which a flank of this reach is long enough.
fn fewest(chart: &Chart<'_>, reach: f64) -> Option<usize> {
    let mut count = 1;
    loop {
        let usable = if count == 1 { reach } else { USABLE * reach };
        let stretch = stretch(chart, count)?;
        if stretch <= usable || count >= MOST_STRIPS {
            return Some(count);
        }
        count = (count + 1).max((0.9 * count as f64 * stretch / usable) as usize).min(MOST_STRIPS);
    }
}

/// Shares of the strips' range at which a few of them are looked at.
const LOOKED_AT: [f64; 5] = [0.0, 0.25, 0.5, 0.75, 1.0];

/// Longest line h = const, mm, straight across one of a few of `count` equal strips.
fn stretch(chart: &Chart<'_>, count: usize) -> Option<f64> {
    const STEPS: u32 = 12;
    let share = 1.0 / count as f64;
    let mut longest: f64 = 0.0;
    for at in LOOKED_AT {
        let low = at * (1.0 - share);
        let (first, last) = chart.span(low, low + share);
        for j in 0..=STEPS {
            let h = first + (last - first) * f64::from(j) / f64::from(STEPS);
            let [lower, middle, upper] = [0.0, 0.5, 1.0].map(|across| chart.frame((low + across * share, h)));
            let (lower, middle, upper) = (lower?, middle?, upper?);
            if lower.inside() || middle.inside() || upper.inside() {
                longest = longest.max((upper.point - lower.point).norm());
            }
        }
    }
    Some(longest)
}

/// Largest error, mm, foreseen for a few of `count` equal strips, and the most that the tool above them adds to it.
fn foreseen(chart: &Chart<'_>, family: &SphereFamily, count: usize) -> Option<[f64; 2]> {
    let share = 1.0 / count as f64;
    let errors = LOOKED_AT.iter().filter_map(|at| {
        let low = at * (1.0 - share);
        bare_errors(chart, family, (low, low + share))
    });
    errors.reduce(|[error, beside], [other, more]| [error.max(other), beside.max(more)])
}

/// Mean angles, degrees, between the parameter lines (along u, along v) and a direction, which must not stand square to
/// the surface anywhere.
fn angles_to(spline: &OrientedSpline, direction: &Vector) -> Result<[f64; 2]> {
    let [(u0, u1), (v0, v1)] = spline.surface().domain();
    let mut sums = [0.0; 2];
    for i in 0..=4 {
        for j in 0..=4 {
            let jet = spline.surface().jet(u0 + (u1 - u0) * f64::from(i) / 4.0, v0 + (v1 - v0) * f64::from(j) / 4.0);
            let normal = jet.su.cross(&jet.sv).normalize();
            let tangent = direction - normal * normal.dot(direction);
            if tangent.norm() < SQUARE * direction.norm() {
                let at = jet.point;
                return Err(Diagnostic::error(format!(
                    "the cutting direction stands square to the surface near ({:.3}, {:.3}, {:.3}): nothing can be cut along it",
                    at.x, at.y, at.z
                ))
                .help("give a [strategy] direction that runs along the surface, or leave it out"));
            }
            let off = |line: &Vector| line.cross(&tangent).norm().atan2(line.dot(&tangent).abs()).to_degrees();
            sums = [sums[0] + off(&jet.su), sums[1] + off(&jet.sv)];
        }
    }
    Ok(sums.map(|sum| sum / 25.0))
}

/// Fixes tip side and sense of the cut.
pub(super) fn orient(strategy: &Strategy, spline: &OrientedSpline, lines: Lines) -> Option<Layout> {
    let mut layout = Layout { lines, tip_high: false, backward: false };
    let middle = Chart::new(spline, layout.clone()).frame((0.5, 0.5))?;
    let axis = middle.across.normalize();
    layout.tip_high = match strategy.tip {
        Some(side) => (side == TipSide::High) != reversed(&layout.lines, spline),
        None => axis.dot(&spindle_side(strategy, &middle.point, &axis)) < 0.0,
    };
    let axis = if layout.tip_high { -axis } else { axis };
    // With a clockwise spindle the cut is climb milling when the material is to the right of the feed.
    let right = middle.along.cross(&axis);
    let climbs = right.dot(&-middle.normal) > 0.0;
    layout.backward = climbs != strategy.climb;
    Some(layout)
}

fn spindle_side(strategy: &Strategy, at: &Point, axis: &Vector) -> Vector {
    let outward = Vector::new(at.x, at.y, 0.0);
    match strategy.spindle {
        Some(side) => side,
        None if axis.z.abs() > 0.35 || outward.norm() < 1e-6 => Vector::z(),
        None => outward,
    }
}

/// Whether the lines' own g falls where the surface parameter that it mostly follows rises: sides are named by that.
fn reversed(lines: &Lines, spline: &OrientedSpline) -> bool {
    let Lines::Field(field) = lines else { return false };
    let (_, by) = field.jet((0.5, 0.5));
    let [(u0, u1), (v0, v1)] = spline.surface().domain();
    let jet = spline.surface().jet(0.5 * (u0 + u1), 0.5 * (v0 + v1));
    let (by_s, by_t) = (by[(0, 0)] / (jet.su.norm() * (u1 - u0)), by[(0, 1)] / (jet.sv.norm() * (v1 - v0)));
    if by_s.abs() > by_t.abs() { by_s < 0.0 } else { by_t < 0.0 }
}
