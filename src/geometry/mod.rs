//! Mathematics that knows no machining: vectors, angles, splines, meshes, closest points, rigid motions. Uses
//! nothing of the crate but `diagnostic`.

pub mod angle;
pub mod curve;
pub mod knots;

pub use angle::{Degrees, Radians};
pub use curve::SplineCurve;

/// A point, mm unless a function says otherwise.
pub type Point = nalgebra::Point3<f64>;
/// A free vector, mm unless a function says otherwise.
pub type Vector = nalgebra::Vector3<f64>;
/// A vector of length one.
pub type Direction = nalgebra::UnitVector3<f64>;
/// A rotation followed by a translation.
pub type RigidMotion = nalgebra::Isometry3<f64>;
