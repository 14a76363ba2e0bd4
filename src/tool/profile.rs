//! Profiles given by points joined by straight lines and circular arcs, and smooth curves turned into such profiles.
//!
//! A point's bulge is that of the piece from it to the next point, as in DXF polylines: the tangent of a quarter of the
//! arc's angle, 0 for a straight piece, positive where the flank bulges away from the axis, negative where it is hollow.

use super::ToolError;
use super::meridian::{ArcSide, Element, MeridianPoint, at};
use std::f64::consts::TAU;

/// A point of a profile and the shape of the piece that follows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProfilePoint {
    /// Where it is.
    pub point: MeridianPoint,
    /// Tangent of a quarter of the following arc's angle; 0 for a straight piece.
    pub bulge: f64,
}

/// Bulges below this are straight pieces: the sagitta of 100 mm of chord is then below a millionth of a micrometre.
const STRAIGHT: f64 = 1e-11;

/// The elements of a profile, closed by a flat bottom.
pub(super) fn elements(points: &[ProfilePoint]) -> Result<Vec<Element>, ToolError> {
    let bad = |message: String| Err(ToolError::new("points", message));
    let [first, _, ..] = points else { return bad(format!("{} given; at least 2 are needed", points.len())) };
    if first.point.height != 0.0 {
        return bad(format!("the first height is {}; it must be 0, the tip", first.point.height));
    }
    for (i, ProfilePoint { point, bulge }) in points.iter().enumerate() {
        if !(point.height.is_finite() && point.radius.is_finite() && bulge.is_finite() && point.radius >= 0.0) {
            return bad(format!(
                "point {} is [{}, {}, {bulge}]; numbers must be finite and radii not negative",
                i + 1,
                point.height,
                point.radius
            ));
        }
        if i > 0 && point.height <= points[i - 1].point.height {
            return bad(format!("point {} at height {} does not lie above the point before it", i + 1, point.height));
        }
    }
    let mut elements = vec![Element::Line { from: at(0.0, 0.0), to: first.point }];
    for (i, pair) in points.windows(2).enumerate() {
        let element = piece(pair[0].point, pair[1].point, pair[0].bulge);
        if !rises(&element) {
            return bad(format!(
                "the arc after point {} with bulge {} turns back toward the tip; give it more points",
                i + 1,
                pair[0].bulge
            ));
        }
        elements.push(element);
    }
    elements.retain(|e| e.length() > 0.0);
    Ok(elements)
}

/// True where heights rise all along a piece: its outward normal never turns past the direction of the axis.
fn rises(element: &Element) -> bool {
    [0.0, 1.0].iter().all(|share| element.contact(*share).normal_radial > 0.0)
}

/// One piece. The circle's centre lies on the chord's normal, on the axis' side of a bulge.
fn piece(from: MeridianPoint, to: MeridianPoint, bulge: f64) -> Element {
    if bulge.abs() < STRAIGHT {
        return Element::Line { from, to };
    }
    let (dh, dr) = (to.height - from.height, to.radius - from.radius);
    let chord = dh.hypot(dr);
    let square = bulge * bulge;
    // tan(theta / 4) = b: R = c (1 + b^2) / (4 |b|), and the centre lies c (1 - b^2) / (4 b) behind the chord.
    let radius = chord * (1.0 + square) / (4.0 * bulge.abs());
    let behind = (1.0 - square) / (4.0 * bulge);
    let centre = at(0.5 * (from.height + to.height) + dr * behind, 0.5 * (from.radius + to.radius) - dh * behind);
    let angle = |p: MeridianPoint| (p.radius - centre.radius).atan2(centre.height - p.height).rem_euclid(TAU);
    let side = if bulge > 0.0 { ArcSide::Convex } else { ArcSide::Concave };
    Element::Arc { centre, radius, from: angle(from), to: angle(to), side }
}

/// A point of a smooth curve with its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Where it is.
    pub point: MeridianPoint,
    /// Unit tangent toward larger heights: (height, radius).
    pub tangent: (f64, f64),
}

/// Most times that a piece of a curve is halved.
const DEEPEST: usize = 12;

/// A smooth curve over 0..=1 as a profile of pairs of arcs that share the curve's tangents, within `tolerance` mm.
/// None where the curve does not run toward larger heights.
pub fn smooth_profile(curve: impl Fn(f64) -> CurvePoint, tolerance: f64) -> Option<Vec<ProfilePoint>> {
    let mut points = Vec::new();
    let pieces = 8;
    for i in 0..pieces {
        let (low, high) = (i as f64 / pieces as f64, (i + 1) as f64 / pieces as f64);
        add_biarcs(&curve, (low, high), (tolerance, DEEPEST), &mut points)?;
    }
    points.push(ProfilePoint { point: curve(1.0).point, bulge: 0.0 });
    // Heights count from the tip.
    let tip = points.first()?.point.height;
    for entry in &mut points {
        entry.point.height -= tip;
    }
    points.windows(2).all(|w| w[1].point.height > w[0].point.height).then_some(points)
}

fn add_biarcs(
    curve: &impl Fn(f64) -> CurvePoint,
    (low, high): (f64, f64),
    (tolerance, depth): (f64, usize),
    points: &mut Vec<ProfilePoint>,
) -> Option<()> {
    let (first, last) = (curve(low), curve(high));
    let [a, b] = biarc(&first, &last)?;
    let arcs = [piece(a.point, b.point, a.bulge), piece(b.point, last.point, b.bulge)];
    let off = (1..8).map(|i| {
        let p = curve(low + (high - low) * f64::from(i) / 8.0).point;
        arcs.iter().map(|arc| distance(arc, p)).fold(f64::INFINITY, f64::min)
    });
    if depth == 0 || off.fold(0.0, f64::max) <= tolerance {
        points.extend([a, b]);
        return Some(());
    }
    let middle = 0.5 * (low + high);
    add_biarcs(curve, (low, middle), (tolerance, depth - 1), points)?;
    add_biarcs(curve, (middle, high), (tolerance, depth - 1), points)
}

