//! What a moving tool sweeps: characteristic, deviation, kink, and their derivatives. May use: geometry, part, tool, motion.
