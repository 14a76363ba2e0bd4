use super::*;
use crate::geometry::{Point, SplineSurface, Vector};
use crate::part::OrientedSpline;
use crate::plan::attainable::FlankLaw;

const FLANK: FlankLaw = FlankLaw { reach: 6.0, radius: 3.0, bend: 0.0 };

/// z = x y / 80 over a square of 40 mm whose parameter lines run at 45 degrees to the rulings x = const, y = const: each
/// control net of a biquadratic gives it exactly.
fn turned_saddle() -> OrientedSpline {
    // In a = (x + y)/√2, b = (y - x)/√2 the saddle is z = (a² - b²) / 160.
    let knots = || vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
    let (ends, half) = ([-20.0, 0.0, 20.0], std::f64::consts::FRAC_1_SQRT_2);
    // Bezier ordinates of t² over -20..20.
    let square = [400.0, -400.0, 400.0];
    let control = |i: usize, j: usize| {
        let (a, b) = (ends[i], ends[j]);
        Point::new((a - b) * half, (a + b) * half, (square[i] - square[j]) / 160.0)
    };
    let rows = (0..3).map(|i| (0..3).map(|j| control(i, j)).collect()).collect();
    OrientedSpline::new(SplineSurface::new([2, 2], [knots(), knots()], rows, None).unwrap(), false).unwrap()
}

fn axis(start_deg: f64) -> (Sheet, AxisField) {
    let sheet = Sheet::new(&turned_saddle()).unwrap();
    let axis = AxisField::solve(&sheet, &FLANK, None, f64::to_radians(start_deg)).unwrap();
    (sheet, axis)
}

#[test]
fn the_axis_turns_to_the_rulings_of_a_saddle_whose_parameter_lines_cross_them() {
    let across = FLANK.error(1.0 / 80.0, FLANK.reach);
    for start in [30.0, 60.0, 120.0] {
        let (_, axis) = axis(start);
        assert!(axis.worst < 0.02 * across, "from {start} degrees: {} against {across} mm", axis.worst);
    }
}

#[test]
fn both_families_of_rulings_are_found_and_told_apart() {
    let (sheet, one) = axis(40.0);
    let ((_, same), (_, other)) = (axis(50.0), axis(130.0));
    assert!(one.resembles(&same, &sheet) && !one.resembles(&other, &sheet));
}

#[test]
fn footprints_follow_the_axis_and_borders_stand_square_to_it() {
    let (sheet, axis) = axis(45.0);
    let field = Field::new(&sheet, &axis, None).unwrap();
    for (station, angle) in sheet.stations.iter().zip(&axis.angles) {
        let (_, by) = field.jet(station.place);
        let g = station.gradient((by[(0, 0)], by[(0, 1)]));
        let h = station.gradient((by[(1, 0)], by[(1, 1)]));
        let (sin, cos) = angle.sin_cos();
        let off = |x: [f64; 2], [a, b]: [f64; 2]| (x[0] * a + x[1] * b).abs() / x[0].hypot(x[1]);
        assert!(off(h, [cos, sin]) < 0.03, "h rises along the axis at {:?}", station.place);
        assert!(off(g, [-sin, cos]) < 0.05, "g rises along the border at {:?}", station.place);
    }
}

#[test]
fn a_firm_wish_makes_borders_run_along_it() {
    let (sheet, axis) = axis(45.0);
    let direction = Vector::new(1.0, 0.3, 0.0);
    let field = Field::new(&sheet, &axis, Some(Wish { direction, weight: 1e3 })).unwrap();
    for station in &sheet.stations {
        let (_, by) = field.jet(station.place);
        let g = station.gradient((by[(0, 0)], by[(0, 1)]));
        let along = [station.bending.e1.dot(&direction), station.bending.e2.dot(&direction)];
        let off = (g[0] * along[0] + g[1] * along[1]) / (g[0].hypot(g[1]) * along[0].hypot(along[1]));
        assert!(off.abs() < 0.05, "{off} at {:?}", station.place);
    }
}

#[test]
fn places_are_found_again_on_the_surface_and_a_little_beyond() {
    let (sheet, axis) = axis(45.0);
    let field = Field::new(&sheet, &axis, None).unwrap();
    for place in [(0.5, 0.5), (0.0, 0.0), (1.0, 0.2), (0.3, 0.98), (-0.1, 0.4), (0.7, 1.12)] {
        let (at, _) = field.jet(place);
        let back = field.at(at);
        assert!((back.0 - place.0).abs() < 1e-9 && (back.1 - place.1).abs() < 1e-9, "{place:?} became {back:?}");
        let near = field.near(at);
        assert!((near.0 - place.0).abs() < 0.02 && (near.1 - place.1).abs() < 0.02, "{place:?} is near {near:?}");
    }
}

#[test]
fn a_band_spans_what_of_the_surface_lies_between_its_borders() {
    let (sheet, axis) = axis(45.0);
    let field = Field::new(&sheet, &axis, None).unwrap();
    let (low, high) = (0.4, 0.55);
    let (first, last) = field.span(low, high).unwrap();
    let inside = sheet.stations.iter().map(|s| field.jet(s.place).0).filter(|(g, _)| (low..=high).contains(g));
    let (least, most) = inside.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), (_, h)| (l.min(h), m.max(h)));
    assert!(first <= least + 1e-3 && most <= last + 1e-3, "{first}..{last} does not hold {least}..{most}");
    assert!(least - first < 0.06 && last - most < 0.06, "{first}..{last} against {least}..{most}");
}
