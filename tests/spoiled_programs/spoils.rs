//! The ways in which programs are spoiled.

use crate::bench::{Case, inputs_of, judged_path, posted};
use crate::text::{find, line, renumbered, replaced, value, with_number, with_value, without, word};
use regulus::machine::{Dialect, Machine, Travel};
use regulus::pipeline::Inputs;

/// A way to spoil a program.
pub(crate) struct Spoil {
    pub(crate) name: &'static str,
    /// Spoils a case's program at a share of its cuts; `None` where there is nothing to spoil this way.
    pub(crate) apply: fn(&Case, f64) -> Option<Spoiled>,
}

/// A spoiled program.
pub(crate) struct Spoiled {
    pub(crate) text: String,
    /// The line to be told as the first that is wrong, where the defect is in one.
    pub(crate) line: Option<usize>,
    /// What it is judged by, where that is not the case's own.
    pub(crate) inputs: Option<Inputs>,
}

impl Spoiled {
    fn text(text: String, line: Option<usize>) -> Option<Self> {
        Some(Self { text: renumbered(&text), line, inputs: None })
    }
}

const fn spoil(name: &'static str, apply: fn(&Case, f64) -> Option<Spoiled>) -> Spoil {
    Spoil { name, apply }
}

pub(crate) const SPOILS: &[Spoil] = &[
    spoil("sign of X", |c, p| valued(c, p, 'X', |v| -v)),
    spoil("sign of Y", |c, p| valued(c, p, 'Y', |v| -v)),
    spoil("sign of Z", |c, p| valued(c, p, 'Z', |v| -v)),
    spoil("sign of the first rotary", |c, p| valued(c, p, rotary(c, 0), |v| -v)),
    spoil("sign of the second rotary", |c, p| valued(c, p, rotary(c, 1), |v| -v)),
    spoil("a digit of X", |c, p| valued(c, p, 'X', |v| v + 0.1)),
    spoil("a digit of Y", |c, p| valued(c, p, 'Y', |v| v - 0.1)),
    spoil("a digit of Z", |c, p| valued(c, p, 'Z', |v| v - 0.1)),
    spoil("a digit of the first rotary", |c, p| valued(c, p, rotary(c, 0), |v| v + 1.0)),
    spoil("a digit of the second rotary", |c, p| valued(c, p, rotary(c, 1), |v| v + 3.0)),
    spoil("a digit of X in two blocks", |c, p| on_cuts(c, p, 2, |l| with_value(l, 'X', |v| v + 0.1))),
    spoil("a digit of Y in two blocks", |c, p| on_cuts(c, p, 2, |l| with_value(l, 'Y', |v| v - 0.1))),
    spoil("a digit of Z in two blocks", |c, p| on_cuts(c, p, 2, |l| with_value(l, 'Z', |v| v - 0.1))),
    spoil("a digit of Z in three blocks", |c, p| on_cuts(c, p, 3, |l| with_value(l, 'Z', |v| v + 0.1))),
    spoil("a digit of the first rotary in two blocks", |c, p| {
        on_cuts(c, p, 2, |l| with_value(l, rotary(c, 0), |v| v + 1.0))
    }),
    spoil("a digit of the second rotary in two blocks", |c, p| {
        on_cuts(c, p, 2, |l| with_value(l, rotary(c, 1), |v| v + 3.0))
    }),
    spoil("point of X lost", |c, p| point_lost(c, p, 'X')),
    spoil("point of Y lost", |c, p| point_lost(c, p, 'Y')),
    spoil("point of Z lost", |c, p| point_lost(c, p, 'Z')),
    spoil("point of a rotary lost", |c, p| point_lost(c, p, rotary(c, 1))),
    spoil("X dropped", |c, p| on_cut(c, p, |l| without(l, 'X'))),
    spoil("second rotary dropped", |c, p| on_cut(c, p, |l| without(l, rotary(c, 1)))),
    spoil("X and Y exchanged", |c, p| on_cut(c, p, |l| exchanged(l, 'X', 'Y'))),
    spoil("rotary letters exchanged", |c, p| on_cut(c, p, |l| exchanged(l, rotary(c, 0), rotary(c, 1)))),
    spoil("a rotary that the machine lacks", missing_axis),
    spoil("lines exchanged", lines_exchanged),
    spoil("blocks lost", blocks_lost),
    spoil("letter O for zero", |c, p| on_cut(c, p, |l| with_number(l, 'X', "1O.5"))),
    spoil("two points in a number", |c, p| on_cut(c, p, |l| with_number(l, 'Y', "1.2.3"))),
    spoil("a comma for the point", comma),
    spoil("X far away", |c, p| on_cut(c, p, |l| with_number(l, 'X', "99999."))),
    spoil("a word twice", |c, p| on_cut(c, p, |l| Some(format!("{l} {}", &l[word(l, 'X')?.1])))),
    spoil("an unknown G code", |c, p| on_cut(c, p, |l| Some(format!("{l} G777")))),
    spoil("an unknown M code", |c, p| on_cut(c, p, |l| Some(format!("{l} M777")))),
    spoil("a variable", |c, p| on_cut(c, p, |l| with_number(l, 'Z', "#5"))),
    spoil("a comment not closed", |c, p| on_cut(c, p, |l| l.split_once(' ').map(|(a, b)| format!("{a} (side {b}")))),
    spoil("a comment in a comment", nested_comment),
    spoil("a block too long", block_too_long),
    spoil("garbage", |c, p| on_cut(c, p, |l| l.split_once(' ').map(|(a, b)| format!("{a} \u{1}\u{fe}?$ {b}")))),
    spoil("F dropped", |c, p| inverse_time(c).then(|| on_cut(c, p, |l| without(l, 'F')))?),
    spoil("F of zero", |c, p| inverse_time(c).then(|| on_cut(c, p, |l| with_number(l, 'F', "0.")))?),
    spoil("F negative", |c, p| on_cut(c, p, |l| with_value(l, 'F', |v| -v))),
    spoil("F a thousand times as high", |c, p| {
        inverse_time(c).then(|| on_cut(c, p, |l| with_value(l, 'F', |v| v * 1000.0)))?
    }),
    spoil("rapid in the cut", rapid_in_cut),
    spoil("rapid through the part", rapid_through_part),
    spoil("arc without centre", |c, p| klartext(c).is_none().then(|| on_cut(c, p, |l| Some(format!("G2 {l}"))))?),
    spoil("incremental", |c, p| klartext(c).is_none().then(|| before_cut(c, p, "G91", 1))?),
    spoil("units exchanged", units_exchanged),
    spoil("lengths in inches", |c, _| every_line(c, |l| scaled(l, &['X', 'Y', 'Z'], 1.0 / 25.4))),
    spoil("angles in radians", |c, _| every_line(c, |l| scaled(l, &[rotary(c, 0), rotary(c, 1)], 1f64.to_radians()))),
    spoil("mirrored", |c, _| every_line(c, |l| scaled(l, &['X'], -1.0))),
    spoil("a rotary turning the other way", |c, _| every_line(c, |l| scaled(l, &[rotary(c, 1)], -1.0))),
    spoil("rotary letters exchanged throughout", |c, _| every_line(c, |l| exchanged(l, rotary(c, 0), rotary(c, 1)))),
    spoil("another work offset", |c, _| work_offset(c, "G55")),
    spoil("an unknown work offset", |c, _| work_offset(c, "G57")),
    spoil("another tool", another_tool),
    spoil("another length offset", |c, _| header(c, "H1", |l| l.replace("H1", "H2"))),
    spoil("no tool length", |c, _| without_line(c, "G43 H1")),
    spoil("TCP never on", tcp_never_on),
    spoil("TCP off in the cut", |c, p| {
        let off = c.inputs.machine.control.options.tcp_off.clone().filter(|_| c.inputs.machine.control.tcp)?;
        before_cut(c, p, &off, 0)
    }),
    spoil("spindle never on", |c, _| {
        edited(c, " M3", |l| l.replace(" M3", "")).or_else(|| edited(c, "M3", |_| String::new()))
    }),
    spoil("spindle off in the cut", |c, p| before_cut(c, p, "M5", 1)),
    spoil("end missing", end_missing),
    spoil("cut off", |c, p| Spoiled::text(c.text.lines().take(c.cut(p)).map(|l| format!("{l}\n")).collect(), None)),
    spoil("unwinding", unwinding),
    spoil("a pivot 0.05 higher", |c, _| pivot(c, 0.05)),
    spoil("a pivot 0.05 lower", |c, _| pivot(c, -0.05)),
    spoil("a tool 0.1 longer", |c, _| tool_length(c, 0.1)),
    spoil("a tool 0.1 shorter", |c, _| tool_length(c, -0.1)),
    spoil("a tool 0.1 thicker", |c, _| with_job(c, "tip_diameter = 4.0", "tip_diameter = 4.1")),
    spoil("a tool 0.1 thinner", |c, _| with_job(c, "tip_diameter = 4.0", "tip_diameter = 3.9")),
    spoil("a tool a tenth of a degree steeper", |c, _| with_job(c, "12.373597", "12.473597")),
    spoil("a rotary axis out of line", |c, _| {
        posted_for(c, |machine| {
            let axis = &mut machine.rotary[0];
            axis.direction = regulus::geometry::Direction::new_normalize(
                axis.direction.into_inner() + regulus::geometry::Vector::new(0.001, 0.001, 0.001),
            );
        })
    }),
];

