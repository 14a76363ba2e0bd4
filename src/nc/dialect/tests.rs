//! What each control's own words mean, and what is said about those that mean nothing.

use super::Rules;
use crate::machine::{Dialect, DialectOptions, Machine, PointRule, TcpInterpolation, builtin};
use crate::nc::code::PathControl;
use crate::nc::program::{ArcCentre, AxisSet, Change, Feed, Frame, LengthOffset, Turn, Way};
use crate::nc::{Finding, Program, read};

fn read_as(dialect: Dialect, text: &str) -> Program {
    read(text.as_bytes(), &Rules::new(dialect, &DialectOptions::of(dialect), &[]))
}

fn siemens(text: &str) -> Program {
    read_as(Dialect::Siemens840d, text)
}

fn klartext(text: &str) -> Program {
    read_as(Dialect::HeidenhainTnc, text)
}

/// Line, column and name of each finding.
fn found(program: &Program, text: &str) -> Vec<(usize, Option<usize>, &'static str)> {
    let place = |finding: &Finding| {
        let diagnostic = finding.diagnostic("p", text.as_bytes());
        (finding.line, diagnostic.place.and_then(|place| place.column), finding.code.name())
    };
    program.findings.list().iter().map(place).collect()
}

fn changes(program: &Program) -> Vec<Change> {
    program.changes.iter().map(|at| at.change).collect()
}

#[test]
fn siemens_words_assignments_and_calls() {
    let text = "%_N_PART_MPF\nN10 G0 X10 Y=20 C=DC(350) A=ACP(5.5) ; text\nTRAORI(1)\nORIVECT ORIWKS\nS8000 M3\n\
                G1 X=IC(-1) A3=0.5 C3=1 F100\nG2 X0 Y0 CR=5\nSUPA G0 Z0 D0\nTRAFOOF\nM30\n";
    let program = siemens(text);
    assert_eq!(found(&program, text), []);
    let [rapid, line, arc, home] = &program.moves[..] else { panic!("{:?}", program.moves) };
    assert_eq!(rapid.target, [10.0, 20.0, 0.0, 5.5, 0.0, 350.0]);
    assert_eq!(
        (rapid.turns.of(3), rapid.turns.of(4), rapid.turns.of(5)),
        (Turn::Positive, Turn::Plain, Turn::Shortest)
    );
    assert!(line.given.has_vector() && line.incremental == AxisSet(1));
    assert_eq!(line.target, [-1.0, 0.0, 0.0, 0.5, 0.0, 1.0]);
    assert_eq!(program.arcs[0].centre, ArcCentre::Radius(5.0));
    assert!(matches!(arc.way, Way::Arc(Feed::PerMinute { linear: 100.0, .. }, 0)) && home.frame == Frame::Machine);
    let said = changes(&program);
    assert!(said.contains(&Change::Tcp(true)) && said.contains(&Change::Length(LengthOffset::Off)), "{said:?}");
    assert!(said.contains(&Change::Interpolation(Some(TcpInterpolation::GreatCircle))), "{said:?}");
}

#[test]
fn siemens_says_which_axes_a_feed_is_for() {
    let program = siemens("FGROUP(X,Y,Z,A,C)\nFGREF[A]=10\nFGROUP(X,Y,Z)\nFGROUP()\nG4 F2.5\nM30\n");
    let usual = DialectOptions::of(Dialect::Siemens840d).feed_radius;
    assert_eq!(
        changes(&program),
        [usual, 10.0, 0.0, usual].map(Change::FeedRadius).into_iter().chain([Change::Dwell(2.5)]).collect::<Vec<_>>()
    );
}

#[test]
fn what_siemens_programs_hold_beyond_motion_is_known_or_said() {
    let text = "TRANS\nTRANS X5\nR1=5\nG1 X=R1 F5\nCYCLE832(0.01,112001)\nMSG(\"a;b(\")\nFOO(1)\nX$\nCYCLE800()\nIF 1\n\
                G0 X=(1\nM30\n";
    let program = siemens(text);
    let expected = [
        (2, Some(1), "unsupported-code"),
        (3, Some(1), "unsupported-code"),
        (4, Some(4), "unreadable-text"),
        (5, Some(1), "blending"),
        (7, Some(1), "unsupported-code"),
        (8, Some(1), "unsupported-code"),
        (10, Some(1), "unsupported-code"),
        (11, Some(4), "unreadable-text"),
        (11, Some(6), "unreadable-text"),
    ];
    assert_eq!(found(&program, text), expected, "{:?}", program.findings.list());
}

