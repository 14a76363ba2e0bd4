//! A tool's cutting profile for those who make it: manufacturability facts, tables, DXF and STL.

use super::meridian::{ArcSide, Element, MeridianPoint};
use super::{ProfilePoint, Tool};
use std::f64::consts::TAU;
use std::fmt::Write;

/// What a grinder needs to know of a flank.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct ProfileFacts {
    /// Height of the flank, mm.
    pub flute_length_mm: f64,
    /// Smallest and largest radius of the flank, mm.
    pub radius_mm: [f64; 2],
    /// Smallest radius of curvature where the flank bulges, with its height, mm; none where it never does.
    pub smallest_bulge_mm: Option<[f64; 2]>,
    /// Smallest radius of curvature where it is hollow, with its height, mm: a wheel must be smaller.
    pub smallest_hollow_mm: Option<[f64; 2]>,
    /// Heights between which it is hollow, mm, in order.
    pub hollows_mm: Vec<[f64; 2]>,
    /// True where the radius never falls, or never rises, from tip to shank.
    pub monotone: bool,
    /// Largest angle by which two pieces of the flank fail to be tangent, degrees.
    pub sharpest_joint_deg: f64,
}

/// Hollow pieces nearer to each other than this are one, mm.
const APART: f64 = 1e-9;
/// Radii of curvature above this are straight for a grinder, mm.
const STRAIGHT: f64 = 1e5;

/// The facts of a tool's flank: the flat bottom is left out.
pub fn facts(tool: &Tool) -> ProfileFacts {
    let flank: Vec<&Element> = tool.flutes().iter().filter(|e| e.end().height > e.start().height).collect();
    let mut facts = ProfileFacts {
        flute_length_mm: tool.flute_length(),
        radius_mm: [f64::INFINITY, 0.0],
        smallest_bulge_mm: None,
        smallest_hollow_mm: None,
        hollows_mm: Vec::new(),
        monotone: true,
        sharpest_joint_deg: 0.0,
    };
    let (mut rises, mut falls) = (false, false);
    for element in &flank {
        for share in [0.0, 0.5, 1.0] {
            let contact = element.contact(share);
            facts.radius_mm[0] = facts.radius_mm[0].min(contact.point.radius);
            rises |= contact.normal_axial < -1e-9;
            falls |= contact.normal_axial > 1e-9;
        }
        facts.radius_mm[1] = facts.radius_mm[1].max(element.max_radius());
        let Element::Arc { radius, side, .. } = element else { continue };
        if *radius > STRAIGHT {
            continue;
        }
        let (low, high) = (element.start().height, element.end().height);
        let smallest = match side {
            ArcSide::Convex => &mut facts.smallest_bulge_mm,
            ArcSide::Concave => {
                match facts.hollows_mm.last_mut().filter(|hollow| low - hollow[1] < APART) {
                    Some(hollow) => hollow[1] = high,
                    None => facts.hollows_mm.push([low, high]),
                }
                &mut facts.smallest_hollow_mm
            }
        };
        if smallest.is_none_or(|known| *radius < known[0]) {
            *smallest = Some([*radius, 0.5 * (low + high)]);
        }
    }
    facts.monotone = !(rises && falls);
    for pair in flank.windows(2) {
        let (a, b) = (pair[0].contact(1.0), pair[1].contact(0.0));
        let cross = a.normal_axial * b.normal_radial - a.normal_radial * b.normal_axial;
        facts.sharpest_joint_deg = facts.sharpest_joint_deg.max(cross.abs().min(1.0).asin().to_degrees());
    }
    facts
}

/// The flank as points with bulges, from the tip upward.
pub fn profile(tool: &Tool) -> Vec<ProfilePoint> {
    let mut points = Vec::new();
    let mut last = None;
    for element in tool.flutes().iter().filter(|e| e.end().height > e.start().height) {
        let bulge = match element {
            Element::Line { .. } => 0.0,
            Element::Arc { from, to, side, .. } => {
                let size = ((to - from).abs() / 4.0).tan();
                if *side == ArcSide::Convex { size } else { -size }
            }
        };
        points.push(ProfilePoint { point: element.start(), bulge });
        last = Some(element.end());
    }
    points.extend(last.map(|point| ProfilePoint { point, bulge: 0.0 }));
    // Ends of arcs are computed, so the tip may be off by rounding.
    if let Some(first) = points.first_mut().filter(|first| first.point.height.abs() < 1e-9) {
        first.point.height = 0.0;
    }
    points
}

/// The flank as a table for people and spreadsheets: height, radius and outward normal at most `step` mm apart.
pub fn csv(tool: &Tool, step: f64) -> String {
    let mut text = "height_mm,radius_mm,normal_axial,normal_radial\n".to_owned();
    let flank: Vec<&Element> = tool.flutes().iter().filter(|e| e.end().height > e.start().height).collect();
    for (i, element) in flank.iter().enumerate() {
        let steps = (element.length() / step).ceil().clamp(1.0, 1e4) as usize;
        let count = if i + 1 == flank.len() { steps + 1 } else { steps };
        for k in 0..count {
            let contact = element.contact(k as f64 / steps as f64);
            let MeridianPoint { height, radius } = contact.point;
            let _ = writeln!(text, "{height:.9},{radius:.9},{:.9},{:.9}", contact.normal_axial, contact.normal_radial);
        }
    }
    text
}

