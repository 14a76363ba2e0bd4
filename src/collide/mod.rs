//! Clearance of shank, holder and tool against part and check surfaces; the only user of the collision library. May use: geometry, part, tool, motion.
