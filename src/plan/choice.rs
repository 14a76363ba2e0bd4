//! Which of several cutters suits a part, before any optimization: by the law of what a flank can attain.
//!
//! For a straight flank the best two-sided error of a strip of width d is d^2 |k| / (16 (1 + r k)), with k the part's
//! normal curvature along the axis, positive where the part bulges, and r the mean sphere radius of the flank in use;
//! a curved meridian counts by the difference of the curvatures. The axis' direction is free at every place.

use super::Strategy;
use super::chart::{Chart, Lines};
use super::layout::{orient, runs_along_u};
use crate::diagnostic::Result;
use crate::part::Part;
use crate::tool::meridian::ArcSide;
use crate::tool::{Element, Tool};

/// What is expected of one cutter.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Prospect {
    /// Largest error of either sign with the predicted strips, mm; none where the cutter does not fit the part.
    pub error_mm: Option<f64>,
    /// Strips that the tolerance needs; none where the cutter does not fit the part.
    pub strips: Option<usize>,
    /// Time at the cutting feed, without leads and links, s.
    pub time_s: Option<f64>,
    /// What decides the number of strips, or why there are none.
    pub limited_by: Limit,
}

/// What limits a cutter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Limit {
    /// Strips are as wide as the flute is long.
    FluteLength,
    /// Strips are as narrow as the part's curvature asks for.
    Curvature,
    /// One strip does for all.
    None,
    /// The part is hollower than the cutter is slim.
    TooBig,
}

/// Places looked at along each parameter.
const PLACES: usize = 16;
/// Directions of the axis tried to each side of straight across the cut, and the farthest, radians.
const DIRECTIONS: i32 = 20;
const FARTHEST: f64 = 1.0;
/// Strips beyond this number are no plan.
const MOST_STRIPS: usize = 1000;

/// The flank of a cutter as the law sees it.
struct Flank {
    length: f64,
    radius: f64,
    curvature: f64,
}

impl Flank {
    /// The last element of the flutes, from a little above its start.
    fn of(tool: &Tool) -> Option<Self> {
        let element = tool.flutes().last()?;
        let (low, high) = (element.contact(0.02), element.contact(1.0));
        let curvature = match element {
            Element::Line { .. } => 0.0,
            Element::Arc { radius, side: ArcSide::Convex, .. } => 1.0 / radius,
            Element::Arc { radius, side: ArcSide::Concave, .. } => -1.0 / radius,
        };
        let length = (high.point.height - low.point.height).hypot(high.point.radius - low.point.radius);
        let radius = 0.5 * (low.sphere_radius() + high.sphere_radius());
        (length > 0.0 && radius.is_finite()).then_some(Self { length, radius, curvature })
    }

    /// Share |k| / (16 (1 + r k)) of the law, with hollows counted positive; none where the flank does not fit.
    fn share(&self, hollow: f64) -> Option<f64> {
        let room = 1.0 - self.radius * hollow;
        (room > 0.0).then(|| (hollow - self.curvature).abs() / (16.0 * room))
    }
}

/// Prospects of the cutters, in their order. `tolerance` is the allowed overcut and undercut, mm; `feed` in mm/min.
pub fn prospects(
    part: &Part,
    tools: &[&Tool],
    strategy: &Strategy,
    tolerance: (f64, f64),
    feed: f64,
) -> Result<Vec<Prospect>> {
    let form = part.surface.spline()?;
    let only = strategy.direction.map(|direction| runs_along_u(&form.spline, &direction));
    let layouts = [true, false].into_iter().filter(|along_u| only.is_none_or(|wanted| wanted == *along_u));
    let charts: Vec<Chart<'_>> = layouts
        .filter_map(|along_u| orient(strategy, &form.spline, Lines::parameter(along_u)))
        .map(|layout| Chart::new(&form.spline, layout))
        .collect();
    // A two-sided error of e can be shifted into any overcut and undercut that sum to 2 e.
    let allowed = 0.5 * (tolerance.0 + tolerance.1);
    Ok(tools
        .iter()
        .map(|tool| {
            let prospects = charts.iter().filter_map(|chart| prospect(chart, tool, allowed, feed));
            prospects.min_by(|a, b| order(a).total_cmp(&order(b))).unwrap_or(NOTHING)
        })
        .collect())
}

