//! Everything rigid on a machine with a part and a tool, and how near any two of it come. Uses `collide`, `diagnostic`,
//! `geometry` and `tool`.
//!
//! Two bodies are looked at when more than one axis lies between them; bodies of one link or of neighbours are made to be
//! near each other. The tool is never too near the part here, but for ways on which it does not cut: what it cuts is judged
//! elsewhere.

use super::axes::AxisPosition;
use super::bodies::{Body, Link, NEAR_MISS};
use super::links::{AxisCourse, LinkSweep, Place};
use super::setup::Setup;
use crate::collide::{Rigid, ToolSolid, nearing};
use crate::diagnostic::Result;
use crate::geometry::{Aabb, Point, RigidMotion, TriangleMesh, Vector};
use crate::tool::{Section, Tool};
use nalgebra::UnitQuaternion;

/// How exactly distances are followed, mm.
const RESOLUTION: f64 = 5e-4;
/// Touch that is no collision, mm.
const TOUCH: f64 = 1e-3;
/// How deep the tool may graze the finished part where it does not cut, mm: tolerance of the part, and its facets.
const GRAZE: f64 = 0.05;

/// What the part is called.
pub const PART: &str = "part";

/// What a member of a scene is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Machine,
    Fixture,
    Tool,
    Part,
    /// Skin of the finished part, and surfaces to stay clear of.
    Finished,
}

#[derive(Clone, Debug)]
struct Member {
    name: String,
    kind: Kind,
    place: Place,
    rigid: Rigid,
    ball: (Point, f64),
    near_miss: f64,
}

/// Bodies, fixtures, tool and part on a machine.
#[derive(Clone, Debug)]
pub struct Scene {
    setup: Setup,
    members: Vec<Member>,
    /// The member on the head's side, or farther out, first.
    pairs: Vec<[usize; 2]>,
}

/// Two bodies that come too near each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encounter {
    /// Index of the pair, see [`Scene::names`].
    pub pair: usize,
    /// When they are nearest, share of the course.
    pub share: f64,
    /// How near, mm; below zero they overlap that deep. Not smaller anywhere in the course by more than half a micrometre,
    /// and a thousandth of a depth.
    pub distance: f64,
}

impl Encounter {
    /// Whether it is more than a touch.
    pub fn is_collision(&self) -> bool {
        self.distance < -TOUCH
    }
}

/// For each pair the direction that parted it last; it makes the next look quick.
#[derive(Clone, Debug)]
pub struct Hints(Vec<Vector>);

impl Scene {
    /// Nothing to look at.
    pub fn empty(setup: &Setup) -> Self {
        Self { setup: setup.clone(), members: Vec::new(), pairs: Vec::new() }
    }

    /// The bodies of a machine.
    ///
    /// # Errors
    /// A body whose file has not been read.
    pub fn new(setup: &Setup) -> Result<Self> {
        let mut scene = Self::empty(setup);
        for body in &setup.machine().bodies {
            scene.add(Kind::Machine, &body.name, body.link, body.near_miss, Some(body.rigid(Vector::zeros())?));
        }
        scene.pair();
        Ok(scene)
    }

    /// The same with fixtures, which are given in the part frame.
    pub fn with_fixtures(mut self, fixtures: &[Body]) -> Result<Self> {
        let zero = Vector::from(self.setup.work_offset());
        for body in fixtures {
            self.add(Kind::Fixture, &body.name, Link::Table, body.near_miss, Some(body.rigid(zero)?));
        }
        self.pair();
        Ok(self)
    }

    /// The same with a tool in the spindle.
    #[must_use]
    pub fn with_tool(mut self, tool: &Tool) -> Self {
        let (solid, tip, axis) = (ToolSolid::of(tool), self.tip(), self.setup.machine().spindle.axis.into_inner());
        for (name, section) in [("flutes", Section::Flute), ("shank", Section::Shank), ("holder", Section::Holder)] {
            let rigid = Rigid::section(&solid, section, tip, axis);
            self.add(Kind::Tool, name, Link::Spindle, 0.0, rigid);
        }
        self.pair();
        self
    }

