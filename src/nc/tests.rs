//! Reading and writing together: what is written is read back to the last digit, on every machine, with TCP on and off.

use super::program::{AXIS_LETTERS, AxisSet, Change, Feed, Frame, LengthOffset, Way};
use super::*;
use crate::diagnostic::Severity;
use crate::feed::TimedMove;
use crate::machine::{
    AxisMove, AxisPosition, BUILTIN, Dialect, DialectOptions, FeedMode, InverseTimeUnit, LengthUnit, Machine,
    OrientationWords, Rollover, Setup, Travel, round_to,
};
use crate::motion::{FeedReference, PassKind, ToolPath, ToolSummary};
use proptest::prelude::*;

fn path() -> ToolPath {
    ToolPath {
        name: "blade (größer) %;".into(),
        tool: ToolSummary {
            number: 1,
            description: "cone D6.000 flute 40.000 gauge 120.000".into(),
            gauge_length: 120.0,
            flute_length: 40.0,
        },
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes: Vec::new(),
    }
}

fn timed(setup: &Setup, linear: [f64; 3], rotary: [f64; 2], rapid: bool, duration: f64) -> TimedMove {
    let to = AxisPosition { linear, rotary };
    let kind = if rapid { PassKind::Rapid } else { PassKind::Cut };
    TimedMove { axes: AxisMove { to, pose: setup.forward(&to), kind, pass: 0, asked: None }, duration, tip_length: 0.0 }
}

fn moves(setup: &Setup, raw: &[([f64; 3], [f64; 2], bool, f64)]) -> Vec<TimedMove> {
    raw.iter().map(|(linear, rotary, rapid, duration)| timed(setup, *linear, *rotary, *rapid, *duration)).collect()
}

fn request<'a>(path: &'a ToolPath, moves: &'a [TimedMove], setup: &'a Setup, tcp: bool) -> WriteRequest<'a> {
    let work_offset = match setup.machine().control.dialect {
        Dialect::OkumaOsp => "G15 H1",
        _ => "G54",
    };
    WriteRequest { path, moves, setup, work_offset, tcp, input_hash: "0123abcd", number: 7, modal: true }
}

/// A control in one of the forms that it can be written in.
fn form() -> impl Strategy<Value = (Machine, bool)> {
    let choices = prop::array::uniform6(any::<bool>());
    let choice =
        (0..BUILTIN.len(), 0..Dialect::ALL.len(), choices, 0_usize..3, 0_usize..3, prop::array::uniform2(2_u8..7));
    let machines =
        choice.prop_map(|(machine, dialect, [tcp, inverse, inch, vectors, wrapped, comma], time, rollover, digits)| {
            let (dialect, _) = Dialect::ALL[dialect];
            let mut machine = Machine::named(BUILTIN[machine].0).unwrap();
            let always_tcp = machine.control.options.tcp_off.is_none();
            let control = &mut machine.control;
            if dialect != control.dialect {
                (control.dialect, control.options) = (dialect, DialectOptions::of(dialect));
            }
            let options = &mut control.options;
            options.feed_mode = match inverse && dialect != Dialect::HeidenhainTnc {
                true => FeedMode::InverseTime,
                false => FeedMode::PerMinute,
            };
            use InverseTimeUnit::{PerMinute, PerSecond, Seconds};
            options.inverse_time_unit = [PerMinute, PerSecond, Seconds][time];
            options.units = if inch { LengthUnit::Inch } else { LengthUnit::Mm };
            options.rollover = [Rollover::Shortest, Rollover::Sign, Rollover::Within][rollover];
            options.decimal_comma = comma && dialect == Dialect::HeidenhainTnc;
            (options.linear_digits, options.rotary_digits) = (digits[0], digits[1]);
            // F must tell moves of a micron from each other.
            options.feed_digits = 5;
            if wrapped {
                machine.rotary[1].travel = Travel::Wrapped;
            }
            let can = options.tcp_on.is_some() || options.tcp_at_start;
            let tcp = can && (tcp || (always_tcp && dialect == Dialect::LinuxCnc));
            let vector_words = matches!(
                dialect,
                Dialect::Fanuc30i | Dialect::MazakSmooth | Dialect::Siemens840d | Dialect::HeidenhainTnc
            );
            if vectors && tcp && vector_words {
                options.orientation = OrientationWords::Vectors;
            }
            (machine, tcp)
        });
    machines.prop_filter("needs five axes", |(machine, _)| machine.has_axis(4))
}

