//! Bad machine files: every complaint has a place and a remedy.

use super::*;
use crate::geometry::Vector;

fn complaint(from: &str, to: &str) -> String {
    let text = builtin("xyzac-trt").unwrap();
    assert!(text.contains(from), "the file has no {from}");
    let error = Machine::read("m.toml", &text.replacen(from, to, 1)).unwrap_err();
    let place = error.place.clone().unwrap();
    assert!(place.line.is_some() && place.column.is_some() && error.help.is_some(), "{error}");
    error.to_string()
}

/// Line of the first occurrence, from 1.
fn line_of(part: &str) -> usize {
    builtin("xyzac-trt").unwrap().lines().position(|line| line.contains(part)).unwrap() + 1
}

fn assert_says(said: &str, parts: &[&str]) {
    for part in parts {
        assert!(said.contains(part), "\"{part}\" is missing in:\n{said}");
    }
}

#[test]
fn axis_named_twice() {
    let said = complaint("letter = \"C\"", "letter = \"A\"");
    assert_says(&said, &["axis A is named twice", &format!("m.toml:{}:10", line_of("letter = \"C\""))]);
    let said = complaint("[linear.Y]", "[linear.X]");
    assert_says(&said, &["duplicate key"]);
}

#[test]
fn inverted_and_absurd_limits() {
    let said = complaint("limits = [-1000, 1000]", "limits = [1000, -1000]");
    assert_says(&said, &["lower limit 1000 mm is not below upper limit -1000 mm", ":10:10", "[lower, upper]"]);
    assert_says(&complaint("[-360, 360]", "[5, 5]"), &["lower limit 5 degrees is not below"]);
    assert_says(&complaint("[-1000, 1000]", "[-1e9, 1000]"), &["no machine has"]);
    assert_says(&complaint("[-36000, 36000]", "\"endless\""), &["unlimited"]);
}

#[test]
fn directions_that_do_not_span() {
    let said = complaint("direction = [1, 0, 0]", "direction = [0, 0, -2]");
    assert_says(&said, &["parallel", "m.toml:", "tilt in two ways"]);
    assert_says(&complaint("direction = [1, 0, 0]", "direction = [0, 0, 0]"), &["has no length", "such as"]);
    let said = complaint("[linear.X]", "[linear.X]\ndirection = [0, 1, 0]");
    assert_says(&said, &["nearly in one plane"]);
    // The axis nearer the tool along the spindle: on this chain that is A.
    let said = complaint("[linear.X]", "[spindle]\naxis = [1, 0, 0]\n\n[linear.X]");
    assert_says(&said, &["does not tilt the tool"]);
}

/// The trunnion's text with one place changed.
fn changed(from: &str, to: &str) -> Machine {
    let text = builtin("xyzac-trt").unwrap();
    assert!(text.contains(from), "the file has no {from}");
    Machine::read("m.toml", &text.replacen(from, to, 1)).unwrap()
}

/// The trunnion's text with only its first rotary axes.
fn with_rotaries(count: usize) -> Machine {
    let text = builtin("xyzac-trt").unwrap();
    let (head, control) = text.split_once("[control]").unwrap();
    let mut tables = head.split("[[rotary]]");
    let kept: String = tables
        .next()
        .into_iter()
        .map(str::to_owned)
        .chain(tables.take(count).map(|t| format!("[[rotary]]{t}")))
        .collect();
    Machine::read("m.toml", &format!("{kept}[control]{control}")).unwrap()
}

#[test]
fn measured_errors_move_the_axes() {
    let nominal = Machine::named("xyzac-trt").unwrap();
    let tilted = changed(
        "direction = [1, 0, 0]",
        "direction = [1, 0, 0]\nerror = { rotation = [0, 0, 0.01], shift = [0, 0.02, -0.03] }",
    );
    let (was, is) = (&nominal.rotary[0], &tilted.rotary[0]);
    // X turned about Z by 0.01 degrees leans toward Y.
    assert!((is.direction.y - 0.01_f64.to_radians().sin()).abs() < 1e-15 && is.direction.z.abs() < 1e-18);
    assert!(((is.pivot - was.pivot) - Vector::new(0.0, 0.02, -0.03)).norm() < 1e-12);
    let skewed = changed("[linear.X]", "[linear.X]\nerror = { rotation = [0, 0, 0.02] }");
    assert!((skewed.linear[0].direction.y - 0.02_f64.to_radians().sin()).abs() < 1e-15);
    // 100 mm along the leaning X axis go 100 sin(0.02 degrees) mm sideways.
    let setup = Setup::new(&skewed, "G54", 50.0).unwrap();
    let at = |x: f64| setup.forward(&AxisPosition { linear: [x, 0.0, 0.0], rotary: [0.0; 2] }).tip;
    assert!((at(100.0).y - at(0.0).y - 100.0 * 0.02_f64.to_radians().sin()).abs() < 1e-12);
    let said = complaint("[linear.X]", "[linear.X]\nerror = { rotation = [0, 0, 45] }");
    assert_says(&said, &["45 degrees is more than an error of alignment", "another direction"]);
}

#[test]
fn fewer_axes_are_locked_ones() {
    let four = with_rotaries(1);
    assert_eq!(four.present_letters(), ['X', 'Y', 'Z', 'A']);
    assert!(four.has_axis(3) && !four.has_axis(4) && four.rotary[1].letter != 'A');
    let three = with_rotaries(0);
    assert_eq!(three.present_letters(), ['X', 'Y', 'Z']);
    assert_ne!(three.rotary[0].letter, three.rotary[1].letter);
    // Their inverse kinematics stays exact.
    for machine in [four, three] {
        let report = check(&machine).unwrap();
        assert!(report.is_sound(), "{:?}", report.contradictions);
    }
    let said = complaint(
        "[control]",
        "[[rotary]]\nletter = \"B\"\non = \"head\"\ndirection = [0, 1, 0]\npivot = [0, 0, 0]\nlimits = \"unlimited\"\nspeed = 1\nacceleration = 1\n\n[control]",
    );
    assert_says(&said, &["3 rotary axes; there can be two at most"]);
}

