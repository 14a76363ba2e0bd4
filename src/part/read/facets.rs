//! The triangles of a mesh file on their way to a surface: joined, scaled, placed, oriented, and curved where that is asked
//! for. May use: diagnostic, geometry and the part's own types.

use super::{DesignSurface, ReadOptions, Triangles};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{CurvedMesh, Direction, MeshError, Point, TriangleMesh};

/// What a mesh file holds.
pub(super) struct Facets<'a> {
    /// Corners, in the file's unit and frame.
    pub(super) corners: Vec<Point>,
    /// Three corners each.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Normals at the corners of each triangle, in the file's frame, where the file has them.
    pub(super) normals: Option<Vec<[Direction; 3]>>,
    /// The line of the file that gives a triangle, from 1.
    pub(super) line_of: &'a dyn Fn(usize) -> Option<usize>,
}

impl Facets<'_> {
    /// The surface; corners with the same coordinates become one.
    pub(super) fn surface(self, options: &ReadOptions) -> Result<DesignSurface> {
        let (vertices, mut triangles) = welded(&self.corners, &self.triangles);
        let mut normals = self.normals;
        if options.flip {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
            normals.iter_mut().flatten().for_each(|[a, b, c]| (*a, *b, *c) = (-*a, -*c, -*b));
        }
        let scale = options.units.unwrap_or_default().in_mm();
        let vertices = vertices.iter().map(|p| options.placement * (p * scale)).collect();
        let mesh = TriangleMesh::new(vertices, triangles)
            .map_err(|error| located(refused(&error), error.triangle().and_then(self.line_of)))?;
        let Triangles::Curved { crease } = options.triangles else { return Ok(DesignSurface::Mesh(mesh)) };
        let given = normals.is_some();
        let curved = match normals {
            Some(mut normals) => {
                normals.iter_mut().flatten().for_each(|n| *n = options.placement * *n);
                CurvedMesh::with_normals(mesh, &normals)
            }
            None => CurvedMesh::with_creases(mesh, crease),
        };
        curved.map(DesignSurface::Curved).map_err(|error| {
            let help = if given {
                "let a mesh editor reorient all faces and compute the normals (vn) again, or leave them out of the file, \
                 or write triangles = \"flat\" under [part]"
            } else {
                "write a smaller crease_deg under [part], so that the edges there stay sharp, give a finer mesh, or write \
                 triangles = \"flat\""
            };
            located(Diagnostic::error(error.to_string()).help(help), (self.line_of)(error.triangle()))
        })
    }
}

fn located(finding: Box<Diagnostic>, line: Option<usize>) -> Box<Diagnostic> {
    match line {
        Some(line) => finding.at(line, 1),
        None => finding,
    }
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
