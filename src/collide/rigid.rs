//! The smallest distance of two rigid bodies during a motion, continuous in time.
//!
//! For any unit vector n, the gap between two convex pieces along n is a lower bound of their distance, negative where
//! they overlap. In a stretch of the motion every point of the moving piece stays near the chord between its places at
//! both ends, so the smaller gap of the two ends, less how far points leave their chords, holds in all of the stretch.
//! Branching over time and over the pieces of both bodies with these bounds gives the smallest distance with a guarantee.
//!
//! A closed mesh is its skin in this, and its inside: what meets no skin during a motion is inside all the time or never,
//! so one instant tells.

use super::convex::{Convex, separation};
use super::solid::{Piece, ToolSolid};
use crate::geometry::{Aabb, Point, RigidMotion, TriangleMesh, Vector};
use crate::tool::Section;
use crate::tool::meridian::at;

/// A continuous motion of one body as seen from another over shares 0 to 1.
pub trait RigidSweep {
    /// Takes the moving body from where it is described to where it is at a share, frame of the other body.
    fn motion(&self, share: f64) -> RigidMotion;

    /// No point of the moving body has a larger second derivative of its place by the share, mm.
    fn acceleration(&self) -> f64;
}

/// A rigid body as a tree of convex pieces, in a frame of its own, mm.
#[derive(Clone, Debug)]
pub struct Rigid {
    /// The first node is the root; of a node with children the first follows it.
    nodes: Vec<Node>,
    /// A point of each of its pieces that hang together.
    anchors: Vec<Point>,
    /// The closed mesh that the nodes are the skin of.
    solid: Option<Box<TriangleMesh>>,
}

#[derive(Clone, Debug)]
struct Node {
    form: Convex,
    /// Length of the diagonal of its box.
    size: f64,
    /// Index of the second child; 0 in a leaf.
    second: usize,
}

/// The smallest distance in a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearing {
    /// Share of the motion, 0 to 1.
    pub share: f64,
    /// Distance there and then, mm, negative where the bodies overlap: then the length of the shortest way that would
    /// part the pieces that overlap most. Guaranteed: nowhere in the motion is it smaller by more than the resolution, and
    /// a thousandth of a depth. Of a body that stays inside a closed mesh it is the depth of one point at the start.
    pub distance: f64,
}

/// Share of a depth to which it is known.
const DEPTH_SHARE: f64 = 1e-3;
/// An interval of shares that is not halved further.
const INSTANT: f64 = 1e-12;
/// While an interval of time is wide, pieces need not be smaller than this share of the way that they go in it.
const SIZE_PER_WAY: f64 = 0.5;

impl Rigid {
    /// A box between two corners, each coordinate of the first below that of the second.
    pub fn cuboid(low: Point, high: Point) -> Self {
        Self::of(vec![Convex::around(&Aabb { low, high })])
    }

    /// A cylinder from the middle of one end along a unit axis; a radius of zero makes it a line. `None` where it has no
    /// length.
    pub fn cylinder(base: Point, axis: Vector, radius: f64, length: f64) -> Option<Self> {
        let piece = Piece::straight(at(0.0, radius), at(length, radius))?;
        Some(Self::of(vec![Convex::Round { foot: base, axis, piece }]))
    }

    /// The surface of a mesh, in one piece.
    pub fn mesh(triangles: &[[Point; 3]]) -> Self {
        Self::of(triangles.iter().map(|corners| Convex::Triangle(*corners)).collect())
    }

    /// What a mesh bounds with its triangles outward; of an open one only the surface.
    pub fn solid(mesh: TriangleMesh) -> Self {
        let faces = 0..mesh.triangles().len();
        let skin = Self::of(faces.map(|face| Convex::Triangle(mesh.corners(face))).collect());
        let anchors = mesh.topology().first_of_components().into_iter().map(|face| mesh.corners(face)[0]).collect();
        let solid = mesh.topology().is_closed().then(|| Box::new(mesh));
        Self { anchors, solid, ..skin }
    }

    /// The same with the inside of a closed mesh whose skin it follows, as far as that is known.
    #[must_use]
    pub fn with_inside(self, mesh: &TriangleMesh) -> Self {
        let solid = mesh.topology().is_closed().then(|| Box::new(mesh.clone()));
        Self { solid, ..self }
    }

