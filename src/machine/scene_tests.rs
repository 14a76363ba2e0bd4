//! Distances of bodies on whole machines against closed forms, and that they do not depend on where zero is.

use super::*;
use crate::geometry::Direction;
use crate::machine::links::Hop;
use crate::machine::{Form, Machine};
use crate::tool::meridian::at;
use crate::tool::{CutterShape, Fixture};
use proptest::prelude::*;

/// The tip goes straight in the part while the rotary axes turn evenly.
fn tip_way(setup: &Setup, tips: [Point; 2], rotary: [[f64; 2]; 2]) -> Hop<'_> {
    let ends = [0, 1].map(|k: usize| setup.with_rotary(&tips[k], rotary[k]));
    Hop { setup, ends, tips: Some(tips) }
}

fn bare(name: &str) -> Machine {
    Machine { bodies: Vec::new(), ..Machine::named(name).unwrap() }
}

fn body(name: &str, link: Link, form: Form) -> Body {
    Body { name: name.to_owned(), link, form, near_miss: 1.0, file: "m.toml".to_owned(), line: 7 }
}

fn post(base: [f64; 3], radius: f64, length: f64) -> Form {
    Form::Cylinder { base: Point::from(base), axis: Direction::new_normalize(Vector::z()), radius, length }
}

fn block(low: [f64; 3], high: [f64; 3]) -> Form {
    Form::Box { low: Point::from(low), high: Point::from(high) }
}

/// Cylinder D10 with 20 mm of flutes, shank D8 up to 50, holder D40 up to 100.
fn tool() -> Tool {
    let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 20.0 };
    let holder = vec![at(50.0, 20.0), at(100.0, 20.0)];
    Tool::new(1, &shape, &Fixture { shank_diameter: Some(8.0), gauge_length: 100.0, holder }).unwrap()
}

fn found(scene: &Scene, course: &impl AxisCourse) -> Vec<([String; 2], f64)> {
    let near = scene.encounters(course, &mut scene.hints());
    near.iter().map(|met| (scene.names(met.pair).map(str::to_owned), met.distance)).collect()
}

/// The tool stays upright in the part while the table, or the head, turns about Z: whatever the machine, the flutes pass a
/// post at the distance that their ways have in the part.
#[test]
fn what_turns_with_table_or_head_is_met_at_its_place_in_the_part() {
    for name in ["xyzac-trt", "xyzbc-trt", "bridgemill", "head-b-table-c", "tr-35", "haas-umc-750"] {
        let setup = Setup::at(&bare(name), [30.0, -20.0, 10.0], 100.0).unwrap();
        let turning = setup.machine().chain[0];
        for (beside, truth) in [(18.5, 0.5), (16.0, -2.0), (19.2, 1.2)] {
            let fixture = body("post", Link::Table, post([0.0, 0.0, 0.0], 13.0, 40.0));
            let scene = Scene::new(&setup).unwrap().with_fixtures(&[fixture]).unwrap().with_tool(&tool());
            let tips = [-200.0, 260.0].map(|x| Point::new(x, beside, 20.0));
            let mut rotary = [[0.0; 2]; 2];
            rotary[1][turning & 1] = 1.3;
            let met = found(&scene, &tip_way(&setup, tips, rotary));
            if truth > 1.0 {
                assert_eq!(met, [], "{name}");
                continue;
            }
            let (names, distance) = met.iter().find(|(names, _)| names[0] == "flutes").unwrap();
            assert_eq!(names, &["flutes".to_owned(), "post".to_owned()]);
            assert!((distance - truth).abs() <= 1e-3 + 2e-3 * (-truth).max(0.0), "{name}: {distance} for {truth}");
        }
    }
}

#[test]
fn a_spindle_is_stopped_by_the_table_where_both_say() {
    let mut machine = bare("xyzac-trt");
    machine.bodies = vec![
        body("table", Link::Table, block([-200.0, -200.0, -60.0], [200.0, 200.0, -40.0])),
        body("nose", Link::Spindle, post([0.0, 0.0, 0.0], 30.0, 80.0)),
        body("ram", Link::Linear(2), block([-50.0, -50.0, 80.0], [50.0, 50.0, 400.0])),
        body("cradle", Link::Rotary(0), block([-200.0, -200.0, -90.0], [200.0, 200.0, -60.0])),
    ];
    let setup = Setup::at(&machine, [0.0; 3], 100.0).unwrap();
    let scene = Scene::new(&setup).unwrap();
    // Bodies of one link, and of neighbours, touch by construction.
    assert_eq!(scene.pairs.len(), 4);
    // The table stands level, the nose comes down to half a millimetre over it: the tip would be far below.
    let course = |tip: f64| tip_way(&setup, [Point::new(0.0, 0.0, 50.0), Point::new(0.0, 0.0, tip)], [[0.0; 2]; 2]);
    let met = found(&scene, &course(-139.5));
    assert_eq!(met.len(), 1, "{met:?}");
    assert!(met[0].0 == ["nose".to_owned(), "table".to_owned()] && (met[0].1 - 0.5).abs() < 1e-3, "{met:?}");
    assert!((found(&scene, &course(-143.0))[0].1 + 3.0).abs() < 0.005);
    assert_eq!(found(&scene, &course(-130.0)), []);
}

