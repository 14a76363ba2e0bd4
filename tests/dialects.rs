//! Every dialect in every form, from a tool path to the verdict on its text; and programs of other makers, read whole.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "dialects/foreign.rs"]
mod foreign;

use regulus::job::Job;
use regulus::machine::{Dialect, DialectOptions, FeedMode, LengthUnit, Machine, OrientationWords, builtin};
use regulus::motion::ToolPath;
use regulus::pipeline::{InputFile, Inputs, Judged, Judging, PartFiles, judge, plan, post_job};
use regulus::verify::{DeviationRecord, Verdict};
use std::sync::OnceLock;

/// A patch of 40 mm x 10 mm, twisted a little; its normal, Su x Sv, points to the tool.
const PART: &[u8] = br#"{"format": "regulus-bspline", "version": 1, "units": "mm", "degree": [1, 1],
    "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1], "flip": false,
    "control": [[[0, 0, 0], [0, 0, 10]], [[40, 0, 0], [40, 0.5, 10]]]}"#;

const JOB: &str = r#"
    format = "regulus-job"
    version = 1
    name = "patch"
    [part]
    file = "patch.json"
    tolerance = { overcut = 0.01, undercut = 0.02 }
    [tool]
    number = 1
    kind = "cylinder"
    diameter = 8.0
    flute_length = 20.0
    gauge_length = 80.0
    [strategy]
    kind = "single-sweep"
    direction = [1.0, 0.0, 0.0]
    [machine]
    file = "MACHINE"
    work_offset = "OFFSET"
    offset = [10.0, 20.0, 30.0]
    [feed]
    cut = 600.0
    spindle = 8000
"#;

/// What moving the words' last digits may change, mm.
const ROUNDING: f64 = 2e-4;
/// What may change where the tool turns another way between blocks: each way keeps this from the path, mm.
const LINEARIZATION: f64 = 1e-3;

fn inputs(machine: &str, dialect: Dialect, change: impl Fn(&mut DialectOptions)) -> Inputs {
    let offset = if dialect == Dialect::OkumaOsp { "G15 H1" } else { "G54" };
    let job = Job::read(&JOB.replace("MACHINE", machine).replace("OFFSET", offset), "job.toml").unwrap();
    let mut machine = Machine::named(machine).unwrap();
    let control = &mut machine.control;
    (control.dialect, control.options) = (dialect, DialectOptions::of(dialect));
    control.tcp = control.options.tcp_on.is_some();
    change(&mut control.options);
    let part = InputFile { name: "patch.json", bytes: PART };
    Inputs::read(job, &PartFiles::alone(part), &machine, "").unwrap()
}

/// The tool path is the same for every machine and control.
fn path() -> &'static ToolPath {
    static PATH: OnceLock<ToolPath> = OnceLock::new();
    PATH.get_or_init(|| plan(&inputs("trunnion-ac-30i", Dialect::Fanuc30i, |_| {})).unwrap().path)
}

fn posted_and_judged(inputs: &Inputs) -> (String, Judged) {
    let text = post_job(inputs, path()).unwrap().text;
    let file = InputFile { name: "program.nc", bytes: text.as_bytes() };
    let judged = judge(inputs, file, Some(path()), &Judging::default()).unwrap_or_else(|complaints| {
        let complaints: Vec<_> = complaints.iter().map(ToString::to_string).collect();
        panic!("{}\n{text}", complaints.join("\n"))
    });
    (text, judged)
}

fn assert_same_part(ours: &DeviationRecord, usual: &DeviationRecord, allowed: f64, text: &str) {
    for (ours, usual) in [(ours.overcut_max_mm, usual.overcut_max_mm), (ours.undercut_max_mm, usual.undercut_max_mm)] {
        assert!((ours - usual).abs() <= allowed, "{ours} {usual}\n{text}");
    }
}