#[test]
fn tolerances_of_rotary_axes_come_with_those_of_corners() {
    let corners = |program: &Program| {
        let said = changes(program).into_iter();
        said.filter(|change| matches!(change, Change::PathControl(_) | Change::RoundingRotary(_))).collect::<Vec<_>>()
    };
    let band = |mm: f64| Change::PathControl(PathControl::Tolerance(mm));
    let siemens = siemens("CYCLE832(0.01,112001)\nCYCLE832(0.02, 3, 0.4)\nCYCLE832()\nG1 X1 F5\nM30\n");
    let expected = [Change::RoundingRotary(None), band(0.01), Change::RoundingRotary(Some(0.4)), band(0.02)];
    assert_eq!(corners(&siemens), expected);
    let klartext = klartext(
        "0 BEGIN PGM A MM\n1 CYCL DEF 32.0 TOLERANCE\n2 CYCL DEF 32.1 T0.02\n3 CYCL DEF 32.2 HSC-MODE:0 TA0,5\n\
         4 CYCL DEF 32.2 HSC-MODE:1\n5 END PGM A MM\n",
    );
    assert_eq!(corners(&klartext), [Change::RoundingRotary(None), band(0.02), Change::RoundingRotary(Some(0.5))]);
}

#[test]
fn klartext_statements() {
    let text = "0 BEGIN PGM 7 MM\n1 BLK FORM 0.1 Z X+0 Y+0 Z-40\n2 ; text\n3 * - structure\n4 TOOL CALL 5 Z S8000 F500 DL+0\n\
                5 M3\n6 L X+10,5 IY-2 A+30 R0 FMAX M126\n7 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR\n\
                8 LN X+1 Y+2 Z+3 NX+0 NY+0 NZ+1 TX+0.6 TY+0 TZ+0.8 F1000\n9 L Z+5\n10 CC X+0 Y+0\n11 C X+3 Y+0 DR-\n\
                12 CR X+0 Y+3 R+3 DR+\n13 FUNCTION RESET TCPM\n14 L Z-1 R0 FMAX M91\n15 M30\n16 END PGM 7 MM\n";
    let program = klartext(text);
    assert_eq!(found(&program, text), []);
    let [rapid, vector, line, first, second, home] = &program.moves[..] else { panic!("{:?}", program.moves) };
    assert_eq!((rapid.way, rapid.incremental, rapid.turns.of(3)), (Way::Rapid, AxisSet(2), Turn::Shortest));
    assert_eq!(rapid.target[..4], [10.5, -2.0, 0.0, 30.0]);
    assert_eq!(vector.target, [1.0, 2.0, 3.0, 0.6, 0.0, 0.8]);
    assert_eq!(line.way, Way::Line(Feed::PerMinute { linear: 1000.0, rotary: 1000.0 }));
    assert!(matches!((first.way, second.way), (Way::Arc(_, 0), Way::Arc(_, 1))) && home.frame == Frame::Machine);
    assert!(program.arcs[0].clockwise && !program.arcs[1].clockwise);
    assert_eq!(program.arcs[0].centre, ArcCentre::Point { words: [0.0; 3], absolute: true });
    let said = changes(&program);
    assert_eq!(said[..3], [Change::Units { inch: false }, Change::Tool(5), Change::Length(LengthOffset::OwnTool)]);
    assert!(said.contains(&Change::Interpolation(Some(TcpInterpolation::GreatCircle))), "{said:?}");
    assert_eq!(said.iter().filter(|change| matches!(change, Change::Tcp(_))).count(), 2);
}

