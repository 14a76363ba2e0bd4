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
    plan(&PlanRequest { observer, ..request(&part, &tool, &strategy) }).unwrap()
}

fn request<'a>(part: &'a Part, tool: &'a Tool, strategy: &'a Strategy) -> PlanRequest<'a> {
    PlanRequest {
        name: "twisted",
        part,
        tool,
        strategy,
        overcut_tolerance: 0.001,
        undercut_tolerance: 0.001,
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0005,
        observer: &Unobserved,
    }
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

/// A plan of `surface` with a cylinder, or why there is none.
fn attempt(surface: SplineSurface, diameter: f64, flute_length: f64, strategy: &Strategy) -> Result<Plan> {
    let surface = DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap());
    let part = Part { name: "part".into(), surface, check: Vec::new(), body: None };
    let shape = CutterShape::Cylinder { diameter, corner_radius: 0.0, flute_length };
    let tool = Tool::new(1, &shape, &Fixture { gauge_length: 90.0, ..Fixture::default() }).unwrap();
    plan(&PlanRequest {
        name: "part",
        part: &part,
        tool: &tool,
        strategy,
        overcut_tolerance: 0.002,
        undercut_tolerance: 0.002,
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0002,
        observer: &Unobserved,
    })
}

/// A square of 24 mm of z = k (x² + y²) / 2, hollow for positive k.
fn bowl(k: f64) -> SplineSurface {
    let knots = || vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let (ends, square) = ([-12.0, 0.0, 12.0], [144.0, -144.0, 144.0]);
    let at = |i: usize, j: usize| Point::new(ends[i], ends[j], 0.5 * k * (square[i] + square[j]));
    let rows = (0..3).map(|i| (0..3).map(|j| at(i, j)).collect()).collect();
    SplineSurface::new([2, 2], [knots(), knots()], rows, None).unwrap()
}

#[test]
fn strips_run_the_way_the_user_wants_across_the_parameter_lines() {
    let direction = Vector::new(1.0, 0.8, 0.0);
    let strategy = Strategy {
        direction: Some(direction),
        strips: Some(5),
        spindle: Some(Vector::y()),
        ..Strategy::new(StrategyKind::MultiStrip)
    };
    let planned = attempt(bowl(-0.001), 6.0, 9.0, &strategy).unwrap();
    assert_eq!(planned.strips.len(), 5);
    for strip in &planned.strips {
        assert!(strip.deviation.overcut < 0.02 && strip.deviation.undercut < 0.02, "{strip:?}");
    }
    for pass in planned.path.passes.iter().filter(|pass| pass.kind == PassKind::Cut) {
        let (start, end) = pass.motion.domain();
        let at = |t: f64| pass.motion.pose(t).unwrap().at_height(4.0);
        let along = at(end) - at(start);
        let off = along.cross(&direction).norm().atan2(along.dot(&direction).abs()).to_degrees();
        assert!(off < 10.0, "strip {:?} runs {off} degrees off", pass.strip);
    }
}

/// A plane 40 mm long, 8 mm wide at y < 8 and above it from 4 mm wide at one end to 12 mm at the other.
fn flared() -> SplineSurface {
    let line = |x: f64, top: f64| vec![Point::new(x, 0.0, 0.0), Point::new(x, 8.0, 0.0), Point::new(x, top, 0.0)];
    let knots = [vec![0.0, 0.0, 1.0, 1.0], vec![0.0, 0.0, 0.5, 1.0, 1.0]];
    SplineSurface::new([1, 1], knots, vec![line(0.0, 12.0), line(40.0, 20.0)], None).unwrap()
}

#[test]
fn where_one_strip_cannot_be_laid_the_others_are_and_the_plan_says_what_it_leaves() {
    let strategy = Strategy {
        method: Method::Rulings,
        direction: Some(Vector::x()),
        tip: Some(TipSide::Low),
        strips: Some(2),
        ..Strategy::new(StrategyKind::MultiStrip)
    };
    let plan = attempt(flared(), 6.0, 10.0, &strategy).unwrap();
    assert_eq!((plan.strips.len(), plan.gaps.len(), plan.gaps[0].before), (1, 1, 1));
    assert!((plan.gaps[0].at - Point::new(20.0, 12.0, 0.0)).norm() < 1.0, "{:?}", plan.gaps);
    assert!(!plan.verdict.within_tolerance && plan.verdict.reasons[0].starts_with("after strip 1, near ("));
    assert!(plan.verdict.reasons[0].contains("left uncut: the tool is too short by"), "{:?}", plan.verdict);
    assert!(!plan.verdict.help.is_empty());
}

#[test]
fn bands_in_which_the_shank_is_in_the_way_are_left_out_with_the_reason() {
    let four = Strategy { strips: Some(4), ..Strategy::new(StrategyKind::MultiStrip) };
    let plan = attempt(bowl(0.03), 6.0, 9.0, &four).unwrap();
    assert!((1..4).contains(&plan.strips.len()), "{} strips", plan.strips.len());
    let why = "what is above the flutes would cut";
    assert!(plan.gaps.iter().any(|gap| gap.why.contains(why)), "{:?}", plan.gaps);
    assert!(plan.verdict.reasons.iter().any(|reason| reason.contains(why)), "{:?}", plan.verdict);
}

fn law(shape: &CutterShape) -> FlankLaw {
    let tool = Tool::new(1, shape, &Fixture { gauge_length: 90.0, ..Fixture::default() }).unwrap();
    flank(&tool, &Strategy { engage_from: Some(0.0), ..Strategy::new(StrategyKind::SingleSweep) }).unwrap().law()
}