/// Letter of a rotary axis of the case's machine.
fn rotary(case: &Case, slot: usize) -> char {
    case.inputs.machine.rotary[slot].letter
}

fn dialect(case: &Case) -> Dialect {
    case.inputs.machine.control.dialect
}

fn klartext(case: &Case) -> Option<()> {
    (dialect(case) == Dialect::HeidenhainTnc).then_some(())
}

fn inverse_time(case: &Case) -> bool {
    case.text.contains("G93")
}

/// Changes the first cut from a place on that can be changed so.
fn on_cut(case: &Case, place: f64, edit: impl Fn(&str) -> Option<String>) -> Option<Spoiled> {
    let first = case.cut(place);
    let (number, new) = case
        .cuts
        .iter()
        .filter(|number| **number >= first)
        .find_map(|number| Some((*number, edit(line(&case.text, *number))?)))?;
    Spoiled::text(replaced(&case.text, number, &[&new]), Some(number))
}

/// Changes so many cuts in a row, the first ones from a place on that can all be changed so.
fn on_cuts(case: &Case, place: f64, count: usize, edit: impl Fn(&str) -> Option<String>) -> Option<Spoiled> {
    let first = case.cut(place);
    let from = case.cuts.iter().position(|number| *number >= first)?;
    let rows = case.cuts.get(from..)?.windows(count);
    let edited = |row: &[usize]| {
        let new = row.iter().map(|number| Some((*number, edit(line(&case.text, *number))?)));
        new.collect::<Option<Vec<(usize, String)>>>()
    };
    let new = rows.filter(|row| row.windows(2).all(|pair| pair[1] == pair[0] + 1)).find_map(edited)?;
    let text = new.iter().fold(case.text.clone(), |text, (number, new)| replaced(&text, *number, &[new]));
    Spoiled::text(text, new.first().map(|(number, _)| *number))
}

