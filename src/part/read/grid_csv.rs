//! Grids of points as CSV: a header line, then i, j, x, y, z by position; i along u, j along v, both from 0. The surface
//! is the bicubic through all points.

use super::{DesignSurface, ReadOptions, oriented};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{GridError, Point, interpolate_grid};
use std::collections::BTreeMap;

const LAYOUT: &str = "write a header line, then one line a point: i,j,x,y,z with i and j counted from 0";

/// One line of the file: where it starts in the text, and its fields with their places.
struct Line<'a> {
    text: &'a str,
    offset: usize,
}

impl<'a> Line<'a> {
    fn fields(&self) -> impl Iterator<Item = (usize, &'a str)> {
        let mut offset = self.offset;
        self.text.split(',').map(move |field| {
            let start = offset + field.len() - field.trim_start().len();
            offset += field.len() + 1;
            (start, field.trim())
        })
    }
}

/// Reads the text of a grid file.
pub(super) fn read(text: &str, options: &ReadOptions) -> Result<DesignSurface> {
    let mut lines = lines(text);
    check_header(text, lines.next())?;
    let scale = options.units.unwrap_or_default().in_mm();
    let mut points: BTreeMap<(usize, usize), (Point, usize)> = BTreeMap::new();
    for line in lines {
        let (place, point) = entry(text, &line)?;
        if let Some((_, first)) = points.insert(place, (options.placement * (point * scale), line.offset)) {
            let before = text[..first].bytes().filter(|b| *b == b'\n').count() + 1;
            return Err(Diagnostic::error(format!("point i={}, j={} is given twice", place.0, place.1))
                .at_offset(text, line.offset)
                .help(format!("keep one of them; the first is on line {before}")));
        }
    }
    let rows = complete(&points)?;
    let surface = interpolate_grid(&rows).map_err(|error| grid_error(text, &points, &error))?;
    oriented(surface, options.flip)
}

/// Lines that hold anything.
fn lines(text: &str) -> impl Iterator<Item = Line<'_>> {
    let mut offset = 0;
    text.split_inclusive('\n')
        .map(move |text| {
            let line = Line { text: text.trim_end(), offset };
            offset += text.len();
            line
        })
        .filter(|line| !line.text.trim().is_empty())
}

fn check_header(text: &str, header: Option<Line>) -> Result<()> {
    let Some(header) = header else {
        return Err(Diagnostic::error("the file is empty").help(LAYOUT));
    };
    match header.fields().next() {
        Some((offset, first)) if first.parse::<f64>().is_ok() => {
            Err(Diagnostic::error("the first line holds a point; it must be a header, or the point would be lost")
                .at_offset(text, offset)
                .help(LAYOUT))
        }
        _ => Ok(()),
    }
}

fn entry(text: &str, line: &Line) -> Result<((usize, usize), Point)> {
    let fields: Vec<(usize, &str)> = line.fields().collect();
    let [i, j, x, y, z] = fields.as_slice() else {
        return Err(Diagnostic::error(format!("{} values where 5 are needed", fields.len()))
            .at_offset(text, line.offset)
            .help(LAYOUT));
    };
    let index = |name: &str, (offset, field): (usize, &str)| {
        field.parse::<usize>().map_err(|_| {
            Diagnostic::error(format!("{name} is \"{field}\", which is not a whole number from 0"))
                .at_offset(text, offset)
                .help(LAYOUT)
        })
    };
    let number = |name: &str, (offset, field): (usize, &str)| {
        let problem = match field.parse::<f64>() {
            Ok(value) if value.is_finite() => return Ok(value),
            Ok(_) => "which is not finite",
            Err(_) => "which is not a number",
        };
        Err(Diagnostic::error(format!("{name} is \"{field}\", {problem}"))
            .at_offset(text, offset)
            .help("write a plain finite number, with a point as decimal mark"))
    };
    Ok(((index("i", *i)?, index("j", *j)?), Point::new(number("x", *x)?, number("y", *y)?, number("z", *z)?)))
}

/// The points as full rows; refuses a grid with a hole.
fn complete(points: &BTreeMap<(usize, usize), (Point, usize)>) -> Result<Vec<Vec<Point>>> {
    let columns = points.keys().map(|(_, j)| j + 1).max().unwrap_or(0);
    let mut rows: Vec<Vec<Point>> = Vec::new();
    for ((i, j), (point, _)) in points {
        // In order of (i, j), the next must be where the last row goes on, or the start of a new row.
        let next = match rows.last() {
            Some(row) if row.len() < columns => (rows.len() - 1, row.len()),
            _ => (rows.len(), 0),
        };
        if (*i, *j) != next {
            return Err(missing(next, columns));
        }
        match rows.last_mut() {
            Some(row) if row.len() < columns => row.push(*point),
            _ => rows.push(vec![*point]),
        }
    }
    match rows.last() {
        Some(row) if row.len() < columns => Err(missing((rows.len() - 1, row.len()), columns)),
        Some(_) => Ok(rows),
        None => Err(Diagnostic::error("the file holds no points").help(LAYOUT)),
    }
}

fn missing((i, j): (usize, usize), columns: usize) -> Box<Diagnostic> {
    Diagnostic::error(format!("point i={i}, j={j} is missing")).help(format!(
        "give every row all of its points, j from 0 to {}, and every i from 0",
        columns.saturating_sub(1)
    ))
}

fn grid_error(text: &str, points: &BTreeMap<(usize, usize), (Point, usize)>, error: &GridError) -> Box<Diagnostic> {
    let diagnostic = Diagnostic::error(error.to_string());
    match error {
        GridError::Coincident { along_u, index } => {
            let place = if *along_u { (*index, 0) } else { (0, *index) };
            let offset = points.get(&place).map_or(0, |(_, offset)| *offset);
            diagnostic.at_offset(text, offset).help("leave one of them out and count on without a gap")
        }
        GridError::TooSmall { .. } | GridError::Surface(_) => diagnostic.help(LAYOUT),
    }
}
