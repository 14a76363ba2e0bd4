//! What a program that misses the part may have meant: read in the other unit, with rotary letters exchanged, or with an
//! axis turning the other way, it may fit.

use super::Inputs;
use crate::machine::Setup;
use crate::nc::program::{AXIS_LETTERS, AxisSet, Change, Frame, Move};
use crate::nc::{FindingCode, Program};
use crate::simulate::simulate;
use crate::tool::Tool;
use crate::verify::{FindingRecord, Settings, Subject, ToleranceRecord, Verified, verify};

/// Share of the part that no pass reaches from which on a program misses it.
const MISSES: f64 = 0.5;
/// Share below which a changed program fits it.
const FITS: f64 = 0.05;
/// Samples that tell.
const SAMPLES: f64 = 300.0;

/// A change to every move of a program.
struct Hypothesis {
    code: FindingCode,
    words: String,
    apply: Box<dyn Fn(&mut Move)>,
}

/// The first change that makes a program fit that misses the part.
pub(super) fn suspicion(
    program: &Program,
    setup: &Setup,
    inputs: &Inputs,
    tool: &Tool,
    verified: &Verified,
) -> Option<FindingRecord> {
    if verified.record.deviation.uncut_share < MISSES || program.moves.is_empty() {
        return None;
    }
    let mut hypotheses = units();
    hypotheses.extend(rotaries(setup));
    let found = hypotheses.into_iter().find(|hypothesis| fits(hypothesis, program, setup, inputs, tool))?;
    let units = |change: &Change| matches!(change, Change::Units { .. });
    let line = match found.code {
        FindingCode::UnitsSuspected => program.changes.iter().find(|at| units(&at.change)).map(|at| at.line),
        _ => program.moves.iter().find(|step| step.given.indices().any(|index| index > 2)).map(|step| step.line),
    };
    let message = format!("the moves miss the part, and fit it {}", found.words);
    Some(FindingRecord::new(found.code, line.map(|line| line as usize), message))
}

/// Whether no more than a little of the part is left uncut by a changed program.
fn fits(hypothesis: &Hypothesis, program: &Program, setup: &Setup, inputs: &Inputs, tool: &Tool) -> bool {
    let mut program = program.clone();
    program.moves.iter_mut().filter(|step| step.frame == Frame::Work).for_each(&hypothesis.apply);
    let motion = simulate(&program, setup, None);
    let spacing = (inputs.part.surface.area() / SAMPLES).sqrt();
    // Exactness does not matter here.
    let settings = Settings {
        spacing: Some(spacing),
        refinement: f64::INFINITY,
        despite_unknown_text: true,
        ..Settings::default()
    };
    let tolerance = ToleranceRecord { overcut: spacing, undercut: spacing };
    let subject = Subject { program: &program, motion: &motion, tool, part: &inputs.part, tolerance, path: None };
    verify(&subject, &settings).record.deviation.uncut_share < FITS
}

fn units() -> Vec<Hypothesis> {
    let scaled = |factor: f64, unit: &str| Hypothesis {
        code: FindingCode::UnitsSuspected,
        words: format!("with lengths taken in {unit}"),
        apply: Box::new(move |step: &mut Move| step.target.iter_mut().take(3).for_each(|word| *word *= factor)),
    };
    vec![scaled(1.0 / 25.4, "millimetres"), scaled(25.4, "inches")]
}

fn rotaries(setup: &Setup) -> Vec<Hypothesis> {
    let machine = setup.machine();
    let letters = machine.rotary.each_ref().map(|axis| axis.letter);
    let Some([a, b]) = letters
        .map(|letter| AXIS_LETTERS.iter().position(|known| *known == letter))
        .iter()
        .copied()
        .collect::<Option<Vec<_>>>()
        .and_then(|found| <[usize; 2]>::try_from(found).ok())
    else {
        return Vec::new();
    };
    let turned = |slot: usize, index: usize| Hypothesis {
        code: FindingCode::SwappedAxes,
        words: format!("with {} turning the other way", letters[slot]),
        apply: Box::new(move |step: &mut Move| {
            if let Some(word) = step.target.get_mut(index).filter(|_| !step.given.has_vector()) {
                *word = -*word;
            }
        }),
    };
    let exchanged = Hypothesis {
        code: FindingCode::SwappedAxes,
        words: format!("with {} and {} exchanged", letters[0], letters[1]),
        apply: Box::new(move |step: &mut Move| {
            if !step.given.has_vector() {
                step.target.swap(a, b);
                let bits = |from: usize, to: usize| if step.given.has(from) { 1 << to } else { 0 };
                step.given = AxisSet(step.given.0 & !(1 << a) & !(1 << b) | bits(a, b) | bits(b, a));
            }
        }),
    };
    vec![exchanged, turned(0, a), turned(1, b)]
}
