//! Our programs on a real controller, headless LinuxCNC: it must accept them, move as our kinematics and our simulation
//! say, and leave of the part what our verification says. Left out, loudly, where it cannot be played on; fails there
//! when the environment variable `REGULUS_REQUIRE_CONTROLLER` is set.

#[cfg(test)]
#[path = "controller/compare.rs"]
mod compare;
#[cfg(test)]
#[path = "controller/emitted.rs"]
mod emitted;
#[cfg(test)]
#[path = "controller/rig.rs"]
mod rig;

#[cfg(test)]
mod tests {
    use crate::compare::{at_feed, fastest, joint_motion, joints, largest_step, way};
    use crate::emitted::Emitted;
    use crate::rig::{CanonicalMove, Kind, Rig, Sample, present};
    use regulus::geometry::{Point, Vector};
    use regulus::machine::{DialectOptions, Machine};
    use regulus::nc::program::{Frame, Program, Way};
    use regulus::nc::{FindingCode, Rules, read};
    use regulus::simulate::{SegmentKind, simulate};

    /// What the rounding of numbers may do, mm and degrees.
    const ROUNDING: f64 = 1e-9;
    /// How far from the end of a block a control may pass that goes on straight but for the words' last decimals, mm and
    /// degrees.
    const CORNER: f64 = 1e-6;
    /// By what share a joint may pass its top speed inside a block: ours keep it from quarter point to quarter point.
    const SPEED: f64 = 1e-3;
    /// By what share our time of all feed moves may differ.
    const TIME: f64 = 0.02;
    /// What following the joints in steps of a cycle may do to the part, mm.
    const CYCLES: f64 = 1e-4;

    /// The interpreter must read the program as we do, to the four decimals that it prints.
    fn assert_read_alike(program: &Program, canonical: &[CanonicalMove]) {
        assert_eq!(program.moves.len(), canonical.len());
        for (ours, theirs) in program.moves.iter().zip(canonical) {
            assert_eq!(ours.frame, Frame::Work);
            assert_eq!(ours.way == Way::Rapid, theirs.rapid, "line {}", ours.line);
            for index in ours.given.indices() {
                let (ours, theirs, line) = (ours.target[index], theirs.target[index], ours.line);
                assert!((ours - theirs).abs() <= 0.5e-4 + ROUNDING, "line {line}: {ours} is read as {theirs}");
            }
        }
    }

    /// The program must end without complaint; its samples.
    fn play(rig: &Rig, text: &str) -> Vec<Sample> {
        let outcome = rig.play(text);
        assert_eq!((outcome.status.as_str(), &outcome.messages[..]), ("ok", &[][..]), "{rig:?}");
        outcome.samples
    }

    /// The controller must move as we say.
    fn assert_moves_alike(emitted: &Emitted, samples: &[Sample]) {
        let (name, setup) = (&emitted.setup().machine().name, emitted.setup());
        let (joints, compared) = joints(setup, samples);
        println!("{name}: joints of {compared} of {} samples: {joints:?}", samples.len());
        assert!(joints.within(ROUNDING), "{name}: {joints:?}");
        assert!(compared + 100 > samples.len(), "{name}: {compared} of {} samples compared", samples.len());
        let way = way(&emitted.motion, samples);
        println!("{name}: {way:?}");
        assert!(way.off.within(ROUNDING), "{name}: {way:?}");
        assert!(way.missed.within(CORNER), "{name}: {way:?}");
        for kind in [Kind::Feed, Kind::Rapid] {
            let speed = fastest(setup, samples, kind);
            println!("{name}: joints reach {speed} of their top speed, {kind:?}");
            assert!(speed <= 1.0 + SPEED, "{name}: {speed} of the top speed, {kind:?}");
        }
    }

    /// The feed moves must take as long as we say: each goes from rest to rest (G61).
    fn assert_takes_as_long(emitted: &Emitted, samples: &[Sample]) {
        let feed = emitted.motion.segments().iter().filter(|segment| segment.kind == SegmentKind::Feed);
        let (ours, theirs) = (feed.map(|segment| segment.duration).sum::<f64>(), at_feed(&emitted.motion, samples));
        println!("{}: feed moves take {ours} s, {theirs} s there", emitted.setup().machine().name);
        assert!((ours / theirs - 1.0).abs() <= TIME, "{ours} s, {theirs} s there");
    }

    /// All of it: text, joints, way, part.
    fn check(machine: &str, tcp: bool) {
        if !present(&format!("{machine} with TCP {}", if tcp { "on" } else { "off" })) {
            return;
        }
        follow(&Emitted::new(machine, tcp));
    }

