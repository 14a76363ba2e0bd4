//! Wavefront OBJ: vertices and faces of all groups together; polygons are cut into triangles from their first corner.
//! Normals at corners (vn) count where triangles are to be curved.

use super::{DesignSurface, Facets, ReadOptions, Triangles};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, Vector};
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
    let line_of = |triangle: usize| line_of_triangle(text, triangle);
    let curved = matches!(options.triangles, Triangles::Curved { .. }) && has_normals(text)?;
    let (mut corners, mut triangles, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    for model in &models {
        let first = corners.len() as u32;
        let (points, _) = model.mesh.positions.as_chunks::<3>();
        corners.extend(points.iter().map(|p| Point::from(*p)));
        let (faces, _) = model.mesh.indices.as_chunks::<3>();
        if curved {
            corner_normals(&model.mesh, &mut normals, &line_of)?;
        }
        triangles.extend(faces.iter().map(|t| t.map(|k| k + first)));
    }
    Facets { corners, triangles, normals: curved.then_some(normals), line_of: &line_of }.surface(options)
}

/// The faces of a text: number of each line, from 1, and what it names for each corner.
fn faces(text: &str) -> impl Iterator<Item = (usize, impl Iterator<Item = &str> + Clone)> {
    text.lines().enumerate().filter_map(|(index, line)| {
        let mut words = line.split_whitespace();
        (words.next() == Some("f")).then_some((index + 1, words))
    })
}

/// Whether the faces name normals; refuses faces that do beside faces that do not.
fn has_normals(text: &str) -> Result<bool> {
    let named = |corner: &str| corner.split('/').nth(2).is_some_and(|normal| !normal.is_empty());
    let mut corners = faces(text).flat_map(|(line, words)| words.map(move |word| (line, named(word))));
    let Some((_, first)) = corners.next() else { return Ok(false) };
    match corners.find(|(_, named)| *named != first) {
        None => Ok(first),
        Some((line, named)) => {
            let (this, other) = if named { ("names", "does not") } else { ("does not name", "does") };
            Err(Diagnostic::error(format!("this face {this} a normal at every corner, the first one {other}"))
                .at(line, 1)
                .help("write f v//vn v//vn v//vn for every face, or for none"))
        }
    }
}

/// Normals at the corners of each triangle, after the others.
fn corner_normals(
    mesh: &tobj::Mesh,
    normals: &mut Vec<[Direction; 3]>,
    line_of: &impl Fn(usize) -> Option<usize>,
) -> Result<()> {
    let (given, _) = mesh.normals.as_chunks::<3>();
    let (triangles, _) = mesh.normal_indices.as_chunks::<3>();
    for corners in triangles {
        let found = corners.map(|index| {
            let normal = given.get(index as usize).map(|n| Vector::from(*n))?;
            Direction::try_new(normal, 1e-9).filter(|n| n.iter().all(|x| x.is_finite()))
        });
        let [Some(a), Some(b), Some(c)] = found else {
            let triangle = normals.len();
            let message = format!("a normal at a corner of triangle {triangle} is missing or has no direction");
            return Err(Diagnostic::error(message)
                .at(line_of(triangle).unwrap_or(1), 1)
                .help("write vn lines of three finite numbers, not all zero, or leave the normals out of all faces"));
        };
        normals.push([a, b, c]);
    }
    Ok(())
}

/// The line of the face that a triangle is cut from.
fn line_of_triangle(text: &str, triangle: usize) -> Option<usize> {
    let mut count = 0;
    faces(text).find_map(|(line, corners)| {
        count += corners.count().saturating_sub(2);
        (count > triangle).then_some(line)
    })
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
