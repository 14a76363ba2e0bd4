//! Why a plan is as good as it is: per strip what limits it, and for the whole whether it keeps the tolerance and what
//! would help. Uses `geometry`, `motion`, `part` and `tool`.

use super::seam::{Engaged, Seam, seam};
use super::trace::rims;
use super::{Deviation, Gap, PlanRequest};
use crate::motion::RuledMotion;
use crate::part::OrientedSpline;
use crate::tool::{Element, Tool};
use rayon::prelude::*;
use serde::Serialize;

/// What keeps a strip from being better.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LimitedBy {
    /// Flutes beside the strip, shank or holder enter the part.
    Body,
    /// The strip leaves part of the surface uncovered.
    Coverage,
    /// Blocks and rounding cost as much as the strip does.
    Machine,
    /// The axis stands at the bound of the directions that the machine makes.
    AxisReach,
    /// The part's curvature along a straight flank.
    Curvature,
    /// The largest overcut allowed.
    OvercutLimit,
    /// The flute is engaged over its whole length.
    Reach,
    /// The strip alone: nothing else accounts for its error.
    Fit,
}

impl LimitedBy {
    /// In words for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Body => "flutes beside the strip, shank or holder",
            Self::Coverage => "coverage of the surface",
            Self::Machine => "blocks and rounding",
            Self::AxisReach => "the tool axis directions that the machine makes",
            Self::Curvature => "curvature along the flank",
            Self::OvercutLimit => "the overcut limit",
            Self::Reach => "reach of the flute",
            Self::Fit => "the fit",
        }
    }
}

/// What one strip came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StripReport {
    /// Deviation of its envelope, as planned.
    pub deviation: Deviation,
    /// Length of the way of the flank's middle, mm.
    pub length: f64,
    /// Widest engagement of the flank, mm.
    pub engagement: f64,
    /// Steps of the optimizer.
    pub steps: usize,
    /// How it meets the next strip; none for the last.
    pub seam: Option<Seam>,
    /// Least error, mm, of either sign, that the curvature of the part along the flank leaves a straight flank, 0 for a curved one:
    /// d^2 |k| / (16 (1 + rm k)).
    pub curvature_error: f64,
    /// What keeps it from being better.
    pub limited_by: LimitedBy,
}

/// A strip as a method leaves it.
#[derive(Clone, Debug)]
pub(super) struct Planned {
    pub(super) motion: RuledMotion,
    pub(super) deviation: Deviation,
    pub(super) steps: usize,
}

/// Instants at which a strip's size and curvature are looked at.
const INSTANTS: usize = 200;
/// Share of the curvature's error from which on it counts as the cause.
const CURVATURE_SHARE: f64 = 0.5;
/// Shares of the largest overcut allowed at which it counts as the cause.
const AT_LIMIT: std::ops::RangeInclusive<f64> = 0.9..=1.02;
/// Share of the flank from which on all of it counts as engaged.
const WHOLE_REACH: f64 = 0.97;

/// Reports on all strips of a plan. `bare`: part of the surface lies outside them.
pub(super) fn reports(
    request: &PlanRequest<'_>,
    tool: &Tool,
    part: &OrientedSpline,
    strips: &[Planned],
    bare: bool,
) -> Vec<StripReport> {
    let engaged = |motion| Engaged { motion, tool, flank: rims(tool) };
    strips
        .par_iter()
        .enumerate()
        .map(|(i, strip)| {
            let next = strips.get(i + 1);
            let seam = next.and_then(|next| seam(&engaged(&strip.motion), &engaged(&next.motion), part));
            let mut report = size(tool, part, strip);
            report.seam = seam;
            let outermost = i == 0 || next.is_none();
            report.limited_by = limit(request, tool, &report, bare && outermost);
            let error = strip.deviation.overcut.max(strip.deviation.undercut);
            if error > request.linearization
                && request.strategy.reach.as_ref().is_some_and(|b| b.holds_back(&strip.motion))
            {
                report.limited_by = LimitedBy::AxisReach;
            }
            report
        })
        .collect()
}