#[test]
fn a_cone_reaches_as_far_as_its_contacts_lie_apart() {
    let law = law(&CutterShape::EndSpheres { r1: 0.3, r2: 1.0, length: 1.717 });
    assert!((law.reach - (1.717_f64.powi(2) - 0.49).sqrt()).abs() < 1e-6, "{law:?}");
    assert!((law.radius - 0.65).abs() < 1e-6 && law.bend.abs() < 1e-6, "{law:?}");
}

#[test]
fn the_flank_of_a_tapered_ball_begins_where_its_ball_ends() {
    let half_angle = crate::geometry::Degrees(10.0);
    let shape = CutterShape::TaperedBall { ball_diameter: 6.0, half_angle, flute_length: 20.0 };
    let tool = Tool::new(1, &shape, &Fixture { gauge_length: 90.0, ..Fixture::default() }).unwrap();
    let from = |height| Strategy { engage_from: Some(height), ..Strategy::new(StrategyKind::SingleSweep) };
    let family = flank(&tool, &from(0.0)).unwrap();
    let end = tool.flutes().last().unwrap().start().height;
    assert!((family.lowest() - 3.0).abs() < 1e-9, "the ball is one sphere, at {}", family.lowest());
    assert!((family.contact_height(family.lowest()) - end).abs() < 1e-9);
}

#[test]
fn a_barrel_lies_without_error_in_a_hollow_of_its_own_radius() {
    let barrel = law(&CutterShape::Barrel {
        diameter: 10.0,
        barrel_radius: 85.0,
        half_angle: crate::geometry::Degrees(0.0),
        corner_radius: 0.0,
        flute_length: 20.0,
    });
    let straight = FlankLaw { bend: 0.0, ..barrel };
    assert!(barrel.error(1.0 / 85.0, 18.0) < 0.02 * straight.error(1.0 / 85.0, 18.0), "{barrel:?}");
    assert!(barrel.error(0.0, 18.0) > straight.error(0.0, 18.0));
}

#[test]
fn the_law_is_known_before_the_plan() {
    let (part, tool) = (twisted(), cylinder());
    let map = attainable(&part, &tool, &Strategy::new(StrategyKind::MultiStrip)).unwrap();
    // A hyperbolic paraboloid carries straight lines everywhere.
    assert!(map.worst() < 1e-9, "{}", map.worst());
}

#[test]
fn what_cannot_be_planned_is_refused_with_place_and_remedy() {
    let free = Strategy::new(StrategyKind::MultiStrip);
    let upward = Strategy { direction: Some(Vector::z()), ..free.clone() };
    let two = Strategy { strips: Some(2), ..free.clone() };
    let cases = [
        (attempt(bowl(0.001), 6.0, 9.0, &upward), "stands square to the surface near ("),
        (attempt(bowl(0.2), 16.0, 9.0, &free), "hollow with radius"),
        (attempt(bowl(-0.001), 6.0, 9.0, &two), "too short by"),
    ];
    for (refused, why) in cases {
        let error = refused.err().unwrap();
        assert!(error.message.contains(why) && error.help.is_some(), "{error}");
    }
}

/// A surface 40 by 16 mm with a bulge of radius 1000 mm along the tool's axis and a wave along the cut, in two strips.
fn two_strips(smoothness: f64) -> Plan {
    let fall = 16.0_f64.powi(2) / 2000.0;
    let wave = [0.0, 0.06, -0.04, 0.03];
    let line = |(i, lift): (usize, &f64)| {
        let x = 40.0 / 3.0 * i as f64;
        vec![Point::new(x, 0.0, *lift), Point::new(x, 8.0, 0.0), Point::new(x, 16.0, -fall - lift)]
    };
    let knots = [vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0]];
    let control = wave.iter().enumerate().map(line).collect();
    let surface = SplineSurface::new([3, 2], knots, control, None).unwrap();
    let surface = DesignSurface::Spline(OrientedSpline::new(surface, false).unwrap());
    let (part, tool) = (Part { name: "bent".into(), surface, check: Vec::new(), body: None }, cylinder());
    let strategy = Strategy {
        direction: Some(Vector::x()),
        tip: Some(TipSide::Low),
        strips: Some(2),
        smoothness,
        ..Strategy::new(StrategyKind::MultiStrip)
    };
    let request = request(&part, &tool, &strategy);
    plan(&PlanRequest { overcut_tolerance: 0.02, undercut_tolerance: 0.02, ..request }).unwrap()
}

#[test]
fn strips_that_are_joined_meet_more_smoothly_within_the_tolerance() {
    let [alone, joined, firmly] = [0.0, 1.0, 10.0].map(two_strips);
    let seam = |plan: &Plan| plan.strips[0].seam.unwrap();
    for plan in [&joined, &firmly] {
        assert!(seam(plan).kink_max_deg < seam(&alone).kink_max_deg, "{:?} {:?}", seam(plan), seam(&alone));
        assert!(seam(plan).kink_mean_deg < seam(&alone).kink_mean_deg, "{:?} {:?}", seam(plan), seam(&alone));
        assert!(plan.verdict.within_tolerance, "{:?}", plan.strips);
    }
    assert!(seam(&joined).kink_max_deg < 0.6 * seam(&alone).kink_max_deg, "{:?} {:?}", seam(&joined), seam(&alone));
}
