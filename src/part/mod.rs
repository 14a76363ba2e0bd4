//! The design surface and how to read it. May use: diagnostic, geometry.

mod design_surface;
mod read;

pub use design_surface::{
    DesignSurface, Foot, OrientedSpline, OutwardNormal, SampleGrid, SplineForm, SurfacePlace, SurfaceSample,
};
pub use read::{ReadOptions, Units, read};

/// What is to be made, and what must not be touched.
#[derive(Clone, Debug)]
pub struct Part {
    /// Name for headers and reports.
    pub name: String,
    /// The surface to be milled.
    pub surface: DesignSurface,
    /// Surfaces that the tool must stay clear of, normals out of the material.
    pub check: Vec<DesignSurface>,
}
