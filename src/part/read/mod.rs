//! Readers: bytes of a file in, design surface out. May use: diagnostic, geometry and the part's own types.

mod bspline_json;
mod grid_csv;
mod json_place;
mod obj;
mod solid;
mod stl;

use super::{DesignSurface, OrientedSpline};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{MeshError, Point, RigidMotion, SplineSurface, TriangleMesh};
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

/// What the job says about a part file.
#[derive(Clone, Copy, Debug)]
pub struct ReadOptions {
    /// Unit of files that name none; millimetres when left out.
    pub units: Option<Units>,
    /// Turns the normals, after the file's own flip.
    pub flip: bool,
    /// Part file to part frame, mm.
    pub placement: RigidMotion,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { units: None, flip: false, placement: RigidMotion::identity() }
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

/// Scales, places and orients the triangles of a mesh file, joining corners with the same coordinates.
fn mesh(corners: &[Point], triangles: &[[u32; 3]], options: &ReadOptions) -> Result<DesignSurface> {
    let (vertices, mut triangles) = welded(corners, triangles);
    if options.flip {
        triangles.iter_mut().for_each(|t| t.swap(1, 2));
    }
    let scale = options.units.unwrap_or_default().in_mm();
    let vertices = vertices.iter().map(|p| options.placement * (p * scale)).collect();
    TriangleMesh::new(vertices, triangles).map(DesignSurface::Mesh).map_err(|error| refused(&error))
}

fn welded(corners: &[Point], triangles: &[[u32; 3]]) -> (Vec<Point>, Vec<[u32; 3]>) {
    // Looked up only, never walked through: its order does not matter.
    let mut known = std::collections::HashMap::with_capacity(corners.len());
    let mut vertices = Vec::new();
    let numbers: Vec<u32> = corners
        .iter()
        .map(|p| {
            // Adding zero makes -0 and 0 the same.
            let key = [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits());
            *known.entry(key).or_insert_with(|| {
                vertices.push(*p);
                vertices.len() as u32 - 1
            })
        })
        .collect();
    let triangles =
        triangles.iter().map(|t| t.map(|corner| numbers.get(corner as usize).copied().unwrap_or(u32::MAX))).collect();
    (vertices, triangles)
}

fn refused(error: &MeshError) -> Box<Diagnostic> {
    let help = match error {
        MeshError::Empty => "export the surface again; the file holds no triangle",
        MeshError::Index { .. } => "the file is damaged; export it again",
        MeshError::NotFinite { .. } => "export the surface again; every coordinate must be a finite number",
        MeshError::Degenerate { .. } => {
            "remove triangles without area in a mesh editor (merge close vertices, delete degenerate faces)"
        }
        MeshError::NonManifold { .. } => {
            "give one surface a file: delete inner walls and doubled triangles in a mesh editor"
        }
        MeshError::Orientation { .. } => {
            "let a mesh editor reorient all faces coherently, outward (in MeshLab: Re-Orient all faces coherently)"
        }
        MeshError::Folded { .. } => "delete the doubled or folded triangles there in a mesh editor",
    };
    Diagnostic::error(error.to_string()).help(help)
}

#[cfg(test)]
mod tests;
