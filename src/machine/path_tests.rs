//! Branch choice and linearization of whole paths.

use super::*;
use crate::geometry::{Direction, Point, SplineCurve, Vector};
use crate::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, RuledMotion, ToolPath, ToolSummary};
use std::f64::consts::{PI, TAU};

pub(crate) fn path(passes: Vec<Pass>) -> ToolPath {
    ToolPath {
        name: "test".into(),
        tool: ToolSummary { number: 1, description: "test".into(), gauge_length: 100.0, flute_length: 40.0 },
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes,
    }
}

pub(crate) fn pass(kind: PassKind, motion: PassMotion) -> Pass {
    Pass { kind, strip: Some(0), motion }
}

/// Tool axis at tilt and azimuth, radians.
pub(crate) fn tilted(tilt: f64, azimuth: f64) -> Direction {
    Direction::new_normalize(Vector::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos()))
}

/// A ruled motion through given poses' lines, by cubic splines near enough to them.
pub(crate) fn ruled(pose: impl Fn(f64) -> Pose, controls: usize) -> PassMotion {
    // Quasi-interpolation of a cubic spline at its Greville points (de Boor): fourth order, smooth.
    let knots = crate::geometry::knots::Knots::clamped_uniform(3, controls).unwrap();
    let rail = |height: f64| -> SplineCurve {
        let at = |t: f64| pose(t.clamp(0.0, 1.0)).at_height(height);
        let values = knots.values();
        let control = (0..controls)
            .map(|i| {
                let (a, b, c) = (values[i + 1], values[i + 2], values[i + 3]);
                if c == a {
                    return at(b);
                }
                // Blossom of the quadratic through both ends and the middle of the local interval.
                let (low, mid, high) = (at(a), at((a + c) / 2.0), at(c));
                let (f1, f2) = ((high - low) / (c - a), ((high - mid) - (mid - low)) * (2.0 / (c - a).powi(2)));
                let g = (a + b + c) / 3.0;
                let pairs = (a * b + b * c + a * c) / 3.0;
                // low + f1 (g - a) + f2 * blossom of (t - a)(t - c)
                low + f1 * (g - a) + f2 * (pairs - (a + c) * g + a * c)
            })
            .collect();
        SplineCurve::from_knots(knots.clone(), control).unwrap()
    };
    PassMotion::Ruled(RuledMotion { lower: rail(0.0), upper: rail(40.0), lower_height: 0.0 })
}

pub(crate) fn setup(name: &str) -> Setup {
    Setup::new(&Machine::named(name).unwrap(), "G54", 100.0).unwrap()
}

pub(crate) fn solve(path: &ToolPath, setup: &Setup, tcp: bool) -> Linearized {
    linearize(path, setup, tcp, &LinearizeOptions::default()).unwrap()
}

/// Straight rails from one pose to another: the axis sweeps a plane when the tips coincide.
fn straight(from: &Pose, to: &Pose) -> PassMotion {
    let rail = |height: f64| {
        let ends = vec![from.at_height(height), to.at_height(height)];
        SplineCurve::new(1, vec![0.0, 0.0, 1.0, 1.0], ends).unwrap()
    };
    PassMotion::Ruled(RuledMotion { lower: rail(0.0), upper: rail(40.0), lower_height: 0.0 })
}

/// Densely measured distance of the moving flank from the plane of two axes through one tip.
fn off_plane(setup: &Setup, moves: &[AxisMove], tcp: bool, from: &Pose, to: &Pose) -> f64 {
    let normal = from.axis.cross(&to.axis).normalize();
    let blocks = moves.windows(2).map(|pair| setup.segment(&pair[0].to, &pair[1].to, setup.interpolation(tcp)));
    let heights =
        blocks.flat_map(|segment| (0..=100).map(move |i| segment.pose(f64::from(i) / 100.0)).collect::<Vec<_>>());
    heights.map(|pose| (pose.at_height(40.0) - from.tip).dot(&normal).abs()).fold(0.0, f64::max)
}

