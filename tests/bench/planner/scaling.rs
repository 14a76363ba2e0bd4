//! How planning time grows: with the samples of the method of Rajain 2023 (its N x M x K), with the number of strips,
//! and with the length of one sweep. Drawn to docs/planning-time.svg, both axes logarithmic.

use crate::cases::{GEAR, S1, part as part_of};
use crate::cases::{Surface, checked, spline};
use regulus::diagnostic::{Diagnostic, Result};
use regulus::geometry::interpolate::interpolate_grid;
use regulus::geometry::{Point, Vector};
use regulus::motion::FeedReference;
use regulus::part::Part;
use regulus::plan::{Method, Plan, PlanRequest, RajainSettings, Strategy, StrategyKind, TipSide, Unobserved, plan};
use regulus::tool::{CutterShape, Fixture, Tool};
use std::fmt::Write as _;
use std::io::{Write, stdout};
use std::time::Instant;

/// One curve: what grows, and (size, seconds).
struct Curve {
    name: &'static str,
    points: Vec<(f64, f64)>,
}

/// Runs everything, prints it, and draws it.
pub(crate) fn run() -> std::result::Result<(), Box<dyn std::error::Error>> {
    let curves = [
        Curve { name: "samples (Rajain 2023), thousands", points: samples()? },
        Curve { name: "strips", points: strips()? },
        Curve { name: "length of one sweep, mm", points: lengths()? },
    ];
    let mut out = stdout();
    for curve in &curves {
        for (size, seconds) in &curve.points {
            writeln!(out, "{:<34} {size:>9.1} {seconds:>9.3} s", curve.name)?;
        }
        writeln!(out, "{:<34} grows with the power {:.2}", curve.name, power(&curve.points))?;
    }
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("planning-time.svg"), svg(&curves))?;
    Ok(())
}

/// N x M x K from a thousand to a million on the gear flank s1, in thousands.
fn samples() -> Result<Vec<(f64, f64)>> {
    let part = part_of(Surface::Middle(S1.0, S1.1, 0.64))?;
    let mut points = Vec::new();
    for (step, heights) in [(1.2, 8), (0.6, 10), (0.3, 20), (0.15, 30), (0.075, 40), (0.0375, 80), (0.0375, 140)] {
        let rajain = RajainSettings { step: Some(step), heights, ..RajainSettings::default() };
        let strategy = Strategy {
            method: Method::Rajain2023,
            direction: Some(Vector::from(GEAR)),
            strips: Some(6),
            rajain,
            ..Strategy::new(StrategyKind::MultiStrip)
        };
        let (planned, seconds) = timed(&part, &strategy)?;
        let count = planned.rajain.map_or(0, |figures| figures.positions * figures.heights);
        points.push((count as f64 / 1e3, seconds));
    }
    Ok(points)
}

/// 1 to 200 strips, all alike, side by side around the waist of a ring.
fn strips() -> Result<Vec<(f64, f64)>> {
    let mut points = Vec::new();
    for count in [1, 2, 5, 10, 20, 50, 100, 200] {
        let part = ring(1.5 * f64::from(count), 12.0)?;
        let strategy = Strategy {
            direction: Some(Vector::z()),
            strips: Some(count as usize),
            tip: Some(TipSide::Low),
            engage_from: Some(0.0),
            ..Strategy::new(StrategyKind::MultiStrip)
        };
        points.push((f64::from(count), timed(&part, &strategy)?.1));
    }
    Ok(points)
}

/// One sweep of 5 to 320 mm around the same waist.
fn lengths() -> Result<Vec<(f64, f64)>> {
    let mut points = Vec::new();
    for length in [5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0] {
        let part = ring(length, 1.5)?;
        let strategy = Strategy {
            direction: Some(Vector::y()),
            tip: Some(TipSide::Low),
            engage_from: Some(0.0),
            ..Strategy::new(StrategyKind::SingleSweep)
        };
        points.push((length, timed(&part, &strategy)?.1));
    }
    Ok(points)
}

/// Radius of the waist, and of the hollow around it, mm.
const RING: f64 = 60.0;
const HOLLOW: f64 = 40.0;

