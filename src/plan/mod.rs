//! Strategies that choose the tool path: single sweep and multi-strip. May use: geometry, part, tool, motion, envelope, optimize.
