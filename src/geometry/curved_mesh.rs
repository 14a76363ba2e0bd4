//! Triangle meshes whose triangles are curved: each a cubic patch through its corners, square to the normals there, with
//! normals of its own that change quadratically (Vlachos, Peters, Boyd and Mitchell 2001, Curved PN triangles). Uses
//! `bezier_triangle`, `corner_normals` and `mesh`.
//!
//! Patches that share an edge share the curve over it. It depends on the ends and on the normals there only; where the
//! sides of a crease have different normals, its tangent at the end lies in both tangent planes. So there are no gaps. On
//! a smooth surface with right normals the patches leave it by the fourth power of their size, flat triangles by the
//! second.

use super::bezier_triangle::{Barycentric, CubicTriangle, QuadraticTriangle};
use super::bvh::{Aabb, Bvh};
use super::corner_normals::CornerNormals;
use super::mesh::TriangleMesh;
use super::mesh_topology::MeshEdge;
use super::{Direction, Point, Radians, RigidMotion, Vector};

/// An oriented mesh of curved triangles, mm.
#[derive(Clone, Debug)]
pub struct CurvedMesh {
    pub(super) chords: TriangleMesh,
    pub(super) corners: CornerNormals,
    pub(super) patches: Vec<Patch>,
    pub(super) tree: Bvh,
    /// The triangles at each vertex, and where those of a vertex begin.
    at_vertex: Vec<u32>,
    starts: Vec<u32>,
}

/// One curved triangle.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub(super) points: CubicTriangle,
    pub(super) normals: QuadraticTriangle,
}

/// Why a mesh cannot be curved. Triangles are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CurvedMeshError {
    /// A normal at a corner that the triangle does not face.
    #[error("the normal at a corner of triangle {triangle} near ({:.4}, {:.4}, {:.4}) is {degrees:.1} degrees from that of the triangle; at most {:.0} can be", at.x, at.y, at.z, MOST_LEAN.acos().to_degrees())]
    Leaning {
        /// The triangle.
        triangle: usize,
        /// The corner.
        at: Point,
        /// Angle between both normals.
        degrees: f64,
    },
    /// A patch that turns over.
    #[error("the curved triangle {triangle} at ({:.4}, {:.4}, {:.4}) folds over, so far apart are the normals at its corners", at.x, at.y, at.z)]
    Folded {
        /// The triangle.
        triangle: usize,
        /// Its first corner.
        at: Point,
    },
}

/// Cosine of the largest angle between a triangle's normal and those at its corners.
const MOST_LEAN: f64 = 0.25;
/// Sine of the angle between both normals at the end of a crease from which on their planes cross in a sure direction.
const CROSSING: f64 = 0.02;
/// Cosine of the largest angle between an edge and the line in which the planes of both sides cross at its end.
const ALONG: f64 = 0.5;

impl CurvedMesh {
    /// Curves the triangles of a mesh by normals that it tells itself; edges whose triangles' normals are farther apart
    /// than `crease` stay sharp.
    pub fn with_creases(mesh: TriangleMesh, crease: Radians) -> Result<Self, CurvedMeshError> {
        let corners = CornerNormals::from_creases(&mesh, crease);
        Self::new(mesh, corners)
    }

    /// Curves the triangles of a mesh by given normals, one for each corner of each triangle; edges at whose ends they
    /// differ stay sharp.
    pub fn with_normals(mesh: TriangleMesh, normals: &[[Direction; 3]]) -> Result<Self, CurvedMeshError> {
        let corners = CornerNormals::given(&mesh, normals);
        Self::new(mesh, corners)
    }