    fn follow(emitted: &Emitted) {
        let rig = emitted.rig();
        assert_read_alike(&emitted.program, &rig.accept(&emitted.text).unwrap());
        let samples = play(&rig, &emitted.text);
        assert_moves_alike(emitted, &samples);
        assert_takes_as_long(emitted, &samples);

        let (ours, theirs) = (&emitted.deviation, emitted.deviation_of(&joint_motion(&emitted.motion, &samples)));
        let overcut = (ours.overcut_max_mm, theirs.overcut_max_mm);
        let undercut = (ours.undercut_max_mm, theirs.undercut_max_mm);
        println!("overcut {overcut:?}, undercut {undercut:?}");
        assert!((overcut.0 - overcut.1).abs() <= CYCLES, "overcut {overcut:?}");
        assert!((undercut.0 - undercut.1).abs() <= CYCLES, "undercut {undercut:?}");
    }

    /// The samples' whole programs.
    fn check_sample(name: &str) {
        if present(name) {
            follow(&Emitted::sample(name));
        }
    }

    #[test]
    fn exact_cone() {
        check_sample("exact-cone");
    }

    #[test]
    fn ruled_impeller() {
        check_sample("ruled-impeller");
    }

    #[test]
    fn rotor37() {
        check_sample("rotor37");
    }

    #[test]
    fn xyzac_trt_with_tcp() {
        check("xyzac-trt", true);
    }

    #[test]
    fn xyzac_trt_without_tcp() {
        check("xyzac-trt", false);
    }

    #[test]
    fn xyzbc_trt_with_tcp() {
        check("xyzbc-trt", true);
    }

    #[test]
    fn xyzbc_trt_without_tcp() {
        check("xyzbc-trt", false);
    }

    #[test]
    fn bridgemill_with_tcp() {
        check("bridgemill", true);
    }

    #[test]
    fn bridgemill_without_tcp() {
        check("bridgemill", false);
    }

    /// Its control is always in TCP.
    #[test]
    fn head_b_table_c_with_tcp() {
        check("head-b-table-c", true);
    }

    /// M428 selects TCP on controls that start without it too, or it selects the kinematics of the start, be they which
    /// they may.
    #[test]
    fn every_meaning_of_m428() {
        if !present("every_meaning_of_m428") {
            return;
        }
        for name in ["xyzac-trt", "xyzbc-trt", "bridgemill"] {
            let usual = Emitted::new(name, true);
            for (identity_first, m428_selects) in [(true, 1), (true, 0), (false, 1)] {
                let m428_is_tcp = identity_first == (m428_selects == 1);
                let change = |options: &mut DialectOptions| {
                    options.tcp_at_start = !identity_first;
                    let (on, off) = if m428_is_tcp { ("M428", "M429") } else { ("M429", "M428") };
                    (options.tcp_on, options.tcp_off) = (Some(on.into()), Some(off.into()));
                };
                let emitted = Emitted::with(name, true, change);
                let rig = Rig { identity_first, m428_selects, ..emitted.rig() };
                let samples = play(&rig, &emitted.text);
                assert_moves_alike(&emitted, &samples);
                if !m428_is_tcp {
                    // A machine file that has it the wrong way round is found out.
                    let wrong = way(&usual.motion, &play(&rig, &usual.text));
                    assert!(wrong.off.mm > 10.0, "{wrong:?}");
                }
            }
        }
    }