#[test]
fn what_klartext_programs_hold_beyond_motion_is_known_or_said() {
    let text = "0 BEGIN PGM A INCH\n1 CYCL DEF 247 DATUM SETTING\n    Q339=+1 ;DATUM NUMBER\n2 CYCL DEF 7.0 DATUM SHIFT\n\
                3 CYCL DEF 7.1 X+0\n4 CYCL DEF 7.2 Y+5\n5 CYCL DEF 32.1 T0.02\n6 CALL LBL 5\n7 PLANE SPATIAL SPA+0\n\
                8 PLANE RESET STAY\n9 L X+Q5 FMAX\n10 L X+1 RL FMAX\n11 C X+1 Y+1\n12 L X1 FMAX\n13 END PGM A INCH\n";
    let program = klartext(text);
    let expected = [
        (6, Some(3), "unsupported-code"),
        (7, Some(3), "blending"),
        (8, Some(3), "unsupported-code"),
        (9, Some(3), "unsupported-code"),
        (11, Some(5), "unreadable-text"),
        (12, Some(10), "unsupported-code"),
        (13, Some(13), "bad-arc"),
    ];
    assert_eq!(found(&program, text), expected, "{:?}", program.findings.list());
    assert!(
        changes(&program)
            .iter()
            .any(|change| matches!(change, Change::WorkOffset(code) if code.to_string() == "PRESET 1"))
    );
    assert_eq!(program.moves.last().map(|step| step.target[0]), Some(25.4));
}

#[test]
fn fanuc_and_its_kin_take_tool_vectors_and_lengths_in_one_block() {
    for dialect in [Dialect::Fanuc30i, Dialect::MazakSmooth] {
        let text = "G21 G90 S9 M3\nG43.5 H1 X0. Y0. Z5.\nG94 G1 X1. I0.6 K0.8 F100.\nX2.\nG49\nG1 X3. I1.\nM30\n";
        let program = read_as(dialect, text);
        assert_eq!(found(&program, text)[0], (2, Some(1), "no-motion-code"));
        let [first, second, last] = &program.moves[..] else { panic!("{:?}", program.moves) };
        assert_eq!(first.target[3..], [0.6, 0.0, 0.8]);
        assert!(first.given.has_vector() && !second.given.has_vector() && !last.given.has_vector());
        // Behind G49 I means nothing.
        assert_eq!(found(&program, text)[1], (6, Some(8), "unused-word"));
    }
    let program = read_as(Dialect::HaasNgc, "G0 G234 X1. Y2. Z3. H5\nG49\nM30\n");
    assert_eq!(changes(&program)[..2], [Change::Length(LengthOffset::Number(5)), Change::Tcp(true)]);
    let program = read_as(Dialect::OkumaOsp, "G15 H2\nG0 G169 X1. Y2. Z3. A5. C6. H5\nG170\nM2\n");
    assert!(matches!(changes(&program)[0], Change::WorkOffset(code) if code.to_string() == "G15 H2"));
    assert_eq!(changes(&program)[2..4], [Change::Tcp(true), Change::Tcp(false)]);
}

#[test]
fn a_machine_file_names_the_codes_of_work_offsets_and_tool_lengths() {
    let text = builtin("trunnion-ac-30i").unwrap().replace("dialect = \"fanuc-30i\"", "dialect = \"okuma-osp\"");
    let text = text
        .replace("[control.work_offsets]", "[control.work_offsets]\n\"G17.5 E2\" = [1, 2, 3]")
        .replace("[control.options]", "[control.options]\nlength_codes = [\"G343\", \"G349\"]");
    let machine = Machine::read("m.toml", &text).unwrap();
    let program = read(b"G17.5 E2\nG343 H5\nG349\nM2\n", &Rules::of(&machine));
    assert!(matches!(changes(&program)[0], Change::WorkOffset(code) if code.to_string() == "G17.5 E2"));
    assert_eq!(changes(&program)[1..3], [Change::Length(LengthOffset::Number(5)), Change::Length(LengthOffset::Off)]);
}

#[test]
fn numbers_without_point_mean_what_the_machine_says() {
    let read_with = |rule| {
        let options = DialectOptions { number_without_point: rule, ..DialectOptions::of(Dialect::Fanuc30i) };
        read(b"G0 X1500 A2. Z0\nM30\n", &Rules::new(Dialect::Fanuc30i, &options, &[]))
    };
    assert_eq!(read_with(PointRule::Unit).moves[0].target[0], 1500.0);
    assert_eq!(read_with(PointRule::Increment).moves[0].target, [1.5, 0.0, 0.0, 2.0, 0.0, 0.0]);
    assert_eq!(read_with(PointRule::Required).findings.list().len(), 1);
}

#[test]
fn linuxcnc_refuses_axis_words_with_g80_and_negative_speeds() {
    let text = "G61 G0 X0 Y0\nX1 Y2 G80\nS-1\nG0 X1\nM2\n";
    assert_eq!(
        found(&read_as(Dialect::LinuxCnc, text), text),
        [(2, Some(1), "no-motion-code"), (3, Some(1), "bad-number")]
    );
}
