//! From a program's text to the verdict.

use super::fixtures::*;
use super::region::plane;
use crate::geometry::{Point, SplineCurve};
use crate::machine::{AxisMove, LinearizeOptions, Machine, ProgramWords, Setup, linearize};
use crate::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, RuledMotion, ToolPath, ToolSummary};
use crate::nc::{Rules, read};
use crate::part::Part;
use crate::simulate::{ToolMotion, simulate};
use crate::verify::{BlockMotion, Settings, Subject, ToleranceRecord, Verdict, Verified, verify, verify_motion};

const FIRST_CUT: usize = 8;

/// Mills the plane z = 0 with the end of a cylinder, 10 mm passes overlapping; line numbers as in `FIRST_CUT`.
fn program(body: &str) -> String {
    format!("G21 G90 G17\nG54\nT1 M6\nS8000 M3\nG43 H1\nM428\nG0 A0 C0 X-40 Y-6 Z20\n{body}G0 Z20\nM429\nM30\n")
}

fn cuts() -> String {
    "G0 Z5\nG1 Z0 F600\nX40\nY0\nX-40\nY6\nX40\n".to_owned()
}

fn motion(text: &str) -> ToolMotion {
    let machine = Machine::named("xyzac-trt").unwrap();
    let setup = Setup::new(&machine, "G54", 200.0).unwrap();
    simulate(&read(text.as_bytes(), &Rules::of(&machine)), &setup, Some(1.into()))
}

fn check(text: &str, path: Option<&ToolPath>, settings: &Settings) -> Verified {
    let part = Part { name: "plane".into(), surface: plane([-20.0, 20.0], [-8.0, 8.0]), body: None, check: vec![] };
    let tolerance = ToleranceRecord { overcut: 0.005, undercut: 0.02 };
    let (motion, tool) = (motion(text), cylinder(10.0));
    let program = read(text.as_bytes(), &Rules::of(motion.setup().machine()));
    verify(&Subject { program: &program, motion: &motion, tool: &tool, part: &part, tolerance, path }, settings)
}

fn judged(body: &str) -> Verified {
    check(&program(body), None, &Settings::default())
}

fn only_reason(verified: &Verified) -> &str {
    assert_eq!(verified.record.verdict, Verdict::Fail);
    assert_eq!(verified.record.reasons.len(), 1, "{:?}", verified.record.reasons);
    &verified.record.reasons[0]
}

#[test]
fn good_program_passes_with_all_keys_in_order() {
    let verified = judged(&cuts());
    assert_eq!((verified.record.verdict, &verified.record.reasons), (Verdict::Pass, &vec![]));
    let json = verified.record.to_json().unwrap();
    let keys = [
        "format",
        "version",
        "verdict",
        "reasons",
        "deviation",
        "overcut_max_mm",
        "undercut_max_mm",
        "within_tolerance_share",
        "tolerance",
        "overcut",
        "undercut",
        "samples",
        "overcut_bound_mm",
        "undercut_bound_mm",
        "blending_band_mm",
        "strips",
        "count",
        "kink_max_deg",
        "kink_mean_deg",
        "gap_max_mm",
        "program",
        "blocks",
        "duration_s",
        "cut_length_mm",
        "max_block_rate_hz",
        "blending_mm",
        "blending_rotary_deg",
        "round_trip",
        "axes",
        "X",
        "min",
        "max",
        "travel",
        "max_rate",
        "max_accel",
        "C",
        "limits",
        "collisions",
    ];
    let mut from = 0;
    for key in keys {
        let quoted = format!("\"{key}\":");
        from += json[from..].find(&quoted).unwrap_or_else(|| panic!("{key} is missing after byte {from}")) + 1;
    }
    let value: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(value["format"], "regulus-verify");
    assert_eq!(value["verdict"], "pass");
    assert_eq!(value["deviation"]["within_tolerance_share"], 1.0);
    // Beside the part the tool is in free space: each way across it is a strip.
    assert_eq!(value["strips"]["count"], 3);
    assert!(!json.contains("-0.0,") && !json.contains("-0.0\n"), "{json}");
    assert_eq!(value["axes"]["X"]["max"], 40.0);
    assert_eq!(value["round_trip"], serde_json::Value::Null);
}