#[test]
fn bodies_that_can_never_part_are_found() {
    let mut machine = bare("xyzac-trt");
    let inside = block([-2000.0, -2000.0, -2000.0], [2000.0, 2000.0, 2000.0]);
    machine.bodies = vec![body("hall", Link::Base, inside), body("nose", Link::Spindle, post([0.0; 3], 30.0, 80.0))];
    let report = crate::machine::check(&machine).unwrap();
    assert!(!report.is_sound());
    let said = "bodies nose (m.toml:7) and hall (m.toml:7) overlap wherever the axes stand";
    assert!(report.contradictions[0].starts_with(said), "{:?}", report.contradictions);
}

#[test]
fn bodies_whose_file_was_not_read_are_refused() {
    let mut machine = bare("xyzac-trt");
    machine.bodies = vec![body("head", Link::Spindle, Form::File("head.stl".to_owned()))];
    let setup = Setup::at(&machine, [0.0; 3], 100.0).unwrap();
    let said = Scene::new(&setup).unwrap_err();
    assert!(said.message.contains("head.stl") && said.place.as_ref().unwrap().line == Some(7), "{said}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// The part's zero moved one way and part, fixtures and program the other: nothing changes. Nor does it when part and
    /// fixtures are turned on the table and the table is turned back.
    #[test]
    fn zero_may_lie_anywhere(
        shift in prop::array::uniform3(-80.0..80.0f64), angle in -3.0..3.0f64, tilt in -0.6..0.6f64,
        foot in prop::array::uniform3(-60.0..60.0f64), way in prop::array::uniform3(-60.0..60.0f64)
    ) {
        let machine = bare("xyzac-trt");
        let shift = Vector::from(shift);
        let near = |zero: Vector, post_at: Point, axis: Vector, ends: [AxisPosition; 2]| {
            let setup = Setup::at(&machine, zero.into(), 100.0).unwrap();
            let form = Form::Cylinder { base: post_at, axis: Direction::new_normalize(axis), radius: 9.0, length: 30.0 };
            let fixture = Body { near_miss: 60.0, ..body("post", Link::Table, form) };
            let scene = Scene::new(&setup).unwrap().with_fixtures(&[fixture]).unwrap().with_tool(&tool());
            found(&scene, &Hop { setup: &setup, ends, tips: None })
        };
        let (foot, axis) = (Point::from(foot), Vector::new(0.2, 0.3, 1.0));
        let from = AxisPosition { linear: [0.0, 0.0, 90.0], rotary: [tilt, 0.4] };
        let to = AxisPosition { linear: [way[0], way[1], 100.0 + way[2]], rotary: [tilt + 0.2, 1.0] };
        let plain = near(Vector::zeros(), foot, axis, [from, to]);
        let moved = near(shift, foot - shift, axis, [from, to]);
        prop_assert_eq!(plain.len(), moved.len());
        for (a, b) in plain.iter().zip(&moved) {
            prop_assert!(a.0 == b.0 && (a.1 - b.1).abs() <= 2e-3 + 3e-3 * (-a.1).max(0.0), "{a:?} {b:?}");
        }
        // A table turns against its words as seen from the part, a reversed one with them.
        let c = &machine.rotary[1];
        let turn = nalgebra::UnitQuaternion::from_axis_angle(&c.direction, angle);
        let turned = |axes: AxisPosition| AxisPosition { rotary: [axes.rotary[0], axes.rotary[1] + c.sign() * angle], ..axes };
        let placed = c.pivot + turn * (foot - c.pivot);
        let spun = near(Vector::zeros(), placed, turn * axis, [turned(from), turned(to)]);
        prop_assert_eq!(plain.len(), spun.len());
        for (a, b) in plain.iter().zip(&spun) {
            prop_assert!(a.0 == b.0 && (a.1 - b.1).abs() <= 2e-3 + 3e-3 * (-a.1).max(0.0), "{a:?} {b:?}");
        }
    }
}
