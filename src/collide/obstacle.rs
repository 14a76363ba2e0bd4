//! Triangle meshes that a tool must stay clear of, and the nearest triangle to a moving piece of the tool.

use super::sweep::{Bound, MovingPiece};
use crate::geometry::{Point, TriangleMesh, Vector};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhLeafCost, BvhNode};

/// What may happen to a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The flutes may touch it while they cut; nothing else may, and nothing in a rapid move.
    Cut,
    /// Nothing may touch it.
    Avoid,
}

/// A surface as triangles, part frame, mm. Which way its triangles turn does not matter, but where it has an inside.
pub struct Obstacle {
    name: String,
    role: Role,
    triangles: Vec<[Point; 3]>,
    tree: Bvh,
    inside: Option<Box<TriangleMesh>>,
}

/// Why a mesh cannot be an obstacle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ObstacleError {
    /// A coordinate that is infinite or not a number.
    #[error("vertex {0} has a coordinate that is not finite")]
    NotFinite(usize),
    /// A triangle that names a vertex past the end of the list.
    #[error("triangle {triangle} names vertex {vertex} of {vertices}")]
    NoVertex {
        /// The triangle, from 0.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
}

/// Lowest bound found on an obstacle for one piece and interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Never undercut during the interval, mm.
    pub(super) least: f64,
    /// The place in the interval, -1 to 1, and the point that are about nearest.
    pub(super) place: f64,
    pub(super) point: Point,
}

impl BvhLeafCost for Nearest {
    fn cost(&self) -> f64 {
        self.least
    }
}

impl Obstacle {
    /// Takes a mesh; triangles index into `vertices`.
    pub fn new(
        name: impl Into<String>,
        role: Role,
        vertices: &[Point],
        triangles: &[[u32; 3]],
    ) -> Result<Self, ObstacleError> {
        if let Some(index) = vertices.iter().position(|v| !v.coords.iter().all(|c| c.is_finite())) {
            return Err(ObstacleError::NotFinite(index));
        }
        let corner = |triangle: usize, vertex: u32| {
            let missing = ObstacleError::NoVertex { triangle, vertex, vertices: vertices.len() };
            vertices.get(vertex as usize).copied().ok_or(missing)
        };
        let corners =
            triangles.iter().enumerate().map(|(i, [a, b, c])| Ok([corner(i, *a)?, corner(i, *b)?, corner(i, *c)?]));
        let triangles = corners.collect::<Result<Vec<_>, _>>()?;
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::from_points(t.iter().map(|p| p.coords.into()))).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        Ok(Self { name: name.into(), role, triangles, tree, inside: None })
    }

    /// The same with the inside of a mesh whose skin it is or comes near to; an open mesh has none.
    #[must_use]
    pub fn with_inside(self, mesh: &TriangleMesh) -> Self {
        let inside = mesh.topology().is_closed().then(|| Box::new(mesh.clone()));
        Self { inside, ..self }
    }

    /// The nearest point of the skin and how deep below it a point lies, mm; `None` outside.
    pub(super) fn depth_of(&self, p: &Point) -> Option<(Point, f64)> {
        let mesh = self.inside.as_ref()?;
        let bounds = self.tree.root_aabb();
        if !bounds.contains_local_point(p.coords.into()) {
            return None;
        }
        let foot = mesh.closest(p);
        (foot.signed_distance < 0.0).then_some((foot.point, -foot.signed_distance))
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What may happen to it.
    pub fn role(&self) -> Role {
        self.role
    }

    /// The lowest bound over all triangles, if it is below `ceiling`. The triangles' size costs it no more than
    /// `resolution`, mm, or little beside the motion.
    pub(super) fn nearest(&self, piece: &MovingPiece<'_>, ceiling: f64, resolution: f64) -> Option<Nearest> {
        let on_box = |node: &BvhNode, ceiling: f64| {
            let bounds = node.aabb();
            let half: Vector = bounds.half_extents().into();
            let centre = Point::from(Vector::from(bounds.center()));
            piece.bound(&centre, ceiling, |n| n.abs().dot(&half)).least
        };
        let on_triangle = |index: u32, ceiling: f64| {
            let triangle = self.triangles.get(index as usize)?;
            lowest_on_triangle(triangle, ceiling, resolution, |centre, part, ceiling| {
                piece.bound(centre, ceiling, |n| part.iter().map(|v| n.dot(&(centre - v))).fold(0.0, f64::max))
            })
        };
        self.tree.find_best(ceiling, on_box, on_triangle).map(|(_, nearest)| nearest)
    }
}

/// While an interval of time is wide, space need not be cut finer than this share of what the motion takes from the
/// bound: the interval will be halved anyway.
const SPACE_PER_TIME: f64 = 0.25;

/// Lowest bound over a triangle, if below `ceiling`: halves the triangle at its longest edge until the size of the
/// parts costs the bound no more than `resolution`, or little beside the motion.
fn lowest_on_triangle(
    triangle: &[Point; 3],
    ceiling: f64,
    resolution: f64,
    bound: impl Fn(&Point, &[Point; 3], f64) -> Bound,
) -> Option<Nearest> {
    let mut lowest: Option<Nearest> = None;
    let mut open = vec![*triangle];
    while let Some(part) = open.pop() {
        let centre = Point::from((part[0].coords + part[1].coords + part[2].coords) / 3.0);
        let limit = lowest.map_or(ceiling, |l| l.least);
        let here = bound(&centre, &part, limit);
        if here.least >= limit {
            continue;
        }
        if here.spread > resolution.max(SPACE_PER_TIME * here.moved) {
            open.extend(halves(&part));
            continue;
        }
        lowest = Some(Nearest { least: here.least, place: here.place, point: centre });
    }
    lowest
}

/// Both halves of a triangle, cut from the middle of its longest edge.
fn halves([a, b, c]: &[Point; 3]) -> [[Point; 3]; 2] {
    let (ab, bc, ca) = ((b - a).norm_squared(), (c - b).norm_squared(), (a - c).norm_squared());
    let cut = |p: Point, q: Point, apex: Point| {
        let middle = nalgebra::center(&p, &q);
        [[p, middle, apex], [middle, q, apex]]
    };
    if ab >= bc && ab >= ca {
        cut(*a, *b, *c)
    } else if bc >= ca {
        cut(*b, *c, *a)
    } else {
        cut(*c, *a, *b)
    }
}