const NOTHING: Prospect = Prospect { error_mm: None, strips: None, time_s: None, limited_by: Limit::TooBig };

fn order(prospect: &Prospect) -> f64 {
    prospect.time_s.unwrap_or(f64::INFINITY)
}

/// Ranks prospects: those that fit first, by time, then by error, then by their place in the list.
pub fn ranking(prospects: &[Prospect]) -> Vec<usize> {
    let mut ranked: Vec<usize> = (0..prospects.len()).collect();
    let error = |i: usize| prospects[i].error_mm.unwrap_or(f64::INFINITY);
    ranked.sort_by(|a, b| {
        let times = order(&prospects[*a]).total_cmp(&order(&prospects[*b]));
        times.then(error(*a).total_cmp(&error(*b))).then(a.cmp(b))
    });
    ranked
}

/// What a strip may be at one place of the part.
struct Local {
    /// Widest strip within tolerance, across the cut, mm.
    width: f64,
    /// Least of the law's share over the directions, with the cosine of the slant squared counted in, 1/mm.
    share: f64,
    /// Whether the flute's length decided the width.
    by_flute: bool,
}

fn prospect(chart: &Chart<'_>, tool: &Tool, allowed: f64, feed: f64) -> Option<Prospect> {
    let flank = Flank::of(tool)?;
    let (mut strips, mut worst, mut way): (f64, f64, f64) = (0.0, 0.0, 0.0);
    let mut by_flute = false;
    let mut widest: f64 = 0.0;
    for j in 0..PLACES {
        let h = (j as f64 + 0.5) / PLACES as f64;
        let (mut needed, mut width) = (0.0, 0.0);
        for i in 0..PLACES {
            let place = ((i as f64 + 0.5) / PLACES as f64, h);
            let frame = chart.frame(place)?;
            let local = local(chart, place, &flank, allowed)?;
            let step = frame.across.norm() / PLACES as f64;
            needed += step / local.width;
            width += step;
            worst = worst.max(local.share);
            by_flute |= local.by_flute;
            way += frame.along.norm() / (PLACES * PLACES) as f64;
        }
        strips = strips.max(needed);
        widest = widest.max(width);
    }
    let strips = strips.ceil().max(1.0);
    if strips > MOST_STRIPS as f64 {
        return None;
    }
    let error = (widest / strips).powi(2) * worst;
    let limited_by = match (strips > 1.0, by_flute) {
        (false, _) => Limit::None,
        (true, true) => Limit::FluteLength,
        (true, false) => Limit::Curvature,
    };
    let time = strips * way / feed * 60.0;
    Some(Prospect { error_mm: Some(error), strips: Some(strips as usize), time_s: Some(time), limited_by })
}