/// Length, engagement and curvature of a strip.
fn size(tool: &Tool, part: &OrientedSpline, strip: &Planned) -> StripReport {
    let motion = &strip.motion;
    let (start, end) = motion.domain();
    let at = |i: usize| start + (end - start) * i as f64 / INSTANTS as f64;
    let middle = |i: usize| nalgebra::center(&motion.lower.point(at(i)), &motion.upper.point(at(i)));
    let length = (0..INSTANTS).map(|i| (middle(i + 1) - middle(i)).norm()).sum();
    let spans = (0..=INSTANTS).map(|i| (motion.upper.point(at(i)) - motion.lower.point(at(i))).norm());
    let curvature = (0..=INSTANTS).step_by(5).filter_map(|i| curvature_error(tool, part, motion, at(i)));
    StripReport {
        deviation: strip.deviation,
        length,
        engagement: spans.fold(0.0, f64::max),
        steps: strip.steps,
        seam: None,
        curvature_error: curvature.fold(0.0, f64::max),
        limited_by: LimitedBy::Fit,
    }
}

/// Least two-sided error of a straight flank at an instant: the part's normal profile along the axis is a parabola, whose
/// best straight line in the middle of two touching ends misses it by d^2 |k'| / 16 either way, with k' = k / (1 + rm k)
/// the curvature of its offset by the mean radius rm (k > 0 where the part bulges), and d the engaged length along it.
fn curvature_error(tool: &Tool, part: &OrientedSpline, motion: &RuledMotion, t: f64) -> Option<f64> {
    let slope = -straight_flank(tool)?.contact(1.0).normal_axial;
    let (lower, upper) = (motion.lower.point(t), motion.upper.point(t));
    let middle = nalgebra::center(&lower, &upper);
    let foot = part.surface().closest(&middle);
    if foot.past_edge.is_some() {
        return None;
    }
    let bulge = -part.side() * part.surface().jet(foot.u, foot.v).curvature()?.normal_curvature(&(upper - lower))?;
    let radius = foot.distance;
    let along = (upper - lower).norm_squared() * (1.0 - slope * slope);
    let offset = 1.0 + radius * bulge;
    (offset > 1e-3).then(|| along * bulge.abs() / (16.0 * offset))
}

/// The flank of a cone or cylinder.
fn straight_flank(tool: &Tool) -> Option<&Element> {
    tool.flutes().last().filter(|element| matches!(element, Element::Line { .. }))
}

fn limit(request: &PlanRequest<'_>, tool: &Tool, report: &StripReport, bare: bool) -> LimitedBy {
    let Deviation { overcut, undercut, outside, .. } = report.deviation;
    let error = overcut.max(undercut);
    let flank = tool.flute_length() - straight_flank(tool).map_or(0.0, |e| e.start().height);
    if outside > error.max(request.overcut_tolerance) {
        LimitedBy::Body
    } else if bare || report.deviation.bare.is_some() {
        LimitedBy::Coverage
    } else if error <= request.linearization {
        LimitedBy::Machine
    } else if error >= CURVATURE_SHARE * report.curvature_error && report.curvature_error > 0.2 * error {
        LimitedBy::Curvature
    } else if AT_LIMIT.contains(&(overcut / request.overcut_tolerance)) {
        LimitedBy::OvercutLimit
    } else if report.engagement >= WHOLE_REACH * flank
        && error <= request.overcut_tolerance.max(request.undercut_tolerance)
    {
        LimitedBy::Reach
    } else {
        LimitedBy::Fit
    }
}

/// Whether a plan keeps the tolerance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PlanVerdict {
    /// True when every strip keeps the tolerance and all of the surface is covered.
    pub within_tolerance: bool,
    /// Why not, one sentence each.
    pub reasons: Vec<String>,
    /// What would help, one sentence each.
    pub help: Vec<String>,
}

