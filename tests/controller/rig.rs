//! Plays programs on a headless LinuxCNC by the scripts in `rig/`.

use regulus::machine::AxisPosition;
use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output};
use std::sync::Mutex;

/// One controller at a time: it wants a core of its own.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Whether a controller can be played on here. Says loudly when not, and fails where it must be.
pub(crate) fn present(test: &str) -> bool {
    let succeeds = |script: &str| {
        let output = Command::new("sh").args(["-c", script]).output();
        output.is_ok_and(|output| output.status.success())
    };
    let installed = succeeds("command -v linuxcnc && command -v rs274 && command -v cc");
    if installed && succeeds("unshare --ipc --pid --net --mount --fork --mount-proc true") {
        return true;
    }
    let needs = "LinuxCNC (Debian package linuxcnc-uspace), a C compiler, and root for namespaces of its own";
    let message = format!("LEFT OUT: {test} needs {needs}");
    assert!(std::env::var_os("REGULUS_REQUIRE_CONTROLLER").is_none(), "{message}");
    // Not by a macro: the test harness would keep it to itself.
    writeln!(std::io::stderr(), "\n*** {message} ***\n").unwrap();
    false
}

/// A controller: a machine with a tool and a work offset, and what its kinematics numbers and codes mean.
#[derive(Clone, Debug)]
pub(crate) struct Rig {
    pub(crate) machine: String,
    pub(crate) tool: u32,
    pub(crate) tool_length: f64,
    /// Coordinate system that has the work offset: 1 is G54.
    pub(crate) system: usize,
    pub(crate) offset: [f64; 3],
    /// Numbers of its kinematics other than the machine has in `rig/machines.py`, by their names there, mm.
    pub(crate) geometry: Vec<(&'static str, f64)>,
    /// Kinematics 0 is identity and 1 TCP, instead of the reverse; the controller starts with 0.
    pub(crate) identity_first: bool,
    /// Kinematics that M428 selects; M429 selects the other.
    pub(crate) m428_selects: u32,
}

/// What the controller commands in one cycle of a millisecond. Linear axes mm, rotary axes radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sample {
    /// What goes to the drives.
    pub(crate) joints: AxisPosition,
    /// Programmed position plus work offset and tool length.
    pub(crate) world: AxisPosition,
    /// Tool length in force, mm.
    pub(crate) tool: f64,
    /// Whether TCP is on.
    pub(crate) tcp: bool,
    /// Line of the program, from 1.
    pub(crate) line: usize,
    /// What kind of move is going on.
    pub(crate) kind: Kind,
}

/// What kind of move is going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Standing,
    Rapid,
    Feed,
}

/// A move as the interpreter understands it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CanonicalMove {
    pub(crate) rapid: bool,
    /// X, Y, Z, A, B, C in program coordinates, mm and degrees.
    pub(crate) target: [f64; 6],
}

/// What became of a program.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    /// `ok` when it ended as it should.
    pub(crate) status: String,
    /// What the controller told its operator.
    pub(crate) messages: Vec<String>,
    pub(crate) samples: Vec<Sample>,
}

impl Rig {
    /// The moves that the interpreter makes of a program; its complaint if it refuses.
    pub(crate) fn accept(&self, text: &str) -> Result<Vec<CanonicalMove>, String> {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program.ngc");
        std::fs::write(&program, text).unwrap();
        let output = self.command("accept").arg(&program).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if !output.status.success() || !said.trim().is_empty() {
            return Err(said);
        }
        let canonical = String::from_utf8(output.stdout).unwrap();
        Ok(canonical.lines().filter_map(canonical_move).collect())
    }

    /// Plays a program to its end.
    pub(crate) fn play(&self, text: &str) -> Outcome {
        let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(|broken| broken.into_inner());
        let folder = tempfile::tempdir().unwrap();
        let [program, csv] = ["program.ngc", "samples.csv"].map(|name| folder.path().join(name));
        std::fs::write(&program, text).unwrap();
        // A busy computer does not keep up with a fast clock.
        for speed in ["10", "3", "1"] {
            let output = self.command("play").args([&program, &csv]).args(["--speed", speed]).output().unwrap();
            let mut outcome = outcome(&output);
            if outcome.status != "broken" || speed == "1" {
                let table = std::fs::read_to_string(&csv).unwrap_or_default();
                outcome.samples = table.lines().skip(1).map(|row| self.sample(row)).collect();
                return outcome;
            }
        }
        unreachable!("the last speed returns")
    }

    fn command(&self, action: &str) -> Command {
        let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/controller/rig/rig.py");
        // The controller's own modules belong to the system's interpreter.
        let mut command = Command::new("/usr/bin/python3");
        command.arg("-B").arg(script).arg(action).args(["--machine", &self.machine]);
        command.arg(format!("--tool={}", self.tool)).arg(format!("--length={}", self.tool_length));
        command.arg(format!("--system={}", self.system)).arg("--offset").args(self.offset.map(|v| v.to_string()));
        command.arg(format!("--m428-type={}", self.m428_selects));
        command.args(self.geometry.iter().map(|(name, value)| format!("--geometry={name}={value}")));
        if self.identity_first {
            command.arg("--identity-first");
        }
        command
    }

    fn sample(&self, row: &str) -> Sample {
        let values: Vec<f64> = row.split(',').map(|field| field.parse().unwrap()).collect();
        let axes = |from: usize| AxisPosition {
            linear: [values[from], values[from + 1], values[from + 2]],
            rotary: [values[from + 3].to_radians(), values[from + 4].to_radians()],
        };
        Sample {
            joints: axes(0),
            world: axes(5),
            tool: values[10],
            tcp: (values[11] == 1.0) == self.identity_first,
            line: values[12] as usize,
            kind: match values[13] as u32 {
                0 => Kind::Standing,
                1 => Kind::Rapid,
                _ => Kind::Feed,
            },
        }
    }
}

fn outcome(output: &Output) -> Outcome {
    let said = String::from_utf8_lossy(&output.stdout);
    let Ok(report) = serde_json::from_str::<serde_json::Value>(&said) else {
        panic!("the rig failed: {}", String::from_utf8_lossy(&output.stderr));
    };
    let messages = report["messages"].as_array().unwrap();
    Outcome {
        status: report["status"].as_str().unwrap().to_owned(),
        messages: messages.iter().map(|message| message.as_str().unwrap().to_owned()).collect(),
        samples: Vec::new(),
    }
}

/// `   27 N..... STRAIGHT_FEED(10.0000, 5.0000, 20.0000, 10.0000, 0.0000, 45.0000)`
fn canonical_move(line: &str) -> Option<CanonicalMove> {
    let (call, arguments) = line.split_whitespace().nth(2).and_then(|_| line.split_once('('))?;
    let rapid = match call.split_whitespace().last()? {
        "STRAIGHT_TRAVERSE" => true,
        "STRAIGHT_FEED" => false,
        _ => return None,
    };
    let numbers = arguments.trim_end().trim_end_matches(')').split(',').map(|field| field.trim().parse().unwrap());
    let numbers: Vec<f64> = numbers.collect();
    Some(CanonicalMove { rapid, target: numbers.try_into().unwrap() })
}