#[test]
fn axes_that_a_machine_does_not_have_are_not_named() {
    let machine = Machine::named("four-axis-a").unwrap();
    let setup = Setup::new(&machine, "G54", 120.0).unwrap();
    let raw = [([0.0; 3], [0.0; 2], true, 0.0), ([10.0, 0.0, 0.0], [0.5, 0.0], false, 1.0)];
    let (path, moves) = (path(), moves(&setup, &raw));
    let text = write(&request(&path, &moves, &setup, false)).unwrap().text;
    let (_, body) = text.split_once("M3").unwrap();
    assert!(body.contains('A') && !body.contains(['B', 'C']), "{body}");
    // Nor are they read.
    let program = read(b"G0 X1 A5\nG0 B5\nM2\n", &Rules::of(&machine));
    assert!(program.findings.list().iter().any(|finding| finding.line == 2), "{:?}", program.findings.list());
}

/// Random moves; for tool vectors on one branch and away from the pole.
fn raw_moves() -> impl Strategy<Value = Vec<([f64; 3], [f64; 2], bool, f64)>> {
    let one = (prop::array::uniform3(-150.0..150.0), prop::array::uniform2(-1.5..1.5), any::<bool>(), 0.01..60.0);
    prop::collection::vec(one, 1..20)
}

fn moves_for(machine: &Machine, setup: &Setup, raw: &[([f64; 3], [f64; 2], bool, f64)]) -> Vec<TimedMove> {
    let vectors = machine.control.options.orientation == OrientationWords::Vectors;
    let near = |[a, b]: [f64; 2]| if vectors { [0.7 + a * 0.1, 0.7 + b * 0.1] } else { [a, b] };
    let raw: Vec<_> = raw.iter().map(|(linear, rotary, rapid, time)| (*linear, near(*rotary), *rapid, *time)).collect();
    moves(setup, &raw)
}

/// What the words in force say after each move of a program: X, Y, Z in mm, then the rotary angles in the machine's
/// order, or the tool axis.
fn words_after_moves(program: &Program, machine: &Machine) -> Vec<[f64; 6]> {
    let index = |letter: char| AXIS_LETTERS.iter().position(|known| *known == letter).unwrap();
    let letters = machine.letters().map(index);
    let mut words = [0.0; 6];
    let follow = |step: &program::Move| {
        for (word, letter) in words.iter_mut().zip(letters) {
            if step.given.has(letter) {
                *word = step.target[letter];
            }
        }
        if step.given.has_vector() {
            words[3..].copy_from_slice(&step.target[3..]);
        }
        words
    };
    program.moves.iter().map(follow).collect()
}