/// Judges the strips as planned. `bare_share` of the surface lies outside them, and all of the `gaps` between them.
pub(super) fn verdict(request: &PlanRequest<'_>, strips: &[StripReport], bare_share: f64, gaps: &[Gap]) -> PlanVerdict {
    let mut verdict = PlanVerdict::default();
    let (over, under) = (request.overcut_tolerance, request.undercut_tolerance);
    let largest = |value: &dyn Fn(&StripReport) -> f64| {
        strips.iter().enumerate().map(|(i, s)| (value(s), i)).fold((0.0, 0), |a, b| if b.0 > a.0 { b } else { a })
    };
    let mut miss = |what: &str, (value, strip): (f64, usize), allowed: f64| {
        if value > allowed {
            verdict.reasons.push(format!(
                "strip {}: {what} is {value:.5} mm, allowed {allowed} mm; limited by {}",
                strip + 1,
                strips[strip].limited_by.words()
            ));
        }
    };
    miss("overcut", largest(&|s| s.deviation.overcut), over);
    miss("undercut", largest(&|s| s.deviation.undercut), under);
    miss("overcut beside the strip", largest(&|s| s.deviation.outside), over);
    verdict.reasons.extend(bare_reason(strips));
    verdict.reasons.extend(gaps.iter().map(|gap| gap_reason(gap, strips.len())));
    if bare_share > 0.0 {
        verdict.reasons.push(format!("{:.2} % of the surface lies outside all strips", bare_share * 100.0));
    }
    verdict.within_tolerance = verdict.reasons.is_empty();
    if !verdict.within_tolerance {
        verdict.help = help(request, strips, bare_share);
        if !gaps.is_empty() {
            verdict.help.push("for what is left uncut: a shorter or slimmer tool, or another direction".to_owned());
        }
    }
    verdict
}

/// What the strip that stops farthest short of its border leaves.
fn bare_reason(strips: &[StripReport]) -> Option<String> {
    let bare = strips.iter().enumerate().filter_map(|(i, strip)| Some((i, strip.deviation.bare?)));
    let (strip, bare) = bare.reduce(|most, next| if next.1.width > most.1.width { next } else { most })?;
    Some(format!(
        "strip {}: the flank stops {:.4} mm short of the strip's border near ({:.2}, {:.2}, {:.2})",
        strip + 1,
        bare.width,
        bare.at.x,
        bare.at.y,
        bare.at.z
    ))
}

fn gap_reason(gap: &Gap, strips: usize) -> String {
    let place = match gap.before {
        0 => "before strip 1".to_owned(),
        before if before == strips => format!("after strip {strips}"),
        before => format!("between strips {before} and {}", before + 1),
    };
    let Gap { at, why, .. } = gap;
    format!("{place}, near ({:.2}, {:.2}, {:.2}), the surface is left uncut: {why}", at.x, at.y, at.z)
}

