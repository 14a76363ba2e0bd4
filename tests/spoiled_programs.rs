//! Programs spoiled in every way that has cost somebody a part: all rejected, with the line; and good programs on every
//! machine and control: all accepted.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "spoiled_programs/bench.rs"]
mod bench;
#[path = "spoiled_programs/good.rs"]
mod good;
#[path = "spoiled_programs/spoils.rs"]
mod spoils;
#[path = "spoiled_programs/text.rs"]
mod text;

use bench::{Case, Judgement, cases};
use rayon::prelude::*;
use spoils::{SPOILS, Spoil};

/// Programs that are spoiled in each way.
const CASES: usize = 3;
/// Shares of the cutting blocks at which programs are spoiled, in turn.
const PLACES: [f64; 3] = [0.31, 0.64, 0.47];

/// What went wrong with a spoiled program, if anything.
fn complaint(case: &Case, spoil: &Spoil, place: f64) -> Option<Result<(), String>> {
    let spoiled = (spoil.apply)(case, place)?;
    let Judgement { passed, findings } = case.judge(&spoiled.text, spoiled.inputs.as_ref());
    let errors: Vec<_> = findings.iter().filter(|finding| finding.is_error()).collect();
    let first = errors.iter().find_map(|finding| finding.line);
    let told = || {
        let list = errors.iter().take(4).map(|f| format!("\n      {:?} {} {}", f.line, f.id, f.message));
        list.collect::<String>()
    };
    let name = format!("{} on {} at {place}", spoil.name, case.name);
    Some(match spoiled.line {
        _ if passed || errors.is_empty() => Err(format!("{name}: accepted")),
        Some(line) if first != Some(line) => Err(format!("{name}: line {line} is told as {first:?}{}", told())),
        _ => Ok(()),
    })
}

#[test]
fn every_spoiled_program_is_rejected_with_the_line() {
    // Before the threads: what waits for them must not be waited for by them.
    let cases = cases();
    let said: Vec<Vec<Result<(), String>>> = SPOILS
        .par_iter()
        .enumerate()
        .map(|(kind, spoil)| {
            let count = cases.len();
            let tries = (0..count).map(|k| (&cases[(kind + k) % count], PLACES[(kind + k) % PLACES.len()]));
            tries.filter_map(|(case, place)| complaint(case, spoil, place)).take(CASES).collect()
        })
        .collect();
    let idle: Vec<_> = SPOILS.iter().zip(&said).filter(|(_, said)| said.is_empty()).map(|(s, _)| s.name).collect();
    let wrong: Vec<&String> = said.iter().flatten().filter_map(|said| said.as_ref().err()).collect();
    let count = said.iter().flatten().count();
    assert!(
        wrong.is_empty(),
        "{} of {count}:\n{}",
        wrong.len(),
        wrong.iter().map(|w| format!("  {w}\n")).collect::<String>()
    );
    assert_eq!(idle, Vec::<&str>::new());
    assert!(said.len() >= 60 && count >= 150, "{} kinds, {count} programs", said.len());
}

#[test]
fn the_programs_are_good_before_they_are_spoiled() {
    for case in cases() {
        let judgement = case.judge(&case.text, None);
        assert!(judgement.passed && judgement.findings.is_empty(), "{}: {:?}", case.name, judgement.findings);
    }
}
