use super::*;
use crate::geometry::{Direction, Knots, Point, SplineCurve, Vector};
use crate::motion::path::{FeedReference, Pass, PassKind, PassMotion, RuledMotion, TimedPoses, ToolPath, ToolSummary};
use crate::motion::pose::Pose;
use proptest::prelude::*;

const GIVEN: Assumptions<'_> = Assumptions {
    name: "file",
    tool: None,
    gauge_length: Some(100.0),
    flute_length: Some(30.0),
    spindle: Some(5000.0),
    feed: None,
    linearization: 0.001,
};

fn timed(pass: &Pass) -> &TimedPoses {
    match &pass.motion {
        PassMotion::Timed(timed) => timed,
        other => panic!("{other:?}"),
    }
}

fn tips(pass: &Pass) -> Vec<[f64; 3]> {
    timed(pass).poses.iter().map(|pose| pose.tip.into()).collect()
}

#[test]
fn motion_feeds_and_tools_are_read() {
    let text = "PARTNO blade 7\n$$ a comment\nUNITS/MM\nMULTAX/ON\nCUTTER/16.,0,8.,0,0,0,32.\nLOADTL/4,LENGTH,93.\n\
                SPINDL/10156,RPM,CLW\nCOOLNT/FLOOD\nFROM/0,0,50\nRAPID\nGOTO  /  .5,  -8.8, 5, 0, 0, 1\n\
                FEDRAT/600.,MMPM\nGOTO/10.5,-8.8,$\n 5.0,0.6,0.,0.8\nGOTO/10.5,-8.8,15.0\nRAPID/\nGOTO/0,0,50\nFINI\n";
    let file = read(text, 0.001);
    assert_eq!((file.name.as_str(), file.unread.len(), file.lines, file.statements), ("blade 7", 0, 18, 16));
    let [operation] = &file.operations[..] else { panic!("{file:?}") };
    assert_eq!((operation.tool, operation.tool_length, operation.cutter), (Some(4), Some(93.0), Some([16.0, 0.0])));
    assert!(operation.coolant && file.has_units);
    let path =
        operation.tool_path(&file.name, &Assumptions { flute_length: None, gauge_length: None, ..GIVEN }).unwrap();
    assert_eq!((path.spindle_rpm, path.tool.flute_length, path.tool.gauge_length), (10156.0, 32.0, 93.0));
    let kinds: Vec<_> = path.passes.iter().map(|pass| pass.kind).collect();
    assert_eq!(kinds, [PassKind::Rapid, PassKind::Cut, PassKind::Rapid]);
    assert_eq!(tips(&path.passes[1]), [[0.5, -8.8, 5.0], [10.5, -8.8, 5.0], [10.5, -8.8, 15.0]]);
    // 10 mm at 600 mm/min each; a GOTO of three numbers keeps the axis.
    let cut = timed(&path.passes[1]);
    assert!((cut.seconds[1] - 1.0).abs() < 1e-12 && (cut.seconds[2] - 2.0).abs() < 1e-12);
    assert!((cut.poses[2].axis.x - 0.6).abs() < 1e-12 && cut.lines == [11, 13, 15]);
}