/// While the azimuth turns by `turn` at about `tilt`, rotary axes linear leave the plane of the axes by
/// `tilt - atan(tan tilt cos(turn/2))`; the error falls with the square of the number of blocks.
#[test]
fn plane_of_axes_needs_nearly_the_fewest_blocks() {
    for (tilt, turn) in [(30.0f64, 5.0f64), (5.0, 20.0)] {
        let (tilt, turn) = (tilt.to_radians(), turn.to_radians());
        let [from, to] = [0.3, 0.3 + turn].map(|c| Pose { tip: Point::new(10.0, 20.0, 30.0), axis: tilted(tilt, c) });
        let path = path(vec![pass(PassKind::Cut, straight(&from, &to))]);
        let whole = 40.0 * (tilt - (tilt.tan() * (turn / 2.0).cos()).atan());
        let fewest = (whole / path.linearization).sqrt();
        for name in ["xyzac-trt", "xyzbc-trt", "bridgemill", "head-b-table-c"] {
            let setup = setup(name);
            let solved = solve(&path, &setup, true);
            let blocks = solved.moves.len() - 1;
            let measured = off_plane(&setup, &solved.moves, true, &from, &to);
            assert!(measured <= path.linearization && solved.deviation <= path.linearization, "{measured}");
            assert!(blocks as f64 <= fewest.ceil() * 1.1, "{blocks} blocks for {fewest}");
            let off = solve(&path, &setup, false);
            assert!(off_plane(&setup, &off.moves, false, &from, &to) <= path.linearization);
        }
    }
}

/// A cone of axes about the first rotary axis is what rotary axes linear do by themselves.
#[test]
fn cone_of_axes_about_the_table_axis_needs_blocks_for_the_turn_only() {
    let pose_at = |azimuth: f64| Pose { tip: Point::new(10.0, 20.0, 30.0), axis: tilted(0.5, azimuth) };
    let path = path(vec![pass(PassKind::Cut, ruled(|t| pose_at(t * PI / 2.0), 60))]);
    let solved = solve(&path, &setup("xyzac-trt"), true);
    let least = (PI / 2.0 / LinearizeOptions::default().largest_turn).ceil() as usize;
    assert!(solved.moves.len() - 1 <= least + 1, "{} for {least}", solved.moves.len() - 1);
}

/// The largest difference of a rotary axis between neighbouring moves that are not rapid, radians.
fn largest_jump(moves: &[AxisMove]) -> f64 {
    let pairs = moves.windows(2).filter(|pair| !pair[1].kind.is_rapid());
    pairs.map(|p| (0..2).map(|k| (p[1].to.rotary[k] - p[0].to.rotary[k]).abs()).fold(0.0, f64::max)).fold(0.0, f64::max)
}

/// A path whose axis tilts through the pole, missing it by `miss` radians.
pub(crate) fn through_the_pole(miss: f64) -> ToolPath {
    let pose = move |t: f64| {
        let angle = (t - 0.5) * 0.6;
        let axis = Vector::new(angle.sin(), miss.sin(), angle.cos());
        Pose { tip: Point::new(100.0 * t - 50.0, 10.0, 5.0), axis: Direction::new_normalize(axis) }
    };
    path(vec![pass(PassKind::Cut, ruled(pose, 24))])
}

#[test]
fn poles_are_crossed_on_every_machine() {
    for name in ["xyzac-trt", "xyzbc-trt", "bridgemill", "head-b-table-c"] {
        for miss in [0.0, 1e-8, 1e-4, 0.1f64.to_radians(), 1f64.to_radians(), 5f64.to_radians()] {
            let path = through_the_pole(miss);
            let setup = setup(name);
            for tcp in [true, false] {
                let solved = solve(&path, &setup, tcp);
                assert!(solved.deviation <= path.linearization, "{name} {miss} {}", solved.deviation);
                assert!(largest_jump(&solved.moves) <= LinearizeOptions::default().largest_turn + 1e-9);
                let end = path.passes[0].motion.pose(1.0).unwrap();
                let last = solved.moves.last().unwrap();
                assert!(last.pose.distance_along(&end, 40.0) <= path.linearization);
            }
        }
    }
}

/// A spiral of the axis about the pole by `turns` turns.
pub(super) fn spiral(turns: f64) -> PassMotion {
    let pose = move |t: f64| {
        let azimuth = TAU * turns * (t - 0.5);
        let (sin, cos) = azimuth.sin_cos();
        Pose { tip: Point::new(60.0 * cos, 60.0 * sin, 20.0 - 10.0 * t), axis: tilted(0.35, azimuth) }
    };
    ruled(pose, 16 * (turns.ceil() as usize + 1))
}

pub(super) fn limited_c(name: &str, degrees: f64) -> Setup {
    let mut machine = Machine::named(name).unwrap();
    machine.rotary[1].travel = Travel::Limited { min: -degrees.to_radians(), max: degrees.to_radians() };
    Setup::new(&machine, "G54", 100.0).unwrap()
}

