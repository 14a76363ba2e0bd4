//! A bicubic spline fitted to a mesh, for planning.

use super::oriented_spline::OrientedSpline;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::TriangleMesh;

/// The fitted spline and its largest measured distance from the mesh, mm.
pub(super) fn spline_of_mesh(_mesh: &TriangleMesh) -> Result<(OrientedSpline, f64)> {
    Err(Diagnostic::error("a mesh cannot be planned on yet"))
}