#[test]
fn indexed_and_modulo_axes() {
    let machine = changed("limits = [-360, 360]", "limits = \"modulo\"\nindex_step = 5");
    let axis = &machine.rotary[0];
    assert_eq!(axis.motion, RotaryMotion::Indexed { step: 5_f64.to_radians() });
    assert!(axis.is_present() && !axis.is_continuous());
    let Travel::Limited { min, max } = axis.travel else { panic!("{:?}", axis.travel) };
    assert!(min == 0.0 && (max - std::f64::consts::TAU).abs() < 1e-6 && max < std::f64::consts::TAU);
    let said = complaint("limits = [-360, 360]", "limits = [-360, 360]\nindex_step = 360");
    assert_says(&said, &["360 degrees is not a step", "0 where it is clamped at any angle"]);
}

#[test]
fn rates_and_numbers() {
    assert_says(&complaint("speed = 30000", "speed = -30000"), &["-30000 mm/min is not a positive rate"]);
    assert_says(&complaint("acceleration = 5000", "acceleration = 0"), &["0 mm/s^2 is not a positive rate"]);
    assert_says(&complaint("pivot = [5, 13, 40]", "pivot = [5, nan, 40]"), &["nan is not a finite number"]);
    let text = builtin("xyzac-trt").unwrap().replacen("pivot = [5, 13, 40]", "pivot = [5, 13]", 1);
    let said = Machine::read("m.toml", &text).unwrap_err().to_string();
    assert_says(
        &said,
        &["a list of length 2", "write a list of 3 in square brackets", &format!("m.toml:{}:9", line_of("pivot"))],
    );
    assert_says(&complaint("pivot = [5, 13, 40]", "pivot = [5, 13, 4e7]"), &["no machine has"]);
    assert_says(&complaint("speed = 30000", "speed = \"fast\""), &["wrong type", "write a number"]);
}

#[test]
fn jerk_limits_are_optional_and_positive() {
    let text = builtin("xyzac-trt").unwrap();
    assert_eq!(Machine::read("m.toml", text).unwrap().jerks(), [f64::INFINITY; 5]);
    let text = text.replacen("acceleration = 5000", "acceleration = 5000\njerk = 60000", 1);
    let text = text.replacen("acceleration = 3600", "acceleration = 3600\njerk = 18000", 1);
    let jerks = Machine::read("m.toml", &text).unwrap().jerks();
    assert_eq!((jerks[0], jerks[1], jerks[4]), (60000.0, f64::INFINITY, f64::INFINITY));
    assert!((jerks[3] - 100.0 * std::f64::consts::PI).abs() < 1e-9, "{jerks:?}");
    let said = complaint("acceleration = 5000", "acceleration = 5000\njerk = -1");
    assert_says(&said, &["-1 mm/s^3 is not a positive rate", "write a number above zero"]);
}

#[test]
fn chain_of_carriers() {
    assert_says(&complaint("carried_by = \"A\"\n", ""), &["neither says that the other carries it"]);
    assert_says(&complaint("carried_by = \"A\"", "carried_by = \"B\""), &["not the other rotary axis"]);
    assert_says(&complaint("letter = \"A\"", "letter = \"A\"\ncarried_by = \"C\""), &["carry each other"]);
    let said = complaint("on = \"table\"", "on = \"head\"");
    assert_says(&said, &["not on the same side"]);
}

#[test]
fn keys_and_values() {
    assert_says(&complaint("regulus-machine", "regulus-job"), &["is not a machine file"]);
    assert_says(&complaint("version = 1", "version = 2"), &["version 2 is not known"]);
    assert_says(&complaint("dialect = \"linuxcnc\"", "dialect = \"linuxcn\""), &["did you mean `linuxcnc`?"]);
    assert_says(&complaint("tcp_at_start = true", "tcp_at_strat = true"), &["did you mean `tcp_at_start`?"]);
    assert_says(&complaint("tcp_at_start = true", "linear_digits = 12"), &["12 decimals are too many"]);
    assert_says(&complaint("tcp_at_start = true", "inverse_time_range = [5, 1]"), &["not an increasing pair"]);
    assert_says(&complaint("tcp_at_start = true", "max_block_length = 10"), &["holds no five-axis move"]);
    assert_says(&complaint("G54 = [0, 0, 0]", ""), &["has no work offset"]);
    assert_says(&complaint("letter = \"A\"", "letter = \"U\""), &["is not the letter of a rotary axis"]);
}

#[test]
fn unknown_names_list_the_known_ones() {
    let said = Machine::named("xyzac-trl").unwrap_err().to_string();
    assert_says(&said, &["no machine is called", "did you mean xyzac-trt?", "bridgemill"]);
    let machine = Machine::named("trunnion-ac-30i").unwrap();
    let said = Setup::new(&machine, "G59", 10.0).unwrap_err().to_string();
    assert_says(&said, &["no work offset \"G59\"", "G54, G55"]);
    assert!(
        Setup::new(&machine, "G54", f64::NAN).is_err() && Setup::at(&machine, [0.0, f64::INFINITY, 0.0], 1.0).is_err()
    );
}
