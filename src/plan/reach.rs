//! Directions of the tool axis that a plan must keep to, because the machine makes no others. What they are is told by
//! whoever knows the machine. Uses `diagnostic`, `geometry` and `motion`.

use super::Strategy;
use super::chart::{Chart, Layout, Lines};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Vector};
use crate::motion::{Pose, RuledMotion};
use crate::part::OrientedSpline;
use std::fmt::Debug;
use std::sync::Arc;

/// Tool axis directions, part frame, that can be had.
pub trait AxisReach: Debug + Send + Sync {
    /// How far a direction lies beyond them, radians; 0 for those that can be had.
    fn beyond(&self, axis: &Direction) -> f64;

    /// What would be needed for a direction beyond them, and what limits it.
    fn words(&self, axis: &Direction) -> String;
}

/// A bound on the tool axis, shared by all who keep to it.
#[derive(Clone, Debug)]
pub struct AxisBound(Arc<dyn AxisReach>);

impl PartialEq for AxisBound {
    /// True for the very same bound.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// Instants at which a strip's axis is looked at.
const INSTANTS: usize = 64;
/// How far inside the bound fits keep, radians: what refines them may move the axis a little.
pub(super) const MARGIN: f64 = 0.003;
/// Rounding, radians.
const SLACK: f64 = 1e-8;
/// Half the angle, radians, across which the way back inside is felt for.
const FEELER: f64 = 1e-4;
/// How far beyond the bound, radians, straight rulings may be for a fit to bring them back.
const FITTABLE: f64 = 0.1;
/// Places along each parameter at which lines are looked at.
const PLACES: i32 = 5;

impl AxisBound {
    /// Keeps to what `reach` allows.
    pub fn new(reach: impl AxisReach + 'static) -> Self {
        Self(Arc::new(reach))
    }

    /// How far an axis is beyond the bound or near it, radians, and the unit vector across the axis that leads farther
    /// out; none well inside.
    pub(super) fn pull(&self, axis: &Vector) -> Option<(f64, Vector)> {
        let beyond = |v: Vector| self.0.beyond(&Direction::new_normalize(v));
        let side = axis.cross(&if axis.x.abs() < 0.7 { Vector::x() } else { Vector::y() }).normalize();
        let sides = [side, axis.cross(&side)];
        // A little farther out in any direction: the bound is felt before it is passed.
        let step = MARGIN.tan();
        let felt = (0..8).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4).map(|turn| {
            let way = sides[0] * turn.cos() + sides[1] * turn.sin();
            (beyond(axis + way * step), way)
        });
        let (most, way) = felt.fold((0.0, side), |best, next| if next.0 > best.0 { next } else { best });
        if most <= 0.0 {
            return None;
        }
        let outermost = axis + way * step;
        let rate = |w: &Vector| (beyond(outermost + w * FEELER) - beyond(outermost - w * FEELER)) / (2.0 * FEELER);
        let out = (sides[0] * rate(&sides[0]) + sides[1] * rate(&sides[1])).try_normalize(1e-9).unwrap_or(way);
        Some((most, out))
    }

    /// True where a motion's axis stands at the bound somewhere.
    pub(super) fn holds_back(&self, motion: &RuledMotion) -> bool {
        instants(motion).any(|pose| self.pull(&pose.axis).is_some())
    }

    /// True where a motion's axis leaves the bound somewhere.
    pub(super) fn is_left(&self, motion: &RuledMotion) -> bool {
        instants(motion).any(|pose| self.0.beyond(&pose.axis) > SLACK)
    }

    /// Refuses motions whose axis leaves the bound.
    pub(super) fn check<'a>(&self, strips: impl ExactSizeIterator<Item = &'a RuledMotion>) -> Result<()> {
        let count = strips.len();
        let mut worst: Option<(f64, usize, Pose)> = None;
        for (strip, motion) in strips.enumerate() {
            for pose in instants(motion) {
                let by = self.0.beyond(&pose.axis);
                if by > worst.as_ref().map_or(SLACK, |worst| worst.0) {
                    worst = Some((by, strip, pose));
                }
            }
        }
        let Some((by, strip, pose)) = worst else { return Ok(()) };
        let (tip, axis) = (pose.tip, pose.axis);
        Err(Diagnostic::error(format!(
            "strip {} of {count}: with the tip at ({:.3}, {:.3}, {:.3}) the tool axis would point along ({:.4}, {:.4}, {:.4}), {:.2} degrees beyond what the machine makes: {}",
            strip + 1, tip.x, tip.y, tip.z, axis.x, axis.y, axis.z, by.to_degrees(), self.0.words(&axis)
        ))
        .help("turn the part by [part] placement, give another [strategy] direction, or use a machine with more travel"))
    }

    /// How far, radians, the rulings straight across lines are beyond the bound at the worst place.
    fn straight_across(&self, chart: &Chart<'_>) -> f64 {
        let at = |k: i32| f64::from(k) / f64::from(PLACES - 1);
        let places = (0..PLACES).flat_map(|i| (0..PLACES).map(move |j| (at(i), at(j))));
        let axes = places.filter_map(|place| Direction::try_new(chart.frame(place)?.across, 1e-9));
        axes.map(|axis| self.0.beyond(&axis)).fold(0.0, f64::max)
    }
}

/// Poses all along a motion.
fn instants(motion: &RuledMotion) -> impl Iterator<Item = Pose> {
    let (start, end) = motion.domain();
    (0..=INSTANTS).filter_map(move |i| motion.pose(start + (end - start) * i as f64 / INSTANTS as f64))
}

