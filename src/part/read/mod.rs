//! Readers: bytes of a file in, design surface out. May use: diagnostic, geometry and the part's own types.

mod bspline_json;
mod facets;
mod grid_csv;
mod json_place;
mod obj;
mod solid;
mod stl;

use super::{DesignSurface, OrientedSpline};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Radians, RigidMotion, SplineSurface};
use facets::Facets;
pub use solid::require_closed;

/// Unit of length in a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Units {
    /// Millimetres.
    #[default]
    Millimetres,
    /// Inches of 25.4 mm.
    Inches,
}

impl Units {
    /// Millimetres in one unit.
    pub fn in_mm(self) -> f64 {
        match self {
            Self::Millimetres => 1.0,
            Self::Inches => 25.4,
        }
    }
}

/// What lies between the corners of a mesh's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Triangles {
    /// The flat triangles themselves: the file is taken at its word.
    #[default]
    Flat,
    /// Patches square to the normals at the corners: those of the file where it has any, else found from the mesh.
    Curved {
        /// Edges whose triangles' normals are farther apart than this stay sharp, where the file has no normals.
        crease: Radians,
    },
}

/// What the job says about a part file.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Unit of files that name none; millimetres when left out.
    pub units: Option<Units>,
    /// Turns the normals, after the file's own flip.
    pub flip: bool,
    /// Part file to part frame, mm.
    pub placement: RigidMotion,
    /// How mesh files are read.
    pub triangles: Triangles,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { units: None, flip: false, placement: RigidMotion::identity(), triangles: Triangles::Flat }
    }
}

/// Reads a design surface; the extension of `file_name` says in which format: `.json` (regulus-bspline), `.csv` (grid of
/// points), `.stl`, `.obj`.
///
/// Errors name the file, and line and column where the format has them.
pub fn read(bytes: &[u8], file_name: &str, options: &ReadOptions) -> Result<DesignSurface> {
    let extension = file_name.rsplit(['/', '\\']).next().and_then(|name| name.rsplit_once('.')).map(|(_, e)| e);
    let surface = match extension.map(str::to_ascii_lowercase).as_deref() {
        Some("json") => text(bytes).and_then(|text| bspline_json::read(text, options)),
        Some("csv") => text(bytes).and_then(|text| grid_csv::read(text, options)),
        Some("stl") => stl::read(bytes, options),
        Some("obj") => text(bytes).and_then(|text| obj::read(text, options)),
        Some(other) => Err(unknown(&format!("\".{other}\" is not a kind of part file that can be read"))),
        None => Err(unknown("the file name has no extension to tell its kind")),
    };
    surface.map_err(|error| error.in_file(file_name))
}

fn unknown(message: &str) -> Box<Diagnostic> {
    Diagnostic::error(message).help("give a .json (regulus-bspline), .csv (grid of points), .stl or .obj file")
}

fn text(bytes: &[u8]) -> Result<&str> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let good = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
        Diagnostic::error("the file is not text in UTF-8").at_offset(&good, good.len()).help("save it as UTF-8")
    })
}

/// Orients a spline and refuses poles and folds.
fn oriented(surface: SplineSurface, flip: bool) -> Result<DesignSurface> {
    OrientedSpline::new(surface, flip).map(DesignSurface::Spline).map_err(|error| {
        Diagnostic::error(error.to_string())
            .help("trim or refit the surface so that it has four sides and a normal everywhere")
    })
}

#[cfg(test)]
mod tests;
