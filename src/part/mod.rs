//! The design surface and how to read it. May use: diagnostic, geometry.

mod cell;
mod design_surface;
mod facing;
mod fit;
mod mesh_sampling;
mod oriented_spline;
mod read;
mod sample;

pub use cell::{Cell, Cells};
pub use design_surface::{DesignSurface, SplineForm};
pub use facing::Facing;
pub use oriented_spline::{IrregularSurface, OrientedSpline};
pub use read::{ReadOptions, Triangles, Units, read, require_closed};
pub use sample::{Foot, OutwardNormal, SampleGrid, SurfacePlace, SurfaceSample};

/// What is to be made, and what must not be touched.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name for headers and reports.
    pub name: String,
    /// The surface to be milled.
    pub surface: DesignSurface,
    /// The finished part as a closed body, of whose skin `surface` is a piece: no tool may enter it anywhere.
    pub body: Option<DesignSurface>,
    /// Surfaces that the tool must stay clear of, normals out of the material.
    pub check: Vec<DesignSurface>,
}
