//! How many poses a second the kinematics solves, on one core: `cargo bench --bench kinematics`.

use divan::Bencher;
use divan::counter::ItemsCount;
use regulus::geometry::{Direction, Point, Vector};
use regulus::machine::{AxisPosition, Machine, Setup, axis_positions};
use regulus::motion::{FeedReference, Pass, PassKind, PassMotion, Pose, ToolPath, ToolSummary};

/// Poses of a run.
const POSES: usize = 100_000;
/// Table-table, head-table, head-head, nutating table, nutating head.
const MACHINES: [&str; 5] = ["xyzac-trt", "head-b-table-c", "bridgemill", "dmg-dmu50-evolution", "tr-35"];

fn main() {
    divan::main();
}

fn setup(name: &str) -> Setup {
    let machine = Machine::named(name).unwrap_or_else(|e| unreachable!("{e}"));
    let offset = machine.control.work_offsets.first().map_or([0.0; 3], |offset| offset.linear);
    Setup::at(&machine, offset, 120.0).unwrap_or_else(|e| unreachable!("{e}"))
}

/// Poses along a way that tilts and turns, 0.01 mm apart.
fn poses() -> Vec<Pose> {
    let pose = |index: usize| {
        let way = index as f64 / POSES as f64;
        let (tilt, azimuth) = (0.5 + 0.3 * (20.0 * way).sin(), 40.0 * way);
        let axis = Vector::new(tilt.sin() * azimuth.cos(), tilt.sin() * azimuth.sin(), tilt.cos());
        let tip = Point::new(100.0 * azimuth.cos(), 100.0 * azimuth.sin(), 50.0 - 20.0 * way);
        Pose { tip, axis: Direction::new_normalize(axis) }
    };
    (0..POSES).map(pose).collect()
}

/// Both branches of the inverse kinematics of every pose.
#[divan::bench(args = MACHINES)]
fn inverse(bencher: Bencher<'_, '_>, name: &str) {
    let (setup, poses) = (setup(name), poses());
    bencher.counter(ItemsCount::new(POSES)).bench(|| {
        let sum = |sum: f64, pose: &Pose| {
            setup
                .inverse(pose)
                .map_or(sum, |solutions| sum + solutions.branches[0].linear[0] + solutions.branches[1].rotary[1])
        };
        poses.iter().fold(0.0, sum)
    });
}

/// A whole path, branch and turns chosen over all of it.
#[divan::bench(args = MACHINES)]
fn whole_path(bencher: Bencher<'_, '_>, name: &str) {
    let setup = setup(name);
    let pass = Pass { kind: PassKind::Cut, strip: Some(0), motion: PassMotion::Poses(poses()) };
    let path = ToolPath {
        name: "bench".into(),
        tool: ToolSummary { number: 1, description: "bench".into(), gauge_length: 120.0, flute_length: 40.0 },
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.001,
        overcut_tolerance: 0.005,
        undercut_tolerance: 0.02,
        passes: vec![pass],
    };
    bencher
        .counter(ItemsCount::new(POSES))
        .bench(|| axis_positions(&path, &setup).map(|(positions, _)| positions.len()));
}

/// The pose of every axis position.
#[divan::bench(args = MACHINES)]
fn forward(bencher: Bencher<'_, '_>, name: &str) {
    let setup = setup(name);
    let axes: Vec<AxisPosition> = poses().iter().filter_map(|pose| setup.inverse_near(pose, [0.0; 2])).collect();
    bencher
        .counter(ItemsCount::new(axes.len()))
        .bench(|| axes.iter().map(|axes| setup.forward(axes).tip.x).sum::<f64>());
}