/// Distance of a point from a piece, measured to its line or circle.
fn distance(element: &Element, p: MeridianPoint) -> f64 {
    match element {
        Element::Line { from, to } => {
            let (dh, dr) = (to.height - from.height, to.radius - from.radius);
            ((p.height - from.height) * dr - (p.radius - from.radius) * dh).abs() / dh.hypot(dr)
        }
        Element::Arc { centre, radius, .. } => {
            ((p.height - centre.height).hypot(p.radius - centre.radius) - radius).abs()
        }
    }
}

/// Two arcs with one tangent where they meet, from one curve point to another. Both tangent lengths are d, the positive
/// root of 2 (1 - T0.T1) d^2 + 2 d v.(T0 + T1) - v.v = 0 with v the chord (Farin, Curves and Surfaces for CAGD).
fn biarc(first: &CurvePoint, last: &CurvePoint) -> Option<[ProfilePoint; 2]> {
    let ((a0, a1), (b0, b1)) = (first.tangent, last.tangent);
    let (v0, v1) = (last.point.height - first.point.height, last.point.radius - first.point.radius);
    let along = v0 * (a0 + b0) + v1 * (a1 + b1);
    let (square, turn) = (v0 * v0 + v1 * v1, 1.0 - a0 * b0 - a1 * b1);
    let d = square / (along + (along * along + 2.0 * turn * square).sqrt());
    if !(d.is_finite() && d > 0.0) {
        return None;
    }
    let joint = at(
        0.5 * (first.point.height + last.point.height + d * (a0 - b0)),
        0.5 * (first.point.radius + last.point.radius + d * (a1 - b1)),
    );
    let bulge = |from: MeridianPoint, to: MeridianPoint, tangent: (f64, f64)| {
        let (c0, c1) = (to.height - from.height, to.radius - from.radius);
        // Half the arc's angle lies between its first tangent and its chord.
        ((tangent.1 * c0 - tangent.0 * c1).atan2(tangent.0 * c0 + tangent.1 * c1) / 2.0).tan()
    };
    let chord = (last.point.height - joint.height, last.point.radius - joint.radius);
    let length = chord.0.hypot(chord.1);
    // The second arc backward: its last tangent reflected at its chord is its first.
    let (u0, u1) = (chord.0 / length, chord.1 / length);
    let along = b0 * u0 + b1 * u1;
    let tangent = (2.0 * along * u0 - b0, 2.0 * along * u1 - b1);
    Some([
        ProfilePoint { point: first.point, bulge: bulge(first.point, joint, first.tangent) },
        ProfilePoint { point: joint, bulge: bulge(joint, last.point, tangent) },
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave about a cone: bulges and hollows.
    fn wave(share: f64) -> CurvePoint {
        let h = 3.0 + 30.0 * share;
        let slope = 0.2 + 0.5 * 0.4 * (0.4 * h).cos();
        let length = slope.hypot(1.0);
        let point = at(h, 5.0 + 0.2 * h + 0.5 * (0.4 * h).sin());
        CurvePoint { point, tangent: (1.0 / length, slope / length) }
    }

    #[test]
    fn smooth_profiles_keep_the_curve_and_its_tangents() {
        let points = smooth_profile(wave, 1e-5).unwrap();
        let elements = elements(&points).unwrap();
        let hollow = elements.iter().filter(|e| matches!(e, Element::Arc { side: ArcSide::Concave, .. })).count();
        assert!(hollow > 2 && points.len() < 140, "{hollow} hollows, {} points", points.len());
        for pair in elements[1..].windows(2) {
            let (a, b) = (pair[0].contact(1.0), pair[1].contact(0.0));
            assert!((a.point.height - b.point.height).hypot(a.point.radius - b.point.radius) < 1e-9);
            assert!((a.normal_axial - b.normal_axial).abs() < 1e-9, "{a:?} {b:?}");
        }
        for i in 0..=500 {
            let p = wave(f64::from(i) / 500.0).point;
            let p = at(p.height - 3.0, p.radius);
            let off = elements[1..].iter().map(|e| distance(e, p)).fold(f64::INFINITY, f64::min);
            assert!(off < 2e-5, "{p:?} {off}");
        }
    }

    #[test]
    fn a_quarter_circle_has_the_bulge_of_its_definition() {
        let bulge = (std::f64::consts::FRAC_PI_2 / 4.0).tan();
        let point = |h, r, bulge| ProfilePoint { point: at(h, r), bulge };
        let up = elements(&[point(0.0, 5.0, bulge), point(3.0, 8.0, 0.0)]);
        // Its normal at the end points along the axis: no proper flank there.
        assert!(up.is_err());
        let arc = piece(at(0.0, 5.0), at(3.0, 8.0), bulge);
        let Element::Arc { centre, radius, .. } = arc else { panic!("{arc:?}") };
        assert!(
            (radius - 3.0).abs() < 1e-12 && (centre.height - 3.0).abs() < 1e-12 && (centre.radius - 5.0).abs() < 1e-12
        );
        let hollow = piece(at(0.0, 5.0), at(3.0, 8.0), -bulge);
        let Element::Arc { centre, .. } = hollow else { panic!("{hollow:?}") };
        assert!(centre.height.abs() < 1e-12 && (centre.radius - 8.0).abs() < 1e-12);
    }
}
