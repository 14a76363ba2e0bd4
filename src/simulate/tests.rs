//! Following short programs against closed forms and against what a real control was measured to do.

use super::*;
use crate::geometry::Point;
use crate::machine::{BUILTIN, Machine, Setup};
use crate::nc::{FindingCode, Rules, read};
use proptest::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

fn run_on(machine: &str, offset: &str, text: &str) -> ToolMotion {
    let machine = Machine::named(machine).unwrap();
    let setup = Setup::new(&machine, offset, 100.0).unwrap();
    simulate(&read(text.as_bytes(), &Rules::of(&machine)), &setup, Some(1.into()))
}

/// On the trunnion of LinuxCNC's samples.
fn run(text: &str) -> ToolMotion {
    run_on("xyzac-trt", "G54", text)
}

fn codes(motion: &ToolMotion) -> Vec<(usize, FindingCode)> {
    motion.findings().list().iter().map(|finding| (finding.line, finding.code)).collect()
}

fn assert_near(a: Point, b: [f64; 3]) {
    assert!((a - Point::from(b)).norm() < 1e-9, "{a:?} {b:?}");
}

const START: &str = "G21 G90 G61 S1 M3\nG43 H1\nM428\nG0 X0 Y0 Z0 A0 C0\n";

#[test]
fn blocks_take_as_long_as_on_the_real_control() {
    let measured_there = [1.01, 3.00, 1.01, 1.01, 1.01, 4.13];
    let body = "G1 F600 X10 C30\nG1 C60\nG93\nG1 X20 C90 F60\nC60 F60\nX20.0099 C90 F60\nG94 F600\nA10 C130\nM2\n";
    let motion = run(&format!("{START}{body}"));
    let programmed = [1.0, 3.0, 1.0, 1.0, 1.0, 10_f64.hypot(40.0) / 10.0];
    assert_eq!(motion.segments().len(), programmed.len());
    for (segment, (programmed, measured)) in motion.segments().iter().zip(programmed.into_iter().zip(measured_there)) {
        assert!((segment.programmed - programmed).abs() < 1e-9, "{segment:?}");
        assert!((segment.duration - measured).abs() < 0.005, "{segment:?} {measured}");
    }
    assert_eq!(codes(&motion), []);
}

#[test]
fn an_inverse_time_word_below_the_slowest_feed_is_said() {
    let motion = run(&format!("{START}G93 G1 X0.0001 C30 F60\nM2\n"));
    assert_eq!(codes(&motion), [(5, FindingCode::FeedTrap)]);
    // Measured on the control: 0.18 s.
    assert!((motion.duration() - 0.18).abs() < 0.005);
}

#[test]
fn words_are_joints_with_tcp_off_and_the_tip_with_tcp_on() {
    let text =
        "G21 G90 G61 S1 M3 F600\nG43 H1\nM429\nG0 X0 Y0 Z0 A0 C0\nG1 X10 Y20 Z30 A30 C40\nM428\nG1 X1 Y2 Z3\nC50\nM2\n";
    let motion = run(text);
    let [joints, tip, turn] = motion.segments() else { panic!("{:?}", motion.segments()) };
    assert_eq!(joints.path, Path::Joints);
    assert_near(joints.to.linear.into(), [10.0, 20.0, 130.0]);
    assert_near(motion.pose(tip, 0.0).tip, motion.setup().forward(&joints.to).tip.into());
    assert_near(motion.pose(tip, 1.0).tip, [1.0, 2.0, 3.0]);
    // Turning alone with TCP on: the tip stays, the linear axes follow.
    for share in [0.0, 0.3, 1.0] {
        assert_near(motion.pose(turn, share).tip, [1.0, 2.0, 3.0]);
        assert_near(motion.setup().forward(&motion.axes(turn, share)).tip, [1.0, 2.0, 3.0]);
    }
    assert!((turn.to.rotary[1] - 50_f64.to_radians()).abs() < 1e-12);
}

#[test]
fn increments_machine_coordinates_and_lengths_add_up() {
    let text = "G21 G90 G61 S1 M3 F600\nM429\nG0 X0 Y0 Z0 A0 C0\nG91 G1 X1 C10\nX1 C10\nG90 G43 H1 Z5\nG53 G0 Z7\nG49 G1 Z5\nM2\n";
    let motion = run(text);
    let ends: Vec<_> = motion.segments().iter().map(|segment| segment.to).collect();
    assert_near(ends[1].linear.into(), [2.0, 0.0, 0.0]);
    assert!((ends[1].rotary[1] - 20_f64.to_radians()).abs() < 1e-12);
    assert_near(ends[2].linear.into(), [2.0, 0.0, 105.0]);
    assert_near(ends[3].linear.into(), [2.0, 0.0, 7.0]);
    assert_near(ends[4].linear.into(), [2.0, 0.0, 5.0]);
}