    /// Pivots, offsets between the axes and places of the part, each as the machine file and the controller name them.
    #[test]
    fn many_pivots_and_offsets() {
        if !present("many_pivots_and_offsets") {
            return;
        }
        type Change = Box<dyn Fn(&mut Machine)>;
        let head = |pivot: f64| -> (&str, Change, Vec<(&'static str, f64)>) {
            let change = move |machine: &mut Machine| machine.rotary.iter_mut().for_each(|axis| axis.pivot.z = pivot);
            ("bridgemill", Box::new(change), vec![("pivot", pivot)])
        };
        let trunnion =
            |name: &'static str, [x, y, z]: [f64; 3], side: f64, up: f64| -> (&str, Change, Vec<(&'static str, f64)>) {
                let tilts_about_x = name == "xyzac-trt";
                let change = move |machine: &mut Machine| {
                    let aside = if tilts_about_x { Vector::new(0.0, side, up) } else { Vector::new(side, 0.0, up) };
                    machine.rotary[1].pivot = Point::new(x, y, z);
                    machine.rotary[0].pivot = Point::new(x, y, z) + aside;
                };
                let beside = if tilts_about_x { "y-offset" } else { "x-offset" };
                let numbers =
                    [("x-rot-point", x), ("y-rot-point", y), ("z-rot-point", z), (beside, side), ("z-offset", up)];
                (name, Box::new(change), numbers.into())
            };
        let cases = [
            (head(75.5), [0.0; 3]),
            (head(331.25), [-80.0, 45.0, -30.0]),
            (head(412.5), [120.0, 60.0, 25.0]),
            (trunnion("xyzac-trt", [-12.0, 30.5, -8.0], -17.5, 42.0), [-40.0, 25.0, 60.0]),
            (trunnion("xyzac-trt", [0.0; 3], 0.0, 0.0), [10.0, 0.0, -5.0]),
            (trunnion("xyzbc-trt", [20.0, -3.0, 55.0], 33.0, -21.0), [15.0, 70.0, -10.0]),
        ];
        for ((name, change, geometry), offset) in cases {
            let emitted = Emitted::on(name, true, offset, change);
            let rig = Rig { geometry, ..emitted.rig() };
            assert_moves_alike(&emitted, &play(&rig, &emitted.text));
        }
    }

    /// Tool length called before TCP, with the rotary axes level: nothing jumps. Called afterwards and tilted, the joints
    /// jump in one cycle, by as much as our simulation warns of.
    #[test]
    fn tool_length_called_level_and_tilted() {
        if !present("tool_length_called_level_and_tilted") {
            return;
        }
        let emitted = Emitted::new("xyzac-trt", true);
        let start = "G21 G90 G17 G94\nG61\nM429\nT7 M6\nG55\n";
        let end = "G0 X10 Y20 Z30 A30 C40\nG43 H7\nG1 X12 F1000\nM429\nG49\nM2\n";
        let level = format!("{start}G43 H7\nM428\n{end}");
        let tilted = format!("{start}M428\n{end}");
        // How far the gauge point moves when the tool's length is tilted by A.
        let chord = 2.0 * emitted.setup().tool_length() * 15_f64.to_radians().sin();
        for (text, jumps) in [(level, false), (tilted, true)] {
            let program = read(text.as_bytes(), &Rules::of(emitted.setup().machine()));
            let motion = simulate(&program, emitted.setup(), Some(7.into()));
            let mut findings = motion.findings().list().iter();
            let warning = findings.find(|finding| finding.code == FindingCode::Jump);
            let step = largest_step(&play(&emitted.rig(), &text));
            match warning {
                Some(warning) if jumps => {
                    assert!(warning.message.contains(&format!("{chord:.3} mm")), "{}", warning.message);
                    assert!((step - chord).abs() < 0.01, "{step} mm instead of {chord} mm");
                }
                None if !jumps => assert!(step < 2.0, "{step} mm"),
                _ => panic!("{warning:?} in\n{text}"),
            }
        }
    }

    /// Blocks that the interpreter refuses must not pass our reader, nor must it find fault with what is taken.
    #[test]
    fn interpreter_and_reader_refuse_alike() {
        if !present("interpreter_and_reader_refuse_alike") {
            return;
        }
        let emitted = Emitted::new("xyzac-trt", true);
        let taken_alike = |blocks: &str| {
            let start = "G21 G90 G17 G94\nG61\nT7 M6\nG43 H7\nM428\nS8000 M3\nG0 X0 Y0 Z0 A0 C0\n";
            let text = format!("{start}{blocks}\nM2\n");
            let program = read(text.as_bytes(), &Rules::of(emitted.setup().machine()));
            let ours = !simulate(&program, emitted.setup(), Some(7.into())).findings().any_error();
            let theirs = emitted.rig().accept(&text);
            assert_eq!(theirs.is_ok(), ours, "{blocks}: {theirs:?}");
            ours
        };
        for block in REFUSED {
            assert!(!taken_alike(block), "{block}");
        }
        assert!(taken_alike(TAKEN));
    }

    const REFUSED: [&str; 28] = [
        "G43.4 H7",
        "G43.5 H7",
        "G68.2 X0 Y0 Z0 I0 J0 K0",
        "G53.1",
        "G187 P1",
        "G5 P10000",
        "M128",
        "M205",
        "TRAORI",
        "G1 X1e3 F100",
        "G1 X1 F100 *55",
        "(a (b) c)",
        "(open",
        "G1 X1 X2 F100",
        "G0 G1 X1 F100",
        "G90 G91",
        "M3 M4",
        "G1 X1",
        "G1 X1 F0",
        "G1 X1 F-100",
        "G1 U1 F100",
        "G93 G1 X1",
        "G2 X10 Y0 I4.9 J0.3 F100",
        "Q",
        "G1 X F100",
        "G1 X1.2.3 F100",
        "X1 Y2 G80",
        "S-1",
    ];

    const TAKEN: &str = "g1 x1 f100
G1 X 1 . 5 F100
N12345 G1 X1 F100
G1 X.5 Y-.5 Z+1 F100
G4 P0.1
G0 X0 Y0
G2 X10 Y0 I5 J0 F100
G64 P0.01
G61.1
G54 (G54) ;x
/ G1 X2 F100
G53 G0 Z0
G93 G1 X1 F10";
}
