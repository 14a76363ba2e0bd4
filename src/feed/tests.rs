//! Durations against closed forms and against the limits they must keep.

use super::block::FASTEST_FLANK;
use super::*;
use crate::geometry::{Point, Vector};
use crate::machine::Machine;
use crate::machine::path_tests::{pass, path, ruled, setup, solve, through_the_pole, tilted};
use crate::motion::{FeedReference, PassMotion, Pose};

fn timed(path: &ToolPath, setup: &Setup, tcp: bool) -> Vec<TimedMove> {
    let solved = solve(path, setup, tcp);
    Schedule::new(path, setup, tcp, &solved.moves).moves().to_vec()
}

fn seconds(moves: &[TimedMove]) -> Vec<Option<f64>> {
    moves.iter().map(|step| Some(step.duration).filter(|_| !step.axes.kind.is_rapid())).collect()
}

/// A machine so brisk that nothing is lost at the ends of a run.
fn brisk(name: &str) -> Setup {
    let mut machine = Machine::named(name).unwrap();
    machine.linear.iter_mut().for_each(|axis| axis.acceleration = 1e9);
    machine.rotary.iter_mut().for_each(|axis| axis.acceleration = 1e9);
    Setup::new(&machine, "G54", 100.0).unwrap()
}

fn total(moves: &[TimedMove]) -> f64 {
    moves.iter().map(|m| m.duration).sum()
}

#[test]
fn straight_cut_takes_length_over_feed() {
    let at = |x: f64| Pose { tip: Point::new(x, 0.0, 10.0), axis: Vector::z_axis() };
    let path = path(vec![pass(PassKind::Cut, PassMotion::Poses(vec![at(0.0), at(30.0), at(90.0)]))]);
    for tcp in [true, false] {
        let moves = timed(&path, &setup("bridgemill"), tcp);
        assert!((total(&moves) - 9.0).abs() < 1e-9, "{}", total(&moves));
        assert!((moves.iter().map(|m| m.tip_length).sum::<f64>() - 90.0).abs() < 1e-9);
    }
}

#[test]
fn reference_decides_what_the_feed_is_the_speed_of() {
    // The tool pivots about the point of its axis at height 10 while that point stands still.
    let pose = |t: f64| {
        let axis = tilted(0.2 + 0.3 * t, 0.5);
        Pose { tip: Point::new(50.0, 0.0, 10.0) - axis.into_inner() * 10.0, axis }
    };
    let mut path = path(vec![pass(PassKind::Cut, ruled(pose, 12))]);
    let arc = |radius: f64| radius * 0.3;
    let cases = [
        (FeedReference::Tip, arc(10.0)),
        (FeedReference::Mid, arc(10.0)),
        (FeedReference::Top, arc(30.0)),
        (FeedReference::Fastest, arc(30.0)),
        // |h - 10| by Simpson's rule over heights 0, 20 and 40.
        (FeedReference::Mean, arc((10.0 + 40.0 + 30.0) / 6.0)),
    ];
    for (reference, length) in cases {
        path.feed_reference = reference;
        let time = total(&timed(&path, &brisk("xyzac-trt"), true));
        assert!((time / (length / 10.0) - 1.0).abs() < 1e-3, "{reference:?} {time}");
    }
}

#[test]
fn tool_that_pivots_about_its_reference_is_still_held_back() {
    let pose = |t: f64| Pose { tip: Point::new(50.0, 0.0, 10.0), axis: tilted(0.2 + 0.3 * t, 0.5) };
    let mut path = path(vec![pass(PassKind::Cut, ruled(pose, 12))]);
    path.feed_reference = FeedReference::Tip;
    let time = total(&timed(&path, &brisk("xyzac-trt"), true));
    assert!((time / (40.0 * 0.3 / (10.0 * FASTEST_FLANK)) - 1.0).abs() < 0.05, "{time}");
}

#[test]
fn rapid_runs_from_rest_to_rest() {
    // 500 mm/s, 5000 mm/s^2: 200 mm take 0.4 s and a ramp of 0.1 s; 20 mm are all ramp.
    let at = |x: f64| Pose { tip: Point::new(x, 0.0, 10.0), axis: Vector::z_axis() };
    for (way, time) in [(200.0, 0.5), (20.0, 2.0 * (20.0f64 / 5000.0).sqrt())] {
        let path = path(vec![pass(PassKind::Rapid, PassMotion::Poses(vec![at(0.0), at(way)]))]);
        let setup = setup("bridgemill");
        let moves = [at(0.0), at(way)].map(|pose| AxisMove {
            to: setup.with_rotary(&pose.tip, [0.0; 2]),
            pose,
            kind: PassKind::Rapid,
            pass: 0,
            asked: None,
        });
        let moves = Schedule::new(&path, &setup, true, &moves).moves().to_vec();
        assert!((moves[1].duration - time).abs() < 1e-9, "{}", moves[1].duration);
    }
}

