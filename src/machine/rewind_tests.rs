//! Leaving the part to turn back, machines whose axes cannot follow, and what the choice of branches costs.

use super::path_tests::{limited_c, pass, path, ruled, setup, spiral, tilted};
use super::*;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::{PassKind, PassMotion, Pose, ToolPath};
use std::f64::consts::PI;

fn solve(path: &ToolPath, setup: &Setup, tcp: bool) -> Linearized {
    linearize(path, setup, tcp, &LinearizeOptions::default()).unwrap()
}

fn refuse(path: &ToolPath, setup: &Setup) -> String {
    linearize(path, setup, true, &LinearizeOptions::default()).unwrap_err().to_string()
}

/// Whether a move belongs to a way out of the part, a turn, or a way back.
fn is_aside(step: &AxisMove) -> bool {
    matches!(step.kind, PassKind::Retract | PassKind::Rapid | PassKind::Approach)
}

/// Runs of moves aside, as ranges.
fn asides(moves: &[AxisMove]) -> Vec<std::ops::Range<usize>> {
    let mut found: Vec<std::ops::Range<usize>> = Vec::new();
    for index in (0..moves.len()).filter(|index| is_aside(&moves[*index])) {
        match found.last_mut().filter(|range| range.end == index) {
            Some(range) => range.end = index + 1,
            None => found.push(index..index + 1),
        }
    }
    found
}

/// Every pose of the first pass lies near a block at feed, and no axis passes a limit at its end.
fn assert_whole(path: &ToolPath, setup: &Setup, solved: &Linearized, tcp: bool) {
    let cuts: Vec<_> = solved.moves.windows(2).filter(|pair| pair[1].kind == PassKind::Cut).collect();
    let near = |pose: &Pose| {
        let far = |step: &AxisMove| step.pose.distance_along(pose, 40.0);
        let blocks = cuts.iter().filter(|pair| far(&pair[0]).min(far(&pair[1])) < 12.0);
        let poses = blocks.flat_map(|pair| {
            let segment = setup.segment(&pair[0].to, &pair[1].to, setup.interpolation(tcp));
            (0..=64).map(move |i| segment.pose(f64::from(i) / 64.0)).collect::<Vec<_>>()
        });
        poses.map(|place| place.distance_along(pose, 40.0)).fold(f64::INFINITY, f64::min)
    };
    for i in 0..=200 {
        let pose = path.passes[0].motion.pose(f64::from(i) / 200.0).unwrap();
        assert!(near(&pose) < 0.12, "nothing cuts at {i}: {} mm", near(&pose));
    }
    for step in &solved.moves {
        for (axis, angle) in setup.machine().rotary.iter().zip(step.to.rotary) {
            assert!(axis.travel.excess(angle) < 1e-9, "{} at {}", axis.letter, angle.to_degrees());
        }
        for (axis, place) in setup.machine().linear.iter().zip(step.to.linear) {
            assert!((axis.min..=axis.max).contains(&place), "{} at {place}", axis.letter);
        }
    }
}

/// Each way aside starts and ends at one place of the part, goes outside the sphere around the cut, and turns there with
/// the tip at rest.
fn assert_clear(setup: &Setup, solved: &Linearized, tcp: bool, centre: Point, radius: f64) {
    let mut travelled: f64 = 0.0;
    for aside in asides(&solved.moves) {
        let (before, last) = (&solved.moves[aside.start - 1], &solved.moves[aside.end - 1]);
        assert!(before.pose.distance_along(&last.pose, 40.0) < 1e-3);
        for pair in solved.moves[aside.start - 1..aside.end].windows(2) {
            let turned = (0..2).map(|k| (pair[1].to.rotary[k] - pair[0].to.rotary[k]).abs()).fold(0.0, f64::max);
            travelled = travelled.max(turned);
            if turned < 1e-6 {
                continue;
            }
            let segment = setup.segment(&pair[0].to, &pair[1].to, setup.interpolation(tcp));
            for i in 0..=10 {
                let pose = segment.pose(f64::from(i) / 10.0);
                let from = pose.tip - centre;
                let along = from.dot(&pose.axis).min(0.0);
                let near = (from.norm_squared() - along * along).sqrt();
                assert!(near >= radius, "the tool comes within {near} mm of the middle, {radius} mm is the cut");
            }
        }
    }
    assert!(travelled > 0.01);
}

