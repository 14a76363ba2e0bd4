//! The kinematic chain of a machine from its file, forward and inverse, branch choice, limits, blocks between poses.
//! Uses `diagnostic`, `geometry`, `part`, `tool`, `motion` and `collide`.

pub mod axes;
mod bodies;
mod builtin;
mod careful;
pub mod check;
pub mod control;
mod course;
#[cfg(test)]
mod course_tests;
mod file;
mod file_bodies;
mod file_reader;
mod file_rotary;
#[cfg(test)]
mod file_tests;
mod layer;
mod legs;
mod limits;
pub mod linearize;
mod links;
pub mod model;
#[cfg(test)]
pub(crate) mod path_tests;
mod place;
pub mod reach;
mod rewind;
#[cfg(test)]
mod rewind_tests;
mod rotaries;
mod scene;
pub mod schema;
pub mod setup;
mod stations;
mod templates;
#[cfg(test)]
mod tests;
mod track;
mod words;

pub use axes::{AxisMove, AxisPosition, ProgramWords, round_to};
pub use bodies::{Body, Form, Link, NEAR_MISS};
pub use builtin::{BUILTIN, builtin};
pub use check::{CheckReport, check};
pub use control::{
    Control, Dialect, DialectOptions, FeedMode, InverseTimeUnit, LengthUnit, OrientationWords, PointRule, Rollover,
    ShortestWay, TcpInterpolation, WorkOffset,
};
pub use file_bodies::RawBody;
pub use linearize::{LinearizeOptions, Linearized, axis_positions, linearize};
pub use links::{AxisCourse, AxisRates, LinearRates};
pub use model::{AxisZero, Carrier, LinearAxis, Machine, RotaryAxis, RotaryMotion, Sense, Spindle, Tolerances, Travel};
pub use reach::{ReachMap, Ways, beyond};
pub use scene::{Encounter, Hints, PART, Scene};
pub use schema::schema;
pub use setup::{Interpolation, InverseSolutions, Segment, Setup, Unreachable, unwind};
pub use templates::{FIELDS as TEMPLATE_FIELDS, Template, Templates, environment as template_environment};
pub use track::Choice;