/// A waisted ring about Z, seen from outside: `around` mm of its narrowest circle, `high` mm of its hollow.
fn ring(around: f64, high: f64) -> Result<Part> {
    let (columns, rows) = ((around / 1.5).ceil() as usize + 4, (high / 1.5).ceil() as usize + 4);
    let points: Vec<Vec<Point>> = (0..=columns)
        .map(|i| {
            let turn = around / RING * (i as f64 / columns as f64 - 0.5);
            (0..=rows)
                .map(|j| {
                    let bend = high / HOLLOW * (j as f64 / rows as f64 - 0.5);
                    let radius = RING + HOLLOW * (1.0 - bend.cos());
                    Point::new(radius * turn.cos(), radius * turn.sin(), HOLLOW * bend.sin())
                })
                .collect()
        })
        .collect();
    // Rows turn about Z, columns rise: the cross product points away from the axis, where the tool stands.
    let surface = spline(checked(interpolate_grid(&points))?, false)?;
    Ok(Part { name: "ring".into(), surface, check: Vec::new(), body: None })
}

/// Plans with the flank of the gear flanks' conical cutter; the plan and the seconds it took.
fn timed(part: &Part, strategy: &Strategy) -> Result<(Plan, f64)> {
    let shape = CutterShape::EndSpheres { r1: 0.3, r2: 1.0, length: 1.717 };
    let fixture = Fixture { gauge_length: 3.0, ..Fixture::default() };
    let tool = Tool::new(1, &shape, &fixture).map_err(|e| Diagnostic::error(e.to_string()))?;
    let request = PlanRequest {
        name: "scaling",
        part,
        tool: &tool,
        strategy,
        overcut_tolerance: 0.004,
        undercut_tolerance: 0.004,
        cut_feed: 600.0,
        feed_reference: FeedReference::Mid,
        spindle_rpm: 8000.0,
        linearization: 0.0,
        observer: &Unobserved,
    };
    let start = Instant::now();
    let planned = plan(&request)?;
    Ok((planned, start.elapsed().as_secs_f64()))
}

/// Slope of the regression line of the logarithms.
fn power(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (x, y) = (logs.iter().map(|p| p.0).sum::<f64>() / n, logs.iter().map(|p| p.1).sum::<f64>() / n);
    let spread: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
    logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / spread
}

/// Frame of the drawing: left, right, top, bottom.
const FRAME: (f64, f64, f64, f64) = (64.0, 620.0, 20.0, 340.0);
/// Decades of the sizes (1 to 1000) and of the seconds (0.01 to 100).
const SIZES: (i32, i32) = (0, 3);
const SECONDS: (i32, i32) = (-2, 2);
const COLOURS: [&str; 3] = ["#1d64a8", "#b8461f", "#3c7a3a"];

/// All curves over one logarithmic grid.
fn svg(curves: &[Curve]) -> String {
    let (left, right, top, bottom) = FRAME;
    let share = |value: f64, (low, high): (i32, i32)| (value.log10() - f64::from(low)) / f64::from(high - low);
    let x = |size: f64| left + share(size, SIZES) * (right - left);
    let y = |seconds: f64| bottom - share(seconds, SECONDS) * (bottom - top);
    let mut out = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 400\" font-family=\"sans-serif\" font-size=\"12\">\
         <rect width=\"640\" height=\"400\" fill=\"white\"/>\n",
    );
    for decade in SIZES.0..=SIZES.1 {
        let (size, at) = (10_f64.powi(decade), x(10_f64.powi(decade)));
        let _ = writeln!(
            out,
            "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ccc\"/><text x=\"{at:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{size}</text>",
            bottom + 16.0
        );
    }
    for decade in SECONDS.0..=SECONDS.1 {
        let (seconds, at) = (10_f64.powi(decade), y(10_f64.powi(decade)));
        let _ = writeln!(
            out,
            "<path d=\"M{left} {at:.1}H{right}\" stroke=\"#ccc\"/><text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{seconds} s</text>",
            left - 6.0,
            at + 4.0
        );
    }
    for (k, (curve, colour)) in curves.iter().zip(COLOURS).enumerate() {
        let path: Vec<String> = curve.points.iter().map(|(size, s)| format!("{:.1} {:.1}", x(*size), y(*s))).collect();
        let _ = writeln!(out, "<path d=\"M{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"/>", path.join("L"));
        for (size, seconds) in &curve.points {
            let _ =
                writeln!(out, "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3\" fill=\"{colour}\"/>", x(*size), y(*seconds));
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.0}\" y=\"{:.0}\" fill=\"{colour}\">{}: power {:.2}</text>",
            left + 10.0,
            top + 16.0 * (k as f64 + 1.0),
            curve.name,
            power(&curve.points)
        );
    }
    out + "</svg>\n"
}
