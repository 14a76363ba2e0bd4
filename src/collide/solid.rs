//! The tool as convex solids of revolution, and the signed distance from each.

use crate::geometry::{Point, Vector};
use crate::motion::Pose;
use crate::tool::meridian::{ArcSide, at};
use crate::tool::{Element, MeridianPoint, Section, Tool};

/// A hollow of the meridian is filled up to chords that leave it by less than this, mm: on the safe side.
const HOLLOW_SAG: f64 = 1e-3;

/// A tool cut into convex solids.
#[derive(Clone, Debug)]
pub struct ToolSolid {
    /// In order from the tip.
    pub(super) pieces: Vec<(Section, Piece)>,
    /// From tip to gauge line, mm.
    pub(super) length: f64,
}

impl ToolSolid {
    /// Takes flutes, shank and holder of a tool. Exact but for hollow arcs, which are filled by up to a micrometre.
    pub fn of(tool: &Tool) -> Self {
        let flutes = tool.flutes().iter().map(|e| (Section::Flute, e));
        let pieces =
            flutes.chain(tool.body()).flat_map(|(section, e)| Piece::of(e).into_iter().map(move |p| (section, p)));
        Self { pieces: pieces.collect(), length: tool.gauge_length() }
    }
}

/// A convex solid of revolution: between two heights, below a meridian that is straight or bulges outward, closed by
/// a disc at each end. Heights and radii in the tool's frame, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    pub(super) low: MeridianPoint,
    pub(super) high: MeridianPoint,
    /// Largest radius.
    pub(super) radius: f64,
    side: Side,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Side {
    Straight,
    Bulge { centre: MeridianPoint, radius: f64 },
}

/// Signed distance of a point from a convex solid, and its gradient: a unit vector, the outward normal of the support
/// plane there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signed {
    /// mm, negative inside.
    pub(super) distance: f64,
    pub(super) normal: Vector,
}

impl Piece {
    /// The solids below an element; none below one that lies flat, which is the end disc of its neighbour.
    fn of(element: &Element) -> Vec<Self> {
        let (low, high) = (element.start(), element.end());
        match element {
            Element::Arc { centre, radius, side: ArcSide::Convex, .. } => {
                let bulge = Side::Bulge { centre: *centre, radius: *radius };
                Self::between(low, high, element.max_radius(), bulge).into_iter().collect()
            }
            Element::Arc { radius, from, to, side: ArcSide::Concave, .. } => {
                // A chord over the angle w leaves the arc by radius w^2 / 8 at most.
                let count = ((to - from).abs() / (8.0 * HOLLOW_SAG / radius).sqrt()).ceil().max(1.0) as usize;
                let corner = |i: usize| element.contact(i as f64 / count as f64).point;
                (0..count).filter_map(|i| Self::straight(corner(i), corner(i + 1))).collect()
            }
            Element::Line { .. } => Self::straight(low, high).into_iter().collect(),
        }
    }

    pub(super) fn straight(low: MeridianPoint, high: MeridianPoint) -> Option<Self> {
        Self::between(low, high, low.radius.max(high.radius), Side::Straight)
    }

    fn between(low: MeridianPoint, high: MeridianPoint, radius: f64, side: Side) -> Option<Self> {
        (high.height > low.height).then_some(Self { low, high, radius, side })
    }

    /// The point of the meridian, or of the discs, that lies farthest along a direction; `radial` is zero or more.
    pub(super) fn support(&self, axial: f64, radial: f64) -> MeridianPoint {
        let along = |p: &MeridianPoint| axial * p.height + radial * p.radius;
        let end = if along(&self.high) > along(&self.low) { self.high } else { self.low };
        let Side::Bulge { centre, radius } = self.side else { return end };
        let length = axial.hypot(radial);
        let top = at(centre.height + radius * axial / length, centre.radius + radius * radial / length);
        let on_arc = length > 0.0 && top.height >= self.low.height && top.height <= self.high.height;
        if on_arc && along(&top) > along(&end) { top } else { end }
    }