#[test]
fn spiral_longer_than_the_travel_is_cut_with_one_rewind() {
    let path = path(vec![pass(PassKind::Cut, spiral(450.0 / 360.0))]);
    for name in ["bridgemill", "xyzac-trt", "head-b-table-c"] {
        let setup = limited_c(name, 200.0);
        for tcp in [true, false] {
            let solved = solve(&path, &setup, tcp);
            assert_eq!((solved.choice.rewinds, asides(&solved.moves).len()), (1, 1), "{name}");
            assert!(solved.deviation <= path.linearization);
            assert_whole(&path, &setup, &solved, tcp);
            assert_clear(&setup, &solved, tcp, Point::new(0.0, 0.0, 15.0), 60.0);
        }
    }
    // The travel is 400 degrees, and each rewind brings 360 more: no fewer rewinds lead to the end.
    let setup = limited_c("bridgemill", 200.0);
    for (degrees, rewinds) in [(1470.0, 3), (1500.0, 4)] {
        let longer = ToolPath { passes: vec![pass(PassKind::Cut, spiral(degrees / 360.0))], ..path.clone() };
        assert_eq!(solve(&longer, &setup, true).choice.rewinds, rewinds);
    }
}

#[test]
fn whole_turns_that_fit_need_no_rewind() {
    let path = path(vec![pass(PassKind::Cut, spiral(390.0 / 360.0))]);
    let solved = solve(&path, &limited_c("bridgemill", 200.0), true);
    assert_eq!(solved.choice.rewinds, 0);
    assert!(asides(&solved.moves).is_empty());
    // A greedy start at the turn nearest to zero stands at 165 degrees or below and would end beyond 200.
    assert!(solved.moves[0].to.rotary[1].to_degrees().abs() > 165.0);
}

/// Azimuths over 200 degrees: where C turns 190, the branch must change on the way.
fn wide_fan() -> ToolPath {
    let pose = |t: f64| {
        let azimuth = (200.0 * (t - 0.5)).to_radians();
        Pose { tip: Point::new(50.0 * azimuth.cos(), 50.0 * azimuth.sin(), 10.0), axis: tilted(0.2, azimuth) }
    };
    path(vec![pass(PassKind::Cut, ruled(pose, 40))])
}

#[test]
fn branch_is_changed_where_no_other_way_is_left() {
    let path = wide_fan();
    for name in ["bridgemill", "xyzac-trt"] {
        let setup = limited_c(name, 95.0);
        let solved = solve(&path, &setup, true);
        assert!(solved.choice.rewinds >= 1, "{name}");
        let tilts = solved.moves.iter().filter(|step| !is_aside(step)).map(|step| step.to.rotary[0]);
        let (low, high) = tilts.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(a), h.max(a)));
        assert!(low < -0.19 && high > 0.19, "{name}: {low} {high}");
        assert_whole(&path, &setup, &solved, true);
        assert_clear(&setup, &solved, true, Point::new(0.0, 0.0, 10.0), 50.0);
    }
}

#[test]
fn rewind_stands_off_the_flank_as_the_paths_own_retract_does() {
    let cut = spiral(450.0 / 360.0);
    let end = cut.pose(1.0).unwrap();
    let rate =
        |t: f64| (cut.pose(t + 1e-6).unwrap().at_height(20.0) - cut.pose(t - 1e-6).unwrap().at_height(20.0)) / 2e-6;
    let normal = |t: f64| cut.pose(t).unwrap().axis.cross(&rate(t)).normalize();
    let aside = normal(1.0 - 1e-6) * -3.0;
    let off = Pose { tip: end.tip + aside, axis: end.axis };
    let retract = pass(PassKind::Retract, PassMotion::Poses(vec![end, off]));
    let path = path(vec![pass(PassKind::Cut, cut.clone()), retract]);
    let solved = solve(&path, &limited_c("bridgemill", 200.0), true);
    let first = solved.moves.iter().position(is_aside).unwrap();
    let (at, out) = (&solved.moves[first - 1], &solved.moves[first]);
    let t = (0..=4000).map(|i| f64::from(i) / 4000.0);
    let far = |t: &f64| cut.pose(*t).unwrap().distance_along(&at.pose, 40.0);
    let t = t.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap().clamp(1e-5, 1.0 - 1e-5);
    assert!((out.pose.tip - at.pose.tip - normal(t) * -3.0).norm() < 0.02, "{:?}", out.pose.tip - at.pose.tip);
}

#[test]
fn missing_room_for_a_rewind_names_pose_axis_and_amount() {
    let mut machine = limited_c("bridgemill", 200.0).machine().clone();
    machine.linear[2].max = 100.0;
    let setup = Setup::new(&machine, "G54", 100.0).unwrap();
    let said = refuse(&path(vec![pass(PassKind::Cut, spiral(450.0 / 360.0))]), &setup);
    assert!(said.contains("pass 0 (cut, strip 1) at tip [") && said.contains("no room to leave the part"), "{said}");
    assert!(said.contains("axis Z would have to stand at") && said.contains("beyond its limit 100.0000"), "{said}");
    assert!(said.contains("move the work offset"), "{said}");
}

