//! `regulus machine`: the machines that come along, and checks of a user's own.

use super::files::Outputs;
use super::inputs::machine_file;
use super::{Outcome, Refusal, Terminal};
use crate::geometry::{Degrees, Radians};
use crate::machine::{BUILTIN, Machine, Travel, check, schema};
use clap::Subcommand;
use std::fmt::Write;
use std::path::{Path, PathBuf};

#[derive(Subcommand)]
pub(super) enum Action {
    /// List the machines that come along
    List,
    /// Print a machine's file, a start for one of your own
    Show {
        /// Name of a machine that comes along, or path of a machine file
        machine: String,
    },
    /// Read a machine file, print its axes, try its kinematics there and back, look for contradictions, draw its reach
    Check {
        /// Name of a machine that comes along, or path of a machine file
        machine: String,
        /// Write the picture of the reach here, too
        #[arg(long, value_name = "P.svg")]
        picture: Option<PathBuf>,
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
        Action::Check { machine, picture } => {
            let machine = machine_file(machine, Path::new(""))?.machine;
            let report = check(&machine)?;
            let text = format!("{}{}\n{}", axes(&machine), report.lines.join("\n"), report.map.text());
            if let Some(picture) = picture {
                let mut outputs = Outputs::default();
                outputs.add(picture.clone(), report.map.svg(&machine.name));
                outputs.write()?;
            }
            terminal.print(&text);
            if !report.is_sound() {
                return Ok(Outcome::Failed);
            }
        }
        Action::Schema => terminal.print(&format!("{}\n", schema())),
    }
    Ok(Outcome::Good)
}

/// The axes and the control in a table.
fn axes(machine: &Machine) -> String {
    let mut text = format!("{:<5}{:>12}{:>12}{:>16}{:>20}\n", "axis", "from", "to", "speed", "acceleration");
    for axis in &machine.linear {
        let (speed, acceleration) = (axis.speed * 60.0, axis.acceleration);
        let _ = writeln!(
            text,
            "{:<5}{:>12.3}{:>12.3}{speed:>9.0} mm/min{acceleration:>13.0} mm/s^2",
            axis.letter, axis.min, axis.max
        );
    }
    for axis in machine.rotary.iter().filter(|axis| axis.is_present()) {
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
    let _ = writeln!(text, "numbers from: {}", machine.source);
    let _ = writeln!(text, "control {}, TCP {tcp}, work offsets {}", control.dialect.name(), offsets.join(", "));
    text
}
