//! Searches on exact envelopes whose tool is known by formula, whole and damaged.

use super::*;
use crate::envelope::envelope_point;
use crate::geometry::interpolate::interpolate_grid;
use crate::geometry::{Direction, Point, Vector};
use crate::motion::Pose;
use crate::motion::path::PoseRate;
use crate::part::{DesignSurface, OrientedSpline};
use crate::plan::Unobserved;
use std::f64::consts::TAU;

/// Length of the exact tool's axis, mm.
const LENGTH: f64 = 20.0;

/// The exact tool: a wave on a cone. Radius with derivatives.
fn exact_radius(s: f64) -> RadiusJet {
    let k = TAU / 16.0;
    RadiusJet {
        radius: 5.0 + 0.05 * s + 0.4 * (k * s).sin(),
        slope: 0.05 + 0.4 * k * (k * s).cos(),
        bend: -0.4 * k * k * (k * s).sin(),
    }
}

/// The exact motion: centre of the lowest sphere and axis, with their derivatives by t in 0..1.
fn exact_rate(t: f64) -> PoseRate {
    let tip = Point::new(60.0 * t, 14.0 * t - 24.0 * t * t + 6.0 * t.powi(3), 4.0 * t * t);
    let tip_rate = Vector::new(60.0, 14.0 - 48.0 * t + 18.0 * t * t, 8.0 * t);
    let along = Vector::new(0.1 + 0.1 * t, -0.12 + 0.3 * t - 0.05 * t * t, 1.0);
    let along_rate = Vector::new(0.1, 0.3 - 0.1 * t, 0.0);
    let length = along.norm();
    let axis = Direction::new_normalize(along);
    let axis_rate = (along_rate - axis.into_inner() * axis.dot(&along_rate)) / length;
    PoseRate { pose: Pose { tip, axis }, tip_rate, axis_rate }
}

/// The envelope of a tool in the exact motion, over the inner part of its flank, as a part.
fn envelope(radius: impl Fn(f64) -> RadiusJet) -> Part {
    let (rows, columns) = (60, 50);
    let point = |s: f64, t: f64| {
        let contact = radius(s).contact(s);
        envelope_point(&exact_rate(t), &contact, &-Vector::y()).unwrap().point
    };
    let points: Vec<Vec<Point>> = (0..=rows)
        .map(|i| {
            let t = i as f64 / rows as f64;
            (0..=columns).map(|j| point(1.0 + 18.0 * j as f64 / columns as f64, t)).collect()
        })
        .collect();
    part_of(interpolate_grid(&points).unwrap())
}

fn part_of(surface: crate::geometry::SplineSurface) -> Part {
    // The tool is on the +y side.
    let flip = surface.jet(0.5, 0.5).normal().unwrap().y < 0.0;
    let surface = DesignSurface::Spline(OrientedSpline::new(surface, flip).unwrap());
    Part { name: "envelope".into(), surface, body: None, check: Vec::new() }
}

fn wish(family: MeridianFamily) -> ToolWish {
    ToolWish {
        number: 1,
        family,
        coefficients: None,
        radius: (0.5, 50.0),
        ends: None,
        seed: None,
        length: (0.0, 60.0),
        weights: MeridianWeights::default(),
        fixture: Fixture { gauge_length: 100.0, ..Fixture::default() },
    }
}

fn find(part: &Part, wish: &ToolWish, tolerance: f64) -> FoundTool {
    let strategy = Strategy { direction: Some(Vector::x()), ..Strategy::new(StrategyKind::SingleSweep) };
    find_tool(&ToolRequest { part, wish, strategy: &strategy, tolerance, observer: &Unobserved }).unwrap()
}

/// Largest distance of a found meridian from the exact one, once it is slid along the axis as best it can.
fn meridian_error(found: &RadiusFunction) -> f64 {
    let exact: Vec<_> =
        (0..=4000).map(|i| LENGTH * f64::from(i) / 4000.0).map(|s| exact_radius(s).contact(s).point).collect();
    let contact = |s: f64| found.jet(s).contact(s).point;
    let points: Vec<_> = (0..=100).map(|i| contact(found.length() * f64::from(i) / 100.0)).collect();
    let error = |slide: f64| {
        let within = points.iter().filter(|p| (1.5..18.5).contains(&(p.height + slide)));
        within
            .map(|p| {
                let distance =
                    |q: &crate::tool::MeridianPoint| (p.height + slide - q.height).hypot(p.radius - q.radius);
                exact.iter().map(distance).fold(f64::INFINITY, f64::min)
            })
            .fold(0.0, f64::max)
    };
    let coarse = (-30..=30).map(|i| f64::from(i) * 0.1).min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap();
    (-100..=100).map(|i| error(coarse + f64::from(i) * 0.001)).fold(f64::INFINITY, f64::min)
}

#[test]
fn an_exact_envelope_gives_its_tool_back() {
    let found = find(&envelope(exact_radius), &wish(MeridianFamily::Free), 0.005);
    let sweep = &found.sweeps[0];
    assert!(sweep.deviation.overcut.max(sweep.deviation.undercut) < 5e-4, "{:?}", sweep.deviation);
    assert!(sweep.covered > 0.999 && sweep.within > 0.999, "{} {}", sweep.covered, sweep.within);
    assert!(meridian_error(&found.radius) < 0.005, "{}", meridian_error(&found.radius));
    assert!(found.radius.first_invalid(500).is_none());
    // The tool's arcs are the meridian that was found.
    let lowest = found.radius.jet(0.0);
    for i in 0..=50 {
        let s = found.radius.length() * f64::from(i) / 50.0;
        let point = found.radius.jet(s).contact(s).point;
        let height = (point.height + lowest.radius * lowest.slope).clamp(0.0, found.tool.flute_length());
        let contact = found.tool.contact_at(height).unwrap();
        assert!((contact.point.radius - point.radius).abs() < 1e-4, "{s}: {contact:?} {point:?}");
    }
}

