//! The oriented surface that is to be milled, spline, mesh or curved mesh, behind one set of questions.

use super::fit;
use super::mesh_sampling;
use super::oriented_spline::OrientedSpline;
use super::sample::{Foot, OutwardNormal, SampleGrid, SurfacePlace, SurfaceSample};
use crate::diagnostic::Result;
use crate::geometry::{Aabb, CurvedMesh, Direction, MeshFoot, Point, RigidMotion, TriangleMesh};
use std::borrow::Cow;

/// The design surface, part frame, mm.
#[derive(Clone, Debug)]
pub enum DesignSurface {
    /// A B-spline surface.
    Spline(OrientedSpline),
    /// A triangle mesh; its corners turn anticlockwise seen from the tool's side.
    Mesh(TriangleMesh),
    /// A mesh whose triangles are curved patches, square to the normals at its corners.
    Curved(CurvedMesh),
}

/// The design surface as a spline, for planning.
#[derive(Clone, Debug)]
pub struct SplineForm<'a> {
    /// The spline with its orientation.
    pub spline: Cow<'a, OrientedSpline>,
    /// Largest measured distance between the spline and the design surface, mm; 0 when they are the same.
    pub fit_error: f64,
}

impl DesignSurface {
    /// Samples of the whole surface, edges included, neighbours at most about `spacing` mm apart. A spacing below a
    /// two-thousandth of the surface's size, or none at all, counts as that.
    pub fn sample(&self, spacing: f64) -> SampleGrid {
        let least = self.bounds().diagonal() / 2000.0;
        let spacing = if spacing > least { spacing } else { least };
        match self {
            Self::Spline(spline) => spline.sample(spacing),
            Self::Mesh(mesh) => mesh_sampling::sample(mesh, spacing),
            Self::Curved(mesh) => mesh_sampling::sample(mesh, spacing),
        }
    }

    /// The exact surface point inside a triangle of a [`SampleGrid`] of this surface; `weights` sum to 1.
    pub fn between(&self, corners: [&SurfaceSample; 3], weights: [f64; 3]) -> SurfaceSample {
        match self {
            Self::Spline(spline) => spline.between(corners, weights),
            Self::Mesh(mesh) => mesh_sampling::between(mesh, corners, weights),
            Self::Curved(mesh) => mesh_sampling::between_curved(mesh, corners, weights),
        }
    }

    /// The closest point and on which side of it `p` lies.
    pub fn foot(&self, p: &Point) -> Foot {
        match self {
            Self::Spline(spline) => spline.foot(p),
            Self::Mesh(mesh) => on_triangle(&mesh.closest(p), |foot| mesh.normal(foot.face, foot.barycentric)),
            Self::Curved(mesh) => on_triangle(&mesh.closest(p), |foot| mesh.normal(foot.face, &foot.barycentric)),
        }
    }

    /// Distance, mm: positive on the tool's side, negative inside the material.
    pub fn signed_distance(&self, p: &Point) -> f64 {
        self.foot(p).signed_distance
    }

    /// A box that holds the surface.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Spline(spline) => spline.surface().bounds(),
            Self::Mesh(mesh) => mesh.bounds(),
            Self::Curved(mesh) => mesh.bounds(),
        }
    }

    /// Area, mm².
    pub fn area(&self) -> f64 {
        match self {
            Self::Spline(spline) => spline.area(),
            Self::Mesh(mesh) => mesh.area(),
            Self::Curved(mesh) => mesh.area(),
        }
    }

    /// The surface moved.
    #[must_use]
    pub fn transformed(&self, motion: &RigidMotion) -> Self {
        match self {
            Self::Spline(spline) => Self::Spline(spline.transformed(motion)),
            Self::Mesh(mesh) => Self::Mesh(mesh.transformed(motion)),
            Self::Curved(mesh) => Self::Curved(mesh.transformed(motion)),
        }
    }

    /// The flat triangles of a mesh, curved or not.
    pub fn mesh(&self) -> Option<&TriangleMesh> {
        match self {
            Self::Spline(_) => None,
            Self::Mesh(mesh) => Some(mesh),
            Self::Curved(mesh) => Some(mesh.chords()),
        }
    }

    /// The surface as a spline: itself, or a bicubic fitted to a mesh. A mesh that is not one disc is refused.
    pub fn spline(&self) -> Result<SplineForm<'_>> {
        match self {
            Self::Spline(spline) => Ok(SplineForm { spline: Cow::Borrowed(spline), fit_error: 0.0 }),
            Self::Mesh(mesh) => {
                let (spline, fit_error) = fit::spline_of_mesh(mesh)?;
                Ok(SplineForm { spline: Cow::Owned(spline), fit_error })
            }
            Self::Curved(mesh) => {
                let (spline, fit_error) = fit::spline_of_curved(mesh)?;
                Ok(SplineForm { spline: Cow::Owned(spline), fit_error })
            }
        }
    }
}

/// A foot on a mesh, with the normal that `normal` gives there.
fn on_triangle(foot: &MeshFoot, normal: impl Fn(&MeshFoot) -> Direction) -> Foot {
    Foot {
        point: foot.point,
        normal: OutwardNormal(normal(foot)),
        signed_distance: foot.signed_distance,
        past_edge: foot.past_edge,
        place: SurfacePlace::Face { index: foot.face, barycentric: foot.barycentric },
    }
}
