//! Programs of other makers, as their posts write them: read whole, with what is not understood listed by word and line.
//! A folder of such programs is read where the environment variable `REGULUS_FOREIGN_PROGRAMS` names one.

use regulus::machine::{Dialect, DialectOptions, PointRule};
use regulus::nc::{Finding, Program, Rules, read};
use std::path::Path;

fn read_as(dialect: Dialect, text: &[u8]) -> Program {
    let options = DialectOptions { number_without_point: PointRule::Unit, ..DialectOptions::of(dialect) };
    read(text, &Rules::new(dialect, &options, &[]))
}

/// Every finding has its line, and the word where it is about one.
fn assert_listed(program: &Program, text: &[u8]) {
    for finding in program.findings.list() {
        assert!(finding.line >= 1 && finding.line <= program.lines.max(1), "{finding:?}");
        assert!(!finding.diagnostic("p", text).to_string().is_empty());
    }
}

/// Name, dialect, fewest moves, and a finding that must be there.
const PROGRAMS: [(&str, Dialect, usize, Option<&str>); 10] = [
    ("linuxcnc_boat-xyzbc.ngc", Dialect::LinuxCnc, 1800, None),
    ("linuxcnc_impeller-7bl-xyzac.ngc", Dialect::LinuxCnc, 4491, None),
    ("nx_dmc100_millplus.ptp", Dialect::HeidenhainTnc, 3700, Some("unsupported-code")),
    ("nx_dmc160u_millplus.ptp", Dialect::Iso, 2300, Some("unknown-code")),
    ("nx_dmu70evo_840d_inch.ptp", Dialect::Siemens840d, 900, Some("unsupported-code")),
    ("nx_haas_vf2tr_5ax.ptp", Dialect::HaasNgc, 900, Some("bad-comment")),
    ("nx_moriseiki_nmv5000_mm.ptp", Dialect::Fanuc30i, 500, Some("missing-offset-number")),
    ("psc_cuq_test_ac.nc", Dialect::Iso, 270, Some("no-motion-code")),
    ("rtcp4r19415_finition_ab_radians.nc", Dialect::LinuxCnc, 870, Some("radians-suspected")),
    ("xcd0_b-f-v16_first3000.ncd", Dialect::Iso, 2900, Some("missing-end")),
];

#[test]
fn a_folder_of_foreign_programs_is_read_whole() {
    let Some(folder) = std::env::var_os("REGULUS_FOREIGN_PROGRAMS") else {
        println!("left out: REGULUS_FOREIGN_PROGRAMS names no folder");
        return;
    };
    for (name, dialect, moves, expected) in PROGRAMS {
        let text = std::fs::read(Path::new(&folder).join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let program = read_as(dialect, &text);
        let lines = text.split(|byte| *byte == b'\n').count();
        // Nothing behind the program's own end is lost but what the control ignores too.
        assert!(program.lines == lines || program.lines + 1 == lines, "{name}: {} of {lines} lines", program.lines);
        assert!(program.moves.len() >= moves, "{name}: {} moves", program.moves.len());
        assert_listed(&program, &text);
        let found = |code: &str| program.findings.list().iter().any(|finding| finding.code.name() == code);
        assert!(
            expected.is_none_or(found),
            "{name}: {:?}",
            program.findings.list().iter().map(name_of).collect::<Vec<_>>()
        );
        if expected != Some("radians-suspected") {
            assert!(!found("radians-suspected"), "{name}");
        }
    }
}

fn name_of(finding: &Finding) -> String {
    format!("{}: {}", finding.line, finding.message)
}

#[test]
fn words_without_blanks_between_them() {
    let text = b"N1(File   : test.nc)\nN4T006M06F800S1800\nM3\nN6X0.000Y-1.000Z305.000A0.001C0.001G00\nN8Y-0.999Z206.021G01F800\nM30\n";
    let program = read_as(Dialect::Iso, text);
    assert_eq!(program.findings.list(), &[]);
    assert_eq!(program.moves[1].target, [0.0, -0.999, 206.021, 0.0, 0.0, 0.0]);
}

#[test]
fn other_words_are_listed_one_by_one() {
    let text = b"%\nO1 (A)\nG54 I1\nG141 R=5\nG7 A5=0.0 B5=0.0\nG0 X1. Y2.\nM777\nM30\n%\n";
    let program = read_as(Dialect::Iso, text);
    assert_listed(&program, text);
    let found: Vec<_> = program.findings.list().iter().map(|f| (f.line, f.code.name())).collect();
    assert_eq!(
        found,
        [
            (3, "no-motion-code"),
            (3, "unused-word"),
            (4, "unknown-code"),
            (4, "unreadable-text"),
            (5, "unknown-code"),
            (5, "unreadable-text"),
            (5, "unreadable-text"),
            (7, "unknown-code"),
        ]
    );
    assert_eq!(program.moves.len(), 1);
}