    /// The same with the axis of a tool of which only the length is known.
    #[must_use]
    pub fn with_tool_axis(mut self) -> Self {
        let axis = self.setup.machine().spindle.axis.into_inner();
        let line = Rigid::cylinder(self.tip(), axis, 0.0, self.setup.tool_length());
        self.add(Kind::Tool, "axis of the tool", Link::Spindle, 0.0, line);
        self.pair();
        self
    }

    /// The same with the part's surface as triangles, part frame: only the machine's bodies must stay clear of it.
    #[must_use]
    pub fn with_part(mut self, triangles: &[[Point; 3]]) -> Self {
        self.add(Kind::Part, PART, Link::Table, 0.0, Some(self.on_table(triangles)));
        self.pair();
        self
    }

    /// The same with a box that holds the part, part frame.
    #[must_use]
    pub fn with_part_box(mut self, bounds: &Aabb) -> Self {
        let zero = Vector::from(self.setup.work_offset());
        let rigid = Rigid::cuboid(bounds.low + zero, bounds.high + zero);
        self.add(Kind::Part, PART, Link::Table, 0.0, Some(rigid));
        self.pair();
        self
    }

    /// The same with a surface of the finished part as triangles, part frame, for ways on which the tool does not cut.
    /// `whole` is the mesh that they follow; a closed one has an inside.
    #[must_use]
    pub fn with_finished(mut self, name: &str, triangles: &[[Point; 3]], whole: Option<&TriangleMesh>) -> Self {
        let zero = RigidMotion::from_parts(Vector::from(self.setup.work_offset()).into(), UnitQuaternion::identity());
        let skin = self.on_table(triangles);
        let rigid = match whole {
            Some(mesh) => skin.with_inside(&mesh.transformed(&zero)),
            None => skin,
        };
        self.add(Kind::Finished, name, Link::Table, NEAR_MISS, Some(rigid));
        self.pair();
        self
    }

    fn on_table(&self, triangles: &[[Point; 3]]) -> Rigid {
        let zero = Vector::from(self.setup.work_offset());
        Rigid::mesh(&triangles.iter().map(|corners| corners.map(|corner| corner + zero)).collect::<Vec<_>>())
    }

    fn tip(&self) -> Point {
        Point::from(self.setup.tip_at_zero())
    }

    fn add(&mut self, kind: Kind, name: &str, link: Link, near_miss: f64, rigid: Option<Rigid>) {
        let Some((rigid, ball)) = rigid.and_then(|rigid| rigid.ball().map(|ball| (rigid, ball))) else { return };
        let place = Place::of(self.setup.machine(), link);
        self.members.push(Member { name: name.to_owned(), kind, place, rigid, ball, near_miss });
    }

    fn pair(&mut self) {
        let met = |a: &Member, b: &Member| {
            let kinds = [a.kind, b.kind];
            let part = kinds.contains(&Kind::Part) && !kinds.contains(&Kind::Machine);
            !part && !a.place.joins(&b.place)
        };
        let count = self.members.len();
        let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        let met: Vec<_> = all.filter(|[a, b]| met(&self.members[*a], &self.members[*b])).collect();
        // What moves more is what runs into the other.
        let rank = |index: usize| {
            let place = self.members[index].place;
            (place.side == super::model::Carrier::Head, place.axes)
        };
        self.pairs = met.into_iter().map(|[a, b]| if rank(a) >= rank(b) { [a, b] } else { [b, a] }).collect();
    }

    /// Whether there is anything to look at.
    pub fn is_empty(&self) -> bool {
        self.pairs.is_empty()
    }

    /// Names of both bodies of a pair.
    pub fn names(&self, pair: usize) -> [&str; 2] {
        self.pairs.get(pair).map_or(["", ""], |pair| pair.map(|index| self.members[index].name.as_str()))
    }

