//! CL files: the tool path as JSON text and back.