/// The widest strip at a place over all directions of the axis; none where the cutter fits in no direction.
fn local(chart: &Chart<'_>, place: (f64, f64), flank: &Flank, allowed: f64) -> Option<Local> {
    let frame = chart.frame(place)?;
    let (across, _) = frame.across_gauge()?;
    let forward = frame.normal.cross(&across);
    let mut best: Option<Local> = None;
    for step in -DIRECTIONS..=DIRECTIONS {
        let slant = FARTHEST * f64::from(step) / f64::from(DIRECTIONS);
        let (sin, cos) = slant.sin_cos();
        let axis = across * cos + forward * sin;
        let sideways = forward * cos - across * sin;
        // Across its axis the cutter must be slimmer than the part is hollow.
        if chart.curvature(place, &sideways)? * flank.radius >= 1.0 {
            continue;
        }
        let Some(share) = flank.share(chart.curvature(place, &axis)?) else { continue };
        let by_curvature = (allowed / share.max(1e-12)).sqrt();
        let width = by_curvature.min(flank.length) * cos;
        // The strip of a given width across the cut is longer along a slanted axis.
        let share = share / (cos * cos);
        if best.as_ref().is_none_or(|known| width > known.width * (1.0 + 1e-9)) {
            best = Some(Local { width, share, by_flute: by_curvature > flank.length });
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Degrees, Point, SplineSurface, Vector};
    use crate::part::{DesignSurface, OrientedSpline};
    use crate::plan::StrategyKind;
    use crate::tool::{CutterShape, Fixture};

    /// A trough of radius `radius` along x, 40 mm long and 10 mm wide, the tool above it.
    fn trough(radius: f64) -> Part {
        let (half, rise) = (5.0, radius - (radius * radius - 25.0_f64).sqrt());
        // The arc as a rational quadratic: the middle control point is where its end tangents meet.
        let cos = (1.0 - (half / radius).powi(2)).sqrt();
        let middle = rise - half * half / (radius * cos);
        let row = |x: f64| vec![Point::new(x, -half, rise), Point::new(x, 0.0, middle), Point::new(x, half, rise)];
        let knots = [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]];
        let weights = Some(vec![vec![1.0, cos, 1.0]; 2]);
        let surface = SplineSurface::new([1, 2], knots, vec![row(0.0), row(40.0)], weights).unwrap();
        let surface = DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap());
        Part { name: "trough".into(), surface, body: None, check: Vec::new() }
    }

    fn tool(shape: &CutterShape) -> Tool {
        Tool::new(1, shape, &Fixture { gauge_length: 60.0, ..Fixture::default() }).unwrap()
    }

    fn cylinder(diameter: f64) -> Tool {
        tool(&CutterShape::Cylinder { diameter, corner_radius: 0.0, flute_length: 30.0 })
    }

    fn along_x() -> Strategy {
        Strategy { direction: Some(Vector::x()), ..Strategy::new(StrategyKind::MultiStrip) }
    }

    #[test]
    fn strips_follow_the_law_on_a_trough() {
        let (radius, r, allowed) = (60.0, 4.0, 0.002);
        let part = trough(radius);
        let cylinder = cylinder(2.0 * r);
        let prospect = &prospects(&part, &[&cylinder], &along_x(), (allowed, allowed), 600.0).unwrap()[0];
        // Slanted axes find less curvature: k cos^2, over a strip that is wider by 1 / cos; it does not pay.
        let k = 1.0 / radius;
        let width = (16.0 * allowed * (1.0 - r * k) / k).sqrt();
        let arc = 2.0 * radius * (5.0 / radius).asin();
        assert_eq!(prospect.strips, Some((arc / width).ceil() as usize), "{prospect:?}");
        assert!(prospect.error_mm.unwrap() <= allowed && prospect.limited_by == Limit::Curvature);
        let time = prospect.strips.unwrap() as f64 * 40.0 / 600.0 * 60.0;
        assert!((prospect.time_s.unwrap() - time).abs() < 1e-6);
    }

    #[test]
    fn what_fits_in_no_direction_is_too_big() {
        let found = prospects(&trough(15.0), &[&cylinder(140.0)], &along_x(), (0.002, 0.002), 600.0).unwrap();
        assert_eq!(found, [NOTHING]);
    }

    #[test]
    fn a_barrel_that_fits_the_trough_comes_first_and_what_is_too_thick_last() {
        let part = trough(60.0);
        let barrel = tool(&CutterShape::Barrel {
            diameter: 8.0,
            barrel_radius: 60.0,
            half_angle: Degrees(0.0),
            corner_radius: 0.0,
            flute_length: 20.0,
        });
        let (slim, huge) = (cylinder(8.0), cylinder(140.0));
        let tools = [&huge, &slim, &barrel];
        let prospects = prospects(&part, &tools, &along_x(), (0.002, 0.002), 600.0).unwrap();
        assert_eq!(ranking(&prospects), [2, 1, 0], "{prospects:?}");
        assert_eq!((prospects[2].strips, prospects[2].limited_by), (Some(1), Limit::None));
    }
}
