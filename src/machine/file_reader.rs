//! Checks that every part of a machine file needs: complaints with their place, numbers, directions. Uses `diagnostic` and
//! `geometry`.

use crate::diagnostic::{Result, TomlText};
use crate::geometry::{Direction, Point, Vector};
use nalgebra::Rotation3;

/// Longest travel or pivot distance that is taken seriously, mm.
pub(super) const LONGEST: f64 = 1e5;
/// Largest measured error of an axis' direction, degrees about one of the machine's axes.
const LARGEST_ERROR: f64 = 5.0;

/// Turns raw tables into checked values, blaming by path.
pub(super) struct Reader<'a> {
    pub(super) text: &'a TomlText,
}

impl<'a> Reader<'a> {
    /// Reads a file's text.
    pub(super) fn new(text: &'a TomlText) -> Self {
        Self { text }
    }

    pub(super) fn bad<T>(&self, path: &str, message: impl Into<String>, help: impl Into<String>) -> Result<T> {
        Err(self.text.blame(path, message).help(help))
    }

    pub(super) fn limits(&self, path: &str, [min, max]: [f64; 2], most: f64, unit: &str) -> Result<[f64; 2]> {
        let path = format!("{path}.limits");
        if min >= max {
            return self.bad(
                &path,
                format!("lower limit {min} {unit} is not below upper limit {max} {unit}"),
                "write [lower, upper]",
            );
        }
        if min.abs() > most || max.abs() > most {
            let message = format!("limits [{min}, {max}] {unit} are beyond {most} {unit}, which no machine has");
            return self.bad(&path, message, format!("write limits in {unit}; an endless axis is \"unlimited\""));
        }
        Ok([min, max])
    }

    pub(super) fn positive(&self, path: &str, value: f64, unit: &str) -> Result<f64> {
        if value > 0.0 && value < 1e12 {
            return Ok(value);
        }
        self.bad(path, format!("{value} {unit} is not a positive rate"), format!("write a number above zero, {unit}"))
    }

    /// A jerk limit, which may be left out.
    pub(super) fn jerk(&self, path: &str, value: Option<f64>, unit: &str) -> Result<Option<f64>> {
        value.map(|jerk| self.positive(&format!("{path}.jerk"), jerk, unit)).transpose()
    }

    pub(super) fn direction(&self, path: &str, [x, y, z]: [f64; 3]) -> Result<Direction> {
        match Direction::try_new(Vector::new(x, y, z), 1e-6) {
            Some(direction) => Ok(direction),
            None => self.bad(
                path,
                format!("direction [{x}, {y}, {z}] has no length"),
                "write a vector along the axis, such as [0, 0, 1]",
            ),
        }
    }

    /// A direction turned by a measured error, degrees about the machine's X, Y and Z.
    pub(super) fn measured(&self, path: &str, nominal: Direction, rotation: Option<[f64; 3]>) -> Result<Direction> {
        let Some(degrees) = rotation else { return Ok(nominal) };
        if let Some(large) = degrees.iter().find(|angle| angle.abs() > LARGEST_ERROR) {
            return self.bad(
                &format!("{path}.rotation"),
                format!("{large} degrees is more than an error of alignment"),
                format!("write at most {LARGEST_ERROR} degrees, or give the axis another direction"),
            );
        }
        Ok(Rotation3::new(Vector::from(degrees.map(f64::to_radians))) * nominal)
    }

    pub(super) fn point(&self, path: &str, value: [f64; 3]) -> Result<Point> {
        match value.iter().find(|v| v.abs() > LONGEST) {
            None => Ok(Point::from(value)),
            Some(far) => self.bad(path, format!("{far} mm is beyond {LONGEST} mm, which no machine has"), "write mm"),
        }
    }
}