#[test]
fn gouge_names_its_line() {
    let verified = judged(&cuts().replace("Y0\nX-40\n", "Y0\nX5\nZ-0.05\nZ0\nX-40\n"));
    assert!((verified.record.deviation.overcut_max_mm - 0.05).abs() < 1e-6);
    let line = FIRST_CUT + 5;
    let reason = only_reason(&verified);
    assert!(
        reason.starts_with(&format!("line {line}: overcut is 0.0500 mm"))
            || reason.starts_with(&format!("line {}: overcut", line + 1)),
        "{reason}"
    );
}

#[test]
fn stock_left_and_places_not_reached_are_told_apart() {
    let high = judged(&cuts().replace("Z0", "Z0.03"));
    assert!((high.record.deviation.undercut_max_mm - 0.03).abs() < 1e-9);
    assert_eq!(high.record.deviation.within_tolerance_share, 0.0);
    assert!(only_reason(&high).starts_with("undercut is 0.0300 mm"), "{:?}", high.record.reasons);
    let missing = judged(&cuts().replace("Y6\nX40\n", ""));
    assert!(missing.record.deviation.uncut_share > 0.1);
    assert!(only_reason(&missing).starts_with("no pass comes within 1 mm"), "{:?}", missing.record.reasons);
}

#[test]
fn rapid_through_the_part_is_a_collision() {
    let verified = judged(&cuts().replace("G1 Z0 F600\nX40", "G0 Z0\nX40\nG1 F600"));
    let collision = &verified.record.collisions[0];
    assert_eq!((collision.line, collision.body_a.as_str()), (FIRST_CUT + 2, "flutes in rapid"));
    assert!(only_reason(&verified).starts_with("line 10: flutes in rapid"), "{:?}", verified.record.reasons);
}

#[test]
fn unknown_text_refuses_a_pass_unless_told_to_go_on() {
    let text = program(&cuts()).replace("G54\n", "G54 G6.2\n");
    let refused = check(&text, None, &Settings::default());
    assert!(only_reason(&refused).contains("line 2"), "{:?}", refused.record.reasons);
    let told = check(&text, None, &Settings { despite_unknown_text: true, ..Settings::default() });
    assert_eq!(told.record.verdict, Verdict::Pass);
}

/// Overcut 0, allowed 0.005 mm.
#[test]
fn corners_that_may_be_rounded_are_a_band_about_the_motion() {
    let with = |tolerance: &str| check(&program(&format!("G64 P{tolerance}\n{}", cuts())), None, &Settings::default());
    let narrow = with("0.004").record;
    assert_eq!((narrow.verdict, narrow.program.blending_mm), (Verdict::Pass, 0.004), "{:?}", narrow.reasons);
    let wide = with("0.006");
    assert!(only_reason(&wide).contains("overcut may be 0.0060 mm"), "{:?}", wide.record.reasons);
}

/// In the cut, and 20 mm above the part.
#[test]
fn rotary_axes_that_may_leave_their_way_at_corners_widen_the_band() {
    let cut = cuts();
    let with = |before: &str, after: &str| {
        let verified =
            check(&program(&format!("G64 P0.001\n{}", cut.replace(before, after))), None, &Settings::default());
        (verified.record.program.blending_rotary_deg, verified.record.deviation.blending_band_mm, verified)
    };
    let (degrees, band, plain) = with("X40\n", "X40\n");
    assert_eq!((degrees, band, plain.record.verdict), (0.0, 0.001, Verdict::Pass), "{:?}", plain.record.reasons);
    // About the tool's own axis the part turns under it.
    let (degrees, band, _) = with("X-40\nY6\n", "X-40 C0.01\nY6 C0.02\n");
    assert!((degrees - 0.01).abs() < 1e-9 && (band - 0.001).abs() < 1e-6, "{degrees} {band}");
    // A tilt of 0.01 degrees beside none: at the end of the flutes of 40 mm, and at their radius of 5 mm.
    let (degrees, band, tilted) = with("X40\nY0\n", "X40\nY0 A0.01\n");
    let angle = 0.01_f64.to_radians();
    assert!((degrees - 0.01).abs() < 1e-9 && (band - 0.001 - 45.0 * angle).abs() < 1e-6, "{degrees} {band}");
    let said = &tilted.record.reasons;
    assert!(said.iter().any(|reason| reason.contains("a rotary axis may be 0.0100 degrees off there")), "{said:?}");
    let (degrees, band, far) = with("Y6\nX40\n", "Y6\nX40\nZ20\nA1\n");
    assert!((degrees - 1.0).abs() < 1e-9 && band == 0.001, "{degrees} {band}");
    assert_eq!(far.record.verdict, Verdict::Pass, "{:?}", far.record.reasons);
}

