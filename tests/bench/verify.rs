//! How fast a program is verified: text to verdict, and the verdict alone, for a ball cutter in rows over a plane with a
//! tilting axis. Run with `cargo bench --bench verify`; the large case by `-- --ignored million`, time
//! against blocks and against points by `-- --ignored against`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a benchmark fails by panicking")]

use divan::Bencher;
use divan::counter::ItemsCount;
use regulus::machine::{Machine, Setup};
use regulus::nc::{Program, Rules, read};
use regulus::part::{Part, ReadOptions};
use regulus::simulate::{ToolMotion, simulate};
use regulus::tool::{CutterShape, Fixture, Tool};
use regulus::verify::{Settings, Subject, ToleranceRecord, verify};
use std::fmt::Write;

/// Size of the plane, mm.
const SIZE: [f64; 2] = [100.0, 50.0];
const GAUGE_LENGTH: f64 = 90.0;

fn main() {
    divan::main();
}

/// Rows along x over the plane; the axis tilts and turns all along.
fn program(blocks: usize) -> String {
    let mut text = String::from("G21 G90 G61 G54\nT1 M6\nS8000 M3\nG43 H1\nM428\nG0 X0 Y0 Z50 A0 C0\nG1 F2000\n");
    // As many rows as keep steps and pitch alike in proportion.
    let rows = (blocks as f64 / 2.0).sqrt().ceil().max(50.0);
    let each = (blocks as f64 / rows).ceil();
    for row in 0..rows as usize {
        for step in 0..each as usize {
            let share = step as f64 / (each - 1.0);
            let share = if row % 2 == 0 { share } else { 1.0 - share };
            let (x, y) = (SIZE[0] * share, SIZE[1] * row as f64 / (rows - 1.0));
            let (a, c) = (10.0 + 3.0 * (6.0 * share).sin(), 5.0 * (4.0 * share).cos());
            // A ball keeps its height only with its centre at rest: the tip sinks by r (1 - cos a).
            let tilt = a.to_radians();
            let z = 3.0 * (1.0 - tilt.cos());
            let (azimuth, lever) = (c.to_radians(), 3.0 * tilt.sin());
            let (dx, dy) = (-lever * azimuth.sin(), lever * azimuth.cos());
            // Writing to a string cannot fail.
            let _ = writeln!(text, "X{:.4} Y{:.4} Z{z:.4} A{a:.4} C{c:.4}", x + dx, y + dy);
        }
    }
    text + "G0 Z50\nM429\nM30\n"
}

struct Case {
    text: String,
    machine: Machine,
    setup: Setup,
    tool: Tool,
    part: Part,
    settings: Settings,
}

impl Case {
    fn new(blocks: usize, points: usize) -> Self {
        let machine = Machine::named("xyzac-trt").unwrap();
        let offset = &machine.control.work_offsets[0].name;
        let setup = Setup::new(&machine, offset, GAUGE_LENGTH).unwrap();
        let shape = CutterShape::Cylinder { diameter: 6.0, corner_radius: 3.0, flute_length: 20.0 };
        let tool = Tool::new(1, &shape, &Fixture { gauge_length: GAUGE_LENGTH, ..Fixture::default() }).unwrap();
        let [x, y] = SIZE;
        let json = format!(
            r#"{{"format": "regulus-bspline", "version": 1, "units": "mm", "degree": [1, 1], "knots_u": [0, 0, 1, 1],
            "knots_v": [0, 0, 1, 1], "flip": false, "control": [[[0, 0, 0], [0, {y}, 0]], [[{x}, 0, 0], [{x}, {y}, 0]]]}}"#
        );
        let surface = regulus::part::read(json.as_bytes(), "plane.json", &ReadOptions::default()).unwrap();
        let part = Part { name: "plane".into(), surface, body: None, check: Vec::new() };
        let settings = Settings { spacing: Some((x * y / points as f64).sqrt()), ..Settings::default() };
        Self { text: program(blocks), machine, setup, tool, part, settings }
    }

    fn motion(&self) -> (Program, ToolMotion) {
        let read = read(self.text.as_bytes(), &Rules::of(&self.machine));
        let motion = simulate(&read, &self.setup, Some(1.into()));
        (read, motion)
    }

    fn verify(&self, program: &Program, motion: &ToolMotion) -> usize {
        let tolerance = ToleranceRecord { overcut: 0.05, undercut: 0.1 };
        let subject = Subject { program, motion, tool: &self.tool, part: &self.part, tolerance, path: None };
        verify(&subject, &self.settings).record.deviation.samples
    }
}

/// 20,000 blocks against 50,000 points.
#[divan::bench(sample_count = 5)]
fn verdict(bencher: Bencher<'_, '_>) {
    let case = Case::new(20_000, 50_000);
    let (program, motion) = case.motion();
    bencher.counter(ItemsCount::new(20_000_usize)).bench_local(|| case.verify(&program, &motion));
}

/// The same from the text on.
#[divan::bench(sample_count = 5)]
fn text_to_verdict(bencher: Bencher<'_, '_>) {
    let case = Case::new(20_000, 50_000);
    bencher.counter(ItemsCount::new(20_000_usize)).bench_local(|| {
        let (program, motion) = case.motion();
        case.verify(&program, &motion)
    });
}

/// Sizes over which the time is followed, and what the other size stays at.
const SIZES: [usize; 5] = [1_000, 4_000, 16_000, 64_000, 256_000];
const FIXED: usize = 16_000;

/// The verdict alone, for more and more blocks.
#[divan::bench(args = SIZES, sample_count = 1, sample_size = 1, ignore)]
fn against_blocks(bencher: Bencher<'_, '_>, blocks: usize) {
    let case = Case::new(blocks, FIXED);
    let (program, motion) = case.motion();
    bencher.counter(ItemsCount::new(blocks)).bench_local(|| case.verify(&program, &motion));
}

/// The verdict alone, for more and more points.
#[divan::bench(args = SIZES, sample_count = 1, sample_size = 1, ignore)]
fn against_points(bencher: Bencher<'_, '_>, points: usize) {
    let case = Case::new(FIXED, points);
    let (program, motion) = case.motion();
    bencher.counter(ItemsCount::new(points)).bench_local(|| case.verify(&program, &motion));
}

/// 1,000,000 blocks against 1,000,000 points, once; takes its time, so only when it is asked for.
#[divan::bench(sample_count = 1, sample_size = 1, ignore)]
fn million(bencher: Bencher<'_, '_>) {
    let case = Case::new(1_000_000, 1_000_000);
    bencher.counter(ItemsCount::new(1_000_000_usize)).bench_local(|| {
        let (program, motion) = case.motion();
        case.verify(&program, &motion)
    });
}
