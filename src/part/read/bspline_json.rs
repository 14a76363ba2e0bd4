//! The regulus-bspline JSON format: degrees, knots, control points and optional weights of one surface.

use super::json_place::{self, Step};
use super::{DesignSurface, ReadOptions, Units, oriented};
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{KnotError, Point, SplineSurface, SurfaceError};
use serde::Deserialize;

/// What tells a file of this format from other JSON.
#[derive(Deserialize)]
struct Head {
    format: Option<serde_json::Value>,
    version: Option<serde_json::Value>,
}

#[derive(Deserialize)]
struct Raw {
    units: Option<String>,
    degree: [usize; 2],
    knots_u: Vec<f64>,
    knots_v: Vec<f64>,
    #[serde(default)]
    flip: bool,
    control: Vec<Vec<[f64; 3]>>,
    weights: Option<Vec<Vec<f64>>>,
}

/// Reads the text of a regulus-bspline file; keys it does not know are passed over.
pub(super) fn read(text: &str, options: &ReadOptions) -> Result<DesignSurface> {
    let head: Head = parse(text)?;
    check_head(text, &head)?;
    let raw: Raw = parse(text)?;
    let units = units(text, raw.units.as_deref(), options)?;
    let flip = raw.flip != options.flip;
    let place = |p: &[f64; 3]| options.placement * (Point::from(*p) * units.in_mm());
    let control = raw.control.iter().map(|row| row.iter().map(place).collect()).collect();
    let surface = SplineSurface::new(raw.degree, [raw.knots_u, raw.knots_v], control, raw.weights)
        .map_err(|error| located(text, &error))?;
    oriented(surface, flip)
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T> {
    serde_json::from_str(text).map_err(|error| {
        let full = error.to_string();
        // The message repeats the place, which the diagnostic shows itself.
        let message = full.rsplit_once(" at line ").map_or(full.as_str(), |(message, _)| message);
        Diagnostic::error(format!("the file cannot be read as regulus-bspline: {message}"))
            .at_offset(text, byte_offset(text, error.line(), error.column()))
            .help("write {\"format\":\"regulus-bspline\",\"version\":1,\"units\":\"mm\",\"degree\":[p,q],\"knots_u\":[…],\"knots_v\":[…],\"flip\":false,\"control\":[[[x,y,z],…],…]} with plain finite numbers")
    })
}

/// serde_json counts lines and columns from 1, columns in bytes; 0 means before the first.
fn byte_offset(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    start + column.saturating_sub(1)
}

fn check_head(text: &str, head: &Head) -> Result<()> {
    let at = |key| json_place::offset(text, &[Step::Key(key)]);
    if head.format.as_ref().and_then(|f| f.as_str()) != Some("regulus-bspline") {
        return Err(Diagnostic::error("this JSON file does not say that it is a regulus-bspline surface")
            .at_offset(text, at("format"))
            .help("write \"format\": \"regulus-bspline\""));
    }
    if head.version.as_ref().and_then(serde_json::Value::as_u64) != Some(1) {
        return Err(Diagnostic::error("the version of the regulus-bspline format is not 1, the only one known")
            .at_offset(text, at("version"))
            .help("write \"version\": 1"));
    }
    Ok(())
}

fn units(text: &str, given: Option<&str>, options: &ReadOptions) -> Result<Units> {
    match given {
        None => Ok(options.units.unwrap_or_default()),
        Some("mm") => Ok(Units::Millimetres),
        Some("inch") => Ok(Units::Inches),
        Some(other) => Err(Diagnostic::error(format!("units \"{other}\" are not known"))
            .at_offset(text, json_place::offset(text, &[Step::Key("units")]))
            .help("write \"mm\" or \"inch\"")),
    }
}

/// Names the place of a refused value in the file.
fn located(text: &str, error: &SurfaceError) -> Box<Diagnostic> {
    use Step::{Index, Key};
    let knots = |key: &'static str, side: usize, error: &KnotError| match error {
        KnotError::Degree(_) => (vec![Key("degree"), Index(side)], "give a degree from 1 to 9"),
        KnotError::Count { .. } => (vec![Key(key)], "give as many knots as control points + degree + 1"),
        KnotError::TooFew { .. } => (vec![Key("control")], "give more control points than the degree"),
        KnotError::Order { index, .. } => (vec![Key(key), Index(*index)], "knots must be finite and never fall"),
        KnotError::Multiplicity { .. } => (vec![Key(key)], "repeat an inner knot at most degree times"),
    };
    let (path, help) = match error {
        SurfaceError::KnotsU(error) => knots("knots_u", 0, error),
        SurfaceError::KnotsV(error) => knots("knots_v", 1, error),
        SurfaceError::Ragged { row, .. } => {
            (vec![Key("control"), Index(*row)], "all rows must have the same number of points")
        }
        SurfaceError::NotFinite { row, column } => {
            (vec![Key("control"), Index(*row), Index(*column)], "write finite numbers")
        }
        SurfaceError::WeightCount { row } => {
            (vec![Key("weights"), Index(*row)], "give one weight a control point, in the same rows")
        }
        SurfaceError::Weight { row, column, .. } => {
            (vec![Key("weights"), Index(*row), Index(*column)], "write a number greater than 0")
        }
    };
    Diagnostic::error(error.to_string()).at_offset(text, json_place::offset(text, &path)).help(help)
}