    fn new(chords: TriangleMesh, corners: CornerNormals) -> Result<Self, CurvedMeshError> {
        let faces = 0..chords.triangles().len();
        faces.clone().try_for_each(|face| check_lean(&chords, &corners, face))?;
        let patches: Vec<Patch> = faces.map(|face| Patch::new(&chords, &corners, face)).collect();
        let folded = patches.iter().position(Patch::folds);
        if let Some(triangle) = folded {
            let [at, ..] = chords.corners(triangle);
            return Err(CurvedMeshError::Folded { triangle, at });
        }
        let mut starts = vec![0u32; chords.vertices().len() + 1];
        chords.triangles().iter().flatten().for_each(|v| starts[*v as usize + 1] += 1);
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let (mut next, mut at_vertex) = (starts.clone(), vec![0; 3 * chords.triangles().len()]);
        for (face, corners) in chords.triangles().iter().enumerate() {
            for vertex in corners {
                let place = &mut next[*vertex as usize];
                at_vertex[*place as usize] = face as u32;
                *place += 1;
            }
        }
        Ok(Self { tree: tree(&patches), chords, corners, patches, at_vertex, starts })
    }

    /// The flat triangles between the corners.
    pub fn chords(&self) -> &TriangleMesh {
        &self.chords
    }

    /// The normals at the corners.
    pub fn corner_normals(&self) -> &CornerNormals {
        &self.corners
    }

    /// Point of patch `face` with weights `w` of its corners.
    pub fn point(&self, face: usize, w: &Barycentric) -> Point {
        Point::from(self.patches[face].points.at(w))
    }

    /// Normal of patch `face` there.
    pub fn normal(&self, face: usize, w: &Barycentric) -> Direction {
        let normal = self.patches[face].normals.at(w);
        Direction::try_new(normal, 1e-9).unwrap_or(self.chords.face_normals()[face])
    }

    /// A box that holds the mesh.
    pub fn bounds(&self) -> Aabb {
        self.patches.iter().fold(Aabb::empty(), |sum, patch| sum.union(&patch.bounds()))
    }

    /// Area, mm², by Gauss quadrature over each patch, exact for polynomials up to the fifth degree (Radon 1948).
    pub fn area(&self) -> f64 {
        let root = 15.0_f64.sqrt();
        let rings = [((6.0 - root) / 21.0, (155.0 - root) / 1200.0), ((6.0 + root) / 21.0, (155.0 + root) / 1200.0)];
        let third = 1.0 / 3.0;
        let ring = |(a, weight): (f64, f64)| {
            let far = 1.0 - 2.0 * a;
            [[far, a, a], [a, far, a], [a, a, far]].map(|w| (w, weight))
        };
        let places: Vec<_> = rings.into_iter().flat_map(ring).chain([([third; 3], 0.225)]).collect();
        let at = |patch: &Patch, w: &Barycentric| {
            let jet = patch.points.jet(w);
            0.5 * jet.u.cross(&jet.v).norm()
        };
        self.patches.iter().map(|patch| places.iter().map(|(w, weight)| weight * at(patch, w)).sum::<f64>()).sum()
    }

    /// The mesh moved.
    #[must_use]
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        let point = |p: &Vector| (motion * Point::from(*p)).coords;
        let moved = |patch: &Patch| Patch {
            points: CubicTriangle(patch.points.0.each_ref().map(point)),
            normals: QuadraticTriangle(patch.normals.0.map(|n| motion * n)),
        };
        let patches: Vec<Patch> = self.patches.iter().map(moved).collect();
        Self {
            chords: self.chords.transformed(motion),
            corners: self.corners.transformed(motion),
            tree: tree(&patches),
            patches,
            ..self.clone()
        }
    }

    /// The triangles at a vertex.
    pub(super) fn faces_at(&self, vertex: u32) -> impl Iterator<Item = usize> {
        let [start, end] = [0, 1].map(|k| self.starts[vertex as usize + k] as usize);
        self.at_vertex[start..end].iter().map(|face| *face as usize)
    }
}