/// To LinuxCNC that means as much as the machine makes of it.
#[test]
fn a_tolerance_of_zero_is_none_to_linuxcnc() {
    for tolerance in ["0", "-0.01"] {
        let verified = check(&program(&format!("G64 P{tolerance}\n{}", cuts())), None, &Settings::default());
        let said = verified.record.findings.iter().find(|finding| finding.id == "R206").map(|finding| &finding.message);
        assert!(said.is_some_and(|said| said.contains("without any tolerance")), "{said:?}");
    }
}

#[test]
fn axis_beyond_its_travel_fails() {
    let verified = judged(&cuts().replace("X40\nY0", "X1400\nX40\nY0"));
    assert!(only_reason(&verified).contains("travel of X"), "{:?}", verified.record.reasons);
    assert_eq!(verified.record.limits[0].line, FIRST_CUT + 2);
}

#[test]
fn program_without_a_cut_fails() {
    let verified = judged("");
    assert!(verified.record.reasons.iter().any(|r| r.contains("no move at feed")), "{:?}", verified.record.reasons);
    assert_eq!(verified.record.deviation.uncut_share, 1.0);
    assert!(verified.record.to_json().unwrap().contains("\"max_block_rate_hz\": 0.0"));
}

/// The path of `cuts`, lifted.
fn path(lift: f64) -> ToolPath {
    let at = |x: f64, y: f64, z: f64| pose([x, y, z + lift], [0.0, 0.0, 1.0]);
    let tool = cylinder(10.0);
    let pass = |kind, poses| Pass { kind, strip: None, motion: PassMotion::Poses(poses) };
    let cut = vec![
        at(-40.0, -6.0, 0.0),
        at(40.0, -6.0, 0.0),
        at(40.0, 0.0, 0.0),
        at(-40.0, 0.0, 0.0),
        at(-40.0, 6.0, 0.0),
        at(40.0, 6.0, 0.0),
    ];
    ToolPath {
        name: "plane".into(),
        tool: ToolSummary::of(&tool),
        cut_feed: 600.0,
        feed_reference: FeedReference::Tip,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes: vec![
            pass(PassKind::Approach, vec![at(-40.0, -6.0, 5.0), at(-40.0, -6.0, 0.0)]),
            pass(PassKind::Cut, cut),
        ],
    }
}

#[test]
fn round_trip_is_the_distance_from_the_path() {
    let against = |lift| {
        let found = check(&program(&cuts()), Some(&path(lift)), &Settings::default());
        found.record.round_trip.unwrap()
    };
    assert!(against(0.0).tip_max_mm < 1e-9 && against(0.0).axis_max_deg < 1e-9, "{:?}", against(0.0));
    assert!((against(0.013).tip_max_mm - 0.013).abs() < 1e-9, "{:?}", against(0.013));
}

