//! Closed forms for the swept tool: each is independent of the method under test.

mod bound;
mod closed_forms;
pub(super) mod fixtures;
mod program;
mod region;
mod search;
