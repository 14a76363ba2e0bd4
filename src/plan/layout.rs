//! Which parameter the cut follows, where the tip is, and in which sense the cut runs.

use super::assess::Borders;
use super::chart::{Chart, Layout};
use super::fit::SphereFamily;
use super::start::{Band, start_strip};
use super::{PlanRequest, Strategy, StrategyKind, TipSide};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Point, Vector};
use crate::part::OrientedSpline;

/// Roles of the parameters: direction as wished or by least misfit, tip and sense as asked for.
pub(super) fn choose_layout(
    request: &PlanRequest<'_>,
    spline: &OrientedSpline,
    family: &SphereFamily,
) -> Result<Layout> {
    let strategy = request.strategy;
    let candidates: Vec<bool> = match strategy.direction {
        Some(direction) => vec![runs_along_u(spline, &direction)],
        None => vec![false, true],
    };
    let mut best: Option<(f64, Layout)> = None;
    for along_u in candidates {
        let Some(layout) = orient(strategy, spline, along_u) else { continue };
        let chart = Chart::new(spline, layout);
        let width = [0.0, 0.5, 1.0]
            .iter()
            .filter_map(|h| Some((chart.frame((1.0, *h))?.point - chart.frame((0.0, *h))?.point).norm()));
        let width = width.fold(0.0, f64::max);
        let reach = family.highest() - family.lowest();
        let share = (0.9 * reach / width).min(1.0) * if strategy.kind == StrategyKind::SingleSweep { 1.0 } else { 0.5 };
        let misfits = [0.0, 0.5, 1.0].iter().filter_map(|at| {
            let low = at * (1.0 - share);
            let borders = Borders { low, high: low + share };
            let band = Band { borders, low, high: low + share, overrun: 0.0, instants: 25, slanted: true };
            start_strip(&chart, family, family.lowest(), &band).map(|s| s.misfit)
        });
        let misfit = misfits.fold(f64::NEG_INFINITY, f64::max);
        if misfit.is_finite() && best.as_ref().is_none_or(|(least, _)| misfit < *least) {
            best = Some((misfit, layout));
        }
    }
    best.map(|(_, layout)| layout).ok_or_else(|| {
        Diagnostic::error("no cutting direction was found in which the tool can sweep this surface")
            .help("give [strategy] direction, use more strips, or a smaller tool")
    })
}

pub(super) fn runs_along_u(spline: &OrientedSpline, direction: &Vector) -> bool {
    let [(u0, u1), (v0, v1)] = spline.surface().domain();
    let mut score = 0.0;
    for i in 0..=4 {
        for j in 0..=4 {
            let jet = spline.surface().jet(u0 + (u1 - u0) * f64::from(i) / 4.0, v0 + (v1 - v0) * f64::from(j) / 4.0);
            score += jet.su.normalize().dot(direction).abs() - jet.sv.normalize().dot(direction).abs();
        }
    }
    score > 0.0
}

/// Fixes tip side and sense of the cut.
pub(super) fn orient(strategy: &Strategy, spline: &OrientedSpline, along_u: bool) -> Option<Layout> {
    let mut layout = Layout { along_u, tip_high: false, backward: false };
    let middle = Chart::new(spline, layout).frame((0.5, 0.5))?;
    let axis = middle.across.normalize();
    layout.tip_high = match strategy.tip {
        Some(side) => side == TipSide::High,
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
