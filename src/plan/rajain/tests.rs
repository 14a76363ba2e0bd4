//! The method's printed behaviour, on surfaces by formula.

use super::fixtures::{cone, dome, part, planned, request, saddle, strategy, tool};
use super::*;
use crate::part::Part;
use crate::plan::{Plan, Strategy};
use crate::tool::CutterShape;

fn figures(plan: &Plan) -> RajainFigures {
    plan.rajain.unwrap()
}

fn with(change: impl FnOnce(&mut RajainSettings)) -> Strategy {
    let mut strategy = strategy();
    change(&mut strategy.rajain);
    strategy
}

fn worst(plan: &Plan) -> f64 {
    plan.strips.iter().map(|s| s.deviation.overcut.max(s.deviation.undercut)).fold(0.0, f64::max)
}

fn distance_error(plan: &Plan) -> f64 {
    let (below, above) = figures(plan).distance_errors;
    below.max(above)
}

#[test]
fn on_a_plane_everything_vanishes() {
    let plane: Part = part(fixtures::graph(20.0, 8.0, |_, _| 0.0));
    let plan = planned(&plane, &cone(), &strategy());
    let found = figures(&plan);
    assert_eq!(found.strips, 6);
    assert!(worst(&plan) < 1e-6 && found.kinks.0 < 1e-4, "{found:?}");
    assert_eq!((found.colliding, found.bare_share), (0, 0.0));
}

/// Fig. 16: the weights trade accuracy against the kink.
#[test]
fn weights_trade_accuracy_against_the_kink() {
    let dome = part(dome());
    let weighted =
        |accuracy: f64, g1: f64| planned(&dome, &cone(), &with(|s| s.weights = Weights { accuracy, g1, ..s.weights }));
    let (accurate, smooth) = (weighted(1.0, 0.001), weighted(0.001, 1.0));
    assert!(distance_error(&smooth) > 1.5 * distance_error(&accurate), "{:?} {:?}", smooth.rajain, accurate.rajain);
    assert!(figures(&smooth).kinks.0 < figures(&accurate).kinks.0 / 1.5, "{:?} {:?}", smooth.rajain, accurate.rajain);
}

/// Fig. 18: half of the flank in twice as many strips; the error drops at least to a half (by the curvature law, to a
/// quarter).
#[test]
fn half_the_engagement_at_least_halves_the_error() {
    let surface = part(saddle());
    let whole = planned(&surface, &cone(), &strategy());
    let half = planned(&surface, &cone(), &with(|s| s.engagement = (0.5, 1.0)));
    assert!(half.strips.len() >= 2 * whole.strips.len() - 1, "{} {}", half.strips.len(), whole.strips.len());
    assert!(distance_error(&half) < 0.5 * distance_error(&whole), "{:?} {:?}", half.rajain, whole.rajain);
    assert!(worst(&half) < 0.5 * worst(&whole), "{} {}", worst(&half), worst(&whole));
}

/// Fig. 11: the lengths of the axis, spread out at the start, come together; what is emitted is rigid whatever is left.
#[test]
fn the_axis_becomes_rigid() {
    let surface = part(saddle());
    let plan = planned(&surface, &cone(), &strategy());
    let RajainFigures { start_lengths, lengths, .. } = figures(&plan);
    let spread = |(low, high): (f64, f64)| high - low;
    assert!(spread(lengths) < 0.1 * spread(start_lengths), "{start_lengths:?} {lengths:?}");
    assert!(spread(lengths) < 1e-3 && (lengths.0 - 1.717).abs() < 1e-3, "{lengths:?}");
}