/// What they must say.
fn expected_words(setup: &Setup, step: &TimedMove, tcp: bool) -> [f64; 6] {
    let machine = setup.machine();
    let options = &machine.control.options;
    let unit = if options.units == LengthUnit::Inch { 25.4 } else { 1.0 };
    let exact = setup.words(&step.axes.to, tcp);
    let mut expected = [0.0; 6];
    for (expected, exact) in expected.iter_mut().zip(exact.linear) {
        *expected = round_to(exact / unit, options.linear_digits) * unit;
    }
    for (slot, axis) in machine.rotary.iter().enumerate() {
        let word = round_to(exact.rotary[slot], options.rotary_digits);
        expected[3 + slot] = if axis.travel == Travel::Wrapped { word.rem_euclid(360.0) } else { word };
    }
    if tcp && options.orientation == OrientationWords::Vectors {
        for (expected, exact) in expected[3..].iter_mut().zip(step.axes.pose.axis.iter()) {
            *expected = round_to(*exact, options.vector_digits);
        }
    }
    expected
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn what_is_written_is_read_back_to_the_last_digit((machine, tcp) in form(), raw in raw_moves(), modal: bool) {
        let setup = Setup::new(&machine, &machine.control.work_offsets[0].name, 120.0).unwrap();
        let (path, moves) = (path(), moves_for(&machine, &setup, &raw));
        let written = write(&WriteRequest { modal, ..request(&path, &moves, &setup, tcp) }).unwrap();
        let program = read(written.text.as_bytes(), &Rules::of(&machine));
        prop_assert_eq!(program.findings.list(), &[], "{}", written.text);
        let words = words_after_moves(&program, &machine);
        // Every move of the path, after the approach and before the retract: same words, same kind.
        let of_path = |(step, _): &(&program::Move, &[f64; 6])| step.frame == Frame::Work && step.incremental.is_empty();
        let read: Vec<_> = program.moves.iter().zip(&words).filter(of_path).collect();
        prop_assert!(read.len() >= moves.len());
        let signed = machine.control.options.rollover == Rollover::Sign;
        for (step, (back, read)) in moves.iter().zip(&read[read.len() - moves.len()..]) {
            let expected = expected_words(&setup, step, tcp);
            for (index, (read, expected)) in read.iter().zip(expected).enumerate() {
                // Of a wrapped axis the sign may say the way.
                let equal = *read == expected || (index == 4 && signed && read.abs() == expected);
                prop_assert!(equal || std::ptr::eq(step, &moves[0]) && index > 2, "{read} {expected}\n{}", written.text);
            }
            prop_assert_eq!(back.way == Way::Rapid, step.axes.kind.is_rapid() || std::ptr::eq(step, &moves[0]));
        }
    }

    #[test]
    fn no_feed_word_is_faster_than_asked(
        (mut machine, tcp) in form(), raw in raw_moves(), shrink in 1e-6..1.0_f64,
    ) {
        machine.control.options.orientation = OrientationWords::Angles;
        let setup = Setup::new(&machine, &machine.control.work_offsets[0].name, 120.0).unwrap();
        let raw: Vec<_> = raw.iter().map(|(linear, rotary, _, duration)| {
            (linear.map(|v| v * shrink), rotary.map(|v| v * shrink), false, *duration)
        }).collect();
        let (path, moves) = (path(), moves(&setup, &raw));
        let Ok(written) = write(&request(&path, &moves, &setup, tcp)) else { return Ok(()) };
        let program = read(written.text.as_bytes(), &Rules::of(&machine));
        let asked: f64 = moves[1..].iter().map(|step| step.duration).sum();
        let options = &machine.control.options;
        let rules = FeedRules::new(machine.control.dialect, options);
        let words = words_after_moves(&program, &machine);
        let mut total = 0.0;
        for (index, step) in program.moves.iter().enumerate() {
            let (Way::Line(feed), Some(before)) = (step.way, index.checked_sub(1)) else { continue };
            let delta = |k: usize| {
                let delta = words[index][k] - words[before][k];
                let wrapped = k == 4 && machine.rotary[1].travel == Travel::Wrapped;
                // The sign of a wrapped word only says the way.
                let delta = if wrapped { words[index][k].abs() - words[before][k].abs() } else { delta };
                if wrapped { (delta + 180.0).rem_euclid(360.0) - 180.0 } else { delta }
            };
            let way = Travelled { linear: delta(0).hypot(delta(1)).hypot(delta(2)), rotary: delta(3).hypot(delta(4)) };
            total += match feed {
                Feed::InverseTime(word) => {
                    prop_assert_eq!(rules.inverse_time_floor(word, way), None);
                    60.0 / word
                }
                Feed::Duration(seconds) => seconds,
                Feed::PerMinute { linear, rotary } => 60.0 * rules.length(way, tcp, linear / rotary) / rotary,
                _ => panic!("no feed"),
            };
        }
        // Blocks in which nothing moves at the end of the program are left out.
        let end = expected_words(&setup, &moves[moves.len() - 1], tcp);
        let last = moves.iter().rev().take_while(|step| expected_words(&setup, step, tcp) == end);
        let left_out: f64 = last.map(|step| step.duration).sum();
        prop_assert!(total >= (asked - left_out) * (1.0 - 1e-9), "{} {}", total, asked);
        prop_assert!((total - asked - written.lost).abs() <= left_out + 1e-6 * total);
    }

    #[test]
    fn any_bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        for (dialect, _) in Dialect::ALL {
            let rules = Rules::new(dialect, &DialectOptions::of(dialect), &[]);
            let program = read(&bytes, &rules);
            for finding in program.findings.list() {
                prop_assert!(!finding.diagnostic("p.nc", &bytes).to_string().is_empty());
            }
            prop_assert!(program.moves.iter().all(|step| step.target.iter().all(|value| value.is_finite())));
        }
    }

    #[test]
    fn program_like_text_is_read(text in "(([GMXYZABCFSTHIJKPQRN][0-9.+-]{0,6}|\\(|\\)|;|/|%|#|=|O|\\[|\\]| |\r)*\n){0,20}") {
        for (dialect, _) in Dialect::ALL {
            let program = read(text.as_bytes(), &Rules::new(dialect, &DialectOptions::of(dialect), &[]));
            prop_assert!(program.lines <= text.lines().count());
        }
    }
}