    /// One section of a tool whose tip stands at `tip`; `None` where the tool has none.
    pub fn section(tool: &ToolSolid, section: Section, tip: Point, axis: Vector) -> Option<Self> {
        let pieces = tool.pieces.iter().filter(|(own, _)| *own == section);
        let pieces: Vec<_> = pieces.map(|(_, piece)| Convex::Round { foot: tip, axis, piece: *piece }).collect();
        (!pieces.is_empty()).then(|| Self::of(pieces))
    }

    fn of(pieces: Vec<Convex>) -> Self {
        let anchors = pieces.first().map(|piece| piece.support(&Vector::x())).into_iter().collect();
        let mut rigid = Self { nodes: Vec::with_capacity(2 * pieces.len()), anchors, solid: None };
        let mut boxed: Vec<(Aabb, Convex)> = pieces.into_iter().map(|piece| (piece.bounds(), piece)).collect();
        rigid.grow(&mut boxed);
        rigid
    }

    fn grow(&mut self, pieces: &mut [(Aabb, Convex)]) {
        let bounds = pieces.iter().fold(Aabb::empty(), |sum, (bounds, _)| sum.union(bounds));
        let index = self.nodes.len();
        let size = bounds.diagonal();
        match pieces {
            [] => {}
            [(_, piece)] => self.nodes.push(Node { form: piece.clone(), size, second: 0 }),
            _ => {
                self.nodes.push(Node { form: Convex::around(&bounds), size, second: 0 });
                let centres = pieces.iter().fold(Aabb::empty(), |sum, (bounds, _)| {
                    sum.union(&Aabb { low: bounds.centre(), high: bounds.centre() })
                });
                let axis = (centres.high - centres.low).imax();
                pieces.sort_by(|(a, _), (b, _)| a.centre()[axis].total_cmp(&b.centre()[axis]));
                let (first, second) = pieces.split_at_mut(pieces.len() / 2);
                self.grow(first);
                self.nodes[index].second = self.nodes.len();
                self.grow(second);
            }
        }
    }

    /// Middle and radius of a ball that holds it; `None` for a body of nothing.
    pub fn ball(&self) -> Option<(Point, f64)> {
        let bounds = self.nodes.first()?.form.bounds();
        Some((bounds.centre(), 0.5 * bounds.diagonal()))
    }

    /// How deep a point lies inside its closed mesh, mm; `None` outside, or without one.
    fn depth_of(&self, p: &Point) -> Option<f64> {
        let (mesh, root) = (self.solid.as_ref()?, self.nodes.first()?);
        // Most points are far from most bodies.
        if root.form.bounds().distance_squared(p) > 0.0 {
            return None;
        }
        let distance = mesh.closest(p).signed_distance;
        (distance < 0.0).then_some(-distance)
    }
}

/// How deep a piece of one body lies inside the other, where neither meets the other's skin, mm.
fn swallowed(motion: &RigidMotion, moving: &Rigid, fixed: &Rigid) -> Option<f64> {
    let of_moving = moving.anchors.iter().filter_map(|anchor| fixed.depth_of(&(motion * anchor)));
    let of_fixed = fixed.anchors.iter().filter_map(|anchor| moving.depth_of(&motion.inverse_transform_point(anchor)));
    of_moving.chain(of_fixed).reduce(f64::max)
}

/// The smallest distance of a moving body from another, if it is below `margin` mm. `hint` is a unit vector that parted
/// them before, or any; a better one is left in it. What is not reported keeps the margin less the resolution, mm.
pub fn nearing(
    sweep: &impl RigidSweep,
    (moving, fixed): (&Rigid, &Rigid),
    (margin, resolution): (f64, f64),
    hint: &mut Vector,
) -> Option<Nearing> {
    let (Some(a), Some(b)) = (moving.nodes.first(), fixed.nodes.first()) else { return None };
    let acceleration = sweep.acceleration();
    let whole = Interval::new(0.0, 1.0, [sweep.motion(0.0), sweep.motion(1.0)], acceleration);
    // Most motions stay clear, and most of these by the direction that parted the bodies in the motion before.
    if whole.least(&a.form, &b.form, hint) >= margin {
        return None;
    }
    let search = Search { sweep, moving, fixed, resolution, acceleration };
    let found = search.run(whole, margin, hint);
    if found.is_some_and(|near| near.distance < 0.0) {
        return found;
    }
    let inside = swallowed(&whole.ends[0], moving, fixed);
    inside.map(|depth| Nearing { share: 0.0, distance: -depth }).or(found)
}

