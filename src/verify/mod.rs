//! The swept tool against the part, axis limits, round trip, and the verdict. May use: geometry, part, tool, motion, collide, machine, nc (reading half), simulate.