/// Two cuts of the plane with a link between; what is between them in program and path.
fn two_cuts(aside: &str) -> (String, ToolPath) {
    let body = format!("G0 Z5\nG1 Z0 F600\nX40\n{aside}X-40 Y4\nZ0\nG1 X40 F600\n");
    let at = |x: f64, y: f64, z: f64| pose([x, y, z], [0.0, 0.0, 1.0]);
    let pass = |kind, poses: Vec<Pose>| Pass { kind, strip: None, motion: PassMotion::Poses(poses) };
    let passes = vec![
        pass(PassKind::Cut, vec![at(-40.0, -5.0, 0.0), at(40.0, -5.0, 0.0)]),
        pass(
            PassKind::Rapid,
            vec![at(40.0, -5.0, 0.0), at(40.0, -5.0, 20.0), at(-40.0, 4.0, 20.0), at(-40.0, 4.0, 0.0)],
        ),
        pass(PassKind::Cut, vec![at(-40.0, 4.0, 0.0), at(40.0, 4.0, 0.0)]),
    ];
    (program(&body).replace("X-40 Y-6", "X-40 Y-5"), ToolPath { passes, ..path(0.0) })
}

#[test]
fn a_link_at_feed_through_free_space_is_a_link() {
    let found = ["G0 Z20\n", "G1 Z20 F9000\n"].map(|aside| {
        let (text, path) = two_cuts(aside);
        check(&text, Some(&path), &Settings::default()).record
    });
    for found in found {
        assert_eq!((found.verdict, found.strips.count), (Verdict::Pass, 2), "{:?}", found.reasons);
        let round_trip = found.round_trip.unwrap();
        assert!(round_trip.tip_max_mm < 1e-9 && round_trip.axis_max_deg < 1e-9, "{round_trip:?}");
    }
    // Low over the part it is no link, and no part of the path either.
    let (text, path) = two_cuts("G1 Z0.5 F9000\n");
    let low = check(&text, Some(&path), &Settings::default()).record;
    assert!(low.round_trip.unwrap().tip_max_mm > 0.4, "{low:?}");
}

/// To turn rotary axes back the post leaves the part and comes back to the same place: that is no part of the path.
#[test]
fn ways_out_that_the_path_does_not_know_are_no_deviation_from_it() {
    let straight = "G1 Z0 F600\nX40\nY0";
    for out in ["G0 Z20\nZ5\nG1 Z0 F600", "G1 Z5 F9000\nZ20\nZ5\nZ0 F600"] {
        let body = cuts().replace(straight, &format!("G1 Z0 F600\nX3\n{out}\nX40\nY0"));
        let found = check(&program(&body), Some(&path(0.0)), &Settings::default()).record;
        assert!(found.round_trip.unwrap().tip_max_mm < 1e-9, "{out}: {:?}", found.round_trip);
        let gone = check(&program(&body.replace("X3\n", "X3 Y-5\n")), Some(&path(0.0)), &Settings::default()).record;
        assert!(gone.round_trip.unwrap().tip_max_mm > 1.0 - 1e-9, "{out}: {:?}", gone.round_trip);
    }
}

/// A curved and twisted strip whose parameter runs slowly at one end, very fast in the middle and slowly again.
fn uneven_pass() -> RuledMotion {
    let knots = || vec![0.0, 0.0, 0.0, 0.0, 0.02, 0.3, 0.31, 0.9, 1.0, 1.0, 1.0, 1.0];
    let angles: [f64; 8] = [0.0, 0.02, 0.1, 0.7, 1.0, 1.9, 2.1, 2.6];
    let rail = |radius: f64, height: f64, twist: f64| {
        let at = |a: &f64| Point::new(radius * a.cos(), radius * (a + twist * a * a).sin(), height + 4.0 * a);
        SplineCurve::new(3, knots(), angles.iter().map(at).collect()).unwrap()
    };
    RuledMotion { lower: rail(30.0, 0.0, 0.0), upper: rail(36.0, 20.0, 0.1), lower_height: 2.0 }
}