/// A leg along X with the axis turning about X by an angle.
fn about_x(by: f64) -> PassMotion {
    let at = |x: f64, angle: f64| {
        let axis = Vector::new(0.0, -angle.sin(), angle.cos());
        Pose { tip: Point::new(x, 5.0, 10.0), axis: Direction::new_normalize(axis) }
    };
    PassMotion::Poses((0..=10).map(|i| at(f64::from(i), by * f64::from(i) / 10.0)).collect())
}

#[test]
fn four_axes_follow_what_one_rotary_axis_makes() {
    let setup = Setup::at(&Machine::named("four-axis-a").unwrap(), [0.0; 3], 50.0).unwrap();
    let path = path(vec![pass(PassKind::Cut, about_x(3.0))]);
    let solved = solve(&path, &setup, false);
    assert!(solved.deviation <= path.linearization && solved.choice.rewinds == 0);
    let last = solved.moves.last().unwrap();
    assert!((last.to.rotary[0] - 3.0).abs() < 1e-6 && solved.moves.iter().all(|step| step.to.rotary[1] == 0.0));
    let tilt = Pose { tip: Point::origin(), axis: tilted(0.1, 0.0) };
    let said =
        refuse(&ToolPath { passes: vec![pass(PassKind::Cut, PassMotion::Poses(vec![tilt, tilt]))], ..path }, &setup);
    assert!(said.contains("the tool would have to tilt 5.7296 degrees, for which the machine has no axis"), "{said}");
    assert!(said.contains("more rotary axes"), "{said}");
}

#[test]
fn indexed_axes_turn_between_cuts_only() {
    let mut machine = Machine::named("xyzac-trt").unwrap();
    for axis in &mut machine.rotary {
        axis.motion = RotaryMotion::Indexed { step: 0.0 };
    }
    let setup = Setup::new(&machine, "G54", 100.0).unwrap();
    let leg = |axis: Direction| {
        let at = |x: f64, z: f64| Pose { tip: Point::new(x, 5.0, z), axis };
        [vec![at(0.0, 10.0), at(30.0, 10.0)], vec![at(30.0, 10.0), at(30.0, 90.0)], vec![at(0.0, 90.0), at(0.0, 10.0)]]
    };
    let ([first, up, _], [second, _, down]) = (leg(tilted(0.3, 0.4)), leg(tilted(0.7, -1.0)));
    let link = PassMotion::Poses(vec![up[1], down[0]]);
    let passes = vec![
        pass(PassKind::Cut, PassMotion::Poses(first)),
        pass(PassKind::Retract, PassMotion::Poses(up)),
        pass(PassKind::Rapid, link),
        pass(PassKind::Approach, PassMotion::Poses(down)),
        pass(PassKind::Cut, PassMotion::Poses(second)),
    ];
    let solved = solve(&path(passes), &setup, true);
    for pair in solved.moves.windows(2).filter(|pair| !pair[1].kind.is_rapid()) {
        assert_eq!(pair[0].to.rotary, pair[1].to.rotary);
    }
    let said = refuse(&path(vec![pass(PassKind::Cut, about_x(0.5))]), &setup);
    assert!(said.contains("axis A is clamped at") && said.contains("while the tool cuts"), "{said}");
    // Clamped at whole degrees only: 0.3 radians is none.
    machine.rotary[0].motion = RotaryMotion::Indexed { step: 1_f64.to_radians() };
    machine.rotary[0].travel = Travel::Limited { min: -PI / 2.0, max: PI / 2.0 };
    let setup = Setup::new(&machine, "G54", 100.0).unwrap();
    let still = |tilt: f64| {
        let at = |x: f64| Pose { tip: Point::new(x, 5.0, 10.0), axis: tilted(tilt, 0.4) };
        path(vec![pass(PassKind::Cut, PassMotion::Poses(vec![at(0.0), at(30.0)]))])
    };
    let said = refuse(&still(0.3), &setup);
    assert!(said.contains("17.0000 degrees while the tool cuts") && said.contains("mount the part"), "{said}");
    assert_eq!(solve(&still(17_f64.to_radians()), &setup, true).moves[1].to.rotary[0].to_degrees().abs().round(), 17.0);
}

#[test]
fn no_choice_costs_less_than_the_bound() {
    for (path, name) in
        [(path(vec![pass(PassKind::Cut, spiral(390.0 / 360.0))]), "bridgemill"), (wide_fan(), "xyzac-trt")]
    {
        let solved = solve(&path, &setup(name), true);
        assert!(solved.choice.least <= solved.choice.seconds + 1e-9, "{:?}", solved.choice);
        // With room enough the branch that is cheapest throughout is taken: only the way to the start is added.
        assert!(solved.choice.seconds - solved.choice.least < 0.1 * PI, "{:?}", solved.choice);
    }
}