impl Patch {
    fn new(mesh: &TriangleMesh, corners: &CornerNormals, face: usize) -> Self {
        let (p, n) = (mesh.corners(face).map(|p| p.coords), corners.of(face));
        let leg = |from: usize, edge: usize| {
            let across = across(mesh, corners, MeshEdge { face, edge }, from);
            let to = if from == edge { (edge + 1) % 3 } else { edge };
            p[from] + leg((p[to] - p[from]) / 3.0, &n[from], across.as_ref())
        };
        let sides = [leg(0, 0), leg(1, 0), leg(1, 1), leg(2, 1), leg(2, 2), leg(0, 2)];
        let [a, b, c] = p;
        let (sides_mean, corners_mean) = (sides.iter().sum::<Vector>() / 6.0, (a + b + c) / 3.0);
        let middle = sides_mean + (sides_mean - corners_mean) * 0.5;
        let [ab, bb, bc, cc, ca, ac] = sides;
        let between = |i: usize, j: usize| {
            let (along, sum) = (p[j] - p[i], n[i].into_inner() + n[j].into_inner());
            let lean = 2.0 * along.dot(&sum) / along.norm_squared();
            (sum - along * lean).try_normalize(1e-9).unwrap_or(mesh.face_normals()[face].into_inner())
        };
        let [na, nb, nc] = n.map(Direction::into_inner);
        Self {
            points: CubicTriangle([a, b, c, ab, bb, bc, cc, ca, ac, middle]),
            normals: QuadraticTriangle([na, nb, nc, between(0, 1), between(1, 2), between(2, 0)]),
        }
    }

    pub(super) fn bounds(&self) -> Aabb {
        let points = self.points.0.map(Point::from);
        Aabb::around(&points)
    }

    /// Whether it turns over at a corner, in the middle of a side or in the middle. So it does, but for rounding, at a corner
    /// both of whose sides are creases against one and the same surface: both follow the line in which that one is met.
    fn folds(&self) -> bool {
        /// Sine of the angle between its directions up to which they are one, but for rounding.
        const FLAT: f64 = 1e-9;
        const PLACES: [Barycentric; 7] = [
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.5],
            [0.5, 0.0, 0.5],
            [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
        ];
        let turned = |w: &Barycentric| {
            let jet = self.points.jet(w);
            jet.u.cross(&jet.v).dot(&self.normals.at(w)) <= FLAT * jet.u.norm() * jet.v.norm()
        };
        PLACES.iter().any(turned)
    }
}

/// The way from a corner to the control point next to it: a third of the edge, laid into the tangent plane there, or into
/// both planes where the side across the edge has another. Both sides of an edge come to the same bits.
fn leg(third: Vector, normal: &Direction, across: Option<&Direction>) -> Vector {
    let into_plane = |n: &Vector| third - n * n.dot(&third);
    let Some(other) = across else { return into_plane(normal) };
    let line = normal.cross(other);
    if let Some(line) = line.try_normalize(CROSSING)
        && line.dot(&third).abs() >= ALONG * third.norm()
    {
        return line * line.dot(&third);
    }
    let mean = normal.into_inner() + other.into_inner();
    mean.try_normalize(CROSSING).map_or(third, |mean| into_plane(&mean))
}

/// The normal at an end of an edge on its other side, where that has another one.
fn across(mesh: &TriangleMesh, corners: &CornerNormals, edge: MeshEdge, end: usize) -> Option<Direction> {
    let other = mesh.topology().neighbours(edge.face)[edge.edge]?;
    let vertex = mesh.triangles()[edge.face][end];
    let there = mesh.triangles()[other].iter().position(|v| *v == vertex)?;
    let differs = corners.number(edge.face, end) != corners.number(other, there);
    differs.then(|| corners.of(other)[there])
}

fn check_lean(mesh: &TriangleMesh, corners: &CornerNormals, triangle: usize) -> Result<(), CurvedMeshError> {
    let own = mesh.face_normals()[triangle];
    for (at, normal) in mesh.corners(triangle).into_iter().zip(corners.of(triangle)) {
        if normal.dot(&own) < MOST_LEAN {
            let degrees = normal.angle(&own).to_degrees();
            return Err(CurvedMeshError::Leaning { triangle, at, degrees });
        }
    }
    Ok(())
}

fn tree(patches: &[Patch]) -> Bvh {
    Bvh::new(&patches.iter().map(Patch::bounds).collect::<Vec<_>>())
}

impl CurvedMeshError {
    /// The triangle that is to blame.
    pub fn triangle(&self) -> usize {
        match self {
            Self::Leaning { triangle, .. } | Self::Folded { triangle, .. } => *triangle,
        }
    }
}

#[cfg(test)]
#[path = "curved_mesh_tests.rs"]
pub(super) mod tests;