#[test]
fn spiral_starts_wound_back_where_its_end_would_pass_the_limit() {
    // 390 degrees of turn in a travel of 400: one start of all fits.
    let setup = limited_c("bridgemill", 200.0);
    let path = path(vec![pass(PassKind::Cut, spiral(390.0 / 360.0))]);
    let solved = solve(&path, &setup, true);
    let angles: Vec<f64> = solved.moves.iter().map(|m| m.to.rotary[1].to_degrees()).collect();
    assert!(angles.iter().all(|c| c.abs() <= 200.0 + 1e-6), "{angles:?}");
    assert!((angles[angles.len() - 1] - angles[0]).abs() > 389.0);
}

#[test]
fn rapid_between_passes_winds_back() {
    let setup = limited_c("bridgemill", 200.0);
    let cut = spiral(300.0 / 360.0);
    let (start, end) = (cut.pose(0.0).unwrap(), cut.pose(1.0).unwrap());
    let up = |pose: &Pose| Pose { tip: pose.at_height(80.0), axis: pose.axis };
    let lift = PassMotion::Poses(vec![end, up(&end)]);
    let link = PassMotion::Poses(vec![up(&end), up(&start)]);
    let lower = PassMotion::Poses(vec![up(&start), start]);
    let passes = vec![
        pass(PassKind::Cut, cut.clone()),
        pass(PassKind::Retract, lift),
        pass(PassKind::Rapid, link),
        pass(PassKind::Approach, lower),
        pass(PassKind::Cut, cut),
    ];
    let path = path(passes);
    let solved = solve(&path, &setup, true);
    assert!(largest_jump(&solved.moves) <= 0.2 + 1e-9);
    assert!(solved.moves.iter().all(|m| m.to.rotary[1].to_degrees().abs() <= 200.0 + 1e-6));
    // Every pose of the link itself is visited.
    let visited = |pose: &Pose| solved.moves.iter().any(|m| m.pose.distance_along(pose, 40.0) < 1e-4);
    assert!(visited(&up(&end)) && visited(&up(&start)));
}

#[test]
fn pose_beyond_a_linear_limit_is_named() {
    let motion = PassMotion::Poses(vec![
        Pose { tip: Point::new(0.0, 0.0, 0.0), axis: Vector::z_axis() },
        Pose { tip: Point::new(1200.0, 0.0, 0.0), axis: Vector::z_axis() },
    ]);
    let setup = setup("bridgemill");
    let path = path(vec![pass(PassKind::Cut, motion)]);
    let said = linearize(&path, &setup, true, &LinearizeOptions::default()).unwrap_err().to_string();
    assert!(said.contains("axis X") && said.contains("1200") && said.contains("200.0000 mm beyond"), "{said}");
}

#[test]
fn tilt_beyond_the_head_is_named() {
    let setup = limited_b("head-b-table-c", 20.0);
    let [from, to] = [0.1f64, 0.5].map(|tilt| Pose { tip: Point::origin(), axis: tilted(tilt, 0.2) });
    let path = path(vec![pass(PassKind::Cut, straight(&from, &to))]);
    let said = linearize(&path, &setup, true, &LinearizeOptions::default()).unwrap_err().to_string();
    assert!(said.contains("axis B would have to stand at") && said.contains("out of reach"), "{said}");
}

fn limited_b(name: &str, degrees: f64) -> Setup {
    let mut machine = Machine::named(name).unwrap();
    machine.rotary[0].travel = Travel::Limited { min: -degrees.to_radians(), max: degrees.to_radians() };
    Setup::new(&machine, "G54", 100.0).unwrap()
}

#[test]
fn words_of_the_moves_have_the_dialects_decimals() {
    let setup = setup("xyzac-trt");
    let path = through_the_pole(0.05);
    for tcp in [true, false] {
        for step in solve(&path, &setup, tcp).moves {
            let words = setup.words(&step.to, tcp);
            let round = words.rounded(5, 5);
            for (a, b) in words.linear.iter().chain(&words.rotary).zip(round.linear.iter().chain(&round.rotary)) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }
    }
}

