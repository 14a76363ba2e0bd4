//! How long it takes to time a path, by its number of blocks: without and with jerk limits.

use divan::{Bencher, counter::ItemsCount};
use regulus::feed::Schedule;
use regulus::geometry::{Direction, Point, Vector};
use regulus::machine::{AxisMove, Machine, Setup};
use regulus::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, ToolPath, ToolSummary};

fn main() {
    divan::main();
}

/// Waves that load every axis, at a feed that none of them can follow everywhere.
fn pose(t: f64) -> Pose {
    let wave = |rate: f64| (t * rate).sin();
    let tip = Point::new(100.0 * wave(0.01), 100.0 * wave(0.0137), 10.0 * wave(0.05));
    let axis = Vector::new(0.3 + 0.2 * wave(0.023), 0.2 * wave(0.031), 1.0);
    Pose { tip, axis: Direction::new_normalize(axis) }
}

fn moves(setup: &Setup, count: usize) -> Vec<AxisMove> {
    let mut near = [0.0; 2];
    let step = |i| {
        let pose = pose(i as f64 * 0.1);
        let to = setup.inverse_near(&pose, near).unwrap_or_default();
        near = to.rotary;
        AxisMove { to, pose, kind: PassKind::Cut, pass: 0, asked: None }
    };
    (0..=count).map(step).collect()
}

fn schedule(bencher: Bencher<'_, '_>, count: usize, jerk: Option<f64>) {
    let Ok(mut machine) = Machine::named("trunnion-ac-30i") else { return };
    machine.linear.iter_mut().for_each(|axis| axis.jerk = jerk.map(|jerk| axis.acceleration * jerk));
    machine.rotary.iter_mut().for_each(|axis| axis.jerk = jerk.map(|jerk| axis.acceleration * jerk));
    let Ok(setup) = Setup::at(&machine, [0.0; 3], 100.0) else { return };
    let moves = moves(&setup, count);
    let tool = ToolSummary { number: 1, description: "bench".into(), gauge_length: 100.0, flute_length: 40.0 };
    let path = ToolPath {
        name: "bench".into(),
        tool,
        cut_feed: 20_000.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.01,
        undercut_tolerance: 0.01,
        passes: vec![Pass { kind: PassKind::Cut, strip: None, motion: PassMotion::Poses(Vec::new()) }],
    };
    let bencher = bencher.counter(ItemsCount::new(count));
    bencher.bench_local(|| Schedule::new(&path, &setup, true, &moves).total());
}

const COUNTS: [usize; 3] = [10_000, 100_000, 1_000_000];

#[divan::bench(args = COUNTS, sample_count = 3, sample_size = 1)]
fn speed_and_acceleration(bencher: Bencher<'_, '_>, count: usize) {
    schedule(bencher, count, None);
}

#[divan::bench(args = COUNTS, sample_count = 3, sample_size = 1)]
fn with_jerk(bencher: Bencher<'_, '_>, count: usize) {
    schedule(bencher, count, Some(20.0));
}