fn linuxcnc(text: &str) -> Program {
    read(text.as_bytes(), &Rules::of(&Machine::named("xyzac-trt").unwrap()))
}

fn fanuc(text: &str) -> Program {
    read(text.as_bytes(), &Rules::of(&Machine::named("trunnion-ac-30i").unwrap()))
}

/// Line, column and name of each finding.
fn found(program: &Program, text: &str) -> Vec<(usize, Option<usize>, &'static str)> {
    let place = |finding: &Finding| {
        let diagnostic = finding.diagnostic("p", text.as_bytes());
        (finding.line, diagnostic.place.and_then(|place| place.column), finding.code.name())
    };
    program.findings.list().iter().map(place).collect()
}

#[test]
fn linuxcnc_takes_blanks_lower_case_line_ends_and_marks_of_all_kinds() {
    let text = "\u{feff}%\r\n(größe)\r\ng21 g90 g61\r\ns 1 00 m3\r\n/g1x+0. 12 34y 7f1 ; text (\r\n\r\n%\r\n";
    let program = linuxcnc(text);
    assert_eq!(found(&program, text), [(5, Some(2), "block-delete")]);
    let step = program.moves[0];
    assert_eq!(step.given, AxisSet(0b11));
    assert_eq!(step.target[..2], [0.1234, 7.0]);
    assert_eq!((program.lines, program.blocks), (7, 3));
}

#[test]
fn each_complaint_has_its_place_and_reading_goes_on() {
    let text = "G21 G61 S1 M3\nG1 X#1 Y2 F100\nG1 X1 G2\nG1 X1e3\nG0 Q5\nX1 X2\nG187 P1\nG1 G0 X5\nB3\nX7\nM2\nX8\n";
    let program = linuxcnc(text);
    assert_eq!(
        found(&program, text),
        [
            (2, Some(4), "unreadable-text"),
            (3, Some(1), "bad-arc"),
            (3, Some(7), "group-conflict"),
            (4, Some(6), "unused-word"),
            (5, Some(4), "unused-word"),
            (6, Some(4), "repeated-word"),
            (7, Some(1), "unknown-code"),
            (8, Some(4), "group-conflict"),
            (9, Some(1), "missing-axis"),
            (12, Some(1), "unreached-text"),
        ]
    );
    assert_eq!(program.moves.last().map(|step| step.target[0]), Some(7.0));
}

#[test]
fn feeds_that_are_missing_are_found() {
    let text = "G61 S1 M3\nG1 X1\nG93 G1 X2 F5\nX3\nG94 X4\nX5 F9\nF0 X6\nM2\n";
    let program = linuxcnc(text);
    let lines: Vec<usize> = program.findings.list().iter().map(|finding| finding.line).collect();
    assert!(program.findings.list().iter().all(|finding| finding.code == FindingCode::MissingFeed));
    assert_eq!(lines, [2, 4, 5, 7]);
}

#[test]
fn inches_are_converted_and_degrees_are_not() {
    let program = linuxcnc("G20 G61 S1 M3\nG1 X1 A10 F2\nM2\n");
    let step = program.moves[0];
    assert_eq!((step.target[0], step.target[3]), (25.4, 10.0));
    assert_eq!(step.way, Way::Line(Feed::PerMinute { linear: 50.8, rotary: 2.0 }));
}

#[test]
fn tcp_codes_are_those_of_the_machine_file() {
    let changes = |program: Program| -> Vec<Change> { program.changes.iter().map(|at| at.change).collect() };
    assert!(changes(linuxcnc("M428\nM2\n")).contains(&Change::Tcp(true)));
    let mut machine = Machine::named("xyzac-trt").unwrap();
    let options = &mut machine.control.options;
    (options.tcp_on, options.tcp_off) = (Some("M68 E3 Q1".into()), Some("M68 E3 Q0".into()));
    let program = read(b"M68 E3 Q1\nM66 E0 L0\nM68 E3 Q0\nM68 E1 Q1\nM428\nM2\n", &Rules::of(&machine));
    assert_eq!(program.findings.list().iter().map(|finding| finding.line).collect::<Vec<_>>(), [5]);
    assert_eq!(changes(program)[1..], [Change::Tcp(true), Change::Tcp(false)]);
    assert_eq!(
        changes(fanuc("G43.4 H3\nG49\nM30\n"))[..],
        [
            Change::Length(LengthOffset::Number(3)),
            Change::Tcp(true),
            Change::Tcp(false),
            Change::Length(LengthOffset::Off)
        ]
    );
}

