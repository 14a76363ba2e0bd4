//! The benchmark surfaces with their tools and what is asked of the plan.

use nalgebra::DMatrix;
use regulus::diagnostic::{Diagnostic, Result};
use regulus::geometry::{Degrees, Knots, Point, SplineSurface, Vector};
use regulus::part::{DesignSurface, OrientedSpline, Part, ReadOptions, read};
use regulus::plan::{Strategy, StrategyKind, TipSide};
use regulus::tool::{CutterShape, Fixture, Tool, ToolError};

/// Where a surface comes from.
#[derive(Clone, Copy)]
pub(crate) enum Surface {
    /// A file, with its name.
    File(&'static str, &'static [u8]),
    /// The middle of a file's surface along v: this share of its parameter interval.
    Middle(&'static str, &'static [u8], f64),
    /// A hyperbolic paraboloid, 50 by 30 mm, twisted by 15 degrees over its width.
    Hypar,
}

/// One line of the table.
pub(crate) struct Case {
    /// What it is called.
    pub(crate) name: &'static str,
    /// What is milled.
    pub(crate) surface: Surface,
    /// With what.
    pub(crate) shape: CutterShape,
    /// Largest overcut and undercut, mm.
    pub(crate) tolerance: [f64; 2],
    /// Wanted cutting direction.
    pub(crate) direction: Option<[f64; 3]>,
    /// Number of strips.
    pub(crate) strips: Option<usize>,
    /// Where the flank starts to be used, mm.
    pub(crate) engage_from: Option<f64>,
    /// Diameter above the flutes, mm; that of their end when left out.
    pub(crate) shank: Option<f64>,
    /// Nothing above the flutes.
    pub(crate) flank_alone: bool,
}

impl Case {
    /// The tool.
    pub(crate) fn tool(&self) -> std::result::Result<Tool, ToolError> {
        let fixture = |gauge_length| Fixture { gauge_length, shank_diameter: self.shank, ..Fixture::default() };
        let tool = Tool::new(1, &self.shape, &fixture(110.0))?;
        if self.flank_alone { Tool::new(1, &self.shape, &fixture(tool.flute_length())) } else { Ok(tool) }
    }

    /// What is wanted of the plan.
    pub(crate) fn strategy(&self) -> Strategy {
        let kind = if self.strips == Some(1) { StrategyKind::SingleSweep } else { StrategyKind::MultiStrip };
        Strategy {
            direction: self.direction.map(Vector::from),
            strips: self.strips,
            tip: Some(TipSide::Low),
            engage_from: self.engage_from,
            ..Strategy::new(kind)
        }
    }
}

macro_rules! data {
    ($name:literal) => {
        include_bytes!(concat!("../../data/", $name))
    };
}

pub(crate) const S1: (&str, &[u8]) = ("surface_s1.json", data!("surface_s1.json"));
pub(crate) const S1B: (&str, &[u8]) = ("surface_s1b.json", data!("surface_s1b.json"));
pub(crate) const S2: (&str, &[u8]) = ("surface_s2.json", data!("surface_s2.json"));
pub(crate) const S5: (&str, &[u8]) = ("surface_s5.json", data!("surface_s5.json"));
pub(crate) const S6: (&str, &[u8]) = ("surface.json", include_bytes!("../../../samples/exact-cone/surface.json"));
const ROTOR_PRESSURE: (&str, &[u8]) =
    ("pressure-side.json", include_bytes!("../../../samples/rotor37/pressure-side.json"));
const ROTOR_SUCTION: (&str, &[u8]) = ("rotor37_suction.json", data!("rotor37_suction.json"));
const HECC: (&str, &[u8]) = ("hecc_main_pressure.json", data!("hecc_main_pressure.json"));

/// The direction that comes with the gear flanks.
pub(crate) const GEAR: [f64; 3] = [0.707_583_731, 0.649_210_227, -0.279_018_538];