#[test]
fn a_cylinder_works_and_the_cone_beats_it_at_most_slightly() {
    let surface = part(saddle());
    let cylinder = tool(&CutterShape::Cylinder { diameter: 1.3, corner_radius: 0.0, flute_length: 1.568 });
    let plan = planned(&surface, &cylinder, &strategy());
    let found = figures(&plan);
    assert!((found.r1 - 0.65).abs() < 1e-12 && (found.r2 - 0.65).abs() < 1e-12, "{found:?}");
    let of_cone = planned(&surface, &cone(), &strategy());
    let ratio = distance_error(&plan) / distance_error(&of_cone);
    assert!((0.7..1.5).contains(&ratio), "{ratio}");
}

/// Section 7.2: a free length is worth more than free radii; neither may cost anything in the sum that is minimized.
#[test]
fn what_is_free_of_the_tool_is_found_and_reported_as_a_tool() {
    let surface = part(saddle());
    let strips = Some(4);
    let free = |free: Free| Strategy { strips, ..with(|s| s.free = free) };
    let fixed = planned(&surface, &cone(), &free(Free::default()));
    assert!(fixed.tool.is_none());
    let length = planned(&surface, &cone(), &free(Free { length: true, ..Free::default() }));
    let all = planned(&surface, &cone(), &free(Free { length: true, r1: true, r2: true }));
    for plan in [&length, &all] {
        let found = figures(plan);
        let tool = plan.tool.as_ref().unwrap();
        let flank = Flank::of(tool, None, (0.0, 1.0)).unwrap().engaged();
        assert!((flank.length - found.length).abs() < 1e-9 && (flank.r1 - found.r1).abs() < 1e-9);
        assert!(distance_error(plan) < 1.2 * distance_error(&fixed), "{found:?} {:?}", fixed.rajain);
        assert_eq!(plan.path.tool.flute_length, tool.flute_length());
    }
    assert!((figures(&length).length - 1.717).abs() > 1e-7);
    assert_eq!(figures(&length).r1, 0.3);
}

/// The rulings of an exact envelope need not lie in the normal planes of the guiding curves, where the start lays them: the
/// proximity to the start (R17) is then all that keeps the method from it.
#[test]
fn proximity_is_what_keeps_the_method_from_an_exact_envelope() {
    let bytes = include_bytes!("../../../samples/exact-cone/surface.json");
    let surface = crate::part::read(bytes, "surface.json", &crate::part::ReadOptions::default()).unwrap();
    let surface = Part { name: "exact".into(), surface, body: None, check: Vec::new() };
    let swept = tool(&CutterShape::EndSpheres { r1: 3.0, r2: 6.0, length: 14.0 });
    let direction = Some(crate::geometry::Vector::new(0.982, 0.141, 0.126));
    let held_by = |proximity: f64| {
        let free = with(|s| s.weights.proximity = proximity);
        distance_error(&planned(&surface, &swept, &Strategy { direction, strips: Some(1), ..free }))
    };
    let (printed, free) = (held_by(1e-4), held_by(1e-8));
    assert!(printed > 0.01 && free < 1e-4, "{printed} {free}");
}

#[test]
fn too_few_strips_leave_part_of_the_surface_bare_and_say_how_much() {
    let surface = part(saddle());
    let plan = planned(&surface, &cone(), &Strategy { strips: Some(3), ..strategy() });
    let bare = figures(&plan).bare_share;
    // Three strips of 1.57 mm on 8.2 mm.
    assert!((0.35..0.50).contains(&bare), "{bare}");
}

#[test]
fn a_direction_that_stands_on_the_surface_is_refused_with_its_place() {
    let surface = part(saddle());
    let standing = Strategy { direction: Some(Vector::z()), ..strategy() };
    let tool = cone();
    let said = crate::plan::plan(&request(&surface, &tool, &standing)).unwrap_err();
    assert!(said.message.contains("stands on the surface near ("), "{said}");
}

#[test]
fn the_same_plan_comes_out_on_one_thread_and_on_several() {
    let surface = part(saddle());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| planned(&surface, &cone(), &with(|s| s.step = Some(0.8))).path)
    };
    assert_eq!(run(1), run(3));
}
