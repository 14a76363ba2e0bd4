use super::*;
use proptest::prelude::*;

fn line(points: &[[f64; 3]]) -> SplineCurve {
    let knots = Knots::clamped_uniform(2, points.len()).unwrap();
    SplineCurve::from_knots(knots, points.iter().copied().map(Point::from).collect()).unwrap()
}

fn sample() -> ToolPath {
    let ruled = RuledMotion {
        lower: line(&[[0.0, 0.0, 0.0], [1.0, 0.1, 0.0], [2.0, 0.0, 1.0 / 3.0]]),
        upper: line(&[[0.0, 0.0, 10.0], [1.0, 0.3, 10.0], [2.0, 0.5, 10.1]]),
        lower_height: 0.7,
    };
    let end = ruled.pose(1.0).unwrap();
    let away = Pose { tip: end.tip + Vector::new(0.0, 0.0, 50.0), axis: end.axis };
    ToolPath {
        name: "blade \"ö\"".to_owned(),
        tool: ToolSummary { number: 3, description: "cone".to_owned(), gauge_length: 120.0, flute_length: 40.0 },
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes: vec![
            Pass { kind: PassKind::Cut, strip: Some(0), motion: PassMotion::Ruled(ruled) },
            Pass { kind: PassKind::Retract, strip: None, motion: PassMotion::Poses(vec![end, away]) },
        ],
    }
}

/// The sample with a retract that has times of its own.
fn timed_sample() -> ToolPath {
    let mut path = sample();
    if let PassMotion::Poses(poses) = &path.passes[1].motion {
        let mut timed = TimedPoses::starting(poses[0], 7);
        timed.push(poses[0].interpolate(&poses[1], 0.5), 0.1, 8, false);
        timed.push(poses[1], 0.25, 8, true);
        path.passes[1].motion = PassMotion::Timed(timed);
    }
    path
}

#[test]
fn times_and_lines_survive_the_file() {
    let path = timed_sample();
    let text = write(&path).unwrap();
    assert_eq!(read(&text, "p.cl").unwrap(), path);
    let motion = &path.passes[1].motion;
    assert!((motion.seconds(0.5, 2.0).unwrap() - 0.3).abs() < 1e-12);
    let PassMotion::Timed(timed) = motion else { panic!("{motion:?}") };
    assert_eq!((timed.line_near(&timed.poses[0]), &timed.corners[..]), (Some(7), &[0, 2][..]));
    for (from, to, said) in [
        ("\"seconds\":[0.0,", "\"seconds\":[", "lists of different length"),
        ("\"seconds\":[0.0,", "\"seconds\":[1.0,", "`seconds` fall"),
        ("\"corners\":[0,2]", "\"corners\":[0,3]", "no ascending indices"),
        ("\"corners\":[0,2]", "\"corners\":[2,2]", "no ascending indices"),
    ] {
        assert!(text.contains(from), "{text}");
        let e = read(&text.replacen(from, to, 1), "p.cl").unwrap_err().to_string();
        assert!(e.contains(said) && e.contains("p.cl:3:1") && e.contains("help: "), "{e}");
    }
}

#[test]
fn what_is_written_is_what_is_read() {
    let path = sample();
    let text = write(&path).unwrap();
    assert_eq!(read(&text, "p.cl").unwrap(), path);
    assert_eq!(write(&read(&text, "p.cl").unwrap()).unwrap(), text);
}

#[test]
fn each_pass_is_one_line_after_the_head() {
    let text = write(&sample()).unwrap();
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines.len(), 4, "{text}");
    assert!(lines[0].starts_with("{\"format\":\"regulus-cl\",\"version\":1,\"name\":"), "{text}");
    assert!(lines[1].starts_with("{\"kind\":\"cut\",\"strip\":0,\"ruled\":{\"degree\":2,"), "{text}");
    assert!(lines[2].starts_with("{\"kind\":\"retract\",\"poses\":[["), "{text}");
}

#[test]
fn numbers_without_end_are_not_written() {
    let mut path = sample();
    path.cut_feed = f64::NAN;
    assert!(write(&path).unwrap_err().message.contains("NaN"));
    let mut path = sample();
    if let PassMotion::Poses(poses) = &mut path.passes[1].motion {
        poses[1].tip.x = f64::INFINITY;
    }
    assert!(write(&path).unwrap_err().message.starts_with("pass 1: "));
}

/// What is said of the sample after one replacement in its text.
fn complaint(from: &str, to: &str) -> String {
    let text = write(&sample()).unwrap();
    assert!(text.contains(from), "{from} is not in {text}");
    read(&text.replacen(from, to, 1), "p.cl").unwrap_err().to_string()
}