/// Every case, in the table's order.
pub(crate) fn all() -> Vec<Case> {
    let cone = |r2: f64, r1: f64, length: f64| CutterShape::EndSpheres { r1, r2, length };
    let small = |length: f64| cone(1.0, 0.3, length);
    let file = |(name, bytes): (&'static str, &'static [u8])| Surface::File(name, bytes);
    let case = |name, surface, shape, tolerance: f64| Case {
        name,
        surface,
        shape,
        tolerance: [tolerance; 2],
        direction: None,
        strips: None,
        engage_from: Some(0.0),
        shank: None,
        flank_alone: false,
    };
    let blade = |half_angle: f64, flute_length: f64, tip_diameter: f64| CutterShape::Cone {
        tip_diameter,
        half_angle: Degrees(half_angle),
        corner_radius: 0.0,
        flute_length,
    };
    let two_sided = vec![
        case("s1, free", file(S1), small(1.717), 2e-4),
        Case { strips: Some(8), ..case("s1, free, 8 strips", file(S1), small(1.717), 2e-4) },
        Case { direction: Some(GEAR), strips: Some(8), ..case("s1, given, 8 strips", file(S1), small(1.717), 4e-3) },
        Case {
            direction: Some(GEAR),
            strips: Some(5),
            ..case("s1 middle 0.64, given, 5 strips", Surface::Middle(S1.0, S1.1, 0.64), small(1.717), 4e-3)
        },
        case("s1b, free", file(S1B), small(1.717), 2.6e-3),
        case("s2, free", file(S2), small(2.46), 3e-4),
        // Its bumps stand in the way of any shank.
        Case { flank_alone: true, ..case("s5, free", file(S5), small(2.64), 0.054) },
        case("s5, free, with a shank", file(S5), small(2.64), 0.054),
        Case { strips: Some(1), ..case("s6, one strip", file(S6), cone(6.0, 3.0, 14.0), 1e-6) },
        Case {
            strips: Some(1),
            direction: Some([1.0, 0.0, 0.0]),
            engage_from: None,
            ..case(
                "hypar 15 deg, cylinder R5",
                Surface::Hypar,
                CutterShape::Cylinder { diameter: 10.0, corner_radius: 0.0, flute_length: 40.0 },
                1e-3,
            )
        },
    ];
    let mut cases = two_sided;
    let without = [
        ("s1, free, no overcut", 0),
        ("s1 middle 0.64, 5 strips, no overcut", 3),
        ("s1b, free, no overcut", 4),
        ("s2, free, no overcut", 5),
        ("s5, free, no overcut", 6),
        ("s6, one strip, no overcut", 8),
        ("hypar 15 deg, no overcut", 9),
    ];
    for (name, of) in without {
        let Some(two_sided) = cases.get(of) else { continue };
        let [overcut, undercut] = two_sided.tolerance;
        let tolerance = [overcut.min(1e-4), 2.1 * undercut];
        cases.push(Case { name, tolerance, shape: two_sided.shape.clone(), ..*two_sided });
    }
    // Tapered, to lean away from hollow and twisted blades, with flutes short enough for their curvature.
    let blades = [
        ("rotor37 pressure side", ROTOR_PRESSURE, blade(20.0, 2.5, 4.0), 4.0),
        ("rotor37 suction side", ROTOR_SUCTION, blade(8.0, 2.5, 6.0), 4.0),
        ("hecc_main pressure side", HECC, blade(15.0, 6.0, 4.0), 4.0),
    ];
    for (name, data, shape, shank) in blades {
        // A little less than what is to be reached: plans are judged far more densely than they are made.
        let tolerance = [4e-5, 0.0095];
        let shank = Some(shank);
        cases.push(Case { tolerance, engage_from: None, shank, ..case(name, file(data), shape, 0.0) });
    }
    cases.push(Case {
        tolerance: [0.010, 0.030],
        direction: Some([0.0, 0.76, 0.65]),
        strips: Some(25),
        engage_from: None,
        shank: Some(8.0),
        ..case("rotor37 pressure side, as the sample", file(ROTOR_PRESSURE), blade(1.0, 5.0, 14.0), 0.0)
    });
    cases
}

/// The part of a case.
pub(crate) fn part(surface: Surface) -> Result<Part> {
    let surface = match surface {
        Surface::File(name, bytes) => read(bytes, name, &ReadOptions::default())?,
        Surface::Middle(name, bytes, share) => {
            let DesignSurface::Spline(whole) = read(bytes, name, &ReadOptions::default())? else {
                return Err(Diagnostic::error(format!("{name} holds no spline")));
            };
            let flip = whole.flip();
            spline(middle(whole.surface(), share)?, flip)?
        }
        Surface::Hypar => {
            let lift = 30.0 * 7.5_f64.to_radians().tan();
            let control = vec![
                vec![Point::origin(), Point::new(0.0, -lift, 30.0)],
                vec![Point::new(50.0, 0.0, 0.0), Point::new(50.0, lift, 30.0)],
            ];
            let knots = || vec![0.0, 0.0, 1.0, 1.0];
            spline(checked(SplineSurface::new([1, 1], [knots(), knots()], control, None))?, false)?
        }
    };
    Ok(Part { name: "bench".into(), surface, check: Vec::new(), body: None })
}

pub(crate) fn spline(surface: SplineSurface, flip: bool) -> Result<DesignSurface> {
    Ok(DesignSurface::Spline(checked(OrientedSpline::new(surface, flip))?))
}

pub(crate) fn checked<T, E: std::fmt::Display>(value: std::result::Result<T, E>) -> Result<T> {
    value.map_err(|e| Diagnostic::error(e.to_string()))
}

/// The middle `share` of a polynomial surface along v, exactly: the pieces between the new ends have the old knots, and
/// as many points as control points determine them.
fn middle(surface: &SplineSurface, share: f64) -> Result<SplineSurface> {
    let old = surface.knots_v();
    let (start, end) = old.domain();
    let margin = 0.5 * (1.0 - share) * (end - start);
    let (low, high) = (start + margin, end - margin);
    let degree = old.degree();
    let mut values = vec![low; degree + 1];
    values.extend(old.values().iter().copied().filter(|knot| low < *knot && *knot < high));
    values.extend(vec![high; degree + 1]);
    let count = values.len() - degree - 1;
    let knots = checked(Knots::new(degree, values.clone(), count))?;
    let mut collocation = DMatrix::zeros(count, count);
    for i in 0..count {
        let basis = knots.basis(knots.greville(i));
        for k in 0..=degree {
            collocation[(i, basis.first + k)] = basis.ders[0][k];
        }
    }
    let lu = collocation.lu();
    let columns = old.controls();
    let mut control = Vec::new();
    for row in surface.control().chunks(columns) {
        let wanted = DMatrix::from_fn(count, 3, |i, c| {
            let basis = old.basis(knots.greville(i));
            (0..=degree).map(|k| basis.ders[0][k] * row[basis.first + k][c]).sum::<f64>()
        });
        let found = lu.solve(&wanted).ok_or_else(|| Diagnostic::error("the surface has no middle"))?;
        control.push((0..count).map(|i| Point::new(found[(i, 0)], found[(i, 1)], found[(i, 2)])).collect());
    }
    let knots_u = surface.knots_u();
    checked(SplineSurface::new([knots_u.degree(), degree], [knots_u.values().to_vec(), values], control, None))
}