#[test]
fn work_offsets_move_the_program_and_not_the_part() {
    let text = "G21 G90 S1 M3 F600\nG43.4 H1\nG54 G0 X0. Y0. Z0. A0. C0.\nG1 X5.\nG55\nX5. Y0. Z0.\nG56\nM30\n";
    let motion = run_on("trunnion-ac-30i", "G54", text);
    let ends: Vec<_> = motion.segments().iter().map(|segment| motion.pose(segment, 1.0).tip).collect();
    assert_near(ends[0], [5.0, 0.0, 0.0]);
    assert_near(ends[1], [5.0, 0.0, 50.0]);
    assert_eq!(codes(&motion), [(7, FindingCode::UnknownWorkOffset)]);
}

#[test]
fn arcs_are_round_in_their_plane_with_tcp_on_and_off() {
    for tcp in ["M428", "M429"] {
        let text = format!(
            "G21 G90 G61 S1 M3 F600\nG43 H1\n{tcp}\nG0 X10 Y0 Z0 A0 C0\nG3 X0 Y10 I-10 J0\nG2 X10 Y0 R10\nG3 X10 Y0 I-10 Z5 P2\nG3 X0 Y10 R-10\nG18 G2 X10 Z15 I10 K0\nM2\n"
        );
        let motion = run(&text);
        assert_eq!(codes(&motion), []);
        let at = |index: usize, share: f64| {
            let segment = &motion.segments()[index];
            match segment.path {
                Path::TipArc(_) => motion.pose(segment, share).tip,
                _ => Point::from(motion.axes(segment, share).linear) - crate::geometry::Vector::new(0.0, 0.0, 100.0),
            }
        };
        let half = 10.0 * FRAC_1_SQRT_2;
        assert_near(at(0, 0.5), [half, half, 0.0]);
        assert_near(at(1, 0.5), [half, half, 0.0]);
        assert_near(at(2, 0.5), [10.0, 0.0, 2.5]);
        assert_near(at(2, 0.25), [-10.0, 0.0, 1.25]);
        // The longer way round.
        assert_near(at(3, 0.5), [10.0 + half, 10.0 + half, 5.0]);
        // Clockwise as seen from Y+: three quarters.
        assert_near(at(4, 0.5), [10.0 + half, 10.0, 5.0 - half]);
        assert_near(at(4, 1.0), [10.0, 10.0, 15.0]);
        let lengths: Vec<f64> = motion.segments().iter().map(|segment| segment.programmed * 10.0).collect();
        assert!((lengths[0] - 5.0 * PI).abs() < 1e-9 && (lengths[3] - 15.0 * PI).abs() < 1e-9, "{lengths:?}");
        assert!((lengths[2] - (40.0 * PI).hypot(5.0)).abs() < 1e-9);
    }
}

#[test]
fn arcs_that_their_words_contradict_are_found() {
    let motion = run(&format!("{START}G1 F600 X10\nG3 X0 Y10 I-8\nG3 X0 Y50 R2\nM2\n"));
    assert_eq!(codes(&motion), [(6, FindingCode::BadArc), (7, FindingCode::BadArc)]);
}

#[test]
fn a_length_change_while_tilted_is_a_jump() {
    let text = "G21 G90 G61 S1 M3\nM428\nG0 X10 Y20 Z30 A30 C40\nG43 H1\nM2\n";
    let motion = run(text);
    let jump = motion.findings().list().iter().find(|finding| finding.code == FindingCode::Jump).unwrap();
    // 2 L sin(A/2)
    assert!(jump.line == 4 && jump.message.contains("51.764 mm"), "{}", jump.message);
    let upright = run(&text.replace("A30", "A0"));
    assert!(!codes(&upright).iter().any(|(_, code)| *code == FindingCode::Jump));
}