/// Changes a word so that it tells: what is next to nothing, or nearly stays, is left for the next line.
fn valued(case: &Case, place: f64, letter: char, change: fn(f64) -> f64) -> Option<Spoiled> {
    on_cut(case, place, |line| {
        let old = value(line, letter)?;
        ((change(old) - old).abs() >= 0.05).then(|| with_value(line, letter, change))?
    })
}

fn point_lost(case: &Case, place: f64, letter: char) -> Option<Spoiled> {
    on_cut(case, place, |line| {
        let (span, _) = word(line, letter)?;
        let old = &line[span];
        let digits = old.replace(['.', ','], "");
        (digits.len() < old.len() && value(line, letter)?.abs() > 0.1).then(|| with_number(line, letter, &digits))?
    })
}

fn exchanged(line: &str, a: char, b: char) -> Option<String> {
    let ((first, _), (second, _)) = (word(line, a)?, word(line, b)?);
    let (first, second) = (line[first].to_owned(), line[second].to_owned());
    (first != second).then(|| with_number(&with_number(line, a, &second)?, b, &first))?
}

fn missing_axis(case: &Case, place: f64) -> Option<Spoiled> {
    let own = case.inputs.machine.present_letters();
    let lacking = ['A', 'B', 'C'].into_iter().find(|letter| !own.contains(letter))?;
    on_cut(case, place, |line| {
        let (_, whole) = word(line, rotary(case, 0))?;
        Some(format!("{}{lacking}{}", &line[..whole.start], &line[whole.start + 1..]))
    })
}

/// The lines of a program with a change to their list; `number` is a cut's.
fn shuffled(case: &Case, number: usize, change: impl Fn(&mut Vec<&str>, usize)) -> Option<Spoiled> {
    let mut lines: Vec<&str> = case.text.lines().collect();
    change(&mut lines, number - 1);
    Spoiled::text(lines.iter().map(|line| format!("{line}\n")).collect(), Some(number))
}