    /// No point lies deeper inside, mm.
    pub(super) fn deepest(&self) -> f64 {
        self.radius.min(0.5 * (self.high.height - self.low.height))
    }

    /// Signed distance of a point of the part frame from the solid at a pose.
    pub(super) fn signed(&self, pose: &Pose, point: &Point) -> Signed {
        let axis = pose.axis.into_inner();
        let offset = point - pose.tip;
        let height = axis.dot(&offset);
        let across = offset - axis * height;
        // On the axis any direction across it is a subgradient: the distance grows alike on all sides.
        let outward = across.try_normalize(1e-12).unwrap_or_else(|| any_across(&axis));
        let (distance, axial, radial) = self.signed_in_plane(at(height, across.norm()));
        Signed { distance, normal: axis * axial + outward * radial }
    }

    /// Signed distance in the half plane, with the axial and the radial part of its gradient.
    fn signed_in_plane(&self, p: MeridianPoint) -> (f64, f64, f64) {
        let (foot, normal) = self.nearest_side(p);
        let ends = [(self.low, -1.0), (self.high, 1.0)];
        let discs = ends.map(|(end, out)| (at(end.height, p.radius.min(end.radius)), (out, 0.0)));
        let distance_to = |q: MeridianPoint| (p.height - q.height).hypot(p.radius - q.radius);
        let (mut foot, mut normal, mut distance) = (foot, normal, distance_to(foot));
        for (q, out) in discs {
            let d = distance_to(q);
            if d < distance {
                (foot, normal, distance) = (q, out, d);
            }
        }
        let sign = if self.holds(p) { -1.0 } else { 1.0 };
        if distance > 1e-9 {
            normal = (sign * (p.height - foot.height) / distance, sign * (p.radius - foot.radius) / distance);
        }
        (sign * distance, normal.0, normal.1)
    }

    fn holds(&self, p: MeridianPoint) -> bool {
        let inside = p.height >= self.low.height && p.height <= self.high.height;
        inside
            && match self.side {
                Side::Straight => {
                    let share = (p.height - self.low.height) / (self.high.height - self.low.height);
                    p.radius <= self.low.radius + share * (self.high.radius - self.low.radius)
                }
                Side::Bulge { centre, radius } => {
                    p.radius <= centre.radius || (p.height - centre.height).hypot(p.radius - centre.radius) <= radius
                }
            }
    }

    /// Nearest point of the side between the discs, and the outward normal there.
    fn nearest_side(&self, p: MeridianPoint) -> (MeridianPoint, (f64, f64)) {
        match self.side {
            Side::Straight => {
                let (dh, dr) = (self.high.height - self.low.height, self.high.radius - self.low.radius);
                let square = dh * dh + dr * dr;
                let along = (p.height - self.low.height) * dh + (p.radius - self.low.radius) * dr;
                let share = (along / square).clamp(0.0, 1.0);
                let length = square.sqrt();
                (at(self.low.height + share * dh, self.low.radius + share * dr), (-dr / length, dh / length))
            }
            Side::Bulge { centre, radius } => {
                let (dh, dr) = (p.height - centre.height, p.radius - centre.radius);
                let away = dh.hypot(dr);
                let (axial, radial) = if away > 1e-12 { (dh / away, dr / away) } else { (0.0, 1.0) };
                let height = centre.height + radius * axial;
                if radial >= 0.0 && height >= self.low.height && height <= self.high.height {
                    return (at(height, centre.radius + radius * radial), (axial, radial));
                }
                let distance = |q: MeridianPoint| (p.height - q.height).hypot(p.radius - q.radius);
                let end = if distance(self.low) <= distance(self.high) { self.low } else { self.high };
                (end, ((end.height - centre.height) / radius, (end.radius - centre.radius) / radius))
            }
        }
    }
}

