//! Triangle meshes: checked construction and closest points with the right sign. Uses `bvh` and `mesh_topology`.

use super::bvh::{Aabb, Bvh};
use super::mesh_error::MeshError;
use super::mesh_topology::{MeshEdge, MeshTopology};
use super::{Direction, Point, RigidMotion, Vector};

/// An oriented triangle mesh, mm: corners anticlockwise seen from outside, no edge in more than two triangles, open or
/// closed.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    face_normals: Vec<Direction>,
    vertex_normals: Vec<Direction>,
    topology: MeshTopology,
    tree: Bvh,
    pub(super) scale: f64,
}

/// Meshes are the same where their vertices and triangles are.
impl PartialEq for TriangleMesh {
    fn eq(&self, other: &Self) -> bool {
        self.vertices == other.vertices && self.triangles == other.triangles
    }
}

/// The part of a triangle on which a closest point lies; corners and edges are counted inside the triangle, edge k runs
/// from corner k to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFeature {
    /// The inside.
    Face,
    /// An edge, its ends excluded.
    Edge(usize),
    /// A corner.
    Vertex(usize),
}

/// A closest point on a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshFoot {
    /// The triangle.
    pub face: usize,
    /// Weights of its corners; their sum is 1.
    pub barycentric: [f64; 3],
    /// The foot, mm.
    pub point: Point,
    /// Distance from the point asked for, mm: positive outside, negative inside (on the sides that the orientation of
    /// the triangles gives).
    pub signed_distance: f64,
    /// What of the triangle it lies on.
    pub feature: MeshFeature,
    /// The foot lies on the boundary of an open mesh and the point asked for beyond it.
    pub past_edge: bool,
}

/// Sine below which the angles of a triangle count as zero.
const FLAT: f64 = 1e-9;
/// Share of (mesh size + distance) within which a point counts as above the boundary and not beyond it.
const BEYOND: f64 = 1e-9;

