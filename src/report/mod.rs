//! JSON and one self-contained HTML page with a 3D view and plots. May use: everything above it.
