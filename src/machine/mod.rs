//! The kinematic chain of a machine from its file, forward and inverse, branch choice, limits, blocks between poses.
//! Uses `diagnostic`, `geometry` and `motion`.

pub mod axes;
mod builtin;
pub mod control;
mod file;
pub mod linearize;
pub mod model;
#[cfg(test)]
mod path_tests;
pub mod rotaries;
pub mod setup;
mod stations;
#[cfg(test)]
mod tests;
mod track;
mod words;

pub use axes::{AxisMove, AxisPosition, ProgramWords, round_to};
pub use builtin::{BUILTIN, builtin};
pub use control::{Control, Dialect, DialectOptions, FeedMode, TcpInterpolation, WorkOffset};
pub use linearize::{LinearizeOptions, Linearized, linearize};
pub use model::{AxisZero, Carrier, LinearAxis, Machine, RotaryAxis, Sense, Spindle, Travel};
pub use rotaries::Unreachable;
pub use setup::{Interpolation, InverseSolutions, Segment, Setup};