/// Of lines to lay strips along those whose rulings a fit can bring within the strategy's bound; all, where there are no
/// such lines.
pub(super) fn within_bound(
    strategy: &Strategy,
    spline: &OrientedSpline,
    lines: Vec<Lines>,
    layout: impl Fn(Lines) -> Option<Layout>,
) -> Vec<Lines> {
    let Some(bound) = &strategy.reach else { return lines };
    let fits = |lines: &Lines| {
        layout(lines.clone()).is_some_and(|layout| bound.straight_across(&Chart::new(spline, layout)) <= FITTABLE)
    };
    let kept: Vec<Lines> = lines.iter().filter(|lines| fits(lines)).cloned().collect();
    if kept.is_empty() { lines } else { kept }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, interpolate_grid};
    use crate::motion::FeedReference;
    use crate::part::{DesignSurface, Part};
    use crate::plan::{Method, Plan, PlanRequest, StrategyKind, Unobserved};
    use crate::tool::{CutterShape, Fixture, Tool};

    /// All directions within an angle of z.
    #[derive(Debug)]
    struct Cone(f64);

    impl AxisReach for Cone {
        fn beyond(&self, axis: &Direction) -> f64 {
            (axis.angle(&Direction::new_normalize(Vector::z())) - self.0).max(0.0)
        }
        fn words(&self, _: &Direction) -> String {
            format!("no more than {:.1} degrees off z", self.0.to_degrees())
        }
    }

    #[test]
    fn the_pull_leads_out_and_is_felt_only_near_the_bound() {
        let bound = AxisBound::new(Cone(0.2));
        let tilted = |angle: f64| Vector::new(angle.sin() * 0.6, angle.sin() * 0.8, angle.cos());
        assert!(bound.pull(&tilted(0.2 - 2.0 * MARGIN)).is_none());
        for angle in [0.2 - 0.5 * MARGIN, 0.2, 0.3] {
            let (by, out) = bound.pull(&tilted(angle)).unwrap();
            assert!((by - (angle + MARGIN - 0.2)).abs() < 0.1 * MARGIN, "{angle}: {by}");
            let expected = Vector::new(angle.cos() * 0.6, angle.cos() * 0.8, -angle.sin());
            assert!(out.dot(&expected) > 0.999, "{out} {expected}");
        }
    }

    /// A wall of 40 mm x 10 mm along x that leans by 3 degrees more at its end than at its start.
    fn planned(method: Method, degrees: f64) -> Result<Plan> {
        let point = |i: u32, j: u32| {
            let (x, h) = (f64::from(i), 0.5 * f64::from(j));
            let (sin, cos) = (3f64.to_radians() * x / 40.0).sin_cos();
            Point::new(x, h * sin, h * cos)
        };
        let rows: Vec<Vec<Point>> = (0..=40).map(|i| (0..=20).map(|j| point(i, j)).collect()).collect();
        let surface = OrientedSpline::new(interpolate_grid(&rows).unwrap(), false).unwrap();
        let surface = DesignSurface::Spline(surface);
        let part = Part { name: "wall".into(), surface, body: None, check: Vec::new() };
        let shape = CutterShape::Cylinder { diameter: 8.0, corner_radius: 0.0, flute_length: 20.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: 80.0, ..Fixture::default() }).unwrap();
        let strategy = Strategy {
            method,
            direction: Some(Vector::x()),
            reach: Some(AxisBound::new(Cone(degrees.to_radians()))),
            ..Strategy::new(StrategyKind::SingleSweep)
        };
        crate::plan::plan(&PlanRequest {
            name: "wall",
            part: &part,
            tool: &tool,
            strategy: &strategy,
            overcut_tolerance: 0.01,
            undercut_tolerance: 0.01,
            cut_feed: 600.0,
            feed_reference: FeedReference::Mid,
            spindle_rpm: 8000.0,
            linearization: 0.001,
            observer: &Unobserved,
        })
    }

    fn error(plan: &Plan) -> f64 {
        plan.strips.iter().map(|s| s.deviation.overcut.max(s.deviation.undercut)).fold(0.0, f64::max)
    }

    #[test]
    fn a_plan_keeps_to_its_bound_and_says_what_that_costs() {
        let (free, bound) = (planned(Method::Regulus, 10.0).unwrap(), planned(Method::Regulus, 2.0).unwrap());
        assert!(free.verdict.within_tolerance, "{:?}", free.verdict);
        // One degree too little over 10 mm, half of it to either side.
        assert!((0.03..0.2).contains(&error(&bound)), "{}", error(&bound));
        assert!(bound.verdict.reasons[0].contains("limited by the tool axis directions that the machine makes"));
        assert!(bound.verdict.help[0].contains("turned by [part] placement"), "{:?}", bound.verdict);
        // Checked at other instants than the fit looks at.
        let motions = bound.path.passes.iter().filter_map(|pass| match &pass.motion {
            crate::motion::PassMotion::Ruled(motion) if pass.kind == crate::motion::PassKind::Cut => Some(motion),
            _ => None,
        });
        for motion in motions {
            let (start, end) = motion.domain();
            for i in 0..=1000 {
                let axis = motion.pose(start + (end - start) * f64::from(i) / 1000.0).unwrap().axis;
                let angle = axis.angle(&Direction::new_normalize(Vector::z())).to_degrees();
                assert!(angle < 2.0 + 1e-3, "{angle}");
            }
        }
    }

    #[test]
    fn a_method_that_cannot_keep_to_the_bound_is_refused_with_strip_angle_and_limit() {
        let said = planned(Method::Rulings, 2.0).unwrap_err();
        for words in ["strip 1 of 1: with the tip at (", "degrees beyond", "no more than 2.0 degrees off z"] {
            assert!(said.message.contains(words), "{said}");
        }
        assert!(said.help.is_some());
    }
}