#[test]
fn what_makes_the_motion_uncertain_is_said() {
    let early = run("G21 G90 G61 S1 M3 F9\nM429\nG1 X1 Y1 Z1\nG0 A0 C0\nM2\n");
    assert_eq!(codes(&early), [(3, FindingCode::UnknownStart)]);
    let other = run("G21 G90 G61 S1 M3 F9\nM429\nT2 M6\nG43 H3\nG0 X1 Y1 Z1\nM2\n");
    assert_eq!(codes(&other), [(3, FindingCode::OtherTool), (4, FindingCode::OtherLength)]);
    let bare = run("G21 G90 G61 S1 M3 F9\nM428\nG1 X1 Y1 Z1 A0 C0\nM2\n");
    assert!(codes(&bare).contains(&(3, FindingCode::TcpWithoutLength)));
    let fanuc = run_on("trunnion-ac-30i", "G54", "G21 G90 S1 M3\nG43.4 H1\nG53 G0 Z0.\nM30\n");
    assert_eq!(codes(&fanuc), [(3, FindingCode::WrongTcpState)]);
}

#[test]
fn statistics_and_limits_are_those_of_the_blocks() {
    let text =
        "G21 G90 G61 S1 M3\nM429\nG0 X0 Y0 Z0 A0 C0\nG93 G1 X10 F60\nG1 X40 F60\nG1 X20 C400 F60\nG1 X1500 F1\nM2\n";
    let motion = run(text);
    let report = motion.axis_report();
    let x = report.axes[0];
    assert_eq!((x.letter, x.min, x.max, x.travel), ('X', 0.0, 1500.0, 40.0 + 20.0 + 1480.0));
    assert!((x.max_rate - 30.0).abs() < 1e-9 && (x.max_acceleration - 50.0).abs() < 1e-9, "{x:?}");
    let limits: Vec<_> = report.limits.iter().map(|l| (l.line, l.axis, l.kind)).collect();
    assert_eq!(limits, [(6, 'C', LimitKind::Speed), (7, 'X', LimitKind::Travel)]);
    assert!((report.limits[0].value - 400.0).abs() < 1e-9 && (report.limits[0].limit - 360.0).abs() < 1e-9);
}

#[test]
fn an_axis_that_swings_out_inside_a_block_is_seen() {
    // Half a turn of the table under a tip 600 mm away from its axis: the ends lie within 1000 mm, the middle does not.
    let text = format!("{START}G0 X800 Y700 Z0\nG93 G1 X800 Y700 C180 F1\nM2\n");
    let report = run(&text).axis_report();
    let travel: Vec<_> = report.limits.iter().filter(|l| l.kind == LimitKind::Travel).collect();
    assert!(travel.iter().all(|l| l.line == 6 && l.value.abs() > 1000.0) && !travel.is_empty(), "{travel:?}");
}

proptest! {
    #[test]
    fn any_program_gives_finite_motion_in_order_of_time(
        machine in 0..BUILTIN.len(),
        text in "((G[0-4]|G43 H1|G49|G9[0-5]|G1[789]|G2[018]|G5[34]|M[345]|M42[89]|G43.4 H1|[XYZABCIJKRFSP]-?[0-9]{1,4}\\.[0-9]{0,3}) ?|\n){0,60}",
    ) {
        let text = format!("G0 X1. Y1. Z1. A1. B1. C1. F99.\n{text}");
        let motion = run_on(BUILTIN[machine].0, "G54", &text);
        let mut time = 0.0;
        for segment in motion.segments() {
            prop_assert!(segment.start >= time && segment.duration > 0.0 && segment.duration.is_finite());
            time = segment.start + segment.duration;
            for share in [0.0, 0.5, 1.0] {
                let pose = motion.pose(segment, share);
                prop_assert!(pose.tip.coords.norm().is_finite() && (pose.axis.norm() - 1.0).abs() < 1e-9);
            }
            let ends = [motion.axes(segment, 0.0), motion.axes(segment, 1.0)];
            for (end, expected) in ends.iter().zip([segment.from, segment.to]) {
                for (a, b) in end.values().iter().zip(expected.values()) {
                    prop_assert!((a - b).abs() < 1e-6 * (1.0 + b.abs()), "{} {} {:?}", a, b, segment);
                }
            }
            prop_assert!(motion.chord_bound(segment, 0.0, 1.0, 10.0).is_finite());
        }
        for axis in motion.axis_report().axes {
            prop_assert!(axis.max_rate.is_finite() && axis.max_acceleration.is_finite() && axis.min <= axis.max);
        }
    }
}
