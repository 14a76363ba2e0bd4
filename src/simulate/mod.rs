//! Program and machine to continuous tool motion in the part frame. May use: geometry, motion, machine, nc (reading half).
