//! How fast a tool is taken from the stock: 60 x 20 x 40 mm in cells of 0.1 mm (440,000 lines), a cylinder of 20 mm tilted
//! by 20 degrees, 90 moves; shifted only, and turning on every move. Run with `cargo bench --bench stock`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a benchmark fails by panicking")]
#![allow(clippy::print_stdout, reason = "a benchmark talks to the terminal")]

use divan::Bencher;
use regulus::geometry::{Direction, Point, Vector};
use regulus::motion::Pose;
use regulus::stock::{Blank, Moves, Stock};
use regulus::tool::{CutterShape, Fixture, Tool};

fn main() {
    divan::main();
}

/// Rows along x, three moves each, 1 mm apart, layer by layer; on one of them the tool dips 0.05 mm below the last layer.
/// `turn` is added to the tilt along a row, degrees.
fn moves(turn: f64) -> Moves {
    let mut poses = Vec::new();
    for row in 0..30 {
        let y = f64::from(row % 10) * 2.0 + 1.0;
        let z = 36.0 - 2.0 * f64::from(row / 10);
        for k in 0..3 {
            let share = f64::from(if row % 2 == 0 { k } else { 2 - k }) / 2.0;
            let tilt = (20.0 + turn * share).to_radians();
            let dip = if row == 25 && k == 1 { 0.05 } else { 0.0 };
            let axis = Direction::new_normalize(Vector::new(tilt.sin(), 0.0, tilt.cos()));
            poses.push(Pose { tip: Point::new(60.0 * share, y, z - dip), axis });
        }
    }
    poses.push(Pose { tip: Point::new(60.0, 19.0, 60.0), ..poses[poses.len() - 1] });
    Moves::through(&poses, 10.0)
}

fn stock() -> Stock {
    Stock::new(&Blank::Box { min: Point::origin(), max: Point::new(60.0, 20.0, 40.0) }, 0.1).unwrap()
}

fn tool(corner_radius: f64) -> Tool {
    let shape = CutterShape::Cylinder { diameter: 20.0, corner_radius, flute_length: 50.0 };
    Tool::new(1, &shape, &Fixture { gauge_length: 80.0, ..Fixture::default() }).unwrap()
}

#[divan::bench(sample_count = 5)]
fn lay_lines() -> Stock {
    stock()
}

#[divan::bench(args = [0.0, 10.0], sample_count = 5)]
fn cut_90_moves(bencher: Bencher<'_, '_>, corner: f64) {
    let (tool, moves) = (tool(corner), moves(0.0));
    bencher.with_inputs(stock).bench_local_values(|mut stock| {
        let cut = stock.cut(&moves, &tool);
        assert_eq!(cut.removals.len(), 90);
        (stock, cut)
    });
    if corner == 0.0 {
        report(&tool, &moves);
    }
}

/// A degree a move: the stretches are as a program would have them.
#[divan::bench(sample_count = 3)]
fn cut_90_turning_moves(bencher: Bencher<'_, '_>) {
    let (tool, moves) = (tool(0.0), moves(0.5));
    bencher.with_inputs(stock).bench_local_values(|mut stock| (stock.cut(&moves, &tool), stock));
}

/// The gouge as the lines show it.
fn report(tool: &Tool, moves: &Moves) {
    let mut stock = stock();
    stock.cut(moves, tool);
    let floor = 32.0 - 10.0 * 20.0_f64.to_radians().sin();
    let ends = stock.ends().filter(|(_, normal)| normal.z > 0.5);
    println!("\n0.05 mm too deep, read as {:.5} mm", ends.map(|(p, _)| floor - p.z).fold(0.0, f64::max));
}
