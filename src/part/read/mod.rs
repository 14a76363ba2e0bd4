//! Readers: bytes of a file in, design surface out.

use super::DesignSurface;
use crate::diagnostic::{Diagnostic, Result};
use crate::geometry::RigidMotion;

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

/// Reads a design surface; the extension of `file_name` says in which format (.json, .csv, .stl, .obj).
pub fn read(bytes: &[u8], file_name: &str, options: &ReadOptions) -> Result<DesignSurface> {
    let _ = (bytes, options);
    Err(Diagnostic::error("no reader for this kind of file").in_file(file_name))
}
