use super::*;
use crate::geometry::{Point, SplineSurface};
use crate::motion::{PassKind, Pose};
use crate::part::{DesignSurface, OrientedSpline};
use crate::tool::{CutterShape, Fixture};

/// A hyperbolic paraboloid, 50 by 30 mm, twisted by 15 degrees over its width. A cylinder of radius 5 laid on its
/// rulings gouges 0.0155 mm; the best axis surface of eight cubic control points a rail is known to err by 0.0010 mm.
fn twisted() -> Part {
    let lift = 30.0 * 7.5_f64.to_radians().tan();
    let control = vec![
        vec![Point::new(0.0, 0.0, 0.0), Point::new(0.0, -lift, 30.0)],
        vec![Point::new(50.0, 0.0, 0.0), Point::new(50.0, lift, 30.0)],
    ];
    let knots = || vec![0.0, 0.0, 1.0, 1.0];
    let surface = SplineSurface::new([1, 1], [knots(), knots()], control, None).unwrap();
    let surface = DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap());
    Part { name: "twisted".into(), surface, body: None, check: Vec::new() }
}

fn cylinder() -> Tool {
    let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 40.0 };
    Tool::new(1, &shape, &Fixture { gauge_length: 90.0, ..Fixture::default() }).unwrap()
}

fn planned(method: Method) -> Plan {
    observed(method, &Unobserved)
}

fn observed(method: Method, observer: &dyn Observer) -> Plan {
    let (part, tool) = (twisted(), cylinder());
    let strategy = Strategy {
        method,
        direction: Some(Vector::x()),
        tip: Some(TipSide::Low),
        ..Strategy::new(StrategyKind::SingleSweep)
    };
    plan(&PlanRequest {
        name: "twisted",
        part: &part,
        tool: &tool,
        strategy: &strategy,
        overcut_tolerance: 0.001,
        undercut_tolerance: 0.001,
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0005,
        observer,
    })
    .unwrap()
}

#[test]
fn cylinder_on_a_twisted_surface_beats_the_best_known_axis_surface_tenfold() {
    let deviation = planned(Method::Regulus).strips[0].deviation;
    assert!(deviation.overcut < 1e-4 && deviation.undercut < 1e-4, "{deviation:?}");
}

#[test]
fn cylinder_on_the_rulings_gouges_as_is_known() {
    let deviation = planned(Method::Rulings).strips[0].deviation;
    // Rulings overrun both borders by 3 %, and the gouge grows with the square of their length.
    let expected = 0.0155 * 1.06 * 1.06;
    assert!((deviation.overcut - expected).abs() < 0.03 * expected, "{deviation:?}");
}

#[test]
fn passes_join_and_links_stay_outside_the_sphere_around_the_part() {
    let path = planned(Method::Regulus).path;
    let ends: Vec<(Pose, Pose)> = path
        .passes
        .iter()
        .map(|pass| {
            let (start, end) = pass.motion.domain();
            (pass.motion.pose(start).unwrap(), pass.motion.pose(end).unwrap())
        })
        .collect();
    for pair in ends.windows(2) {
        assert!(pair[0].1.distance_along(&pair[1].0, 40.0) < 1e-9, "{pair:?}");
    }
    let kinds: Vec<PassKind> = path.passes.iter().map(|pass| pass.kind).collect();
    use PassKind::{Approach, Cut, LeadIn, LeadOut, Rapid, Retract};
    assert_eq!(kinds, [Rapid, Approach, LeadIn, Cut, LeadOut, Retract, Rapid]);
    let surface = twisted().surface;
    let (first, last) = (ends[0].0, ends[ends.len() - 1].1);
    for pose in [first, last] {
        for height in [0.0, 40.0, 90.0] {
            let clear = surface.foot(&pose.at_height(height));
            assert!((pose.at_height(height) - clear.point).norm() > 10.0, "{pose:?}");
        }
    }
}

/// Wants the best so far from the outset.
#[derive(Debug)]
struct Impatient;

impl Observer for Impatient {
    fn note(&self, _progress: &Progress) {}

    fn stopped(&self) -> bool {
        true
    }
}

#[test]
fn a_stopped_plan_is_whole_and_says_so() {
    let stopped = observed(Method::Regulus, &Impatient);
    let whole = planned(Method::Regulus);
    assert!(stopped.interrupted && !whole.interrupted);
    assert_eq!(stopped.path.passes.len(), whole.path.passes.len());
    // Fewer steps, still better than the tool laid on its rulings.
    assert!(stopped.strips[0].steps < whole.strips[0].steps, "{:?}", stopped.strips[0]);
    assert!(stopped.strips[0].deviation.overcut < 0.0155, "{:?}", stopped.strips[0]);
}

/// Counts what it is told.
#[derive(Debug, Default)]
struct Counting(std::sync::atomic::AtomicUsize);

impl Observer for Counting {
    fn note(&self, progress: &Progress) {
        assert!(progress.overcut.is_finite() && progress.undercut.is_finite());
        self.0.fetch_add(1, std::sync::atomic::Ordering::SeqCst);
    }

    fn stopped(&self) -> bool {
        false
    }
}

#[test]
fn an_observer_is_told_of_every_strip_and_changes_nothing() {
    let counting = Counting::default();
    let watched = observed(Method::Regulus, &counting);
    assert_eq!(counting.0.into_inner(), 1);
    assert_eq!(watched.path, planned(Method::Regulus).path);
}