#[test]
fn bad_input_is_located() {
    for (from, to, said, place) in [
        ("regulus-cl", "other", "format \"other\" is not that of a tool path", "p.cl:1:1"),
        ("\"version\":1", "\"version\":2", "version 2 of the regulus-cl format", "p.cl:1:1"),
        ("\"cut_feed\":600.0", "\"cut_feed\":-1", "`cut_feed` is -1", "p.cl:1:1"),
        ("\"gauge_length\":120.0", "\"gauge_length\":12", "is shorter than", "p.cl:1:1"),
        ("\"cut_feed\":600.0", "\"cut_feed\":\"x\"", "invalid type", "p.cl:1:"),
        ("\"cut_feed\"", "\"feed\"", "unknown field `feed`", "p.cl:1:"),
        ("600.0", "1e999", "number out of range", "p.cl:1:"),
        ("\"degree\":2", "\"degree\":0", "pass 0: `ruled`: degree 0", "p.cl:2:1"),
        ("\"degree\":2", "\"degree\":\"2\"", "invalid type", "p.cl:2:"),
        ("\"upper\":[[0.0,0.0,10.0],", "\"upper\":[", "pass 0: `upper`", "p.cl:2:1"),
        ("\"poses\"", "\"pose\"", "unknown field `pose`", "p.cl:3:"),
        ("\"kind\":\"retract\"", "\"kind\":\"jump\"", "unknown variant `jump`", "p.cl:3:"),
    ] {
        let text = complaint(from, to);
        assert!(text.contains(said) && text.contains(place) && text.contains("help: "), "{to}: {text}");
    }
}

#[test]
fn text_that_is_no_json_is_refused() {
    for text in ["", "{", "[]", "nonsense", "{\"format\":\"regulus-cl\"}"] {
        let said = read(text, "p.cl").unwrap_err().to_string();
        assert!(said.contains("not a tool path") && said.contains("p.cl:1:"), "{said}");
    }
}

#[test]
fn a_gap_between_passes_is_refused() {
    let mut path = sample();
    if let PassMotion::Poses(poses) = &mut path.passes[1].motion {
        poses[0].tip.x += 0.5;
    }
    let said = read(&write(&path).unwrap(), "p.cl").unwrap_err().to_string();
    assert!(said.contains("pass 1: starts 0.500000 mm") && said.contains("p.cl:3:1"), "{said}");
}

#[test]
fn axes_must_have_length_one() {
    let mut path = sample();
    path.passes.remove(0);
    let text = write(&path).unwrap();
    let (start, _) = text.split_once("\"poses\":[[").unwrap();
    let said = read(&format!("{start}\"poses\":[[0,0,0,0,0,2]]}}\n]}}"), "p.cl").unwrap_err().to_string();
    assert!(said.contains("the axis of pose 0 has length 2"), "{said}");
    let seven_digits = format!("{start}\"poses\":[[0,0,0,0.6000001,0,0.8]]}}\n]}}");
    let read_back = read(&seven_digits, "p.cl").unwrap();
    let axis = read_back.passes[0].motion.pose(0.0).unwrap().axis;
    assert!((axis.norm() - 1.0).abs() < 1e-15);
}

#[test]
fn rails_that_meet_are_refused() {
    let said = complaint("\"upper\":[[0.0,0.0,10.0]", "\"upper\":[[0.0,0.0,0.0]");
    assert!(said.contains("pass 0: the rails meet at parameter 0"), "{said}");
}

proptest! {
    #[test]
    fn every_finite_path_survives_the_file(
        numbers in proptest::collection::vec(proptest::num::f64::NORMAL | proptest::num::f64::ZERO, 3),
        scale in -300i32..300,
        axis in proptest::array::uniform3(-1.0f64..1.0),
        strip in proptest::option::of(any::<u32>()),
    ) {
        let axis = Vector::from(axis);
        prop_assume!(axis.norm() > 1e-3);
        let mut path = sample();
        let tip = Point::new(numbers[0], numbers[1], numbers[2] * 10f64.powi(scale).min(1.0));
        prop_assume!(tip.coords.iter().all(|x| x.is_finite()));
        let pose = Pose { tip, axis: Direction::new_normalize(axis) };
        path.passes = vec![Pass { kind: PassKind::Rapid, strip, motion: PassMotion::Poses(vec![pose]) }];
        let text = write(&path).unwrap();
        prop_assert_eq!(read(&text, "p.cl").unwrap(), path);
    }

    #[test]
    fn no_text_makes_the_reader_panic(cut in 0usize..2000, insert in "[\\PC]{0,6}") {
        let text = write(&sample()).unwrap();
        let mut cut = cut.min(text.len());
        while !text.is_char_boundary(cut) {
            cut -= 1;
        }
        let broken = format!("{}{insert}{}", &text[..cut], &text[cut..]);
        if let Err(e) = read(&broken, "p.cl") {
            prop_assert!(e.place.is_some_and(|p| p.line.is_some()));
        }
    }
}
