//! Wavefront OBJ: vertices and faces of all groups together; polygons are cut into triangles from their first corner.

use super::{DesignSurface, ReadOptions, mesh};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;
use std::io::{BufRead, Read};

/// Reads the text of an OBJ file.
pub(super) fn read(text: &str, options: &ReadOptions) -> Result<DesignSurface> {
    let load = tobj::LoadOptions { single_index: false, triangulate: true, ignore_points: true, ignore_lines: true };
    let mut source = CountingLines { rest: text.as_bytes(), line: 0 };
    // Materials do not matter, so none is looked for.
    let models = match tobj::load_obj_buf(&mut source, &load, |_| Err(tobj::LoadError::OpenFileFailed)) {
        Ok((models, _)) => models,
        Err(error) => {
            return Err(Diagnostic::error(format!("the OBJ file cannot be read: {error}"))
                .at(source.line.max(1), 1)
                .help("vertices are \"v x y z\", faces \"f a b c\" with vertex numbers from 1"));
        }
    };
    let (mut corners, mut triangles) = (Vec::new(), Vec::new());
    for model in &models {
        let first = corners.len() as u32;
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        corners.extend(points.iter().map(|p| Point::from(*p)));
        let (faces, _) = model.mesh.indices.as_chunks::<3>();
        triangles.extend(faces.iter().map(|t| t.map(|k| k + first)));
    }
    mesh(&corners, &triangles, options)
}

/// Counts the lines that have been read.
struct CountingLines<'a> {
    rest: &'a [u8],
    line: usize,
}

impl Read for CountingLines<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.rest.read(buffer)?;
        self.line += buffer[..count].iter().filter(|b| **b == b'\n').count();
        Ok(count)
    }
}

impl BufRead for CountingLines<'_> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        Ok(self.rest)
    }

    fn consume(&mut self, count: usize) {
        let (read, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.line += read.iter().filter(|b| **b == b'\n').count();
        self.rest = rest;
    }
}