impl TriangleMesh {
    /// Checks and joins vertices and triangles. Vertices that no triangle uses are dropped.
    pub fn new(vertices: Vec<Point>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check_indices(&vertices, &triangles)?;
        let (vertices, triangles) = drop_unused(&vertices, triangles);
        let face_normals = face_normals(&vertices, &triangles)?;
        let topology = MeshTopology::new(&vertices, &triangles)?;
        let mut sums = vec![Vector::zeros(); vertices.len()];
        for (triangle, normal) in triangles.iter().zip(&face_normals) {
            for k in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|i| vertices[triangle[(k + i) % 3] as usize]);
                let (to_b, to_c) = (b - a, c - a);
                let angle = to_b.cross(&to_c).norm().atan2(to_b.dot(&to_c));
                sums[triangle[k] as usize] += normal.into_inner() * angle;
            }
        }
        let vertex_normals = sums
            .iter()
            .enumerate()
            .map(|(vertex, sum)| {
                Direction::try_new(*sum, 1e-9).ok_or(MeshError::Folded { vertex, at: vertices[vertex] })
            })
            .collect::<Result<_, _>>()?;
        let boxes: Vec<Aabb> =
            triangles.iter().map(|t| Aabb::around(t.iter().map(|v| &vertices[*v as usize]))).collect();
        let scale = Aabb::around(&vertices).diagonal();
        Ok(Self { vertices, triangles, face_normals, vertex_normals, topology, tree: Bvh::new(&boxes), scale })
    }

    /// The vertices.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Vertex indices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Normals of the triangles.
    pub fn face_normals(&self) -> &[Direction] {
        &self.face_normals
    }

    /// Normals at the vertices, weighted by the angles of the triangles there.
    pub fn vertex_normals(&self) -> &[Direction] {
        &self.vertex_normals
    }

    /// Edges, boundary and components.
    pub fn topology(&self) -> &MeshTopology {
        &self.topology
    }

    /// Box around the vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(&self.vertices)
    }

    /// Corners of triangle `face`.
    pub fn corners(&self, face: usize) -> [Point; 3] {
        self.triangles[face].map(|v| self.vertices[v as usize])
    }

    /// The mesh moved.
    #[must_use]
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        let vertices: Vec<Point> = self.vertices.iter().map(|p| motion * p).collect();
        let boxes: Vec<Aabb> =
            self.triangles.iter().map(|t| Aabb::around(t.iter().map(|v| &vertices[*v as usize]))).collect();
        let turn = |normals: &[Direction]| normals.iter().map(|n| motion * n).collect();
        Self {
            face_normals: turn(&self.face_normals),
            vertex_normals: turn(&self.vertex_normals),
            tree: Bvh::new(&boxes),
            vertices,
            ..self.clone()
        }
    }

    /// Area, mm².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len())
            .map(|face| {
                let [a, b, c] = self.corners(face);
                (b - a).cross(&(c - a)).norm() / 2.0
            })
            .sum()
    }

    /// Volume, mm³, of a closed mesh: negative when its triangles are turned inside out.
    pub fn signed_volume(&self) -> f64 {
        let origin = self.bounds().centre();
        (0..self.triangles.len())
            .map(|face| {
                let [a, b, c] = self.corners(face).map(|p| p - origin);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum()
    }

    /// Point of triangle `face` with weights `barycentric`.
    pub fn point(&self, face: usize, barycentric: [f64; 3]) -> Point {
        let [a, b, c] = self.corners(face);
        let [x, y, z] = barycentric;
        Point::from(a.coords * x + b.coords * y + c.coords * z)
    }

    /// Weights of the corners of triangle `face` for a point of its plane; their sum is 1.
    pub fn barycentric(&self, face: usize, p: &Point) -> [f64; 3] {
        let [a, b, c] = self.corners(face);
        let cross = (b - a).cross(&(c - a));
        let area = cross.norm_squared();
        let second = (p - a).cross(&(c - a)).dot(&cross) / area;
        let third = (b - a).cross(&(p - a)).dot(&cross) / area;
        [1.0 - second - third, second, third]
    }

    /// Normal inside triangle `face`, interpolated between those of its vertices.
    pub fn normal(&self, face: usize, barycentric: [f64; 3]) -> Direction {
        let mut sum = Vector::zeros();
        for (vertex, weight) in self.triangles[face].iter().zip(barycentric) {
            sum += self.vertex_normals[*vertex as usize].into_inner() * weight;
        }
        Direction::try_new(sum, 1e-9).unwrap_or(self.face_normals[face])
    }

    /// The closest point of the mesh and on which side `p` lies, by the pseudonormal of the feature there (Baerentzen and
    /// Aanaes 2005), which is right on edges and corners too.
    pub fn closest(&self, p: &Point) -> MeshFoot {
        let mut best = (0, OnTriangle::nearest(&self.corners(0), p));
        let mut least = (best.1.point - p).norm_squared();
        self.tree.nearest(p, f64::INFINITY, |face, bound| {
            let found = OnTriangle::nearest(&self.corners(face), p);
            let distance = (found.point - p).norm_squared();
            if distance < least {
                (best, least) = ((face, found), distance);
            }
            bound.min(least)
        });
        let (face, OnTriangle { point, barycentric, feature }) = best;
        let offset = p - point;
        let side = offset.dot(&self.pseudonormal(face, feature));
        MeshFoot {
            face,
            barycentric,
            point,
            signed_distance: least.sqrt().copysign(side),
            feature,
            past_edge: self.past_edge(face, feature, &offset),
        }
    }

    fn pseudonormal(&self, face: usize, feature: MeshFeature) -> Vector {
        match feature {
            MeshFeature::Face => self.face_normals[face].into_inner(),
            MeshFeature::Edge(k) => {
                let other = self.topology.neighbours(face)[k].map_or(Vector::zeros(), |f| *self.face_normals[f]);
                self.face_normals[face].into_inner() + other
            }
            MeshFeature::Vertex(k) => self.vertex_normals[self.triangles[face][k] as usize].into_inner(),
        }
    }

    fn past_edge(&self, face: usize, feature: MeshFeature, offset: &Vector) -> bool {
        let tolerance = BEYOND * (self.scale + offset.norm());
        match feature {
            MeshFeature::Face => false,
            MeshFeature::Edge(k) => {
                self.topology.neighbours(face)[k].is_none()
                    && offset.dot(&self.conormal(MeshEdge { face, edge: k })) > tolerance
            }
            MeshFeature::Vertex(k) => {
                let vertex = self.triangles[face][k] as usize;
                self.topology.boundary_at(vertex).any(|edge| offset.dot(&self.conormal(edge)) > tolerance)
            }
        }
    }

    /// In the plane of the face, across the edge, outward.
    fn conormal(&self, edge: MeshEdge) -> Vector {
        let corners = self.corners(edge.face);
        let along = corners[(edge.edge + 1) % 3] - corners[edge.edge];
        along.cross(&self.face_normals[edge.face]).normalize()
    }
}

fn check_indices(vertices: &[Point], triangles: &[[u32; 3]]) -> Result<(), MeshError> {
    if triangles.is_empty() {
        return Err(MeshError::Empty);
    }
    if let Some(vertex) = vertices.iter().position(|p| !p.coords.iter().all(|x| x.is_finite())) {
        return Err(MeshError::NotFinite { vertex });
    }
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(vertex) = corners.iter().find(|v| **v as usize >= vertices.len()) {
            return Err(MeshError::Index { triangle, vertex: *vertex, count: vertices.len() });
        }
    }
    Ok(())
}

