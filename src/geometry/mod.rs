//! Mathematics that knows no machining: vectors, angles, splines, meshes, closest points, rigid motions. Uses
//! nothing of the crate but `diagnostic`.

pub mod angle;
pub mod bezier_triangle;
pub mod bvh;
pub mod corner_normals;
pub mod curvature;
pub mod curve;
pub mod curved_mesh;
pub mod curved_place;
pub mod derivative_bounds;
pub mod extend;
pub mod interpolate;
pub mod knots;
pub mod mesh;
pub mod mesh_error;
pub mod mesh_topology;
pub mod parametrize;
mod patch;
pub mod surface;
pub mod surface_fit;
pub mod surface_foot;

pub use angle::{Degrees, Radians};
pub use bezier_triangle::Barycentric;
pub use bvh::{Aabb, Bvh};
pub use corner_normals::CornerNormals;
pub use curvature::{Curvature, PrincipalCurvatures};
pub use curve::SplineCurve;
pub use curved_mesh::{CurvedMesh, CurvedMeshError};
pub use curved_place::PatchBounds;
pub use derivative_bounds::{DerivativeBounds, DerivativeTable};
pub use interpolate::{GridError, interpolate_grid};
pub use knots::{KnotError, Knots};
pub use mesh::{MeshFeature, MeshFoot, TriangleMesh};
pub use mesh_error::MeshError;
pub use mesh_topology::{MeshEdge, MeshTopology};
pub use parametrize::{ParametrizeError, SquareMap, map_to_square};
pub use surface::{SplineSurface, SurfaceError, SurfaceJet};
pub use surface_fit::{FitPoint, fit_surface};
pub use surface_foot::{Boundary, Edge, SurfaceFoot, SurfacePlace};

/// A point, mm unless a function says otherwise.
pub type Point = nalgebra::Point3<f64>;
/// A free vector, mm unless a function says otherwise.
pub type Vector = nalgebra::Vector3<f64>;
/// A vector of length one.
pub type Direction = nalgebra::UnitVector3<f64>;
/// A rotation followed by a translation.
pub type RigidMotion = nalgebra::Isometry3<f64>;
