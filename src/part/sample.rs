//! Points of a design surface: samples with their normals, grids of them, closest points. Uses `geometry`.

use crate::geometry::{Direction, Point};

/// Unit normal out of the material, toward the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutwardNormal(pub Direction);

/// Where on the design surface a point lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SurfacePlace {
    /// On a spline.
    Parameters {
        /// Parameter.
        u: f64,
        /// Parameter.
        v: f64,
    },
    /// On a mesh.
    Face {
        /// Index of the triangle.
        index: usize,
        /// Weights of its three vertices; their sum is 1.
        barycentric: [f64; 3],
    },
}

/// A point of the design surface with its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceSample {
    /// The point, part frame, mm.
    pub point: Point,
    /// Normal out of the material.
    pub normal: OutwardNormal,
    /// Where it lies.
    pub place: SurfacePlace,
}

/// Samples over the whole design surface, joined by triangles.
#[derive(Clone, Debug)]
pub struct SampleGrid {
    /// The samples.
    pub samples: Vec<SurfaceSample>,
    /// Indices of three samples each, anticlockwise seen from the tool's side.
    pub triangles: Vec<[u32; 3]>,
}

/// The closest point of a design surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// The closest point, mm.
    pub point: Point,
    /// Normal out of the material there.
    pub normal: OutwardNormal,
    /// Distance, mm: positive on the tool's side, negative inside the material.
    pub signed_distance: f64,
    /// The point asked for lies beyond an edge of an open surface: the distance is not along a normal.
    pub past_edge: bool,
    /// Where the foot lies.
    pub place: SurfacePlace,
}
