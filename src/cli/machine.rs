//! `regulus machine`: the machines that come along, and checks of a user's own.

use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal};
use crate::geometry::{Degrees, Radians};
use crate::machine::{AxisPosition, BUILTIN, Machine, Setup, Travel};
use clap::Subcommand;
use std::fmt::Write;
use std::path::Path;

/// JSON Schema of a machine file.
const SCHEMA: &str = include_str!("machine_schema.json");
/// Positions a rotary axis is tried at by `check`.
const TRIALS: usize = 25;
/// Tool length that `check` tries the kinematics with, mm.
const TRIAL_TOOL_LENGTH: f64 = 100.0;

#[derive(Subcommand)]
pub(super) enum Action {
    /// List the machines that come along
    List,
    /// Print a machine's file, a start for one of your own
    Show {
        /// Name of a machine that comes along, or path of a machine file
        machine: String,
    },
    /// Read a machine file, print its axes and try its kinematics there and back
    Check {
        /// Name of a machine that comes along, or path of a machine file
        machine: String,
    },
    /// Print the JSON Schema of machine files
    Schema,
}

pub(super) fn run(action: &Action, terminal: &mut Terminal) -> Result<Outcome, Refusal> {
    match action {
        Action::List => {
            let mut text = String::new();
            for (name, source) in BUILTIN {
                let machine = Machine::read(name, source)?;
                let _ = writeln!(text, "{name:<18} {}", machine.description);
            }
            terminal.print(&text);
        }
        Action::Show { machine } => terminal.print(&machine_file(machine, Path::new(""))?.text),
        Action::Check { machine } => {
            let found = machine_file(machine, Path::new(""))?;
            terminal.print(&check(&found.machine)?);
        }
        Action::Schema => terminal.print(SCHEMA),
    }
    Ok(Outcome::Good)
}

/// The axes in a table, and how well the inverse kinematics undoes the forward one.
fn check(machine: &Machine) -> Result<String, Refusal> {
    let mut text = format!("{}: {}\n", machine.name, machine.description);
    let _ = writeln!(text, "{:<5}{:>12}{:>12}{:>16}{:>20}", "axis", "from", "to", "speed", "acceleration");
    for axis in &machine.linear {
        let (speed, acceleration) = (axis.speed * 60.0, axis.acceleration);
        let _ = writeln!(
            text,
            "{:<5}{:>12.3}{:>12.3}{speed:>9.0} mm/min{acceleration:>13.0} mm/s^2",
            axis.letter, axis.min, axis.max
        );
    }
    for axis in &machine.rotary {
        let degrees = |radians: f64| Degrees::from(Radians(radians)).0;
        let (from, to) = match axis.travel {
            Travel::Limited { min, max } => (format!("{:.3}", degrees(min)), format!("{:.3}", degrees(max))),
            Travel::Unlimited => ("unlimited".to_owned(), String::new()),
            Travel::Wrapped => ("wrapped".to_owned(), String::new()),
        };
        let (speed, acceleration) = (degrees(axis.speed) * 60.0, degrees(axis.acceleration));
        let _ = writeln!(text, "{:<5}{from:>12}{to:>12}{speed:>8.0} deg/min{acceleration:>12.0} deg/s^2", axis.letter);
    }
    let control = &machine.control;
    let offsets: Vec<_> = control.work_offsets.iter().map(|o| o.name.as_str()).collect();
    let tcp = if control.tcp { "on" } else { "off" };
    let _ = writeln!(text, "control {}, TCP {tcp}, work offsets {}", control.dialect.name(), offsets.join(", "));
    let (error, poses) = there_and_back(machine)?;
    let _ = writeln!(text, "inverse after forward kinematics, {poses} poses: largest difference {error:.1e} mm or rad");
    Ok(text)
}

/// Largest difference between axis positions and what the inverse kinematics finds for their pose, over a grid of both
/// rotary axes; and the number of poses.
fn there_and_back(machine: &Machine) -> Result<(f64, usize), Refusal> {
    let setup = Setup::at(machine, [0.0; 3], TRIAL_TOOL_LENGTH)?;
    let mut worst = 0.0f64;
    let angles = |index: usize| {
        let (low, high) = match machine.rotary[index & 1].travel {
            Travel::Limited { min, max } => (min, max),
            Travel::Unlimited | Travel::Wrapped => (-std::f64::consts::PI, std::f64::consts::PI),
        };
        (0..TRIALS).map(move |i| low + (high - low) * i as f64 / (TRIALS - 1) as f64)
    };
    for first in angles(0) {
        for second in angles(1) {
            let linear = machine.linear.each_ref().map(|axis| (axis.min + axis.max) / 2.0);
            let axes = AxisPosition { linear, rotary: [first, second] };
            let found = setup.inverse_near(&setup.forward(&axes), axes.rotary);
            let difference = found.map_or(f64::INFINITY, |found| {
                let pairs = found.values().into_iter().zip(axes.values());
                pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            worst = worst.max(difference);
        }
    }
    Ok((worst, TRIALS * TRIALS))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// Every table of the schema as (path of the table in a machine file, its keys).
    fn tables(schema: &Value, path: &str, found: &mut Vec<(String, Vec<String>)>) {
        let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
        found.push((path.to_owned(), properties.keys().cloned().collect()));
        for (key, inner) in properties {
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            tables(inner, &path, found);
            if let Some(items) = inner.get("items") {
                tables(items, &path, found);
            }
        }
    }

    /// The reader's own list of the keys of a table: what it offers in place of a key that it does not know.
    fn keys_the_reader_knows(path: &str) -> Vec<String> {
        let mut machine: toml::Value = toml::from_str(crate::machine::builtin("xyzac-trt").unwrap()).unwrap();
        machine.as_table_mut().unwrap().entry("spindle").or_insert(toml::Table::new().into());
        let mut table = &mut machine;
        for key in path.split('.').filter(|k| !k.is_empty()) {
            table = table.get_mut(key).unwrap();
            if table.is_array() {
                table = table.get_mut(0).unwrap();
            }
        }
        table.as_table_mut().unwrap().insert("no-such-key-anywhere".to_owned(), 1.into());
        let text = toml::to_string(&machine).unwrap();
        let help = Machine::read("m.toml", &text).unwrap_err().help.unwrap();
        let (_, list) = help.split_once(": ").unwrap();
        list.split(", ").map(str::to_owned).collect()
    }

    #[test]
    fn schema_and_reader_know_the_same_keys() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let mut found = Vec::new();
        tables(&schema, "", &mut found);
        assert!(found.len() >= 8, "{found:?}");
        for (path, mut keys) in found {
            let mut known = keys_the_reader_knows(&path);
            keys.sort();
            known.sort();
            assert_eq!(keys, known, "table [{path}]");
        }
    }

    #[test]
    fn machines_that_come_along_are_good() {
        for (name, text) in BUILTIN {
            let machine = Machine::read(name, text).unwrap();
            assert_eq!(machine.name, name);
            let (error, _) = there_and_back(&machine).ok().unwrap();
            assert!(error < 1e-9, "{name}: {error}");
        }
    }
}