/// The profile as an ASCII DXF drawing (release 12, mm): one polyline with exact arcs, X the radius, Y the height, on
/// layer FLANK; the axis as a line on layer AXIS.
pub fn dxf(tool: &Tool) -> String {
    let points = profile(tool);
    let top = tool.flute_length();
    let mut text = String::new();
    let mut pair = |code: u32, value: &str| {
        let _ = writeln!(text, "{code:>3}\n{value}");
    };
    let number = |value: f64| format!("{value:.12}");
    for (code, value) in [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1009"), (0, "ENDSEC")] {
        pair(code, value);
    }
    for (code, value) in [(0, "SECTION"), (2, "ENTITIES"), (0, "LINE"), (8, "AXIS")] {
        pair(code, value);
    }
    for (code, value) in [(10, 0.0), (20, 0.0), (30, 0.0), (11, 0.0), (21, top), (31, 0.0)] {
        pair(code, &number(value));
    }
    for (code, value) in [(0, "POLYLINE"), (8, "FLANK"), (66, "1"), (70, "0"), (10, "0.0"), (20, "0.0"), (30, "0.0")] {
        pair(code, value);
    }
    for ProfilePoint { point, bulge } in points {
        pair(0, "VERTEX");
        pair(8, "FLANK");
        for (code, value) in [(10, point.radius), (20, point.height), (30, 0.0), (42, bulge)] {
            pair(code, &number(value));
        }
    }
    for (code, value) in [(0, "SEQEND"), (8, "FLANK"), (0, "ENDSEC"), (0, "EOF")] {
        pair(code, value);
    }
    text
}

/// The body of revolution of the flutes as a closed binary STL (mm, axis along +Z, tip at the origin), its facets
/// within about `chord` mm of it.
pub fn stl(tool: &Tool, chord: f64) -> Vec<u8> {
    let mut outline: Vec<MeridianPoint> = Vec::new();
    for element in tool.flutes() {
        let steps = match element {
            Element::Line { .. } => 1,
            // The chord of an arc of angle a leaves it by R a^2 / 8.
            Element::Arc { radius, from, to, .. } => steps_of((to - from).abs(), *radius, chord),
        };
        outline.extend((0..steps).map(|k| element.contact(k as f64 / steps as f64).point));
    }
    outline.extend(tool.flutes().last().map(Element::end));
    outline.push(MeridianPoint { height: tool.flute_length(), radius: 0.0 });
    let around = steps_of(TAU, tool.max_radius(), chord).max(16);
    let at = |p: MeridianPoint, i: usize| {
        let (sin, cos) = (TAU * (i % around) as f64 / around as f64).sin_cos();
        // The sum turns a negative zero, which readers tell from zero, into zero.
        [p.radius * cos, p.radius * sin, p.height].map(|value| value + 0.0)
    };
    let mut triangles: Vec<[[f64; 3]; 3]> = Vec::new();
    for pair in outline.windows(2) {
        let (low, high) = (pair[0], pair[1]);
        for i in 0..around {
            let (a, b, c, d) = (at(low, i), at(low, i + 1), at(high, i + 1), at(high, i));
            if low.radius > 0.0 {
                triangles.push([a, b, c]);
            }
            if high.radius > 0.0 {
                triangles.push([a, c, d]);
            }
        }
    }
    binary_stl(b"tool flutes, mm, axis +Z, tip at the origin", &triangles)
}

/// Pieces into which an arc is cut so that its chords leave it by at most `chord`.
fn steps_of(angle: f64, radius: f64, chord: f64) -> usize {
    (angle / (8.0 * chord / radius.max(chord)).sqrt()).ceil().clamp(1.0, 2000.0) as usize
}

