//! Triangle meshes.

use super::bvh::Aabb;
use super::{Direction, Point};

/// An oriented triangle mesh, mm: corners anticlockwise seen from outside.
#[derive(Clone, Debug)]
pub struct TriangleMesh {
    vertices: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    normals: Vec<Direction>,
}

impl TriangleMesh {
    /// The vertices.
    pub fn vertices(&self) -> &[Point] {
        &self.vertices
    }

    /// Vertex indices of each triangle.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Normals at the vertices, weighted by the angles of the triangles there.
    pub fn vertex_normals(&self) -> &[Direction] {
        &self.normals
    }

    /// Box around the vertices.
    pub fn bounds(&self) -> Aabb {
        Aabb::around(&self.vertices)
    }
}
