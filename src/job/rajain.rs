//! From the keys of method "rajain-2023" to its settings.

use super::limits::{Checks, LENGTH, SAMPLES, SHARE, ZERO_WEIGHT};
use super::raw;
use crate::plan::{Free, RajainSettings, Weights};

/// Least share of the flank that may be engaged: less is no flank milling.
const LEAST_ENGAGEMENT: f64 = 0.02;

/// What a method of another name must not be given.
pub(super) fn refuse_foreign_keys(checks: &mut Checks<'_>, strategy: &raw::Strategy) {
    const HELP: &str = "write method = \"rajain-2023\", or leave it out";
    if strategy.rajain.is_some() {
        checks.refuse("strategy.rajain", "these settings belong to the method \"rajain-2023\"", HELP);
    }
    let Some(weights) = &strategy.weights else { return };
    for (key, value) in [("rigidity", weights.rigidity), ("proximity", weights.proximity)] {
        if value.is_some() {
            let message = format!("only the method \"rajain-2023\" weighs {key}");
            checks.refuse(&format!("strategy.weights.{key}"), message, HELP);
        }
    }
}

/// Settings of the method; the direction field is named beside them.
pub(super) fn settings(checks: &mut Checks<'_>, strategy: &raw::Strategy) -> (RajainSettings, Option<String>) {
    let mut settings =
        RajainSettings { weights: weights(checks, strategy.weights.as_ref()), ..RajainSettings::default() };
    let table = strategy.rajain.as_ref();
    let field = table.and_then(|t| t.field.clone()).map(|field| checks.path("strategy.rajain.field", field));
    match (&field, strategy.direction) {
        (Some(_), Some(_)) => checks.refuse(
            "strategy.direction",
            "the machining direction is given twice, as one vector and as a field",
            "leave out `direction`, or `field` under [strategy.rajain]",
        ),
        (None, None) => checks.refuse(
            "strategy.method",
            "method \"rajain-2023\" needs the machining direction",
            "add `direction = [x, y, z]`, or `field = \"directions.csv\"` under [strategy.rajain]",
        ),
        _ => {}
    }
    let Some(table) = table else { return (settings, field) };
    let has = |wanted: raw::Freed| table.free.contains(&wanted);
    settings.free = Free { length: has(raw::Freed::Length), r1: has(raw::Freed::R1), r2: has(raw::Freed::R2) };
    if let Some([from, to]) = table.engagement {
        checks.all_within("strategy.rajain.engagement", &[from, to], &SHARE);
        if to - from < LEAST_ENGAGEMENT {
            checks.refuse(
                "strategy.rajain.engagement",
                format!("from {from} to {to} is no part of the flank to mill with"),
                "write [from, to] as shares of the flank, from tip to spindle, such as [0.0, 0.5]",
            );
        }
        settings.engagement = (from, to);
    }
    if let Some(step) = table.step {
        checks.within("strategy.rajain.step", step, &LENGTH);
        if step < 1e-3 {
            checks.refuse("strategy.rajain.step", format!("a step of {step} mm is too short"), "write 0.001 or more");
        }
        settings.step = Some(step);
    }
    if let Some(samples) = table.samples {
        checks.within("strategy.rajain.samples", f64::from(samples), &SAMPLES);
        settings.heights = samples as usize;
    }
    (settings, field)
}

/// Weights of equation 18; each may be zero, which leaves its term out.
fn weights(checks: &mut Checks<'_>, given: Option<&raw::Weights>) -> Weights {
    let mut weights = Weights::default();
    let Some(given) = given else { return weights };
    for (key, value, weight) in [
        ("rigidity", given.rigidity, &mut weights.rigidity),
        ("accuracy", given.accuracy, &mut weights.accuracy),
        ("g1", given.g1, &mut weights.g1),
        ("proximity", given.proximity, &mut weights.proximity),
        ("fairness", given.fairness, &mut weights.fairness),
    ] {
        if let Some(value) = value {
            checks.within(&format!("strategy.weights.{key}"), value, &ZERO_WEIGHT);
            *weight = value;
        }
    }
    weights
}
