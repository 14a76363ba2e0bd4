//! The tool as an unknown, on the two sides of a cavity that one tool sweeps exactly (tests/data, own construction):
//! whole, with noise, with a quarter cut away, and with a local bump (Bo 2016, Figs. 14 to 16).

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

use regulus::geometry::interpolate::interpolate_grid;
use regulus::geometry::{FitPoint, Point, SplineSurface, fit_surface};
use regulus::part::{DesignSurface, OrientedSpline, Part, ReadOptions, read};
use regulus::plan::meridian::{
    FoundTool, MeridianFamily, MeridianWeights, RadiusFunction, ToolRequest, ToolWish, find_tool,
};
use regulus::plan::{Strategy, StrategyKind, Unobserved};
use regulus::tool::Fixture;

fn side(number: u8) -> OrientedSpline {
    let path = format!("{}/tests/data/cavity_c4_side{number}.json", env!("CARGO_MANIFEST_DIR"));
    match read(&std::fs::read(&path).unwrap(), &path, &ReadOptions::default()).unwrap() {
        DesignSurface::Spline(spline) => spline,
        DesignSurface::Mesh(_) | DesignSurface::Curved(_) => panic!("{path} is a spline"),
    }
}

fn part(spline: OrientedSpline) -> Part {
    Part { name: "side".into(), surface: DesignSurface::Spline(spline), body: None, check: Vec::new() }
}

fn find(part: &Part, tolerance: f64) -> FoundTool {
    let wish = ToolWish {
        number: 1,
        family: MeridianFamily::Free,
        coefficients: None,
        radius: (1.0, 20.0),
        ends: None,
        seed: None,
        length: (0.0, 60.0),
        weights: MeridianWeights::default(),
        fixture: Fixture { gauge_length: 100.0, ..Fixture::default() },
    };
    let strategy = Strategy::new(StrategyKind::SingleSweep);
    find_tool(&ToolRequest { part, wish: &wish, strategy: &strategy, tolerance, observer: &Unobserved }).unwrap()
}

/// Largest error of either sign of a sweep that covers everything.
fn error(found: &FoundTool) -> f64 {
    let sweep = &found.sweeps[0];
    assert!(sweep.covered > 0.998, "{}", sweep.covered);
    sweep.deviation.overcut.max(sweep.deviation.undercut)
}

fn diagonal(spline: &OrientedSpline) -> f64 {
    DesignSurface::Spline(spline.clone()).bounds().diagonal()
}

/// Points of a side at shares of its parameters.
fn grid(spline: &OrientedSpline, (rows, columns): (usize, usize), most: f64) -> Vec<Vec<Point>> {
    let [(u0, u1), (v0, v1)] = spline.surface().domain();
    (0..=rows)
        .map(|i| {
            let u = u0 + (u1 - u0) * most * i as f64 / rows as f64;
            (0..=columns).map(|j| spline.surface().point(u, v0 + (v1 - v0) * j as f64 / columns as f64)).collect()
        })
        .collect()
}

/// Largest distance of the middle part of a meridian from another, once slid along the axis as best it can.
fn meridian_distance(a: &RadiusFunction, b: &RadiusFunction) -> f64 {
    let points = |r: &RadiusFunction, count: usize| -> Vec<(f64, f64)> {
        let station = |i: usize| r.length() * i as f64 / count as f64;
        let contacts = (0..=count).map(|i| r.jet(station(i)).contact(station(i)).point);
        contacts.map(|p| (p.height, p.radius)).collect()
    };
    let (coarse, fine) = (points(a, 60), points(b, 3000));
    let inner = &coarse[5..56];
    let off = |slide: f64| {
        let to =
            |p: &(f64, f64)| fine.iter().map(|q| (p.0 + slide - q.0).hypot(p.1 - q.1)).fold(f64::INFINITY, f64::min);
        inner.iter().map(to).fold(0.0, f64::max)
    };
    let best = |around: f64, step: f64| {
        let tried = (-20..=20).map(|i| around + f64::from(i) * step);
        tried.min_by(|x, y| off(*x).total_cmp(&off(*y))).unwrap()
    };
    off(best(best(best(0.0, 0.1), 0.01), 0.001))
}

