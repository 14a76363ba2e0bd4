//! How fast programs are written and read, a core: poses to text, text to commanded motion, for every dialect and form,
//! and beside them the interpreter of LinuxCNC on the same program, where it is installed. Run with
//! `cargo bench --bench nc`; items per second are poses and blocks.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a benchmark fails by panicking")]

use divan::Bencher;
use divan::counter::ItemsCount;
use regulus::feed::TimedMove;
use regulus::machine::{AxisMove, AxisPosition, Dialect, DialectOptions, FeedMode, Machine, OrientationWords, Setup};
use regulus::motion::{FeedReference, PassKind, ToolPath, ToolSummary};
use regulus::nc::{Rules, WriteRequest, read, write};
use std::fmt;

const POSES: usize = 20_000;

fn main() {
    divan::main();
}

/// A dialect with the form of its blocks.
#[derive(Clone, Copy)]
struct Form {
    dialect: Dialect,
    vectors: bool,
}

impl fmt::Display for Form {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.dialect.name(), if self.vectors { " vectors" } else { "" })
    }
}

fn forms() -> impl Iterator<Item = Form> {
    let angles = Dialect::ALL.into_iter().map(|(dialect, _)| Form { dialect, vectors: false });
    let with_vectors = [Dialect::Fanuc30i, Dialect::MazakSmooth, Dialect::Siemens840d, Dialect::HeidenhainTnc];
    angles.chain(with_vectors.map(|dialect| Form { dialect, vectors: true }))
}

/// What a program is made from.
struct Job {
    path: ToolPath,
    moves: Vec<TimedMove>,
    setup: Setup,
    tcp: bool,
}

impl Job {
    fn new(form: Form) -> Self {
        let mut machine = Machine::named("xyzac-trt").unwrap();
        let options = DialectOptions::of(form.dialect);
        let tcp = options.tcp_on.is_some();
        (machine.control.dialect, machine.control.options) = (form.dialect, options);
        if form.vectors {
            machine.control.options.orientation = OrientationWords::Vectors;
        }
        Self::on(&machine, tcp)
    }

    fn on(machine: &Machine, tcp: bool) -> Self {
        let setup = Setup::new(machine, "G54", 120.0).unwrap();
        let moves = (0..POSES).map(|k| timed(&setup, k)).collect();
        let tool =
            ToolSummary { number: 1, description: "cone D6.000".into(), gauge_length: 120.0, flute_length: 40.0 };
        let path = ToolPath {
            name: "benchmark".into(),
            tool,
            cut_feed: 600.0,
            feed_reference: FeedReference::Mid,
            spindle_rpm: 8000.0,
            linearization: 0.001,
            overcut_tolerance: 0.005,
            undercut_tolerance: 0.02,
            passes: Vec::new(),
        };
        Self { path, moves, setup, tcp }
    }

    fn text(&self) -> String {
        let work_offset = match self.setup.machine().control.dialect {
            Dialect::OkumaOsp => "G15 H1",
            _ => "G54",
        };
        let request = WriteRequest {
            path: &self.path,
            moves: &self.moves,
            setup: &self.setup,
            work_offset,
            tcp: self.tcp,
            input_hash: "0123456789abcdef",
            number: 1,
            modal: true,
        };
        write(&request).unwrap().text
    }
}

/// A smooth path on which every word changes in every block.
fn timed(setup: &Setup, k: usize) -> TimedMove {
    let t = k as f64 * 2e-3;
    let to = AxisPosition {
        linear: [80.0 * t.cos(), 80.0 * t.sin(), -100.0 + 10.0 * (3.0 * t).sin()],
        rotary: [0.7 + 0.1 * t.sin(), (t / 7.0).sin()],
    };
    let axes = AxisMove { to, pose: setup.forward(&to), kind: PassKind::Cut, pass: 0, asked: None };
    TimedMove { axes, duration: 0.016, tip_length: 0.16 }
}

#[divan::bench(args = forms())]
fn poses_to_text(bencher: Bencher<'_, '_>, form: &Form) {
    let job = Job::new(*form);
    bencher.counter(ItemsCount::new(POSES)).bench(|| job.text());
}

#[divan::bench(args = forms())]
fn text_to_motion(bencher: Bencher<'_, '_>, form: &Form) {
    let job = Job::new(*form);
    let (text, rules) = (job.text(), Rules::of(job.setup.machine()));
    let program = read(text.as_bytes(), &rules);
    assert!(program.findings.list().is_empty(), "{:?}", program.findings.list());
    bencher.counter(ItemsCount::new(program.blocks)).bench(|| read(text.as_bytes(), &rules));
}

/// The same program, in joint coordinates, through our reader and through LinuxCNC's.
mod beside_linuxcnc {
    use super::*;
    use std::fs;
    use std::process::{Command, Stdio};

    fn joint_program() -> (String, Rules) {
        let mut machine = Machine::named("xyzac-trt").unwrap();
        let options = &mut machine.control.options;
        (options.tcp_on, options.tcp_off, options.tcp_at_start) = (None, None, false);
        options.feed_mode = FeedMode::InverseTime;
        let job = Job::on(&machine, false);
        (job.text(), Rules::of(&machine))
    }

    #[divan::bench]
    fn regulus(bencher: Bencher<'_, '_>) {
        let (text, rules) = joint_program();
        let blocks = read(text.as_bytes(), &rules).blocks;
        bencher.counter(ItemsCount::new(blocks)).bench(|| read(text.as_bytes(), &rules));
    }

    #[divan::bench(sample_count = 5, sample_size = 1)]
    fn rs274(bencher: Bencher<'_, '_>) {
        let (text, rules) = joint_program();
        let blocks = read(text.as_bytes(), &rules).blocks;
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("program.ngc"), text).unwrap();
        fs::write(folder.path().join("tool.tbl"), "T1 P1 Z120 D6\n").unwrap();
        let run = || {
            let mut command = Command::new("rs274");
            command.args(["-g", "-n", "2", "-t", "tool.tbl", "-v", "machine.var", "program.ngc"]);
            command.current_dir(&folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).status()
        };
        if run().is_err() {
            divan::black_box("rs274 is not installed: nothing to compare with");
            return;
        }
        bencher.counter(ItemsCount::new(blocks)).bench(run);
    }
}