fn error(found: &FoundTool) -> f64 {
    let errors = found.sweeps.iter().map(|sweep| sweep.deviation.overcut.max(sweep.deviation.undercut));
    errors.fold(0.0, f64::max)
}

/// A straight flank, a constant radius and a bulging arc.
const FAMILIES: [(MeridianFamily, [f64; 3]); 3] = [
    (MeridianFamily::Cone, [4.0, 6.0, 0.0]),
    (MeridianFamily::Cylinder, [5.0, 0.0, 0.0]),
    (MeridianFamily::Barrel, [5.0, 0.05, 1.0 / 90.0]),
];

#[test]
fn each_family_finds_its_own_exact_tool() {
    for (family, coefficients) in FAMILIES {
        let count = RadiusFunction::constant(family, 5.0, LENGTH, FREE_COEFFICIENTS).unwrap().coefficients().len();
        let exact = RadiusFunction::constant(family, 5.0, LENGTH, FREE_COEFFICIENTS).unwrap();
        let exact = exact.with(&coefficients[..count]);
        let found = find(&envelope(|s| exact.jet(s)), &wish(family), 0.005);
        assert!(error(&found) < 0.002, "{family:?}: {}", error(&found));
        assert!(found.sweeps[0].covered > 0.998, "{family:?}: {}", found.sweeps[0].covered);
        assert_eq!(found.radius.family(), family);
    }
}

/// What no cylinder fits: the error that is left must not drive the fit off the part.
#[test]
fn a_family_that_cannot_fit_still_covers_the_part() {
    let found = find(&envelope(exact_radius), &wish(MeridianFamily::Cylinder), 0.005);
    // The wave of the exact tool is 0.4 mm high over a slope of 0.05.
    assert!((0.2..0.9).contains(&error(&found)), "{}", error(&found));
    assert!(found.sweeps[0].covered > 0.98, "{}", found.sweeps[0].covered);
}

#[test]
fn a_cone_between_given_ends_keeps_them_and_finds_its_length() {
    let exact = RadiusFunction::between((4.0, 6.0), LENGTH).unwrap();
    for seed in [Some(Seed::Line), Some(Seed::Surface)] {
        let wish = ToolWish { ends: Some((4.0, 6.0)), radius: (4.0, 6.0), seed, ..wish(MeridianFamily::Cone) };
        let found = find(&envelope(|s| exact.jet(s)), &wish, 0.005);
        assert!(error(&found) < 0.005, "{seed:?}: {}", error(&found));
        assert_eq!(Some(found.seed), seed);
        let length = found.radius.length();
        assert!((18.0..26.0).contains(&length), "{length}");
        assert_eq!((found.radius.jet(0.0).radius, found.radius.jet(length).radius), (4.0, 6.0));
    }
}

/// Two plane walls that meet at a ridge, which no cylinder turns over: each is swept by itself with the same tool.
#[test]
fn what_one_sweep_cannot_make_is_made_patch_by_patch() {
    let point = |i: i32, j: i32| {
        let (x, z) = (f64::from(i), f64::from(j) * 0.4 - 10.0);
        Point::new(x, -0.25 * z.max(0.0), z)
    };
    let rows: Vec<Vec<Point>> = (0..=40).map(|i| (0..=50).map(|j| point(i, j)).collect()).collect();
    let part = part_of(interpolate_grid(&rows).unwrap());
    let strategy = Strategy { direction: Some(Vector::x()), ..Strategy::new(StrategyKind::MultiStrip) };
    let wish = wish(MeridianFamily::Cylinder);
    let request = ToolRequest { part: &part, wish: &wish, strategy: &strategy, tolerance: 0.02, observer: &Unobserved };
    let found = find_tool(&request).unwrap();
    assert!(error(&found) < 0.02, "{}", error(&found));
    assert!(found.sweeps.len() == 2 && found.left == 0.0, "{} {}", found.sweeps.len(), found.left);
    // One border is the ridge.
    let mut borders = found.sweeps.iter().flat_map(|sweep| [sweep.band[0].0, sweep.band[0].1]);
    assert!(borders.any(|border| (border - 0.5).abs() < 0.05));
}

#[test]
fn bounds_on_the_radius_are_kept() {
    let wish = ToolWish { radius: (3.0, 5.2), ..wish(MeridianFamily::Free) };
    let found = find(&envelope(exact_radius), &wish, 0.005);
    for i in 0..=100 {
        let radius = found.radius.jet(found.radius.length() * f64::from(i) / 100.0).radius;
        assert!((2.99..5.21).contains(&radius), "{i}: {radius}");
    }
}

#[test]
fn a_flank_that_may_not_be_long_enough_is_refused_with_the_length_needed() {
    let wish = ToolWish { length: (0.0, 10.0), ..wish(MeridianFamily::Cone) };
    let part = envelope(exact_radius);
    let strategy = Strategy::new(StrategyKind::SingleSweep);
    let said = find_tool(&ToolRequest {
        part: &part,
        wish: &wish,
        strategy: &strategy,
        tolerance: 0.01,
        observer: &Unobserved,
    })
    .unwrap_err();
    assert!(said.message.contains("no flank of at most 10 mm") && said.help.is_some(), "{said}");
}