/// The parameter's pose nearest to a tool by tip and height 40, by looking everywhere, then closely.
fn nearest_of_many(pass: &RuledMotion, tool: &Pose) -> Pose {
    let off = |t: f64| {
        let near = pass.pose(t).unwrap();
        [0.0, 40.0].map(|h| (near.at_height(h) - tool.at_height(h)).norm_squared()).iter().sum::<f64>()
    };
    let (mut low, mut high): (f64, f64) = (0.0, 1.0);
    for _ in 0..4 {
        let at = |k: u32| low + (high - low) * f64::from(k) / 1000.0;
        let best = (0..=1000).min_by(|a, b| off(at(*a)).total_cmp(&off(at(*b)))).unwrap();
        (low, high) = (at(best.max(3) - 3), at(best.min(997) + 3));
    }
    pass.pose(0.5 * (low + high)).unwrap()
}

#[test]
fn round_trip_of_an_uneven_pass_is_what_following_it_in_blocks_costs() {
    let ruled = uneven_pass();
    let passes = vec![Pass { kind: PassKind::Cut, strip: Some(0), motion: PassMotion::Ruled(ruled.clone()) }];
    let path = ToolPath { passes, ..path(0.0) };
    let machine = Machine::named("xyzac-trt").unwrap();
    let setup = Setup::new(&machine, "G54", 200.0).unwrap();
    let linearized = linearize(&path, &setup, true, &LinearizeOptions::default()).unwrap();
    let block = |m: &AxisMove| {
        let ProgramWords { linear: [x, y, z], rotary: [a, c] } = setup.tcp_words(&m.to);
        format!("X{x:.5} Y{y:.5} Z{z:.5} A{a:.5} C{c:.5}")
    };
    let blocks: Vec<String> = linearized.moves.iter().map(block).collect();
    let text = format!(
        "G21 G90 G54\nT1 M6\nS8000 M3\nG43 H1\nM428\nG0 {}\nG1 F600 {}\nM429\nM30\n",
        blocks[0],
        blocks[1..].join("\n")
    );
    let motion = motion(&text);
    let (mut tip, mut axis): (f64, f64) = (0.0, 0.0);
    let feed: Vec<usize> = (0..motion.blocks()).filter(|block| !motion.is_rapid(*block)).collect();
    for (block, share) in feed.iter().flat_map(|block| [(*block, 0.5), (*block, 1.0)]) {
        let pose = BlockMotion::pose(&motion, block, share);
        let near = nearest_of_many(&ruled, &pose);
        tip = tip.max((pose.tip - near.tip).norm());
        axis = axis.max(pose.axis_angle(&near).to_degrees());
    }
    let found = check(&text, Some(&path), &Settings::default()).record.round_trip.unwrap();
    assert!(
        (found.tip_max_mm - tip).abs() < 1e-6 && (found.axis_max_deg - axis).abs() < 1e-6,
        "{found:?} {tip} {axis}"
    );
    // The allowance, and the rounding of three words to five decimals.
    assert!(found.tip_max_mm < path.linearization + 1e-5, "{found:?}");
}

#[test]
fn blocks_that_follow_faster_than_the_control_reads_are_told_with_their_first_line() {
    let mut machine = Machine::named("xyzac-trt").unwrap();
    machine.control.options.max_block_rate = 1000.0;
    let setup = Setup::new(&machine, "G54", 200.0).unwrap();
    // So many blocks of a step at 50 mm/s.
    let starved = |count: u32, step: f64| {
        let row: String = (1..=count).map(|k| format!("X{:.3}\n", -30.0 + step * f64::from(k))).collect();
        let text = program(&format!("G0 Z5\nG1 Z0 F3000\nX-30\n{row}X40\n"));
        let read = read(text.as_bytes(), &Rules::of(&machine));
        let findings = verify_motion(&read, &simulate(&read, &setup, Some(1.into())), false).findings;
        findings.into_iter().find(|finding| finding.id == "R603").map(|finding| (finding.line, finding.message))
    };
    let (line, message) = starved(40, 0.02).unwrap();
    assert_eq!(line, Some(FIRST_CUT + 3));
    assert!(message.starts_with("40 blocks follow each other at 2500 a second, the control takes 1000"), "{message}");
    // 1000 a second is what it reads; 8 blocks it holds ready.
    assert_eq!(starved(40, 0.0501), None);
    assert_eq!(starved(8, 0.02), None);
    assert!(starved(9, 0.02).is_some());
}