/// A table whose tilting axis lies at 45 degrees: its two branches meet where the tool axis lies level.
fn nutating() -> Setup {
    let mut machine = Machine::named("xyzbc-trt").unwrap();
    machine.rotary[0].direction = Direction::new_normalize(Vector::new(0.0, 1.0, 1.0));
    Setup::new(&machine, "G54", 100.0).unwrap()
}

#[test]
fn nutating_axis_goes_through_pole_and_level_tool() {
    let setup = nutating();
    let swing = |low: f64, high: f64, lean: f64| {
        let pose = move |t: f64| {
            let angle = low + (high - low) * t;
            let axis = Vector::new(angle.sin(), lean, angle.cos());
            Pose { tip: Point::new(30.0 * t, 10.0, 5.0), axis: Direction::new_normalize(axis) }
        };
        path(vec![pass(PassKind::Cut, ruled(pose, 24))])
    };
    for path in [swing(-0.3, 0.3, 0.0), swing(-0.3, 0.3, 0.01), swing(1.2, PI / 2.0, 0.0)] {
        for tcp in [true, false] {
            let solved = solve(&path, &setup, tcp);
            assert!(solved.deviation <= path.linearization);
            assert!(largest_jump(&solved.moves) <= LinearizeOptions::default().largest_turn + 1e-9);
        }
    }
    let said = linearize(&swing(1.2, 1.7, 0.0), &setup, true, &LinearizeOptions::default()).unwrap_err().to_string();
    assert!(said.contains("out of reach: axis B would have to tilt") && said.contains("0.000 to 90.000"), "{said}");
}

#[test]
fn free_axis_turns_in_place_where_the_path_turns_at_the_pole() {
    // Tilts to the pole along one azimuth and leaves along another, 90 degrees away.
    let at = |tilt: f64, azimuth: f64| Pose { tip: Point::new(50.0, 0.0, 10.0), axis: tilted(tilt, azimuth) };
    let poses = vec![at(0.3, 0.4), at(0.0, 0.0), at(0.3, 0.4 + PI / 2.0)];
    let path = path(vec![pass(PassKind::Cut, PassMotion::Poses(poses))]);
    for name in ["xyzac-trt", "bridgemill", "head-b-table-c"] {
        let setup = setup(name);
        let solved = solve(&path, &setup, true);
        assert!(solved.deviation <= path.linearization);
        let turned = |p: &[AxisMove]| p[0].pose.distance_along(&p[1].pose, 40.0) < 1e-3;
        let in_place = solved.moves.windows(2).find(|p| turned(p)).unwrap();
        assert!(((in_place[1].to.rotary[1] - in_place[0].to.rotary[1]).abs() - PI / 2.0).abs() < 1e-6);
    }
}

#[test]
fn wrapped_axis_comes_back_from_its_words() {
    let mut machine = Machine::named("bridgemill").unwrap();
    machine.rotary[1].travel = Travel::Wrapped;
    let setup = Setup::new(&machine, "G54", 100.0).unwrap();
    let solved = solve(&path(vec![pass(PassKind::Cut, spiral(1.5))]), &setup, true);
    let mut before = solved.moves[0].to;
    for step in &solved.moves {
        let words = setup.tcp_words(&step.to);
        assert!((0.0..360.0).contains(&words.rotary[1]));
        before = setup.axes_from_tcp_words(&words, &before);
        assert!((before.rotary[1] - step.to.rotary[1]).abs() < 1e-9);
    }
}

#[test]
fn gap_between_passes_is_refused() {
    let at = |x: f64| Pose { tip: Point::new(x, 0.0, 0.0), axis: Vector::z_axis() };
    let leg = |a: f64, b: f64| pass(PassKind::Cut, PassMotion::Poses(vec![at(a), at(b)]));
    let path = path(vec![leg(0.0, 1.0), leg(1.5, 2.0)]);
    let said = linearize(&path, &setup("bridgemill"), true, &LinearizeOptions::default()).unwrap_err().to_string();
    assert!(said.contains("pass 1 (cut, strip 1)") && said.contains("0.5000 mm away"), "{said}");
}

#[test]
fn allowance_below_the_rounding_of_words_is_refused() {
    let mut machine = Machine::named("bridgemill").unwrap();
    machine.control.options.linear_digits = 2;
    let setup = Setup::new(&machine, "G54", 100.0).unwrap();
    let said = linearize(&through_the_pole(0.05), &setup, true, &LinearizeOptions::default()).unwrap_err().to_string();
    assert!(said.contains("no block is short enough") && said.contains("2 and 5 decimals"), "{said}");
}
