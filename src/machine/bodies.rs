//! Rigid bodies of a machine and of a setup: what they move with, their form, and when a tool is too near. Uses
//! `diagnostic`, `geometry`, `part` and `collide`.

use crate::collide::Rigid;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::{Direction, Point, RigidMotion, TriangleMesh, Vector};
use crate::part::{DesignSurface, ReadOptions, read, require_closed};
use nalgebra::UnitQuaternion;

/// Nearness that is told where a body does not say, mm.
pub const NEAR_MISS: f64 = 2.0;

/// What a body moves with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Link {
    /// It stands still.
    Base,
    /// X, Y or Z, by its index.
    Linear(usize),
    /// A rotary axis, by its index in the machine file.
    Rotary(usize),
    /// The last link on the part's side: fixtures and part stand on it.
    Table,
    /// The last link on the tool's side.
    Spindle,
}

/// The form of a body, mm.
#[derive(Clone, Debug, PartialEq)]
pub enum Form {
    /// A box along the axes, by two corners, each coordinate of the first below that of the second.
    Box {
        /// Least coordinates.
        low: Point,
        /// Greatest coordinates.
        high: Point,
    },
    /// A cylinder from the middle of one end along its axis.
    Cylinder {
        /// Middle of one end.
        base: Point,
        /// Way to the other.
        axis: Direction,
        /// Radius.
        radius: f64,
        /// Length.
        length: f64,
    },
    /// File of a closed mesh that has not been read yet.
    File(String),
    /// What a closed mesh bounds.
    Mesh(TriangleMesh),
}

/// A body. Those of a machine are given in the machine frame with every axis at zero, fixtures in the part frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Its name, for findings.
    pub name: String,
    /// What it moves with.
    pub link: Link,
    /// Its form.
    pub form: Form,
    /// Distance below which its nearness to another body is told, mm.
    pub near_miss: f64,
    /// File in which it is given.
    pub file: String,
    /// Line there, from 1.
    pub line: usize,
}

impl Body {
    /// The body with the content of its file, mm, named `name` in messages; the same where it needs none.
    ///
    /// # Errors
    /// A file that holds no closed mesh.
    pub fn with_file(self, name: &str, bytes: &[u8]) -> Result<Self> {
        if !matches!(self.form, Form::File(_)) {
            return Ok(self);
        }
        let surface = read(bytes, name, &ReadOptions::default())?;
        require_closed(&surface).map_err(|e| e.in_file(name))?;
        let DesignSurface::Mesh(mesh) = surface else {
            return Err(Diagnostic::error("a body is a closed mesh").in_file(name).help("give an .stl file"));
        };
        Ok(Self { form: Form::Mesh(mesh), ..self })
    }

    /// A complaint about it, at its place.
    pub fn blame(&self, message: impl Into<String>) -> Box<Diagnostic> {
        Diagnostic::error(message).in_file(&self.file).at(self.line, 1)
    }

    /// The body as `collide` takes it, shifted.
    pub(super) fn rigid(&self, shift: Vector) -> Result<Rigid> {
        match &self.form {
            Form::Box { low, high } => Ok(Rigid::cuboid(low + shift, high + shift)),
            Form::Cylinder { base, axis, radius, length } => {
                let rigid = Rigid::cylinder(base + shift, axis.into_inner(), *radius, *length);
                rigid.ok_or_else(|| self.blame(format!("{} has no length", self.name)).help("write a length above 0"))
            }
            Form::Mesh(mesh) => {
                Ok(Rigid::solid(mesh.transformed(&RigidMotion::from_parts(shift.into(), UnitQuaternion::identity()))))
            }
            Form::File(file) => {
                let message = format!("the file {file} of {} has not been read", self.name);
                Err(self.blame(message).help("read it before the machine is used"))
            }
        }
    }
}
