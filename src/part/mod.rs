//! The design surface and how to read it. May use: diagnostic, geometry.
