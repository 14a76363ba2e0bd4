//! STL, binary and ASCII. The normals in the file are not used: the turn of the corners says which side is out.

use super::{DesignSurface, Facets, ReadOptions};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::Point;
use std::io::{Cursor, Read, Seek, SeekFrom};

const HEADER: usize = 80;
const TRIANGLE: usize = 50;

/// Reads the bytes of an STL file; all solids of a text file become one mesh.
pub(super) fn read(bytes: &[u8], options: &ReadOptions) -> Result<DesignSurface> {
    let text = is_text(bytes);
    let corners = if text { text_corners(bytes)? } else { binary_corners(bytes)? };
    let triangles: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let line_of = |triangle: usize| if text { line_of_facet(bytes, triangle) } else { None };
    Facets { corners, triangles, normals: None, line_of: &line_of }.surface(options)
}

/// The line on which a facet of a text file begins, from 1.
fn line_of_facet(bytes: &[u8], facet: usize) -> Option<usize> {
    let begins = |line: &[u8]| line.trim_ascii_start().get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"facet"));
    let lines = bytes.split(|b| *b == b'\n').enumerate();
    lines.filter(|(_, line)| begins(line)).nth(facet).map(|(index, _)| index + 1)
}

/// Begins with "solid" and holds no zero byte; binary files that begin so have one in their count or numbers.
fn is_text(bytes: &[u8]) -> bool {
    let start = bytes.trim_ascii_start();
    start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !bytes.contains(&0)
}

fn binary_corners(bytes: &[u8]) -> Result<Vec<Point>> {
    check_length(bytes)?;
    // A header that begins with "solid" must not make the reader take the rest for text.
    let mut plain = bytes.to_vec();
    plain[..HEADER].fill(0);
    let mut corners = Vec::new();
    collect(&mut Cursor::new(plain), &mut corners).map_err(|error| unreadable(&error))?;
    Ok(corners)
}

fn text_corners(bytes: &[u8]) -> Result<Vec<Point>> {
    let lower = bytes.to_ascii_lowercase();
    let mut corners = Vec::new();
    let (mut rest, mut line) = (lower.as_slice(), 1);
    loop {
        let start = rest.trim_ascii_start();
        line += newlines(&rest[..rest.len() - start.len()]);
        if start.is_empty() {
            return Ok(corners);
        }
        // The first line holds the name only; the reader wants a blank after the word.
        let end_of_name = start.iter().position(|b| *b == b'\n').unwrap_or(start.len());
        let name = if start.starts_with(b"solid") { b"solid ".as_slice() } else { &start[..end_of_name] };
        let solid = [name, &start[end_of_name..]].concat();
        let mut source = LineByLine { cursor: Cursor::new(&solid) };
        let outcome = collect(&mut source, &mut corners);
        let read = usize::try_from(source.cursor.position()).unwrap_or(usize::MAX).min(solid.len());
        let lines_read = newlines(&solid[..read]);
        if let Err(error) = outcome {
            let unfinished = usize::from(read == 0 || solid[read - 1] != b'\n');
            return Err(unreadable(&error).at(line + (lines_read + unfinished).saturating_sub(1), 1));
        }
        line += lines_read;
        rest = start.get(read + end_of_name - name.len()..).unwrap_or_default();
    }
}

fn collect(source: &mut (impl Read + Seek), corners: &mut Vec<Point>) -> std::io::Result<()> {
    for triangle in stl_io::create_stl_reader(source)? {
        corners.extend(triangle?.vertices.iter().map(|v| Point::from(v.0.map(f64::from))));
    }
    Ok(())
}

fn newlines(bytes: &[u8]) -> usize {
    bytes.iter().filter(|b| **b == b'\n').count()
}

fn unreadable(error: &std::io::Error) -> Box<Diagnostic> {
    Diagnostic::error(format!("the STL file cannot be read: {error}")).help(
        "each facet is: facet normal, outer loop, three vertex lines with three finite numbers, endloop, endfacet",
    )
}

/// Length that the count in a binary header announces.
fn binary_length(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER..HEADER + 4)?.try_into().ok().map(u32::from_le_bytes)?;
    (count as usize).checked_mul(TRIANGLE)?.checked_add(HEADER + 4)
}

fn check_length(bytes: &[u8]) -> Result<()> {
    match binary_length(bytes) {
        Some(length) if length <= bytes.len() => Ok(()),
        Some(length) => Err(Diagnostic::error(format!(
            "the binary STL file announces {} triangles ({length} bytes), but has only {} bytes",
            (length - HEADER - 4) / TRIANGLE,
            bytes.len()
        ))
        .help("the file is cut off, or no STL file; export it again")),
        None => Err(Diagnostic::error("the file is too short for an STL file").help("export it again")),
    }
}

/// Hands out text one line at a time, so that its reader has read no further than the line it complains about.
struct LineByLine<'a> {
    cursor: Cursor<&'a Vec<u8>>,
}

impl Read for LineByLine<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let start = usize::try_from(self.cursor.position()).unwrap_or(usize::MAX);
        let rest = self.cursor.get_ref().get(start..).unwrap_or_default();
        let end = rest.iter().position(|b| *b == b'\n').map_or(rest.len(), |i| i + 1);
        self.cursor.by_ref().take(end as u64).read(buffer)
    }
}

impl Seek for LineByLine<'_> {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.cursor.seek(to)
    }
}