fn lines_exchanged(case: &Case, place: f64) -> Option<Spoiled> {
    shuffled(case, case.cut(place), |lines, at| lines.swap(at, at + 10))
}

fn blocks_lost(case: &Case, place: f64) -> Option<Spoiled> {
    shuffled(case, case.cut(place), |lines, at| drop(lines.drain(at..at + 10)))
}

fn comma(case: &Case, place: f64) -> Option<Spoiled> {
    // Klartext may be written with either.
    let elsewhere = klartext(case).is_none();
    elsewhere.then(|| on_cut(case, place, |l| with_number(l, 'X', &l[word(l, 'X')?.0].replace('.', ","))))?
}

fn nested_comment(case: &Case, place: f64) -> Option<Spoiled> {
    let brackets = !matches!(dialect(case), Dialect::HeidenhainTnc | Dialect::Siemens840d);
    brackets.then(|| on_cut(case, place, |l| Some(format!("{l} (side (lower))"))))?
}

fn block_too_long(case: &Case, place: f64) -> Option<Spoiled> {
    let limited = matches!(dialect(case), Dialect::LinuxCnc | Dialect::GrblHal | Dialect::Siemens840d);
    limited.then(|| on_cut(case, place, |l| Some(format!("{l} {}; {}", " ".repeat(300), "x".repeat(300)))))?
}

/// Inserts a block before a cut; `after` lines behind it the effect shows first.
fn before_cut(case: &Case, place: f64, block: &str, after: usize) -> Option<Spoiled> {
    let number = case.cut(place);
    let block = if klartext(case).is_some() { format!("0 {block}") } else { block.to_owned() };
    let text = replaced(&case.text, number, &[&block, line(&case.text, number)]);
    Spoiled::text(text, Some(number + after))
}

fn rapid_in_cut(case: &Case, place: f64) -> Option<Spoiled> {
    let number = case.cut(place);
    let plain = without(line(&case.text, number), 'F').unwrap_or_else(|| line(&case.text, number).to_owned());
    let (rapid, next) = match klartext(case) {
        Some(()) => (format!("{plain} FMAX"), line(&case.text, number + 1).to_owned()),
        None => (format!("G0 {plain}"), format!("G1 {}", line(&case.text, number + 1))),
    };
    let text = replaced(&replaced(&case.text, number + 1, &[&next]), number, &[&rapid]);
    Spoiled::text(text, Some(number))
}

/// Before the first feed move, a rapid along the chord of the cut: its second block goes through the part.
fn rapid_through_part(case: &Case, place: f64) -> Option<Spoiled> {
    let first = if klartext(case).is_some() { None } else { find(&case.text, "G1 ") }?;
    let rapid = |share: f64| {
        let start = case.cut(share);
        let target = case.cuts.iter().filter(|number| **number >= start).find_map(|number| {
            let line = line(&case.text, *number);
            let all =
                ['X', 'Y', 'Z', rotary(case, 0), rotary(case, 1)].iter().all(|letter| word(line, *letter).is_some());
            all.then(|| without(line, 'F').unwrap_or_else(|| line.to_owned()))
        });
        Some(format!("G0 {}", target?))
    };
    let (near, far) = (rapid(0.5 * place)?, rapid(place + 0.2)?);
    Spoiled::text(replaced(&case.text, first, &[&near, &far, line(&case.text, first)]), None)
}

/// Changes the first line that holds a piece of text; the line is to be told.
fn header(case: &Case, piece: &str, change: impl Fn(&str) -> String) -> Option<Spoiled> {
    let number = find(&case.text, piece)?;
    let new = change(line(&case.text, number));
    Spoiled::text(replaced(&case.text, number, &[&new]), Some(number))
}

/// The same where what is wrong shows elsewhere.
fn edited(case: &Case, piece: &str, change: impl Fn(&str) -> String) -> Option<Spoiled> {
    Some(Spoiled { line: None, ..header(case, piece, change)? })
}

/// Siemens calls its offset a second time with TCP on, Klartext runs at a preset.
fn work_offset(case: &Case, other: &str) -> Option<Spoiled> {
    let once = !matches!(dialect(case), Dialect::Siemens840d | Dialect::HeidenhainTnc);
    once.then(|| header(case, "G54", |line| line.replace("G54", other)))?
}