/// A binary STL file; `title` goes into its header, which holds 80 bytes.
pub(crate) fn binary_stl(title: &[u8], triangles: &[[[f64; 3]; 3]]) -> Vec<u8> {
    let mut bytes: Vec<u8> = title.iter().copied().chain(std::iter::repeat(0)).take(80).collect();
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for [a, b, c] in triangles {
        let edge = |p: &[f64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
        let (u, v) = (edge(b), edge(c));
        let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = n.iter().map(|x| x * x).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        for value in n.map(|x| x / length).iter().chain(a).chain(b).chain(c) {
            bytes.extend((*value as f32).to_le_bytes());
        }
        bytes.extend([0, 0]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool::meridian::at;
    use crate::tool::profile::{CurvePoint, smooth_profile};
    use crate::tool::{CutterShape, Fixture};

    fn wave() -> Tool {
        let points = smooth_profile(
            |share| {
                let h = 30.0 * share;
                let slope = 0.2 * (0.4 * h).cos();
                let length = slope.hypot(1.0);
                CurvePoint { point: at(h, 5.0 + 0.5 * (0.4 * h).sin()), tangent: (1.0 / length, slope / length) }
            },
            1e-5,
        );
        let fixture = Fixture { gauge_length: 80.0, ..Fixture::default() };
        Tool::new(3, &CutterShape::Meridian { points: points.unwrap() }, &fixture).unwrap()
    }

    #[test]
    fn facts_of_a_wave_are_those_of_its_formula() {
        let facts = facts(&wave());
        // rho = 5 + 0.5 sin(0.4 h): curvature 0.5 * 0.16 at the crests, hollow where the sine is negative.
        let crest = 1.0 / (0.5 * 0.16);
        assert!((facts.smallest_bulge_mm.unwrap()[0] - crest).abs() < 0.02 * crest, "{facts:?}");
        assert!((facts.smallest_hollow_mm.unwrap()[0] - crest).abs() < 0.02 * crest, "{facts:?}");
        let zero = std::f64::consts::PI / 0.4;
        assert_eq!(facts.hollows_mm.len(), 2, "{facts:?}");
        assert!((facts.hollows_mm[0][0] - zero).abs() < 0.5 && (facts.hollows_mm[0][1] - 2.0 * zero).abs() < 0.5);
        assert!(!facts.monotone && facts.sharpest_joint_deg < 1e-6);
        assert!((facts.radius_mm[1] - 5.5).abs() < 1e-3 && (facts.radius_mm[0] - 4.5).abs() < 1e-3);
    }

    #[test]
    fn the_profile_gives_the_tool_back() {
        let tool = wave();
        let fixture = Fixture { gauge_length: 80.0, ..Fixture::default() };
        let again = Tool::new(3, &CutterShape::Meridian { points: profile(&tool) }, &fixture).unwrap();
        for i in 0..=300 {
            let h = tool.flute_length() * f64::from(i) / 300.0;
            let (a, b) = (tool.contact_at(h).unwrap(), again.contact_at(h).unwrap());
            assert!((a.point.radius - b.point.radius).abs() < 1e-12, "{a:?} {b:?}");
            assert!((a.normal_axial - b.normal_axial).abs() < 1e-9, "{a:?} {b:?}");
        }
    }

    #[test]
    fn stl_is_a_closed_body_of_the_right_volume() {
        let tool = wave();
        let bytes = stl(&tool, 0.005);
        let mesh = stl_io::read_stl(&mut std::io::Cursor::new(bytes)).unwrap();
        mesh.validate().unwrap();
        let volume: f64 = mesh
            .faces
            .iter()
            .map(|face| {
                let [a, b, c] =
                    face.vertices.map(|i| crate::geometry::Vector::from_iterator(mesh.vertices[i].0.map(f64::from)));
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        let steps = 3000;
        let exact: f64 = (0..steps)
            .map(|i| {
                let h = 30.0 * (f64::from(i) + 0.5) / f64::from(steps);
                std::f64::consts::PI * (5.0 + 0.5 * (0.4 * h).sin()).powi(2) * 30.0 / f64::from(steps)
            })
            .sum();
        assert!((volume - exact).abs() < 3e-3 * exact, "{volume} {exact}");
    }

    #[test]
    fn dxf_holds_the_profile_as_pairs_of_codes_and_values() {
        let tool = wave();
        let text = dxf(&tool);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len() % 2, 0);
        let pairs: Vec<(u32, &str)> = lines.chunks(2).map(|c| (c[0].trim().parse().unwrap(), c[1])).collect();
        assert_eq!(pairs.last(), Some(&(0, "EOF")));
        let vertices: Vec<ProfilePoint> = pairs
            .split(|pair| pair.0 == 0)
            .filter(|group| group.first() == Some(&(8, "FLANK")) && group.iter().any(|p| p.0 == 42))
            .map(|group| {
                let value = |code: u32| group.iter().find(|p| p.0 == code).unwrap().1.parse::<f64>().unwrap();
                ProfilePoint { point: at(value(20), value(10)), bulge: value(42) }
            })
            .collect();
        let wanted = profile(&tool);
        assert_eq!(vertices.len(), wanted.len());
        for (got, want) in vertices.iter().zip(&wanted) {
            assert!((got.point.radius - want.point.radius).abs() < 1e-11);
            assert!((got.point.height - want.point.height).abs() < 1e-11 && (got.bulge - want.bulge).abs() < 1e-11);
        }
    }

    #[test]
    fn csv_rows_lie_on_the_flank() {
        let tool = wave();
        let text = csv(&tool, 0.25);
        let mut last = -1.0;
        for line in text.lines().skip(1) {
            let values: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let contact = tool.contact_at(values[0]).unwrap();
            assert!(values[0] > last && (contact.point.radius - values[1]).abs() < 1e-8, "{line}");
            last = values[0];
        }
        assert!((last - tool.flute_length()).abs() < 1e-8);
    }
}