fn drop_unused(vertices: &[Point], mut triangles: Vec<[u32; 3]>) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut used = vec![false; vertices.len()];
    triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    let mut number = Vec::with_capacity(vertices.len());
    let mut kept = Vec::with_capacity(vertices.len());
    for (vertex, used) in vertices.iter().zip(used) {
        number.push(kept.len() as u32);
        if used {
            kept.push(*vertex);
        }
    }
    triangles.iter_mut().flatten().for_each(|v| *v = number[*v as usize]);
    (kept, triangles)
}

fn face_normals(vertices: &[Point], triangles: &[[u32; 3]]) -> Result<Vec<Direction>, MeshError> {
    let normal = |(triangle, corners): (usize, &[u32; 3])| {
        let [a, b, c] = corners.map(|v| vertices[v as usize]);
        let sides = [b - a, c - b, a - c];
        let longest = sides.iter().map(Vector::norm_squared).fold(0.0, f64::max);
        // Twice the area over the square of the longest side: the sine of the smallest angle, about.
        Direction::try_new(sides[0].cross(&-sides[2]), FLAT * longest)
            .filter(|_| longest > 0.0)
            .ok_or(MeshError::Degenerate { triangle, at: a })
    };
    triangles.iter().enumerate().map(normal).collect()
}

/// The closest point of one triangle.
pub(super) struct OnTriangle {
    pub(super) point: Point,
    pub(super) barycentric: [f64; 3],
    feature: MeshFeature,
}

impl OnTriangle {
    /// By the region of the plane in which the projection lies. Source: Ericson, Real-Time Collision Detection, 5.1.5.
    pub(super) fn nearest(corners: &[Point; 3], p: &Point) -> Self {
        let [a, b, c] = *corners;
        let (ab, ac) = (b - a, c - a);
        let corner = |k: usize| {
            let mut barycentric = [0.0; 3];
            barycentric[k] = 1.0;
            Self { point: corners[k], barycentric, feature: MeshFeature::Vertex(k) }
        };
        let edge = |k: usize, share: f64| {
            let mut barycentric = [0.0; 3];
            let next = (k + 1) % 3;
            (barycentric[k], barycentric[next]) = (1.0 - share, share);
            let point = corners[k] + (corners[next] - corners[k]) * share;
            Self { point, barycentric, feature: MeshFeature::Edge(k) }
        };
        let (d1, d2) = (ab.dot(&(p - a)), ac.dot(&(p - a)));
        if d1 <= 0.0 && d2 <= 0.0 {
            return corner(0);
        }
        let (d3, d4) = (ab.dot(&(p - b)), ac.dot(&(p - b)));
        if d3 >= 0.0 && d4 <= d3 {
            return corner(1);
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return edge(0, d1 / (d1 - d3));
        }
        let (d5, d6) = (ab.dot(&(p - c)), ac.dot(&(p - c)));
        if d6 >= 0.0 && d5 <= d6 {
            return corner(2);
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return edge(2, 1.0 - d2 / (d2 - d6));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 >= d3 && d5 >= d6 {
            return edge(1, (d4 - d3) / ((d4 - d3) + (d5 - d6)));
        }
        let sum = va + vb + vc;
        let (v, w) = (vb / sum, vc / sum);
        Self { point: a + ab * v + ac * w, barycentric: [1.0 - v - w, v, w], feature: MeshFeature::Face }
    }
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