#[test]
fn each_side_alone_gives_the_same_tool() {
    let found = [1, 2].map(|number| find(&part(side(number)), 0.005));
    for found in &found {
        assert!(error(found) <= 0.0005, "{}", error(found));
        assert!(found.radius.first_invalid(1000).is_none());
    }
    // One tool sweeps both sides: found from either, it is the same.
    let apart = meridian_distance(&found[0].radius, &found[1].radius);
    assert!(apart < 0.005, "{apart}");
}

#[test]
fn a_quarter_cut_away_leaves_the_tool_as_it_was() {
    let whole = side(1);
    let points = grid(&whole, (60, 60), 0.75);
    let cut = part(OrientedSpline::new(interpolate_grid(&points).unwrap(), whole.flip()).unwrap());
    let found = find(&cut, 0.005);
    assert!(error(&found) < 0.001 * diagonal(&whole), "{}", error(&found));
    assert!(error(&found) < 0.002, "{}", error(&found));
}

#[test]
fn noise_of_one_percent_is_averaged_out() {
    let whole = side(1);
    let size = diagonal(&whole);
    let mut state = 1u64;
    let mut random = || {
        // A linear congruential generator (Knuth's MMIX constants): the same noise everywhere.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let (rows, columns) = (360, 180);
    let [(u0, u1), (v0, v1)] = whole.surface().domain();
    let mut points = Vec::new();
    for i in 0..=rows {
        for j in 0..=columns {
            let (u, v) = (f64::from(i) / f64::from(rows), f64::from(j) / f64::from(columns));
            let sample = whole.at(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v);
            let moved = sample.point + sample.normal.0.into_inner() * (0.01 * size * random());
            points.push(FitPoint { parameters: [u, v], point: moved, weight: 1.0 });
        }
    }
    let noisy: SplineSurface = fit_surface(&points, [10, 12], 1e-6).unwrap();
    let found = find(&part(OrientedSpline::new(noisy, whole.flip()).unwrap()), 0.001 * size);
    // Judged against the surface without noise.
    let clean = DesignSurface::Spline(whole);
    let points = envelope_points(&found);
    let worst = points.iter().map(|p| clean.foot(p)).filter(|foot| !foot.past_edge);
    let worst = worst.map(|foot| foot.signed_distance.abs()).fold(0.0, f64::max);
    assert!(worst < 0.001 * size, "{worst} of {size}");
}

#[test]
fn a_local_bump_is_set_aside_and_the_rest_is_found() {
    let whole = side(1);
    let size = diagonal(&whole);
    let mut points = grid(&whole, (90, 60), 1.0);
    let [(u0, u1), (v0, v1)] = whole.surface().domain();
    for (i, row) in points.iter_mut().enumerate() {
        for (j, point) in row.iter_mut().enumerate() {
            let (u, v) = (i as f64 / 90.0, j as f64 / 60.0);
            let normal = whole.at(u0 + (u1 - u0) * u, v0 + (v1 - v0) * v).normal.0.into_inner();
            let square = ((u - 0.7) / 0.06).powi(2) + ((v - 0.5) / 0.12).powi(2);
            *point -= normal * (0.6 * (-square).exp());
        }
    }
    let bumped = part(OrientedSpline::new(interpolate_grid(&points).unwrap(), whole.flip()).unwrap());
    let found = find(&bumped, 0.001 * size);
    let sweep = &found.sweeps[0];
    // Within a thousandth of the box all around the bump, whose footprint is 6 % of the side.
    assert!(sweep.within > 0.9 && sweep.within < 0.995, "{}", sweep.within);
    let [(low, high), (start, end)] = sweep.patch.unwrap();
    assert!((high - low) * (end - start) > 0.5, "{low} {high} {start} {end}");
    assert!(end < 0.72 || start > 0.28, "the patch spans the bump: {start} {end}");
}

/// Envelope points of a found tool's sweep.
fn envelope_points(found: &FoundTool) -> Vec<Point> {
    let sweep = &found.sweeps[0];
    let (first, last) = sweep.motion.domain();
    let mut points = Vec::new();
    for i in 0..=200 {
        let rate = sweep.motion.pose_rate(first + (last - first) * f64::from(i) / 200.0).unwrap();
        for k in 0..=60 {
            let s = found.radius.length() * f64::from(k) / 60.0;
            let mut contact = found.radius.jet(s).contact(s);
            contact.point.height += sweep.motion.lower_height;
            // The material of this side is at lower y.
            let into = -regulus::geometry::Vector::y();
            points.extend(regulus::envelope::envelope_point(&rate, &contact, &into).map(|touch| touch.point));
        }
    }
    points
}