#[test]
fn fanuc_numbers_without_point_are_not_believed() {
    let text = "%\nO0001 (A)\nG21 S1 M3\nG1 X10 Y0 Z1. F5\nM30\n%\n";
    assert_eq!(found(&fanuc(text), text), [(4, Some(4), "missing-point")]);
}

#[test]
fn radians_are_noticed_and_degrees_are_not() {
    let radians: String = (0..20).map(|k| format!("G0 A{:.12} C1.5707963267949\n", f64::from(k) * 0.0371)).collect();
    let degrees: String = (0..20).map(|k| format!("G0 A{:.4} C1.5708\n", f64::from(k) * 0.0371)).collect();
    let suspect = |text: &str| linuxcnc(text).findings.list().iter().any(|f| f.code == FindingCode::RadiansSuspected);
    assert!(suspect(&radians));
    assert!(!suspect(&degrees));
}

#[test]
fn canned_cycles_are_said_and_not_followed() {
    let text = "G61 S1 M3 F9\nG81 X1 Y1 Z-5 R2\nX2 Y2\nG80\nG0 X3\nM2\n";
    let program = linuxcnc(text);
    assert_eq!(found(&program, text), [(2, Some(1), "unsupported-code")]);
    assert_eq!(program.moves.len(), 1);
}

#[test]
fn a_flood_of_complaints_is_counted_and_not_kept() {
    let program = linuxcnc(&"@ @ @\n".repeat(2000));
    assert!(program.findings.list().len() <= 1001);
    assert!(program.findings.omitted() >= 4999);
    assert!(program.findings.any_error());
}

#[test]
fn an_empty_program_is_an_error() {
    for text in ["", "%\n%\n", "(only a comment)\n"] {
        assert_eq!(linuxcnc(text).findings.list()[0].severity, Severity::Error);
    }
}

#[test]
fn the_same_request_gives_the_same_bytes_and_control_characters_stay_out_of_comments() {
    let machine = Machine::named("trunnion-ac-30i").unwrap();
    let setup = Setup::new(&machine, "G54", 120.0).unwrap();
    let (path, moves) =
        (path(), moves(&setup, &[([0.0; 3], [0.1, 0.2], true, 1.0), ([9.0; 3], [0.2, 0.1], false, 2.0)]));
    let text = write(&request(&path, &moves, &setup, true)).unwrap().text;
    assert_eq!(text, write(&request(&path, &moves, &setup, true)).unwrap().text);
    assert!(text.starts_with("%\nO0007 (BLADE ?GR??ER? ??)\n(TOOL T1 CONE D6.000"), "{text}");
    assert!(text.ends_with("M5\nM30\n%\n"), "{text}");
}

#[test]
fn what_cannot_be_written_is_refused_with_a_reason() {
    let machine = Machine::named("head-b-table-c").unwrap();
    let setup = Setup::new(&machine, "G54", 120.0).unwrap();
    let path = path();
    let good = moves(&setup, &[([0.0; 3], [0.1, 0.2], true, 1.0), ([9.0; 3], [0.2, 0.1], false, 2.0)]);
    let refused = |moves: &[TimedMove], tcp| write(&request(&path, moves, &setup, tcp)).unwrap_err().message;
    assert!(refused(&good, false).contains("cannot turn TCP off"));
    assert!(refused(&[], true).contains("no moves"));
    let endless = moves(&setup, &[([0.0; 3], [0.1, 0.2], true, 1.0), ([f64::NAN; 3], [0.2, 0.1], false, 2.0)]);
    assert!(refused(&endless, true).contains("no number"));
    let slow = moves(&setup, &[([0.0; 3], [0.1, 0.2], true, 1.0), ([9.0; 3], [0.2, 0.1], false, f64::INFINITY)]);
    assert!(refused(&slow, true).contains("inf s"));
}
