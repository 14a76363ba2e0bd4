//! Where a closed body is required.

use crate::diagnostic::{Diagnostic, Result};
use crate::part::DesignSurface;

/// Refuses a surface that is not the whole boundary of a body with the normals outward: an open mesh, a mesh turned
/// inside out, a spline patch. Returns nothing else; the surface stays as it is.
pub fn require_closed(surface: &DesignSurface) -> Result<()> {
    let Some(mesh) = surface.mesh() else {
        return Err(Diagnostic::error("a spline patch is given where a closed body is required")
            .help("give a closed triangle mesh (.stl or .obj) with its triangles outward"));
    };
    if !mesh.topology().is_closed() {
        let loops = mesh.topology().boundary_loops();
        let at = loops.first().and_then(|l| l.first()).map(|v| mesh.vertices()[*v as usize]).unwrap_or_default();
        let message = format!(
            "the mesh is open where a closed body is required: it has {} boundary {}, one through ({:.4}, {:.4}, {:.4})",
            loops.len(),
            if loops.len() == 1 { "loop" } else { "loops" },
            at.x,
            at.y,
            at.z
        );
        return Err(Diagnostic::error(message)
            .help("close its holes in a mesh editor; where edges only seem to meet, merge close vertices"));
    }
    if mesh.signed_volume() < 0.0 {
        return Err(Diagnostic::error(format!(
            "the triangles of the closed mesh point inward (its volume counts as {:.4} mm³)",
            mesh.signed_volume()
        ))
        .help("invert its faces in a mesh editor"));
    }
    Ok(())
}