#[test]
fn inches_and_their_feeds_are_converted() {
    let text = "UNITS/INCHES\nSPINDL/1000,RPM\nGOTO/0,0,0\nFEDRAT/10\nGOTO/1,0,0\nFEDRAT/254,MMPM\nGOTO/2,0,0\nFEDRAT/0.01,IPR\nGOTO/3,0,0\n";
    let file = read(text, 0.001);
    let path = file.operations[0].tool_path("", &GIVEN).unwrap();
    assert_eq!(path.name, "file");
    let cut = timed(&path.passes[0]);
    assert!((cut.poses[3].tip.x - 76.2).abs() < 1e-12);
    assert!(cut.seconds.iter().zip([0.0, 6.0, 12.0, 18.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{:?}", cut.seconds);
    let metric = read("GOTO/0,0,0\nFEDRAT/600\nGOTO/10,0,0\n", 0.001);
    assert!(!metric.has_units && metric.operations[0].legs[0].feed == Some(600.0));
}

#[test]
fn circles_become_chords_within_the_tolerance() {
    let text = "GOTO/10,0,0\nFEDRAT/600\nCIRCLE/0,0,0,0,0,1,10,0.1,0.5,12,0\nGOTO/0,10,5\nCIRCLE/0,0,5,0,0,-1,10\nGOTO/0,10,5\n";
    for chord in [0.1, 0.001] {
        let file = read(text, chord);
        assert_eq!(file.unread, []);
        let legs = &file.operations[0].legs;
        let corners: Vec<usize> = (0..legs.len()).filter(|k| legs[*k].corner).collect();
        assert_eq!(corners.len(), 2);
        let mut from = Point::new(10.0, 0.0, 0.0);
        let mut angle: f64 = 0.0;
        for (k, leg) in legs.iter().enumerate() {
            let middle = from + (leg.to.tip - from) * 0.5;
            let sagitta = 10.0 - middle.x.hypot(middle.y);
            assert!((leg.to.tip.x.hypot(leg.to.tip.y) - 10.0).abs() < 1e-9 && sagitta <= chord * (1.0 + 1e-9));
            if k <= corners[0] {
                angle += (leg.to.tip.y.atan2(leg.to.tip.x) - from.y.atan2(from.x)).abs();
                // A helix rises evenly.
                assert!((leg.to.tip.z - 5.0 * angle / std::f64::consts::FRAC_PI_2).abs() < 1e-9);
            }
            from = leg.to.tip;
        }
        // The second is a whole circle, clockwise as seen from above.
        let after = legs[corners[0] + 1].to.tip;
        assert!(
            after.x > 0.0 && after.y < 10.0 && (legs[corners[1]].to.tip - Point::new(0.0, 10.0, 5.0)).norm() < 1e-12
        );
    }
    let off = read("GOTO/10,0,0\nFEDRAT/600\nCIRCLE/0,0,0,0,0,1,9\nGOTO/0,10,0\n", 0.001);
    assert_eq!((off.unread[0].line, off.unread[0].word.as_str(), off.unread[0].harmless), (3, "CIRCLE", false));
}

#[test]
fn incremental_moves_home_and_drilling() {
    let text = "FROM/0,0,20\nFEDRAT/600\nTLAXIS/0,0,1\nGODLTA/1,2,3\nGODLTA/-5\n\
                CYCLE/DRILL,FEDTO,4,MMPM,120,RAPTO,2,RTRCTO,10\nGOTO/5,5,0\nCYCLE/OFF\nRAPID\nGOHOME\n";
    let file = read(text, 0.001);
    assert_eq!(file.unread, []);
    let legs = &file.operations[0].legs;
    let seen: Vec<_> = legs.iter().map(|leg| (leg.to.tip.z, leg.feed)).collect();
    let feeds = [Some(600.0), Some(600.0), None, None, Some(120.0), None, None];
    assert_eq!(seen, [23.0, 18.0, 10.0, 2.0, -4.0, 10.0, 20.0].into_iter().zip(feeds).collect::<Vec<_>>());
    assert_eq!(legs[6].to.tip, Point::new(0.0, 0.0, 20.0));
}

#[test]
fn a_new_tool_is_a_new_operation() {
    let text = "CUTTER/6\nLOAD/TOOL,4\nGOTO/0,0,9\nFEDRAT/60\nGOTO/0,0,0\nCUTTER/3,0.5\nLOAD/TOOL,16\nGOTO/5,0,9\nGOTO/5,0,0\nLOADTL/2\n";
    let file = read(text, 0.001);
    let seen: Vec<_> = file.operations.iter().map(|o| (o.tool, o.cutter, o.legs.len(), o.line)).collect();
    assert_eq!(seen, [(Some(4), Some([6.0, 0.0]), 1, 2), (Some(16), Some([3.0, 0.5]), 1, 7)]);
    assert_eq!(file.operations[1].start.unwrap().0.tip, Point::new(5.0, 0.0, 9.0));
}

#[test]
fn what_is_not_understood_is_listed_by_line_and_word() {
    let text = "MACHIN/PWORKS,0\nWOBBLE/1,2\nGOTO/1,2\nFEDRAT/-5\nFEDRAT/100,FURLONGS\nGOTO/0,0,0,0,0,0\n  CYCLE/BORE,1\n\
                GOTO/0,0,0,SIDEWAYS\nFROM/1,1,1\nGOHOME/3\nFINI\nGOTO/1,1,1\n";
    let seen: Vec<_> = read(text, 0.001).unread.into_iter().map(|u| (u.line, u.column, u.word, u.harmless)).collect();
    let expected = [
        (1, 1, "MACHIN", true),
        (2, 1, "WOBBLE", false),
        (3, 1, "GOTO", false),
        (4, 1, "FEDRAT", false),
        (5, 12, "FURLONGS", false),
        (6, 1, "GOTO", false),
        (7, 3, "CYCLE", false),
        (8, 12, "SIDEWAYS", false),
        (10, 1, "GOHOME", false),
        (12, 1, "GOTO", true),
    ];
    assert_eq!(seen, expected.map(|(line, column, word, harmless)| (line, column, word.to_owned(), harmless)));
}

#[test]
fn what_the_file_does_not_say_is_asked_for_at_once() {
    let file = read("GOTO/0,0,0\nGOTO/1,0,0\n", 0.001);
    let said =
        file.operations[0].tool_path("", &Assumptions { linearization: 0.001, ..Assumptions::default() }).unwrap_err();
    let helps: Vec<_> = said.iter().filter_map(|finding| finding.help.as_deref()).collect();
    assert_eq!(helps, ["give --gauge-length MM", "give --flank MM", "give --spindle RPM", "give --feed MM_PER_MIN"]);
}

fn path(passes: Vec<Pass>) -> ToolPath {
    ToolPath {
        name: "blade ö".to_owned(),
        tool: ToolSummary { number: 3, description: "cone".to_owned(), gauge_length: 120.0, flute_length: 30.0 },
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes,
    }
}

#[test]
fn a_ruled_pass_is_written_within_the_linearization() {
    let rail = |points: [[f64; 3]; 4]| {
        let knots = Knots::clamped_uniform(3, 4).unwrap();
        SplineCurve::from_knots(knots, points.map(Point::from).to_vec()).unwrap()
    };
    let motion = RuledMotion {
        lower: rail([[0.0, 0.0, 0.0], [10.0, 4.0, 0.0], [20.0, -4.0, 1.0], [30.0, 0.0, 0.0]]),
        upper: rail([[0.0, 2.0, 30.0], [10.0, 8.0, 30.0], [20.0, 0.0, 31.0], [30.0, 5.0, 30.0]]),
        lower_height: 0.0,
    };
    let cut = Pass { kind: PassKind::Cut, strip: Some(0), motion: PassMotion::Ruled(motion.clone()) };
    let text = write(&path(vec![cut])).unwrap();
    let back = read(&text, 0.001);
    assert_eq!((back.unread.len(), back.name.as_str()), (0, "blade"));
    let legs = &back.operations[0].legs;
    assert!(legs.len() > 4, "{text}");
    let dense: Vec<Pose> = (0..=4000).filter_map(|k| motion.pose(f64::from(k) / 4000.0)).collect();
    let mut from = back.operations[0].start.unwrap().0;
    for leg in legs {
        for share in [0.3, 0.5, 0.8] {
            let written = from.interpolate(&leg.to, share);
            let off = dense.iter().map(|pose| pose.distance_along(&written, 30.0)).fold(f64::INFINITY, f64::min);
            // The dense poses lie 0.01 mm apart along the motion.
            assert!(off < 0.001 + 0.006, "{off}");
        }
        from = leg.to;
    }
}

proptest! {
    #[test]
    fn what_is_written_is_what_is_read_to_its_digits(
        places in prop::collection::vec((prop::array::uniform3(-500.0..500.0), prop::array::uniform3(-1.0..1.0), 0.01..5.0), 2..12),
        rapid in any::<bool>(),
    ) {
        let poses = places.iter().map(|(tip, axis, _)| {
            let axis = Vector::from(*axis) + Vector::z() * 1.8;
            Pose { tip: Point::from(*tip), axis: Direction::new_normalize(axis) }
        });
        let poses: Vec<Pose> = poses.collect();
        let mut motion = TimedPoses::starting(poses[0], 1);
        for (pose, (_, _, seconds)) in poses.iter().zip(&places).skip(1) {
            motion.push(*pose, *seconds, 1, true);
        }
        let kind = if rapid { PassKind::Rapid } else { PassKind::Cut };
        let given = path(vec![Pass { kind, strip: None, motion: PassMotion::Timed(motion.clone()) }]);
        let back = read(&write(&given).unwrap(), 0.001);
        prop_assert_eq!(&back.unread, &[]);
        let again = back.operations[0].tool_path(&back.name, &GIVEN).unwrap();
        prop_assert_eq!(again.passes[0].kind, kind);
        prop_assert_eq!(again.tool.gauge_length, 120.0);
        let read_back = timed(&again.passes[0]);
        for (index, (a, b)) in read_back.poses.iter().zip(&poses).enumerate() {
            prop_assert!((a.tip - b.tip).norm() < 1e-6 && a.axis_angle(b) < 2e-9);
            prop_assert!(rapid || (read_back.seconds[index] / motion.seconds[index].max(1e-9) - 1.0).abs() < 1e-3 || index == 0);
        }
        prop_assert_eq!(read_back.poses.len(), poses.len());
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "((GOTO|FEDRAT|CIRCLE|CYCLE|CUTTER|LOADTL|FROM|SPINDL|GODLTA)?/?[-0-9.,$ A-Z\u{e9}]{0,14}\n?){0,40}") {
        let file = read(&text, 0.001);
        for unread in &file.unread {
            prop_assert!(unread.line >= 1 && unread.line <= file.lines && unread.column >= 1);
        }
        for leg in file.operations.iter().flat_map(|operation| &operation.legs) {
            prop_assert!(leg.to.tip.coords.norm().is_finite());
        }
    }
}
