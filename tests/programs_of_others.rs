//! Programs and tool paths that others wrote and that this repository does not hold: read whole, and carried to other
//! kinematics and controls and back. Left out, loudly, unless the environment variable `REGULUS_FOREIGN_PROGRAMS` names the
//! folder that holds them.

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a test says what it measures and fails by panicking"
)]

use regulus::machine::{Dialect, DialectOptions, Machine};
use regulus::motion::apt;
use regulus::pipeline::{InputFile, RetargetGoal, RetargetRequest, Retargeted, Source, diff, recover, retarget};
use std::path::PathBuf;

/// What may be lost on the way to another machine and back, mm.
const TOLERANCE: f64 = 0.001;
/// Height up to which the flank is compared, mm.
const FLANK: f64 = 40.0;
/// Tip to gauge line: what the controls without TCP need to know, mm.
const LENGTH: f64 = 100.0;

/// A file of the folder; `None`, said loudly, where there is no folder.
fn foreign(name: &str) -> Option<Vec<u8>> {
    let Some(folder) = std::env::var_os("REGULUS_FOREIGN_PROGRAMS") else {
        eprintln!("LEFT OUT: {name}; REGULUS_FOREIGN_PROGRAMS names no folder with programs of others");
        return None;
    };
    let path = PathBuf::from(folder).join(name);
    Some(std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
}

fn request<'a>(name: &'a str, bytes: &'a [u8], machine: &'a Machine) -> RetargetRequest<'a> {
    RetargetRequest {
        source: Source {
            program: InputFile { name, bytes },
            machine,
            work_offset: None,
            gauge_length: LENGTH,
            despite_unknown_text: false,
        },
        knows_length: true,
        tolerance: TOLERANCE / 2.0,
        height: FLANK,
        tool: None,
        spindle: None,
    }
}

fn moved(request: &RetargetRequest<'_>, to: &Machine) -> Retargeted {
    let goal = RetargetGoal { machine: to, work_offset: &to.control.work_offsets[0].name, number: 1, input_hash: "0" };
    let recovered = recover(request).unwrap_or_else(|e| panic!("{}: {e:?}", request.source.machine.name));
    retarget(request, &recovered, &goal).unwrap_or_else(|e| panic!("{}: {e:?}", to.name))
}

/// A machine that comes along with another control, whose options are the careful ones.
fn machine(name: &str, dialect: Dialect) -> Machine {
    let mut machine = Machine::named(name).expect("a machine that comes along");
    if machine.control.dialect != dialect {
        let mut options = DialectOptions::of(dialect);
        // Where the tip is said by five decimals, so is it here: four lose what is asked for without TCP.
        options.linear_digits = options.linear_digits.max(5);
        options.rotary_digits = options.rotary_digits.max(5);
        machine.control.tcp = options.tcp_on.is_some();
        (machine.control.dialect, machine.control.options) = (dialect, options);
        if dialect == Dialect::OkumaOsp {
            // There G54 begins a tool length offset.
            machine.control.work_offsets[0].name = "G15 H1".to_owned();
        }
    }
    machine
}

#[test]
fn an_impeller_goes_to_every_kinematics_and_control_and_back() {
    let file = "linuxcnc_impeller-7bl-xyzac.ngc";
    let Some(bytes) = foreign(file) else { return };
    let first = Machine::named("xyzac-trt").expect("a machine that comes along");
    let home = request(file, &bytes, &first);
    // Table-table, head-table and head-head.
    for name in ["xyzbc-trt", "head-b-table-c", "bridgemill"] {
        for (dialect, said) in Dialect::ALL {
            let other = machine(name, dialect);
            let there = moved(&home, &other);
            let back = moved(&request("there", there.posted.text.as_bytes(), &other), &first);
            let returned = request("back", back.posted.text.as_bytes(), &first);
            let round = diff(&home.source, &returned.source, FLANK).expect("two programs").difference;
            let [out, home_again] = [&there.difference.feed, &round.feed];
            println!(
                "{name} {said}: there tip {:.6} flank {:.6} time {:.3} s, and back tip {:.6} flank {:.6}; {} moves",
                out.tip_mm.value,
                out.flank_mm.value,
                out.time_s.value,
                home_again.tip_mm.value,
                home_again.flank_mm.value,
                there.posted.moves
            );
            for found in [&there.difference, &back.difference, &round] {
                let apart = found.feed.tip_mm.value.max(found.feed.flank_mm.value);
                assert!(apart <= TOLERANCE, "{name} {said}: {found:?}");
            }
        }
    }
}

#[test]
fn tool_paths_of_others_are_read_whole() {
    if let Some(bytes) = foreign("ncl_pmill_test1_4.as") {
        let file = apt::read(&String::from_utf8_lossy(&bytes), 0.001);
        assert!(file.unread.iter().all(|unread| unread.harmless), "{:?}", file.unread);
        let legs: usize = file.operations.iter().map(|operation| operation.legs.len()).sum();
        // Every GOTO but the first leads somewhere, or stays where the one before was.
        assert!(legs > 3600 && file.lines == 3794, "{legs} {}", file.lines);
    }
    if let Some(bytes) = foreign("amorim_tilt-support1_tilted_axis.apt") {
        let file = apt::read(&String::from_utf8_lossy(&bytes), 0.001);
        let tools: Vec<_> = file.operations.iter().map(|operation| operation.tool).collect();
        assert_eq!(tools, [Some(4), Some(6), Some(16)]);
        let doubtful: Vec<_> =
            file.unread.iter().filter(|unread| !unread.harmless).map(|unread| &unread.word[..]).collect();
        // Words of the vendor's own, and a cycle that pecks.
        assert!(doubtful.iter().all(|word| word.starts_with("CSI_") || *word == "CYCLE"), "{doubtful:?}");
        assert_eq!(file.operations[0].spindle, Some(10156.0));
    }
}
