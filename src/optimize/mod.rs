//! Sparse least squares, knowing nothing of tools. May use: diagnostic, geometry.