    /// Whether a pair is the tool and what it works on.
    pub(super) fn is_work(&self, pair: usize) -> bool {
        let is = |kind| self.pairs.get(pair).is_some_and(|pair| pair.iter().any(|i| self.members[*i].kind == kind));
        is(Kind::Tool) && is(Kind::Finished)
    }

    /// Whether two bodies run into each other, the tool into the finished part only where it does not just graze it.
    pub(super) fn collides(&self, met: &Encounter) -> bool {
        if self.is_work(met.pair) { met.distance < -GRAZE } else { met.is_collision() }
    }

    /// Directions to begin with.
    pub fn hints(&self) -> Hints {
        Hints(vec![Vector::z(); self.pairs.len()])
    }

    /// Every pair that comes nearer in a course than either body allows.
    pub fn encounters(&self, course: &impl AxisCourse, hints: &mut Hints) -> Vec<Encounter> {
        let margin = |[a, b]: [&Member; 2]| a.near_miss.max(b.near_miss);
        self.nearer(course, hints, margin)
    }

    /// Every pair that overlaps, or comes nearer in a course than `room` mm.
    pub(super) fn within(&self, course: &impl AxisCourse, room: f64) -> Vec<Encounter> {
        self.nearer(course, &mut self.hints(), |_| room)
    }

    fn nearer(
        &self,
        course: &impl AxisCourse,
        hints: &mut Hints,
        margin: impl Fn([&Member; 2]) -> f64,
    ) -> Vec<Encounter> {
        let ends = [0.0, 1.0].map(|share| course.axes(share));
        let placed: Vec<[RigidMotion; 2]> = self.placed(&ends);
        let mut found = Vec::new();
        for (pair, ([a, b], hint)) in self.pairs.iter().zip(&mut hints.0).enumerate() {
            let (moving, fixed) = (&self.members[*a], &self.members[*b]);
            let places = [moving.place, fixed.place];
            let acceleration = self.setup.acceleration([&places[0], &places[1]], moving.ball, course);
            let ends = [0, 1].map(|end| placed[*b][end].inverse() * placed[*a][end]);
            let sweep = LinkSweep { setup: &self.setup, course, places, ends, acceleration };
            let wanted = (margin([moving, fixed]), RESOLUTION);
            if let Some(near) = nearing(&sweep, (&moving.rigid, &fixed.rigid), wanted, hint) {
                found.push(Encounter { pair, share: near.share, distance: near.distance });
            }
        }
        found
    }

    /// Where each member is at both ends of a course.
    fn placed(&self, ends: &[AxisPosition; 2]) -> Vec<[RigidMotion; 2]> {
        let mut placed: Vec<[RigidMotion; 2]> = Vec::with_capacity(self.members.len());
        for (index, member) in self.members.iter().enumerate() {
            let known = self.members[..index].iter().position(|other| other.place == member.place);
            placed.push(match known {
                Some(known) => placed[known],
                None => ends.each_ref().map(|axes| self.setup.placed(&member.place, axes)),
            });
        }
        placed
    }

    /// Pairs that overlap wherever the axes stand, as far as looking at many positions can tell.
    pub(super) fn always_overlapping(&self, positions: &[AxisPosition]) -> Vec<usize> {
        let mut left: Vec<usize> = (0..self.pairs.len()).collect();
        for axes in positions {
            if left.is_empty() {
                break;
            }
            let found = self.within(&Standing(*axes), 0.0);
            left.retain(|pair| found.iter().any(|near| near.pair == *pair && near.is_collision()));
        }
        left
    }
}

/// Axes that stand still.
struct Standing(AxisPosition);

impl AxisCourse for Standing {
    fn axes(&self, _share: f64) -> AxisPosition {
        self.0
    }

    fn rates(&self) -> super::links::AxisRates {
        let linear = super::links::LinearRates::Axes { speed: 0.0, acceleration: 0.0 };
        super::links::AxisRates { rotary: [0.0; 2], linear }
    }
}

#[cfg(test)]
#[path = "scene_tests.rs"]
mod tests;
