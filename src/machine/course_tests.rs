//! Near the pole: what sliding rulings gains, and that the flank stays where it was.

use super::path_tests::{pass, path, ruled, solve, through_the_pole};
use super::*;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::{PassKind, Pose, ToolPath};

/// Tilts across its way, missing the pole by `miss` radians along its way.
fn across(miss: f64) -> ToolPath {
    let pose = move |t: f64| {
        let angle = (t - 0.5) * 0.6;
        let axis = Vector::new(angle.sin(), miss.sin(), angle.cos());
        Pose { tip: Point::new(10.0, 100.0 * t - 50.0, 5.0), axis: Direction::new_normalize(axis) }
    };
    path(vec![pass(PassKind::Cut, ruled(pose, 24))])
}

/// A machine whose C axis turns by a radian a second at most.
fn slow_c(name: &str) -> Setup {
    let mut machine = Machine::named(name).unwrap();
    machine.rotary[1].speed = 1.0;
    Setup::new(&machine, "G54", 100.0).unwrap()
}

/// The way of C, and the least time that a feed of 10 mm/s at mid flute and C's top speed leave for the blocks, s.
fn effort(setup: &Setup, moves: &[AxisMove]) -> (f64, f64) {
    let turned = |pair: &[AxisMove]| (pair[1].to.rotary[1] - pair[0].to.rotary[1]).abs();
    let way = |pair: &[AxisMove]| (pair[1].pose.at_height(20.0) - pair[0].pose.at_height(20.0)).norm();
    let speed = setup.machine().rotary[1].speed;
    let time = |pair: &[AxisMove]| (way(pair) / 10.0).max(turned(pair) / speed);
    (moves.windows(2).map(turned).sum(), moves.windows(2).map(time).sum())
}

/// Largest distance of moving axis points from the way that the points of their height take in the pass, by brute force.
fn off_surface(setup: &Setup, path: &ToolPath, moves: &[AxisMove]) -> f64 {
    const STEPS: usize = 40_000;
    let heights = [0.0, 10.0, 20.0, 30.0, 40.0];
    let motion = &path.passes[0].motion;
    let poses: Vec<Pose> = (0..=STEPS).map(|i| motion.pose(i as f64 / STEPS as f64).unwrap()).collect();
    let mut worst: f64 = 0.0;
    for pair in moves.windows(2) {
        let segment = setup.segment(&pair[0].to, &pair[1].to, setup.interpolation(true));
        for pose in (0..=8).map(|i| segment.pose(f64::from(i) / 8.0)) {
            for height in heights {
                let point = pose.at_height(height);
                // All goes along Y at an even pace, so the nearest place is not far.
                let guess = ((point.y + 50.0) / 100.0 * STEPS as f64) as usize;
                let near = guess.saturating_sub(800)..(guess + 800).min(STEPS);
                let chord = |k: usize| {
                    let (a, b) = (poses[k].at_height(height), poses[k + 1].at_height(height));
                    let share = ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
                    (point - (a + (b - a) * share)).norm()
                };
                worst = worst.max(near.map(chord).fold(f64::INFINITY, f64::min));
            }
        }
    }
    worst
}

#[test]
fn tangency_leads_through_the_pole_instead_of_around_it() {
    for name in ["xyzac-trt", "bridgemill", "head-b-table-c"] {
        let setup = slow_c(name);
        // The twist of 0.006 rad/mm lifts the middle by 0.042 mm a degree, half of which is taken back.
        for (miss, linearization) in [(0.02_f64, 0.001), (0.1, 0.005)] {
            let path = ToolPath { linearization, ..across(miss.to_radians()) };
            let solved = solve(&path, &setup, true);
            let off = off_surface(&setup, &path, &solved.moves);
            assert!(off <= path.linearization && solved.deviation <= path.linearization, "{name} {miss}: {off}");
            let (turned, time) = effort(&setup, &solved.moves);
            // Around the pole C turns by nearly half a turn; through it, by what the bend of the way takes.
            assert!(turned.to_degrees() < 60.0, "{name} {miss}: {} degrees", turned.to_degrees());
            assert!(time < 1.05 * 10.0, "{name} {miss}: {time} s for what the feed does in 10 s");
        }
    }
}

#[test]
fn nothing_slides_where_it_would_not_help() {
    // Along the way of the tool the axis misses the pole sideways: no turn about the contact normal leads there.
    let setup = slow_c("xyzac-trt");
    let path = through_the_pole(0.1_f64.to_radians());
    let solved = solve(&path, &setup, true);
    assert!(solved.deviation <= path.linearization);
    assert!(effort(&setup, &solved.moves).0.to_degrees() > 150.0);
    for step in &solved.moves {
        // The pass itself is followed, at its own places.
        let t = (step.pose.tip.x + 50.0) / 100.0;
        let nearest = (0..=200).map(|k| path.passes[0].motion.pose(t + f64::from(k - 100) * 1e-5).unwrap());
        let off = nearest.map(|pose| pose.distance_along(&step.pose, 40.0)).fold(f64::INFINITY, f64::min);
        assert!(off < 1.5e-3, "{off} mm");
    }
    // Nor where it would cost more than the allowance.
    let path = across(0.1_f64.to_radians());
    let solved = solve(&path, &setup, true);
    assert!(solved.deviation <= path.linearization && effort(&setup, &solved.moves).0.to_degrees() > 150.0);
    // Five degrees away C is fast enough.
    let path = across(5_f64.to_radians());
    let plain = Setup::new(&Machine::named("xyzac-trt").unwrap(), "G54", 100.0).unwrap();
    assert!(effort(&plain, &solve(&path, &plain, true).moves).0.to_degrees() > 90.0);
}