fn help(request: &PlanRequest<'_>, strips: &[StripReport], bare_share: f64) -> Vec<String> {
    let mut help = Vec::new();
    let strain = |s: &StripReport| {
        let tolerance = |t: f64| if t > 0.0 { t } else { 1e-6 };
        let over = s.deviation.overcut / tolerance(request.overcut_tolerance);
        over.max(s.deviation.undercut / tolerance(request.undercut_tolerance))
    };
    let worst = strips.iter().max_by(|a, b| strain(a).total_cmp(&strain(b)));
    if let Some(worst) = worst.filter(|s| strain(s) > 1.0) {
        // The error grows with the square of the engaged length.
        let factor = strain(worst).sqrt();
        if worst.limited_by == LimitedBy::Fit {
            help.push("more weight on accuracy, less on kink and fairness".to_owned());
        } else if worst.limited_by == LimitedBy::AxisReach {
            help.push("the part turned by [part] placement, or a machine with more travel".to_owned());
        } else if worst.limited_by == LimitedBy::Machine {
            help.push(format!("a larger tolerance: blocks alone may leave {} mm", request.linearization));
        } else {
            help.push(format!(
                "shorter engagement, {:.2} mm of flank in place of {:.2}: about {} strips",
                worst.engagement / factor,
                worst.engagement,
                (strips.len() as f64 * factor).ceil()
            ));
        }
        if worst.limited_by == LimitedBy::Curvature {
            help.push("another direction, along which the part is flatter, or a barrel cutter".to_owned());
        }
    }
    if strips.iter().any(|s| s.deviation.outside > request.overcut_tolerance) {
        help.push(
            "a slimmer shank, shorter flutes or a longer engagement, so that nothing beside the strip cuts".to_owned(),
        );
    }
    if bare_share > 0.0 {
        let count = (strips.len() as f64 / (1.0 - bare_share).max(0.01)).ceil();
        help.push(format!("more strips, about {count}, or a longer flank"));
    }
    help
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::plan::{Bare, Strategy, StrategyKind, Unobserved};

    fn strip(overcut: f64, undercut: f64, outside: f64) -> StripReport {
        let deviation = Deviation { overcut, undercut, outside, samples: 100, bare: None };
        let limited_by = LimitedBy::Curvature;
        StripReport {
            deviation,
            length: 40.0,
            engagement: 10.0,
            steps: 9,
            seam: None,
            curvature_error: 0.01,
            limited_by,
        }
    }

    fn judged(strips: &[StripReport], bare_share: f64) -> PlanVerdict {
        let surface = crate::geometry::interpolate_grid(&[
            vec![crate::geometry::Point::origin(), crate::geometry::Point::new(0.0, 1.0, 0.0)],
            vec![crate::geometry::Point::new(1.0, 0.0, 0.0), crate::geometry::Point::new(1.0, 1.0, 0.0)],
        ]);
        let surface = crate::part::OrientedSpline::new(surface.unwrap(), false).unwrap();
        let surface = crate::part::DesignSurface::Spline(surface);
        let part = crate::part::Part { name: String::new(), surface, body: None, check: Vec::new() };
        let shape = crate::tool::CutterShape::Cylinder { diameter: 4.0, corner_radius: 0.0, flute_length: 12.0 };
        let fixture = crate::tool::Fixture { gauge_length: 40.0, ..Default::default() };
        let tool = Tool::new(1, &shape, &fixture).unwrap();
        let request = PlanRequest {
            name: "judged",
            part: &part,
            tool: &tool,
            strategy: &Strategy::new(StrategyKind::MultiStrip),
            overcut_tolerance: 0.01,
            undercut_tolerance: 0.02,
            cut_feed: 600.0,
            feed_reference: crate::motion::FeedReference::Mid,
            spindle_rpm: 8000.0,
            linearization: 0.001,
            observer: &Unobserved,
        };
        verdict(&request, strips, bare_share, &[])
    }

    #[test]
    fn what_keeps_the_tolerance_has_no_reasons() {
        let verdict = judged(&[strip(0.01, 0.02, 0.0), strip(0.0, 0.001, 0.005)], 0.0);
        assert_eq!(verdict, PlanVerdict { within_tolerance: true, ..PlanVerdict::default() });
    }

    #[test]
    fn what_a_strip_leaves_uncut_is_said_with_its_place() {
        let bare = |width: f64| Some(Bare { width, at: Point::new(1.0, 2.0, 3.0) });
        let mut strips = [strip(0.001, 0.001, 0.0), strip(0.001, 0.001, 0.0), strip(0.001, 0.001, 0.0)];
        (strips[1].deviation.bare, strips[2].deviation.bare) = (bare(0.5), bare(0.1));
        let verdict = judged(&strips, 0.0);
        assert!(!verdict.within_tolerance && verdict.reasons.len() == 1, "{verdict:?}");
        let said = "strip 2: the flank stops 0.5000 mm short of the strip's border near (1.00, 2.00, 3.00)";
        assert_eq!(verdict.reasons[0], said);
        let gap = |before| Gap { before, at: Point::new(1.0, 2.0, 3.0), why: "no".to_owned() };
        let places = [0, 2, 3].map(|before| gap_reason(&gap(before), 3));
        let said = "near (1.00, 2.00, 3.00), the surface is left uncut: no";
        let wanted = ["before strip 1", "between strips 2 and 3", "after strip 3"];
        assert_eq!(places, wanted.map(|place| format!("{place}, {said}")));
    }

    #[test]
    fn what_misses_it_says_which_strip_why_and_what_would_help() {
        let verdict = judged(&[strip(0.0, 0.001, 0.0), strip(0.001, 0.08, 0.0)], 0.0);
        assert_eq!(verdict.reasons.len(), 1);
        assert!(verdict.reasons[0].starts_with("strip 2: undercut is 0.08000 mm, allowed 0.02 mm"), "{verdict:?}");
        // Four times too much: half the engagement, twice the strips.
        assert!(verdict.help[0].contains("5.00 mm of flank in place of 10.00: about 4 strips"), "{verdict:?}");
        let verdict = judged(&[strip(0.001, 0.001, 0.3)], 0.5);
        assert_eq!((verdict.reasons.len(), verdict.help.len()), (2, 2), "{verdict:?}");
    }
}