/// Posts in a form and compares with the usual one.
fn check(machine: &str, dialect: Dialect, allowed: f64, change: impl Fn(&mut DialectOptions)) -> String {
    static USUAL: OnceLock<DeviationRecord> = OnceLock::new();
    let usual = USUAL.get_or_init(|| {
        let usual = inputs("trunnion-ac-30i", Dialect::Fanuc30i, |_| {});
        posted_and_judged(&usual).1.verified.record.deviation
    });
    let (text, judged) = posted_and_judged(&inputs(machine, dialect, change));
    let record = &judged.verified.record;
    assert_eq!(record.verdict, Verdict::Pass, "{:?}\n{text}", record.reasons);
    let round_trip = record.round_trip.unwrap();
    assert!(round_trip.tip_max_mm <= 2e-3, "{round_trip:?}\n{text}");
    assert_same_part(&record.deviation, usual, allowed, &text);
    text
}

/// Without TCP the axes go straight, with it the tip does.
fn allowed(dialect: Dialect) -> f64 {
    if DialectOptions::of(dialect).tcp_on.is_some() { ROUNDING } else { LINEARIZATION }
}

#[test]
fn every_dialect_leaves_the_same_part() {
    for (dialect, name) in Dialect::ALL {
        let text = check("trunnion-ac-30i", dialect, allowed(dialect), |_| {});
        assert!(text.to_lowercase().contains(name), "{text}");
    }
}

#[test]
fn tool_vectors_leave_the_same_part() {
    for (dialect, words) in [
        (Dialect::Fanuc30i, "G43.5"),
        (Dialect::MazakSmooth, "G43.5"),
        (Dialect::Siemens840d, "ORIVECT"),
        (Dialect::HeidenhainTnc, "LN X"),
    ] {
        let vectors = |options: &mut DialectOptions| options.orientation = OrientationWords::Vectors;
        let text = check("trunnion-ac-30i", dialect, LINEARIZATION, vectors);
        assert!(text.contains(words), "{text}");
    }
}

#[test]
fn inches_and_feeds_per_minute_leave_the_same_part() {
    for (dialect, _) in Dialect::ALL {
        check("trunnion-ac-30i", dialect, allowed(dialect), |options| {
            options.units = LengthUnit::Inch;
            options.linear_digits = 5;
            options.feed_mode = FeedMode::PerMinute;
        });
    }
}

/// A machine file with templates of its own.
fn with_templates(templates: &str) -> String {
    format!("{}\n[control.templates]\n{templates}", builtin("trunnion-ac-30i").unwrap())
}

#[test]
fn a_shop_writes_the_parts_around_the_path_its_own_way() {
    let text = with_templates(
        "header = \"\"\"\n%\nO{{ number | pad(6) }} {{ name | comment }}\n{% for line in start_lines %}{{ line }}\n\
         {% endfor %}G21 G90 G17 G40 G49 G80 G94\n\"\"\"\nend = \"M9\\nM5\\nM30\\n%\"\n",
    );
    let mut ours = inputs("trunnion-ac-30i", Dialect::Fanuc30i, |_| {});
    ours.machine.control.templates = Machine::read("shop.toml", &text).unwrap().control.templates;
    let (text, _) = posted_and_judged(&ours);
    assert!(text.starts_with("%\nO000001 (PATCH)\nG21 G90") && text.ends_with("M9\nM5\nM30\n%\n"), "{text}");
}

#[test]
fn a_template_with_an_unknown_field_is_refused_in_its_place() {
    let text = with_templates("header = \"\"\"\n%\n{{ spindel }}\n\"\"\"\n");
    let error = Machine::read("shop.toml", &text).unwrap_err();
    let line = text.lines().position(|line| line == "{{ spindel }}").unwrap() + 1;
    let place = error.place.as_ref().unwrap();
    assert_eq!((place.file.as_str(), place.line), ("shop.toml", Some(line)), "{error}");
    assert!(
        error.message.contains("spindel") && error.help.as_ref().unwrap().contains("did you mean spindle?"),
        "{error}"
    );
    let text = with_templates("end = \"M30\\n{% if tcp %}\"\n");
    assert!(Machine::read("shop.toml", &text).unwrap_err().to_string().contains("shop.toml:"));
}