fn without_line(case: &Case, whole: &str) -> Option<Spoiled> {
    let number = case.text.lines().position(|line| line == whole)? + 1;
    Spoiled::text(replaced(&case.text, number, &[]), None)
}

fn another_tool(case: &Case, _place: f64) -> Option<Spoiled> {
    match klartext(case) {
        Some(()) => header(case, "TOOL CALL 1", |line| line.replace("TOOL CALL 1", "TOOL CALL 2")),
        None => header(case, "T1 M6", |line| line.replace("T1 M6", "T2 M6")),
    }
}

fn tcp_never_on(case: &Case, _place: f64) -> Option<Spoiled> {
    let options = &case.inputs.machine.control.options;
    let on = options.tcp_on.clone().filter(|_| case.inputs.machine.control.tcp)?;
    let plain = if on == "G43.4" { "G43" } else { "" };
    edited(case, &on, |line| line.replace(&on, plain))
}

fn units_exchanged(case: &Case, _place: f64) -> Option<Spoiled> {
    let inch = [("G21", "G20"), ("G710", "G700"), (" MM", " INCH")];
    let (from, to) = inch.into_iter().find(|(from, _)| find(&case.text, from).is_some())?;
    header(case, from, |line| line.replace(from, to))
}

/// Changes every line that moves.
fn every_line(case: &Case, edit: impl Fn(&str) -> Option<String>) -> Option<Spoiled> {
    let moved = case.text.lines().map(|line| {
        let header = line.starts_with(['(', ';', '%', 'O']) || line.contains("G53") || line.contains("SUPA");
        let new = if header { None } else { edit(line) };
        new.unwrap_or_else(|| line.to_owned()) + "\n"
    });
    Spoiled::text(moved.collect(), None)
}

fn scaled(line: &str, letters: &[char], factor: f64) -> Option<String> {
    letters
        .iter()
        .try_fold((line.to_owned(), false), |(line, changed), letter| {
            let new = with_value(&line, *letter, |v| v * factor);
            Some((new.clone().unwrap_or(line), changed || new.is_some()))
        })
        .and_then(|(line, changed)| changed.then_some(line))
}

/// Only some controls need to be told the end.
fn end_missing(case: &Case, _place: f64) -> Option<Spoiled> {
    if dialect(case) != Dialect::LinuxCnc {
        return None;
    }
    let is_end = |line: &&str| {
        let words = line.trim_start_matches(|c: char| c.is_ascii_digit()).trim();
        !(matches!(words, "M2" | "M30") || words.starts_with("END PGM"))
    };
    let kept: Vec<&str> = case.text.lines().filter(is_end).collect();
    let kept = kept.strip_suffix(&["%"]).unwrap_or(&kept);
    Spoiled::text(kept.iter().map(|line| format!("{line}\n")).collect(), None)
}

fn unwinding(case: &Case, place: f64) -> Option<Spoiled> {
    let axis = &case.inputs.machine.rotary[1];
    let literal = axis.travel != Travel::Wrapped && !case.text.contains("DC(") && !case.text.contains("M126");
    let back = |v: f64| if v > 0.0 { v - 360.0 } else { v + 360.0 };
    literal.then(|| on_cut(case, place, |line| with_value(line, axis.letter, back)))?
}

/// The program posted for a machine a little different from the one that it is judged on; for controls without TCP, which
/// have to know their pivots.
fn posted_for(case: &Case, change: impl Fn(&mut Machine)) -> Option<Spoiled> {
    if case.inputs.machine.control.tcp {
        return None;
    }
    let other = inputs_of(case, str::to_owned, change);
    Spoiled::text(posted(&other, judged_path()).ok()?, None)
}

fn pivot(case: &Case, by: f64) -> Option<Spoiled> {
    posted_for(case, |machine| machine.rotary[0].pivot.z += by)
}

fn tool_length(case: &Case, by: f64) -> Option<Spoiled> {
    if case.inputs.machine.control.tcp {
        return None;
    }
    let mut path = judged_path().clone();
    path.tool.gauge_length += by;
    Spoiled::text(posted(&case.inputs, &path).ok()?, None)
}

/// The program judged by a job a little different from the one that it was made for.
fn with_job(case: &Case, from: &str, to: &str) -> Option<Spoiled> {
    let inputs = inputs_of(case, |job| job.replace(from, to), |_| {});
    Some(Spoiled { text: case.text.clone(), line: None, inputs: Some(inputs) })
}