/// Near the pole the table must turn half round while the tool hardly moves; corners and fast feeds load the linear axes.
#[test]
fn axis_limits_are_kept_after_rounding_of_the_feed_word() {
    let corner = {
        let at = |x: f64, y: f64| Pose { tip: Point::new(x, y, 10.0), axis: tilted(0.3, x + y) };
        let poses = vec![at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0), at(0.0, 0.0)];
        path(vec![pass(PassKind::Cut, PassMotion::Poses(poses))])
    };
    for mut path in [through_the_pole(1e-3), through_the_pole(0.02), corner] {
        for feed in [600.0, 60_000.0] {
            path.cut_feed = feed;
            for name in ["xyzac-trt", "xyzbc-trt", "bridgemill", "head-b-table-c"] {
                for tcp in [true, false] {
                    let setup = setup(name);
                    let moves = timed(&path, &setup, tcp);
                    let exact = seconds(&moves);
                    assert_eq!(excesses(&moves, &exact, setup.machine()), [], "{name} {feed} {tcp}");
                    let rounded = |seconds: f64| 60.0 / crate::machine::round_to(60.0 / seconds, 3);
                    let rounded: Vec<_> = exact.into_iter().map(|seconds| seconds.map(rounded)).collect();
                    assert_eq!(excesses(&moves, &rounded, setup.machine()), [], "{name} {feed} {tcp} rounded");
                }
            }
        }
    }
}

#[test]
fn too_short_durations_are_found() {
    let setup = setup("xyzac-trt");
    let mut moves = timed(&through_the_pole(0.02), &setup, true);
    let middle = moves.len() / 2;
    moves[middle].duration /= 1000.0;
    let found = excesses(&moves, &seconds(&moves), setup.machine());
    assert!(found.iter().any(|e| e.index == middle && e.kind == ExcessKind::Speed && e.value > e.limit));
    assert!(found.iter().any(|e| e.kind == ExcessKind::Acceleration));
}

#[test]
fn losses_say_which_axis_holds_the_feed_back() {
    let mut path = through_the_pole(0.02);
    path.cut_feed = 6000.0;
    let setup = setup("xyzac-trt");
    let solved = solve(&path, &setup, true);
    let schedule = Schedule::new(&path, &setup, true, &solved.moves);
    let losses = schedule.losses();
    assert!(matches!(losses[0].limiter, Limiter::Axis('C', _)), "{losses:?}");
    // What is lost comes on top of what the feed asks for.
    let patient = Schedule::new(&path, &brisk("xyzac-trt"), true, &solved.moves);
    let lost: f64 = losses.iter().map(|loss| loss.seconds).sum();
    let more = schedule.total() - patient.total();
    assert!(lost >= more - 1e-9 && more > 0.0, "{lost} {more}");
    assert_eq!(schedule.limiters().len() + 1, schedule.moves().len());
    // At a feed that every axis can follow nothing is lost but a ramp at each end.
    path.cut_feed = 1.0;
    let slow = Schedule::new(&path, &setup, true, &solved.moves);
    assert!(slow.limiters().iter().all(|limiter| *limiter == Limiter::Feed), "{:?}", slow.losses());
}

#[test]
fn blocks_that_the_control_slows_brake_their_neighbours() {
    let mut path = through_the_pole(0.02);
    path.cut_feed = 30_000.0;
    let setup = setup("xyzac-trt");
    let solved = solve(&path, &setup, true);
    let mut schedule = Schedule::new(&path, &setup, true, &solved.moves);
    let middle = schedule.moves().len() / 2;
    let mut slowed = seconds(schedule.moves());
    slowed[middle] = slowed[middle].map(|seconds| seconds * 2.0);
    assert!(!excesses(schedule.moves(), &slowed, setup.machine()).is_empty());
    schedule.slow_to(&slowed);
    let after = seconds(schedule.moves());
    assert_eq!(excesses(schedule.moves(), &after, setup.machine()), []);
    assert!(after[middle] >= slowed[middle]);
    assert_eq!(schedule.limiters()[middle - 1], Limiter::Word);
}