/// A block that stands in the part.
fn fixture(name: &str, low: Point, high: Point) -> Body {
    let form = Form::Box { low, high };
    Body { name: name.to_owned(), link: Link::Table, form, near_miss: 1.0, file: "job.toml".to_owned(), line: 9 }
}

/// Whether bodies run into each other on the ways aside.
fn collides(scene: &Scene, setup: &Setup, solved: &Linearized) -> bool {
    asides(&solved.moves).into_iter().any(|aside| {
        solved.moves[aside.start - 1..aside.end].windows(2).any(|pair| {
            let tips = Some([pair[0].pose.tip, pair[1].pose.tip]);
            let turn = links::Hop { setup, ends: [pair[0].to, pair[1].to], tips };
            scene.encounters(&turn, &mut scene.hints()).iter().any(Encounter::is_collision)
        })
    })
}

/// A box as triangles.
fn skin(low: Point, high: Point) -> Vec<[Point; 3]> {
    let corner = |i: usize| Point::from(Vector::from_fn(|k, _| if i >> k & 1 == 1 { high[k] } else { low[k] }));
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).map(|face| face.map(corner)).collect()
}

#[test]
fn a_way_out_that_is_blocked_goes_farther() {
    let path = path(vec![pass(PassKind::Cut, spiral(450.0 / 360.0))]);
    for name in ["xyzac-trt", "head-b-table-c"] {
        let setup = limited_c(name, 200.0);
        let plain = solve(&path, &setup, true);
        // Half way through the turn of the plain way, a block stands where the tool then is.
        let aside = asides(&plain.moves).remove(0);
        let middle = plain.moves[(aside.start + aside.end) / 2].pose;
        let at = middle.at_height(40.0);
        let (low, high) = (at - Vector::repeat(6.0), at + Vector::repeat(6.0));
        let clamp = Scene::new(&setup).unwrap().with_fixtures(&[fixture("clamp", low, high)]).unwrap();
        let hub = Scene::new(&setup).unwrap().with_finished("finished part", &skin(low, high), None);
        let (mut machine, zero) = (setup.machine().clone(), Vector::from(setup.work_offset()));
        machine.bodies = vec![fixture("table", low + zero, high + zero)];
        let table = Scene::new(&Setup::new(&machine, "G54", 100.0).unwrap()).unwrap();
        for scene in [clamp.with_tool_axis(), hub.with_tool_axis(), table.with_tool_axis()] {
            assert!(collides(&scene, &setup, &plain), "{name}");
            let options = LinearizeOptions { scene: Some(&scene), ..LinearizeOptions::default() };
            let solved = linearize(&path, &setup, true, &options).unwrap();
            assert_eq!(solved.choice.rewinds, 1);
            assert!(!collides(&scene, &setup, &solved), "{name}");
            assert_whole(&path, &setup, &solved, true);
            assert_clear(&setup, &solved, true, Point::new(0.0, 0.0, 15.0), 60.0);
        }
    }
}

#[test]
fn the_tool_may_touch_the_finished_part_where_it_leaves_its_flank() {
    let path = path(vec![pass(PassKind::Cut, spiral(450.0 / 360.0))]);
    let setup = limited_c("xyzac-trt", 200.0);
    let plain = solve(&path, &setup, true);
    let aside = asides(&plain.moves).remove(0);
    // A plate that the tool stands in where it cuts, 0.3 mm deep, and has left once it is off the flank.
    let pose = plain.moves[aside.start - 1].pose;
    let (low, high) = (pose.tip - Vector::new(8.0, 8.0, 3.0), pose.tip + Vector::new(8.0, 8.0, 0.3));
    let scene = Scene::new(&setup).unwrap().with_finished("finished part", &skin(low, high), None).with_tool_axis();
    let options = LinearizeOptions { scene: Some(&scene), ..LinearizeOptions::default() };
    assert!(collides(&scene, &setup, &plain));
    assert_eq!(linearize(&path, &setup, true, &options).unwrap().moves, plain.moves);
}

#[test]
fn a_rewind_without_room_names_what_is_in_the_way() {
    let path = path(vec![pass(PassKind::Cut, spiral(450.0 / 360.0))]);
    let setup = limited_c("xyzac-trt", 200.0);
    let roof = fixture("roof", Point::new(-900.0, -900.0, 75.0), Point::new(900.0, 900.0, 400.0));
    let scene = Scene::new(&setup).unwrap().with_fixtures(&[roof]).unwrap().with_tool_axis();
    let options = LinearizeOptions { scene: Some(&scene), ..LinearizeOptions::default() };
    let said = linearize(&path, &setup, true, &options).unwrap_err();
    assert!(said.message.contains("no rewind room: ") && said.message.contains("inside the roof"), "{said}");
    assert!(
        said.message.contains("with the tip at [") && said.help.as_ref().unwrap().contains("move the roof"),
        "{said}"
    );
}
