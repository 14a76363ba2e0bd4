//! Why a mesh is refused.

use super::Point;

impl MeshError {
    /// The triangle that is to blame, where it is one.
    pub fn triangle(&self) -> Option<usize> {
        match self {
            Self::Index { triangle, .. } | Self::Degenerate { triangle, .. } => Some(*triangle),
            Self::Orientation { second, .. } => Some(*second),
            Self::Empty | Self::NotFinite { .. } | Self::NonManifold { .. } | Self::Folded { .. } => None,
        }
    }
}

/// Why a mesh is refused. Triangles and vertices are counted from 0.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Nothing in it.
    #[error("the mesh has no triangles")]
    Empty,
    /// A triangle names a vertex that does not exist.
    #[error("triangle {triangle} names vertex {vertex}, but there are only {count}")]
    Index {
        /// The triangle.
        triangle: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A coordinate that is not finite.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NotFinite {
        /// The vertex.
        vertex: usize,
    },
    /// A triangle without area.
    #[error("triangle {triangle} near ({:.4}, {:.4}, {:.4}) has no area", at.x, at.y, at.z)]
    Degenerate {
        /// The triangle.
        triangle: usize,
        /// Its first corner.
        at: Point,
    },
    /// An edge in three or more triangles.
    #[error("{count} triangles share the edge from ({:.4}, {:.4}, {:.4}) to ({:.4}, {:.4}, {:.4}); at most 2 may",
        from.x, from.y, from.z, to.x, to.y, to.z)]
    NonManifold {
        /// Triangles at the edge.
        count: usize,
        /// End of the edge.
        from: Point,
        /// End of the edge.
        to: Point,
    },
    /// Two neighbours that turn opposite ways.
    #[error("triangles {first} and {second} at ({:.4}, {:.4}, {:.4}) are oriented against each other", at.x, at.y, at.z)]
    Orientation {
        /// A triangle.
        first: usize,
        /// Its neighbour.
        second: usize,
        /// An end of their common edge.
        at: Point,
    },
    /// The normals around a vertex cancel.
    #[error("the triangles around vertex {vertex} at ({:.4}, {:.4}, {:.4}) fold back on themselves", at.x, at.y, at.z)]
    Folded {
        /// The vertex.
        vertex: usize,
        /// Its position.
        at: Point,
    },
}