struct Search<'a, S> {
    sweep: &'a S,
    moving: &'a Rigid,
    fixed: &'a Rigid,
    resolution: f64,
    acceleration: f64,
}

/// A stretch of the motion.
#[derive(Clone, Copy)]
struct Interval {
    from: f64,
    to: f64,
    ends: [RigidMotion; 2],
    /// How far points leave their chords.
    bend: f64,
}

/// A stretch of the motion and a node of either body, yet to be looked at.
struct Open {
    interval: Interval,
    nodes: [usize; 2],
    least: f64,
}

impl Interval {
    fn new(from: f64, to: f64, ends: [RigidMotion; 2], acceleration: f64) -> Self {
        Self { from, to, ends, bend: acceleration * (to - from).powi(2) / 8.0 }
    }

    fn middle(&self) -> f64 {
        0.5 * (self.from + self.to)
    }

    /// Gap along a unit vector that holds in all of the stretch.
    fn least(&self, a: &Convex, b: &Convex, n: &Vector) -> f64 {
        let low = |motion: &RigidMotion| {
            let farthest = a.support(&-motion.inverse_transform_vector(n));
            n.dot(&(motion * farthest).coords)
        };
        low(&self.ends[0]).min(low(&self.ends[1])) - n.dot(&b.support(n).coords) - self.bend
    }

    /// About how far a node goes.
    fn way(&self, node: &Node) -> f64 {
        let centre = node.form.support(&Vector::x());
        (self.ends[1] * centre - self.ends[0] * centre).norm() + self.bend
    }
}

impl<S: RigidSweep> Search<'_, S> {
    fn run(&self, whole: Interval, margin: f64, hint: &mut Vector) -> Option<Nearing> {
        let mut best: Option<Nearing> = None;
        let mut limit = margin - self.resolution;
        let mut open = vec![Open { interval: whole, nodes: [0, 0], least: f64::NEG_INFINITY }];
        while let Some(Open { interval, nodes, least }) = open.pop() {
            if least >= limit {
                continue;
            }
            let [a, b] = [&self.moving.nodes[nodes[0]], &self.fixed.nodes[nodes[1]]];
            // What parts the whole bodies parts most of their pieces.
            if interval.least(&a.form, &b.form, hint) >= limit {
                continue;
            }
            let middle = self.sweep.motion(interval.middle());
            let (apart, n) = separation(&a.form, &middle, &b.form, hint);
            if open.is_empty() {
                *hint = n;
            }
            let leaves = a.second == 0 && b.second == 0;
            if leaves && apart < best.map_or(margin, |best| best.distance) {
                best = Some(Nearing { share: interval.middle(), distance: apart });
                limit = limit.min(apart - self.resolution - DEPTH_SHARE * (-apart).max(0.0));
            }
            let least = interval.least(&a.form, &b.form, &n);
            if least < limit {
                self.split(&mut open, (&interval, &middle), nodes, least);
            }
        }
        best
    }

    /// Halves the time, or takes the larger node apart; what is likelier to come nearer is looked at first.
    fn split(
        &self,
        open: &mut Vec<Open>,
        (interval, middle): (&Interval, &RigidMotion),
        nodes: [usize; 2],
        least: f64,
    ) {
        let [a, b] = [&self.moving.nodes[nodes[0]], &self.fixed.nodes[nodes[1]]];
        let apart = |node: &Node| if node.second == 0 { 0.0 } else { node.size };
        let largest = apart(a).max(apart(b));
        if largest == 0.0 || largest < SIZE_PER_WAY * interval.way(a) {
            if interval.to - interval.from > INSTANT {
                let (from, to, half) = (interval.from, interval.to, interval.middle());
                let [start, end] = interval.ends;
                let halves = [(from, half, [start, *middle]), (half, to, [*middle, end])];
                open.extend(halves.map(|(from, to, ends)| {
                    let interval = Interval::new(from, to, ends, self.acceleration);
                    Open { interval, nodes, least }
                }));
            }
            return;
        }
        let children = |node: &Node, index: usize| [index + 1, node.second];
        let pairs = if apart(a) >= apart(b) {
            children(a, nodes[0]).map(|child| [child, nodes[1]])
        } else {
            children(b, nodes[1]).map(|child| [nodes[0], child])
        };
        open.extend(pairs.map(|nodes| Open { interval: *interval, nodes, least }));
    }
}

#[cfg(test)]
#[path = "rigid_tests.rs"]
mod tests;
