//! Clearance of flutes, shank and holder from part and check surfaces, and distances of rigid bodies, continuous in time;
//! the only user of the collision library, for its bounding volume hierarchy and its distances of convex bodies. May use: geometry, part, tool, motion.
//!
//! The tool is a union of convex solids of revolution. The signed distance from a convex solid is a convex function of
//! the point, so its value and gradient at one point bound it from below on a whole box or triangle, and a support
//! plane bounds how a motion can change it ([`Sweep`]). Branching over triangles and time with these bounds gives the
//! smallest clearance with a guarantee: no pose is sampled and then trusted for its neighbours.
//!
//! What is followed is contact with surfaces; what crosses none during a motion is inside a closed body all the time or
//! never, which one instant tells. Open surfaces are skins without an inside.

mod clearance;
mod convex;
mod obstacle;
mod rigid;
mod solid;
mod sweep;

pub use clearance::{Approach, Clearance, Move};
pub use obstacle::{Obstacle, ObstacleError, Role};
pub use rigid::{Nearing, Rigid, RigidSweep, nearing};
pub use solid::ToolSolid;
pub use sweep::{Leg, Sweep};

#[cfg(test)]
mod tests;