fn any_across(axis: &Vector) -> Vector {
    let helper = if axis.z.abs() < 0.9 { Vector::z() } else { Vector::x() };
    axis.cross(&helper).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Degrees, Direction};
    use crate::tool::{CutterShape, Fixture};
    use proptest::prelude::*;

    fn pieces() -> Vec<Piece> {
        let ball = CutterShape::TaperedBall { ball_diameter: 6.0, half_angle: Degrees(5.0), flute_length: 30.0 };
        let barrel = CutterShape::Barrel {
            diameter: 10.0,
            barrel_radius: 60.0,
            half_angle: Degrees(3.0),
            corner_radius: 1.0,
            flute_length: 20.0,
        };
        let fixture = Fixture { shank_diameter: None, gauge_length: 50.0, holder: vec![at(35.0, 8.0), at(45.0, 20.0)] };
        let tools = [ball, barrel].map(|shape| ToolSolid::of(&Tool::new(1, &shape, &fixture).unwrap()));
        tools.into_iter().flat_map(|t| t.pieces.into_iter().map(|p| p.1)).collect()
    }

    fn point() -> impl Strategy<Value = Point> {
        (-30.0..30.0, -30.0..30.0, -10.0..60.0).prop_map(|(x, y, z)| Point::new(x, y, z))
    }

    const UPRIGHT: fn() -> Pose = || Pose { tip: Point::origin(), axis: Direction::new_normalize(Vector::z()) };

    proptest! {
        /// What every bound rests on: the tangent plane of the distance lies below it everywhere.
        #[test]
        fn distance_is_convex_with_its_unit_gradient(index in 0usize..7, p in point(), q in point()) {
            let pieces = pieces();
            let piece = pieces[index % pieces.len()];
            let (here, there) = (piece.signed(&UPRIGHT(), &p), piece.signed(&UPRIGHT(), &q));
            prop_assert!((here.normal.norm() - 1.0).abs() < 1e-9);
            prop_assert!(there.distance >= here.distance + here.normal.dot(&(q - p)) - 1e-9);
            // The foot lies on the solid.
            let foot = p - here.normal * here.distance;
            prop_assert!(piece.signed(&UPRIGHT(), &foot).distance.abs() < 1e-9);
        }
    }

    #[test]
    fn pieces_fill_the_tool_without_gaps() {
        let shape = CutterShape::Cylinder { diameter: 10.0, corner_radius: 2.0, flute_length: 20.0 };
        let fixture =
            Fixture { shank_diameter: Some(8.0), gauge_length: 60.0, holder: vec![at(40.0, 15.0), at(50.0, 15.0)] };
        let solid = ToolSolid::of(&Tool::new(1, &shape, &fixture).unwrap());
        let corner_end = solid.pieces[0].1.high.height;
        assert!((corner_end - 2.0).abs() < 1e-12);
        let heights: Vec<_> = solid.pieces.iter().map(|(s, p)| (*s, p.low.height, p.high.height)).collect();
        assert_eq!(
            heights,
            [
                (Section::Flute, 0.0, corner_end),
                (Section::Flute, corner_end, 20.0),
                (Section::Shank, 20.0, 40.0),
                (Section::Holder, 40.0, 50.0),
                (Section::Holder, 50.0, 60.0)
            ]
        );
    }

    #[test]
    fn hollow_arcs_are_filled_by_a_micrometre_at_most() {
        let hollow = Element::Arc {
            centre: at(10.0, 30.0),
            radius: 25.0,
            from: -0.4 + std::f64::consts::PI * 1.5,
            to: std::f64::consts::PI * 1.5 - 0.9,
            side: ArcSide::Concave,
        };
        let chords = Piece::of(&hollow);
        for i in 1..100 {
            let contact = hollow.contact(f64::from(i) / 100.0).point;
            let deepest = chords.iter().map(|c| c.signed_in_plane(contact).0).fold(f64::INFINITY, f64::min);
            assert!((-HOLLOW_SAG..1e-9).contains(&deepest), "{i}: {deepest}");
        }
    }
}
